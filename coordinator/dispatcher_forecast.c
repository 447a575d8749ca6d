/* Remaining time: what the dispatcher tells forecasts, and asks them. Work is in milliseconds of one thread. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

void dispatcher_begin_forecast(struct dispatcher *d, uint32_t number)
{
    const struct render_job *job = d->jobs[number];
    uint32_t width = job->settings.width, height = job->settings.height;
    uint32_t cell_rows = render_job_survey_rows(job) > 0 ? survey_grid(width, height).side : 0;
    const uint32_t rows[PASSES] = {render_job_survey_rows(job), height};
    forecast_destroy(&d->forecasts[number]);
    d->forecasts[number] = forecast_create(height, cell_rows);
    for (int pass = 0; pass < PASSES; pass++)
        for (uint32_t row = 0; row < rows[pass]; row++)
            if (job->bands[pass][row].rows > 0)
                forecast_add(d->forecasts[number], (enum render_pass)pass, row, job->bands[pass][row].rows, NAN, 0);
}

/* The share that first samples are of all. */
static double looks_of(const struct render_job *job, const struct band_account *band)
{
    double pixels = (double)job->settings.width * band->rows;
    if (sampling_is_fixed(&job->sampling))
        return 0;
    return pixels < (double)band->figures.samples ? pixels / (double)band->figures.samples : 1;
}

void dispatcher_add_to_forecast(struct dispatcher *d, const struct action *accepted, double work)
{
    const struct render_job *job = d->jobs[accepted->job];
    double looks = accepted->pass == PASS_RENDER ? looks_of(job, &job->bands[PASS_RENDER][accepted->first_row]) : 0;
    forecast_add(d->forecasts[accepted->job], accepted->pass, accepted->first_row, accepted->rows, work, looks);
}

static uint32_t threads_at_work(const struct dispatcher *d)
{
    uint32_t threads = 0;
    for (size_t i = 0; i < d->peer_count; i++)
        threads += d->peers[i].gone || d->peers[i].draining ? 0 : d->peers[i].threads;
    return threads;
}

/* As how many bands so many rows will be handed out: about as rows_to_cut in scheduler_bands.c does. */
static uint32_t bands_to_come(const struct dispatcher *d, uint32_t rows, uint32_t threads)
{
    enum { BANDS_A_THREAD = 2, ROWS_MAX = 32, ROWS_MIN = 4 };
    uint32_t bands = 0;
    for (; rows > 0; bands++) {
        uint32_t share = rows / (BANDS_A_THREAD * threads), cut = d->config.band_rows;
        if (cut == 0)
            cut = share < ROWS_MIN ? ROWS_MIN : share < ROWS_MAX ? share : ROWS_MAX;
        rows -= cut < rows ? cut : rows;
    }
    return bands;
}

/* What is in work of the job's render, into *hands, which the caller frees. A worker spends its time on the first band
 * that it holds. */
static size_t list_hands(const struct dispatcher *d, uint32_t job, struct forecast_hand **hands)
{
    size_t count = 0, capacity = 0;
    *hands = NULL;
    for (size_t i = 0; i < d->peer_count; i++) {
        const struct peer *peer = &d->peers[i];
        double spent = (double)(d->now_ms - peer->turn_ms) * peer->threads;
        for (size_t k = 0; k < peer->held_count && !peer->gone; k++) {
            const struct held_band *band = &peer->held[k];
            if (band->job != job || band->pass != PASS_RENDER)
                continue;
            *hands = memory_grow(*hands, &capacity, count + 1, sizeof **hands);
            (*hands)[count++] = (struct forecast_hand){band->first_row, band->rows, k == 0 ? spent : 0};
        }
    }
    return count;
}

double dispatcher_remaining_seconds(const struct dispatcher *d, uint32_t number)
{
    const struct render_job *job = d->jobs[number];
    uint32_t threads = threads_at_work(d);
    if (job->state == JOB_DONE || (job->state == JOB_RUNNING && !d->forecasts[number])) /* the latter is being written */
        return 0;
    if (job->state != JOB_RUNNING || threads == 0)
        return -1;
    struct forecast_hand *hands;
    size_t count = list_hands(d, number, &hands);
    uint32_t leased = scheduler_rows_leased(d->scheduler, number);
    uint32_t waiting = job->settings.height - job->rows_done - leased;
    double left_ms = forecast_time(d->forecasts[number], hands, count, bands_to_come(d, waiting, threads), threads);
    free(hands);
    return left_ms < 0 ? -1 : left_ms / 1000;
}
