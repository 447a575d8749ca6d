#include "coordinator/farm.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "coordinator/dispatcher.h"
#include "coordinator/local.h"
#include "coordinator/runtime.h"
#include "trace/proof.h"

struct farm {
    struct farm_config config;
    struct progress *progress;
    struct http_server *http;
    struct wire_server *server;
    char private_endpoint[WIRE_ENDPOINT_BYTES];
    struct local_workers local;
    int signals; /* descriptors: of signals, */
    int bell;    /* and of outputs that are complete */
    int judges;  /* local workers that were started to do what others may not */
    struct dispatcher *dispatcher;
    int64_t ticked_ms;
    uint32_t shown_states; /* of jobs: dispatcher_states */
};

/* --- starting --------------------------------------------------------------------------------------------- */

/* Those that end the render, unless this process was started to ignore them, as by nohup; of children; and of the
 * terminal, that its size has changed, and that we go on after we were stopped. */
static int block_signals(void)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
    sigaddset(&set, SIGWINCH);
    sigaddset(&set, SIGCONT);
    for (size_t i = 0; i < sizeof ending / sizeof *ending; i++) {
        struct sigaction now;
        if (sigaction(ending[i], NULL, &now) == 0 && now.sa_handler != SIG_IGN)
            sigaddset(&set, ending[i]);
    }
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

static enum status listen_everywhere(struct farm *farm, struct error *error)
{
    enum status status = runtime_endpoint(farm->private_endpoint, error);
    if (status == STATUS_OK)
        status = wire_server_bind_own(farm->server, farm->private_endpoint, error);
    if (status != STATUS_OK || !farm->config.listen)
        return status;
    char bound[WIRE_ENDPOINT_BYTES];
    status = wire_server_bind(farm->server, farm->config.listen, bound, error);
    if (status == STATUS_OK)
        log_info("listening on %s", bound);
    return status;
}

static enum status start(struct farm *farm, struct error *error)
{
    farm->signals = block_signals();
    farm->bell = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (farm->signals < 0 || farm->bell < 0)
        return error_set(error, STATUS_INTERNAL, "cannot make descriptors to wait for: %s", strerror(errno));
    enum status status = wire_start(error);
    if (status != STATUS_OK)
        return status;
    farm->server = wire_server_create(farm->config.keys, error);
    if (!farm->server)
        return STATUS_INTERNAL;
    status = listen_everywhere(farm, error);
    if (status != STATUS_OK)
        return status;
    const struct local_config local = {
        .endpoint = farm->private_endpoint,
        .kernel = farm->config.local_kernel,
        .log = farm->config.log,
        .log_json = farm->config.log_json,
    };
    return local_workers_init(&farm->local, &local, farm->config.local_workers, farm->config.local_threads, error);
}

static bool send_by_server(void *context, const struct wire_peer *to, const void *data, size_t size)
{
    return wire_server_send(context, to, data, size);
}

/* While the workers start: what they will be compared with. */
static struct dispatcher *make_dispatcher(const struct farm *farm)
{
    const struct dispatcher_config config = {
        .band_rows = farm->config.band_rows,
        .audit_percent = farm->config.audit_percent,
        .core_revision = proof_revision(),
        .proof = proof_render(kernel_default()),
        .bell = farm->bell,
        .send = send_by_server,
        .context = farm->server,
    };
    return dispatcher_create(&config, clock_now_ms());
}

struct farm *farm_create(const struct farm_config *config, enum status *status, struct error *error)
{
    struct farm *farm = memory_array(1, sizeof *farm);
    farm->config = *config;
    farm->signals = farm->bell = -1;
    *status = start(farm, error);
    if (*status != STATUS_OK)
        farm_destroy(&farm);
    else
        farm->dispatcher = make_dispatcher(farm);
    return farm;
}

void farm_add_job(struct farm *farm, struct render_job *job)
{
    dispatcher_add_job(farm->dispatcher, job, clock_now_ms());
}

void farm_set_progress(struct farm *farm, struct progress *progress)
{
    farm->progress = progress;
}

void farm_set_http(struct farm *farm, struct http_server *http)
{
    farm->http = http;
}

/* --- running ---------------------------------------------------------------------------------------------- */

static void say_how(pid_t pid, int how)
{
    if (WIFSIGNALED(how))
        log_warning("local worker process %d was ended by signal %d (%s)", (int)pid, WTERMSIG(how),
                    strsignal(WTERMSIG(how)));
    else
        log_warning("local worker process %d ended with status %d", (int)pid, WEXITSTATUS(how));
}

static void take_dead_children(struct farm *farm)
{
    int how;
    for (pid_t pid = local_workers_reap(&farm->local, &how); pid; pid = local_workers_reap(&farm->local, &how)) {
        say_how(pid, how);
        dispatcher_lose_process(farm->dispatcher, (uint32_t)pid, clock_now_ms());
        struct error error = {""};
        if (!local_workers_restart(&farm->local, pid, &error) && error.text[0])
            log_warning("%s", error.text);
    }
}

/* A local worker that hangs makes room for a new one. */
static void kill_expelled(struct farm *farm)
{
    uint32_t pid;
    while (dispatcher_take_expelled(farm->dispatcher, &pid))
        local_workers_kill(&farm->local, (pid_t)pid);
}

/* Workers that contradict each other need one that both must believe; what was lost with others may not be with it. */
static void start_trusted(struct farm *farm)
{
    enum { JUDGES_MAX = 3 };
    struct error error;
    if (!dispatcher_take_need_of_trusted(farm->dispatcher))
        return;
    enum status status = STATUS_OK;
    if (farm->judges++ == JUDGES_MAX)
        status = error_set(&error, STATUS_FAILED, "no local worker lives to do what others may not; giving up");
    else
        status = local_workers_add(&farm->local, farm->config.local_threads, &error);
    if (status != STATUS_OK)
        dispatcher_give_up(farm->dispatcher, status, &error, clock_now_ms());
}

/* Returns the number of a signal that ends the render, or 0. */
static int take_signals(struct farm *farm)
{
    struct signalfd_siginfo info;
    while (read(farm->signals, &info, sizeof info) == (ssize_t)sizeof info) {
        bool of_terminal = info.ssi_signo == SIGWINCH || info.ssi_signo == SIGCONT;
        if (of_terminal && farm->progress)
            progress_disturb(farm->progress, info.ssi_signo == SIGCONT);
        if (!of_terminal && info.ssi_signo != SIGCHLD)
            return (int)info.ssi_signo;
    }
    take_dead_children(farm);
    return 0;
}

/* Takes those that wait; a bounded number, so that no flood of them keeps the rest from its turn. Returns whether all
 * are taken. */
static bool take_messages(struct farm *farm)
{
    enum { MESSAGES_AT_ONCE = 1000 };
    struct bytes data = {0};
    struct wire_peer from;
    int taken = 0;
    while (taken < MESSAGES_AT_ONCE && wire_server_receive(farm->server, &from, &data)) {
        dispatcher_take_message(farm->dispatcher, &from, data.data, data.size, clock_now_ms());
        taken++;
    }
    bytes_finish(&data);
    return taken < MESSAGES_AT_ONCE;
}

/* Who seems silent may wait to be heard, so nobody is judged while messages wait, unless they do for too long. */
static void tick(struct farm *farm, bool all_taken)
{
    enum { LATEST_MS = 2000 };
    int64_t now_ms = clock_now_ms();
    if (!all_taken && now_ms - farm->ticked_ms < LATEST_MS)
        return;
    dispatcher_tick(farm->dispatcher, now_ms);
    farm->ticked_ms = clock_now_ms();
}

/* With no local worker left that could be started again, and nobody else able to come or to settle a contradiction,
 * waiting would be for ever. */
static void check_hope(struct farm *farm)
{
    struct error error;
    bool others_do = farm->config.listen && farm->judges == 0;
    if (others_do || local_workers_running(&farm->local) > 0 || dispatcher_is_over(farm->dispatcher))
        return;
    error_set(&error, STATUS_FAILED, "all local workers have died; giving up");
    dispatcher_give_up(farm->dispatcher, STATUS_FAILED, &error, clock_now_ms());
}

static int wait_ms(const struct farm *farm)
{
    int64_t now_ms = clock_now_ms(), until = dispatcher_deadline(farm->dispatcher);
    int wait = until <= now_ms ? 0 : (int)(until - now_ms);
    int progress = farm->progress ? progress_wait_ms(farm->progress, now_ms) : -1;
    int http = farm->http ? http_wait_ms(farm->http, now_ms) : -1;
    wait = progress >= 0 && progress < wait ? progress : wait;
    return http >= 0 && http < wait ? http : wait;
}

static void tell_done(struct farm *farm, farm_job_done *done, void *context)
{
    const struct render_job *job;
    uint64_t rung;
    ssize_t got = read(farm->bell, &rung, sizeof rung);
    (void)got; /* whether it has rung or not */
    while ((job = dispatcher_take_done(farm->dispatcher, clock_now_ms())))
        done(job, context);
}

/* Shows the present state where it is time to, or that of a job has changed; `last` shows it in any case. */
static void show(struct farm *farm, bool last)
{
    int64_t now_ms = clock_now_ms();
    bool news = dispatcher_states(farm->dispatcher) != farm->shown_states;
    bool progress = farm->progress && (last || news || progress_wait_ms(farm->progress, now_ms) == 0);
    bool http = farm->http && (last || http_wait_ms(farm->http, now_ms) == 0);
    if (!progress && !http)
        return;
    struct snapshot snapshot = farm_snapshot(farm);
    farm->shown_states = dispatcher_states(farm->dispatcher);
    if (http)
        http_publish(farm->http, &snapshot, now_ms, last);
    if (progress && last)
        progress_finish(farm->progress, &snapshot, now_ms);
    else if (progress)
        progress_update(farm->progress, &snapshot, now_ms);
}

/* Waits for messages, signals, outputs that are complete, who wants to see the state, and what is due. */
static void wait_for_work(struct farm *farm)
{
    struct pollfd fds[3] = {{.fd = farm->signals, .events = POLLIN}, {.fd = farm->bell, .events = POLLIN}};
    size_t count = 2;
    if (farm->http)
        fds[count++] = (struct pollfd){.fd = http_bell(farm->http), .events = POLLIN};
    wire_server_wait(farm->server, fds, count, wait_ms(farm));
}

enum status farm_run(struct farm *farm, farm_job_done *done, void *context, int *interrupted, struct error *error)
{
    *interrupted = 0;
    while (!dispatcher_is_over(farm->dispatcher)) {
        wait_for_work(farm);
        *interrupted = take_signals(farm);
        if (*interrupted)
            break;
        tick(farm, take_messages(farm));
        kill_expelled(farm);
        start_trusted(farm);
        check_hope(farm);
        tell_done(farm, done, context);
        show(farm, false);
    }
    if (*interrupted) {
        dispatcher_finish_written(farm->dispatcher);
        tell_done(farm, done, context);
    }
    show(farm, true);
    enum status status = dispatcher_status(farm->dispatcher, error);
    return *interrupted ? STATUS_FAILED : status;
}

struct snapshot farm_snapshot(struct farm *farm)
{
    return dispatcher_snapshot(farm->dispatcher, clock_now_ms());
}

/* --- ending ----------------------------------------------------------------------------------------------- */

/* A message just sent is lost if its socket closes, so the coordinator stays until its workers have answered. */
static void say_goodbye(struct farm *farm)
{
    enum { PATIENCE_MS = 500 };
    int64_t now_ms = clock_now_ms(), deadline_ms = now_ms + PATIENCE_MS;
    dispatcher_say_goodbye(farm->dispatcher, now_ms);
    for (; dispatcher_present(farm->dispatcher) > 0 && now_ms < deadline_ms; now_ms = clock_now_ms()) {
        wire_server_wait(farm->server, NULL, 0, (int)(deadline_ms - now_ms));
        take_messages(farm);
    }
}

void farm_destroy(struct farm **pointer)
{
    struct farm *farm = *pointer;
    if (!farm)
        return;
    if (farm->dispatcher)
        say_goodbye(farm);
    dispatcher_destroy(&farm->dispatcher);
    local_workers_finish(&farm->local);
    wire_server_destroy(&farm->server);
    wire_stop();
    if (farm->private_endpoint[0])
        runtime_endpoint_remove(farm->private_endpoint);
    if (farm->signals >= 0)
        close(farm->signals);
    if (farm->bell >= 0)
        close(farm->bell);
    free(farm);
    *pointer = NULL;
}
