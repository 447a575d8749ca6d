/* The scheduler's events, and what may be asked of it. */
#include "coordinator/scheduler.h"

#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

struct scheduler *scheduler_create(const struct scheduler_policy *policy)
{
    struct scheduler *s = memory_array(1, sizeof *s);
    struct list *lists[] = {&s->heard, &s->room, &s->idle, &s->turn, &s->suspects};
    s->policy = *policy;
    s->next_lease = 1;
    s->look_ms = INT64_MIN;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        list_empty(lists[i]);
    return s;
}

void scheduler_destroy(struct scheduler **pointer)
{
    struct scheduler *s = *pointer;
    struct action_list unwanted = {0};
    if (!s)
        return;
    s->actions = &unwanted;
    while (!list_is_empty(&s->heard))
        scheduler_remove_worker(s, list_owner(s->heard.next, struct worker, in_heard), false);
    for (size_t i = 0; i < s->job_count; i++)
        scheduler_finish_job(s->jobs[i]);
    free(unwanted.items);
    free(s->jobs);
    free(s->workers);
    free(s->candidates);
    free(s);
    *pointer = NULL;
}

void scheduler_act(struct scheduler *s, struct action action)
{
    struct action_list *list = s->actions;
    list->items = memory_grow(list->items, &list->capacity, list->count + 1, sizeof *list->items);
    list->items[list->count++] = action;
}

/* --- events ----------------------------------------------------------------------------------------------- */

static void take_readiness(struct scheduler *s, struct worker *w, uint32_t job)
{
    if (job >= s->job_count || s->jobs[job]->over || *scheduler_readiness(w, job) != READINESS_ANNOUNCED)
        return;
    *scheduler_readiness(w, job) = READINESS_READY;
    scheduler_end_loading(s, w, true);
    list_append(&s->turn, &w->in_turn);
}

static void take_worker_event(struct scheduler *s, struct worker *w, const struct event *event)
{
    w->heard_ms = s->now_ms;
    list_append(&s->heard, &w->in_heard);
    switch (event->kind) {
    case EVENT_READY:
        take_readiness(s, w, event->job);
        break;
    case EVENT_BEAT:
        scheduler_take_beat(s, w, event->progress);
        break;
    case EVENT_RESULT:
        scheduler_take_result(s, w, event->lease);
        break;
    case EVENT_DRAIN:
        w->draining = true;
        scheduler_update_room(s, w);
        break;
    case EVENT_LEAVE:
    case EVENT_LOST:
        scheduler_remove_worker(s, w, event->kind == EVENT_LOST);
        break;
    default:
        break;
    }
}

void scheduler_handle(struct scheduler *s, const struct event *event, int64_t now_ms, struct action_list *actions)
{
    s->now_ms = now_ms;
    s->slept = event->slept;
    s->actions = actions;
    struct worker *w = scheduler_worker(s, event->worker);
    if (event->kind == EVENT_JOB)
        scheduler_add_job(s, event);
    else if (event->kind == EVENT_TICK) /* before, what workers have said may not have been told yet */
        scheduler_expel_hopeless(s);
    else if (event->kind == EVENT_SETTLED)
        scheduler_settle_audit(s, event);
    else if (event->kind == EVENT_JUDGE)
        scheduler_judge_audit(s, event);
    else if (event->kind == EVENT_LIAR)
        scheduler_take_liar(s, event->worker);
    else if (event->kind == EVENT_JOIN && !w)
        scheduler_add_worker(s, event);
    else if (w)
        take_worker_event(s, w, event);
    scheduler_tell_jobs(s);
    scheduler_deal(s);
    scheduler_grant_backups(s);
    scheduler_ask_for_trusted(s);
}

/* --- questions -------------------------------------------------------------------------------------------- */

static int64_t earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

int64_t scheduler_deadline(const struct scheduler *s)
{
    int64_t deadline = scheduler_backups_due(s);
    if (!list_is_empty(&s->heard))
        deadline = earlier(deadline, scheduler_silent_at(s, list_owner(s->heard.next, struct worker, in_heard)));
    return list_is_empty(&s->suspects) ? deadline : earlier(deadline, s->now_ms);
}

bool scheduler_lease(const struct scheduler *s, uint32_t worker, uint64_t id, struct action *grant)
{
    const struct worker *w = scheduler_worker(s, worker);
    const struct lease *lease = w ? scheduler_find_lease(w, id) : NULL;
    if (!lease)
        return false;
    *grant = (struct action){.kind = ACTION_GRANT, .worker = worker, .job = lease->job->number,
                             .pass = lease->job->pass, .first_row = lease->band->first_row, .rows = lease->band->rows,
                             .lease = id};
    return true;
}

uint32_t scheduler_rows_leased(const struct scheduler *s, uint32_t job)
{
    return job < s->job_count ? s->jobs[job]->leased_rows : 0;
}
