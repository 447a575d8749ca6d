/*
 * The render threads of a worker. They take small tiles across all bands that the worker holds, oldest band first, so
 * that one band feeds many threads and ends soon. All calls from one other thread.
 */
#ifndef WEFT_WORKER_POOL_H
#define WEFT_WORKER_POOL_H

#include <stdbool.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "image/encode.h"
#include "scene/assets.h"
#include "trace/kernel.h"
#include "trace/plan.h"
#include "worker/order.h"

struct pool;

enum pool_outcome_kind { POOL_LOADED, POOL_LOAD_FAILED, POOL_BAND };

struct pool_outcome {
    enum pool_outcome_kind kind;
    uint32_t job;       /* LOADED, LOAD_FAILED */
    uint64_t lease;     /* BAND */
    struct bytes bytes; /* BAND: what band_complete gave (band.h); the receiver frees */
    struct error error; /* LOAD_FAILED */
};

/* Starts `threads` threads (at least 1). The kernel is borrowed. NULL with *error filled if the system refuses. */
struct pool *pool_create(int threads, const struct kernel *kernel, struct error *error);

/* Stops the threads, each at the end of its tile, frees *pool and sets it to NULL. */
void pool_destroy(struct pool **pool);

/* A descriptor that is readable while outcomes wait, and no more once pool_take has returned false. */
int pool_descriptor(const struct pool *pool);

/* The next outcome, in the order in which they came about. False if none waits. */
bool pool_take(struct pool *pool, struct pool_outcome *outcome);

/* Loads the scene called `name` from the set, which is moved into the pool (*assets becomes empty), and prepares it;
 * answered by LOADED or LOAD_FAILED. `job` must not be in the pool. */
void pool_load(struct pool *pool, uint32_t job, const char *name, struct asset_set *assets,
               const struct job_settings *settings);

/* Forgets a job and its bands; no outcomes come of them beyond those that wait already. */
void pool_forget(struct pool *pool, uint32_t job);

/* Renders or surveys rows of a loaded job; answered by BAND. False if the job is not loaded or the order does not fit
 * it. */
bool pool_start(struct pool *pool, uint64_t lease, uint32_t job, const struct order *order);

/* Stops work on a band; no outcome comes of it unless it waits already. */
void pool_cancel(struct pool *pool, uint64_t lease);

/* Since the start: batches of camera rays traced, which also grows while a tile takes long, and rays of tiles that are
 * finished. */
void pool_progress(struct pool *pool, uint64_t *batches, uint64_t *rays);

#endif
