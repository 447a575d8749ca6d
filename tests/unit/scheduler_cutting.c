/* How the scheduler cuts a picture into bands. */
#include "tests/unit/scheduler_help.h"

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

static uint32_t soundings_of(uint32_t rows, uint32_t sounding_rows, uint32_t threads)
{
    uint32_t count = rows / 48 < 16 ? 16 : rows / 48 > 32 ? 32 : rows / 48;
    count = count < rows / 2 / sounding_rows ? count : rows / 2 / sounding_rows;
    return count >= 16 && rows >= 8 * threads ? count : 0;
}

/* Soundings come first, each in another part of the picture; then all other rows from the top. Automatic bands before a
 * worker's first answer are low, since nobody knows how fast it is. */
static void check_bands(uint32_t rows, uint32_t band_rows, uint32_t threads)
{
    struct action *grants = memory_array(rows, sizeof *grants);
    bool *granted = memory_array(rows + 1, sizeof *granted);
    uint32_t low = band_rows > 0 ? band_rows : 4, next = 0, soundings = soundings_of(rows, low, threads);
    uint64_t parts = 0;
    start(band_rows);
    size_t count = run_through(rows, threads, grants);
    for (size_t i = 0; i < count; i++) {
        uint32_t first = grants[i].first_row, end = first + grants[i].rows;
        for (; next < first && i >= soundings; next++)
            assert_true(granted[next]);
        for (uint32_t row = first; row < end; row++) {
            assert_false(granted[row]);
            granted[row] = true;
        }
        parts |= i < soundings ? UINT64_C(1) << first * soundings / rows : 0;
        assert_true(grants[i].rows <= (i < 2 * threads ? low : band_rows > 0 ? band_rows : 48));
        if (i < soundings || band_rows > 0)
            assert_true(grants[i].rows == low || end == rows || granted[end]);
    }
    assert_true(parts == (UINT64_C(1) << soundings) - 1);
    for (uint32_t row = 0; row < rows; row++)
        assert_true(granted[row]);
    free(granted);
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
    assert_in_range(grants[22].rows, 16, 48); /* after 22 soundings */
    assert_in_range(grants[count - 1].rows, 1, 4);
    assert_in_range(count, 50, 90);
}

/* The worker's new lease. */
static struct action grant_of(struct event event)
{
    tell(event);
    for (size_t i = 0; i < actions.count; i++)
        if (actions.items[i].kind == ACTION_GRANT && actions.items[i].worker == event.worker)
            return actions.items[i];
    fail_msg("worker %u got nothing", event.worker);
    return (struct action){.lease = 0};
}

/* Of rows that are cut automatically a worker that is four times slower than the other gets about a quarter. */
static void test_slow_worker_gets_less(void **state)
{
    (void)state;
    static const int64_t ms_a_row[] = {3, 12};
    struct action grants[2];
    int64_t done_ms[2];
    uint32_t rows[2] = {0};
    start(0);
    tell(job(10000));
    for (uint32_t i = 0; i < 2; i++)
        tell(join(i + 1, 1, 1));
    for (uint32_t i = 0; i < 2; i++) {
        grants[i] = grant_of(ready(i + 1, 0));
        done_ms[i] = now_ms + grants[i].rows * ms_a_row[i];
    }
    for (int step = 0; step < 80; step++) {
        uint32_t i = done_ms[1] < done_ms[0];
        now_ms = done_ms[i];
        grants[i] = grant_of(result(i + 1, grants[i].lease));
        done_ms[i] = now_ms + grants[i].rows * ms_a_row[i];
        if (step < 40)
            continue;
        assert_in_range(grants[i].rows, 4, i == 0 ? 48 : 24);
        rows[i] += grants[i].rows;
    }
    assert_in_range(rows[0], 3 * rows[1], 5 * rows[1]);
}

enum { DEAR_ROWS = 1080, DEAR_FIRST = 540, DEAR_END = 640, DEAR_TIMES = 100 };

/* What rows take of which some are so many times as dear as the others. */
static const double *sums_of_dear_rows(void *context, uint32_t job)
{
    double *sums = context;
    assert_int_equal(job, 0);
    for (uint32_t row = 0; row < DEAR_ROWS; row++)
        sums[row + 1] = sums[row] + (row >= DEAR_FIRST && row < DEAR_END ? DEAR_TIMES : 1);
    return sums;
}

/* Where it is known what rows take, bands of dear ones are low: none takes more than half a thread's share of what is left
 * when it is cut, unless it is as low as may be, and cheap ones are high to the end. */
static void test_bands_of_dear_rows_are_low(void **state)
{
    (void)state;
    static double sums[DEAR_ROWS + 1];
    struct action grants[DEAR_ROWS];
    start_with((struct scheduler_policy){.expects = sums_of_dear_rows, .expects_context = sums});
    size_t count = run_through(DEAR_ROWS, 4, grants);
    uint32_t low = 0, high = 0;
    for (size_t i = 22; i < count; i++) { /* after the soundings */
        const double *first = sums + grants[i].first_row;
        if (grants[i].rows > 4)
            assert_true(first[grants[i].rows] - *first <= (sums[DEAR_ROWS] - *first) / 8);
        if (grants[i].first_row >= DEAR_FIRST && grants[i].first_row < DEAR_END)
            low += grants[i].rows <= 12;
        else if (grants[i].first_row < DEAR_FIRST)
            high += grants[i].rows > 16;
    }
    assert_in_range(low, 10, 30);
    assert_in_range(high, 10, 30);
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

/* --- soundings -------------------------------------------------------------------------------------------- */

/* Each next one is far from those before it. */
static void test_soundings(void **state)
{
    (void)state;
    start(0);
    tell(job(320));
    tell(join(1, 1, 18));
    expect(ready(1, 0), "grant w1 j0 150+4 #1, grant w1 j0 70+4 #2, grant w1 j0 230+4 #3, grant w1 j0 30+4 #4, "
                        "grant w1 j0 110+4 #5, grant w1 j0 190+4 #6, grant w1 j0 270+4 #7, grant w1 j0 10+4 #8, "
                        "grant w1 j0 50+4 #9, grant w1 j0 90+4 #10, grant w1 j0 130+4 #11, grant w1 j0 170+4 #12, "
                        "grant w1 j0 210+4 #13, grant w1 j0 250+4 #14, grant w1 j0 290+4 #15, grant w1 j0 310+4 #16, "
                        "grant w1 j0 0+4 #17, grant w1 j0 4+3 #18"); /* three alike up to row 10 */
    expect(plain(EVENT_LOST, 1), "");
    tell(join(2, 1, 1));
    expect(ready(2, 0), "grant w2 j0 150+4 #19"); /* in that order again */
}

static void test_too_few_rows_for_soundings(void **state)
{
    (void)state;
    start(0);
    tell(job(127));
    tell(join(1, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
    start(10);
    tell(job(319));
    tell(join(1, 1, 1));
    expect(ready(1, 0), "grant w1 j0 0+10 #1");
    start(0); /* enough rows, but not for so many threads */
    tell(job(400));
    tell(join(1, 51, 1));
    expect(ready(1, 0), "grant w1 j0 0+4 #1");
}

/* Where an earlier run has left something there is no sounding; bands end at what is left and at soundings. */
static void test_soundings_of_a_resumed_job(void **state)
{
    (void)state;
    static const struct kept_rows kept[] = {{PASS_RENDER, 0, 46}, {PASS_RENDER, 149, 6}, {PASS_RENDER, 273, 47}};
    start(10);
    tell((struct event){.kind = EVENT_JOB, .rows = 320, .kept = kept, .kept_count = 3});
    tell(join(1, 1, 12));
    expect(ready(1, 0), "grant w1 j0 70+10 #1, grant w1 j0 230+10 #2, grant w1 j0 110+10 #3, grant w1 j0 190+10 #4, "
                        "grant w1 j0 50+10 #5, grant w1 j0 90+10 #6, grant w1 j0 130+10 #7, grant w1 j0 170+10 #8, "
                        "grant w1 j0 210+10 #9, grant w1 j0 250+10 #10, grant w1 j0 46+4 #11, grant w1 j0 60+10 #12");
    for (uint64_t lease = 1; actions.items[actions.count - 1].kind != ACTION_DONE; lease++) {
        assert_true(lease <= 28);
        tell(result(1, lease));
    }
}

/* A survey has none, and is cut into 32 bands at least; the render after it has half as many. */
static void test_soundings_after_a_survey(void **state)
{
    (void)state;
    start(10);
    tell((struct event){.kind = EVENT_JOB, .survey_rows = 400, .rows = 320});
    tell(join(1, 1, 1));
    expect(ready(1, 0), "grant w1 s0 0+12 #1");
    start(10);
    tell((struct event){.kind = EVENT_JOB, .survey_rows = 1, .rows = 320});
    tell(join(1, 1, 1));
    tell(ready(1, 0));
    expect(result(1, 1), "ack w1 #1, accept s0 0+1, surveyed j0, grant w1 j0 140+10 #2");
    static const char *const grants[] = {"60+10", "220+10", "20+10", "100+10", "180+10", "260+10", "300+10", "0+10"};
    for (uint64_t i = 0; i < 8; i++) {
        char text[80];
        snprintf(text, sizeof text, "grant w1 j0 %s #%d", grants[i], (int)i + 3);
        tell(result(1, i + 2));
        char granted[80];
        describe(&actions.items[actions.count - 1], granted, sizeof granted);
        assert_string_equal(granted, text);
    }
}

static void test_bands_to_come(void **state)
{
    (void)state;
    start(4);
    assert_int_equal(scheduler_bands_to_come(scheduler, 0), 0);
    tell(job(320));
    assert_int_equal(scheduler_bands_to_come(scheduler, 0), 0);
    tell(join(1, 1, 2));
    tell(ready(1, 0));
    tell(join(2, 1, 1));
    tell(ready(2, 0));
    tell(plain(EVENT_LOST, 2));
    for (uint32_t come = 3; come <= 81; come++) { /* with 16 soundings */
        assert_int_equal(scheduler_bands_to_come(scheduler, 0), 82 - come);
        tell(result(1, come == 3 ? 1 : come == 4 ? 2 : come));
    }
    assert_int_equal(scheduler_bands_to_come(scheduler, 0), 0);
    assert_int_equal(scheduler_rows_leased(scheduler, 0), 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_bands_cover_the_picture, finish),
        cmocka_unit_test_teardown(test_guided_bands_shrink, finish),
        cmocka_unit_test_teardown(test_slow_worker_gets_less, finish),
        cmocka_unit_test_teardown(test_bands_of_dear_rows_are_low, finish),
        cmocka_unit_test_teardown(test_few_rows_for_many_threads, finish),
        cmocka_unit_test_teardown(test_soundings, finish),
        cmocka_unit_test_teardown(test_too_few_rows_for_soundings, finish),
        cmocka_unit_test_teardown(test_soundings_of_a_resumed_job, finish),
        cmocka_unit_test_teardown(test_soundings_after_a_survey, finish),
        cmocka_unit_test_teardown(test_bands_to_come, finish),
    };
    return cmocka_run_group_tests_name("scheduler's bands", tests, NULL, NULL);
}
