/* The scheduler's copies of bands that hold up the end. */
#include "tests/unit/scheduler_help.h"

/* Worker 1 answers a band after 100 ms; worker 2 sits on the other one. */
static void start_straggling(void)
{
    start_pair(10, 20);
    now_ms += 100;
    expect(result(1, 1), "ack w1 #1, accept j0 0+10");
}

/* Worker 1 needs 100 ms for such a band; worker 2 is taken to need half as long again as it has taken already. */
static void test_backup(void **state)
{
    (void)state;
    start_straggling();
    assert_true(scheduler_deadline(scheduler) == now_ms + 200);
    now_ms += 141;
    expect(plain(EVENT_TICK, 0), "");
    now_ms++;
    expect(plain(EVENT_TICK, 0), "grant w1 j0 10+10 #3");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 10);
    expect(result(1, 3), "ack w1 #3, accept j0 10+10, revoke w2 #2, end w1 j0, end w2 j0, done j0");
    expect(result(2, 2), "ack w2 #2"); /* too late, and harmless */
}

static void test_original_wins(void **state)
{
    (void)state;
    start_straggling();
    now_ms += 200;
    expect(plain(EVENT_TICK, 0), "grant w1 j0 10+10 #3");
    expect(result(2, 2), "ack w2 #2, accept j0 10+10, revoke w1 #3, end w1 j0, end w2 j0, done j0");
}

static void test_lost_original(void **state)
{
    (void)state;
    start_straggling();
    now_ms += 200;
    expect(plain(EVENT_TICK, 0), "grant w1 j0 10+10 #3");
    expect(plain(EVENT_LOST, 2), ""); /* its copy is still out */
    expect(plain(EVENT_LOST, 1), "");
    tell(join(3, 1, 1));
    expect(ready(3, 0), "grant w3 j0 10+10 #4");
}

/* While there are fresh rows nobody duplicates. */
static void test_no_backup_while_rows_wait(void **state)
{
    (void)state;
    start_pair(1, 1000);
    struct action grant, straggler;
    assert_true(scheduler_lease(scheduler, 2, 2, &straggler));
    for (uint64_t lease = 3; lease < 500; lease++) {
        now_ms += 10;
        tell(plain(EVENT_BEAT, 2));
        tell(result(1, lease == 3 ? 1 : lease - 1));
        assert_true(scheduler_lease(scheduler, 1, lease, &grant));
        assert_int_not_equal(grant.first_row, straggler.first_row);
    }
}

/* Workers that live but never answer: with nothing to compare with, patience is two seconds a holder. */
static void test_stuck_workers(void **state)
{
    (void)state;
    start(10);
    tell(job(10));
    for (uint32_t worker = 1; worker <= 3; worker++) {
        tell(join(worker, 1, 1));
        tell(ready(worker, 0));
    }
    static const char *const expected[] = {[4] = "grant w2 j0 0+10 #2", [8] = "grant w3 j0 0+10 #3"};
    for (size_t step = 0; step <= 20; step++, now_ms += 500) {
        expect(plain(EVENT_BEAT, 1), step < 9 && expected[step] ? expected[step] : "");
        expect(plain(EVENT_BEAT, 2), "");
        expect(plain(EVENT_BEAT, 3), "");
    }
    expect(result(3, 3), "ack w3 #3, accept j0 0+10, revoke w1 #1, revoke w2 #2, "
                         "end w1 j0, end w2 j0, end w3 j0, done j0");
}

/* Workers 2 and 3 are stuck for ten seconds before anybody takes over: no measure of what a band needs. */
static void test_wasted_time(void **state)
{
    (void)state;
    start(10);
    tell(job(30));
    for (uint32_t worker = 1; worker <= 3; worker++) {
        tell(join(worker, 1, 1));
        tell(ready(worker, 0));
    }
    now_ms += 100;
    expect(result(1, 1), "ack w1 #1, accept j0 0+10");
    expect(plain(EVENT_LEAVE, 1), "");
    for (int i = 0; i < 5; i++, now_ms += 2000)
        for (uint32_t worker = 2; worker <= 3; worker++)
            expect(plain(EVENT_BEAT, worker), "");
    tell(join(4, 1, 1));
    expect(ready(4, 0), "grant w4 j0 20+10 #4");
    now_ms += 100;
    expect(result(4, 4), "ack w4 #4, accept j0 20+10, revoke w3 #3, grant w4 j0 10+10 #5");
    assert_true(scheduler_deadline(scheduler) == now_ms + 300); /* as long as for the first copy */
    now_ms += 300;
    expect(plain(EVENT_BEAT, 3), "grant w3 j0 10+10 #6");
}

/* A straggler of a later job is duplicated too, though an earlier one is still open. */
static void test_backup_beyond_a_finished_job(void **state)
{
    (void)state;
    start(10);
    for (int i = 0; i < 3; i++)
        tell(job(20));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    for (uint32_t number = 1; number <= 2; number++) {
        tell(ready(1, number)); /* job 0 is never loaded */
        tell(ready(2, number));
        if (number == 1) {
            tell(result(1, 1));
            tell(result(2, 2));
        }
    }
    expect(result(1, 3), "ack w1 #3, accept j2 0+10");
    now_ms += 100;
    expect(plain(EVENT_TICK, 0), "grant w1 j2 10+10 #5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_backup, finish),
        cmocka_unit_test_teardown(test_original_wins, finish),
        cmocka_unit_test_teardown(test_lost_original, finish),
        cmocka_unit_test_teardown(test_no_backup_while_rows_wait, finish),
        cmocka_unit_test_teardown(test_stuck_workers, finish),
        cmocka_unit_test_teardown(test_wasted_time, finish),
        cmocka_unit_test_teardown(test_backup_beyond_a_finished_job, finish),
    };
    return cmocka_run_group_tests_name("scheduler's backups", tests, NULL, NULL);
}
