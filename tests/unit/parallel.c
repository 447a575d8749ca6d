/* A shared loop runs every turn once, with any number of threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/parallel.h"

enum { TURNS = 1000 };

static void count_turn(void *context, size_t index)
{
    atomic_fetch_add((atomic_int *)context + index, 1);
}

static void test_every_turn_once(void **state)
{
    (void)state;
    const int threads[] = {-1, 0, 1, 2, 7, 2 * TURNS};
    for (size_t t = 0; t < sizeof threads / sizeof *threads; t++)
        for (size_t count = 0; count <= TURNS; count = 10 * count + 1) {
            atomic_int turns[TURNS + 1] = {0};
            parallel_for(threads[t], count, count_turn, turns);
            for (size_t i = 0; i <= TURNS; i++)
                assert_int_equal(turns[i], i < count);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_turn_once)};
    return cmocka_run_group_tests_name("parallel", tests, NULL, NULL);
}
