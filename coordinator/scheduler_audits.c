/*
 * The scheduler's audits, liars, and who may take what. An audit is a band of its own over rows that are accepted: it
 * waits, is leased, lost and copied as others are, but it counts no rows. Once answered it stays open until the caller
 * has settled it.
 */
#include "base/memory.h"
#include "coordinator/scheduler_private.h"

void scheduler_choose_audit(struct scheduler *s, struct job *job, uint32_t first_row, uint32_t rows,
                            const struct worker *w)
{
    const struct scheduler_policy *policy = &s->policy;
    if (!policy->audits || !policy->audits(policy->audits_context, job->number, job->pass, first_row))
        return;
    struct band *audit = scheduler_add_band(job, first_row, rows);
    audit->audits = true;
    audit->worker = w ? w->number : 0;
    audit->machine = w ? w->machine : 0;
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

/* Two workers of one machine may lie alike. Trusted ones may not, but their machine may fail: others come first. */
static bool is_too_near(const struct scheduler *s, const struct band *audit, const struct worker *w)
{
    bool same = w->machine > 0 && w->machine == audit->machine;
    bool others = s->trusted_count < s->worker_count && !audit->lenient;
    return same && (!w->trusted || others);
}

static bool may_audit(const struct scheduler *s, const struct band *audit, const struct worker *w)
{
    if (has_rendered(audit, w->number))
        return false;
    return audit->judges ? w->trusted : !is_too_near(s, audit, w);
}

bool scheduler_may_take(const struct scheduler *s, const struct band *band, const struct worker *w)
{
    bool loses_it = scheduler_is_dreaded(band) && scheduler_has_lost(band, w);
    return !loses_it && (!band->audits || may_audit(s, band, w));
}

struct band *scheduler_next_reserved(const struct scheduler *s, const struct job *job, const struct worker *w)
{
    list_each(link, &job->reserved) {
        struct band *band = list_owner(link, struct band, in_job);
        if (scheduler_may_take(s, band, w))
            return band;
    }
    return NULL;
}

/* --- asking for a trusted worker -------------------------------------------------------------------------- */

/* All that the worker holds is overdue, so that it may live and yet never answer. What a trusted one says of its
 * progress is true, and one more would not be faster. */
static bool is_doubtful(const struct scheduler *s, const struct worker *w)
{
    enum { STANDSTILL_MS = 10000 };
    if (w->trusted && s->now_ms - w->pace.advanced_ms < STANDSTILL_MS)
        return false;
    list_each(link, &w->leases) {
        const struct lease *lease = list_owner(link, struct lease, in_worker);
        if (scheduler_straggles_at(lease->job, lease->band) > s->now_ms)
            return false;
    }
    return w->lease_count > 0;
}

/* It has loaded the job, or is likely to. One more trusted worker would not load it sooner than the one there is. */
static bool knows(const struct scheduler *s, struct worker *w, const struct job *job)
{
    enum { LOADING_MS = 10000 }; /* patience with one who was told of it and does not say that it is ready */
    bool is_ready = *scheduler_readiness(w, job->number) == READINESS_READY;
    return is_ready || w->trusted || s->now_ms - w->told_ms < LOADING_MS;
}

/* Of all who are here, nobody is likely ever to take it. */
static bool is_hopeless(const struct scheduler *s, const struct job *job, const struct band *band)
{
    list_each(link, &s->heard) {
        struct worker *w = list_owner(link, struct worker, in_heard);
        if (!w->draining && scheduler_may_take(s, band, w) && !is_doubtful(s, w) && knows(s, w, job))
            return false;
    }
    return true;
}

/* The job has no rows that anybody may take, and nothing leased but what is overdue. */
static bool is_at_rest(const struct scheduler *s, const struct job *job)
{
    if (scheduler_has_rows(job) || list_is_empty(&job->leased))
        return !scheduler_has_rows(job);
    return scheduler_straggles_at(job, list_owner(job->leased.previous, struct band, in_job)) <= s->now_ms;
}

/* A band of the job for which a trusted worker is needed; NULL: there is none. As long as there is something else to do
 * for the job, somebody may yet come who takes the audit; a judge is wanted at once, and so is who dares to take what
 * others were lost with. */
static struct band *needs_trusted(const struct scheduler *s, const struct job *job)
{
    if (job->open_audits == 0 && !job->has_dreaded)
        return NULL;
    bool at_rest = is_at_rest(s, job);
    list_each(link, &job->reserved) {
        struct band *band = list_owner(link, struct band, in_job);
        if ((at_rest || band->judges || scheduler_is_dreaded(band)) && is_hopeless(s, job, band))
            return band;
    }
    for (struct list *link = job->leased.next; at_rest && link != &job->leased; link = link->next) {
        struct band *band = list_owner(link, struct band, in_job);
        if ((band->audits || scheduler_is_dreaded(band)) && is_hopeless(s, job, band))
            return band;
    }
    return NULL;
}

/* Another trusted worker of the same machine is better than none. */
static bool help_themselves(struct scheduler *s, const struct job *job, struct band *band)
{
    if (!band->audits || band->lenient)
        return false;
    band->lenient = true;
    s->everyones_turn = true;
    scheduler_deal(s);
    return !is_hopeless(s, job, band);
}

void scheduler_ask_for_trusted(struct scheduler *s)
{
    for (size_t i = 0; i < s->told_count; i++) {
        const struct job *job = s->told[i];
        struct band *band = needs_trusted(s, job);
        if (!band || help_themselves(s, job, band) || s->asked)
            continue;
        s->asked = true;
        scheduler_act(s, (struct action){.kind = ACTION_NEED_TRUSTED, .job = job->number, .pass = job->pass,
                                         .first_row = band->first_row,
                                         .rows = scheduler_is_dreaded(band) ? band->rows : 0});
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
    if (job->pass == PASS_SURVEY)
        scheduler_note_surveyor(job, audit->auditors[audit->auditor_count - 1]);
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

/* What it alone found right may not be. */
static void audit_again(struct scheduler *s, struct job *job, struct band *audit, uint32_t liar)
{
    if (audit->auditor_count == 0 || audit->auditors[audit->auditor_count - 1] != liar)
        return;
    job->open_audits++;
    scheduler_put_waiting(s, job, audit);
}

static void doubt_audit(struct scheduler *s, struct job *job, struct band *audit, uint32_t liar)
{
    if (audit->worker != liar) {
        if (audit->state == BAND_DONE)
            audit_again(s, job, audit, liar);
        return;
    }
    if (audit->state != BAND_DONE)
        close_audit(s, job, audit);
    audit->auditor_count = 0; /* of rows that are undone it is never made again */
}

static void doubt_job(struct scheduler *s, struct job *job, uint32_t liar)
{
    if (rests_on(job, liar)) {
        scheduler_restart_job(s, job);
        return;
    }
    for (size_t i = 0; i < job->band_count; i++) {
        struct band *band = job->bands[i];
        if (band->audits)
            doubt_audit(s, job, band, liar);
        else if (band->worker == liar && band->state == BAND_DONE)
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
