#include "worker/cache.h"

#include <stdlib.h>

#include "base/memory.h"

void cache_finish(struct cache *cache)
{
    cache_trim(cache, 0);
    free(cache->entries);
    *cache = (struct cache){0};
}

const struct bytes *cache_find(const struct cache *cache, const struct digest *digest)
{
    for (size_t i = 0; i < cache->count; i++)
        if (digest_equal(&cache->entries[i].digest, digest))
            return &cache->entries[i].bytes;
    return NULL;
}

void cache_add(struct cache *cache, struct bytes *bytes)
{
    struct digest digest = digest_of(bytes->data, bytes->size);
    if (cache_find(cache, &digest)) {
        bytes_finish(bytes);
        return;
    }
    cache->entries = memory_grow(cache->entries, &cache->capacity, cache->count + 1, sizeof *cache->entries);
    cache->entries[cache->count++] = (struct cache_entry){digest, *bytes};
    *bytes = (struct bytes){0};
}

void cache_trim(struct cache *cache, size_t limit)
{
    size_t total = 0, dropped = 0;
    for (size_t i = 0; i < cache->count; i++)
        total += cache->entries[i].bytes.size;
    while (dropped < cache->count && (total > limit || limit == 0)) {
        total -= cache->entries[dropped].bytes.size;
        bytes_finish(&cache->entries[dropped++].bytes);
    }
    cache->count -= dropped;
    for (size_t i = 0; i < cache->count; i++)
        cache->entries[i] = cache->entries[i + dropped];
}
