/*
 * Assets that a worker has received, by digest: sent once, kept for later jobs. At most CACHE_BYTES_MAX stay when
 * no job needs them.
 */
#ifndef WEFT_WORKER_CACHE_H
#define WEFT_WORKER_CACHE_H

#include <stddef.h>

#include "base/bytes.h"
#include "base/hash.h"

#define CACHE_BYTES_MAX ((size_t)1 << 30)

struct cache_entry {
    struct digest digest;
    struct bytes bytes;
};

/* All zero is empty; cache_finish frees it. Oldest entries first. */
struct cache {
    struct cache_entry *entries;
    size_t count, capacity;
};

void cache_finish(struct cache *cache);

/* The bytes of that digest, borrowed until the next cache_add or cache_trim; NULL if they are not there. */
const struct bytes *cache_find(const struct cache *cache, const struct digest *digest);

/* Moves the bytes, whose digest it computes, into the cache (*bytes becomes empty). */
void cache_add(struct cache *cache, struct bytes *bytes);

/* Drops the oldest entries until at most `limit` bytes are left. */
void cache_trim(struct cache *cache, size_t limit);

#endif
