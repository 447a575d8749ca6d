/* weft render */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "coordinator/farm.h"
#include "coordinator/outputs.h"
#include "coordinator/report.h"
#include "image/compare.h"
#include "trace/kernel.h"
#include "wire/socket.h"

enum { OPTION_BITS = 256, OPTION_SAMPLES, OPTION_ERROR, OPTION_MAX_SAMPLES, OPTION_FILTER, OPTION_BAND, OPTION_KERNEL,
       OPTION_PROGRESS, OPTION_REPORT, OPTION_SAMPLE_MAP, OPTION_ERROR_MAP, OPTION_KEYS, OPTION_INSECURE,
       OPTION_NO_RESUME, OPTION_AUDIT, OPTION_HTTP, OPTION_HTTP_TOKEN, OPTION_LOG, OPTION_LOG_JSON, OPTION_HELP,
       OPTION_VERSION };

static const struct option_spec options[] = {
    OPTIONS_HEADING("The picture"),
    {'o', "output", "OUT", ".png or .pfm; of several scenes a folder"},
    {OPTION_BITS, "bits", "8|16", "bits a channel of a PNG (default 8)"},
    {'s', "size", "WxH", "its size in pixels (default: the scene's)"},
    {OPTION_SAMPLES, "samples", "N", "of every pixel (default: the scene's, else as --error)"},
    {OPTION_ERROR, "error", "E", "sample until the RMSE is at most E (default 0.005)"},
    {OPTION_MAX_SAMPLES, "max-samples", "N", "with --error, at most so many a pixel (default 1024)"},
    {OPTION_FILTER, "filter", "NAME", "box, or tent, which is smoother (default: the scene's)"},
    {OPTION_NO_RESUME, "no-resume", NULL, "start anew, and keep no journal to go on from"},
    OPTIONS_HEADING("Who renders it"),
    {'w', "workers", "N", "local worker processes (default 1; 0: only others)"},
    {'t', "threads", "N", "of local workers together (default: all cores)"},
    {OPTION_KERNEL, "kernel", "NAME", "of local workers: ref, sse2, avx2, avx512, neon"},
    {OPTION_BAND, "band", "ROWS", "handed out at a time (default: chosen)"},
    {'l', "listen", "ENDPOINT", "take workers from elsewhere too: tcp://192.0.2.1:7420"},
    {OPTION_KEYS, "keys", "DIR", "keys for workers of other machines; see weft keygen"},
    {OPTION_INSECURE, "insecure", NULL, "listen beyond this machine without keys"},
    {OPTION_AUDIT, "audit", "PERCENT", "of the bands, rendered twice, by two workers"},
    OPTIONS_HEADING("What is told of it"),
    {OPTION_REPORT, "report", "FILE", "all that is known of the render, as JSON"},
    {OPTION_SAMPLE_MAP, "sample-map", "FILE", "a .png of where the samples went; of one scene"},
    {OPTION_ERROR_MAP, "error-map", "FILE", "a .png of how far off each pixel is; of one scene"},
    {OPTION_HTTP, "http", "ADDR:PORT", "a page to watch it in a browser, metrics; or PORT"},
    {OPTION_HTTP_TOKEN, "http-token", "FILE", "of a secret that browsers are to show"},
    {OPTION_PROGRESS, "progress", "MODE", "auto, bar, json or none (default auto)"},
    {OPTION_LOG, "log", "FILE", "what is said goes there too, with times"},
    {OPTION_LOG_JSON, "log-json", NULL, "the log as JSON (without --log: what is said)"},
    {'q', "quiet", NULL, "say only what is wrong"},
    {'v', "verbose", NULL, "say more"},
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

struct arguments {
    const char *output, *report, *kernel, *keys, *log;
    struct render_choices choices;
    double audit_percent;
    bool can_go_on; /* once interrupted: there is something to go on from */
    int64_t workers, threads, band;
    char listen[WIRE_ENDPOINT_BYTES]; /* "": no */
    const char *http_token;
    struct http_address http; /* size 0: no */
    bool insecure, quiet, verbose, log_json;
    const char *progress;
};

static void print_help(void)
{
    puts("usage: weft render [OPTION]... SCENE...\n"
         "Renders scenes (.json or .nff): scenes/first.json into first.png, unless -o says\n"
         "where. Starts local workers by itself; with --listen, workers on other machines\n"
         "join by `weft-worker ENDPOINT`. The same command goes on where one was ended.\n");
    options_help(stdout, options);
    puts("\nExit status: 0 done; 1 the render failed; 2 wrong usage; 3 bad scene, file or\n"
         "key; 4 output could not be written; 5 an internal failure; 129, 130 and 143\n"
         "interrupted, by SIGHUP, SIGINT and SIGTERM.");
}

static enum status take_integer(const char *name, const char *text, int64_t min, int64_t max, uint32_t *value,
                                struct error *error)
{
    int64_t number;
    enum status status = options_integer(name, text, min, max, &number, error);
    if (status == STATUS_OK)
        *value = (uint32_t)number;
    return status;
}

static enum status take_size(const char *text, struct render_choices *choices, struct error *error)
{
    int64_t width, height;
    enum status status = options_size("--size", text, 1, IMAGE_SIDE_MAX, &width, &height, error);
    if (status == STATUS_OK) {
        choices->width = (uint32_t)width;
        choices->height = (uint32_t)height;
    }
    return status;
}

static enum status take_bits(const char *text, struct render_choices *choices, struct error *error)
{
    choices->bits = strcmp(text, "16") == 0 ? 16 : 8;
    if (strcmp(text, "8") == 0 || strcmp(text, "16") == 0)
        return STATUS_OK;
    return error_set(error, STATUS_USAGE, "--bits: expected 8 or 16, found \"%s\"", text);
}

static enum status take_filter(const char *text, struct render_choices *choices, struct error *error)
{
    for (choices->filter = 0; choices->filter < PIXEL_FILTERS; choices->filter++)
        if (strcmp(text, pixel_filter_names[choices->filter]) == 0)
            return STATUS_OK;
    return error_set(error, STATUS_USAGE, "--filter: expected box or tent, found \"%s\"", text);
}

static enum status take_map(const char *name, const char *path, const char **map, struct error *error)
{
    size_t length = strlen(path);
    if (length < 4 || strcmp(path + length - 4, ".png") != 0)
        return error_set(error, STATUS_USAGE, "%s: expected a file that ends with .png, found \"%s\"", name, path);
    *map = path;
    return STATUS_OK;
}

static enum status take_choice(struct arguments *a, int key, const char *argument, struct error *error)
{
    switch (key) {
    case OPTION_BITS:
        return take_bits(argument, &a->choices, error);
    case OPTION_SAMPLES:
        return take_integer("--samples", argument, 1, SCENE_SAMPLES_MAX, &a->choices.samples, error);
    case OPTION_ERROR:
        return options_number("--error", argument, 0.0005, 0.5, &a->choices.error, error);
    case OPTION_MAX_SAMPLES:
        return take_integer("--max-samples", argument, 4, SCENE_SAMPLES_MAX, &a->choices.samples_max, error);
    case OPTION_FILTER:
        return take_filter(argument, &a->choices, error);
    case OPTION_SAMPLE_MAP:
        return take_map("--sample-map", argument, &a->choices.sample_map, error);
    case OPTION_ERROR_MAP:
        return take_map("--error-map", argument, &a->choices.error_map, error);
    case 's':
        return take_size(argument, &a->choices, error);
    case 'w':
        return options_integer("--workers", argument, 0, 1024, &a->workers, error);
    case 't':
        return options_integer("--threads", argument, 1, 4096, &a->threads, error);
    case OPTION_BAND:
        return options_integer("--band", argument, 1, IMAGE_SIDE_MAX, &a->band, error);
    case OPTION_AUDIT:
        return options_number("--audit", argument, 0, 100, &a->audit_percent, error);
    case 'l':
        return wire_endpoint_parse(argument, a->listen, error);
    case OPTION_HTTP:
        return http_address_parse(argument, &a->http, error);
    case OPTION_KERNEL:
        a->kernel = argument;
        if (kernel_find(argument))
            return STATUS_OK;
        return error_set(error, STATUS_USAGE, "--kernel: expected a kernel that this machine can run, found \"%s\"",
                         argument);
    default:
        return STATUS_OK;
    }
}

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    struct arguments *a = context;
    switch (key) {
    case 'o':
        a->output = argument;
        break;
    case OPTION_REPORT:
        a->report = argument;
        break;
    case OPTION_PROGRESS:
        a->progress = argument;
        break;
    case OPTION_KEYS:
        a->keys = argument;
        break;
    case OPTION_HTTP_TOKEN:
        a->http_token = argument;
        break;
    case OPTION_INSECURE:
        a->insecure = true;
        break;
    case OPTION_NO_RESUME:
        a->choices.no_resume = true;
        break;
    case OPTION_LOG:
        a->log = argument;
        break;
    case OPTION_LOG_JSON:
        a->log_json = true;
        break;
    case 'q':
        a->quiet = true;
        break;
    case 'v':
        a->verbose = true;
        break;
    case OPTION_HELP:
        print_help();
        exit(STATUS_OK);
    case OPTION_VERSION:
        puts("weft " WEFT_VERSION);
        exit(STATUS_OK);
    default:
        return take_choice(a, key, argument, error);
    }
    return STATUS_OK;
}

static enum status check_http(const struct arguments *a, struct error *error)
{
    char url[HTTP_URL_BYTES];
    bool on = a->http.size > 0;
    if (a->http_token && !on)
        return error_set(error, STATUS_USAGE, "--http-token needs --http");
    if (!on || a->http_token || a->insecure || http_address_is_local(&a->http))
        return STATUS_OK;
    http_address_url(&a->http, url);
    return error_set(error, STATUS_USAGE,
                     "--http: %s can be reached from other machines, and anyone there could watch; say --http-token "
                     "FILE, or --insecure if that is meant", url);
}

static enum status check_arguments(const struct arguments *a, int scenes, struct error *error)
{
    static const char *const modes[] = {"auto", "bar", "json", "none"};
    size_t mode = 0;
    while (mode < 4 && strcmp(a->progress, modes[mode]) != 0)
        mode++;
    if (mode == 4)
        return error_set(error, STATUS_USAGE, "--progress: expected auto, bar, json or none, found \"%s\"",
                         a->progress);
    if (scenes == 0)
        return error_set(error, STATUS_USAGE, "expected a scene; see weft render --help");
    if (a->choices.samples > 0 && a->choices.error > 0)
        return error_set(error, STATUS_USAGE, "--samples and --error: expected one of them");
    if (a->choices.samples > 0 && a->choices.samples_max > 0)
        return error_set(error, STATUS_USAGE, "--samples and --max-samples: expected one of them");
    if (scenes > 1 && (a->choices.sample_map || a->choices.error_map))
        return error_set(error, STATUS_USAGE, "--sample-map and --error-map: expected one scene, found %d", scenes);
    if (a->workers == 0 && !a->listen[0])
        return error_set(error, STATUS_USAGE, "--workers 0 needs --listen: otherwise nobody would render");
    if (a->keys && a->insecure)
        return error_set(error, STATUS_USAGE, "--keys and --insecure: expected one of them");
    if (a->listen[0] && !a->keys && !a->insecure && !wire_endpoint_is_local(a->listen))
        return error_set(error, STATUS_USAGE,
                         "--listen: %s can be reached from other machines, and anyone there could join; say --keys DIR "
                         "(weft keygen makes them), or --insecure if that is meant",
                         a->listen);
    return check_http(a, error);
}

/* --- outputs ---------------------------------------------------------------------------------------------- */

/* Where the scenes' pictures go: paths[count]; free_paths follows. */
static char **choose_paths(const struct arguments *a, char **scenes, size_t count)
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

/* That all files that are asked for are different ones. */
static enum status check_distinct(const struct arguments *a, char **scenes, char **paths, size_t count,
                                  struct error *error)
{
    const struct output others[] = {{"--sample-map", a->choices.sample_map},
                                    {"--error-map", a->choices.error_map},
                                    {"--report", a->report},
                                    {"--log", a->log}};
    struct output *outputs = memory_array(count + sizeof others / sizeof *others, sizeof *outputs);
    size_t total = 0;
    for (size_t i = 0; i < count; i++)
        outputs[total++] = (struct output){scenes[i], paths[i]};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (others[i].path)
            outputs[total++] = others[i];
    enum status status = outputs_check_distinct(outputs, total, error);
    free(outputs);
    return status;
}

/* The log, which is opened before anything is said, must not be one of the outputs either. */
static enum status open_log(const struct arguments *a, char **scenes, size_t count, struct error *error)
{
    char **paths = choose_paths(a, scenes, count);
    enum status status = check_distinct(a, scenes, paths, count, error);
    free_paths(paths, count);
    return status == STATUS_OK ? log_open(a->log, a->log_json, error) : status;
}

static enum status open_jobs(const struct arguments *a, char **scenes, size_t count, struct render_job *jobs,
                             struct error *error)
{
    enum status status = a->output && count > 1 ? outputs_make_folder(a->output, error) : STATUS_OK;
    char **paths = choose_paths(a, scenes, count);
    for (size_t i = 0; i < count && status == STATUS_OK; i++)
        status = render_job_init(&jobs[i], scenes[i], paths[i], &a->choices, error);
    free_paths(paths, count);
    return status;
}

/* --- rendering -------------------------------------------------------------------------------------------- */

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
    const struct arguments *a = context;
    if (a->quiet || strcmp(a->progress, "json") == 0)
        return;
    double seconds = (double)(job->ended_ms - job->started_ms) / 1000;
    double rays = (double)render_job_rays(job);
    char count[16], rate[16];
    format_count(count, rays);
    format_count(rate, seconds > 0 ? rays / seconds : 0);
    char *error = describe_error(job);
    log_result("%s: %u×%u, %.*f samples a pixel, %.2f s, %s rays, %s rays/s%s", job->output_path, job->settings.width,
               job->settings.height, job->error > 0, render_job_samples(job), seconds, count, rate, error);
    free(error);
}

static struct progress *make_progress(const struct arguments *a)
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

/* Renders what is open, and reports it however it ended, unless `report` is closed. */
static enum status run(struct arguments *a, struct farm *farm, struct http_server *http, struct render_job *jobs,
                       size_t count, struct part_file *report, int *interrupted, struct error *error)
{
    struct progress *progress = make_progress(a);
    struct error report_error;
    farm_set_progress(farm, progress);
    farm_set_http(farm, http);
    for (size_t i = 0; i < count; i++)
        farm_add_job(farm, &jobs[i]);
    enum status status = farm_run(farm, say_done, a, interrupted, error);
    progress_destroy(&progress);
    struct snapshot last = farm_snapshot(farm);
    if (report->fd < 0 || report_publish(report, &last, jobs, &report_error) == STATUS_OK)
        return status;
    if (status == STATUS_OK) {
        *error = report_error;
        return STATUS_OUTPUT;
    }
    log_error("%s", report_error.text);
    return status;
}

/* *http stays NULL where nobody asked for it. */
static enum status open_http(const struct arguments *a, struct http_server **http, struct error *error)
{
    struct http_token token;
    if (a->http.size == 0)
        return STATUS_OK;
    enum status status = a->http_token ? http_token_read(a->http_token, &token, error) : STATUS_OK;
    if (status != STATUS_OK)
        return status;
    *http = http_create(&a->http, a->http_token ? &token : NULL, error);
    return *http ? STATUS_OK : STATUS_FAILED;
}

static enum status render(struct arguments *a, struct coordinator_keys *keys, char **scenes, size_t count,
                          int *interrupted, struct error *error)
{
    struct farm_config config = {
        .listen = a->listen[0] ? a->listen : NULL,
        .keys = keys,
        .local_workers = (int)a->workers,
        .local_threads = (int)a->threads,
        .local_kernel = a->kernel,
        .log = a->log,
        .log_json = a->log_json,
        .band_rows = (uint32_t)a->band,
        .audit_percent = a->audit_percent,
    };
    struct http_server *http = NULL;
    enum status status = open_http(a, &http, error);
    struct farm *farm = status == STATUS_OK ? farm_create(&config, &status, error) : NULL;
    if (!farm) {
        http_destroy(&http);
        return status;
    }
    struct render_job *jobs = memory_array(count, sizeof *jobs);
    struct part_file report = {.folder_fd = -1, .fd = -1};
    a->choices.preview_bytes = http ? PREVIEWS_BYTES_MAX / count : 0;
    status = open_jobs(a, scenes, count, jobs, error);
    if (status == STATUS_OK && http)
        http_show_jobs(http, jobs, count);
    if (status == STATUS_OK && a->report)
        status = part_file_open(&report, a->report, error);
    if (status == STATUS_OK)
        status = run(a, farm, http, jobs, count, &report, interrupted, error);
    part_file_discard(&report);
    farm_destroy(&farm);
    if (http && !*interrupted)
        http_linger(http);
    http_destroy(&http);
    for (size_t i = 0; i < count; i++) {
        a->can_go_on |= !a->choices.no_resume && jobs[i].state != JOB_DONE &&
                         render_job_has_begun(&jobs[i]);
        render_job_finish(&jobs[i]);
    }
    free(jobs);
    return status;
}

static enum status render_with_keys(struct arguments *a, char **scenes, size_t count, int *interrupted,
                                    struct error *error)
{
    struct coordinator_keys keys;
    enum status status = coordinator_keys_read(&keys, a->keys, error);
    if (status == STATUS_OK)
        status = render(a, &keys, scenes, count, interrupted, error);
    coordinator_keys_finish(&keys);
    return status;
}

int command_render(int argc, char **argv)
{
    struct arguments a = {.workers = 1, .threads = cpu_available(), .progress = "auto",
                          .choices = {.filter = -1, .bits = 8}};
    struct error error;
    int first = 0, interrupted = 0;
    enum status status = options_parse(argc, argv, options, handle_option, &a, &first, &error);
    if (status == STATUS_OK)
        status = check_arguments(&a, argc - first, &error);
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error of the write that met the limit */
    if (status == STATUS_OK)
        status = open_log(&a, argv + first, (size_t)(argc - first), &error);
    if (status == STATUS_OK) {
        log_start("weft", a.quiet ? LOG_WARNING : a.verbose ? LOG_DEBUG : LOG_INFO);
        char **scenes = argv + first;
        size_t count = (size_t)(argc - first);
        status = a.keys ? render_with_keys(&a, scenes, count, &interrupted, &error)
                        : render(&a, NULL, scenes, count, &interrupted, &error);
    }
    if (interrupted) {
        log_error(a.can_go_on ? "interrupted; the same command will go on from here"
                              : "interrupted; nothing was written of the unfinished picture");
        return 128 + interrupted;
    }
    if (status != STATUS_OK)
        log_error("%s", error.text);
    return (int)status;
}
