/* The scheduler's audits, and what is done about liars. */
#include "tests/unit/scheduler_help.h"

/* Rows from 0 to *context − 1 are audited. */
static bool is_audited(const void *context, uint32_t job_number, enum render_pass pass, uint32_t first_row)
{
    (void)job_number;
    (void)pass;
    return first_row < *(const uint32_t *)context;
}

static void start_auditing(uint32_t audited_rows)
{
    static uint32_t rows;
    rows = audited_rows;
    start_with((struct scheduler_policy){.band_rows = 4, .audits = is_audited, .audits_context = &rows});
}

static struct event trusted(struct event event)
{
    event.trusted = true;
    return event;
}

static struct event about(enum event_kind kind, enum render_pass pass, uint32_t first_row)
{
    return (struct event){.kind = kind, .pass = pass, .first_row = first_row};
}

/* --- audits ----------------------------------------------------------------------------------------------- */

/* Two workers, of one thread and one band each, and a job of 8 rows, of which the first 4 are audited. */
static void start_two(void)
{
    start_auditing(4);
    tell(job(8));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
    expect(ready(2, 0), "grant w2 j0 4+4 #2");
    expect(result(1, 1), "ack w1 #1, accept j0 0+4");
    expect(result(2, 2), "ack w2 #2, accept j0 4+4, grant w2 j0 0+4 #3");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 0); /* all are accepted */
}

static void test_audit(void **state)
{
    (void)state;
    start_two();
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), ""); /* before it is answered: no */
    expect(result(2, 3), "ack w2 #3, audited w2 j0 0+4 of w1");
    expect(plain(EVENT_TICK, 0), "");
    expect(about(EVENT_SETTLED, PASS_SURVEY, 0), "");
    expect(about(EVENT_SETTLED, PASS_RENDER, 4), "");
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), "end w1 j0, end w2 j0, done j0");
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), "");
}

/* Before bands that nobody has had yet. */
static void test_audits_come_first(void **state)
{
    (void)state;
    start_auditing(4);
    tell(job(20));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+4, grant w1 j0 8+4 #3");
    expect(result(2, 2), "ack w2 #2, accept j0 4+4, grant w2 j0 0+4 #4");
}

static void test_lost_audit(void **state)
{
    (void)state;
    start_two();
    expect(plain(EVENT_LOST, 2), "need trusted");
    expect(plain(EVENT_BEAT, 1), ""); /* said once */
    expect(join(3, 1, 1), "announce w3 j0");
    expect(ready(3, 0), "grant w3 j0 0+4 #4");
    expect(result(3, 4), "ack w3 #4, audited w3 j0 0+4 of w1");
}

/* An audit that is late is copied, but not to whose rows it is about. So somebody else is asked for. */
static void test_late_audit(void **state)
{
    (void)state;
    start_two();
    now_ms += 2500;
    expect(plain(EVENT_BEAT, 1), "need trusted");
    tell(join(3, 1, 1));
    tell(plain(EVENT_BEAT, 2));
    now_ms += 10;
    expect(ready(3, 0), "grant w3 j0 0+4 #4");
    expect(result(3, 4), "ack w3 #4, audited w3 j0 0+4 of w1, revoke w2 #3");
}

static void test_judgement(void **state)
{
    (void)state;
    start_two();
    expect(result(2, 3), "ack w2 #3, audited w2 j0 0+4 of w1");
    expect(join(3, 1, 1), "announce w3 j0");
    tell(ready(3, 0));
    expect(about(EVENT_JUDGE, PASS_RENDER, 0), "need trusted");
    expect(plain(EVENT_TICK, 0), "");
    expect(trusted(join(4, 1, 1)), "announce w4 j0");
    expect(ready(4, 0), "grant w4 j0 0+4 #4");
    expect(result(4, 4), "ack w4 #4, audited w4 j0 0+4 of w1");
    expect(about(EVENT_JUDGE, PASS_RENDER, 0), "need trusted"); /* another one */
    tell(trusted(join(5, 1, 1)));
    expect(ready(5, 0), "grant w5 j0 0+4 #5");
    expect(plain(EVENT_LEAVE, 5), "need trusted");
}

/* Nobody is asked for while there is other work for the job. */
static void test_alone(void **state)
{
    (void)state;
    start_auditing(8);
    tell(job(8));
    tell(join(1, 1, 2));
    tell(ready(1, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+4");
    expect(result(1, 2), "ack w1 #2, accept j0 4+4, need trusted");
    tell(trusted(join(2, 1, 2)));
    expect(ready(2, 0), "grant w2 j0 0+4 #3, grant w2 j0 4+4 #4");
    expect(plain(EVENT_DRAIN, 1), "");
    expect(result(2, 3), "ack w2 #3, audited w2 j0 0+4 of w1");
    expect(result(2, 4), "ack w2 #4, audited w2 j0 4+4 of w1");
    expect(about(EVENT_SETTLED, PASS_RENDER, 4), "");
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), "end w1 j0, end w2 j0, done j0");
}

/* A survey waits for its audits too; those of the render are others. */
static void test_audited_survey(void **state)
{
    (void)state;
    start_auditing(1);
    tell((struct event){.kind = EVENT_JOB, .survey_rows = 1, .rows = 4});
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    expect(ready(1, 0), "grant w1 s0 0+1 #1");
    tell(ready(2, 0));
    expect(result(1, 1), "ack w1 #1, accept s0 0+1, grant w2 s0 0+1 #2");
    expect(result(2, 2), "ack w2 #2, audited w2 s0 0+1 of w1");
    expect(about(EVENT_SETTLED, PASS_SURVEY, 0), "surveyed j0, grant w1 j0 0+4 #3");
    expect(result(1, 3), "ack w1 #3, accept j0 0+4, grant w2 j0 0+4 #4");
    expect(result(2, 4), "ack w2 #4, audited w2 j0 0+4 of w1");
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), "end w1 j0, end w2 j0, done j0");
}

/* --- liars ------------------------------------------------------------------------------------------------ */

/* What it delivered is rendered again, what it holds too, and audits of it vanish. */
static void test_liar(void **state)
{
    (void)state;
    start_auditing(8);
    tell(job(16));
    tell(join(1, 1, 1));
    tell(join(2, 1, 2));
    tell(join(3, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
    expect(result(1, 1), "ack w1 #1, accept j0 0+4, grant w1 j0 4+4 #2");
    expect(result(1, 2), "ack w1 #2, accept j0 4+4, grant w1 j0 8+4 #3");
    expect(ready(2, 0), "grant w2 j0 0+4 #4, grant w2 j0 4+4 #5");
    expect(result(2, 4), "ack w2 #4, audited w2 j0 0+4 of w1, grant w2 j0 12+4 #6");
    expect(plain(EVENT_LIAR, 1), "expel w1, which lied, undo j0 0+4, undo j0 4+4, revoke w2 #5, grant w2 j0 8+4 #7");
    expect(about(EVENT_SETTLED, PASS_RENDER, 0), "");
    expect(plain(EVENT_LIAR, 1), "");
    expect(result(1, 3), ""); /* it is not heard any more */
    expect(result(2, 6), "ack w2 #6, accept j0 12+4, grant w2 j0 0+4 #8");
    expect(result(2, 7), "ack w2 #7, accept j0 8+4, grant w2 j0 4+4 #9");
    expect(result(2, 8), "ack w2 #8, accept j0 0+4"); /* chosen again */
    expect(ready(3, 0), "grant w3 j0 0+4 #10");
}

/* One that is gone already; and nothing is undone of a job that is over. */
static void test_liar_that_is_gone(void **state)
{
    (void)state;
    start_auditing(0);
    tell(job(4));
    tell(job(8));
    tell(join(1, 1, 1));
    tell(ready(1, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+4, end w1 j0, done j0");
    tell(ready(1, 1));
    expect(result(1, 2), "ack w1 #2, accept j1 0+4, grant w1 j1 4+4 #3");
    expect(plain(EVENT_LEAVE, 1), "");
    expect(plain(EVENT_LIAR, 1), "undo j1 0+4");
}

/* All of a render rests on its survey. */
static void test_liar_in_the_survey(void **state)
{
    (void)state;
    start_auditing(1);
    tell((struct event){.kind = EVENT_JOB, .survey_rows = 1, .rows = 8});
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
    tell(result(1, 1));
    tell(result(2, 2));
    expect(about(EVENT_SETTLED, PASS_SURVEY, 0), "surveyed j0, grant w1 j0 0+4 #3, grant w2 j0 4+4 #4");
    expect(result(1, 3), "ack w1 #3, accept j0 0+4");
    expect(plain(EVENT_LIAR, 1), "expel w1, which lied, revoke w2 #4, restart j0, grant w2 s0 0+1 #5");
    expect(result(2, 4), "ack w2 #4");
    expect(result(2, 5), "ack w2 #5, accept s0 0+1, need trusted");
}

/* Kept rows are audited like others; if they lie, nothing is kept. */
static void test_kept_rows(void **state)
{
    (void)state;
    static const struct kept_rows kept[] = {{PASS_RENDER, 0, 2}, {PASS_RENDER, 2, 6}};
    start_auditing(1);
    expect(((struct event){.kind = EVENT_JOB, .rows = 8, .kept = kept, .kept_count = 2}), "need trusted");
    tell(join(1, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+2 #1");
    expect(result(1, 1), "ack w1 #1, audited w1 j0 0+2 of w0");
    expect(about(EVENT_JUDGE, PASS_RENDER, 0), "");
    tell(trusted(join(2, 1, 1)));
    expect(ready(2, 0), "grant w2 j0 0+2 #2");
    expect(result(2, 2), "ack w2 #2, audited w2 j0 0+2 of w0");
    expect(plain(EVENT_LIAR, 0), "restart j0, grant w1 j0 0+4 #3, grant w2 j0 4+4 #4");
    expect(plain(EVENT_LIAR, 0), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_audit, finish),
        cmocka_unit_test_teardown(test_audits_come_first, finish),
        cmocka_unit_test_teardown(test_lost_audit, finish),
        cmocka_unit_test_teardown(test_late_audit, finish),
        cmocka_unit_test_teardown(test_judgement, finish),
        cmocka_unit_test_teardown(test_alone, finish),
        cmocka_unit_test_teardown(test_audited_survey, finish),
        cmocka_unit_test_teardown(test_liar, finish),
        cmocka_unit_test_teardown(test_liar_that_is_gone, finish),
        cmocka_unit_test_teardown(test_liar_in_the_survey, finish),
        cmocka_unit_test_teardown(test_kept_rows, finish),
    };
    return cmocka_run_group_tests_name("scheduler's audits", tests, NULL, NULL);
}
