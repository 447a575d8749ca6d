/* What is to come: what the dispatcher tells forecasts, and asks them. Work is in milliseconds of one thread. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

void dispatcher_begin_forecast(struct dispatcher *d, uint32_t number)
{
    const struct render_job *job = d->jobs[number];
    uint32_t width = job->settings.width, height = job->settings.height;
    forecast_destroy(&d->forecasts[number]);
    uint32_t survey_rows = render_job_survey_rows(job);
    d->forecasts[number] = forecast_create(height, survey_rows > 0 ? survey_grid(width, height).side : 0);
    for (uint32_t row = 0; row < survey_rows; row++)
        if (job->bands[PASS_SURVEY][row].rows > 0)
            forecast_survey(d->forecasts[number], row, job->bands[PASS_SURVEY][row].rows, NAN);
    for (uint32_t row = 0; row < height; row++)
        if (job->bands[PASS_RENDER][row].rows > 0)
            forecast_add(d->forecasts[number], row, job->bands[PASS_RENDER][row].rows, NAN, 0);
}

/* What the band of the survey that is there in the journal expects; 1 where it cannot be read, as others will see. */
static double expected_samples(const struct render_job *job, uint64_t offset)
{
    uint8_t bytes[SURVEY_BYTES];
    struct survey part;
    struct error ignored;
    if (journal_read(job->journal, offset, bytes, sizeof bytes, &ignored) != STATUS_OK)
        return 1;
    survey_read(&part, bytes);
    return forecast_samples(&part, &job->sampling);
}

void dispatcher_tell_forecast_of_survey(struct dispatcher *d, uint32_t number)
{
    const struct render_job *job = d->jobs[number];
    for (uint32_t row = 0; row < render_job_survey_rows(job); row++) {
        const struct band_account *band = &job->bands[PASS_SURVEY][row];
        double samples = band->rows > 0 ? expected_samples(job, band->offset) : 0;
        for (uint32_t i = 0; i < band->rows; i++)
            forecast_expect(d->forecasts[number], row + i, samples);
    }
}

/* The share that first samples are of all. A worker that lies may say that it took any number of them. */
static double looks_of(const struct render_job *job, const struct band_account *band)
{
    double pixels = (double)job->settings.width * band->rows;
    double samples = fmin((double)band->figures.samples, pixels * job->sampling.most);
    if (sampling_is_fixed(&job->sampling))
        return 0;
    return pixels < samples ? pixels / samples : 1;
}

void dispatcher_add_to_forecast(struct dispatcher *d, const struct action *accepted, double work)
{
    const struct render_job *job = d->jobs[accepted->job];
    struct forecast *forecast = d->forecasts[accepted->job];
    if (accepted->pass == PASS_SURVEY)
        forecast_survey(forecast, accepted->first_row, accepted->rows, work);
    else
        forecast_add(forecast, accepted->first_row, accepted->rows, work,
                     looks_of(job, &job->bands[PASS_RENDER][accepted->first_row]));
}

static uint32_t threads_at_work(const struct dispatcher *d)
{
    uint32_t threads = 0;
    for (size_t i = 0; i < d->peer_count; i++)
        threads += d->peers[i].gone || d->peers[i].draining ? 0 : d->peers[i].threads;
    return threads;
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
            (*hands)[count++] = (struct forecast_hand){band->first_row, band->rows, k == 0 ? spent : 0, peer->threads};
        }
    }
    return count;
}

double dispatcher_remaining_seconds(const struct dispatcher *d, uint32_t number)
{
    const struct render_job *job = d->jobs[number];
    uint32_t threads = threads_at_work(d);
    if (job->state == JOB_DONE || (job->state == JOB_RUNNING && !d->forecasts[number])) /* and is being written */
        return 0;
    if (job->state != JOB_RUNNING || threads == 0)
        return -1;
    struct forecast_hand *hands;
    size_t count = list_hands(d, number, &hands);
    uint32_t bands = scheduler_bands_to_come(d->scheduler, number);
    double left_ms = forecast_time(d->forecasts[number], hands, count, bands, threads);
    free(hands);
    return left_ms < 0 ? -1 : left_ms / 1000;
}

const double *dispatcher_expected_work(void *context, uint32_t job)
{
    struct dispatcher *d = context;
    return d->forecasts[job] ? forecast_sums(d->forecasts[job]) : NULL;
}
