/* Row records: their bytes, sums of figures, and the scale of errors. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "wire/rows.h"

/* Figures of which each tells its place. */
static struct row_figures figures_of(uint64_t seed)
{
    struct row_figures figures = {seed, 100 + seed, 1000 * seed, {seed << 32, seed + 7}, {0}};
    for (size_t i = 0; i < ROW_STAGES; i++)
        figures.stages[i] = seed * i + 1;
    return figures;
}

static void assert_figures(const struct row_figures *found, const struct row_figures *expected)
{
    assert_memory_equal(found, expected, sizeof *found); /* of whole numbers of one size: no padding */
}

/* The layout is kept in journals, so it is pinned byte by byte. */
static void test_layout(void **state)
{
    (void)state;
    const struct row_layout layout = row_layout_of(1, 3, true);
    struct row_figures figures = {0x0102030405060708, 0x0102, UINT64_MAX, {0x11, 0x2200}, {[0] = 0x33, [15] = 0x44}};
    uint8_t record[256] = "", expected[256] = {0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x02, 0x01};
    memset(expected + 16, 0xff, 8);
    expected[24] = 0x11;
    expected[33] = 0x22;
    expected[40] = 0x33;
    expected[160] = 0x44;
    memcpy(expected + 168, "rgbse", 5);
    row_figures_write(record, &figures);
    memcpy(record + ROW_FIGURES_BYTES, "rgb", 3);
    record[row_stages_at(&layout)] = 's';
    record[row_errors_at(&layout)] = 'e';
    assert_int_equal(row_record_bytes(&layout), 173);
    assert_memory_equal(record, expected, sizeof expected);
}

static void test_lengths(void **state)
{
    (void)state;
    const struct row_layout plain = row_layout_of(65535, 12, false), mapped = row_layout_of(65535, 12, true);
    assert_int_equal(row_record_bytes(&plain), ROW_FIGURES_BYTES + 65535 * 12);
    assert_int_equal(row_record_bytes(&mapped), ROW_FIGURES_BYTES + 65535 * 14);
    assert_int_equal(row_stages_at(&mapped), ROW_FIGURES_BYTES + 65535 * 12);
    assert_int_equal(row_errors_at(&mapped), ROW_FIGURES_BYTES + 65535 * 13);
}

static void test_figures_come_back(void **state)
{
    (void)state;
    uint8_t record[ROW_FIGURES_BYTES];
    for (uint64_t seed = 0; seed < 5; seed++) {
        struct row_figures figures = figures_of(seed), back;
        row_figures_write(record, &figures);
        row_figures_read(record, &back);
        assert_figures(&back, &figures);
    }
}

static void test_sums(void **state)
{
    (void)state;
    struct row_figures sum = {0}, expected = figures_of(10);
    for (uint64_t seed = 1; seed <= 4; seed++) {
        struct row_figures figures = figures_of(seed);
        row_figures_add(&sum, &figures);
    }
    expected.secondary_rays = 400 + 10;
    expected.error[1] = 10 + 4 * 7;
    for (size_t i = 0; i < ROW_STAGES; i++)
        expected.stages[i] = 10 * i + 4;
    assert_figures(&sum, &expected);
}

/* Errors that are beyond what can be counted stay there, whatever comes before or after. */
static void test_sums_saturate(void **state)
{
    (void)state;
    const struct row_figures some = {.error = {1, UINT64_MAX - 5}}, more = {.error = {2, 6}};
    struct row_figures one_way = some, other_way = more;
    row_figures_add(&one_way, &more);
    row_figures_add(&one_way, &more);
    row_figures_add(&other_way, &more);
    row_figures_add(&other_way, &some);
    assert_true(one_way.error[0] == 5 && one_way.error[1] == UINT64_MAX);
    assert_figures(&other_way, &one_way);
}

/* --- the scale of errors ---------------------------------------------------------------------------------- */

static void test_codes_of_round_errors(void **state)
{
    (void)state;
    assert_int_equal(row_error_code(0), 0);
    assert_int_equal(row_error_code(-1), 0);
    assert_int_equal(row_error_code(NAN), 0);
    assert_int_equal(row_error_code(1), 255);
    assert_int_equal(row_error_code(INFINITY), 255);
    for (int octave = 0; octave < 32; octave++)
        assert_int_equal(row_error_code(exp2(-2 * octave)), 255 - 8 * octave);
    assert_int_equal(row_error_code(exp2(-2 * 31.75)), 1);
    assert_int_equal(row_error_code(0x1p-200), 1);
    assert_int_equal(row_error_code(0x1p-1074), 1);
}

static void test_codes_stand_for_what_got_them(void **state)
{
    (void)state;
    assert_true(row_error_of(0) == 0);
    assert_true(row_error_of(255) == 1);
    for (int code = 1; code < 256; code++) {
        double rms = row_error_of((uint8_t)code);
        assert_true(fabs(rms / exp2((code - 255) / 8.0) - 1) < 1e-15);
        assert_int_equal(row_error_code(rms * rms), code);
        if (code > 1) /* the middle between two, 2^(1/16) below, within rounding */
            assert_int_equal(row_error_code(rms * rms * exp2(-0.125) * (1 + 1e-12)), code);
        if (code > 1)
            assert_int_equal(row_error_code(rms * rms * exp2(-0.125) * (1 - 1e-12)), code - 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_lengths),
        cmocka_unit_test(test_figures_come_back),
        cmocka_unit_test(test_sums),
        cmocka_unit_test(test_sums_saturate),
        cmocka_unit_test(test_codes_of_round_errors),
        cmocka_unit_test(test_codes_stand_for_what_got_them),
    };
    return cmocka_run_group_tests_name("rows", tests, NULL, NULL);
}
