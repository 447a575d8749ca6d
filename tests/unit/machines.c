/* Machines as the wire tells them apart, what is held against them, and how many lines the log has for them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/machines.h"

static struct machines machines;

static int finish(void **state)
{
    (void)state;
    machines_finish(&machines);
    assert_int_equal(machines.count, 0);
    return 0;
}

static uint32_t number_of(uint32_t name)
{
    struct wire_machine machine = {{0}};
    memcpy(machine.id + 3, &name, sizeof name);
    return machines_number(&machines, &machine);
}

static struct machine *some_machine(void)
{
    return machines_find(&machines, number_of(1));
}

/* Known ones are found among all that are told apart; more there are not. */
static void test_numbers(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MACHINES_MAX; i++)
        assert_int_equal(number_of(i), i + 1);
    assert_int_equal(number_of(MACHINES_MAX), 0);
    assert_null(machines_find(&machines, 0));
    for (uint32_t i = 0; i < MACHINES_MAX; i += 97)
        assert_int_equal(number_of(i), i + 1);
}

static void test_trouble(void **state)
{
    (void)state;
    struct machine *machine = some_machine();
    machine_note_trouble(machine, "loom", 7, false, TROUBLE_STUCK, true);
    machine_note_trouble(machine, "loom", 7, false, TROUBLE_LOST, false);
    assert_int_equal(machine_trouble(machine, "loom", 7, false), TROUBLE_LOST);
    assert_int_equal(machine_trouble(machine, "loom", 8, false), TROUBLE_NONE);
    assert_int_equal(machine_trouble(machine, "shuttle", 7, false), TROUBLE_NONE);
    assert_int_equal(machine_trouble(machine, "loom", 7, true), TROUBLE_NONE); /* whoever says that it is one of ours */
}

static void test_failures(void **state)
{
    (void)state;
    struct machine *machine = some_machine();
    for (int i = 0; i < MACHINE_FAILURES_MAX; i++) {
        assert_false(machine_fails_too_often(machine, "loom", 7, false));
        machine_note_trouble(machine, "loom", 7, false, TROUBLE_UNFIT, true);
    }
    assert_true(machine_fails_too_often(machine, "loom", 7, false));
    assert_false(machine_fails_too_often(machine, "loom", 8, false));
    assert_false(machine_fails_too_often(machine, "loom", 7, true));
}

/* A new name each time does not help, nor does it cost more memory; but it does not hurt this process's own. */
static void test_many_failures(void **state)
{
    (void)state;
    struct machine *machine = some_machine();
    for (uint32_t i = 0; i <= MACHINE_PROCESSES_MAX; i++) {
        assert_false(machine_fails_too_often(machine, "loom", 1000, false));
        machine_note_trouble(machine, "loom", i, false, TROUBLE_UNFIT, true);
    }
    assert_true(machine_fails_too_often(machine, "loom", 1000, false));
    assert_false(machine_fails_too_often(machine, "loom", 1000, true));
    assert_int_equal(machine->process_count, MACHINE_PROCESSES_MAX);
}

/* Losses come and go; a failure among them is not forgotten. */
static void test_many_losses(void **state)
{
    (void)state;
    struct machine *machine = some_machine();
    for (int i = 0; i < MACHINE_FAILURES_MAX; i++)
        machine_note_trouble(machine, "loom", 7, false, TROUBLE_UNFIT, true);
    for (uint32_t i = 0; i < 1000; i++)
        machine_note_trouble(machine, "loom", 100 + i, false, TROUBLE_LOST, false);
    assert_int_equal(machine->process_count, MACHINE_PROCESSES_MAX);
    assert_true(machine_fails_too_often(machine, "loom", 7, false));
    assert_false(machine_fails_too_often(machine, "loom", 2000, false));
    assert_int_equal(machine_trouble(machine, "loom", 100, false), TROUBLE_NONE);
    assert_int_equal(machine_trouble(machine, "loom", 1099, false), TROUBLE_LOST);
}

/* One line of nonsense a minute, which tells of those that it stands for; other kinds have their own. */
static void test_lines(void **state)
{
    (void)state;
    struct machine *machine = some_machine();
    uint64_t passed_over;
    assert_true(machine_may_tell(machine, LINE_NONSENSE, 5000, &passed_over));
    assert_int_equal(passed_over, 0);
    for (int64_t now_ms = 5000; now_ms < 65000; now_ms += 100)
        assert_false(machine_may_tell(machine, LINE_NONSENSE, now_ms, &passed_over));
    assert_true(machine_may_tell(machine, LINE_REFUSAL, 64999, &passed_over));
    assert_int_equal(passed_over, 0);
    assert_true(machine_may_tell(machine, LINE_NONSENSE, 65000, &passed_over));
    assert_int_equal(passed_over, 600);
    assert_false(machine_may_tell(machine, LINE_NONSENSE, 65001, &passed_over));
    assert_true(machine_may_tell(machines_find(&machines, number_of(2)), LINE_NONSENSE, 65001, &passed_over));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_numbers, finish),
        cmocka_unit_test_teardown(test_trouble, finish),
        cmocka_unit_test_teardown(test_failures, finish),
        cmocka_unit_test_teardown(test_many_failures, finish),
        cmocka_unit_test_teardown(test_many_losses, finish),
        cmocka_unit_test_teardown(test_lines, finish),
    };
    return cmocka_run_group_tests_name("machines", tests, NULL, NULL);
}
