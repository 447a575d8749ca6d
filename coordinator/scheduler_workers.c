/* The scheduler's workers: coming, going, silent, stuck. */
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

struct worker *scheduler_worker(const struct scheduler *s, uint32_t number)
{
    return number < s->worker_capacity ? s->workers[number] : NULL;
}

/* Those new are NULL. */
static void make_room_for(struct scheduler *s, uint32_t number)
{
    size_t before = s->worker_capacity;
    s->workers = memory_grow(s->workers, &s->worker_capacity, (size_t)number + 1, sizeof(struct worker *));
    for (size_t i = before; i < s->worker_capacity; i++)
        s->workers[i] = NULL;
}

/* Trusted workers are each its own; so are those whose machine nobody knows. */
static uint64_t party_of(const struct event *event)
{
    bool alone = event->trusted || event->machine == 0;
    return alone ? event->worker : (uint64_t)event->machine << 32;
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

/* What it says of itself may count. */
static bool allows_all(const struct scheduler *s, const struct worker *w)
{
    return s->policy.newcomer_bands == 0 || w->proven || w->trusted;
}

void scheduler_add_worker(struct scheduler *s, const struct event *event)
{
    struct worker *w = memory_array(1, sizeof *w);
    make_room_for(s, event->worker);
    s->workers[event->worker] = w;
    *w = (struct worker){.number = event->worker, .machine = event->machine, .threads = event->threads,
                         .credit = event->credit, .trusted = event->trusted, .party = party_of(event),
                         .heard_ms = s->now_ms};
    list_empty(&w->leases);
    list_append(&s->heard, &w->in_heard);
    s->worker_count++;
    w->counted_threads = allows_all(s, w) ? w->threads : least(w->threads, s->policy.newcomer_bands);
    s->threads += w->counted_threads;
    s->trusted_count += w->trusted;
    s->asked &= !w->trusted;
    scheduler_update_room(s, w);
    scheduler_tell_worker(s, w);
}

void scheduler_remove_worker(struct scheduler *s, struct worker *w, bool by_fault)
{
    struct list *links[] = {&w->in_heard, &w->in_room, &w->in_idle, &w->in_turn, &w->in_suspects};
    for (size_t i = 0; i < sizeof links / sizeof *links; i++)
        list_leave(links[i]);
    s->workers[w->number] = NULL;
    s->worker_count--;
    s->threads -= w->counted_threads;
    s->trusted_count -= w->trusted;
    s->everyones_turn |= s->trusted_count == s->worker_count; /* those left may audit one another now */
    scheduler_give_back(s, w, by_fault);
    free(w->readiness);
    free(w);
}

static void put(struct list *list, struct list *link, bool in)
{
    if (!in)
        list_leave(link);
    else if (!list_is_in(link))
        list_append(list, link);
}

void scheduler_prove(struct scheduler *s, struct worker *w)
{
    w->proven = true;
    s->threads += w->threads - w->counted_threads;
    w->counted_threads = w->threads;
}

static uint32_t allowance(const struct scheduler *s, const struct worker *w)
{
    return allows_all(s, w) ? w->credit : least(w->credit, least(w->threads, s->policy.newcomer_bands));
}

void scheduler_update_room(struct scheduler *s, struct worker *w)
{
    bool can_take = !w->draining && w->lease_count < allowance(s, w);
    put(&s->room, &w->in_room, can_take);
    put(&s->idle, &w->in_idle, can_take && w->lease_count == 0 && w->loaded > 0);
}

uint8_t *scheduler_readiness(struct worker *w, uint32_t job)
{
    size_t before = w->readiness_count;
    w->readiness = memory_grow(w->readiness, &w->readiness_count, (size_t)job + 1, sizeof *w->readiness);
    for (size_t i = before; i < w->readiness_count; i++)
        w->readiness[i] = READINESS_NONE;
    return &w->readiness[job];
}

void scheduler_end_loading(struct scheduler *s, struct worker *w, bool loaded)
{
    w->loading--;
    w->loaded += loaded;
    pace_excuse(&w->pace, s->now_ms);
    scheduler_update_room(s, w);
}

void scheduler_unload(struct scheduler *s, struct worker *w)
{
    w->loaded--;
    scheduler_update_room(s, w);
}

/* --- those from whom nothing more is to be expected ------------------------------------------------------- */

/* Who loads a job may have no threads left for the bands that it holds. The last one is never given up for being
 * stuck: a mistake would end the render, and nobody would gain. */
static bool is_stuck(const struct scheduler *s, const struct worker *w)
{
    return w->loading == 0 && s->worker_count > 1 && s->now_ms >= pace_stuck_at(&w->pace);
}

/* Its answer may be on its way behind this beat, so it is not judged before the next tick. */
void scheduler_take_beat(struct scheduler *s, struct worker *w, uint64_t progress)
{
    pace_beat(&w->pace, progress, s->now_ms);
    if (is_stuck(s, w))
        list_append(&s->suspects, &w->in_suspects);
}

int64_t scheduler_silent_at(const struct scheduler *s, const struct worker *w)
{
    return w->heard_ms + s->policy.silence_ms;
}

static void expel(struct scheduler *s, struct worker *w, bool stuck)
{
    scheduler_act(s, (struct action){.kind = ACTION_EXPEL, .worker = w->number, .stuck = stuck});
    scheduler_remove_worker(s, w, !stuck && !s->slept); /* that a worker is stuck is not held against its bands */
}

void scheduler_expel_hopeless(struct scheduler *s)
{
    while (!list_is_empty(&s->heard)) {
        struct worker *w = list_owner(s->heard.next, struct worker, in_heard);
        if (s->now_ms < scheduler_silent_at(s, w))
            break;
        expel(s, w, false);
    }
    while (!list_is_empty(&s->suspects)) {
        struct worker *w = list_owner(s->suspects.next, struct worker, in_suspects);
        list_leave(&w->in_suspects);
        if (is_stuck(s, w))
            expel(s, w, true);
    }
}
