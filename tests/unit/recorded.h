/*
 * Recordings of what the rows of renders take (tests/bench/bands.c), and small farms that replay them: the real
 * scheduler hands out bands to workers that only count time. No clock is read; times are in microseconds.
 */
#ifndef WEFT_TESTS_RECORDED_H
#define WEFT_TESTS_RECORDED_H

#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/forecast.h"
#include "coordinator/scheduler.h"

enum { RECORDED_ROWS_MAX = 2000, REPLAY_WORKERS_MAX = 16, REPLAY_CREDIT = 2 };

struct recorded {
    char name[256];
    uint32_t width, rows, cell_rows, cells; /* cells: rows of them; 0: without a survey */
    double survey[RECORDED_ROWS_MAX], expected[RECORDED_ROWS_MAX]; /* of each row of cells */
    double work[RECORDED_ROWS_MAX], samples[RECORDED_ROWS_MAX];    /* of each row; samples a pixel */
};

/* --- reading a recording ---------------------------------------------------------------------------------- */

static void recorded_read_survey(struct recorded *recorded, char *line)
{
    for (char *word = strtok(line, " \n"); word; word = strtok(NULL, " \n"), recorded->cells++)
        assert_int_equal(sscanf(word, "%lf:%lf", &recorded->survey[recorded->cells],
                                &recorded->expected[recorded->cells]), 2);
}

/* With adaptive sampling, the bands took first samples of the rows beside them too. */
static void recorded_read_render(struct recorded *recorded, char *line)
{
    uint32_t row = 0, rows;
    for (char *word = strtok(line, " \n"); word; word = strtok(NULL, " \n")) {
        double took, samples;
        assert_int_equal(sscanf(word, "%" SCNu32 ":%lf:%lf", &rows, &took, &samples), 3);
        assert_true(rows <= recorded->rows - row);
        samples /= recorded->width * rows;
        double own = recorded->cells > 0 ? rows * samples / (rows * samples + 2 * SAMPLING_REACH) : 1;
        for (uint32_t end = row + rows; row < end; row++) {
            recorded->work[row] = took * own / rows;
            recorded->samples[row] = samples;
        }
    }
    assert_int_equal(row, recorded->rows);
}

/* The next of the file; false: there is none. */
static bool recorded_read(FILE *file, struct recorded *recorded)
{
    static char line[1 << 16];
    *recorded = (struct recorded){0};
    if (!fgets(line, sizeof line, file))
        return false;
    assert_int_equal(sscanf(line, "%255s %" SCNu32 " %" SCNu32 " %" SCNu32, recorded->name, &recorded->width,
                            &recorded->rows, &recorded->cell_rows), 4);
    assert_non_null(fgets(line, sizeof line, file));
    recorded_read_survey(recorded, line);
    assert_non_null(fgets(line, sizeof line, file));
    recorded_read_render(recorded, line);
    return true;
}

/* --- replaying it ----------------------------------------------------------------------------------------- */

/* A worker of one thread, which renders the bands that it holds in the order of their granting. */
struct replayed_worker {
    struct action held[REPLAY_CREDIT];
    int count;
    double began, done; /* of the first */
};

struct replay {
    const struct recorded *recorded;
    struct scheduler *scheduler;
    struct action_list actions;
    struct replayed_worker workers[REPLAY_WORKERS_MAX];
    int worker_count;
    double now;
    bool over;
    struct forecast *forecast;
};

/* What first samples of a row take; 0 beyond the picture. */
static double replay_looks(const struct recorded *recorded, uint32_t row)
{
    return row < recorded->rows ? recorded->work[row] / recorded->samples[row] : 0;
}

static double replay_cost(const struct recorded *recorded, const struct action *band)
{
    double cost = 0;
    const double *work = band->pass == PASS_SURVEY ? recorded->survey : recorded->work;
    for (uint32_t row = band->first_row; row < band->first_row + band->rows; row++)
        cost += work[row];
    for (uint32_t i = 1; band->pass == PASS_RENDER && recorded->cells > 0 && i <= SAMPLING_REACH; i++)
        cost += replay_looks(recorded, band->first_row - i) +
                replay_looks(recorded, band->first_row + band->rows - 1 + i);
    return cost;
}

static void replay_begin_first(struct replay *replay, struct replayed_worker *worker)
{
    worker->began = replay->now;
    worker->done = worker->count > 0 ? replay->now + replay_cost(replay->recorded, &worker->held[0]) : INFINITY;
}

static void replay_drop(struct replay *replay, struct replayed_worker *worker, uint64_t lease)
{
    for (int i = 0; i < worker->count; i++) {
        if (worker->held[i].lease != lease)
            continue;
        worker->count--;
        memmove(worker->held + i, worker->held + i + 1, (size_t)(worker->count - i) * sizeof *worker->held);
        if (i == 0)
            replay_begin_first(replay, worker);
    }
}

static void replay_grant(struct replay *replay, const struct action *band)
{
    struct replayed_worker *worker = &replay->workers[band->worker - 1];
    assert_true(worker->count < REPLAY_CREDIT);
    worker->held[worker->count++] = *band;
    if (worker->count == 1)
        replay_begin_first(replay, worker);
}

static void replay_accept(struct replay *replay, const struct action *band, double work)
{
    const struct recorded *recorded = replay->recorded;
    double samples = 0;
    for (uint32_t row = band->first_row; band->pass == PASS_RENDER && row < band->first_row + band->rows; row++)
        samples += recorded->samples[row];
    if (band->pass == PASS_SURVEY)
        forecast_survey(replay->forecast, band->first_row, band->rows, work);
    else
        forecast_add(replay->forecast, band->first_row, band->rows, work,
                     recorded->cells > 0 ? band->rows / samples : 0);
}

/* `work`: of a result. */
static void replay_tell(struct replay *replay, struct event event, double work)
{
    replay->actions.count = 0;
    scheduler_handle(replay->scheduler, &event, (int64_t)(replay->now / 1000), &replay->actions);
    for (size_t i = 0; i < replay->actions.count; i++) {
        const struct action *a = &replay->actions.items[i];
        if (a->kind == ACTION_GRANT)
            replay_grant(replay, a);
        else if (a->kind == ACTION_REVOKE)
            replay_drop(replay, &replay->workers[a->worker - 1], a->lease);
        else if (a->kind == ACTION_ACCEPT)
            replay_accept(replay, a, work);
        else if (a->kind == ACTION_SURVEYED)
            for (uint32_t cell = 0; cell < replay->recorded->cells; cell++)
                forecast_expect(replay->forecast, cell, replay->recorded->expected[cell]);
        replay->over |= a->kind == ACTION_DONE;
    }
}

static const double *replay_sums(void *context, uint32_t job)
{
    (void)job;
    return forecast_sums(((struct replay *)context)->forecast);
}

static void replay_begin(struct replay *replay, const struct recorded *recorded, int workers)
{
    *replay = (struct replay){.recorded = recorded, .worker_count = workers};
    replay->scheduler = scheduler_create(&(struct scheduler_policy){
        .silence_ms = INT32_MAX, .expects = replay_sums, .expects_context = replay});
    replay->forecast = forecast_create(recorded->rows, recorded->cell_rows);
    replay_tell(replay, (struct event){.kind = EVENT_JOB, .survey_rows = recorded->cells, .rows = recorded->rows}, 0);
    for (int i = 0; i < workers; i++) {
        replay->workers[i].done = INFINITY;
        replay_tell(replay, (struct event){.kind = EVENT_JOIN, .worker = (uint32_t)i + 1, .threads = 1,
                                           .credit = REPLAY_CREDIT}, 0);
    }
    for (int i = 0; i < workers; i++)
        replay_tell(replay, (struct event){.kind = EVENT_READY, .worker = (uint32_t)i + 1}, 0);
}

/* Goes on to that time, or to the end if that comes first. */
static void replay_until(struct replay *replay, double until)
{
    while (!replay->over) {
        struct replayed_worker *next = replay->workers;
        for (int i = 1; i < replay->worker_count; i++)
            next = replay->workers[i].done < next->done ? &replay->workers[i] : next;
        int64_t deadline_ms = scheduler_deadline(replay->scheduler);
        double tick = fmax((double)deadline_ms * 1000, replay->now), then = fmin(tick, next->done);
        if (then > until)
            break;
        replay->now = then;
        if (tick < next->done) {
            replay_tell(replay, (struct event){.kind = EVENT_TICK}, 0);
            continue;
        }
        uint64_t lease = next->held[0].lease;
        double work = next->done - next->began;
        replay_drop(replay, next, lease);
        replay_tell(replay, (struct event){.kind = EVENT_RESULT, .worker = (uint32_t)(next - replay->workers) + 1,
                                           .lease = lease}, work);
    }
    replay->now = replay->over ? replay->now : until;
}

/* What would be shown as remaining; negative: unknown. */
static double replay_remaining(struct replay *replay)
{
    struct forecast_hand hands[REPLAY_WORKERS_MAX * REPLAY_CREDIT];
    size_t count = 0;
    for (int i = 0; i < replay->worker_count; i++)
        for (int k = 0; k < replay->workers[i].count; k++) {
            const struct action *band = &replay->workers[i].held[k];
            if (band->pass == PASS_RENDER)
                hands[count++] = (struct forecast_hand){band->first_row, band->rows,
                                                        k == 0 ? replay->now - replay->workers[i].began : 0, 1};
        }
    return forecast_time(replay->forecast, hands, count, scheduler_bands_to_come(replay->scheduler, 0),
                         replay->worker_count);
}

static void replay_end(struct replay *replay)
{
    scheduler_destroy(&replay->scheduler);
    forecast_destroy(&replay->forecast);
    free(replay->actions.items);
}

#endif
