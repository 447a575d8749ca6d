/*
 * Which worker is at an address: an index over an array of peers, so that among thousands of them the sender of a
 * message is found at once.
 */
#ifndef WEFT_COORDINATOR_PEER_INDEX_H
#define WEFT_COORDINATOR_PEER_INDEX_H

#include <stddef.h>
#include <stdint.h>

#include "coordinator/peer.h"

/* All zero is empty; peer_index_finish frees it. */
struct peer_index {
    uint32_t *slots; /* numbers of peers, by a hash of their addresses; 0: free */
    size_t count, capacity; /* of the slots, which are a power of two */
};

/* Adds the peer of that number, peers[number - 1], in place of an earlier one with its address. */
void peer_index_add(struct peer_index *index, const struct peer *peers, uint32_t number);

/* Takes out the peer of that number, unless another one has its address. */
void peer_index_remove(struct peer_index *index, const struct peer *peers, uint32_t number);

/* The number of the peer that was added last with that address, or 0. `peers` holds all that were added. */
uint32_t peer_index_find(const struct peer_index *index, const struct peer *peers, const struct wire_peer *address);

void peer_index_finish(struct peer_index *index);

#endif
