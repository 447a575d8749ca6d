/*
 * How a worker comes by what its jobs need: each job's manifest, then the files that it lists, in chunks, one file at a
 * time and none twice, in the order in which the jobs were added. It is told of jobs and of the chunks that came, and
 * says step by step what to ask for and which jobs have all they need.
 */
#ifndef WEFT_WORKER_FETCHING_H
#define WEFT_WORKER_FETCHING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "base/hash.h"
#include "scene/assets.h"
#include "wire/message.h"
#include "worker/cache.h"

/* The one file (or manifest) on its way. */
struct transfer {
    bool active; /* some job is known to lack it */
    struct digest digest;
    uint64_t total, requested; /* bytes; requested chunks are whole ones, so it may be more than the total */
    struct bytes bytes;        /* those that came */
};

struct fetching_job;

/* All zero is one without jobs; fetching_finish frees it. */
struct fetching {
    struct cache cache;
    struct transfer transfer;
    struct fetching_job *jobs;
    size_t job_count, job_capacity;
};

enum fetching_step_kind {
    FETCHING_NEED,     /* ask for the chunk at offset of the asset with that digest */
    FETCHING_COMPLETE, /* all that job needs is there */
    FETCHING_UNUSABLE, /* what should be job's manifest is none; error says why */
};

struct fetching_step {
    enum fetching_step_kind kind;
    uint32_t job;
    struct digest digest;
    uint64_t offset;
    struct error error;
};

void fetching_finish(struct fetching *fetching);

/* A new job, whose manifest has that digest and so many bytes (1 to MANIFEST_BYTES_MAX). */
void fetching_add(struct fetching *fetching, uint32_t job, const struct digest *manifest, uint64_t manifest_bytes);

/* Forgets a job. After the last of them, at most CACHE_BYTES_MAX of what came are kept for later ones. */
void fetching_remove(struct fetching *fetching, uint32_t job);

/* The next step; false if there is none for now. To be called until then after each fetching_add, fetching_take and
 * fetching_remove, but where all jobs are to be removed. */
bool fetching_next(struct fetching *fetching, struct fetching_step *step);

/* Takes an ASSET message. NULL, or why its sender does not keep the protocol: then all jobs are to be removed. */
const char *fetching_take(struct fetching *fetching, const struct message *message);

/* Copies the files of a complete job into an empty set. Returns the scene's name in the set, borrowed from it. */
const char *fetching_copy(const struct fetching *fetching, uint32_t job, struct asset_set *assets);

#endif
