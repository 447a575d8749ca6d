/*
 * The samples of a pixel: stratified as a (0,2)-net, unlike from pixel to pixel, and spread as the filter is.
 */
#include "trace/sample.h"

#include <float.h>
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
        struct sample_position at = sample_position(hash_u32(i), i, 0, 1, i % 2 ? FILTER_BOX : FILTER_TENT);
        assert_true(at.x == 0.5 && at.y == 0.5);
    }
}

static void samples_lie_within_the_pixel(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000000; i++) {
        struct sample_position at = sample_position(hash_u32(i) % 65535, i % 65535, i % 4096, 4096, FILTER_BOX);
        assert_true(at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1);
    }
}

/* The ends and the middle of the filters, and what lies between is in order. */
static void filters_spread_shares_over_their_width(void **state)
{
    (void)state;
    const double last = 1 - 0x1p-32; /* the greatest coordinate that there is */
    assert_true(sample_spread(0, FILTER_BOX) == 0 && sample_spread(last, FILTER_BOX) == last);
    assert_true(sample_spread(0, FILTER_TENT) == -0.5 && sample_spread(0.5, FILTER_TENT) == 0.5);
    assert_true(sample_spread(0.125, FILTER_TENT) == 0 && sample_spread(0.875, FILTER_TENT) == 1);
    assert_true(sample_spread(last, FILTER_TENT) < 1.5 && sample_spread(last, FILTER_TENT) > 1.4999);
    for (double u = 0x1p-16, before = -0.5; u < 1; u += 0x1p-16) {
        double x = sample_spread(u, FILTER_TENT), other = sample_spread(1 - u, FILTER_TENT);
        assert_true(x > before);
        assert_true(fabs(x + other - 1) <= 0x1p-52);
        before = x;
    }
}

/* The share of the tent that lies before x. */
static double tent_share(double x)
{
    return x < 0.5 ? (x + 0.5) * (x + 0.5) / 2 : 1 - (1.5 - x) * (1.5 - x) / 2;
}

/* Each sample of the tent has as much of the tent before it as the box's has of the box: so they are stratified by the
 * tent's measure. Squaring and rooting lose three roundings of numbers up to 2. */
static void the_tents_samples_are_the_boxs_spread(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000000; i++) {
        uint32_t x = hash_u32(i) % 65535, y = i % 65535;
        struct sample_position box = sample_position(x, y, i % 4096, 4096, FILTER_BOX);
        struct sample_position tent = sample_position(x, y, i % 4096, 4096, FILTER_TENT);
        assert_true(tent.x >= -0.5 && tent.x < 1.5 && tent.y >= -0.5 && tent.y < 1.5);
        assert_true(fabs(tent_share(tent.x) - box.x) <= 0x1p-51);
        assert_true(fabs(tent_share(tent.y) - box.y) <= 0x1p-51);
    }
}

/* The mean of f(x) over samples, one in each of COUNT strata of equal measure, is off by at most f's variation / COUNT:
 * here, where nothing varies by more than 2, by 2 / COUNT. */
static void check_moments(enum pixel_filter filter, double variance)
{
    enum { COUNT = 1 << 16 };
    double mean[2] = {0}, square[2] = {0};
    for (uint32_t i = 0; i < COUNT; i++) {
        struct sample_position at = sample_position(17, 4, i, COUNT, filter);
        mean[0] += at.x / COUNT;
        mean[1] += at.y / COUNT;
        square[0] += (at.x - 0.5) * (at.x - 0.5) / COUNT;
        square[1] += (at.y - 0.5) * (at.y - 0.5) / COUNT;
    }
    for (int axis = 0; axis < 2; axis++) {
        assert_true(fabs(mean[axis] - 0.5) <= 2.0 / COUNT);
        assert_true(fabs(square[axis] - variance) <= 2.0 / COUNT);
    }
}

static void samples_vary_as_their_filter(void **state)
{
    (void)state;
    check_moments(FILTER_BOX, 1.0 / 12);
    check_moments(FILTER_TENT, 1.0 / 6);
}

/* One sample alone is averaged over a box that varies as the filter does; four are half as wide. */
static void widths_are_the_filters(void **state)
{
    (void)state;
    assert_true(sample_width(1, FILTER_BOX) == 1 && sample_width(4, FILTER_BOX) == 0.5);
    double width = sample_width(1, FILTER_TENT);
    assert_true(fabs(width * width / 12 - 1.0 / 6) <= DBL_EPSILON);
    assert_true(sample_width(4, FILTER_TENT) == width / 2);
}

/* What samples stand for adds up to their filter: at each place, as much of it as there are samples whose boxes lie there,
 * by their width. Edges of boxes lie within a share of one in COUNT of where they are counted. */
static void check_cells(enum pixel_filter filter, double (*height)(double x))
{
    enum { COUNT = 1 << 14, PLACES = 97 };
    for (uint32_t cells = 1; cells <= 64; cells *= 2)
        for (uint32_t place = 0; place < PLACES; place++) {
            double x = -0.75 + 2.5 * place / PLACES, sum = 0;
            for (uint32_t i = 0; i < COUNT; i++) {
                struct sample_cell cell = sample_cell((i + 0.5) / COUNT, cells, filter);
                sum += fabs(cell.middle - x) <= cell.width / 2 ? 1 / cell.width / COUNT : 0;
            }
            assert_true(fabs(sum - height(x)) <= 2.0 * cells / COUNT);
        }
}

static double height_of_box(double x)
{
    return x >= 0 && x < 1;
}

static double height_of_tent(double x)
{
    return fmax(1 - fabs(x - 0.5), 0);
}

static void cells_add_up_to_their_filter(void **state)
{
    (void)state;
    check_cells(FILTER_BOX, height_of_box);
    check_cells(FILTER_TENT, height_of_tent);
}

/* Each of the `count` = 2^m boxes of 2^-columns × 2^-(m−columns) holds exactly one sample, for every division.
 */
static bool is_net(uint32_t x, uint32_t y, uint32_t count)
{
    for (uint32_t columns = 1; columns <= count; columns *= 2) {
        bool taken[64] = {false};
        uint32_t rows = count / columns;
        for (uint32_t i = 0; i < count; i++) {
            struct sample_position at = sample_position(x, y, i, count, FILTER_BOX);
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
        struct sample_position few = sample_position(3, 4, i, 64, FILTER_BOX);
        struct sample_position many = sample_position(3, 4, i, 1024, FILTER_BOX);
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
            struct sample_position at = sample_position(x, y, 0, 4, FILTER_BOX);
            struct sample_position next = sample_position(x + 1, y, 0, 4, FILTER_BOX);
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
        cmocka_unit_test(filters_spread_shares_over_their_width),
        cmocka_unit_test(the_tents_samples_are_the_boxs_spread),
        cmocka_unit_test(samples_vary_as_their_filter),
        cmocka_unit_test(widths_are_the_filters),
        cmocka_unit_test(cells_add_up_to_their_filter),
        cmocka_unit_test(powers_of_two_are_nets_in_every_pixel),
        cmocka_unit_test(more_samples_go_on_from_fewer),
        cmocka_unit_test(pixels_are_scrambled_independently),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
