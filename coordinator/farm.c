#include "coordinator/farm.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "coordinator/farm_private.h"
#include "coordinator/runtime.h"
#include "trace/proof.h"

enum { BEAT_MS = 1000, SILENCE_MS = 4500 }; /* four beats, and a little */

/* --- starting --------------------------------------------------------------------------------------------- */

/* Signals that this process was started to ignore, as by nohup, stay ignored. */
static int block_signals(void)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
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
        status = wire_server_bind(farm->server, farm->private_endpoint, NULL, error);
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
    enum status status = wire_start(error);
    if (status != STATUS_OK)
        return status;
    farm->server = wire_server_create(error);
    if (!farm->server)
        return STATUS_FAILED;
    status = listen_everywhere(farm, error);
    if (status != STATUS_OK)
        return status;
    return local_workers_init(&farm->local, farm->config.local_workers, farm->config.local_threads,
                              farm->private_endpoint, farm->config.local_kernel, error);
}

struct farm *farm_create(const struct farm_config *config, enum status *status, struct error *error)
{
    struct farm *farm = memory_array(1, sizeof *farm);
    farm->config = *config;
    farm->signals = -1;
    farm->started_ms = farm->beat_ms = clock_now_ms();
    farm->scheduler = scheduler_create(&(struct scheduler_policy){config->band_rows, SILENCE_MS});
    *status = start(farm, error);
    if (*status != STATUS_OK) {
        farm_destroy(&farm);
        return NULL;
    }
    /* While the workers start: what they will be compared with. */
    farm->core_revision = proof_revision();
    farm->proof = proof_render(kernel_default());
    return farm;
}

void farm_add_job(struct farm *farm, struct render_job *job)
{
    farm->jobs = memory_grow(farm->jobs, &farm->job_capacity, farm->job_count + 1, sizeof(struct render_job *));
    farm->jobs[farm->job_count++] = job;
    farm_tell(farm, &(struct event){.kind = EVENT_JOB, .survey_rows = render_job_survey_rows(job),
                                    .rows = job->settings.height}, NULL);
}

void farm_set_progress(struct farm *farm, struct progress *progress)
{
    farm->progress = progress;
}

/* --- running ---------------------------------------------------------------------------------------------- */

static struct peer *peer_of_process(struct farm *farm, pid_t pid)
{
    for (size_t i = 0; i < farm->peer_count; i++)
        if (!farm->peers[i].gone && farm->peers[i].pid == (uint32_t)pid)
            return &farm->peers[i];
    return NULL;
}

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
        struct peer *peer = peer_of_process(farm, pid);
        if (peer)
            farm_lose_peer(farm, peer, true);
        struct error error = {""};
        if (!local_workers_restart(&farm->local, pid, &error) && error.text[0])
            log_warning("%s", error.text);
    }
}

/* Returns the number of a signal that ends the render, or 0. */
static int take_signals(struct farm *farm)
{
    struct signalfd_siginfo info;
    while (read(farm->signals, &info, sizeof info) == (ssize_t)sizeof info)
        if (info.ssi_signo != SIGCHLD)
            return (int)info.ssi_signo;
    take_dead_children(farm);
    return 0;
}

static void beat(struct farm *farm)
{
    int64_t now_ms = clock_now_ms();
    if (now_ms < farm->beat_ms)
        return;
    farm->beat_ms = now_ms + BEAT_MS;
    for (size_t i = 0; i < farm->peer_count; i++)
        farm_send(farm, &farm->peers[i], (struct message){.kind = MESSAGE_BEAT});
}

/* With no local worker left that could be started again and nobody else able to come, waiting would be for ever. */
static void check_hope(struct farm *farm)
{
    if (farm->config.listen || local_workers_running(&farm->local) > 0 || farm->status != STATUS_OK)
        return;
    farm->status = error_set(&farm->error, STATUS_FAILED, "all local workers have died; giving up");
    for (size_t i = 0; i < farm->job_count; i++)
        if (render_job_is_open(farm->jobs[i]))
            render_job_fail(farm->jobs[i]);
}

static int wait_ms(const struct farm *farm)
{
    int64_t now_ms = clock_now_ms(), until = farm->beat_ms, deadline = scheduler_deadline(farm->scheduler);
    until = deadline < until ? deadline : until;
    int wait = until <= now_ms ? 0 : (int)(until - now_ms);
    int progress = farm->progress ? progress_wait_ms(farm->progress, now_ms) : -1;
    return progress >= 0 && progress < wait ? progress : wait;
}

enum status farm_run(struct farm *farm, farm_job_done *done, void *context, int *interrupted, struct error *error)
{
    farm->job_done = done;
    farm->job_done_context = context;
    *interrupted = 0;
    while (farm->jobs_over < farm->job_count && farm->status == STATUS_OK) {
        struct pollfd signals = {.fd = farm->signals, .events = POLLIN};
        wire_server_wait(farm->server, &signals, 1, wait_ms(farm));
        *interrupted = take_signals(farm);
        if (*interrupted)
            break;
        farm_take_messages(farm);
        farm_tell(farm, &(struct event){.kind = EVENT_TICK}, NULL);
        beat(farm);
        check_hope(farm);
        farm_show(farm, false);
    }
    farm_show(farm, true);
    *error = farm->error;
    return *interrupted ? STATUS_FAILED : farm->status;
}

/* --- ending ----------------------------------------------------------------------------------------------- */

static size_t peers_present(const struct farm *farm)
{
    size_t present = 0;
    for (size_t i = 0; i < farm->peer_count; i++)
        present += !farm->peers[i].gone;
    return present;
}

/* A message just sent is lost if its socket closes, so the coordinator stays until its workers have answered. */
static void say_goodbye(struct farm *farm)
{
    enum { PATIENCE_MS = 500 };
    int64_t now_ms = clock_now_ms(), deadline_ms = now_ms + PATIENCE_MS;
    for (size_t i = 0; i < farm->peer_count; i++)
        farm_send(farm, &farm->peers[i], (struct message){.kind = MESSAGE_GOODBYE});
    farm->ending = true;
    farm->status = STATUS_OK; /* whatever ended the farm, messages are to be taken once more */
    for (; peers_present(farm) > 0 && now_ms < deadline_ms; now_ms = clock_now_ms()) {
        wire_server_wait(farm->server, NULL, 0, (int)(deadline_ms - now_ms));
        farm_take_messages(farm);
    }
}

void farm_destroy(struct farm **pointer)
{
    struct farm *farm = *pointer;
    if (!farm)
        return;
    if (farm->server)
        say_goodbye(farm);
    for (size_t i = 0; i < farm->peer_count; i++)
        peer_finish(&farm->peers[i]);
    local_workers_finish(&farm->local);
    wire_server_destroy(&farm->server);
    wire_stop();
    if (farm->private_endpoint[0])
        runtime_endpoint_remove(farm->private_endpoint);
    if (farm->signals >= 0)
        close(farm->signals);
    scheduler_destroy(&farm->scheduler);
    free(farm->events);
    free(farm->job_views);
    free(farm->worker_views);
    free(farm->peers);
    free(farm->jobs);
    free(farm);
    *pointer = NULL;
}
