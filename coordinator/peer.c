#include "coordinator/peer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { RATE_SPAN_MS = 2000 };

const char *peer_name(const struct peer *peer, char text[PEER_NAME_BYTES])
{
    snprintf(text, PEER_NAME_BYTES, "worker %u (%s, process %u)", peer->number, peer->host, peer->pid);
    return text;
}

void peer_finish(struct peer *peer)
{
    for (size_t i = 0; i < peer->incoming_count; i++)
        bytes_finish(&peer->incoming[i].records);
    free(peer->incoming);
    peer->incoming = NULL;
    peer->incoming_count = peer->incoming_capacity = 0;
    free(peer->held);
    peer->held = NULL;
    peer->held_count = peer->held_capacity = 0;
}

static struct incoming *find_incoming(struct peer *peer, uint64_t lease)
{
    for (size_t i = 0; i < peer->incoming_count; i++)
        if (peer->incoming[i].lease == lease)
            return &peer->incoming[i];
    return NULL;
}

static struct incoming *add_incoming(struct peer *peer, uint64_t lease)
{
    peer->incoming = memory_grow(peer->incoming, &peer->incoming_capacity, peer->incoming_count + 1,
                                 sizeof *peer->incoming);
    peer->incoming[peer->incoming_count] = (struct incoming){.lease = lease};
    return &peer->incoming[peer->incoming_count++];
}

bool peer_take_chunk(struct peer *peer, const struct message *message, uint64_t total, struct bytes *whole, bool *fits)
{
    struct incoming *incoming = find_incoming(peer, message->result.lease);
    if (!incoming)
        incoming = add_incoming(peer, message->result.lease);
    *fits = message->result.total == total && message->result.offset == incoming->records.size &&
            message->result.size <= total - incoming->records.size;
    if (!*fits)
        return false;
    bytes_put(&incoming->records, message->result.data, message->result.size);
    if (incoming->records.size < total)
        return false;
    *whole = incoming->records;
    incoming->records = (struct bytes){0};
    peer_drop(peer, message->result.lease);
    return true;
}

void peer_drop(struct peer *peer, uint64_t lease)
{
    struct incoming *incoming = find_incoming(peer, lease);
    if (!incoming)
        return;
    bytes_finish(&incoming->records);
    *incoming = peer->incoming[--peer->incoming_count];
}

/* --- bands ------------------------------------------------------------------------------------------------ */

void peer_give_band(struct peer *peer, const struct held_band *band, int64_t now_ms)
{
    if (peer->held_count == 0)
        peer->turn_ms = now_ms;
    peer->held = memory_grow(peer->held, &peer->held_capacity, peer->held_count + 1, sizeof *peer->held);
    peer->held[peer->held_count++] = *band;
}

/* The next one's turn begins if it was the first. */
static void drop_band(struct peer *peer, size_t index, int64_t now_ms)
{
    if (index == 0)
        peer->turn_ms = now_ms;
    peer->held_count--;
    memmove(peer->held + index, peer->held + index + 1, (peer->held_count - index) * sizeof *peer->held);
}

void peer_revoke_band(struct peer *peer, uint64_t lease, int64_t now_ms)
{
    for (size_t i = 0; i < peer->held_count; i++)
        if (peer->held[i].lease == lease) {
            drop_band(peer, i, now_ms);
            return;
        }
}

double peer_answer_band(struct peer *peer, uint32_t job, enum render_pass pass, uint32_t first_row, int64_t now_ms)
{
    double work = (double)(now_ms - peer->turn_ms) * peer->threads;
    for (size_t i = 0; i < peer->held_count; i++) {
        const struct held_band *held = &peer->held[i];
        if (held->job == job && held->pass == pass && held->first_row == first_row) {
            drop_band(peer, i, now_ms);
            break;
        }
    }
    peer->turn_ms = now_ms; /* also when it answered out of turn */
    return work;
}

/* --- rays ------------------------------------------------------------------------------------------------- */

void peer_take_beat(struct peer *peer, uint64_t rays, int64_t now_ms)
{
    if (!peer->beaten)
        peer->rays_before = rays;
    peer->beaten = true;
    peer->rays = rays > peer->rays_before ? rays - peer->rays_before : 0;
    if (now_ms - peer->rate_from_ms < RATE_SPAN_MS)
        return;
    if (peer->rays >= peer->rate_from_rays)
        peer->rays_per_second =
            (double)(peer->rays - peer->rate_from_rays) * 1000 / (double)(now_ms - peer->rate_from_ms);
    peer->rate_from_ms = now_ms;
    peer->rate_from_rays = peer->rays;
}

uint64_t peer_rays(const struct peer *peer)
{
    return peer->rays > peer->rays_returned ? peer->rays : peer->rays_returned;
}

double peer_rate(const struct peer *peer, int64_t now_ms)
{
    if (peer->gone)
        return 0;
    if (peer->rate_from_ms > peer->joined_ms || now_ms <= peer->joined_ms)
        return peer->rays_per_second;
    return (double)peer_rays(peer) * 1000 / (double)(now_ms - peer->joined_ms);
}
