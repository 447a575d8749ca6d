/* Which refusals are told, under a virtual clock. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "wire/refusals.h"

static struct refusals refusals;
static char line[REFUSAL_LINE_BYTES];

static int begin(void **state)
{
    (void)state;
    refusals = (struct refusals){0};
    return 0;
}

static void assert_told(const char *expected)
{
    assert_true(refusals_take(&refusals, line));
    assert_string_equal(line, expected);
}

static void assert_silent(void)
{
    assert_false(refusals_take(&refusals, line));
}

static void test_again(void **state)
{
    (void)state;
    assert_silent();
    refusals_note(&refusals, "a", 5);
    refusals_note(&refusals, "b", 6);
    assert_told("a");
    assert_told("b");
    assert_silent();
    refusals_note(&refusals, "a", 4 + REFUSAL_PAUSE_MS);
    assert_silent();
    refusals_note(&refusals, "a", 5 + REFUSAL_PAUSE_MS);
    assert_told("a (and 1 more since the last line)");
    refusals_note(&refusals, "a", 6 + REFUSAL_PAUSE_MS);
    assert_silent(); /* the minute began anew */
}

static void test_flood(void **state)
{
    (void)state;
    char text[16];
    int told = 0;
    for (int i = 0; i < 10000; i++) {
        snprintf(text, sizeof text, "%d", i);
        refusals_note(&refusals, text, i);
        while (refusals_take(&refusals, line))
            told++;
    }
    assert_int_equal(told, REFUSALS_RECENT);
    refusals_note(&refusals, "a", 10000 + REFUSAL_PAUSE_MS);
    assert_told("a (and 9984 more since the last line)");
}

/* Lines that nobody has taken yet stay, whatever comes. */
static void test_nobody_takes(void **state)
{
    (void)state;
    char text[16];
    for (int i = 0; i < 100; i++) {
        snprintf(text, sizeof text, "%d", i);
        refusals_note(&refusals, text, (int64_t)i * REFUSAL_PAUSE_MS);
    }
    int taken = 0, sum = 0, number;
    for (; refusals_take(&refusals, line); taken++) {
        assert_int_equal(sscanf(line, "%d", &number), 1);
        sum += number;
    }
    assert_int_equal(taken, REFUSALS_RECENT);
    assert_int_equal(sum, REFUSALS_RECENT * (REFUSALS_RECENT - 1) / 2); /* the first ones */
}

static void test_long(void **state)
{
    (void)state;
    char text[2 * REFUSAL_BYTES];
    memset(text, 'x', sizeof text);
    text[sizeof text - 1] = '\0';
    refusals_note(&refusals, text, 0);
    refusals_note(&refusals, text, 1);
    text[REFUSAL_BYTES - 1] = '\0';
    assert_true(refusals_take(&refusals, line));
    assert_memory_equal(line, text, REFUSAL_BYTES - 1);
    assert_silent();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_again, begin),
        cmocka_unit_test_setup(test_flood, begin),
        cmocka_unit_test_setup(test_nobody_takes, begin),
        cmocka_unit_test_setup(test_long, begin),
    };
    return cmocka_run_group_tests_name("refusals", tests, NULL, NULL);
}
