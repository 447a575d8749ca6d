#include <math.h>
#include <stdlib.h>

#include "base/hash.h"
#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

static enum worker_state state_of(const struct peer *peer)
{
    if (peer->gone)
        return WORKER_GONE;
    if (peer->draining)
        return WORKER_DRAINING;
    if (peer->held_count > 0)
        return WORKER_WORKING;
    return peer->bands_done > 0 ? WORKER_IDLE : WORKER_LOADING;
}

static struct worker_snapshot show_peer(const struct peer *peer, int64_t now_ms)
{
    return (struct worker_snapshot){
        .number = peer->number,
        .host = peer->host,
        .kernel = peer->kernel,
        .pid = peer->pid,
        .threads = peer->threads,
        .state = state_of(peer),
        .bands_held = peer->gone ? 0 : (uint32_t)peer->held_count,
        .bands_done = peer->bands_done,
        .rows_done = peer->rows_done,
        .rays = peer_rays(peer),
        .rays_per_second = peer_rate(peer, now_ms),
        .trouble = peer->trouble,
    };
}

/* --- the stretches of a picture --------------------------------------------------------------------------- */

/* What is known of a row: it waits (0), a worker has it (whose number it is), or it is done. */
enum { ROW_WAITS = 0 };
#define ROW_IS_DONE UINT32_MAX

static void mark_done(const struct render_job *job, uint32_t *marks)
{
    const struct band_account *bands = job->bands[PASS_RENDER];
    for (uint32_t first_row = 0; first_row < job->settings.height; first_row++)
        for (uint32_t row = 0; row < bands[first_row].rows; row++)
            marks[first_row + row] = ROW_IS_DONE;
}

/* A row of a survey's cells stands for several of the picture. Rows that are done may be in work too, to be audited. */
static void mark_held(const struct dispatcher *d, size_t index, uint32_t *marks)
{
    const struct job_settings *settings = &d->jobs[index]->settings;
    uint32_t side = survey_grid(settings->width, settings->height).side;
    for (size_t i = 0; i < d->peer_count; i++) {
        const struct peer *peer = &d->peers[i];
        for (size_t k = 0; k < peer->held_count && !peer->gone; k++) {
            const struct held_band *band = &peer->held[k];
            if (band->job != index)
                continue;
            uint32_t scale = band->pass == PASS_SURVEY ? side : 1, end = (band->first_row + band->rows) * scale;
            for (uint32_t row = band->first_row * scale; row < end && row < settings->height; row++)
                marks[row] = marks[row] == ROW_IS_DONE ? ROW_IS_DONE : peer->number;
        }
    }
}

static void add_stretch(struct dispatcher *d, size_t *count, uint32_t first_row, uint32_t rows, uint32_t mark)
{
    d->stretch_views = memory_grow(d->stretch_views, &d->stretch_view_capacity, *count + 1, sizeof *d->stretch_views);
    struct stretch_snapshot *stretch = &d->stretch_views[(*count)++];
    *stretch = (struct stretch_snapshot){.first_row = first_row, .rows = rows};
    if (mark == ROW_WAITS || mark == ROW_IS_DONE) {
        stretch->state = mark == ROW_WAITS ? STRETCH_WAITING : STRETCH_DONE;
    } else {
        stretch->state = STRETCH_IN_WORK;
        stretch->worker = mark;
    }
}

/* Appends those of the job to stretch_views[*count]. */
static void list_stretches(struct dispatcher *d, size_t index, size_t *count)
{
    const struct render_job *job = d->jobs[index];
    uint32_t height = job->settings.height, first = 0;
    uint32_t *marks = memory_array(height, sizeof *marks);
    mark_done(job, marks);
    if (job->state == JOB_SURVEYING || job->state == JOB_RUNNING)
        mark_held(d, index, marks);
    for (uint32_t row = 1; row <= height; row++)
        if (row == height || marks[row] != marks[first]) {
            add_stretch(d, count, first, row - first, marks[first]);
            first = row;
        }
    free(marks);
}

/* --- the whole -------------------------------------------------------------------------------------------- */

uint32_t dispatcher_states(const struct dispatcher *d)
{
    uint32_t states = (uint32_t)d->job_count;
    for (size_t i = 0; i < d->job_count; i++)
        states = hash_u32(states ^ (uint32_t)d->jobs[i]->state);
    return states;
}

static struct job_snapshot show_job(const struct dispatcher *d, size_t index, int64_t now_ms)
{
    const struct render_job *job = d->jobs[index];
    struct job_snapshot view = {
        .scene = job->scene_path,
        .output = job->output_path,
        .state = job->state,
        .width = job->settings.width,
        .height = job->settings.height,
        .samples = render_job_samples(job),
        .samples_max = job->sampling.most,
        .error = job->error,
        .rmse = job->rows_done > 0 ? render_job_rows_rmse(job, job->rows_done, &job->figures) : NAN,
        .rows_done = job->rows_done,
        .rows_in_work = job->state == JOB_RUNNING ? scheduler_rows_leased(d->scheduler, (uint32_t)index) : 0,
        .rays = row_figures_rays(&job->figures),
        .remaining_seconds = dispatcher_remaining_seconds(d, (uint32_t)index),
    };
    if (job->state != JOB_WAITING)
        view.elapsed_seconds = (double)((job->ended_ms ? job->ended_ms : now_ms) - job->started_ms) / 1000;
    return view;
}

/* The array of stretches may move until the last is in it. */
static void show_stretches(struct dispatcher *d)
{
    size_t count = 0;
    for (size_t i = 0; i < d->job_count; i++) {
        size_t before = count;
        list_stretches(d, i, &count);
        d->job_views[i].stretch_count = count - before;
    }
    const struct stretch_snapshot *next = d->stretch_views;
    for (size_t i = 0; i < d->job_count; i++) {
        d->job_views[i].stretches = next;
        next += d->job_views[i].stretch_count;
    }
}

struct snapshot dispatcher_snapshot(struct dispatcher *d, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    d->job_views = memory_grow(d->job_views, &d->job_view_capacity, d->job_count, sizeof *d->job_views);
    d->worker_views = memory_grow(d->worker_views, &d->worker_view_capacity, d->peer_count,
                                     sizeof *d->worker_views);
    struct snapshot snapshot = {
        .elapsed_seconds = (double)(now_ms - d->started_ms) / 1000,
        .refused = d->refused,
        .job_count = d->job_count,
        .worker_count = d->peer_count,
        .jobs = d->job_views,
        .workers = d->worker_views,
    };
    for (size_t i = 0; i < d->job_count; i++) {
        d->job_views[i] = show_job(d, i, now_ms);
        snapshot.rays += d->job_views[i].rays;
    }
    show_stretches(d);
    for (size_t i = 0; i < d->peer_count; i++) {
        d->worker_views[i] = show_peer(&d->peers[i], now_ms);
        snapshot.rays_per_second += d->worker_views[i].rays_per_second;
    }
    return snapshot;
}
