/*
 * A worker as the coordinator knows it: its connection, what it said of itself, and what it is sending.
 */
#ifndef WEFT_COORDINATOR_PEER_H
#define WEFT_COORDINATOR_PEER_H

#include <stdbool.h>
#include <stdint.h>

#include "base/bytes.h"
#include "coordinator/snapshot.h"
#include "wire/message.h"
#include "wire/socket.h"

/* A result that has come in part. */
struct incoming {
    uint64_t lease;
    struct bytes records;
};

/* A band that a worker holds. */
struct held_band {
    uint64_t lease;
    uint32_t job;
    enum render_pass pass;
    uint32_t first_row, rows;
};

struct peer {
    uint32_t number; /* from 1, in the order of joining; the scheduler's worker number */
    struct wire_peer address;
    uint32_t machine;    /* its number (machines.h) */
    uint32_t next_spare; /* of a worker that is gone: the next in its machine's queue */
    uint64_t epoch;
    char host[MESSAGE_HOST_BYTES];
    char kernel[MESSAGE_KERNEL_BYTES];
    uint32_t pid, threads;
    bool gone;      /* kept for the record */
    bool lied;      /* it returned wrong bytes */
    bool draining;
    struct incoming *incoming;
    size_t incoming_count, incoming_capacity;
    struct held_band *held; /* in the order in which it was given them, which is that of its work */
    size_t held_count, held_capacity;
    int64_t turn_ms; /* since when the first of these has its turn */
    uint32_t bands_done;
    uint64_t rows_done;
    uint64_t rays_returned; /* in the bands that it returned */
    uint64_t rays;          /* since it joined, by its last beat, which also counts bands in work */
    uint64_t asset_allowance; /* bytes of assets that it may still ask for */
    int64_t joined_ms;
    bool beaten;            /* it has sent a beat */
    uint64_t rays_before;   /* that it had traced for others by its first beat, which it sends on joining */
    int64_t rate_from_ms;   /* start of the span over which the rate is measured */
    uint64_t rate_from_rays;
    double rays_per_second;
    enum worker_trouble trouble; /* the last */
};

/* How every line of the log names it: "worker 3 (loom, process 4711)", into text, which is returned. */
enum { PEER_NAME_BYTES = MESSAGE_HOST_BYTES + 64 };
const char *peer_name(const struct peer *peer, char text[PEER_NAME_BYTES]);

/* Frees what the peer holds. */
void peer_finish(struct peer *peer);

/* Takes a chunk of a result of `total` bytes. True once it is complete: the whole is moved into *whole, which
 * the caller frees. *fits becomes false if the chunk does not continue what came before. */
bool peer_take_chunk(struct peer *peer, const struct message *result, uint64_t total, struct bytes *whole, bool *fits);

/* Forgets what has come under that lease. */
void peer_drop(struct peer *peer, uint64_t lease);

/* It is given a band; it need not work on that any more; it has answered it. The last returns the band's work, in
 * milliseconds of one thread: all threads are at it from the previous answer on. */
void peer_give_band(struct peer *peer, const struct held_band *band, int64_t now_ms);
void peer_revoke_band(struct peer *peer, uint64_t lease, int64_t now_ms);
double peer_answer_band(struct peer *peer, uint32_t job, enum render_pass pass, uint32_t first_row, int64_t now_ms);

/* Rays traced as far as is known, and how many a second: over the last few seconds, or since joining in the first. */
uint64_t peer_rays(const struct peer *peer);
double peer_rate(const struct peer *peer, int64_t now_ms);

/* Takes the rays that a beat tells, for the rate. They count from the worker's start, which may be long before it
 * joined; those of the first beat are taken off. */
void peer_take_beat(struct peer *peer, uint64_t rays, int64_t now_ms);

#endif
