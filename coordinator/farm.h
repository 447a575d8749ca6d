/*
 * The coordinator at work: sockets, local worker processes, signals and progress around the dispatcher, which decides.
 * One thread, one loop.
 */
#ifndef WEFT_COORDINATOR_FARM_H
#define WEFT_COORDINATOR_FARM_H

#include "base/error.h"
#include "coordinator/http.h"
#include "coordinator/progress.h"
#include "coordinator/render_job.h"
#include "wire/keys.h"

struct farm_config {
    const char *listen;       /* endpoint in full form for workers from elsewhere, or NULL */
    struct coordinator_keys *keys; /* who may come over TCP (finished by farm_create), or NULL: everybody */
    int local_workers;        /* processes to start */
    int local_threads;        /* render threads of all of them together */
    const char *local_kernel; /* name to force, or NULL */
    const char *log;          /* file that local workers write their lines to, or NULL */
    bool log_json;
    uint32_t band_rows;       /* 0: automatic */
    double audit_percent;     /* of the bands, that a second worker renders too, to compare; 0: none */
};

struct farm;

/* Blocks the signals that farm_run reads, binds, and starts local workers. NULL with *status and *error set. */
struct farm *farm_create(const struct farm_config *config, enum status *status, struct error *error);

/* Adds a job; it is rendered after those added before. Borrowed; must stay until farm_destroy. */
void farm_add_job(struct farm *farm, struct render_job *job);

/* Shows progress there from now on. Borrowed; NULL: nowhere. */
void farm_set_progress(struct farm *farm, struct progress *progress);

/* Shows the state there from now on, to whoever looks. Borrowed; NULL: to nobody. */
void farm_set_http(struct farm *farm, struct http_server *http);

/* Called when a job's output is complete. */
typedef void farm_job_done(const struct render_job *job, void *context);

/* Renders all jobs. STATUS_OK if every output was written. A signal ends it early: *interrupted is then the signal's
 * number, otherwise 0. */
enum status farm_run(struct farm *farm, farm_job_done *done, void *context, int *interrupted, struct error *error);

/* Its present state; borrowed, until the next call or farm_destroy. */
struct snapshot farm_snapshot(struct farm *farm);

/* Says goodbye to all workers, ends the local ones, frees *farm and sets it to NULL; *farm may be NULL. */
void farm_destroy(struct farm **farm);

#endif
