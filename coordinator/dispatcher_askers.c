/* How things stand, for those who ask. */
#include <stdio.h>

#include <sodium.h>

#include "coordinator/dispatcher_private.h"
#include "coordinator/snapshot_json.h"

static uint64_t draw_ticket(void)
{
    uint64_t ticket;
    do
        randombytes_buf(&ticket, sizeof ticket);
    while (ticket == 0);
    return ticket;
}

/* False if the asker cannot be reached. */
static bool send_chunks(struct dispatcher *d, const struct asker *asker, uint64_t ticket, const struct bytes *text)
{
    size_t at = 0;
    do {
        size_t left = text->size - at;
        struct message message = {.kind = MESSAGE_STATUS, .status = {
            .number = asker->number, .ticket = ticket, .last = d->ending, .offset = at, .total = text->size,
            .data = text->data + at, .size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX)}};
        if (!dispatcher_send_to(d, &asker->address, &message))
            return false;
        at += message.status.size;
    } while (at < text->size);
    return true;
}

/* Of a size that only a farm of tens of thousands comes to. */
static bool refuse_as_too_large(struct dispatcher *d, const struct asker *asker, size_t size)
{
    struct message message = {.kind = MESSAGE_REFUSE};
    snprintf(message.refuse.reason, sizeof message.refuse.reason, "its status has %zu bytes, more than %d", size,
             MESSAGE_STATUS_MAX);
    return dispatcher_send_to(d, &asker->address, &message);
}

/* Returns the bytes that were sent. */
static size_t answer(struct dispatcher *d, struct asker *asker, const struct bytes *text)
{
    bool fits = text->size <= MESSAGE_STATUS_MAX;
    uint64_t ticket = draw_ticket();
    if (fits ? send_chunks(d, asker, ticket, text) : refuse_as_too_large(d, asker, text->size))
        askers_answered(asker, ticket, d->ending, d->now_ms);
    else
        askers_forget(&d->askers, &asker->address);
    return fits ? text->size : 0;
}

void dispatcher_answer_askers(struct dispatcher *d)
{
    struct asker *asker = askers_next(&d->askers, d->ending, d->now_ms);
    if (!asker)
        return;
    struct bytes text = {0};
    struct snapshot snapshot = dispatcher_snapshot(d, d->now_ms);
    snapshot_write_json(&text, &snapshot);
    size_t bytes = text.size;
    while (asker && (d->ending || bytes < text.size + ASKERS_ROUND_BYTES)) {
        bytes += answer(d, asker, &text);
        asker = askers_next(&d->askers, d->ending, d->now_ms);
    }
    askers_end_round(&d->askers, bytes, d->now_ms);
    bytes_finish(&text);
}

static void take_question(struct dispatcher *d, const struct wire_peer *from, const struct message *ask)
{
    uint64_t ticket = draw_ticket();
    struct message welcome = {.kind = MESSAGE_STATUS, .status = {.number = ask->ask.number, .ticket = ticket}};
    if (askers_take(&d->askers, from, ask, ticket, d->now_ms) && !dispatcher_send_to(d, from, &welcome))
        askers_forget(&d->askers, from);
    if (d->ending) /* there is no tick any more */
        dispatcher_answer_askers(d);
}

bool dispatcher_take_asker(struct dispatcher *d, const struct wire_peer *from, const struct message *message)
{
    if (message->kind == MESSAGE_ASK)
        take_question(d, from, message);
    else if (message->kind == MESSAGE_GOODBYE && message->epoch == 0)
        askers_forget(&d->askers, from);
    else
        return false;
    return true;
}
