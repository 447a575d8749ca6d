/* How fast a worker is, from its answers and beats. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "coordinator/pace.h"

static void test_unknown(void **state)
{
    (void)state;
    struct pace pace = {0};
    assert_int_equal(pace_alone_ms(&pace, 0, PASS_SURVEY, 10, 1000), -1);
    assert_int_equal(pace_leased_ms(&pace, 0, PASS_SURVEY, 10), -1);
    assert_true(pace_stuck_at(&pace) == INT64_MAX);
}

/* Two bands at once, of 10 rows each, take 200 ms; alone one would take half of that. */
static void test_answers(void **state)
{
    (void)state;
    struct pace pace = {0};
    pace_begin(&pace, 1000);
    pace_answer(&pace, 3, PASS_RENDER, 10, 200, 1200);
    pace_answer(&pace, 3, PASS_RENDER, 10, 200, 1200);
    pace_end(&pace, 1200);
    assert_int_equal(pace_leased_ms(&pace, 3, PASS_RENDER, 10), 200);
    assert_int_equal(pace_alone_ms(&pace, 3, PASS_RENDER, 10, 9000), 100);
    pace_begin(&pace, 9000); /* what it has in hand counts as it goes */
    assert_int_equal(pace_alone_ms(&pace, 3, PASS_RENDER, 10, 9200), 200);
    assert_int_equal(pace_alone_ms(&pace, 3, PASS_SURVEY, 10, 9200), -1);
    assert_int_equal(pace_alone_ms(&pace, 4, PASS_RENDER, 10, 9200), -1);
}

/* Another pass begins anew, from when its first band was granted. */
static void test_next_pass(void **state)
{
    (void)state;
    struct pace pace = {0};
    pace_begin(&pace, 0);
    pace_answer(&pace, 0, PASS_SURVEY, 1, 5000, 5000);
    pace_answer(&pace, 0, PASS_RENDER, 10, 300, 5300);
    assert_int_equal(pace_alone_ms(&pace, 0, PASS_RENDER, 10, 5300), 300);
    assert_int_equal(pace_leased_ms(&pace, 0, PASS_RENDER, 10), 300);
    assert_int_equal(pace_leased_ms(&pace, 0, PASS_SURVEY, 10), -1);
}

static void test_stuck(void **state)
{
    (void)state;
    struct pace pace = {0};
    pace_beat(&pace, 7, 1000); /* it holds nothing */
    assert_true(pace_stuck_at(&pace) == INT64_MAX);
    pace_begin(&pace, 2000);
    assert_true(pace_stuck_at(&pace) == INT64_MAX); /* nobody knows how long it needs */
    pace_beat(&pace, 8, 2500);
    assert_true(pace_stuck_at(&pace) == 2500 + 10000); /* not within ten seconds */
    pace_beat(&pace, 8, 4500);
    assert_true(pace_stuck_at(&pace) == 2500 + 10000);
    pace_beat(&pace, 9, 5500);
    assert_true(pace_stuck_at(&pace) == 5500 + 8 * 3000);
    pace_answer(&pace, 0, PASS_RENDER, 1, 4500, 6500);
    assert_true(pace_stuck_at(&pace) == 6500 + 8 * 3000);
    pace_end(&pace, 6500);
    assert_true(pace_stuck_at(&pace) == INT64_MAX);
    pace_begin(&pace, 90000); /* the time without bands is no gap */
    assert_true(pace_stuck_at(&pace) == 90000 + 8 * 3000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_unknown), cmocka_unit_test(test_answers),
                                       cmocka_unit_test(test_next_pass), cmocka_unit_test(test_stuck)};
    return cmocka_run_group_tests_name("pace", tests, NULL, NULL);
}
