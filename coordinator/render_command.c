/* weft render */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "coordinator/commands.h"
#include "coordinator/farm.h"
#include "coordinator/http.h"
#include "coordinator/outputs.h"
#include "coordinator/render_arguments.h"
#include "coordinator/report.h"
#include "image/compare.h"

/* --- outputs ---------------------------------------------------------------------------------------------- */

/* Where the scenes' pictures go: paths[count]; free_paths follows. */
static char **choose_paths(const struct render_arguments *a, char **scenes, size_t count)
{
    char **paths = memory_array(count, sizeof *paths);
    for (size_t i = 0; i < count; i++)
        paths[i] = outputs_path(a->output, scenes[i], count > 1);
    return paths;
}

static void free_paths(char **paths, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(paths[i]);
    free(paths);
}

/* All files that are asked for, of which there are *total; the log is the last. The caller frees. */
static struct output *list_outputs(const struct render_arguments *a, char **scenes, char **paths, size_t count,
                                   size_t *total)
{
    const struct output others[] = {{"--sample-map", a->choices.sample_map},
                                    {"--error-map", a->choices.error_map},
                                    {"--report", a->report},
                                    {"--log", a->log}};
    struct output *outputs = memory_array(count + sizeof others / sizeof *others, sizeof *outputs);
    *total = 0;
    for (size_t i = 0; i < count; i++)
        outputs[(*total)++] = (struct output){scenes[i], paths[i]};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (others[i].path)
            outputs[(*total)++] = others[i];
    return outputs;
}

/* That these are different files, and none of them a scene or the token. */
static enum status check_outputs(const struct render_arguments *a, char **scenes, size_t count,
                                 const struct output *outputs, size_t total, struct error *error)
{
    enum status status = outputs_check_distinct(outputs, total, error);
    if (status == STATUS_OK)
        status = outputs_check_spare(outputs, total, a->http_token, error);
    for (size_t i = 0; i < count && status == STATUS_OK; i++)
        status = outputs_check_spare(outputs, total, scenes[i], error);
    return status;
}

/* The log, which is opened before anything is said, must not be one of the outputs either. */
static enum status open_log(const struct render_arguments *a, char **scenes, size_t count, struct error *error)
{
    size_t total;
    char **paths = choose_paths(a, scenes, count);
    struct output *outputs = list_outputs(a, scenes, paths, count, &total);
    enum status status = check_outputs(a, scenes, count, outputs, total, error);
    free(outputs);
    free_paths(paths, count);
    return status == STATUS_OK ? log_open(a->log, a->log_json, error) : status;
}

/* That no output is a file that one of the scenes reaches. */
static enum status spare_assets(const struct output *outputs, size_t total, const struct render_job *jobs, size_t count,
                                struct error *error)
{
    enum status status = STATUS_OK;
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < jobs[i].assets.count && status == STATUS_OK; k++) {
            char *path = asset_set_path(&jobs[i].assets, jobs[i].assets.assets[k].name);
            status = outputs_check_spare(outputs, total, path, error);
            free(path);
        }
    return status;
}

/* --- what is said ----------------------------------------------------------------------------------------- */

/* "12.3 M" and the like. */
static void format_count(char text[16], double count)
{
    static const char *const units[] = {"", " k", " M", " G", " T"};
    size_t unit = 0;
    while (count >= 999.5 && unit < 4) {
        count /= 1000;
        unit++;
    }
    snprintf(text, 16, unit && count < 99.95 ? "%.1f%s" : "%.0f%s", count, units[unit]);
}

/* With three digits that count, as "0.00471". */
static void format_error(char text[16], double error)
{
    int decimals = 3;
    for (double shown = error; shown < 0.1 && decimals < 9; shown *= 10)
        decimals++;
    snprintf(text, 16, "%.*f", decimals, error);
}

/* ", RMSE 0.00471 (46.5 dB)", and why it is not what was asked for where it is not. The caller frees. */
static char *describe_error(const struct render_job *job)
{
    double rmse = render_job_rmse(job);
    if (isnan(rmse))
        return memory_string(", RMSE unknown");
    if (rmse == 0)
        return memory_string(", RMSE 0");
    char text[16];
    format_error(text, rmse);
    const uint64_t *stages = job->figures.stages;
    uint64_t pixels = (uint64_t)job->settings.width * job->settings.height;
    uint64_t limited = stages[sampling_stage_within(job->sampling.most)];
    if (job->error == 0 || rmse <= job->error)
        return memory_format(", RMSE %s (%.1f dB)", text, image_psnr(rmse));
    if (limited == 0)
        return memory_format(", RMSE %s (%.1f dB), above %g, though no pixel met the limit of %u samples", text,
                             image_psnr(rmse), job->error, job->sampling.most);
    return memory_format(", RMSE %s (%.1f dB), above %g: %.3g %% of the pixels met the limit of %u samples", text,
                         image_psnr(rmse), job->error, 100.0 * (double)limited / (double)pixels, job->sampling.most);
}

static void say_done(const struct render_job *job, void *context)
{
    const struct render_arguments *a = context;
    if (a->quiet || strcmp(a->progress, "json") == 0)
        return;
    double seconds = (double)(job->ended_ms - job->started_ms) / 1000;
    double rays = (double)render_job_rays(job);
    double samples = render_job_samples(job);
    bool one = job->error == 0 && samples == 1;
    char count[16], rate[16];
    format_count(count, rays);
    format_count(rate, seconds > 0 ? rays / seconds : 0);
    char *error = describe_error(job);
    log_result("%s: %u×%u, %.*f sample%s a pixel, %.2f s, %s rays, %s rays/s%s", job->output_path, job->settings.width,
               job->settings.height, job->error > 0, samples, one ? "" : "s", seconds, count, rate, error);
    free(error);
}

static struct progress *make_progress(const struct render_arguments *a)
{
    bool all_is_json = a->log_json && !a->log && strcmp(a->progress, "auto") == 0;
    if (a->quiet || all_is_json || strcmp(a->progress, "none") == 0)
        return NULL;
    if (strcmp(a->progress, "json") == 0)
        return progress_create(PROGRESS_JSON, stdout);
    if (strcmp(a->progress, "bar") == 0)
        return progress_create(PROGRESS_BAR, stderr);
    return progress_create(progress_mode_auto(stderr), stderr);
}

/* --- rendering -------------------------------------------------------------------------------------------- */

/* All that a command has open, and how it ended. */
struct rendering {
    struct render_arguments *arguments;
    char **scenes;
    size_t count;
    struct coordinator_keys keys;
    struct http_server *http; /* NULL where nobody asked for it */
    struct farm *farm;
    struct render_job *jobs; /* [count] */
    struct part_file report; /* closed where nobody asked for it */
    int signal;              /* that interrupted it; 0: none did */
    bool can_go_on;          /* and there is something to go on from */
};

static enum status open_http(struct rendering *r, struct error *error)
{
    const struct render_arguments *a = r->arguments;
    struct http_token token;
    if (a->http.size == 0)
        return STATUS_OK;
    enum status status = a->http_token ? http_token_read(a->http_token, &token, error) : STATUS_OK;
    if (status != STATUS_OK)
        return status;
    r->http = http_create(&a->http, a->http_token ? &token : NULL, &status, error);
    return status;
}

static enum status open_farm(struct rendering *r, struct error *error)
{
    const struct render_arguments *a = r->arguments;
    const struct farm_config config = {
        .listen = a->listen[0] ? a->listen : NULL,
        .keys = a->keys ? &r->keys : NULL,
        .local_workers = (int)a->workers,
        .local_threads = (int)a->threads,
        .local_kernel = a->kernel,
        .log = a->log,
        .log_json = a->log_json,
        .band_rows = (uint32_t)a->band,
        .audit_percent = a->audit_percent,
    };
    enum status status = STATUS_OK;
    r->farm = farm_create(&config, &status, error);
    return status;
}

static enum status open_jobs(struct rendering *r, struct error *error)
{
    const struct render_arguments *a = r->arguments;
    struct render_choices choices = a->choices;
    choices.preview_bytes = r->http ? PREVIEWS_BYTES_MAX / r->count : 0;
    enum status status = a->output && r->count > 1 ? outputs_make_folder(a->output, error) : STATUS_OK;
    size_t total;
    char **paths = choose_paths(a, r->scenes, r->count);
    struct output *outputs = list_outputs(a, r->scenes, paths, r->count, &total);
    if (status == STATUS_OK)
        status = outputs_check_folders(outputs, total - (a->log != NULL), error); /* the log is open already */
    for (size_t i = 0; i < r->count && status == STATUS_OK; i++)
        status = render_job_init(&r->jobs[i], r->scenes[i], paths[i], &choices, error);
    if (status == STATUS_OK)
        status = spare_assets(outputs, total, r->jobs, r->count, error);
    free(outputs);
    free_paths(paths, r->count);
    if (status == STATUS_OK && r->http)
        http_show_jobs(r->http, r->jobs, r->count);
    return status;
}

/* What fails leaves the rest closed; close_all follows in any case. */
static enum status open_all(struct rendering *r, struct error *error)
{
    const struct render_arguments *a = r->arguments;
    enum status status = a->keys ? coordinator_keys_read(&r->keys, a->keys, error) : STATUS_OK;
    if (status == STATUS_OK)
        status = open_http(r, error);
    if (status == STATUS_OK)
        status = open_farm(r, error);
    if (status == STATUS_OK)
        status = open_jobs(r, error);
    if (status == STATUS_OK && a->report)
        status = part_file_open(&r->report, a->report, error);
    return status;
}

static enum status run_farm(struct rendering *r, struct error *error)
{
    struct progress *progress = make_progress(r->arguments);
    farm_set_progress(r->farm, progress);
    farm_set_http(r->farm, r->http);
    for (size_t i = 0; i < r->count; i++)
        farm_add_job(r->farm, &r->jobs[i]);
    enum status status = farm_run(r->farm, say_done, r->arguments, &r->signal, error);
    progress_destroy(&progress);
    return status;
}

/* However the render ended. What it ended with counts before what the report fails with. */
static enum status write_report(struct rendering *r, enum status status, struct error *error)
{
    const struct snapshot last = farm_snapshot(r->farm);
    struct error report_error;
    if (r->report.fd < 0 || report_publish(&r->report, &last, r->jobs, &report_error) == STATUS_OK)
        return status;
    if (status == STATUS_OK) {
        *error = report_error;
        return STATUS_OUTPUT;
    }
    log_error("%s", report_error.text);
    return status;
}

static void close_all(struct rendering *r)
{
    part_file_discard(&r->report);
    farm_destroy(&r->farm);
    if (r->http && !r->signal)
        http_linger(r->http);
    http_destroy(&r->http);
    for (size_t i = 0; i < r->count; i++) {
        const struct render_job *job = &r->jobs[i];
        r->can_go_on |= !r->arguments->choices.no_resume && job->state != JOB_DONE && render_job_has_begun(job);
        render_job_finish(&r->jobs[i]);
    }
    free(r->jobs);
    coordinator_keys_finish(&r->keys);
}

static enum status render(struct rendering *r, struct error *error)
{
    r->jobs = memory_array(r->count, sizeof *r->jobs);
    r->report = (struct part_file){.folder_fd = -1, .fd = -1};
    enum status status = open_all(r, error);
    if (status == STATUS_OK)
        status = write_report(r, run_farm(r, error), error);
    close_all(r);
    return status;
}

int command_render(int argc, char **argv)
{
    struct render_arguments a;
    struct error error;
    int first = 0;
    enum status status = render_arguments_read(&a, argc, argv, &first, &error);
    struct rendering r = {.arguments = &a, .scenes = argv + first, .count = (size_t)(argc - first)};
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error of the write that met the limit */
    if (status == STATUS_OK)
        status = open_log(&a, r.scenes, r.count, &error);
    if (status == STATUS_OK) {
        log_start("weft", a.quiet ? LOG_WARNING : a.verbose ? LOG_DEBUG : LOG_INFO);
        status = render(&r, &error);
    }
    if (r.signal) {
        log_error(r.can_go_on ? "interrupted; the same command will go on from here"
                              : "interrupted; nothing was written of the unfinished picture");
        return 128 + r.signal;
    }
    if (status != STATUS_OK)
        log_error("%s", error.text);
    return (int)status;
}
