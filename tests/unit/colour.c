/*
 * sRGB: the curve, its round trips, and the fast 8 bit quantizer against its definition.
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

enum { SEED = 20240612, SAMPLES = 2000000, NEIGHBOURS = 500 };

static int plain_quantize8(double linear)
{
    return (int)floor(255 * colour_encode_srgb(linear) + 0.5);
}

static void check_quantize8(double linear)
{
    int expected = plain_quantize8(linear), code = colour_quantize8(linear);
    if (code != expected)
        fail_msg("seed %d: %a quantizes to %d, not %d", SEED, linear, code, expected);
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
        assert_true(colour_quantize8(low[i]) == 0 && colour_quantize16(low[i]) == 0);
    }
    for (size_t i = 0; i < sizeof high / sizeof high[0]; i++) {
        assert_true(colour_encode_srgb(high[i]) == 1 && colour_decode_srgb(high[i]) == 1);
        assert_true(colour_quantize8(high[i]) == 255 && colour_quantize16(high[i]) == 65535);
    }
}

static void all_codes_survive_the_round_trip(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        assert_true(colour_from_srgb8((uint8_t)code) == colour_decode_srgb(code / 255.0));
        assert_int_equal(colour_quantize8(colour_from_srgb8((uint8_t)code)), code);
    }
    for (int code = 0; code < 65536; code++)
        assert_int_equal(colour_quantize16(colour_decode_srgb(code / 65535.0)), code);
}

/* Both sides of every border between codes, which encoding has to be monotonic to place. */
static void quantize8_equals_its_definition_at_the_borders(void **state)
{
    (void)state;
    for (int code = 1; code < 256; code++) {
        double border = colour_decode_srgb((code - 0.5) / 255), below = border, above = border;
        for (int i = 0; i < NEIGHBOURS; i++) {
            check_quantize8(below);
            check_quantize8(above);
            below = nextafter(below, 0);
            above = nextafter(above, 1);
        }
        assert_int_equal(colour_quantize8(below), code - 1);
        assert_int_equal(colour_quantize8(above), code);
    }
}

static void quantize8_equals_its_definition_anywhere(void **state)
{
    (void)state;
    print_message("# seed %d\n", SEED);
    for (uint32_t i = 0; i < SAMPLES; i++) {
        double value = hash_u32(hash_u32(SEED) ^ i) * 0x1p-32 + hash_u32(i) * 0x1p-64;
        check_quantize8(i % 4 ? value : value * value * value);
    }
    for (int i = 0; i <= 4096; i++) { /* the borders of the quantizer's buckets */
        check_quantize8(nextafter(i / 4096.0, 0));
        check_quantize8(i / 4096.0);
        check_quantize8(nextafter(i / 4096.0, 1));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_curve_is_that_of_the_standard),
        cmocka_unit_test(what_is_outside_is_clamped),
        cmocka_unit_test(all_codes_survive_the_round_trip),
        cmocka_unit_test(quantize8_equals_its_definition_at_the_borders),
        cmocka_unit_test(quantize8_equals_its_definition_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
