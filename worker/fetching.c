#include "worker/fetching.h"

#include <assert.h>
#include <stdlib.h>

#include "base/memory.h"
#include "wire/manifest.h"

enum { WINDOW_BYTES = 4 * MESSAGE_CHUNK_MAX }; /* asked for and not yet received */

struct fetching_job {
    uint32_t number;
    bool settled; /* complete or unusable */
    struct digest manifest_digest;
    uint64_t manifest_bytes;
    struct manifest manifest; /* empty until it has come */
};

/* --- transfer --------------------------------------------------------------------------------------------- */

static void drop_transfer(struct transfer *transfer)
{
    bytes_finish(&transfer->bytes);
    *transfer = (struct transfer){0};
}

/* What was on its way already goes on where it is: its next chunks have been asked for. */
static void begin_transfer(struct transfer *transfer, const struct digest *digest, uint64_t total)
{
    if (transfer->total != total || !digest_equal(&transfer->digest, digest)) {
        drop_transfer(transfer);
        *transfer = (struct transfer){.digest = *digest, .total = total};
    }
    transfer->active = true;
}

/* The chunk to ask for next; even an empty file has one. False while enough are on their way. */
static bool request_chunk(struct transfer *transfer, struct fetching_step *step)
{
    bool more = transfer->requested < transfer->total && transfer->requested - transfer->bytes.size < WINDOW_BYTES;
    if (transfer->requested > 0 && !more)
        return false;
    *step = (struct fetching_step){
        .kind = FETCHING_NEED, .digest = transfer->digest, .offset = transfer->requested};
    transfer->requested += MESSAGE_CHUNK_MAX;
    return true;
}

/* Moves what came into the cache. */
static const char *complete_transfer(struct fetching *f)
{
    struct bytes *bytes = &f->transfer.bytes;
    const struct digest wanted = f->transfer.digest;
    bytes_put_u8(bytes, 0); /* a NUL that the size does not count, as readers expect */
    bytes->size--;
    cache_add(&f->cache, bytes);
    drop_transfer(&f->transfer);
    return cache_find(&f->cache, &wanted) ? NULL : "an asset's bytes do not have its digest";
}

const char *fetching_take(struct fetching *f, const struct message *message)
{
    struct transfer *transfer = &f->transfer;
    if (!transfer->active || !digest_equal(&message->asset.digest, &transfer->digest))
        return NULL; /* for a job that has ended */
    uint64_t left = transfer->total - transfer->bytes.size;
    uint64_t expected = left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX;
    if (message->asset.total != transfer->total || message->asset.offset != transfer->bytes.size ||
        message->asset.size != expected)
        return "an asset's chunks do not fit together";
    bytes_put(&transfer->bytes, message->asset.data, message->asset.size);
    return transfer->bytes.size == transfer->total ? complete_transfer(f) : NULL;
}

/* --- jobs ------------------------------------------------------------------------------------------------- */

static struct fetching_job *find_job(const struct fetching *f, uint32_t number)
{
    for (size_t i = 0; i < f->job_count; i++)
        if (f->jobs[i].number == number)
            return &f->jobs[i];
    return NULL;
}

void fetching_add(struct fetching *f, uint32_t job, const struct digest *manifest, uint64_t manifest_bytes)
{
    assert(!find_job(f, job));
    f->jobs = memory_grow(f->jobs, &f->job_capacity, f->job_count + 1, sizeof *f->jobs);
    f->jobs[f->job_count++] =
        (struct fetching_job){.number = job, .manifest_digest = *manifest, .manifest_bytes = manifest_bytes};
}

void fetching_remove(struct fetching *f, uint32_t number)
{
    struct fetching_job *job = find_job(f, number);
    assert(job);
    manifest_finish(&job->manifest);
    f->job_count--;
    for (struct fetching_job *to = job; to < f->jobs + f->job_count; to++) /* keeps the order */
        *to = to[1];
    f->transfer.active = false; /* until another job turns out to lack the same */
    if (f->job_count > 0)
        return;
    drop_transfer(&f->transfer);
    cache_trim(&f->cache, CACHE_BYTES_MAX);
}

void fetching_finish(struct fetching *f)
{
    while (f->job_count > 0)
        fetching_remove(f, f->jobs[f->job_count - 1].number);
    cache_finish(&f->cache);
    free(f->jobs);
    *f = (struct fetching){0};
}

static bool settle(struct fetching_job *job, enum fetching_step_kind kind, struct fetching_step *step)
{
    job->settled = true;
    step->kind = kind;
    step->job = job->number;
    return true;
}

/* Begins to fetch the first thing that the job lacks, and returns false. If it lacks nothing, the step is that the job
 * is settled. */
static bool settle_or_fetch(struct fetching *f, struct fetching_job *job, struct fetching_step *step)
{
    if (job->manifest.count == 0) {
        const struct bytes *bytes = cache_find(&f->cache, &job->manifest_digest);
        if (!bytes) {
            begin_transfer(&f->transfer, &job->manifest_digest, job->manifest_bytes);
            return false;
        }
        if (manifest_decode(&job->manifest, bytes->data, bytes->size, &step->error) != STATUS_OK)
            return settle(job, FETCHING_UNUSABLE, step);
    }
    for (size_t i = 0; i < job->manifest.count; i++) {
        const struct manifest_entry *entry = &job->manifest.entries[i];
        if (!cache_find(&f->cache, &entry->digest)) {
            begin_transfer(&f->transfer, &entry->digest, entry->size);
            return false;
        }
    }
    return settle(job, FETCHING_COMPLETE, step);
}

bool fetching_next(struct fetching *f, struct fetching_step *step)
{
    for (size_t i = 0; i < f->job_count && !f->transfer.active; i++)
        if (!f->jobs[i].settled && settle_or_fetch(f, &f->jobs[i], step))
            return true;
    if (f->transfer.active)
        return request_chunk(&f->transfer, step);
    drop_transfer(&f->transfer); /* nobody lacks it any more */
    return false;
}

const char *fetching_copy(const struct fetching *f, uint32_t number, struct asset_set *assets)
{
    const struct fetching_job *job = find_job(f, number);
    assert(job && job->manifest.count > 0);
    for (size_t i = 0; i < job->manifest.count; i++) {
        const struct manifest_entry *entry = &job->manifest.entries[i];
        const struct bytes *bytes = cache_find(&f->cache, &entry->digest);
        struct bytes copy = {0};
        bytes_put(&copy, bytes->data, bytes->size + 1); /* with its NUL */
        copy.size--;
        asset_set_add(assets, entry->name, &copy);
    }
    return assets->assets[0].name;
}
