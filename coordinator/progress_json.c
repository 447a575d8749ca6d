#include "coordinator/progress_views.h"

#include <inttypes.h>
#include <math.h>

#include "coordinator/text.h"

static void put_string(struct bytes *text, const char *key, const char *value)
{
    text_put(text, "\"%s\":\"", key);
    for (uint32_t code; (code = text_next(&value));) {
        if (code < 0x20 || code == 0x7F)
            text_put(text, "\\u%04x", (unsigned)code);
        else if (code == '"' || code == '\\')
            text_put(text, "\\%c", (char)code);
        else
            text_put_code(text, code);
    }
    text_put(text, "\"");
}

/* JSON has no way to write an infinity. */
static void put_number(struct bytes *text, const char *key, double value, int decimals)
{
    if (isfinite(value))
        text_put(text, "\"%s\":%.*f", key, decimals, value);
    else
        text_put(text, "\"%s\":null", key);
}

static void put_job(struct bytes *text, const struct job_snapshot *job)
{
    static const char *const states[] = {
        [JOB_WAITING] = "waiting", [JOB_SURVEYING] = "surveying", [JOB_RUNNING] = "running", [JOB_DONE] = "done",
        [JOB_FAILED] = "failed"};
    text_put(text, "{");
    put_string(text, "scene", job->scene);
    text_put(text, ",");
    put_string(text, "output", job->output);
    text_put(text, ",\"state\":\"%s\",\"width\":%" PRIu32 ",\"height\":%" PRIu32 ",\"samples_max\":%" PRIu32 ",",
             states[job->state], job->width, job->height, job->samples_max);
    put_number(text, "samples", job->samples > 0 ? job->samples : NAN, 3);
    text_put(text, ",");
    put_number(text, "error", job->error > 0 ? job->error : NAN, 9);
    text_put(text, ",");
    put_number(text, "rmse", job->rmse, 9);
    text_put(text, ",\"rows_done\":%" PRIu32 ",\"rows_in_work\":%" PRIu32 ",\"rays\":%" PRIu64 ",",
             job->rows_done, job->rows_in_work, job->rays);
    put_number(text, "elapsed", job->elapsed_seconds, 3);
    text_put(text, ",");
    put_number(text, "remaining", job->remaining_seconds < 0 ? INFINITY : job->remaining_seconds, 3);
    text_put(text, "}");
}

static void put_worker(struct bytes *text, const struct worker_snapshot *worker)
{
    text_put(text, "{\"number\":%" PRIu32 ",", worker->number);
    put_string(text, "host", worker->host);
    text_put(text, ",\"pid\":%" PRIu32 ",\"threads\":%" PRIu32 ",", worker->pid, worker->threads);
    put_string(text, "kernel", worker->kernel);
    text_put(text, ",\"state\":\"%s\",\"bands_held\":%" PRIu32 ",\"bands_done\":%" PRIu32,
             progress_worker_state(worker->state), worker->bands_held, worker->bands_done);
    text_put(text, ",\"rows_done\":%" PRIu64 ",\"rays\":%" PRIu64 ",", worker->rows_done, worker->rays);
    put_number(text, "rays_per_second", worker->rays_per_second, 3);
    text_put(text, "}");
}

void progress_json(struct bytes *text, const struct snapshot *snapshot)
{
    text_put(text, "{");
    put_number(text, "elapsed", snapshot->elapsed_seconds, 3);
    text_put(text, ",\"rays\":%" PRIu64 ",", snapshot->rays);
    put_number(text, "rays_per_second", snapshot->rays_per_second, 3);
    text_put(text, ",\"jobs\":[");
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
