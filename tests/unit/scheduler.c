/* The scheduler, driven through histories written by hand. */
#include "tests/unit/scheduler_help.h"

/* --- an ordinary job -------------------------------------------------------------------------------------- */

static void test_one_worker(void **state)
{
    (void)state;
    start(4);
    assert_true(scheduler_deadline(scheduler) == INT64_MAX);
    expect(job(10), "");
    expect(join(1, 1, 2), "announce w1 j0");
    expect(ready(1, 0), "grant w1 j0 0+4 #1, grant w1 j0 4+4 #2");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 8);
    expect(result(1, 1), "ack w1 #1, accept j0 0+4, grant w1 j0 8+2 #3");
    expect(result(1, 3), "ack w1 #3, accept j0 8+2");
    expect(result(1, 2), "ack w1 #2, accept j0 4+4, end w1 j0, done j0");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 0);
    expect(plain(EVENT_TICK, 0), "");
}

static void test_lease_lookup(void **state)
{
    (void)state;
    struct action grant;
    start(4);
    tell(job(10));
    tell(join(7, 1, 2));
    tell(ready(7, 0));
    assert_true(scheduler_lease(scheduler, 7, 2, &grant));
    assert_int_equal(grant.job, 0);
    assert_int_equal(grant.first_row, 4);
    assert_int_equal(grant.rows, 4);
    assert_false(scheduler_lease(scheduler, 7, 3, &grant));
    assert_false(scheduler_lease(scheduler, 1, 2, &grant));
    assert_int_equal(scheduler_rows_leased(scheduler, 5), 0);
}

/* Nothing is given before a worker is ready, and nothing beyond its credit. */
static void test_credit(void **state)
{
    (void)state;
    start(1);
    tell(job(20));
    tell(join(1, 4, 3));
    tell(join(2, 4, 1));
    expect(plain(EVENT_BEAT, 1), "");
    expect(ready(2, 0), "grant w2 j0 0+1 #1");
    expect(ready(1, 0), "grant w1 j0 1+1 #2, grant w1 j0 2+1 #3, grant w1 j0 3+1 #4");
    expect(ready(1, 0), ""); /* said twice */
    expect(result(1, 3), "ack w1 #3, accept j0 2+1, grant w1 j0 4+1 #5");
}

/* Where several can take more, bands go round, one each. */
static void test_turns(void **state)
{
    (void)state;
    start(1);
    tell(job(4));
    tell(job(4)); /* nobody has it yet; if it were not there, a worker would get no second band of so few */
    tell(join(1, 1, 4));
    tell(join(2, 1, 4));
    tell(join(3, 1, 4));
    tell(ready(1, 0));
    expect(ready(2, 0), "");
    expect(ready(3, 0), "");
    expect(plain(EVENT_LOST, 1), "grant w2 j0 0+1 #5, grant w3 j0 1+1 #6, grant w2 j0 2+1 #7, grant w3 j0 3+1 #8");
}

/* --- several jobs ----------------------------------------------------------------------------------------- */

static void test_jobs_overlap(void **state)
{
    (void)state;
    start(10);
    tell(join(1, 1, 2));
    expect(job(20), "announce w1 j0");
    expect(job(20), "announce w1 j1");
    expect(job(20), ""); /* two at a time */
    expect(ready(1, 1), "grant w1 j1 0+10 #1, grant w1 j1 10+10 #2"); /* rather than wait for the first */
    expect(ready(1, 0), "");
    expect(result(1, 1), "ack w1 #1, accept j1 0+10, grant w1 j0 0+10 #3");
    expect(result(1, 2), "ack w1 #2, accept j1 10+10, end w1 j1, done j1, announce w1 j2, grant w1 j0 10+10 #4");
    expect(ready(1, 2), "");
    expect(result(1, 3), "ack w1 #3, accept j0 0+10, grant w1 j2 0+10 #5"); /* job 0 has no more to hand out */
    expect(result(1, 5), "ack w1 #5, accept j2 0+10, grant w1 j2 10+10 #6");
    expect(result(1, 4), "ack w1 #4, accept j0 10+10, end w1 j0, done j0");
    expect(result(1, 6), "ack w1 #6, accept j2 10+10, end w1 j2, done j2");
}

static void test_late_joiner(void **state)
{
    (void)state;
    start(10);
    for (int i = 0; i < 4; i++)
        tell(job(10));
    tell(join(1, 1, 1));
    tell(ready(1, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+10, end w1 j0, done j0, announce w1 j2");
    expect(join(2, 1, 1), "announce w2 j1, announce w2 j2");
    expect(ready(2, 2), "grant w2 j2 0+10 #2");
    expect(ready(2, 0), ""); /* over, and never announced to it */
}

/* Workers are told of as many jobs as it takes to keep all threads busy, and no more. */
static void test_jobs_for_many_threads(void **state)
{
    (void)state;
    start(1);
    for (int i = 0; i < 9; i++)
        tell(job(10));
    expect(join(1, 10, 10), "announce w1 j0, announce w1 j1");
    expect(join(2, 5, 2), "announce w2 j0, announce w2 j1, announce w1 j2, announce w2 j2");
    expect(ready(2, 1), "grant w2 j1 0+1 #1, grant w2 j1 1+1 #2");
    expect(plain(EVENT_BEAT, 1), "announce w1 j3, announce w2 j3"); /* 28 rows were waiting */
    expect(plain(EVENT_BEAT, 1), "");
}

/* --- what should not happen ------------------------------------------------------------------------------- */

static void test_harmless_events(void **state)
{
    (void)state;
    static const enum event_kind kinds[] = {EVENT_READY, EVENT_BEAT,  EVENT_RESULT,
                                            EVENT_DRAIN, EVENT_LEAVE, EVENT_LOST};
    start(10);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) /* of a worker that nobody knows */
        expect((struct event){.kind = kinds[i], .worker = 9, .job = 9, .lease = 9}, "");
    tell(job(30));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    expect(join(1, 50, 50), ""); /* twice: the first counts */
    expect(ready(1, 1), "");
    expect(ready(1, UINT32_MAX), "");
    expect(ready(1, 0), "grant w1 j0 0+10 #1");
    expect(ready(2, 0), "grant w2 j0 10+10 #2");
    expect(result(1, 99), "ack w1 #99");
    expect(result(1, 2), "ack w1 #2"); /* another's lease */
    expect(result(1, 1), "ack w1 #1, accept j0 0+10, grant w1 j0 20+10 #3");
    expect(result(1, 1), "ack w1 #1"); /* answered twice */
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_one_worker, finish),
        cmocka_unit_test_teardown(test_lease_lookup, finish),
        cmocka_unit_test_teardown(test_credit, finish),
        cmocka_unit_test_teardown(test_turns, finish),
        cmocka_unit_test_teardown(test_jobs_overlap, finish),
        cmocka_unit_test_teardown(test_late_joiner, finish),
        cmocka_unit_test_teardown(test_jobs_for_many_threads, finish),
        cmocka_unit_test_teardown(test_harmless_events, finish),
    };
    return cmocka_run_group_tests_name("scheduler", tests, NULL, NULL);
}
