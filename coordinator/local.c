#include "coordinator/local.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"

extern char **environ;

/* weft-worker beside this program. */
static void find_program(char *path, size_t capacity)
{
    ssize_t length = readlink("/proc/self/exe", path, capacity - 1);
    path[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(path, '/');
    size_t folder = slash ? (size_t)(slash + 1 - path) : 0;
    snprintf(path + folder, capacity - folder, "weft-worker");
}

/* Default signals, none blocked (the coordinator blocks those it reads from a descriptor), and a process group of its
 * own, so that Ctrl-C reaches the coordinator alone. */
static void set_attributes(posix_spawnattr_t *attributes)
{
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_init(attributes);
    posix_spawnattr_setsigmask(attributes, &none);
    posix_spawnattr_setsigdefault(attributes, &all);
    posix_spawnattr_setpgroup(attributes, 0);
    posix_spawnattr_setflags(attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

enum { ARGUMENTS_MAX = 16 };

/* Into a list that ends with NULL; texts are borrowed. */
static void list_arguments(const struct local_workers *local, const char *threads, const char *list[ARGUMENTS_MAX])
{
    const struct local_config *config = &local->config;
    size_t count = 0;
    list[count++] = local->program;
    list[count++] = "--once";
    list[count++] = "--tether";
    list[count++] = "--quiet";
    list[count++] = "--threads";
    list[count++] = threads;
    if (config->kernel) {
        list[count++] = "--kernel";
        list[count++] = config->kernel;
    }
    if (config->log) {
        list[count++] = "--log";
        list[count++] = config->log;
    }
    if (config->log_json)
        list[count++] = "--log-json";
    list[count++] = config->endpoint;
    list[count] = NULL;
}

static enum status spawn(struct local_workers *local, struct local_worker *worker, struct error *error)
{
    char threads[16];
    const char *arguments[ARGUMENTS_MAX];
    snprintf(threads, sizeof threads, "%d", worker->threads);
    list_arguments(local, threads, arguments);
    int tether[2];
    if (pipe2(tether, O_CLOEXEC) != 0)
        return error_set(error, STATUS_INTERNAL, "cannot make a pipe: %s", strerror(errno));
    posix_spawnattr_t attributes;
    set_attributes(&attributes);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, tether[0], STDIN_FILENO);
    int failure = posix_spawn(&worker->pid, local->program, &files, &attributes, (char **)arguments, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    close(tether[0]);
    worker->tether = tether[1];
    if (failure == 0)
        return STATUS_OK;
    worker->pid = 0;
    return error_set(error, STATUS_INTERNAL, "%s: cannot be started: %s", local->program, strerror(failure));
}

enum status local_workers_init(struct local_workers *local, const struct local_config *config, int count, int threads,
                               struct error *error)
{
    *local = (struct local_workers){.config = *config, .count = count};
    find_program(local->program, sizeof local->program);
    local->workers = memory_array((size_t)count, sizeof *local->workers);
    for (int i = 0; i < count; i++) {
        int share = threads / count + (i < threads % count);
        local->workers[i] = (struct local_worker){.tether = -1, .threads = share > 0 ? share : 1};
    }
    for (int i = 0; i < count; i++) {
        enum status status = spawn(local, &local->workers[i], error);
        if (status != STATUS_OK)
            return status;
    }
    return STATUS_OK;
}

enum status local_workers_add(struct local_workers *local, int threads, struct error *error)
{
    local->workers = memory_resize(local->workers, (size_t)local->count + 1, sizeof *local->workers);
    struct local_worker *worker = &local->workers[local->count++];
    *worker = (struct local_worker){.tether = -1, .threads = threads};
    return spawn(local, worker, error);
}

static struct local_worker *find(struct local_workers *local, pid_t pid)
{
    for (int i = 0; i < local->count; i++)
        if (local->workers[i].pid == pid)
            return &local->workers[i];
    return NULL;
}

static void cut_tether(struct local_worker *worker)
{
    if (worker->tether >= 0)
        close(worker->tether);
    worker->tether = -1;
}

pid_t local_workers_reap(struct local_workers *local, int *how)
{
    for (int i = 0; i < local->count; i++) {
        struct local_worker *worker = &local->workers[i];
        if (worker->pid == 0 || waitpid(worker->pid, how, WNOHANG) != worker->pid)
            continue;
        pid_t pid = worker->pid;
        worker->pid = -pid; /* not running, but still findable for a restart */
        cut_tether(worker);
        return pid;
    }
    return 0;
}

bool local_workers_restart(struct local_workers *local, pid_t pid, struct error *error)
{
    struct local_worker *worker = find(local, -pid);
    if (!worker || worker->restarts >= LOCAL_RESTARTS_MAX)
        return false;
    worker->restarts++;
    return spawn(local, worker, error) == STATUS_OK;
}

void local_workers_kill(struct local_workers *local, pid_t pid)
{
    if (pid > 0 && find(local, pid))
        kill(pid, SIGKILL);
}

int local_workers_running(const struct local_workers *local)
{
    int running = 0;
    for (int i = 0; i < local->count; i++)
        running += local->workers[i].pid > 0;
    return running;
}

/* Reaps until none runs or the deadline has passed. */
static void wait_for_all(struct local_workers *local, int64_t deadline_ms)
{
    int how;
    while (local_workers_running(local) > 0) {
        if (local_workers_reap(local, &how) != 0)
            continue;
        if (clock_now_ms() >= deadline_ms)
            return;
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
}

void local_workers_finish(struct local_workers *local)
{
    enum { KIND_MS = 1000, KILLED_MS = 500 };
    for (int i = 0; i < local->count; i++)
        cut_tether(&local->workers[i]);
    wait_for_all(local, clock_now_ms() + KIND_MS);
    for (int i = 0; i < local->count; i++)
        if (local->workers[i].pid > 0)
            kill(local->workers[i].pid, SIGKILL);
    wait_for_all(local, clock_now_ms() + KILLED_MS);
    free(local->workers);
    *local = (struct local_workers){0};
}
