/* The colours of maps: the ends of their scales, and that they grow lighter in between. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "coordinator/map_colours.h"
#include "trace/sampling.h"
#include "wire/rows.h"

static const uint8_t darkest[3] = {0, 0, 4}, lightest[3] = {252, 253, 191};

/* Of codes as they are, which is enough to tell the lighter of two colours of this scale. */
static double luma(const uint8_t codes[3])
{
    return 0.2126 * codes[0] + 0.7152 * codes[1] + 0.0722 * codes[2];
}

static void assert_lighter(const uint8_t codes[3], const uint8_t than[3])
{
    assert_true(luma(codes) > luma(than));
}

static void test_every_stage_is_lighter(void **state)
{
    (void)state;
    uint8_t last[3], codes[3];
    map_colour_of_stage(0, last);
    assert_memory_equal(last, darkest, 3);
    for (uint8_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        map_colour_of_stage(stage, codes);
        assert_lighter(codes, last);
        for (size_t i = 0; i < 3; i++)
            last[i] = codes[i];
    }
    assert_memory_equal(last, lightest, 3);
}

static void test_errors(void **state)
{
    (void)state;
    uint8_t codes[3], last[3] = {0, 0, 4};
    for (int code = 0; code < 256; code++) {
        double error = row_error_of((uint8_t)code);
        map_colour_of_error((uint8_t)code, codes);
        if (error <= 0x1p-11)
            assert_memory_equal(codes, darkest, 3);
        else if (error >= 0.5)
            assert_memory_equal(codes, lightest, 3);
        else
            assert_lighter(codes, last);
        for (size_t i = 0; i < 3; i++)
            last[i] = codes[i];
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_stage_is_lighter), cmocka_unit_test(test_errors)};
    return cmocka_run_group_tests_name("map colours", tests, NULL, NULL);
}
