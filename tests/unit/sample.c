/*
 * The samples of a pixel: stratified as a (0,2)-net, unlike from pixel to pixel, and within the pixel.
 */
#include "trace/sample.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/hash.h"

static void a_single_sample_is_the_centre(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 100; i++) {
        struct sample_position at = sample_position(hash_u32(i), i, 0, 1);
        assert_true(at.x == 0.5 && at.y == 0.5);
    }
}

static void samples_lie_within_the_pixel(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000000; i++) {
        struct sample_position at = sample_position(hash_u32(i) % 65535, i % 65535, i % 4096, 4096);
        assert_true(at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1);
    }
}

/* Each of the `count` = 2^m boxes of 2^-columns × 2^-(m−columns) holds exactly one sample, for every division.
 */
static bool is_net(uint32_t x, uint32_t y, uint32_t count)
{
    for (uint32_t columns = 1; columns <= count; columns *= 2) {
        bool taken[64] = {false};
        uint32_t rows = count / columns;
        for (uint32_t i = 0; i < count; i++) {
            struct sample_position at = sample_position(x, y, i, count);
            uint32_t box = (uint32_t)(at.x * columns) * rows + (uint32_t)(at.y * rows);
            if (taken[box])
                return false;
            taken[box] = true;
        }
    }
    return true;
}

static void powers_of_two_are_nets_in_every_pixel(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 3000; i++)
        for (uint32_t count = 4; count <= 64; count *= 4) {
            assert_true(is_net(i % 50, i / 50, count));
            assert_true(is_net(hash_u32(i) % 65535, hash_u32(i + 9999) % 65535, count));
        }
}

/* The first samples of many are the samples of fewer, so that adding samples keeps the old ones. */
static void more_samples_go_on_from_fewer(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 64; i++) {
        struct sample_position few = sample_position(3, 4, i, 64), many = sample_position(3, 4, i, 1024);
        assert_true(few.x == many.x && few.y == many.y);
    }
}

/* Over pixels the first sample is uniform: mean 1/2 and each of 16 × 16 cells as full as chance allows; and
 * pixels beside one another are not alike. */
static void pixels_are_scrambled_independently(void **state)
{
    (void)state;
    enum { SIDE = 256 };
    static unsigned cells[16][16];
    memset(cells, 0, sizeof cells);
    double product = 0;
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++) {
            struct sample_position at = sample_position(x, y, 0, 4), next = sample_position(x + 1, y, 0, 4);
            cells[(int)(16 * at.y)][(int)(16 * at.x)]++;
            product += (at.x - 0.5) * (next.x - 0.5) + (at.x - 0.5) * (at.y - 0.5);
        }
    double chi_square = 0;
    for (int i = 0; i < 256; i++)
        chi_square += (cells[i / 16][i % 16] - 256.0) * (cells[i / 16][i % 16] - 256.0) / 256;
    assert_true(chi_square < 255 + 5 * sqrt(2 * 255)); /* five standard deviations */
    assert_true(fabs(product) / (SIDE * SIDE) < 5 * sqrt(2) / 12 / SIDE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_single_sample_is_the_centre),
        cmocka_unit_test(samples_lie_within_the_pixel),
        cmocka_unit_test(powers_of_two_are_nets_in_every_pixel),
        cmocka_unit_test(more_samples_go_on_from_fewer),
        cmocka_unit_test(pixels_are_scrambled_independently),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
