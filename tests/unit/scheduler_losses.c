/* The scheduler and workers that go: dead, silent, leaving, stuck. */
#include "tests/unit/scheduler_help.h"

static void test_lost_bands_come_first(void **state)
{
    (void)state;
    start(4);
    tell(job(100));
    tell(join(1, 1, 2));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    expect(ready(2, 0), "grant w2 j0 8+4 #3");
    expect(plain(EVENT_LOST, 1), "");
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 4);
    expect(result(2, 3), "ack w2 #3, accept j0 8+4, grant w2 j0 0+4 #4");
    expect(result(2, 4), "ack w2 #4, accept j0 0+4, grant w2 j0 4+4 #5");
    expect(result(2, 5), "ack w2 #5, accept j0 4+4, grant w2 j0 12+4 #6");
}

static void test_silence(void **state)
{
    (void)state;
    start_pair(50, 100);
    now_ms += SILENCE_MS - 1;
    expect(plain(EVENT_BEAT, 2), "");
    assert_true(scheduler_deadline(scheduler) == now_ms + 1);
    now_ms++;
    expect(plain(EVENT_TICK, 0), "expel w1");
    expect(plain(EVENT_BEAT, 1), ""); /* what it says from now on is not heard */
    expect(result(1, 1), "");
    expect(result(2, 2), "ack w2 #2, accept j0 50+50, grant w2 j0 0+50 #3");
    now_ms += SILENCE_MS;
    expect(plain(EVENT_TICK, 0), "expel w2");
    assert_true(scheduler_deadline(scheduler) == INT64_MAX);
}

/* After the coordinator itself stood still all seem silent, until what they said meanwhile has been told. */
static void test_standstill(void **state)
{
    (void)state;
    start(50);
    tell(job(100));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    now_ms += 2 * SILENCE_MS;
    actions.count = 0;
    scheduler_handle(scheduler, &(struct event){.kind = EVENT_BEAT, .worker = 1}, now_ms, &actions);
    assert_int_equal(actions.count, 0);
    expect(plain(EVENT_BEAT, 2), "");
    expect(plain(EVENT_TICK, 0), "");
}

static void test_drain(void **state)
{
    (void)state;
    start(10);
    tell(job(100));
    tell(join(1, 1, 2));
    expect(ready(1, 0), "grant w1 j0 0+10 #1, grant w1 j0 10+10 #2");
    expect(plain(EVENT_DRAIN, 1), "");
    expect(job(5), ""); /* not told to one that is about to go */
    expect(result(1, 1), "ack w1 #1, accept j0 0+10");
    expect(join(2, 1, 1), "announce w2 j0, announce w2 j1");
    expect(ready(2, 0), "grant w2 j0 20+10 #3");
    expect(result(1, 2), "ack w1 #2, accept j0 10+10");
    expect(plain(EVENT_LEAVE, 1), "");
}

/* A goodbye gives bands back too, but is no loss that counts against them. */
static void test_leaving_is_no_loss(void **state)
{
    (void)state;
    start(10);
    tell(job(10));
    for (uint32_t worker = 1; worker <= 10; worker++) {
        tell(join(worker, 1, 1));
        tell(ready(worker, 0));
        expect(plain(EVENT_LEAVE, worker), "");
    }
}

static void test_three_losses(void **state)
{
    (void)state;
    start(10);
    tell(job(30));
    tell(job(7));
    tell(join(1, 1, 1));
    for (uint32_t worker = 2; worker <= 4; worker++) {
        tell(join(worker, 1, 1));
        tell(ready(worker, 0));
        if (worker < 4)
            expect(plain(EVENT_LOST, worker), "");
    }
    expect(ready(1, 0), "grant w1 j0 10+10 #4");
    expect(plain(EVENT_LOST, 4), "revoke w1 #4, end w1 j0, fail j0 0+10");
    expect(result(1, 4), "ack w1 #4");
    expect(ready(1, 1), "grant w1 j1 0+7 #5"); /* the next job is not touched */
}

/* --- those that do not get on ----------------------------------------------------------------------------- */

static struct event beat(uint32_t worker, uint64_t progress)
{
    return (struct event){.kind = EVENT_BEAT, .worker = worker, .progress = progress};
}

/* Worker 2 advanced every two seconds and then no more: after eight times that others get its bands, and that it does
 * not get on is not held against them. The last one left is never expelled. */
static void test_stuck(void **state)
{
    (void)state;
    start_pair(10, 20);
    uint64_t progress = 1;
    for (int i = 0; i < 5; i++, now_ms += 2000, progress++) {
        tell(beat(1, progress));
        tell(beat(2, progress));
    }
    for (int i = 0; i < 6; i++, progress++) {
        expect(beat(1, progress), "");
        expect(beat(2, 5), "");
        now_ms += 2000;
    }
    expect(beat(1, progress), "");
    now_ms += 1999;
    expect(beat(2, 5), "");
    now_ms++;
    expect(plain(EVENT_TICK, 0), ""); /* it may have said meanwhile how it gets on */
    expect(beat(2, 5), "");
    assert_true(scheduler_deadline(scheduler) == now_ms);
    expect(plain(EVENT_TICK, 0), "expel w2");
    assert_true(actions.items[0].stuck);
    for (int i = 0; i < 30; i++, now_ms += 3000) {
        expect(beat(1, progress), "");
        expect(plain(EVENT_TICK, 0), "");
    }
    expect(result(1, 1), "ack w1 #1, accept j0 0+10, grant w1 j0 10+10 #3");
}

/* Two workers, ready; worker 2 advanced every second and then no more: its threads load the next job. */
static void start_loading(void)
{
    start_pair(10, 20);
    for (uint64_t progress = 1; progress <= 5; progress++, now_ms += 1000)
        for (uint32_t worker = 1; worker <= 2; worker++)
            tell(beat(worker, progress));
    expect(job(20), "announce w1 j1, announce w2 j1");
    tell(ready(1, 1));
}

/* For `seconds` worker 1 advances and worker 2 does not. */
static void load_on(int seconds)
{
    static uint64_t progress = 100;
    for (int i = 0; i < seconds; i++, now_ms += 1000) {
        expect(beat(1, progress++), "");
        expect(beat(2, 5), "");
        expect(plain(EVENT_TICK, 0), "");
    }
}

/* As long as it loads it is not stuck; then it has as long as ever. */
static void test_loading_is_not_stuck(void **state)
{
    (void)state;
    start_loading();
    load_on(60);
    tell(ready(2, 1));
    load_on(10);
    expect(beat(2, 5), "");
    expect(plain(EVENT_TICK, 0), "expel w2");
    assert_true(actions.items[0].stuck);
}

/* The job that it loads is over before it is ready: the same. */
static void test_loading_in_vain(void **state)
{
    (void)state;
    start_loading();
    load_on(20);
    expect(result(1, 1), "ack w1 #1, accept j0 0+10, grant w1 j1 0+10 #3");
    expect(result(1, 3), "ack w1 #3, accept j1 0+10, grant w1 j1 10+10 #4");
    expect(result(1, 4), "ack w1 #4, accept j1 10+10, end w1 j1, end w2 j1, done j1");
    load_on(10);
    expect(beat(2, 5), "");
    expect(plain(EVENT_TICK, 0), "expel w2, grant w1 j0 10+10 #5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_lost_bands_come_first, finish),
        cmocka_unit_test_teardown(test_silence, finish),
        cmocka_unit_test_teardown(test_standstill, finish),
        cmocka_unit_test_teardown(test_drain, finish),
        cmocka_unit_test_teardown(test_leaving_is_no_loss, finish),
        cmocka_unit_test_teardown(test_three_losses, finish),
        cmocka_unit_test_teardown(test_stuck, finish),
        cmocka_unit_test_teardown(test_loading_is_not_stuck, finish),
        cmocka_unit_test_teardown(test_loading_in_vain, finish),
    };
    return cmocka_run_group_tests_name("scheduler's losses", tests, NULL, NULL);
}
