#include "coordinator/report.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_text.h"
#include "base/memory.h"
#include "base/text.h"
#include "coordinator/snapshot_json.h"
#include "image/compare.h"
#include "scene/model.h"

/* --- what was asked for ----------------------------------------------------------------------------------- */

static int bits_of(const struct render_job *job)
{
    static const int bits[PIXEL_FORMATS] = {[PIXEL_SRGB8] = 8, [PIXEL_SRGB16] = 16, [PIXEL_LINEAR] = 32};
    return bits[job->settings.pixel_format];
}

static void put_settings(struct bytes *text, const struct render_job *job)
{
    double samples = job->sampling.most;
    text_put(text, "\"settings\":{\"width\":%" PRIu32 ",\"height\":%" PRIu32 ",\"bits\":%d,\"filter\":\"%s\",",
             job->settings.width, job->settings.height, bits_of(job), pixel_filter_names[job->settings.filter]);
    json_text_number(text, "samples", job->error > 0 ? NAN : samples, 0);
    text_put(text, ",");
    json_text_number(text, "error", job->error > 0 ? job->error : NAN, 9);
    text_put(text, ",");
    json_text_number(text, "samples_max", job->error > 0 ? samples : NAN, 0);
    text_put(text, "}");
}

/* --- what came of it -------------------------------------------------------------------------------------- */

/* Whether the render's sampling is known. */
static bool is_chosen(const struct render_job *job)
{
    return job->sampling.least > 0;
}

static void put_sampling(struct bytes *text, const struct render_job *job)
{
    const struct sampling *sampling = &job->sampling;
    if (is_chosen(job))
        text_put(text, "\"sampling\":{\"least\":%" PRIu32 ",\"most\":%" PRIu32 ",\"threshold\":%" PRIu32 "}",
                 sampling->least, sampling->most, sampling->threshold);
    else
        text_put(text, "\"sampling\":null");
}

static double survey_seconds(const struct render_job *job, double total_seconds)
{
    if (job->surveying.most == 0)
        return 0;
    return is_chosen(job) ? (double)(job->render_ms - job->started_ms) / 1000 : total_seconds;
}

static void put_seconds(struct bytes *text, const struct render_job *job, double total_seconds)
{
    double survey = survey_seconds(job, total_seconds);
    text_put(text, "\"seconds\":{");
    json_text_number(text, "total", total_seconds, 3);
    text_put(text, ",");
    json_text_number(text, "survey", survey, 3);
    text_put(text, ",");
    json_text_number(text, "render", total_seconds - survey, 3);
    text_put(text, "}");
}

static void put_rays(struct bytes *text, const struct render_job *job, double seconds)
{
    const struct row_figures *figures = &job->figures;
    uint64_t rays = row_figures_rays(figures);
    text_put(text, "\"rays\":{\"camera\":%" PRIu64 ",\"secondary\":%" PRIu64 ",\"shadow\":%" PRIu64, figures->samples,
             figures->secondary_rays, figures->shadow_rays);
    text_put(text, ",\"render\":%" PRIu64 ",\"survey\":%" PRIu64 "},", rays, job->survey.rays);
    json_text_number(text, "rays_per_second", seconds > 0 ? (double)render_job_rays(job) / seconds : NAN, 0);
}

/* A fixed number of samples need not be one of the stages. */
static void put_histogram(struct bytes *text, const struct render_job *job)
{
    const char *comma = "";
    text_put(text, "\"histogram\":{");
    for (uint32_t i = 0; i < ROW_STAGES; i++) {
        uint64_t pixels = job->figures.stages[i];
        if (pixels == 0)
            continue;
        text_put(text, "%s\"%" PRIu32 "\":%" PRIu64, comma,
                 sampling_is_fixed(&job->sampling) ? job->sampling.most : sampling_stage(i), pixels);
        comma = ",";
    }
    text_put(text, "}");
}

static void put_error(struct bytes *text, const struct render_job *job)
{
    double rmse = job->state == JOB_DONE ? render_job_rmse(job) : NAN;
    json_text_number(text, "rmse", rmse, 9);
    text_put(text, ",");
    json_text_number(text, "psnr_decibels", rmse > 0 ? image_psnr(rmse) : NAN, 2);
    const char *met = rmse <= job->error ? "true" : "false";
    text_put(text, ",\"error_met\":%s", job->error == 0 || isnan(rmse) ? "null" : met);
}

/* --- who did it ------------------------------------------------------------------------------------------- */

static void put_band(struct bytes *text, const struct render_job *job, const struct band_account *band)
{
    text_put(text, "{\"first_row\":%" PRIu32 ",\"rows\":%" PRIu32 ",\"worker\":%" PRIu32 ",", band->first_row,
             band->rows, band->worker);
    json_text_number(text, "seconds", (double)band->lease_ms / 1000, 3);
    text_put(text, ",\"rays\":%" PRIu64 ",\"samples\":%" PRIu64 ",", row_figures_rays(&band->figures),
             band->figures.samples);
    json_text_number(text, "rmse", render_job_rows_rmse(job, band->rows, &band->figures), 9);
    text_put(text, "}");
}

static void put_bands(struct bytes *text, const struct render_job *job)
{
    const struct band_account *bands = job->bands[PASS_RENDER];
    const char *comma = "";
    text_put(text, "\"bands\":[");
    for (uint32_t row = 0; row < job->settings.height; row++) {
        if (bands[row].rows == 0)
            continue;
        text_put(text, "%s\n   ", comma);
        put_band(text, job, &bands[row]);
        comma = ",";
    }
    text_put(text, "]");
}

static void put_worker(struct bytes *text, const struct worker_snapshot *worker)
{
    text_put(text, "{");
    snapshot_write_worker(text, worker);
    text_put(text, "\"bands\":%" PRIu32 ",\"rows\":%" PRIu64 ",\"rays\":%" PRIu64 "}", worker->bands_done,
             worker->rows_done, worker->rays);
}

/* --- all of it -------------------------------------------------------------------------------------------- */

static void put_job(struct bytes *text, const struct render_job *job, double seconds)
{
    text_put(text, "{");
    json_text_string(text, "scene", job->scene_path);
    text_put(text, ",");
    json_text_string(text, "source", job->source);
    text_put(text, ",");
    json_text_string(text, "output", job->output_path);
    text_put(text, ",\"state\":\"%s\",\n   ", job_state_name(job->state));
    put_settings(text, job);
    text_put(text, ",\n   ");
    put_sampling(text, job);
    text_put(text, ",");
    put_seconds(text, job, seconds);
    text_put(text, ",\n   ");
    put_rays(text, job, seconds);
    text_put(text, ",\n   \"rows\":%" PRIu32 ",\"rows_resumed\":%" PRIu32 ",\"bands_audited\":%" PRIu32 ",",
             job->rows_done, job->rows_kept, job->audited);
    json_text_number(text, "samples_mean", job->rows_done > 0 ? render_job_samples(job) : NAN, 6);
    text_put(text, ",");
    put_histogram(text, job);
    text_put(text, ",\n   ");
    put_error(text, job);
    text_put(text, ",\n   ");
    put_bands(text, job);
    text_put(text, "}");
}

void report_json(struct bytes *text, const struct snapshot *snapshot, const struct render_job *jobs)
{
    text_put(text, "{\"weft\":\"%s\",", WEFT_VERSION);
    json_text_number(text, "seconds", snapshot->elapsed_seconds, 3);
    text_put(text, ",\n \"jobs\":[");
    for (size_t i = 0; i < snapshot->job_count; i++) {
        text_put(text, "%s\n  ", i ? "," : "");
        put_job(text, &jobs[i], snapshot->jobs[i].elapsed_seconds);
    }
    text_put(text, "],\n \"workers\":[");
    for (size_t i = 0; i < snapshot->worker_count; i++) {
        text_put(text, "%s\n  ", i ? "," : "");
        put_worker(text, &snapshot->workers[i]);
    }
    text_put(text, "]}\n");
}

enum status report_publish(struct part_file *file, const struct snapshot *snapshot, const struct render_job *jobs,
                           struct error *error)
{
    struct bytes text = {0};
    report_json(&text, snapshot, jobs);
    enum status status = part_file_write(file, text.data, text.size, 0, error);
    if (status == STATUS_OK)
        status = part_file_publish(file, error);
    bytes_finish(&text);
    return status;
}
