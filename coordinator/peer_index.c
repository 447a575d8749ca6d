#include "coordinator/peer_index.h"

#include <stdlib.h>

#include "base/hash.h"
#include "base/memory.h"

enum { SLOTS_LEAST = 64 };

static uint32_t hash_of(const struct wire_peer *address)
{
    uint32_t hash = address->socket;
    for (size_t i = 0; i < address->size; i++)
        hash = hash_u32(hash ^ address->id[i]);
    return hash;
}

/* The slot of that address, or the free one where it belongs: the next from its hash on. */
static uint32_t *find_slot(const struct peer_index *index, const struct peer *peers, const struct wire_peer *address)
{
    size_t at = hash_of(address) & (index->capacity - 1);
    while (index->slots[at] && !wire_peer_equal(&peers[index->slots[at] - 1].address, address))
        at = (at + 1) & (index->capacity - 1);
    return &index->slots[at];
}

/* Half of the slots stay free, so that the next free one is near. */
static void make_room(struct peer_index *index, const struct peer *peers)
{
    if (2 * (index->count + 1) <= index->capacity)
        return;
    struct peer_index larger = {.count = index->count, .capacity = index->capacity ? 2 * index->capacity : SLOTS_LEAST};
    larger.slots = memory_array(larger.capacity, sizeof *larger.slots);
    for (size_t i = 0; i < index->capacity; i++)
        if (index->slots[i])
            *find_slot(&larger, peers, &peers[index->slots[i] - 1].address) = index->slots[i];
    free(index->slots);
    *index = larger;
}

void peer_index_add(struct peer_index *index, const struct peer *peers, uint32_t number)
{
    make_room(index, peers);
    uint32_t *slot = find_slot(index, peers, &peers[number - 1].address);
    index->count += *slot == 0;
    *slot = number;
}

/* What comes after the gap moves into it, unless it belongs behind it. */
void peer_index_remove(struct peer_index *index, const struct peer *peers, uint32_t number)
{
    uint32_t *slots = index->slots, *slot = find_slot(index, peers, &peers[number - 1].address);
    size_t mask = index->capacity - 1, gap = (size_t)(slot - slots);
    if (*slot != number)
        return;
    for (size_t at = (gap + 1) & mask; slots[at]; at = (at + 1) & mask) {
        size_t home = hash_of(&peers[slots[at] - 1].address) & mask;
        if (((at - home) & mask) < ((at - gap) & mask))
            continue;
        slots[gap] = slots[at];
        gap = at;
    }
    slots[gap] = 0;
    index->count--;
}

uint32_t peer_index_find(const struct peer_index *index, const struct peer *peers, const struct wire_peer *address)
{
    return index->capacity ? *find_slot(index, peers, address) : 0;
}

void peer_index_finish(struct peer_index *index)
{
    free(index->slots);
    *index = (struct peer_index){0};
}
