/* The scheduler among strangers: machines instead of workers where it matters who is another. */
#include "tests/unit/scheduler_help.h"

static bool is_first(const void *context, uint32_t job_number, enum render_pass pass, uint32_t first_row)
{
    (void)context;
    (void)job_number;
    (void)pass;
    return first_row == 0;
}

static void start_auditing_first(void)
{
    start_with((struct scheduler_policy){.band_rows = 4, .audits = is_first});
}

static struct event of(uint32_t machine, struct event event)
{
    event.machine = machine;
    return event;
}

static struct event trusted(struct event event)
{
    event.trusted = true;
    return of(9, event);
}


/* --- losses ----------------------------------------------------------------------------------------------- */

/* Worker after worker of that machine comes and dies with the first band, which `took` expects it to get. */
static void lose_first(uint32_t worker, uint32_t machine, const char *took, const char *then)
{
    tell(of(machine, join(worker, 1, 1)));
    expect(ready(worker, 0), took);
    expect(plain(EVENT_LOST, worker), then);
}

static void lose_thrice(void)
{
    start(10);
    tell(job(20));
    lose_first(1, 5, "grant w1 j0 0+10 #1", "");
    lose_first(2, 5, "grant w2 j0 0+10 #2", "");
    lose_first(3, 5, "grant w3 j0 0+10 #3", "need trusted");
    assert_int_equal(actions.items[0].rows, 10);
}

/* The others' rows go on meanwhile; a machine that has not tried it yet may. */
static void test_one_machine(void **state)
{
    (void)state;
    lose_thrice();
    tell(of(5, join(4, 1, 2)));
    expect(ready(4, 0), "grant w4 j0 10+10 #4");
    expect(result(4, 4), "ack w4 #4, accept j0 10+10");
    tell(of(6, join(5, 1, 1)));
    expect(ready(5, 0), "grant w5 j0 0+10 #5");
    expect(result(5, 5), "ack w5 #5, accept j0 0+10, end w4 j0, end w5 j0, done j0");
}

static void test_last_resort(void **state)
{
    (void)state;
    lose_thrice();
    tell(trusted(join(4, 1, 1)));
    expect(ready(4, 0), "grant w4 j0 0+10 #4");
    expect(result(4, 4), "ack w4 #4, accept j0 0+10, grant w4 j0 10+10 #5");
}

/* It ends all the same if the rows are to blame: here with two trusted ones, */
static void test_deadly_rows(void **state)
{
    (void)state;
    lose_thrice();
    tell(trusted(join(4, 1, 1)));
    expect(ready(4, 0), "grant w4 j0 0+10 #4");
    expect(plain(EVENT_LOST, 4), "need trusted");
    tell(trusted(join(5, 1, 1)));
    expect(ready(5, 0), "grant w5 j0 0+10 #5");
    expect(plain(EVENT_LOST, 5), "fail j0 0+10");
    assert_int_equal(actions.items[0].lost_by[0], 1);
    assert_int_equal(actions.items[0].lost_by[1], 4);
    assert_int_equal(actions.items[0].lost_by[2], 5);
}

/* here with three machines, */
static void test_three_machines(void **state)
{
    (void)state;
    start(10);
    tell(job(10));
    lose_first(1, 5, "grant w1 j0 0+10 #1", "");
    lose_first(2, 5, "grant w2 j0 0+10 #2", "");
    lose_first(3, 6, "grant w3 j0 0+10 #3", "need trusted");
    lose_first(4, 7, "grant w4 j0 0+10 #4", "fail j0 0+10");
}

/* and here with three trusted ones of the one machine that there is. */
static void test_three_trusted(void **state)
{
    (void)state;
    start(10);
    tell(job(10));
    for (uint32_t worker = 1; worker <= 3; worker++) {
        tell(trusted(join(worker, 1, 1)));
        tell(ready(worker, 0));
        expect(plain(EVENT_LOST, worker), worker < 3 ? "" : "fail j0 0+10");
    }
}

/* A trusted one is asked for too when who holds the band neither dies nor answers. */
static void test_holder_in_doubt(void **state)
{
    (void)state;
    lose_thrice();
    tell(of(6, join(4, 1, 2)));
    expect(ready(4, 0), "grant w4 j0 0+10 #4, grant w4 j0 10+10 #5");
    tell(trusted(join(5, 1, 1)));
    tell(plain(EVENT_LEAVE, 5));
    now_ms += 1000;
    expect(plain(EVENT_BEAT, 4), "");
    now_ms += 1000;
    expect(plain(EVENT_BEAT, 4), "need trusted");
}

/* After its caller stood still nobody is to blame for silence. */
static void test_slept(void **state)
{
    (void)state;
    for (int slept = 0; slept < 2; slept++) {
        start(10);
        tell(job(10));
        for (uint32_t worker = 1; worker <= 3; worker++) {
            tell(join(worker, 1, 1));
            tell(ready(worker, 0));
            now_ms += SILENCE_MS;
            tell((struct event){.kind = EVENT_TICK, .slept = slept});
        }
        assert_int_equal(actions.items[actions.count - 1].kind, slept ? ACTION_EXPEL : ACTION_FAIL);
    }
}

/* --- newcomers -------------------------------------------------------------------------------------------- */

static void test_newcomers(void **state)
{
    (void)state;
    start_with((struct scheduler_policy){.band_rows = 1, .newcomer_bands = 2});
    tell(job(20));
    tell(join(1, 1, 3));
    tell(join(2, 8, 1000));
    tell(trusted(join(3, 1, 3)));
    expect(ready(1, 0), "grant w1 j0 0+1 #1");
    expect(ready(2, 0), "grant w2 j0 1+1 #2, grant w2 j0 2+1 #3");
    expect(ready(3, 0), "grant w3 j0 3+1 #4, grant w3 j0 4+1 #5, grant w3 j0 5+1 #6");
    expect(result(1, 9), "ack w1 #9"); /* an answer to nothing is none */
    expect(result(1, 1), "ack w1 #1, accept j0 0+1, grant w1 j0 6+1 #7, grant w1 j0 7+1 #8, grant w1 j0 8+1 #9");
}

/* --- audits ----------------------------------------------------------------------------------------------- */

/* Another worker of the same machine may lie alike. */
static void test_audit_elsewhere(void **state)
{
    (void)state;
    start_auditing_first();
    tell(job(8));
    tell(of(5, join(1, 1, 1)));
    tell(of(5, join(2, 1, 1)));
    tell(ready(1, 0));
    tell(ready(2, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+4");
    expect(result(2, 2), "ack w2 #2, accept j0 4+4, need trusted");
    assert_int_equal(actions.items[actions.count - 1].rows, 0);
    tell(of(6, join(3, 1, 1)));
    expect(ready(3, 0), "grant w3 j0 0+4 #3");
}

/* Where all are trusted, they audit one another; */
static void test_trusted_alone(void **state)
{
    (void)state;
    start_auditing_first();
    tell(job(8));
    tell(trusted(join(1, 1, 1)));
    tell(trusted(join(2, 1, 1)));
    tell(ready(1, 0));
    tell(ready(2, 0));
    expect(result(1, 1), "ack w1 #1, accept j0 0+4");
    expect(result(2, 2), "ack w2 #2, accept j0 4+4, grant w2 j0 0+4 #3");
}

/* else others come first, as long as there are some. */
static void test_trusted_wait_for_others(void **state)
{
    (void)state;
    start_auditing_first();
    tell(job(8));
    tell(trusted(join(1, 1, 1)));
    tell(trusted(join(2, 1, 1)));
    tell(of(5, join(3, 1, 1)));
    tell(ready(1, 0));
    tell(ready(2, 0));
    tell(result(1, 1));
    expect(result(2, 2), "ack w2 #2, accept j0 4+4");
    expect(plain(EVENT_LEAVE, 3), "grant w2 j0 0+4 #3");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_one_machine, finish),
        cmocka_unit_test_teardown(test_last_resort, finish),
        cmocka_unit_test_teardown(test_deadly_rows, finish),
        cmocka_unit_test_teardown(test_three_machines, finish),
        cmocka_unit_test_teardown(test_three_trusted, finish),
        cmocka_unit_test_teardown(test_holder_in_doubt, finish),
        cmocka_unit_test_teardown(test_slept, finish),
        cmocka_unit_test_teardown(test_newcomers, finish),
        cmocka_unit_test_teardown(test_audit_elsewhere, finish),
        cmocka_unit_test_teardown(test_trusted_alone, finish),
        cmocka_unit_test_teardown(test_trusted_wait_for_others, finish),
    };
    return cmocka_run_group_tests_name("scheduler among strangers", tests, NULL, NULL);
}
