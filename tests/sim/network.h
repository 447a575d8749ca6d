/*
 * A network for whole farms, on a virtual clock: connections as ZeroMQ keeps them (wire/socket.h). Within a living
 * connection messages are delayed, but keep their order and are all delivered; what is on its way when a connection is
 * cut is lost, and so is what is sent before the senders notice, if they ever do. A new connection has a new address.
 *
 * An evil link moreover repeats, swaps and shortens messages, and flips bits.
 */
#ifndef WEFT_TESTS_NETWORK_H
#define WEFT_TESTS_NETWORK_H

#include "tests/sim/history.h"
#include "wire/message.h"
#include "wire/socket.h"

enum happening_kind {
    COORDINATOR_TURN, /* there may be something for it to do */
    WORKER_TURN,      /* and for worker `who` */
    CONNECTION,       /* worker `who` is connected, if its socket is still `tag` */
    START,            /* of worker `who` */
    TROUBLE,          /* somewhere */
    CONTINUE,         /* worker `who` is no longer stopped */
    DEATH_IS_TOLD,    /* of process `tag` */
    LIE,              /* by worker `who` */
    LATE_JOB,         /* the coordinator gets the job that it was to get later */
};

struct happening {
    enum happening_kind kind;
    uint32_t who, tag;
};

static struct queue happenings;

static inline void happen(enum happening_kind kind, uint32_t who, uint32_t tag, int64_t at_ms)
{
    queue_put(&happenings, at_ms, &(struct happening){kind, who, tag}, sizeof(struct happening));
}

struct packet {
    int64_t at_ms;
    bool altered; /* its fields */
    struct bytes bytes;
};

/* One direction of a connection. */
struct pipe {
    struct packet *packets; /* on their way, or waiting to be taken: first .. count − 1 */
    size_t first, count, capacity;
    int64_t last_ms;        /* nothing put from now on arrives before */
};

struct link {
    uint32_t worker;
    uint32_t low_ms, high_ms; /* how long a message takes */
    uint32_t evil;            /* of so many messages in a hundred something becomes */
    bool cut;
    bool own;          /* of a worker of the coordinator's */
    uint32_t machine;  /* of its worker, whatever that says; 0: the coordinator's */
    uint64_t farewell; /* epoch of the conversation that the coordinator ended by a word to the worker */
    int64_t worker_knows_ms, coordinator_knows_ms; /* from when on each cannot send; INT64_MAX: it can */
    struct pipe up, down; /* to the coordinator, to the worker */
};

static struct {
    struct link *links; /* all that there ever were in this history */
    size_t count, capacity;
    bool flips; /* evil alters fields too */
} network;

static const size_t NO_LINK = SIZE_MAX;

/* --- pipes ------------------------------------------------------------------------------------------------ */

static inline void wake(const struct link *link, const struct pipe *pipe, int64_t at_ms)
{
    happen(pipe == &link->up ? COORDINATOR_TURN : WORKER_TURN, link->worker, 0, at_ms);
}

/* The receiver of *packet frees its bytes. */
static inline bool pipe_take(struct pipe *pipe, struct packet *packet)
{
    if (pipe->first == pipe->count || pipe->packets[pipe->first].at_ms > history.now_ms)
        return false;
    *packet = pipe->packets[pipe->first++];
    return true;
}

/* Loses what has not arrived by then. */
static inline void pipe_drop(struct pipe *pipe, int64_t from_ms)
{
    while (pipe->count > pipe->first && pipe->packets[pipe->count - 1].at_ms > from_ms)
        bytes_finish(&pipe->packets[--pipe->count].bytes);
}

static inline void pipe_push(struct link *link, struct pipe *pipe, struct packet packet)
{
    packet.at_ms = history.now_ms + draw(link->low_ms, link->high_ms);
    packet.at_ms = packet.at_ms > pipe->last_ms ? packet.at_ms : pipe->last_ms;
    pipe->last_ms = packet.at_ms;
    pipe->packets = memory_grow(pipe->packets, &pipe->capacity, pipe->count + 1, sizeof *pipe->packets);
    pipe->packets[pipe->count++] = packet;
    wake(link, pipe, packet.at_ms);
}

/* --- evil ------------------------------------------------------------------------------------------------- */

enum { HEADER_BYTES = 15 }; /* of a message: all that is not a field of its kind */

/* Evil that alters a job or a band makes for another picture, which its size may not tell; assets have digests. */
static inline bool decides_pixels(enum message_kind kind)
{
    return kind == MESSAGE_JOB || kind == MESSAGE_BAND || kind == MESSAGE_RESULT;
}

static inline void flip_bits(struct packet *packet)
{
    for (uint32_t i = draw(1, 3); i > 0; i--) {
        uint32_t end = network.flips ? (uint32_t)packet->bytes.size : HEADER_BYTES, at = draw(0, end - 1);
        packet->bytes.data[at] ^= (uint8_t)(1u << draw(0, 7));
        packet->altered |= at >= HEADER_BYTES;
    }
}

static inline void swap_last(struct pipe *pipe)
{
    if (pipe->count - pipe->first < 2)
        return;
    struct packet *last = &pipe->packets[pipe->count - 1], packet = *last;
    last->bytes = last[-1].bytes;
    last->altered = last[-1].altered;
    last[-1].bytes = packet.bytes;
    last[-1].altered = packet.altered;
}

static inline void push_by_evil(struct link *link, struct pipe *pipe, struct packet packet)
{
    struct packet again = {0};
    uint32_t what = draw(0, 3);
    if (what == 0)
        flip_bits(&packet);
    if (what == 1)
        packet.bytes.size = draw(0, (uint32_t)packet.bytes.size - 1);
    if (what == 2)
        bytes_put(&again.bytes, packet.bytes.data, packet.bytes.size);
    pipe_push(link, pipe, packet);
    if (what == 2)
        pipe_push(link, pipe, again);
    if (what == 3)
        swap_last(pipe);
}

static inline void pipe_put(struct link *link, struct pipe *pipe, const void *data, size_t size)
{
    struct packet packet = {0};
    if (link->cut)
        return;
    bytes_put(&packet.bytes, data, size);
    bool is_chunk = pipe == &link->up && size > MESSAGE_CHUNK_MAX / 4; /* of a result; few of them ever come */
    if (link->evil > 0 && chance(is_chunk ? 50 : link->evil))
        push_by_evil(link, pipe, packet);
    else
        pipe_push(link, pipe, packet);
}

/* --- connections ------------------------------------------------------------------------------------------ */

static inline struct wire_peer address_of(size_t link)
{
    struct wire_peer address = {.size = 5, .may_work = true, .own = network.links[link].own};
    memcpy(address.id + 1, &(uint32_t){(uint32_t)link}, sizeof(uint32_t));
    memcpy(address.machine.id, &network.links[link].machine, sizeof(uint32_t));
    return address;
}

static inline struct link *link_at(const struct wire_peer *address)
{
    uint32_t link;
    memcpy(&link, address->id + 1, sizeof link);
    return &network.links[link];
}

static inline size_t network_open(uint32_t worker, uint32_t low_ms, uint32_t high_ms, uint32_t evil)
{
    network.links = memory_grow(network.links, &network.capacity, network.count + 1, sizeof *network.links);
    network.links[network.count] = (struct link){.worker = worker, .low_ms = low_ms, .high_ms = high_ms, .evil = evil,
                                                 .worker_knows_ms = INT64_MAX, .coordinator_knows_ms = INT64_MAX};
    return network.count++;
}

/* To the coordinator. False if the worker has no connection. */
static inline bool network_send_up(size_t index, const void *data, size_t size)
{
    if (index == NO_LINK || history.now_ms >= network.links[index].worker_knows_ms)
        return false;
    pipe_put(&network.links[index], &network.links[index].up, data, size);
    return true;
}

static inline bool network_send_down(const struct wire_peer *address, const void *data, size_t size)
{
    struct link *link = link_at(address);
    if (history.now_ms >= link->coordinator_knows_ms)
        return false;
    pipe_put(link, &link->down, data, size);
    return true;
}

/* Takes what came first of all that has arrived. */
static inline bool network_take_up(struct packet *packet, size_t *from)
{
    int64_t first_ms = INT64_MAX;
    for (size_t i = 0; i < network.count; i++) {
        const struct pipe *up = &network.links[i].up;
        if (up->first == up->count || up->packets[up->first].at_ms >= first_ms)
            continue;
        first_ms = up->packets[up->first].at_ms;
        *from = i;
    }
    return first_ms != INT64_MAX && pipe_take(&network.links[*from].up, packet);
}

/* Whether something of it has arrived that the coordinator has not yet taken. */
static inline bool network_waits(const struct link *link)
{
    return link->up.first < link->up.count && link->up.packets[link->up.first].at_ms <= history.now_ms;
}

/* The worker ends the connection: what it has sent still arrives. */
static inline void network_close(size_t index)
{
    struct link *link = &network.links[index];
    int64_t end_ms = link->up.last_ms > history.now_ms ? link->up.last_ms : history.now_ms;
    link->worker_knows_ms = history.now_ms;
    pipe_drop(&link->down, INT64_MIN);
    if (!link->cut && link->coordinator_knows_ms > end_ms)
        link->coordinator_knows_ms = end_ms + draw(0, link->high_ms);
}

/* An end that nobody wanted, and that each side notices at another time, or not at all. */
static inline void network_cut(size_t index)
{
    struct link *link = &network.links[index];
    int64_t worker_ms = history.now_ms + draw(0, 9000), coordinator_ms = history.now_ms + draw(0, 9000);
    link->cut = true;
    pipe_drop(&link->up, history.now_ms);
    pipe_drop(&link->down, history.now_ms);
    if (chance(80) && worker_ms < link->worker_knows_ms)
        link->worker_knows_ms = worker_ms;
    if (chance(80) && coordinator_ms < link->coordinator_knows_ms)
        link->coordinator_knows_ms = coordinator_ms;
    happen(WORKER_TURN, link->worker, 0, worker_ms);
}

/* For some time nothing gets through that pipe; then everything does. */
static inline void network_hold(struct link *link, struct pipe *pipe, int64_t until_ms)
{
    pipe->last_ms = until_ms > pipe->last_ms ? until_ms : pipe->last_ms;
    for (size_t i = pipe->first; i < pipe->count; i++)
        if (pipe->packets[i].at_ms > history.now_ms && pipe->packets[i].at_ms < until_ms)
            pipe->packets[i].at_ms = until_ms;
    wake(link, pipe, until_ms);
}

/* The coordinator's end of all connections is gone. */
static inline void network_lose_coordinator(void)
{
    for (size_t i = 0; i < network.count; i++) {
        struct link *link = &network.links[i];
        pipe_drop(&link->up, INT64_MIN);
        if (link->cut)
            continue;
        network_cut(i);
    }
}

static inline void network_finish(void)
{
    for (size_t i = 0; i < network.count; i++) {
        struct link *link = &network.links[i];
        pipe_drop(&link->up, INT64_MIN);
        pipe_drop(&link->down, INT64_MIN);
        free(link->up.packets);
        free(link->down.packets);
    }
    free(network.links);
    memset(&network, 0, sizeof network);
}

#endif
