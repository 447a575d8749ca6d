/*
 * Worker processes that the coordinator starts on its own machine. Each holds the read end of a pipe as its standard
 * input; when the coordinator ends, however it ends, the pipe closes and the worker ends too.
 */
#ifndef WEFT_COORDINATOR_LOCAL_H
#define WEFT_COORDINATOR_LOCAL_H

#include <stdbool.h>
#include <sys/types.h>

#include "base/error.h"

enum { LOCAL_RESTARTS_MAX = 3 };

struct local_worker {
    pid_t pid;   /* 0: not running */
    int tether;  /* write end of its pipe, or −1 */
    int threads;
    int restarts;
};

/* What they are started with. Texts are borrowed as long as workers may be started. */
struct local_config {
    const char *endpoint;
    const char *kernel; /* name to force, or NULL */
    const char *log;    /* file that they write their lines to, or NULL */
    bool log_json;
};

struct local_workers {
    char program[4096]; /* path of weft-worker */
    struct local_config config;
    struct local_worker *workers;
    int count;
};

/* Starts `count` workers (0 or more) that share `threads` render threads, at least one each. STATUS_INTERNAL if the
 * program cannot be started. local_workers_finish must follow in any case. */
enum status local_workers_init(struct local_workers *local, const struct local_config *config, int count, int threads,
                               struct error *error);

/* Ends all workers, kindly and then not, within about a second, and frees what is held. */
void local_workers_finish(struct local_workers *local);

/* Starts one more, with so many threads (at least 1). STATUS_INTERNAL if that fails. */
enum status local_workers_add(struct local_workers *local, int threads, struct error *error);

/* Looks for a worker that has died. Returns its pid and how it ended (as from waitpid), or 0 if there is none. */
pid_t local_workers_reap(struct local_workers *local, int *how);

/* Starts the worker that had this pid again, unless it has been LOCAL_RESTARTS_MAX times. */
bool local_workers_restart(struct local_workers *local, pid_t pid, struct error *error);

/* Ends the worker with this pid at once, if there is one: it is then to be reaped like one that died. */
void local_workers_kill(struct local_workers *local, pid_t pid);

/* How many are running. */
int local_workers_running(const struct local_workers *local);

#endif
