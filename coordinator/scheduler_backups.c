/*
 * The scheduler's backups: idle workers get second copies of bands that hold up the end.
 *
 * Which ones, only a look at all that are out can show: at each worker, and what it needs yet for each of its bands.
 * One look serves all idle workers. The larger the farm, the longer it takes and the more rarely it is taken, so that
 * what all looks take in a second is bounded.
 */
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

enum {
    PATIENCE = 2, /* a band whose last lease is older than so many times the mean, and a little, is a straggler */
    LEAST_MS = 100,
    BLIND_MS = 2000, /* patience as long as nothing was answered that a band could be compared with */
    GAIN_MS = 20,    /* a copy that is likely to be sooner by no more than that does not pay */
    LOOKS_A_MS = 512, /* at how many workers and leases to look in a millisecond, if there are more */
    PACE_ROWS = 1024, /* a pace is a time for so many rows */
};

/* A band that may be worth a copy. */
struct candidate {
    struct job *job;
    struct band *band; /* NULL: copied */
    uint64_t lease; /* the first on it */
    bool overdue;
    int64_t left_ms; /* that the one who has it is likely to need for it yet; 0: more than one has it */
    int64_t gain;    /* if a worker of the mean pace rendered it too */
};

/* Each further holder has as long again, so that no number of workers that live but never answer can keep a band for
 * ever. */
int64_t scheduler_straggles_at(const struct job *job, const struct band *band)
{
    int64_t patience_ms = BLIND_MS;
    if (job->answered > 0)
        patience_ms = PATIENCE * job->answered_ms / job->answered + LEAST_MS;
    return band->copied_ms + patience_ms;
}

/* --- what a copy gains ------------------------------------------------------------------------------------ */

/* By the worker's pace for this band and the rows of the job that it got before, `rows` with those of the band; or
 * where that is unknown or over, half as long again as it has had the band already. */
static int64_t left_ms(const struct scheduler *s, const struct lease *lease, uint64_t rows)
{
    const struct pace *pace = &lease->worker->pace;
    int64_t needed = pace_alone_ms(pace, lease->job->number, lease->job->pass, rows, s->now_ms);
    int64_t left = needed - (s->now_ms - pace->answered_ms);
    return needed >= 0 && left > 0 ? left : (s->now_ms - lease->granted_ms) / 2;
}

static int64_t mean_pace(const struct job *job)
{
    return job->paces > 0 ? job->pace_sum_ms / job->paces : -1;
}

/* How much sooner the band would be done if an idle worker of that pace (−1: nobody knows) rendered it too; at most 0:
 * no sooner. Bands that are long overdue come before all others: first those that fewest have, and of these the ones
 * that were granted last: if their worker still gets on, the oldest are the ones that it is at. */
static int64_t gain(const struct candidate *c, int64_t pace)
{
    const int64_t overdue = INT64_C(1) << 62, of_a_holder = INT64_C(1) << 48;
    if (c->overdue)
        return overdue - c->band->holders * of_a_holder + c->band->granted_ms;
    return pace < 0 ? 0 : c->left_ms - pace * (int64_t)c->band->rows / PACE_ROWS - GAIN_MS;
}

/* --- looking ---------------------------------------------------------------------------------------------- */

/* The mean pace of each job that workers know, over those that have answered some of its present pass. */
static void look_at_paces(struct scheduler *s)
{
    for (size_t i = 0; i < s->told_count; i++)
        s->told[i]->pace_sum_ms = s->told[i]->paces = 0;
    list_each(link, &s->heard) {
        const struct pace *pace = &list_owner(link, struct worker, in_heard)->pace;
        struct job *job = pace->rows > 0 ? s->jobs[pace->job] : NULL;
        int64_t ms = job ? pace_alone_ms(pace, job->number, job->pass, PACE_ROWS, s->now_ms) : -1;
        if (ms < 0)
            continue;
        job->pace_sum_ms += ms;
        job->paces++;
    }
}

/* `rows`: of this band and of those that its worker got before, of the same job. */
static void consider(struct scheduler *s, const struct lease *lease, uint64_t rows)
{
    struct candidate c = {.job = lease->job, .band = lease->band, .lease = lease->id};
    c.overdue = scheduler_straggles_at(c.job, c.band) <= s->now_ms;
    c.left_ms = c.band->holders == 1 ? left_ms(s, lease, rows) : 0;
    c.gain = gain(&c, mean_pace(c.job));
    if (!c.overdue && c.left_ms <= GAIN_MS)
        return;
    s->candidates = memory_grow(s->candidates, &s->candidate_capacity, s->candidate_count + 1, sizeof *s->candidates);
    s->candidates[s->candidate_count++] = c;
}

/* Of bands that several have, the first lease counts. */
static void look_at_leases(struct scheduler *s, const struct worker *w)
{
    uint64_t rows = 0;
    list_each(link, &w->leases) {
        const struct lease *lease = list_owner(link, struct lease, in_worker);
        rows += lease->job->number == w->pace.job ? lease->band->rows : 0; /* of others the pace is unknown */
        if (lease->band->leases.next == &lease->in_band)
            consider(s, lease, rows);
    }
}

/* By their jobs' order, then those that gain most first; of equals the last, which its worker comes to last. */
static int compare(const void *left, const void *right)
{
    const struct candidate *a = left, *b = right;
    if (a->job != b->job)
        return a->job->number < b->job->number ? -1 : 1;
    if (a->gain != b->gain)
        return a->gain > b->gain ? -1 : 1;
    return a->lease > b->lease ? -1 : a->lease < b->lease;
}

static void look(struct scheduler *s)
{
    size_t at = 0;
    s->candidate_count = 0;
    look_at_paces(s);
    list_each(link, &s->heard)
        look_at_leases(s, list_owner(link, struct worker, in_heard));
    if (s->candidate_count > 0)
        qsort(s->candidates, s->candidate_count, sizeof *s->candidates, compare);
    for (size_t i = 0; i < s->told_count; i++) {
        s->told[i]->candidate = at;
        while (at < s->candidate_count && s->candidates[at].job == s->told[i])
            at++;
        s->told[i]->candidate_end = at;
    }
}

/* --- handing out ------------------------------------------------------------------------------------------ */

/* What is worth most of the job's candidates that the worker may take; NULL: there is none. */
static struct candidate *first_for(const struct scheduler *s, struct job *job, const struct worker *w)
{
    while (job->candidate < job->candidate_end && !s->candidates[job->candidate].band)
        job->candidate++;
    for (size_t i = job->candidate; i < job->candidate_end; i++)
        if (s->candidates[i].band && scheduler_may_take(s, s->candidates[i].band, w))
            return &s->candidates[i];
    return NULL;
}

/* What this idle worker gains most with of what is worth most in each job; NULL: with none. */
static struct candidate *choose(const struct scheduler *s, struct worker *w)
{
    struct candidate *best = NULL;
    int64_t most = 0;
    for (size_t i = 0; i < s->told_count; i++) {
        struct job *job = s->told[i];
        if (job->candidate == job->candidate_end || *scheduler_readiness(w, job->number) != READINESS_READY)
            continue;
        struct candidate *c = first_for(s, job, w);
        if (!c)
            continue;
        int64_t own = pace_alone_ms(&w->pace, job->number, job->pass, PACE_ROWS, s->now_ms);
        int64_t gains = gain(c, own >= 0 ? own : mean_pace(job));
        if (gains <= most)
            continue;
        most = gains;
        best = c;
    }
    return best;
}

void scheduler_grant_backups(struct scheduler *s)
{
    s->look_put_off = false;
    if (list_is_empty(&s->idle) || s->lease_count == 0)
        return;
    if (s->now_ms < s->look_ms) {
        s->look_put_off = true;
        return;
    }
    s->look_ms = s->now_ms + 1 + (int64_t)((s->worker_count + s->lease_count) / LOOKS_A_MS);
    look(s);
    for (struct list *link = s->idle.next, *next; s->candidate_count > 0 && link != &s->idle; link = next) {
        struct worker *w = list_owner(link, struct worker, in_idle);
        struct candidate *c = choose(s, w);
        next = link->next;
        if (!c)
            continue;
        scheduler_grant(s, w, c->job, c->band);
        c->band = NULL;
    }
}

int64_t scheduler_backups_due(const struct scheduler *s)
{
    int64_t due_ms = s->look_put_off ? s->look_ms : INT64_MAX;
    for (size_t i = 0; !list_is_empty(&s->idle) && i < s->told_count; i++) {
        const struct job *job = s->told[i];
        if (list_is_empty(&job->leased))
            continue;
        int64_t straggles_ms = scheduler_straggles_at(job, list_owner(job->leased.next, struct band, in_job));
        due_ms = straggles_ms > s->now_ms && straggles_ms < due_ms ? straggles_ms : due_ms;
    }
    return due_ms;
}
