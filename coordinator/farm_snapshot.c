#include <math.h>

#include "base/clock.h"
#include "base/memory.h"
#include "coordinator/farm_private.h"

static enum worker_state state_of(const struct farm *farm, const struct peer *peer, uint32_t *held)
{
    *held = peer->gone ? 0 : (uint32_t)scheduler_held(farm->scheduler, peer->number);
    if (peer->gone)
        return WORKER_GONE;
    if (peer->draining)
        return WORKER_DRAINING;
    if (*held > 0)
        return WORKER_WORKING;
    return peer->bands_done > 0 ? WORKER_IDLE : WORKER_LOADING;
}

static struct worker_snapshot show_peer(const struct farm *farm, const struct peer *peer, int64_t now_ms)
{
    struct worker_snapshot view = {
        .number = peer->number,
        .host = peer->host,
        .kernel = peer->kernel,
        .pid = peer->pid,
        .threads = peer->threads,
        .bands_done = peer->bands_done,
        .rows_done = peer->rows_done,
        .rays = peer_rays(peer),
        .rays_per_second = peer_rate(peer, now_ms),
    };
    view.state = state_of(farm, peer, &view.bands_held);
    return view;
}

static struct job_snapshot show_job(const struct farm *farm, size_t index, int64_t now_ms)
{
    const struct render_job *job = farm->jobs[index];
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
        .rows_in_work = job->state == JOB_RUNNING ? scheduler_rows_leased(farm->scheduler, (uint32_t)index) : 0,
        .rays = row_figures_rays(&job->figures),
        .remaining_seconds = -1,
    };
    if (job->state == JOB_WAITING)
        return view;
    view.elapsed_seconds = (double)((job->ended_ms ? job->ended_ms : now_ms) - job->started_ms) / 1000;
    if (job->state == JOB_DONE)
        view.remaining_seconds = 0;
    else if (job->rows_done > 0)
        view.remaining_seconds =
            (double)(now_ms - job->render_ms) / 1000 * (view.height - view.rows_done) / view.rows_done;
    return view;
}

struct snapshot farm_snapshot(struct farm *farm)
{
    int64_t now_ms = clock_now_ms();
    farm->job_views = memory_grow(farm->job_views, &farm->job_view_capacity, farm->job_count, sizeof *farm->job_views);
    farm->worker_views = memory_grow(farm->worker_views, &farm->worker_view_capacity, farm->peer_count,
                                     sizeof *farm->worker_views);
    struct snapshot snapshot = {
        .elapsed_seconds = (double)(now_ms - farm->started_ms) / 1000,
        .job_count = farm->job_count,
        .worker_count = farm->peer_count,
        .jobs = farm->job_views,
        .workers = farm->worker_views,
    };
    for (size_t i = 0; i < farm->job_count; i++) {
        farm->job_views[i] = show_job(farm, i, now_ms);
        snapshot.rays += farm->job_views[i].rays;
    }
    for (size_t i = 0; i < farm->peer_count; i++) {
        farm->worker_views[i] = show_peer(farm, &farm->peers[i], now_ms);
        snapshot.rays_per_second += farm->worker_views[i].rays_per_second;
    }
    return snapshot;
}

void farm_show(struct farm *farm, bool last)
{
    int64_t now_ms = clock_now_ms();
    if (!farm->progress || (!last && progress_wait_ms(farm->progress, now_ms) > 0))
        return;
    struct snapshot snapshot = farm_snapshot(farm);
    if (last)
        progress_finish(farm->progress, &snapshot, now_ms);
    else
        progress_update(farm->progress, &snapshot, now_ms);
}
