#include <math.h>

#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

static enum worker_state state_of(const struct peer *peer)
{
    if (peer->gone)
        return WORKER_GONE;
    if (peer->draining)
        return WORKER_DRAINING;
    if (peer->bands_held > 0)
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
        .bands_held = peer->gone ? 0 : peer->bands_held,
        .bands_done = peer->bands_done,
        .rows_done = peer->rows_done,
        .rays = peer_rays(peer),
        .rays_per_second = peer_rate(peer, now_ms),
    };
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
        .rmse = job->state == JOB_DONE ? render_job_rmse(job) : NAN,
        .rows_done = job->rows_done,
        .rows_in_work = job->state == JOB_RUNNING ? scheduler_rows_leased(d->scheduler, (uint32_t)index) : 0,
        .rays = row_figures_rays(&job->figures),
        .remaining_seconds = -1,
    };
    if (job->state == JOB_WAITING)
        return view;
    view.elapsed_seconds = (double)((job->ended_ms ? job->ended_ms : now_ms) - job->started_ms) / 1000;
    if (job->state == JOB_DONE)
        view.remaining_seconds = 0;
    else if (job->rows_done > job->rows_kept)
        view.remaining_seconds = (double)(now_ms - job->render_ms) / 1000 * (view.height - view.rows_done) /
                                 (view.rows_done - job->rows_kept);
    return view;
}

struct snapshot dispatcher_snapshot(struct dispatcher *d, int64_t now_ms)
{
    d->job_views = memory_grow(d->job_views, &d->job_view_capacity, d->job_count, sizeof *d->job_views);
    d->worker_views = memory_grow(d->worker_views, &d->worker_view_capacity, d->peer_count,
                                     sizeof *d->worker_views);
    struct snapshot snapshot = {
        .elapsed_seconds = (double)(now_ms - d->started_ms) / 1000,
        .job_count = d->job_count,
        .worker_count = d->peer_count,
        .jobs = d->job_views,
        .workers = d->worker_views,
    };
    for (size_t i = 0; i < d->job_count; i++) {
        d->job_views[i] = show_job(d, i, now_ms);
        snapshot.rays += d->job_views[i].rays;
    }
    for (size_t i = 0; i < d->peer_count; i++) {
        d->worker_views[i] = show_peer(&d->peers[i], now_ms);
        snapshot.rays_per_second += d->worker_views[i].rays_per_second;
    }
    return snapshot;
}
