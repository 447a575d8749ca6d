/* Who asks, and when each is answered, under a virtual clock. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "coordinator/askers.h"

static struct askers askers;

static int begin(void **state)
{
    (void)state;
    askers = (struct askers){0};
    return 0;
}

static struct wire_peer address_of(int who)
{
    return (struct wire_peer){.size = 2, .id = {(uint8_t)who, (uint8_t)(who >> 8)}};
}

/* The tickets of tests: who and how often. */
static bool ask(int who, uint64_t number, uint64_t ticket, uint32_t pause_ms, int64_t now_ms)
{
    struct wire_peer address = address_of(who);
    struct message message = {.kind = MESSAGE_ASK, .ask = {number, ticket, pause_ms}};
    return askers_take(&askers, &address, &message, (uint64_t)who * 1000 + 1, now_ms);
}

static void assert_answered(int who, uint64_t number, uint64_t ticket, int64_t now_ms)
{
    struct wire_peer address = address_of(who);
    struct asker *asker = askers_next(&askers, false, now_ms);
    assert_non_null(asker);
    assert_true(wire_peer_equal(&asker->address, &address));
    assert_int_equal(asker->number, number);
    askers_answered(asker, ticket, false, now_ms);
}

static void assert_nobody(int64_t now_ms)
{
    assert_null(askers_next(&askers, false, now_ms));
}

static void test_ticket(void **state)
{
    (void)state;
    assert_true(askers_due_ms(&askers) == INT64_MAX);
    assert_true(ask(1, 7, 0, 0, 1000));
    assert_nobody(1000);
    assert_false(ask(1, 7, 0, 0, 1001)); /* shows none */
    assert_false(ask(1, 7, 5, 0, 1001)); /* nor this */
    assert_nobody(1001);
    assert_false(ask(1, 8, 1001, 0, 1002));
    assert_true(askers_due_ms(&askers) <= 1002);
    assert_answered(1, 8, 77, 1002);
    assert_nobody(2000);
    assert_false(ask(1, 9, 1001, 0, 2000)); /* which was that of the answer before */
    assert_nobody(2000);
    assert_false(ask(1, 9, 77, 0, 2000));
    assert_answered(1, 9, 78, 2000);
}

/* A question that is said again is one question. */
static void test_again(void **state)
{
    (void)state;
    ask(1, 1, 0, 0, 1000);
    ask(1, 1, 1001, 0, 1000);
    ask(1, 1, 1001, 0, 1000);
    assert_answered(1, 1, 5, 1000);
    assert_nobody(9000);
}

static void test_pause(void **state)
{
    (void)state;
    ask(1, 1, 0, 250, 1000);
    ask(1, 1, 1001, 250, 1000);
    assert_answered(1, 1, 5, 1000);
    ask(1, 2, 5, 250, 1001);
    assert_int_equal(askers_due_ms(&askers), 1250);
    assert_nobody(1249);
    assert_answered(1, 2, 6, 1250);
}

static void test_rounds(void **state)
{
    (void)state;
    askers_end_round(&askers, 100, 1000);
    ask(1, 1, 0, 0, 1000);
    ask(1, 1, 1001, 0, 1000);
    assert_int_equal(askers_due_ms(&askers), 1000 + ASKERS_ROUND_MS);
    assert_nobody(999 + ASKERS_ROUND_MS);
    assert_answered(1, 1, 5, 1000 + ASKERS_ROUND_MS);
    askers_end_round(&askers, 500 * ASKERS_BYTES_PER_MS, 2000); /* a costly one */
    ask(1, 2, 5, 0, 2000);
    assert_int_equal(askers_due_ms(&askers), 2500);
}

/* In the order in which they asked, not that of their places. */
static void test_turns(void **state)
{
    (void)state;
    static const int order[] = {3, 1, 2};
    for (int who = 1; who <= 3; who++)
        ask(who, 1, 0, 0, 1000);
    for (int i = 0; i < 3; i++)
        ask(order[i], 1, (uint64_t)order[i] * 1000 + 1, 0, 1000);
    ask(3, 1, 3001, 0, 1000); /* keeps its turn */
    for (int i = 0; i < 3; i++)
        assert_answered(order[i], 1, 9, 1000);
    assert_nobody(1000);
}

static void test_full(void **state)
{
    (void)state;
    for (int who = 0; who < ASKERS_MAX; who++)
        assert_true(ask(who, 1, 0, 100, 1000 + who));
    assert_int_equal(askers.count, ASKERS_MAX);
    assert_false(ask(1000, 1, 0, 0, 1000 + ASKERS_MAX));
    assert_false(ask(0, 1, 1, 100, 3000)); /* it lives */
    assert_true(ask(1000, 1, 0, 0, 1001 + ASKERS_FORGET_MS)); /* in the place of 1, which does not */
    assert_int_equal(askers.count, ASKERS_MAX);
    assert_false(ask(1, 1, 1001, 100, 1001 + ASKERS_FORGET_MS)); /* for which there is no place now */
    struct wire_peer gone = address_of(5);
    askers_forget(&askers, &gone);
    askers_forget(&askers, &gone);
    assert_int_equal(askers.count, ASKERS_MAX - 1);
    assert_true(ask(1, 1, 1001, 100, 1001 + ASKERS_FORGET_MS));
}

static void test_ending(void **state)
{
    (void)state;
    ask(1, 1, 0, 60000, 1000);
    ask(1, 1, 1001, 60000, 1000);
    assert_answered(1, 1, 5, 1000);
    ask(1, 2, 5, 60000, 1000);
    ask(2, 1, 0, 0, 1000);
    ask(2, 1, 2001, 0, 1000);
    askers_end_round(&askers, 0, 1000);
    assert_nobody(1000);
    assert_int_equal(askers_watching(&askers, 1000), 1); /* 2 asks but once */
    for (int i = 0; i < 2; i++) {
        struct asker *asker = askers_next(&askers, true, 1000);
        assert_non_null(asker);
        askers_answered(asker, 9, true, 1000);
    }
    assert_null(askers_next(&askers, true, 1000));
    ask(1, 3, 9, 60000, 1000); /* but it has been told */
    assert_null(askers_next(&askers, true, 1000));
    assert_int_equal(askers_watching(&askers, 999 + ASKERS_FORGET_MS), 1);
    assert_int_equal(askers_watching(&askers, 1000 + ASKERS_FORGET_MS), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_ticket, begin), cmocka_unit_test_setup(test_again, begin),
        cmocka_unit_test_setup(test_pause, begin),  cmocka_unit_test_setup(test_rounds, begin),
        cmocka_unit_test_setup(test_turns, begin),  cmocka_unit_test_setup(test_full, begin),
        cmocka_unit_test_setup(test_ending, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
