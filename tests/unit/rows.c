/* Row records: their bytes, and that a band is its rows' records one after another. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "wire/rows.h"

/* The layout is kept in journals, so it is pinned byte by byte. */
static void test_layout(void **state)
{
    (void)state;
    static const uint8_t expected[] = {
        0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x02, 0x01, 0,    0,
        0,    0,    0,    0,    0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff,
        'r',  'g',  'b',
    };
    struct row_figures figures = {0x0102030405060708, 0x0102, UINT64_MAX};
    uint8_t record[ROW_FIGURES_BYTES + 3] = "";
    row_figures_write(record, &figures);
    memcpy(record + ROW_FIGURES_BYTES, "rgb", 3);
    assert_int_equal(sizeof record, row_record_bytes(3));
    assert_int_equal(sizeof record, sizeof expected);
    assert_memory_equal(record, expected, sizeof expected);
}

static void test_band(void **state)
{
    (void)state;
    enum { ROWS = 5, ROW_BYTES = 7 };
    struct bytes band = {0};
    for (uint8_t row = 0; row < ROWS; row++) {
        uint8_t *record = bytes_extend(&band, row_record_bytes(ROW_BYTES));
        row_figures_write(record, &(struct row_figures){row, 100u + row, 1000u * row});
        for (uint8_t i = 0; i < ROW_BYTES; i++)
            record[ROW_FIGURES_BYTES + i] = (uint8_t)(10 * row + i);
    }
    assert_int_equal(band.size, ROWS * row_record_bytes(ROW_BYTES));
    for (uint8_t row = 0; row < ROWS; row++) {
        struct row_figures figures;
        const uint8_t *record = band.data + row * row_record_bytes(ROW_BYTES);
        const uint8_t *pixels = row_record_decode(record, &figures);
        assert_ptr_equal(pixels, record + ROW_FIGURES_BYTES);
        assert_int_equal(figures.samples, row);
        assert_int_equal(figures.secondary_rays, 100u + row);
        assert_int_equal(figures.shadow_rays, 1000u * row);
        assert_int_equal(pixels[ROW_BYTES - 1], 10 * row + ROW_BYTES - 1);
    }
    bytes_finish(&band);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_band),
    };
    return cmocka_run_group_tests_name("rows", tests, NULL, NULL);
}
