/*
 * The project's flags keep conversions from double to float. tests/build/conversion.t shows that without one of them
 * gcc 12 loses these very ones.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/numeric/rounding.h"

static void neighbouring_doubles_are_rounded_to_floats(void **state)
{
    (void)state;
    assert_int_equal(conversions_done(), 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(neighbouring_doubles_are_rounded_to_floats)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
