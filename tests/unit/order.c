/* What a worker takes for an order: rows that the picture has, and no larger a result than the protocol allows. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "image/encode.h"
#include "wire/rows.h"
#include "worker/order.h"

static bool fits(uint32_t first_row, uint32_t rows, const struct job_settings *settings)
{
    const struct order order = {.pass = PASS_RENDER, .first_row = first_row, .rows = rows, .sampling = {1, 1, 0}};
    return order_fits(&order, settings);
}

static void test_rows(void **state)
{
    (void)state;
    const struct job_settings settings = {.width = 10, .height = 20};
    assert_true(fits(0, 20, &settings));
    assert_true(fits(19, 1, &settings));
    assert_false(fits(0, 0, &settings));
    assert_false(fits(0, 21, &settings));
    assert_false(fits(20, 1, &settings));
    assert_false(fits(1, UINT32_MAX, &settings));
}

/* The largest pictures, in the most bytes a pixel. */
static void test_bytes(void **state)
{
    (void)state;
    const struct job_settings settings = {.width = MESSAGE_SIDE_MAX, .height = MESSAGE_SIDE_MAX, .maps = 1,
                                          .pixel_format = MESSAGE_PIXEL_FORMATS - 1};
    const struct row_layout layout =
        row_layout_of(settings.width, pixel_format_bytes((enum pixel_format)settings.pixel_format), true);
    uint32_t most = (uint32_t)(MESSAGE_RESULT_MAX / row_record_bytes(&layout));
    assert_true(most > 32); /* as many as bands have that are cut automatically */
    assert_true(fits(0, most, &settings));
    assert_false(fits(0, most + 1, &settings));
    assert_true(fits(MESSAGE_SIDE_MAX - most, most, &settings));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_bytes),
    };
    return cmocka_run_group_tests_name("orders", tests, NULL, NULL);
}
