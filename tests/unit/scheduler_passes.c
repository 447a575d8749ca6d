/* The scheduler and jobs that begin with a survey, or of which an earlier run has left something. */
#include "tests/unit/scheduler_help.h"

static struct event surveyed_job(uint32_t survey_rows, uint32_t rows)
{
    return (struct event){.kind = EVENT_JOB, .survey_rows = survey_rows, .rows = rows};
}

/* --- surveys ---------------------------------------------------------------------------------------------- */

/* Rows of both passes count from 0; bands of a survey are cut automatically, and the render waits for the last. */
static void test_survey(void **state)
{
    (void)state;
    struct action grant;
    start(4);
    tell(surveyed_job(2, 6));
    expect(join(1, 1, 2), "announce w1 j0");
    expect(ready(1, 0), "grant w1 s0 0+1 #1, grant w1 s0 1+1 #2");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 2);
    assert_true(scheduler_lease(scheduler, 1, 2, &grant));
    assert_int_equal(grant.pass, PASS_SURVEY);
    expect(result(1, 2), "ack w1 #2, accept s0 1+1");
    expect(result(1, 1), "ack w1 #1, accept s0 0+1, surveyed j0, grant w1 j0 0+4 #3, grant w1 j0 4+2 #4");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 6);
    assert_true(scheduler_lease(scheduler, 1, 4, &grant));
    assert_int_equal(grant.pass, PASS_RENDER);
    expect(result(1, 1), "ack w1 #1"); /* of the survey, answered again */
    expect(result(1, 3), "ack w1 #3, accept j0 0+4");
    expect(result(1, 4), "ack w1 #4, accept j0 4+2, end w1 j0, done j0");
}

/* While a survey's last band is out there is the next job to work on. */
static void test_next_job_during_a_survey(void **state)
{
    (void)state;
    start(4);
    tell(surveyed_job(1, 4));
    tell(surveyed_job(1, 4));
    tell(join(1, 1, 1));
    tell(join(2, 1, 2));
    tell(ready(2, 0));
    expect(ready(2, 1), "grant w2 s1 0+1 #2");
    tell(ready(1, 0));
    expect(ready(1, 1), "");
    expect(result(2, 2), "ack w2 #2, accept s1 0+1, surveyed j1, grant w1 j1 0+4 #3");
    expect(result(2, 1), "ack w2 #1, accept s0 0+1, surveyed j0, grant w2 j0 0+4 #4");
    expect(result(1, 3), "ack w1 #3, accept j1 0+4, end w1 j1, end w2 j1, done j1");
    expect(result(2, 4), "ack w2 #4, accept j0 0+4, end w1 j0, end w2 j0, done j0");
}

/* Copies of a survey's band are revoked before the render begins, and how long a survey's bands took says nothing of
 * the render's. */
static void test_straggling_survey(void **state)
{
    (void)state;
    start(4);
    tell(surveyed_job(2, 4));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    expect(ready(1, 0), "grant w1 s0 0+1 #1");
    expect(ready(2, 0), "grant w2 s0 1+1 #2");
    now_ms += 10;
    expect(result(1, 1), "ack w1 #1, accept s0 0+1");
    now_ms += 200;
    expect(plain(EVENT_BEAT, 2), "grant w1 s0 1+1 #3");
    expect(result(1, 3), "ack w1 #3, accept s0 1+1, revoke w2 #2, surveyed j0, grant w1 j0 0+4 #4");
    now_ms += 1000;
    expect(plain(EVENT_BEAT, 2), "");
    expect(result(2, 2), "ack w2 #2");
    now_ms += 1000; /* two seconds, as where nothing was answered yet */
    expect(plain(EVENT_BEAT, 1), "grant w2 j0 0+4 #5");
    expect(result(2, 5), "ack w2 #5, accept j0 0+4, revoke w1 #4, end w1 j0, end w2 j0, done j0");
}

static void test_lost_survey(void **state)
{
    (void)state;
    start(4);
    tell(surveyed_job(1, 4));
    for (uint32_t worker = 1; worker <= SCHEDULER_LOSSES_MAX; worker++) {
        tell(join(worker, 1, 1));
        tell(ready(worker, 0));
        expect(plain(EVENT_LOST, worker), worker < SCHEDULER_LOSSES_MAX ? "" : "fail s0 0+1");
    }
}

/* --- what an earlier run left ----------------------------------------------------------------------------- */

static struct event resumed_job(uint32_t survey_rows, uint32_t rows, const struct kept_rows *kept, size_t count)
{
    return (struct event){.kind = EVENT_JOB, .survey_rows = survey_rows, .rows = rows, .kept = kept,
                          .kept_count = count};
}

/* Bands are cut from what is missing, and end where kept rows begin. */
static void test_kept_rows(void **state)
{
    (void)state;
    static const struct kept_rows kept[] = {{PASS_RENDER, 0, 2}, {PASS_RENDER, 5, 1}, {PASS_RENDER, 6, 3},
                                            {PASS_RENDER, 14, 6}};
    start(4);
    tell(resumed_job(0, 20, kept, 4));
    tell(join(1, 1, 3));
    expect(ready(1, 0), "grant w1 j0 2+3 #1, grant w1 j0 9+4 #2, grant w1 j0 13+1 #3");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 8);
    expect(result(1, 2), "ack w1 #2, accept j0 9+4");
    expect(plain(EVENT_LOST, 1), "");
    tell(join(2, 1, 3));
    expect(ready(2, 0), "grant w2 j0 2+3 #4, grant w2 j0 13+1 #5"); /* in the order in which they were lost */
    expect(result(2, 4), "ack w2 #4, accept j0 2+3");
    expect(result(2, 5), "ack w2 #5, accept j0 13+1, end w2 j0, done j0");
}

static void test_nothing_left_to_do(void **state)
{
    (void)state;
    static const struct kept_rows kept[] = {{PASS_SURVEY, 0, 2}, {PASS_RENDER, 0, 20}};
    start(4);
    expect(resumed_job(2, 20, kept, 2), "surveyed j0, done j0");
    expect(resumed_job(0, 20, kept + 1, 1), "done j1");
    tell(join(1, 1, 3));
    expect(job(4), "announce w1 j2");
    expect(ready(1, 2), "grant w1 j2 0+4 #1");
}

/* A whole survey and a part of the render; then a part of the survey. */
static void test_kept_survey(void **state)
{
    (void)state;
    static const struct kept_rows whole[] = {{PASS_SURVEY, 0, 3}, {PASS_RENDER, 4, 16}};
    static const struct kept_rows part[] = {{PASS_SURVEY, 0, 1}, {PASS_SURVEY, 2, 1}};
    start(4);
    expect(resumed_job(3, 20, whole, 2), "surveyed j0");
    tell(join(1, 1, 3));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
    expect(result(1, 1), "ack w1 #1, accept j0 0+4, end w1 j0, done j0");
    expect(resumed_job(3, 4, part, 2), "announce w1 j1");
    expect(ready(1, 1), "grant w1 s1 1+1 #2");
    expect(result(1, 2), "ack w1 #2, accept s1 1+1, surveyed j1, grant w1 j1 0+4 #3");
    expect(result(1, 3), "ack w1 #3, accept j1 0+4, end w1 j1, done j1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_survey, finish),
        cmocka_unit_test_teardown(test_next_job_during_a_survey, finish),
        cmocka_unit_test_teardown(test_straggling_survey, finish),
        cmocka_unit_test_teardown(test_lost_survey, finish),
        cmocka_unit_test_teardown(test_kept_rows, finish),
        cmocka_unit_test_teardown(test_nothing_left_to_do, finish),
        cmocka_unit_test_teardown(test_kept_survey, finish),
    };
    return cmocka_run_group_tests_name("scheduler's passes", tests, NULL, NULL);
}
