#include "coordinator/askers.h"

static struct asker *find(struct askers *askers, const struct wire_peer *address)
{
    for (size_t i = 0; i < askers->count; i++)
        if (wire_peer_equal(&askers->list[i].address, address))
            return &askers->list[i];
    return NULL;
}

/* A free place, or that of one who has been silent for too long. */
static struct asker *find_place(struct askers *askers, int64_t now_ms)
{
    if (askers->count < ASKERS_MAX)
        return &askers->list[askers->count++];
    for (size_t i = 0; i < askers->count; i++)
        if (now_ms - askers->list[i].heard_ms >= ASKERS_FORGET_MS)
            return &askers->list[i];
    return NULL;
}

static void wait(struct askers *askers, struct asker *asker, const struct message *ask)
{
    if (!asker->waiting)
        asker->turn = askers->turns++;
    asker->waiting = true;
    asker->number = ask->ask.number;
    asker->watching = ask->ask.pause_ms > 0;
    asker->due_ms = asker->answered_ms + ask->ask.pause_ms;
}

bool askers_take(struct askers *askers, const struct wire_peer *from, const struct message *ask, uint64_t ticket,
                 int64_t now_ms)
{
    struct asker *asker = find(askers, from);
    if (asker) {
        asker->heard_ms = now_ms;
        if (asker->ticket == ask->ask.ticket)
            wait(askers, asker, ask);
        return false;
    }
    asker = find_place(askers, now_ms);
    if (!asker)
        return false;
    *asker = (struct asker){.address = *from, .ticket = ticket, .heard_ms = now_ms,
                            .answered_ms = now_ms - MESSAGE_PAUSE_MAX_MS};
    return true;
}

void askers_forget(struct askers *askers, const struct wire_peer *address)
{
    struct asker *asker = find(askers, address);
    if (asker)
        *asker = askers->list[--askers->count];
}

int64_t askers_due_ms(const struct askers *askers)
{
    int64_t due_ms = INT64_MAX;
    for (size_t i = 0; i < askers->count; i++) {
        const struct asker *asker = &askers->list[i];
        if (asker->waiting && asker->due_ms < due_ms)
            due_ms = asker->due_ms;
    }
    return due_ms < askers->round_ms ? askers->round_ms : due_ms;
}

struct asker *askers_next(struct askers *askers, bool ending, int64_t now_ms)
{
    struct asker *next = NULL;
    if (!ending && now_ms < askers->round_ms)
        return NULL;
    for (size_t i = 0; i < askers->count; i++) {
        struct asker *asker = &askers->list[i];
        bool due = asker->waiting && (ending ? !asker->told : asker->due_ms <= now_ms);
        if (due && (!next || asker->turn < next->turn))
            next = asker;
    }
    return next;
}

void askers_answered(struct asker *asker, uint64_t ticket, bool last, int64_t now_ms)
{
    asker->ticket = ticket;
    asker->waiting = false;
    asker->told = last;
    asker->answered_ms = now_ms;
}

void askers_end_round(struct askers *askers, size_t bytes, int64_t now_ms)
{
    int64_t pause_ms = (int64_t)(bytes / ASKERS_BYTES_PER_MS);
    askers->round_ms = now_ms + (pause_ms > ASKERS_ROUND_MS ? pause_ms : ASKERS_ROUND_MS);
}

size_t askers_watching(const struct askers *askers, int64_t now_ms)
{
    size_t watching = 0;
    for (size_t i = 0; i < askers->count; i++)
        watching += askers->list[i].watching && now_ms - askers->list[i].heard_ms < ASKERS_FORGET_MS;
    return watching;
}
