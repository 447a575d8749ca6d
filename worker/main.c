/* weft-worker: joins a coordinator and renders bands for it. */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "base/abort.h"
#include "base/clock.h"
#include "base/cpu.h"
#include "base/log.h"
#include "base/options.h"
#include "trace/proof.h"
#include "wire/socket.h"
#include "worker/pool.h"
#include "worker/session.h"

enum { OPTION_KERNEL = 256, OPTION_ONCE, OPTION_WAIT, OPTION_KEYS, OPTION_INSECURE, OPTION_TETHER,
       OPTION_LOG, OPTION_LOG_JSON, OPTION_HELP, OPTION_VERSION };

enum { EXIT_INTERRUPTED = 130, EXIT_TERMINATED = 143 };

static const struct option_spec options[] = {
    {'t', "threads", "N", "render threads (default: all cores it may use)"},
    {OPTION_KERNEL, "kernel", "NAME", "force a kernel: ref, sse2, avx2, avx512, neon"},
    {OPTION_ONCE, "once", NULL, "end with the coordinator; do not wait for the next"},
    {OPTION_WAIT, "wait", "SECONDS", "give up if none answers for so long (default: never)"},
    {OPTION_KEYS, "keys", "DIR", "its own key and the coordinator's; see weft keygen"},
    {OPTION_INSECURE, "insecure", NULL, "join another machine's coordinator without keys"},
    {OPTION_TETHER, "tether", NULL, "end at once when standard input closes"},
    {OPTION_LOG, "log", "FILE", "what is said goes there too, with times"},
    {OPTION_LOG_JSON, "log-json", NULL, "the log as JSON (without --log: what is said)"},
    {'q', "quiet", NULL, "say only what is wrong"},
    {'v', "verbose", NULL, "say more"},
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

struct settings {
    int threads;
    const struct kernel *kernel;
    bool once, tether, insecure;
    const char *keys; /* folder, or NULL */
    const char *log;  /* file, or NULL */
    bool log_json;
    int64_t wait_ms;
    enum log_level level;
};

struct worker {
    struct settings settings;
    struct wire_client *client;
    struct session *session;
    struct pool *pool;
    int signals;
    int terminations; /* SIGTERMs received */
    bool ended;
    int exit_status;
};

static void print_help(void)
{
    puts("usage: weft-worker [OPTION]... ENDPOINT\n"
         "Joins the coordinator at ENDPOINT (HOST, HOST:PORT, tcp://HOST:PORT, ipc://PATH;\n"
         "port 7420 if none is said) and renders for it. Started before its coordinator it\n"
         "waits; after a render it waits for the next. For example:\n"
         "\n"
         "  weft-worker --keys keys 192.0.2.1\n");
    options_help(stdout, options);
    puts("\nSIGTERM: finish the bands in hand, then end; a second one ends at once.\n"
         "Exit status: 0 done; 1 refused, or none answered within --wait; 2 wrong usage;\n"
         "3 bad keys; 4 no log; 5 an internal failure; 130, 143 ended at once.");
}

static enum status choose_kernel(struct settings *settings, const char *name, struct error *error)
{
    settings->kernel = kernel_find(name);
    if (settings->kernel)
        return STATUS_OK;
    return error_set(error, STATUS_USAGE, "--kernel: expected a kernel that this machine can run, found \"%s\"", name);
}

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    struct settings *settings = context;
    int64_t number;
    enum status status = STATUS_OK;
    switch (key) {
    case 't':
        status = options_integer("--threads", argument, 1, 1024, &number, error);
        if (status == STATUS_OK)
            settings->threads = (int)number;
        break;
    case OPTION_KERNEL:
        status = choose_kernel(settings, argument, error);
        break;
    case OPTION_ONCE:
        settings->once = true;
        break;
    case OPTION_WAIT:
        status = options_integer("--wait", argument, 1, 1000000000, &number, error);
        if (status == STATUS_OK)
            settings->wait_ms = number * 1000;
        break;
    case OPTION_KEYS:
        settings->keys = argument;
        break;
    case OPTION_INSECURE:
        settings->insecure = true;
        break;
    case OPTION_TETHER:
        settings->tether = true;
        break;
    case OPTION_LOG:
        settings->log = argument;
        break;
    case OPTION_LOG_JSON:
        settings->log_json = true;
        break;
    case 'q':
        settings->level = LOG_WARNING;
        break;
    case 'v':
        settings->level = LOG_DEBUG;
        break;
    case OPTION_HELP:
        print_help();
        exit(STATUS_OK);
    case OPTION_VERSION:
        puts("weft-worker " WEFT_VERSION);
        exit(STATUS_OK);
    default:
        break;
    }
    return status;
}

static struct session_config describe(const struct settings *settings)
{
    struct session_config config = {.once = settings->once, .keyed = settings->keys, .wait_ms = settings->wait_ms};
    config.hello.kind = MESSAGE_HELLO;
    config.hello.hello.core_revision = proof_revision();
    config.hello.hello.proof = proof_render(settings->kernel);
    config.hello.hello.pid = (uint32_t)getpid();
    config.hello.hello.threads = (uint32_t)settings->threads;
    config.hello.hello.credit = 2 * (uint32_t)settings->threads; /* two bands a thread hide the round trip */
    wire_host_name(config.hello.hello.host, sizeof config.hello.hello.host);
    strncpy(config.hello.hello.kernel, settings->kernel->name, sizeof config.hello.hello.kernel - 1);
    return config;
}

/* SIGTERM and SIGINT are read from a descriptor; a broken pipe is an error of the write that met it. */
static int block_signals(void)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

static void finish(struct worker *w, int exit_status)
{
    if (!w->ended)
        w->exit_status = exit_status;
    w->ended = true;
}

/* --- carrying out the session's actions ------------------------------------------------------------------- */

static void load(struct worker *w, uint32_t job)
{
    struct job_settings settings;
    struct asset_set assets = {0};
    const char *name = session_assets(w->session, job, &settings, &assets);
    pool_load(w->pool, job, name, &assets, &settings);
}

static void reconnect(struct worker *w)
{
    struct error error;
    if (wire_client_reconnect(w->client, &error) == STATUS_OK)
        return;
    log_error("%s", error.text);
    finish(w, STATUS_INTERNAL);
}

static void carry_out(struct worker *w, struct session_action *action)
{
    switch (action->kind) {
    case SESSION_SEND:
        if (!wire_client_send(w->client, action->bytes.data, action->bytes.size))
            session_send_failed(w->session, clock_now_ms());
        bytes_finish(&action->bytes);
        break;
    case SESSION_LOAD:
        load(w, action->job);
        break;
    case SESSION_START:
        pool_start(w->pool, action->lease, action->job, &action->order);
        break;
    case SESSION_CANCEL:
        pool_cancel(w->pool, action->lease);
        break;
    case SESSION_FORGET:
        pool_forget(w->pool, action->job);
        break;
    case SESSION_RECONNECT:
        reconnect(w);
        break;
    case SESSION_SAY:
        log_info("%s", action->text);
        break;
    case SESSION_EXIT:
        finish(w, action->exit_status);
        break;
    }
}

static void handle(struct worker *w, const struct session_event *event)
{
    session_handle(w->session, event, clock_now_ms());
    struct session_action action;
    while (session_take(w->session, &action))
        carry_out(w, &action);
}

/* --- what happens ----------------------------------------------------------------------------------------- */

/* Of a message of another version no more is understood than that: it comes from a coordinator that has no use for this
 * worker. */
static void take_foreign(struct worker *w, unsigned version)
{
    struct message refusal = {.kind = MESSAGE_REFUSE};
    snprintf(refusal.refuse.reason, sizeof refusal.refuse.reason,
             "it speaks version %u of the protocol, this worker version %d", version, PROTOCOL_VERSION);
    handle(w, &(struct session_event){.kind = SESSION_MESSAGE, .message = &refusal});
}

static void take_messages(struct worker *w)
{
    struct bytes data = {0};
    while (!w->ended && wire_client_receive(w->client, &data)) {
        struct message message;
        struct error error;
        unsigned version = message_version(data.data, data.size);
        if (version > 0 && version != PROTOCOL_VERSION)
            take_foreign(w, version);
        else if (message_decode(&message, data.data, data.size, &error) == STATUS_OK)
            handle(w, &(struct session_event){.kind = SESSION_MESSAGE, .message = &message});
        else
            log_warning("ignored a message: %s", error.text);
    }
    bytes_finish(&data);
}

static void take_outcomes(struct worker *w)
{
    static const enum session_event_kind kinds[] = {
        [POOL_LOADED] = SESSION_LOADED, [POOL_LOAD_FAILED] = SESSION_LOAD_FAILED, [POOL_BAND] = SESSION_RENDERED};
    struct pool_outcome outcome;
    while (pool_take(w->pool, &outcome))
        handle(w, &(struct session_event){.kind = kinds[outcome.kind], .job = outcome.job, .lease = outcome.lease,
                                          .reason = outcome.error.text, .records = &outcome.bytes});
}

/* A signal that ends at once does so without joining the render threads, whose tiles can take minutes. */
static void take_signals(struct worker *w)
{
    struct signalfd_siginfo info;
    while (read(w->signals, &info, sizeof info) == (ssize_t)sizeof info) {
        if (info.ssi_signo == SIGINT)
            _exit(EXIT_INTERRUPTED);
        else if (++w->terminations > 1)
            _exit(EXIT_TERMINATED);
        else
            handle(w, &(struct session_event){.kind = SESSION_DRAIN});
    }
}

/* The name may be one that is yet to come. */
static void tell_of_name(struct worker *w)
{
    struct error error;
    enum wire_name name = wire_client_name(w->client, &error);
    if (name == WIRE_NAME_LACKING)
        log_warning("%s; trying again and again", error.text);
    else if (name == WIRE_NAME_FOUND)
        log_info("the coordinator's name leads to an address now");
}

static void tick(struct worker *w)
{
    struct session_event event = {.kind = SESSION_TICK};
    pool_progress(w->pool, &event.progress, &event.rays);
    handle(w, &event);
}

/* True once the other end of standard input is closed. */
static bool tether_is_cut(short revents)
{
    if (!(revents & (POLLIN | POLLHUP | POLLERR)))
        return false;
    char buffer[64];
    ssize_t got = read(STDIN_FILENO, buffer, sizeof buffer);
    return got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN);
}

static void run(struct worker *w)
{
    while (!w->ended) {
        struct pollfd fds[3] = {{.fd = w->signals, .events = POLLIN},
                                {.fd = pool_descriptor(w->pool), .events = POLLIN},
                                {.fd = STDIN_FILENO, .events = POLLIN}};
        int64_t wait_ms = session_deadline(w->session) - clock_now_ms();
        wait_ms = wait_ms < 0 ? 0 : wait_ms > 60000 ? 60000 : wait_ms;
        wire_client_wait(w->client, fds, w->settings.tether ? 3 : 2, (int)wait_ms);
        if (w->settings.tether && tether_is_cut(fds[2].revents))
            _exit(STATUS_FAILED); /* the coordinator is gone, and so is the reason to be here */
        take_signals(w);
        tell_of_name(w);
        take_outcomes(w);
        take_messages(w);
        tick(w);
    }
}

static enum status check_security(const struct settings *settings, const char *endpoint, struct error *error)
{
    if (settings->keys && settings->insecure)
        return error_set(error, STATUS_USAGE, "--keys and --insecure: expected one of them");
    if (settings->keys || settings->insecure || wire_endpoint_is_local(endpoint))
        return STATUS_OK;
    return error_set(error, STATUS_USAGE,
                     "%s is on another machine, and anyone on the way could pass for the coordinator; say --keys DIR "
                     "(weft keygen makes them), or --insecure if that is meant", endpoint);
}

static enum status connect_client(struct worker *w, const char *endpoint, struct error *error)
{
    struct worker_keys keys;
    enum status status = w->settings.keys ? worker_keys_read(&keys, w->settings.keys, error) : STATUS_OK;
    if (status == STATUS_OK)
        status = wire_start(error);
    if (status == STATUS_OK) {
        w->client = wire_client_create(endpoint, w->settings.keys ? &keys : NULL, error);
        status = w->client ? STATUS_OK : STATUS_FAILED;
    }
    if (w->settings.keys)
        worker_keys_finish(&keys);
    return status;
}

static enum status start(struct worker *w, const char *endpoint_text, struct error *error)
{
    char endpoint[WIRE_ENDPOINT_BYTES];
    enum status status = wire_endpoint_parse(endpoint_text, endpoint, error);
    if (status == STATUS_OK)
        status = check_security(&w->settings, endpoint, error);
    if (status == STATUS_OK)
        status = connect_client(w, endpoint, error);
    if (status != STATUS_OK)
        return status;
    w->pool = pool_create(w->settings.threads, w->settings.kernel, error);
    if (!w->pool)
        return STATUS_INTERNAL;
    log_info("looking for a coordinator at %s", endpoint);
    struct session_config config = describe(&w->settings);
    w->session = session_create(&config, clock_now_ms());
    return STATUS_OK;
}

int main(int argc, char **argv)
{
    struct worker w = {.settings = {.threads = cpu_available(), .kernel = kernel_default(), .wait_ms = -1,
                                    .level = LOG_INFO}};
    struct error error;
    int first;
    log_start("weft-worker", LOG_INFO);
    abort_becomes_status("weft-worker");
    enum status status = options_parse(argc, argv, options, handle_option, &w.settings, &first, &error);
    if (status == STATUS_OK && argc - first != 1)
        status = error_set(&error, STATUS_USAGE, "expected one endpoint, found %d operands; see --help", argc - first);
    if (status == STATUS_OK)
        status = log_open(w.settings.log, w.settings.log_json, &error);
    if (status != STATUS_OK) {
        log_error("%s", error.text);
        return status;
    }
    log_start("weft-worker", w.settings.level);
    w.signals = block_signals(); /* before any thread exists, so that all inherit the mask */
    status = start(&w, argv[first], &error);
    if (status == STATUS_OK)
        run(&w);
    else
        log_error("%s", error.text);
    session_destroy(&w.session);
    wire_client_destroy(&w.client);
    wire_stop();
    pool_destroy(&w.pool);
    log_close();
    return status == STATUS_OK ? w.exit_status : (int)status;
}
