#include "coordinator/snapshot_json.h"

#include <inttypes.h>
#include <math.h>

#include "base/json_text.h"
#include "base/text.h"

static void put_stretch(struct bytes *text, const struct stretch_snapshot *stretch)
{
    text_put(text, "{\"first_row\":%" PRIu32 ",\"rows\":%" PRIu32 ",\"state\":\"%s\",", stretch->first_row,
             stretch->rows, stretch_state_name(stretch->state));
    json_text_number(text, "worker", stretch->worker > 0 ? stretch->worker : NAN, 0);
    text_put(text, "}");
}

static void put_job(struct bytes *text, const struct job_snapshot *job)
{
    text_put(text, "{");
    json_text_string(text, "scene", job->scene);
    text_put(text, ",");
    json_text_string(text, "output", job->output);
    text_put(text, ",\"state\":\"%s\",\"width\":%" PRIu32 ",\"height\":%" PRIu32 ",\"samples_max\":%" PRIu32 ",",
             job_state_name(job->state), job->width, job->height, job->samples_max);
    json_text_number(text, "samples", job->samples > 0 ? job->samples : NAN, 3);
    text_put(text, ",");
    json_text_number(text, "error", job->error > 0 ? job->error : NAN, 9);
    text_put(text, ",");
    json_text_number(text, "rmse", job->rmse, 9);
    text_put(text, ",\"rows_done\":%" PRIu32 ",\"rows_in_work\":%" PRIu32 ",\"rays\":%" PRIu64 ",",
             job->rows_done, job->rows_in_work, job->rays);
    json_text_number(text, "elapsed", job->elapsed_seconds, 3);
    text_put(text, ",");
    json_text_number(text, "remaining", job->remaining_seconds < 0 ? INFINITY : job->remaining_seconds, 3);
    text_put(text, ",\"bands\":[");
    for (size_t i = 0; i < job->stretch_count; i++) {
        text_put(text, "%s", i ? "," : "");
        put_stretch(text, &job->stretches[i]);
    }
    text_put(text, "]}");
}

void snapshot_write_worker(struct bytes *text, const struct worker_snapshot *worker)
{
    text_put(text, "\"number\":%" PRIu32 ",", worker->number);
    json_text_string(text, "host", worker->host);
    text_put(text, ",\"pid\":%" PRIu32 ",\"threads\":%" PRIu32 ",", worker->pid, worker->threads);
    json_text_string(text, "kernel", worker->kernel);
    text_put(text, ",\"state\":\"%s\",", worker_state_name(worker->state));
}

static void put_worker(struct bytes *text, const struct worker_snapshot *worker)
{
    text_put(text, "{");
    snapshot_write_worker(text, worker);
    text_put(text, "\"bands_held\":%" PRIu32 ",\"bands_done\":%" PRIu32, worker->bands_held, worker->bands_done);
    text_put(text, ",\"rows_done\":%" PRIu64 ",\"rays\":%" PRIu64 ",", worker->rows_done, worker->rays);
    json_text_number(text, "rays_per_second", worker->rays_per_second, 3);
    if (worker->trouble == TROUBLE_NONE)
        text_put(text, ",\"trouble\":null}");
    else
        text_put(text, ",\"trouble\":\"%s\"}", worker_trouble_name(worker->trouble));
}

void snapshot_write_json(struct bytes *text, const struct snapshot *snapshot)
{
    text_put(text, "{");
    json_text_number(text, "elapsed", snapshot->elapsed_seconds, 3);
    text_put(text, ",\"rays\":%" PRIu64 ",", snapshot->rays);
    json_text_number(text, "rays_per_second", snapshot->rays_per_second, 3);
    text_put(text, ",\"refused\":%" PRIu32 ",\"jobs\":[", snapshot->refused);
    for (size_t i = 0; i < snapshot->job_count; i++) {
        text_put(text, "%s", i ? "," : "");
        put_job(text, &snapshot->jobs[i]);
    }
    text_put(text, "],\"workers\":[");
    for (size_t i = 0; i < snapshot->worker_count; i++) {
        text_put(text, "%s", i ? "," : "");
        put_worker(text, &snapshot->workers[i]);
    }
    text_put(text, "]}\n");
}
