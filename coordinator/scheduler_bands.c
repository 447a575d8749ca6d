/* The scheduler's bands: handed out, answered, given back. */
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

/* --- leases ----------------------------------------------------------------------------------------------- */

struct lease *scheduler_find_lease(const struct worker *w, uint64_t id)
{
    list_each(link, &w->leases) {
        struct lease *lease = list_owner(link, struct lease, in_worker);
        if (lease->id == id)
            return lease;
    }
    return NULL;
}

static void add_lease(struct scheduler *s, struct worker *w, struct job *job, struct band *band)
{
    struct lease *lease = memory_array(1, sizeof *lease);
    *lease = (struct lease){s->next_lease++, w, job, band, s->now_ms, {0}, {0}};
    list_append(&w->leases, &lease->in_worker);
    list_append(&band->leases, &lease->in_band);
    if (w->lease_count++ == 0)
        pace_begin(&w->pace, s->now_ms);
    s->lease_count++;
    scheduler_update_room(s, w);
    scheduler_act(s, (struct action){.kind = ACTION_GRANT, .worker = w->number, .job = job->number, .pass = job->pass,
                                     .first_row = band->first_row, .rows = band->rows, .lease = lease->id});
}

void scheduler_grant(struct scheduler *s, struct worker *w, struct job *job, struct band *band)
{
    if (band->holders++ == 0) {
        band->state = BAND_LEASED;
        band->granted_ms = s->now_ms;
        job->leased_rows += band->audits ? 0 : band->rows;
    }
    band->copied_ms = s->now_ms;
    list_append(&job->leased, &band->in_job);
    add_lease(s, w, job, band);
}

/* Frees the lease. Its worker may get another band instead. */
static void drop_lease(struct scheduler *s, struct lease *lease)
{
    struct worker *w = lease->worker;
    list_leave(&lease->in_worker);
    list_leave(&lease->in_band);
    lease->band->holders--;
    s->lease_count--;
    if (--w->lease_count == 0)
        pace_end(&w->pace, s->now_ms);
    scheduler_update_room(s, w);
    list_append(&s->turn, &w->in_turn);
    free(lease);
}

void scheduler_revoke(struct scheduler *s, struct job *job, struct band *band)
{
    while (!list_is_empty(&band->leases)) {
        struct lease *lease = list_owner(band->leases.next, struct lease, in_band);
        scheduler_act(s, (struct action){.kind = ACTION_REVOKE, .worker = lease->worker->number, .lease = lease->id});
        drop_lease(s, lease);
    }
    list_leave(&band->in_job);
    band->state = BAND_DONE;
    job->leased_rows -= band->audits ? 0 : band->rows;
}

/* --- answers ---------------------------------------------------------------------------------------------- */

void scheduler_note_surveyor(struct job *job, uint32_t worker)
{
    job->surveyors = memory_grow(job->surveyors, &job->surveyor_capacity, job->surveyor_count + 1,
                                 sizeof *job->surveyors);
    job->surveyors[job->surveyor_count++] = worker;
}

static void accept(struct scheduler *s, const struct worker *w, struct job *job, struct band *band, int64_t lease_ms)
{
    band->worker = w->number;
    if (job->pass == PASS_SURVEY)
        scheduler_note_surveyor(job, w->number);
    job->answered_ms += lease_ms;
    job->answered++;
    job->answered_rows += band->rows;
    job->accepted_rows += band->rows;
    scheduler_act(s, (struct action){.kind = ACTION_ACCEPT, .worker = w->number, .job = job->number, .pass = job->pass,
                                     .first_row = band->first_row, .rows = band->rows, .lease_ms = lease_ms});
    scheduler_revoke(s, job, band);
    scheduler_choose_audit(s, job, band->first_row, band->rows, w);
    scheduler_end_complete_passes(s, job);
}

void scheduler_take_result(struct scheduler *s, struct worker *w, uint64_t id)
{
    struct lease *lease = scheduler_find_lease(w, id);
    scheduler_act(s, (struct action){.kind = ACTION_ACK, .worker = w->number, .lease = id});
    if (!lease)
        return; /* revoked meanwhile: the band is done already */
    struct job *job = lease->job;
    struct band *band = lease->band;
    int64_t lease_ms = s->now_ms - lease->granted_ms;
    if (!w->proven)
        scheduler_prove(s, w);
    pace_answer(&w->pace, job->number, job->pass, band->rows, lease_ms, s->now_ms);
    drop_lease(s, lease);
    if (band->audits)
        scheduler_answer_audit(s, w, job, band);
    else
        accept(s, w, job, band, lease_ms);
}

/* --- losses ----------------------------------------------------------------------------------------------- */

void scheduler_put_waiting(struct scheduler *s, struct job *job, struct band *band)
{
    band->state = BAND_WAITING;
    list_append(band->audits || scheduler_is_dreaded(band) ? &job->reserved : &job->waiting, &band->in_job);
    s->everyones_turn = true;
}

bool scheduler_has_lost(const struct band *band, const struct worker *w)
{
    for (uint32_t i = 0; i < band->loser_count; i++)
        if (band->losers[i].party == w->party)
            return true;
    return false;
}

static void note_loss(struct job *job, struct band *band, const struct worker *w)
{
    band->losses++;
    job->has_dreaded |= scheduler_is_dreaded(band);
    if (!scheduler_has_lost(band, w))
        band->losers[band->loser_count++] = (struct loser){w->party, w->number};
}

/* A worker that had the band is gone. */
static void lose_band(struct scheduler *s, struct job *job, struct band *band, const struct worker *w, bool by_fault)
{
    if (by_fault)
        note_loss(job, band, w);
    if (band->holders == 0) {
        job->leased_rows -= band->audits ? 0 : band->rows;
        scheduler_put_waiting(s, job, band);
    }
    if (band->loser_count == SCHEDULER_LOSSES_MAX)
        scheduler_fail_job(s, job, band);
}

/* In two steps: when a loss ends a job, the worker that is gone must not be among those who hold its bands. */
void scheduler_give_back(struct scheduler *s, struct worker *w, bool by_fault)
{
    list_each(link, &w->leases) {
        struct lease *lease = list_owner(link, struct lease, in_worker);
        list_leave(&lease->in_band);
        lease->band->holders--;
    }
    while (!list_is_empty(&w->leases)) {
        struct lease *lease = list_owner(w->leases.next, struct lease, in_worker);
        list_leave(&lease->in_worker);
        s->lease_count--;
        if (!lease->job->over)
            lose_band(s, lease->job, lease->band, w, by_fault);
        free(lease);
    }
}

/* --- handing out ------------------------------------------------------------------------------------------ */

static bool is_anything_waiting(const struct job *job)
{
    return scheduler_has_rows(job) || !list_is_empty(&job->reserved);
}

/* The last rows are not to wait behind those that the worker has in work, when others may have nothing to do. */
static bool is_for_others(const struct scheduler *s, const struct worker *w, const struct job *job)
{
    return s->told_count == 1 && w->lease_count >= w->threads && scheduler_is_scarce(s, job);
}

/* What not everybody may take, else a band that came back, else one cut from the remaining rows; NULL: there is nothing
 * for the worker. */
static struct band *next_band(const struct scheduler *s, struct job *job, const struct worker *w)
{
    struct band *reserved = scheduler_next_reserved(s, job, w);
    if (reserved)
        return reserved;
    if (!scheduler_has_rows(job) || is_for_others(s, w, job))
        return NULL;
    scheduler_lay_soundings(s, job);
    if (list_is_empty(&job->waiting))
        return scheduler_cut_band(s, job, w);
    return list_owner(job->waiting.next, struct band, in_job);
}

/* Gives the worker one band of the first job that has one for it. */
static bool grant_one(struct scheduler *s, struct worker *w)
{
    for (size_t i = 0; list_is_in(&w->in_room) && i < s->told_count; i++) {
        struct job *job = s->told[i];
        if (!is_anything_waiting(job) || *scheduler_readiness(w, job->number) != READINESS_READY)
            continue;
        struct band *band = next_band(s, job, w);
        if (!band)
            continue;
        scheduler_grant(s, w, job, band);
        return true;
    }
    return false;
}

void scheduler_deal(struct scheduler *s)
{
    bool waits = false;
    for (size_t i = 0; s->everyones_turn && i < s->told_count; i++)
        waits |= is_anything_waiting(s->told[i]);
    if (waits)
        list_each(link, &s->room)
            list_append(&s->turn, &list_owner(link, struct worker, in_room)->in_turn);
    s->everyones_turn = false;
    while (!list_is_empty(&s->turn)) {
        struct worker *w = list_owner(s->turn.next, struct worker, in_turn);
        list_leave(&w->in_turn);
        if (grant_one(s, w))
            list_append(&s->turn, &w->in_turn);
    }
}
