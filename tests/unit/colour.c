/*
 * sRGB: the curve, its round trips, and the fast quantizers against their definition.
 */
#include "math/colour.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/hash.h"

enum { SEED = 20240612, SAMPLES = 2000000 };

static int quantize8(double linear)
{
    uint8_t codes[3];
    colour_quantize8(&(struct vec3){linear, 0, 1}, 1, codes);
    assert_true(codes[1] == 0 && codes[2] == 255);
    return codes[0];
}

static int quantize16(double linear)
{
    uint16_t codes[3];
    colour_quantize16(&(struct vec3){0, linear, 1}, 1, codes);
    assert_true(codes[0] == 0 && codes[2] == 65535);
    return codes[1];
}

static int plain_quantize(double linear, double highest)
{
    return (int)floor(highest * colour_encode_srgb(linear) + 0.5);
}

static void check_quantizers(double linear)
{
    int expected8 = plain_quantize(linear, 255), expected16 = plain_quantize(linear, 65535);
    int code8 = quantize8(linear), code16 = quantize16(linear);
    if (code8 != expected8 || code16 != expected16)
        fail_msg("seed %d: %a quantizes to %d and %d, not to %d and %d", SEED, linear, code8, code16, expected8,
                 expected16);
}

/* Values of IEC 61966-2-1 computed with 40 digits. */
static void the_curve_is_that_of_the_standard(void **state)
{
    (void)state;
    static const double rows[][2] = {
        {0, 0},
        {0.001, 0.01292},
        {0.0031308, 0.040449936},
        {0.18, 0.46135612950044164986},
        {0.5, 0.73535698305244949062},
        {1, 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_true(fabs(colour_encode_srgb(rows[i][0]) - rows[i][1]) <= 2 * DBL_EPSILON);
        assert_true(fabs(colour_decode_srgb(rows[i][1]) - rows[i][0]) <= 4 * DBL_EPSILON);
    }
    assert_true(fabs(colour_decode_srgb(0.5) - 0.2140411404822324424) <= DBL_EPSILON);
    assert_true(colour_encode_srgb(1) == 1 && colour_decode_srgb(1) == 1);
}

static void what_is_outside_is_clamped(void **state)
{
    (void)state;
    static const double low[] = {-0.0, -1e-300, -1, -INFINITY, NAN, -NAN},
                        high[] = {1, 1 + DBL_EPSILON, 2, 1e300, INFINITY};
    for (size_t i = 0; i < sizeof low / sizeof low[0]; i++) {
        assert_true(colour_encode_srgb(low[i]) == 0 && colour_decode_srgb(low[i]) == 0);
        assert_true(quantize8(low[i]) == 0 && quantize16(low[i]) == 0);
    }
    for (size_t i = 0; i < sizeof high / sizeof high[0]; i++) {
        assert_true(colour_encode_srgb(high[i]) == 1 && colour_decode_srgb(high[i]) == 1);
        assert_true(quantize8(high[i]) == 255 && quantize16(high[i]) == 65535);
    }
}

static void all_codes_survive_the_round_trip(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        assert_true(colour_from_srgb8((uint8_t)code) == colour_decode_srgb(code / 255.0));
        assert_int_equal(quantize8(colour_from_srgb8((uint8_t)code)), code);
    }
    for (int code = 0; code < 65536; code++)
        assert_int_equal(quantize16(colour_decode_srgb(code / 65535.0)), code);
}

/* Floats of all magnitudes, and some that are out of range. */
static void many_at_once_are_encoded_alike(void **state)
{
    (void)state;
    enum { COUNT = 4099 };
    float linear[COUNT] = {0, -0.0f, 1, -1, 7, 0x1.fffffep-1f, INFINITY, -INFINITY, 0.0031308f, 0x1p-149f};
    double encoded[COUNT];
    for (uint32_t i = 10; i < COUNT; i++)
        linear[i] = i % 2 ? hash_u32(SEED + i) * 0x1p-32f : ldexpf(1, -(int)(i % 150)) * (1 + i / (float)COUNT);
    colour_encode_srgb_many(linear, COUNT, encoded);
    for (int i = 0; i < COUNT; i++)
        assert_float_equal(encoded[i], colour_encode_srgb(linear[i]), 1e-14);
    assert_true(encoded[0] == 0 && encoded[2] == 1 && encoded[3] == 0 && encoded[4] == 1 && encoded[6] == 1);
}

/* Up to the borders of every part of the curve, and outside. */
static void colours_are_encoded_nearly_alike(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 100000; i++) {
        struct vec3 linear = {i * 0x1p-16, ldexp(1 + (i & 255) / 256.0, -(int)(i >> 8) % 16), -(double)i}, encoded;
        linear.y = i & 1 << 16 ? nextafter(linear.y, 0) : linear.y;
        colour_encode_srgb_near(&linear, 1, &encoded);
        assert_true(fabs(encoded.x - colour_encode_srgb(linear.x)) <= 0x1p-28);
        assert_true(fabs(encoded.y - colour_encode_srgb(linear.y)) <= 0x1p-28);
        assert_true(encoded.z == 0);
    }
    struct vec3 odd[2] = {{NAN, INFINITY, -INFINITY}, {1, 0.0031308, 0x1p-1074}}, encoded[2];
    colour_encode_srgb_near(odd, 2, encoded);
    assert_true(encoded[0].x == 0 && encoded[0].y == 1 && encoded[0].z == 0 && encoded[1].x == 1);
    assert_true(encoded[1].y == 12.92 * 0.0031308 && encoded[1].z == 12.92 * 0x1p-1074);
}

/* Both sides of every border between codes, which encoding has to be monotonic to place. */
static void check_borders(double highest, int (*quantize)(double), int neighbours)
{
    for (int code = 1; code <= highest; code++) {
        double border = colour_decode_srgb((code - 0.5) / highest), below = border, above = border;
        for (int i = 0; i < neighbours; i++) {
            check_quantizers(below);
            check_quantizers(above);
            below = nextafter(below, 0);
            above = nextafter(above, 1);
        }
        assert_int_equal(quantize(below), code - 1);
        assert_int_equal(quantize(above), code);
    }
}

static void quantizers_equal_their_definition_at_the_borders(void **state)
{
    (void)state;
    check_borders(255, quantize8, 500);
    check_borders(65535, quantize16, 20);
}

/* Where the quantizers' tables go from one part to the next: octaves, cut into up to 128 parts. */
static void quantizers_equal_their_definition_between_parts(void **state)
{
    (void)state;
    for (double octave = 0x1p-12; octave < 1; octave *= 2) {
        for (int i = 0; i < 128; i++) {
            double start = octave * (1 + i / 128.0);
            check_quantizers(nextafter(start, 0));
            check_quantizers(start);
            check_quantizers(nextafter(start, 1));
        }
    }
    check_quantizers(nextafter(0.0031308, 0));
    check_quantizers(0.0031308);
    check_quantizers(nextafter(0.0031308, 1));
    check_quantizers(nextafter(1, 0));
    check_quantizers(DBL_TRUE_MIN);
}

static void quantizers_equal_their_definition_anywhere(void **state)
{
    (void)state;
    print_message("# seed %d\n", SEED);
    for (uint32_t i = 0; i < SAMPLES; i++) {
        double value = hash_u32(hash_u32(SEED) ^ i) * 0x1p-32 + hash_u32(i) * 0x1p-64;
        check_quantizers(i % 4 ? value : value * value * value);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_curve_is_that_of_the_standard),
        cmocka_unit_test(what_is_outside_is_clamped),
        cmocka_unit_test(all_codes_survive_the_round_trip),
        cmocka_unit_test(many_at_once_are_encoded_alike),
        cmocka_unit_test(colours_are_encoded_nearly_alike),
        cmocka_unit_test(quantizers_equal_their_definition_at_the_borders),
        cmocka_unit_test(quantizers_equal_their_definition_between_parts),
        cmocka_unit_test(quantizers_equal_their_definition_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
