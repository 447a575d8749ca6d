/*
 * The scheduler's audits and liars. An audit is a band of its own over rows that are accepted: it waits, is leased,
 * lost and copied as others are, but it counts no rows. Once answered it stays open until the caller has settled it.
 */
#include "base/memory.h"
#include "coordinator/scheduler_private.h"

void scheduler_choose_audit(struct scheduler *s, struct job *job, uint32_t first_row, uint32_t rows, uint32_t worker)
{
    const struct scheduler_policy *policy = &s->policy;
    if (!policy->audits || !policy->audits(policy->audits_context, job->number, job->pass, first_row))
        return;
    struct band *audit = scheduler_add_band(job, first_row, rows);
    audit->audits = true;
    audit->worker = worker;
    job->open_audits++;
    scheduler_put_waiting(s, job, audit);
}

/* --- who may ---------------------------------------------------------------------------------------------- */

static bool has_rendered(const struct band *audit, uint32_t worker)
{
    bool has = audit->worker == worker;
    for (size_t i = 0; i < audit->auditor_count; i++)
        has |= audit->auditors[i] == worker;
    return has;
}

bool scheduler_may_take(const struct band *band, const struct worker *w)
{
    return !band->audits || ((w->trusted || !band->judges) && !has_rendered(band, w->number));
}

struct band *scheduler_next_audit(const struct job *job, const struct worker *w)
{
    list_each(link, &job->audits) {
        struct band *audit = list_owner(link, struct band, in_job);
        if (scheduler_may_take(audit, w))
            return audit;
    }
    return NULL;
}

/* --- asking for a trusted worker -------------------------------------------------------------------------- */

/* All that the worker holds is overdue, so that it may live and yet never answer. */
static bool is_doubtful(const struct scheduler *s, const struct worker *w)
{
    list_each(link, &w->leases) {
        const struct lease *lease = list_owner(link, struct lease, in_worker);
        if (scheduler_straggles_at(lease->job, lease->band) > s->now_ms)
            return false;
    }
    return w->lease_count > 0;
}

/* It has loaded the job, or is likely to. One more trusted worker would not load it sooner than the one that is there. */
static bool knows(const struct scheduler *s, struct worker *w, const struct job *job)
{
    enum { LOADING_MS = 10000 }; /* patience with one who was told of it and does not say that it is ready */
    bool is_ready = *scheduler_readiness(w, job->number) == READINESS_READY;
    return is_ready || w->trusted || s->now_ms - w->told_ms < LOADING_MS;
}

/* Of all who are here, nobody is likely ever to take it. */
static bool is_hopeless(const struct scheduler *s, const struct job *job, const struct band *audit)
{
    list_each(link, &s->heard) {
        struct worker *w = list_owner(link, struct worker, in_heard);
        if (!w->draining && scheduler_may_take(audit, w) && !is_doubtful(s, w) && knows(s, w, job))
            return false;
    }
    return true;
}

/* The job has no rows waiting, and nothing leased but what is overdue. */
static bool is_at_rest(const struct scheduler *s, const struct job *job)
{
    if (scheduler_rows_waiting(job) > 0 || list_is_empty(&job->leased))
        return scheduler_rows_waiting(job) == 0;
    return scheduler_straggles_at(job, list_owner(job->leased.previous, struct band, in_job)) <= s->now_ms;
}

/* As long as there is something else to do for the job, somebody may yet come who takes the audit; a judge is wanted at
 * once. */
static bool needs_trusted(const struct scheduler *s, const struct job *job)
{
    bool at_rest = job->open_audits > 0 && is_at_rest(s, job);
    list_each(link, &job->audits) {
        const struct band *audit = list_owner(link, struct band, in_job);
        if ((at_rest || audit->judges) && is_hopeless(s, job, audit))
            return true;
    }
    for (struct list *link = job->leased.next; at_rest && link != &job->leased; link = link->next) {
        const struct band *audit = list_owner(link, struct band, in_job);
        if (audit->audits && is_hopeless(s, job, audit))
            return true;
    }
    return false;
}

void scheduler_ask_for_trusted(struct scheduler *s)
{
    if (!s->policy.audits)
        return;
    for (size_t i = 0; !s->asked && i < s->told_count; i++) {
        s->asked = needs_trusted(s, s->told[i]);
        if (s->asked)
            scheduler_act(s, (struct action){.kind = ACTION_NEED_TRUSTED, .job = s->told[i]->number});
    }
}

/* --- answers ---------------------------------------------------------------------------------------------- */

void scheduler_answer_audit(struct scheduler *s, struct worker *w, struct job *job, struct band *audit)
{
    audit->auditors = memory_grow(audit->auditors, &audit->auditor_capacity, audit->auditor_count + 1,
                                  sizeof *audit->auditors);
    audit->auditors[audit->auditor_count++] = w->number;
    scheduler_act(s, (struct action){.kind = ACTION_AUDITED, .worker = w->number, .job = job->number,
                                     .pass = job->pass, .first_row = audit->first_row, .rows = audit->rows,
                                     .about = audit->worker});
    scheduler_revoke(s, job, audit);
    audit->state = BAND_UNSETTLED;
    list_append(&job->unsettled, &audit->in_job);
}

/* The answered audit that the event is about, and its job; NULL: there is none. */
static struct band *find_unsettled(const struct scheduler *s, const struct event *event, struct job **job)
{
    *job = event->job < s->job_count ? s->jobs[event->job] : NULL;
    if (!*job || (*job)->over || (*job)->pass != event->pass)
        return NULL;
    list_each(link, &(*job)->unsettled) {
        struct band *audit = list_owner(link, struct band, in_job);
        if (audit->first_row == event->first_row)
            return audit;
    }
    return NULL;
}

/* In whatever state it is. */
static void close_audit(struct scheduler *s, struct job *job, struct band *audit)
{
    if (audit->state == BAND_LEASED)
        scheduler_revoke(s, job, audit);
    list_leave(&audit->in_job);
    audit->state = BAND_DONE;
    job->open_audits--;
}

void scheduler_settle_audit(struct scheduler *s, const struct event *event)
{
    struct job *job;
    struct band *audit = find_unsettled(s, event, &job);
    if (!audit)
        return;
    close_audit(s, job, audit);
    scheduler_end_complete_passes(s, job);
}

void scheduler_judge_audit(struct scheduler *s, const struct event *event)
{
    struct job *job;
    struct band *audit = find_unsettled(s, event, &job);
    if (!audit)
        return;
    audit->judges = true;
    scheduler_put_waiting(s, job, audit);
}

/* --- liars ------------------------------------------------------------------------------------------------ */

static void undo(struct scheduler *s, struct job *job, struct band *band)
{
    job->accepted_rows -= band->rows;
    scheduler_act(s, (struct action){.kind = ACTION_UNDO, .job = job->number, .pass = job->pass,
                                     .first_row = band->first_row, .rows = band->rows});
    scheduler_put_waiting(s, job, band);
}

/* Whether something that cannot be undone alone rests on what the worker said, as all of a render on its survey. */
static bool rests_on(const struct job *job, uint32_t liar)
{
    bool rests = liar == 0 && job->kept_count > 0;
    for (size_t i = 0; i < job->surveyor_count; i++)
        rests |= job->surveyors[i] == liar;
    return rests;
}

static void doubt_job(struct scheduler *s, struct job *job, uint32_t liar)
{
    if (rests_on(job, liar)) {
        scheduler_restart_job(s, job);
        return;
    }
    for (size_t i = 0; i < job->band_count; i++) {
        struct band *band = job->bands[i];
        if (band->worker != liar)
            continue;
        if (band->audits && band->state != BAND_DONE)
            close_audit(s, job, band);
        if (!band->audits && band->state == BAND_DONE)
            undo(s, job, band);
    }
}

void scheduler_take_liar(struct scheduler *s, uint32_t worker)
{
    struct worker *w = scheduler_worker(s, worker);
    if (w) {
        scheduler_act(s, (struct action){.kind = ACTION_EXPEL, .worker = worker, .liar = true});
        scheduler_remove_worker(s, w, false);
    }
    for (size_t i = 0; i < s->job_count; i++)
        if (!s->jobs[i]->over)
            doubt_job(s, s->jobs[i], worker);
}
