/* weft status */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "coordinator/inquiry.h"
#include "coordinator/progress.h"
#include "coordinator/progress_views.h"
#include "coordinator/runtime.h"
#include "coordinator/snapshot_json.h"
#include "wire/socket.h"

enum { OPTION_WATCH = 256, OPTION_JSON, OPTION_KEYS, OPTION_INSECURE, OPTION_WAIT, OPTION_HELP, OPTION_VERSION };

static const struct option_spec options[] = {
    {OPTION_WATCH, "watch", NULL, "go on until the render ends"},
    {OPTION_JSON, "json", NULL, "one JSON object a line"},
    {OPTION_WAIT, "wait", "SECONDS", "give up if none answers for so long (default 5)"},
    {OPTION_KEYS, "keys", "DIR", "a watcher's or worker's key and the coordinator's"},
    {OPTION_INSECURE, "insecure", NULL, "ask another machine's coordinator without keys"},
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

struct arguments {
    bool watch, json, insecure;
    const char *keys; /* folder, or NULL */
    int64_t wait_ms;
};

struct viewer {
    const struct arguments *arguments;
    char endpoint[WIRE_ENDPOINT_BYTES];
    int signals; /* a descriptor */
    struct wire_client *client;
    struct inquiry inquiry;
    enum progress_mode mode;   /* of --watch */
    struct progress *progress; /* NULL without --watch */
    struct snapshot *seen; /* last; NULL: none yet */
    bool ended;
    int interrupted; /* by that signal; 0: it was not */
};

static void print_help(void)
{
    puts("usage: weft status [OPTION]... [ENDPOINT]\n"
         "Shows what the coordinator at ENDPOINT (HOST, HOST:PORT, tcp://HOST:PORT,\n"
         "ipc://PATH; port 7420 if none is said) is doing, as its own terminal does;\n"
         "without ENDPOINT that of this machine and user. For example:\n"
         "\n"
         "  weft status --watch\n");
    options_help(stdout, options);
    puts("\nExit status: 0 shown, and with --watch the render was completed; 1 no answer, or\n"
         "it ended early; 2 wrong usage, or there are several; 3 bad keys; 4 output could\n"
         "not be written; 5 an internal failure; 129, 130, 143 interrupted.");
}

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    struct arguments *a = context;
    int64_t seconds;
    enum status status = STATUS_OK;
    switch (key) {
    case OPTION_WATCH:
        a->watch = true;
        break;
    case OPTION_JSON:
        a->json = true;
        break;
    case OPTION_WAIT:
        status = options_integer("--wait", argument, 1, 1000000000, &seconds, error);
        if (status == STATUS_OK)
            a->wait_ms = seconds * 1000;
        break;
    case OPTION_KEYS:
        a->keys = argument;
        break;
    case OPTION_INSECURE:
        a->insecure = true;
        break;
    case OPTION_HELP:
        print_help();
        exit(STATUS_OK);
    default:
        puts("weft " WEFT_VERSION);
        exit(STATUS_OK);
    }
    return status;
}

/* --- whom to ask ------------------------------------------------------------------------------------------ */

static enum status find_own(char endpoint[WIRE_ENDPOINT_BYTES], struct error *error)
{
    enum { NAMED_MAX = 4 };
    char found[NAMED_MAX][WIRE_ENDPOINT_BYTES], named[NAMED_MAX * WIRE_ENDPOINT_BYTES] = "";
    size_t count = runtime_find(found, NAMED_MAX);
    if (count == 0)
        return error_set(error, STATUS_FAILED, "no coordinator of this user runs on this machine; of another one say "
                                               "the endpoint, as in weft status 192.0.2.1");
    if (count == 1) {
        memcpy(endpoint, found[0], WIRE_ENDPOINT_BYTES);
        return STATUS_OK;
    }
    for (size_t i = 0, at = 0; i < count && i < NAMED_MAX; i++)
        at += (size_t)snprintf(named + at, sizeof named - at, "%s%s", i ? ", " : "", found[i]);
    return error_set(error, STATUS_USAGE, "%zu coordinators run on this machine; say which: %s%s", count, named,
                     count > NAMED_MAX ? ", …" : "");
}

static enum status check_security(const struct arguments *a, const char *endpoint, struct error *error)
{
    if (a->keys && a->insecure)
        return error_set(error, STATUS_USAGE, "--keys and --insecure: expected one of them");
    if (a->keys || a->insecure || wire_endpoint_is_local(endpoint))
        return STATUS_OK;
    return error_set(error, STATUS_USAGE,
                     "%s is on another machine, and anyone on the way could answer for the coordinator; say --keys DIR "
                     "(weft keygen makes them), or --insecure if that is meant", endpoint);
}

static enum status open_client(struct viewer *v, struct error *error)
{
    struct worker_keys keys;
    const char *folder = v->arguments->keys;
    enum status status = folder ? watcher_keys_read(&keys, folder, error) : STATUS_OK;
    if (status == STATUS_OK)
        status = wire_start(error);
    if (status == STATUS_OK) {
        v->client = wire_client_create(v->endpoint, folder ? &keys : NULL, error);
        status = v->client ? STATUS_OK : STATUS_FAILED;
    }
    if (folder)
        worker_keys_finish(&keys);
    return status;
}

/* Those that end it, and those of the terminal. Before any thread exists, so that all inherit the mask. */
static int block_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGWINCH, SIGCONT};
    sigset_t set;
    sigemptyset(&set);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        sigaddset(&set, numbers[i]);
    sigprocmask(SIG_BLOCK, &set, NULL);
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

/* --- showing ---------------------------------------------------------------------------------------------- */

static enum status write_text(const struct bytes *text, struct error *error)
{
    if (fwrite(text->data, 1, text->size, stdout) == text->size && fflush(stdout) == 0)
        return STATUS_OK;
    return error_set(error, STATUS_OUTPUT, "standard output cannot be written: %s", strerror(errno));
}

/* Of the terminal; of a file or pipe enough for everything. */
static size_t columns(void)
{
    enum { COLUMNS_DEFAULT = 120 };
    struct winsize size;
    return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : COLUMNS_DEFAULT;
}

/* All of it, however long the list of workers is. */
static enum status print(const struct viewer *v, struct error *error)
{
    struct bytes text = {0};
    if (v->arguments->json)
        snapshot_write_json(&text, v->seen);
    else if (v->mode == PROGRESS_LINES)
        progress_line(&text, v->seen);
    else
        progress_block(&text, v->seen, columns(), SIZE_MAX);
    enum status status = write_text(&text, error);
    bytes_finish(&text);
    return status;
}

static void start_showing(struct viewer *v)
{
    if (!v->arguments->watch)
        return;
    v->mode = v->arguments->json ? PROGRESS_JSON : progress_mode_auto(stdout);
    v->progress = progress_create(v->mode, stdout);
}

/* How often an answer is wanted; 0: once. */
static uint32_t pause_ms(const struct viewer *v)
{
    static const uint32_t pauses[] = {[PROGRESS_BAR] = 100, [PROGRESS_LINES] = 1000, [PROGRESS_JSON] = 250};
    return v->arguments->watch ? pauses[v->mode] : 0;
}

static bool is_complete(const struct snapshot *snapshot)
{
    size_t done = 0;
    for (size_t i = 0; i < snapshot->job_count; i++)
        done += snapshot->jobs[i].state == JOB_DONE;
    return done > 0 && done == snapshot->job_count;
}

/* The block or the lines are followed by how it ended. */
static enum status end_watching(struct viewer *v, int64_t now_ms, struct error *error)
{
    enum status status = STATUS_OK;
    progress_finish(v->progress, v->seen, now_ms);
    if (!v->arguments->json)
        status = print(v, error);
    if (status == STATUS_OK && !is_complete(v->seen))
        status = error_set(error, STATUS_FAILED, "%s: the render ended before it was complete", v->endpoint);
    return status;
}

static enum status show(struct viewer *v, bool first, int64_t now_ms, struct error *error)
{
    if (!v->progress)
        return print(v, error);
    if (v->inquiry.last)
        return end_watching(v, now_ms, error);
    progress_update(v->progress, v->seen, now_ms);
    return first && v->mode == PROGRESS_LINES ? print(v, error) : STATUS_OK; /* its own first line is a later one */
}

/* --- the conversation ------------------------------------------------------------------------------------- */

static void say(struct viewer *v)
{
    struct bytes message = {0};
    int64_t now_ms = clock_now_ms();
    if (inquiry_say(&v->inquiry, &message, now_ms) && !wire_client_send(v->client, message.data, message.size))
        inquiry_not_said(&v->inquiry, now_ms);
    bytes_finish(&message);
}

static void say_goodbye(struct viewer *v)
{
    struct bytes message = {0};
    inquiry_goodbye(&message);
    wire_client_send(v->client, message.data, message.size);
    bytes_finish(&message);
}

static enum status take_answer(struct viewer *v, int64_t now_ms, struct error *error)
{
    const struct bytes *text = &v->inquiry.text;
    struct snapshot *next = snapshot_read_json((const char *)text->data, text->size, error);
    if (!next)
        return error_prefix(error, STATUS_FAILED, "%s: ", v->endpoint);
    bool first = !v->seen;
    free(v->seen);
    v->seen = next;
    v->ended = !v->progress || v->inquiry.last;
    enum status status = show(v, first, now_ms, error);
    inquiry_go_on(&v->inquiry, now_ms);
    return status;
}

/* A bounded number, so that no flood of them keeps signals from being heard. */
static enum status take_messages(struct viewer *v, struct error *error)
{
    enum { MESSAGES_AT_ONCE = 1000 };
    struct bytes data = {0};
    enum status status = STATUS_OK;
    for (int i = 0; i < MESSAGES_AT_ONCE && status == STATUS_OK && !v->ended; i++) {
        if (!wire_client_receive(v->client, &data))
            break;
        int64_t now_ms = clock_now_ms();
        status = inquiry_take(&v->inquiry, data.data, data.size, now_ms, error);
        if (status != STATUS_OK)
            error_prefix(error, status, "%s: ", v->endpoint);
        else if (v->inquiry.complete)
            status = take_answer(v, now_ms, error);
    }
    bytes_finish(&data);
    return status;
}

/* Who asks can ask again; waiting is for coordinators. */
static enum status check_name(struct viewer *v, struct error *error)
{
    if (wire_client_name(v->client, error) != WIRE_NAME_LACKING)
        return STATUS_OK;
    return error_prefix(error, STATUS_FAILED, "%s: ", v->endpoint);
}

/* Whether the coordinator is there no more, or never was. */
static enum status check_patience(struct viewer *v, struct error *error)
{
    long long seconds = v->arguments->wait_ms / 1000;
    if (v->ended || !inquiry_is_late(&v->inquiry, clock_now_ms()))
        return STATUS_OK;
    v->ended = true;
    if (v->seen && is_complete(v->seen)) /* and then it went, unheard */
        return end_watching(v, clock_now_ms(), error);
    if (v->inquiry.heard)
        return error_set(error, STATUS_FAILED, "%s: lost the coordinator: no word for %lld s", v->endpoint, seconds);
    if (wire_client_seeks_address(v->client))
        return error_set(error, STATUS_FAILED, "%s: no address of that name was found within %lld s", v->endpoint,
                         seconds);
    return error_set(error, STATUS_FAILED, "%s: no coordinator answered within %lld s%s", v->endpoint, seconds,
                     v->arguments->keys ? " (if there is one, its keys and these may not match)" : "");
}

static void take_signals(struct viewer *v)
{
    struct signalfd_siginfo info;
    while (read(v->signals, &info, sizeof info) == (ssize_t)sizeof info) {
        bool of_terminal = info.ssi_signo == SIGWINCH || info.ssi_signo == SIGCONT;
        if (of_terminal && v->progress)
            progress_disturb(v->progress, info.ssi_signo == SIGCONT);
        if (!of_terminal)
            v->interrupted = (int)info.ssi_signo;
    }
}

static enum status converse(struct viewer *v, struct error *error)
{
    enum status status = STATUS_OK;
    start_showing(v);
    inquiry_init(&v->inquiry, pause_ms(v), v->arguments->wait_ms, clock_now_ms());
    while (status == STATUS_OK && !v->ended && !v->interrupted) {
        say(v);
        struct pollfd fds[] = {{.fd = v->signals, .events = POLLIN}};
        int64_t left_ms = inquiry_deadline(&v->inquiry) - clock_now_ms();
        wire_client_wait(v->client, fds, 1, left_ms > 0 ? (int)left_ms : 0);
        take_signals(v);
        status = check_name(v, error);
        if (status == STATUS_OK)
            status = take_messages(v, error);
        if (status == STATUS_OK)
            status = check_patience(v, error);
    }
    say_goodbye(v);
    return status;
}

static enum status run(struct viewer *v, const char *endpoint, struct error *error)
{
    enum status status = endpoint ? wire_endpoint_parse(endpoint, v->endpoint, error) : find_own(v->endpoint, error);
    if (status == STATUS_OK)
        status = check_security(v->arguments, v->endpoint, error);
    if (status != STATUS_OK)
        return status;
    v->signals = block_signals();
    if (v->signals < 0)
        return error_set(error, STATUS_INTERNAL, "cannot make a descriptor for signals: %s", strerror(errno));
    status = open_client(v, error);
    if (status == STATUS_OK)
        status = converse(v, error);
    progress_destroy(&v->progress);
    inquiry_finish(&v->inquiry);
    free(v->seen);
    wire_client_destroy(&v->client);
    wire_stop();
    close(v->signals);
    return status;
}

int command_status(int argc, char **argv)
{
    struct arguments a = {.wait_ms = 5000};
    struct viewer v = {.arguments = &a, .mode = PROGRESS_NONE};
    struct error error;
    int first = 0;
    enum status status = options_parse(argc, argv, options, handle_option, &a, &first, &error);
    if (status == STATUS_OK && argc - first > 1)
        status = error_set(&error, STATUS_USAGE, "expected at most one endpoint, found %d operands; see weft status "
                                                 "--help", argc - first);
    if (status == STATUS_OK)
        status = run(&v, argv[first], &error);
    if (v.interrupted && status == STATUS_OK)
        return 128 + v.interrupted;
    if (status != STATUS_OK)
        log_error("%s", error.text);
    return (int)status;
}
