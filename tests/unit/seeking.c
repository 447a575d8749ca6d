/* When a worker does what, to find a coordinator (worker/seeking.h). As a part of a session: tests/unit/session.c. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "worker/seeking.h"

static const char *const names[] = {[SEEKING_HELLO] = "HELLO", [SEEKING_RENEW] = "RENEW", [SEEKING_SAY] = "SAY",
                                    [SEEKING_GIVE_UP] = "GIVE UP"};

/* What is done up to end_ms, or until it gives up, when no more is called for than the deadlines say. */
static void expect(struct seeking *seeking, int64_t end_ms, const char *expected)
{
    char text[2000] = "";
    enum seeking_step step = SEEKING_WAIT;
    int64_t now_ms = seeking_deadline(seeking);
    while (now_ms <= end_ms && step != SEEKING_GIVE_UP) {
        size_t length = strlen(text);
        step = seeking_next(seeking, now_ms);
        if (step == SEEKING_WAIT)
            now_ms = seeking_deadline(seeking);
        else
            snprintf(text + length, sizeof text - length, "%s%lld %s", length ? ", " : "", (long long)now_ms,
                     names[step]);
    }
    assert_string_equal(text, expected);
}

static void test_hello(void **state)
{
    (void)state;
    struct seeking seeking = seeking_begin(-1, 0, 1000);
    expect(&seeking, 1750, "1000 HELLO, 1250 HELLO, 1500 HELLO, 1750 HELLO");
    seeking_retry(&seeking, 1750);
    expect(&seeking, 2000, "1751 HELLO");
    seeking_pause(&seeking, 300, 1900);
    expect(&seeking, 2300, "2200 HELLO");
}

/* All but the HELLOs, for a minute and a half. */
static void test_renewing_and_saying(void **state)
{
    (void)state;
    struct seeking seeking = seeking_begin(-1, 1000000, 0);
    expect(&seeking, 80000, "5000 SAY, 5000 RENEW, 15000 RENEW, 20000 SAY, 35000 SAY, 35000 RENEW, 50000 SAY, "
                            "55000 RENEW, 65000 SAY, 75000 RENEW, 80000 SAY");
}

/* Before all else that would be due. */
static void test_giving_up(void **state)
{
    (void)state;
    struct seeking seeking = seeking_begin(5000, 4999, 0);
    expect(&seeking, 10000, "4999 HELLO, 5000 GIVE UP");
    seeking = seeking_begin(0, 0, 7);
    expect(&seeking, 10000, "7 GIVE UP");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hello),
        cmocka_unit_test(test_renewing_and_saying),
        cmocka_unit_test(test_giving_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
