/* How far apart two images are: values that can be calculated by hand, and a plain sum in higher precision. */
#include "image/compare.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "math/colour.h"
#include "tests/random.h"

/* Images hold linear light as float, so an encoded value comes back with a relative error of 2^-24 times what the curve
 * makes of it: 2^-24 (1 + 0.055) / 2.4, at most. */
static const double ROUND_TRIP = 2.63e-8;

/* Of one colour, given as encoded. */
static struct image make_image(uint32_t width, uint32_t height, double red, double green, double blue)
{
    struct image image = {width, height, memory_array((size_t)width * height, 3 * sizeof(float))};
    const double encoded[3] = {red, green, blue};
    for (size_t i = 0; i < 3 * (size_t)width * height; i++)
        image.rgb[i] = (float)colour_decode_srgb(encoded[i % 3]);
    return image;
}

static struct image_difference compare_greys(double a, double b)
{
    struct image first = make_image(5, 3, a, a, a), second = make_image(5, 3, b, b, b);
    struct image_difference difference = image_compare(&first, &second, 1);
    image_finish(&first);
    image_finish(&second);
    return difference;
}

static void equal_images_do_not_differ(void **state)
{
    (void)state;
    struct image_difference none = compare_greys(0.3, 0.3);
    assert_true(none.rmse == 0 && none.maximum == 0 && none.share_off == 0);
    assert_true(image_psnr(0) == (double)INFINITY);
}

static void one_channel_of_one_pixel_counts_once(void **state)
{
    (void)state;
    struct image a = make_image(2, 2, 0.25, 0.5, 1), b = make_image(2, 2, 0.25, 0.5, 1);
    b.rgb[7] = (float)colour_decode_srgb(0.1);
    struct image_difference found = image_compare(&a, &b, 1);
    assert_float_equal(found.rmse, sqrt(0.4 * 0.4 / 12), ROUND_TRIP);
    assert_float_equal(found.maximum, 0.4, 2 * ROUND_TRIP);
    assert_float_equal(found.share_off, 0.25, 0);
    image_finish(&a);
    image_finish(&b);
}

static void black_and_white_differ_by_one(void **state)
{
    (void)state;
    struct image_difference found = compare_greys(0, 1);
    assert_true(found.rmse == 1 && found.maximum == 1 && found.share_off == 1);
    assert_true(image_psnr(1) == 0);
    assert_float_equal(image_psnr(0.1), 20, 1e-13);
    assert_float_equal(image_psnr(0.001), 60, 1e-13);
}

static void light_is_clamped(void **state)
{
    (void)state;
    struct image a = make_image(3, 1, 0, 1, 0.5), b = make_image(3, 1, 0, 1, 0.5);
    for (int x = 0; x < 3; x++) {
        a.rgb[3 * x] = -2.5f;
        a.rgb[3 * x + 1] = 1e30f;
    }
    struct image_difference found = image_compare(&a, &b, 1);
    assert_true(found.rmse == 0 && found.maximum == 0 && found.share_off == 0);
    image_finish(&a);
    image_finish(&b);
}

/* "Off by more than 1/255" tells a step of 8 bit codes from the next larger one of 16 bit codes, everywhere. */
static void steps_of_codes_are_told_apart(void **state)
{
    (void)state;
    for (int code = 0; code + 258 <= 65535; code++) {
        struct image_difference step = compare_greys(code / 65535.0, (code + 257) / 65535.0);
        struct image_difference more = compare_greys(code / 65535.0, (code + 258) / 65535.0);
        assert_float_equal(step.rmse, 1 / 255.0, 2 * ROUND_TRIP);
        if (step.share_off != 0 || more.share_off != 1)
            fail_msg("from code %d: %g and %g are off", code, step.share_off, more.share_off);
    }
}

static struct image random_image(uint32_t width, uint32_t height, uint32_t draw)
{
    struct image image = {width, height, memory_array((size_t)width * height, 3 * sizeof(float))};
    for (uint32_t i = 0; i < 3 * width * height; i++)
        image.rgb[i] = (float)random_between(i, draw, -0.2, 1.2);
    return image;
}

static struct image_difference plain_difference(const struct image *a, const struct image *b)
{
    long double squares = 0, maximum = 0;
    size_t pixels = (size_t)a->width * a->height, off = 0;
    for (size_t i = 0; i < pixels; i++) {
        double most = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double d = fabs(colour_encode_srgb(a->rgb[c]) - colour_encode_srgb(b->rgb[c]));
            squares += (long double)d * d;
            most = d > most ? d : most;
        }
        off += most > 1 / 255.0;
        maximum = most > maximum ? most : maximum;
    }
    return (struct image_difference){(double)sqrtl(squares / (3 * pixels)), (double)maximum, (double)off / pixels};
}

/* Wider than the pieces in which rows are encoded. */
static void random_images_agree_with_a_plain_sum(void **state)
{
    (void)state;
    struct image a = random_image(611, 47, 1), b = random_image(611, 47, 2);
    struct image_difference expected = plain_difference(&a, &b), found = image_compare(&a, &b, 1);
    assert_float_equal(found.rmse, expected.rmse, 1e-13);
    assert_float_equal(found.maximum, expected.maximum, 2e-14);
    assert_float_equal(found.share_off, expected.share_off, 0);
    const int threads[] = {2, 3, 16};
    for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
        struct image_difference shared = image_compare(&a, &b, threads[i]);
        assert_memory_equal(&shared, &found, sizeof found);
    }
    image_finish(&a);
    image_finish(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_images_do_not_differ),
        cmocka_unit_test(one_channel_of_one_pixel_counts_once),
        cmocka_unit_test(black_and_white_differ_by_one),
        cmocka_unit_test(light_is_clamped),
        cmocka_unit_test(steps_of_codes_are_told_apart),
        cmocka_unit_test(random_images_agree_with_a_plain_sum),
    };
    return cmocka_run_group_tests_name("compare", tests, NULL, NULL);
}
