/* The scheduler's jobs: which of them workers are told of, and how their passes end. */
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

enum { ROWS_A_THREAD = 2 }; /* as long as fewer wait, of all jobs that workers know, a further one is announced */

static void begin(struct scheduler *s, struct job *job)
{
    scheduler_begin_pass(s, job, job->pass_rows[PASS_SURVEY] > 0 ? PASS_SURVEY : PASS_RENDER);
}

void scheduler_add_job(struct scheduler *s, const struct event *event)
{
    struct job *job = memory_array(1, sizeof *job);
    s->jobs = memory_grow(s->jobs, &s->job_capacity, s->job_count + 1, sizeof(struct job *));
    *job = (struct job){.number = (uint32_t)s->job_count, .pass_rows = {event->survey_rows, event->rows},
                        .rows_most = event->rows_most, .kept_count = event->kept_count};
    s->jobs[s->job_count++] = job;
    job->kept = memory_array(event->kept_count, sizeof *job->kept);
    for (size_t i = 0; i < event->kept_count; i++)
        job->kept[i] = event->kept[i];
    list_empty(&job->leased);
    begin(s, job);
    scheduler_end_complete_passes(s, job);
}

void scheduler_finish_job(struct job *job)
{
    scheduler_clear_bands(job);
    free(job->bands);
    free(job->surveyors);
    free(job->kept);
    free(job->ahead);
    free(job);
}

/* --- telling workers -------------------------------------------------------------------------------------- */

static void tell(struct scheduler *s, struct worker *w, const struct job *job)
{
    uint8_t *readiness = scheduler_readiness(w, job->number);
    if (*readiness != READINESS_NONE || w->draining)
        return;
    *readiness = READINESS_ANNOUNCED;
    w->loading++;
    w->told_ms = s->now_ms;
    scheduler_act(s, (struct action){.kind = ACTION_ANNOUNCE, .worker = w->number, .job = job->number});
}

void scheduler_tell_worker(struct scheduler *s, struct worker *w)
{
    for (size_t i = 0; i < s->told_count; i++)
        tell(s, w, s->told[i]);
}

/* A scene costs every worker the time to load it, and memory until its end. So no more are announced than it takes to
 * give each thread something to do, even if a row is all that it gets. */
static bool is_time_for_more(const struct scheduler *s)
{
    uint64_t rows = 0;
    if (s->told_count < JOBS_AHEAD)
        return true;
    if (s->told_count == JOBS_AHEAD_MAX)
        return false;
    for (size_t i = 0; i < s->told_count; i++) {
        rows += scheduler_rows_waiting(s->told[i]);
        rows += s->told[i]->pass == PASS_SURVEY ? s->told[i]->pass_rows[PASS_RENDER] : 0; /* soon */
    }
    return rows < ROWS_A_THREAD * s->threads;
}

void scheduler_tell_jobs(struct scheduler *s)
{
    while (s->next_job < s->job_count && is_time_for_more(s)) {
        struct job *job = s->jobs[s->next_job++];
        if (job->over)
            continue;
        s->told[s->told_count++] = job;
        for (size_t i = 0; i < s->worker_capacity; i++)
            if (s->workers[i])
                tell(s, s->workers[i], job);
    }
}

static void forget_told(struct scheduler *s, const struct job *job)
{
    size_t kept = 0;
    for (size_t i = 0; i < s->told_count; i++)
        if (s->told[i] != job)
            s->told[kept++] = s->told[i];
    s->told_count = kept;
}

/* --- the ends of passes ----------------------------------------------------------------------------------- */

static void tell_end(struct scheduler *s, struct worker *w, const struct job *job)
{
    enum readiness readiness = *scheduler_readiness(w, job->number);
    if (readiness == READINESS_NONE)
        return;
    if (readiness == READINESS_READY)
        scheduler_unload(s, w);
    else
        scheduler_end_loading(s, w, false);
    scheduler_act(s, (struct action){.kind = ACTION_END, .worker = w->number, .job = job->number});
}

static void revoke_all(struct scheduler *s, struct job *job)
{
    while (!list_is_empty(&job->leased))
        scheduler_revoke(s, job, list_owner(job->leased.next, struct band, in_job));
}

static void end_job(struct scheduler *s, struct job *job, struct action last)
{
    revoke_all(s, job);
    job->over = true;
    scheduler_clear_bands(job);
    forget_told(s, job);
    for (size_t i = 0; i < s->worker_capacity; i++)
        if (s->workers[i])
            tell_end(s, s->workers[i], job);
    scheduler_act(s, last);
}

void scheduler_fail_job(struct scheduler *s, struct job *job, const struct band *band)
{
    struct action failure = {.kind = ACTION_FAIL, .job = job->number, .pass = job->pass, .first_row = band->first_row,
                             .rows = band->rows};
    for (int i = 0; i < SCHEDULER_LOSSES_MAX; i++)
        failure.lost_by[i] = band->losers[i].worker;
    end_job(s, job, failure);
}

void scheduler_restart_job(struct scheduler *s, struct job *job)
{
    revoke_all(s, job);
    scheduler_act(s, (struct action){.kind = ACTION_RESTART, .job = job->number});
    job->kept_count = job->surveyor_count = 0;
    begin(s, job);
    s->everyones_turn = true;
}

static bool is_complete(const struct job *job)
{
    return job->accepted_rows == job->pass_rows[job->pass] && job->open_audits == 0;
}

void scheduler_end_complete_passes(struct scheduler *s, struct job *job)
{
    if (job->pass == PASS_SURVEY && is_complete(job)) {
        scheduler_act(s, (struct action){.kind = ACTION_SURVEYED, .job = job->number});
        scheduler_begin_pass(s, job, PASS_RENDER);
        s->everyones_turn = true;
    }
    if (job->pass == PASS_RENDER && is_complete(job))
        end_job(s, job, (struct action){.kind = ACTION_DONE, .job = job->number});
}
