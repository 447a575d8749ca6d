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
    tell(job(100));
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

/* Answers every lease at once until the job is done; `grants` gets the bands in the order of granting. */
static size_t run_through(uint32_t rows, uint32_t threads, struct action *grants)
{
    size_t granted = 0, answered = 0;
    uint32_t accepted = 0;
    bool done = false;
    tell(job(rows));
    tell(join(1, threads, 2 * threads));
    tell(ready(1, 0));
    for (;;) {
        for (size_t i = 0; i < actions.count; i++) {
            const struct action *a = &actions.items[i];
            if (a->kind == ACTION_GRANT)
                grants[granted++] = *a;
            accepted += a->kind == ACTION_ACCEPT ? a->rows : 0;
            done |= a->kind == ACTION_DONE;
        }
        if (done)
            break;
        assert_true(answered < granted);
        now_ms++;
        tell(result(1, grants[answered++].lease));
    }
    assert_int_equal(accepted, rows);
    return granted;
}

/* Bands follow one another from row 0 to the last. Of automatic ones the first that a worker gets are small, since nobody
 * knows how fast it is; those after its first answer never grow. */
static void check_bands(uint32_t rows, uint32_t band_rows, uint32_t threads)
{
    struct action *grants = memory_array(rows, sizeof *grants);
    start(band_rows);
    size_t count = run_through(rows, threads, grants);
    uint32_t next = 0;
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(grants[i].first_row, next);
        assert_true(grants[i].rows >= 1);
        next += grants[i].rows;
        if (band_rows)
            assert_int_equal(grants[i].rows, i + 1 < count ? band_rows : rows - band_rows * (uint32_t)(count - 1));
        else
            assert_true(grants[i].rows <= (i < 2 * threads ? 4 : i == 2 * threads ? 32 : grants[i - 1].rows));
    }
    assert_int_equal(next, rows);
    free(grants);
}

static void test_bands_cover_the_picture(void **state)
{
    (void)state;
    static const uint32_t rows[] = {1, 2, 3, 7, 31, 64, 100, 719, 1080, 4321};
    static const uint32_t band_rows[] = {0, 1, 2, 5, 32, 719, 65535};
    static const uint32_t threads[] = {1, 2, 3, 16, 100, 2000};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
        for (size_t b = 0; b < sizeof band_rows / sizeof *band_rows; b++)
            for (size_t t = 0; t < sizeof threads / sizeof *threads; t++)
                check_bands(rows[r], band_rows[b], threads[t]);
}

/* Guided: large once the worker has answered, small at the end, and far fewer bands than rows. */
static void test_guided_bands_shrink(void **state)
{
    (void)state;
    struct action grants[1080];
    start(0);
    size_t count = run_through(1080, 4, grants);
    assert_int_equal(grants[0].rows, 4);
    assert_int_equal(grants[8].rows, 32);
    assert_in_range(grants[count - 1].rows, 1, 4);
    assert_in_range(count, 50, 80);
}

/* --- losses ----------------------------------------------------------------------------------------------- */

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
    start(50);
    tell(job(100));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
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

/* --- duplicates ------------------------------------------------------------------------------------------- */

/* Worker 1 answers a band after 100 ms; worker 2 sits on the other one. */
static void start_straggling(void)
{
    start(10);
    tell(job(20));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
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
    start(1);
    tell(job(1000));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
    for (uint64_t lease = 3; lease < 500; lease++) {
        now_ms += 10;
        tell(plain(EVENT_BEAT, 2));
        tell(result(1, lease == 3 ? 1 : lease - 1));
        struct action grant;
        assert_true(scheduler_lease(scheduler, 1, lease, &grant));
        assert_int_equal(grant.first_row, lease - 1);
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

/* --- pace ------------------------------------------------------------------------------------------------- */

static struct event beat(uint32_t worker, uint64_t progress)
{
    return (struct event){.kind = EVENT_BEAT, .worker = worker, .progress = progress};
}

/* Of rows that are cut automatically a worker that is ten times slower than the other gets a tenth. */
static void test_slow_worker_gets_less(void **state)
{
    (void)state;
    struct action grant;
    start(0);
    tell(job(10000));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
    expect(ready(2, 0), "grant w2 j0 4+4 #2");
    uint64_t lease = 1;
    for (int i = 0; i < 20; i++) { /* 32 rows take worker 1 100 ms, and the first 4 take worker 2 125 */
        now_ms += i == 0 ? 12 : 100;
        tell(result(1, lease));
        lease = i == 0 ? 3 : lease + (i == 2 ? 2 : 1);
        if (i == 1)
            tell(result(2, 2));
        assert_true(scheduler_lease(scheduler, 1, lease, &grant));
        assert_int_equal(grant.rows, 32);
    }
    assert_true(scheduler_lease(scheduler, 2, 5, &grant));
    assert_in_range(grant.rows, 4, 6);
}

/* Worker 2 advanced every two seconds and then no more: after eight times that others get its bands, and that it does not
 * get on is not held against them. The last one left is never expelled. */
static void test_stuck(void **state)
{
    (void)state;
    start(10);
    tell(job(20));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
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
    start(10);
    tell(job(20));
    tell(join(1, 1, 1));
    tell(join(2, 1, 1));
    tell(ready(1, 0));
    tell(ready(2, 0));
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

/* Without other jobs, the last rows of a picture that is small for so many threads go out one by one, and to threads
 * that have nothing to do. */
static void test_few_rows_for_many_threads(void **state)
{
    (void)state;
    start(0);
    tell(job(10));
    tell(join(1, 2, 4));
    tell(join(2, 2, 4));
    expect(ready(1, 0), "grant w1 j0 0+4 #1, grant w1 j0 4+4 #2");
    expect(ready(2, 0), "grant w2 j0 8+1 #3, grant w2 j0 9+1 #4");
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
        cmocka_unit_test_teardown(test_bands_cover_the_picture, finish),
        cmocka_unit_test_teardown(test_guided_bands_shrink, finish),
        cmocka_unit_test_teardown(test_lost_bands_come_first, finish),
        cmocka_unit_test_teardown(test_silence, finish),
        cmocka_unit_test_teardown(test_standstill, finish),
        cmocka_unit_test_teardown(test_drain, finish),
        cmocka_unit_test_teardown(test_leaving_is_no_loss, finish),
        cmocka_unit_test_teardown(test_three_losses, finish),
        cmocka_unit_test_teardown(test_backup, finish),
        cmocka_unit_test_teardown(test_original_wins, finish),
        cmocka_unit_test_teardown(test_lost_original, finish),
        cmocka_unit_test_teardown(test_no_backup_while_rows_wait, finish),
        cmocka_unit_test_teardown(test_stuck_workers, finish),
        cmocka_unit_test_teardown(test_wasted_time, finish),
        cmocka_unit_test_teardown(test_slow_worker_gets_less, finish),
        cmocka_unit_test_teardown(test_stuck, finish),
        cmocka_unit_test_teardown(test_loading_is_not_stuck, finish),
        cmocka_unit_test_teardown(test_loading_in_vain, finish),
        cmocka_unit_test_teardown(test_jobs_overlap, finish),
        cmocka_unit_test_teardown(test_late_joiner, finish),
        cmocka_unit_test_teardown(test_jobs_for_many_threads, finish),
        cmocka_unit_test_teardown(test_few_rows_for_many_threads, finish),
        cmocka_unit_test_teardown(test_backup_beyond_a_finished_job, finish),
        cmocka_unit_test_teardown(test_harmless_events, finish),
    };
    return cmocka_run_group_tests_name("scheduler", tests, NULL, NULL);
}
