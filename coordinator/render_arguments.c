#include "coordinator/render_arguments.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/options.h"
#include "trace/kernel.h"

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

static enum status take_choice(struct render_arguments *a, int key, const char *argument, struct error *error)
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
    struct render_arguments *a = context;
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

static enum status check_http(const struct render_arguments *a, struct error *error)
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

static enum status check_arguments(const struct render_arguments *a, int scenes, struct error *error)
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

enum status render_arguments_read(struct render_arguments *a, int argc, char **argv, int *first, struct error *error)
{
    *a = (struct render_arguments){.workers = 1, .threads = cpu_available(), .progress = "auto",
                                   .choices = {.filter = -1, .bits = 8}};
    enum status status = options_parse(argc, argv, options, handle_option, a, first, error);
    return status == STATUS_OK ? check_arguments(a, argc - *first, error) : status;
}
