#include "coordinator/scheduler.h"

#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/pace.h"

enum {
    JOBS_AHEAD = 2,       /* unfinished jobs that workers are told of: the one in work and the one to come */
    BAND_ROWS_MAX = 32,   /* of a band cut automatically, */
    BAND_ROWS_MIN = 4,    /* and of a render's, where so many are left: adaptive sampling looks beyond its edges */
    BANDS_A_THREAD = 2,   /* into how many bands a thread's share of the remaining rows is cut */
    BACKUP_PATIENCE = 2,  /* a band out for so many times the mean, and a little, is a straggler */
    BACKUP_LEAST_MS = 100,
    BACKUP_GAIN_MS = 20,    /* a copy that is likely to be sooner by no more than that does not pay */
    BACKUP_BLIND_MS = 2000, /* patience as long as nothing was answered that a band could be compared with */
};

enum band_state { BAND_WAITING, BAND_LEASED, BAND_DONE };

struct band {
    uint32_t first_row, rows;
    enum band_state state;
    uint32_t holders;   /* leases on it */
    uint32_t losses;    /* leases that ended with their worker's loss, */
    uint32_t lost_by[SCHEDULER_LOSSES_MAX]; /* and whose */
    int64_t granted_ms; /* its first lease since it last waited, */
    uint32_t worker;    /* and who has it */
};

struct job {
    enum render_pass pass;
    uint32_t pass_rows[PASSES];
    bool over;
    struct kept_rows *kept; /* those at kept_at and later are yet to be passed by next_row */
    size_t kept_at, kept_count;
    /* Of the present pass, which began with no band and so with no lease: */
    uint32_t next_row; /* rows from there on are not yet cut into bands; it is not a kept one */
    uint32_t accepted_rows;
    struct band *bands;
    size_t band_count, band_capacity;
    uint32_t *waiting; /* bands to be handed out again, first in first out from waiting_at */
    size_t waiting_at, waiting_count, waiting_capacity;
    int64_t answered_ms; /* sum over accepted bands of the time that the worker needed which answered; what others
                          * wasted on them must not lengthen the patience */
    uint32_t answered;
    int64_t answered_rows;
};

struct lease {
    uint64_t id;
    uint32_t job, band;
    int64_t granted_ms;
};

enum readiness { READINESS_NONE, READINESS_ANNOUNCED, READINESS_READY };

struct worker {
    uint32_t number, threads, credit;
    bool draining;
    int64_t heard_ms;
    struct pace pace;
    struct lease *leases;
    size_t lease_count, lease_capacity;
    uint8_t *readiness; /* of each job */
    size_t readiness_count;
};

struct scheduler {
    struct scheduler_policy policy;
    int64_t now_ms;
    struct job *jobs;
    size_t job_count, job_capacity, first_open_job;
    struct worker *workers; /* those present */
    size_t worker_count, worker_capacity;
    uint64_t threads; /* of all present */
    uint64_t next_lease;
    struct action_list *actions; /* during scheduler_handle */
};

struct scheduler *scheduler_create(const struct scheduler_policy *policy)
{
    struct scheduler *s = memory_array(1, sizeof *s);
    s->policy = *policy;
    s->next_lease = 1;
    return s;
}

static void worker_finish(struct worker *w)
{
    free(w->leases);
    free(w->readiness);
}

void scheduler_destroy(struct scheduler **pointer)
{
    struct scheduler *s = *pointer;
    if (!s)
        return;
    for (size_t i = 0; i < s->job_count; i++) {
        free(s->jobs[i].bands);
        free(s->jobs[i].waiting);
        free(s->jobs[i].kept);
    }
    for (size_t i = 0; i < s->worker_count; i++)
        worker_finish(&s->workers[i]);
    free(s->jobs);
    free(s->workers);
    free(s);
    *pointer = NULL;
}

/* --- looking things up ------------------------------------------------------------------------------------ */

static struct worker *find_worker(const struct scheduler *s, uint32_t number)
{
    for (size_t i = 0; i < s->worker_count; i++)
        if (s->workers[i].number == number)
            return &s->workers[i];
    return NULL;
}

static struct lease *find_lease(struct worker *w, uint64_t id)
{
    for (size_t i = 0; i < w->lease_count; i++)
        if (w->leases[i].id == id)
            return &w->leases[i];
    return NULL;
}

static struct band *band_of(const struct scheduler *s, const struct lease *lease)
{
    return &s->jobs[lease->job].bands[lease->band];
}

bool scheduler_lease(const struct scheduler *s, uint32_t worker, uint64_t id, struct action *grant)
{
    struct worker *w = find_worker(s, worker);
    struct lease *lease = w ? find_lease(w, id) : NULL;
    if (!lease)
        return false;
    const struct band *band = band_of(s, lease);
    enum render_pass pass = s->jobs[lease->job].pass;
    *grant = (struct action){.kind = ACTION_GRANT, .worker = worker, .job = lease->job, .pass = pass,
                             .first_row = band->first_row, .rows = band->rows, .lease = id};
    return true;
}

size_t scheduler_held(const struct scheduler *s, uint32_t worker)
{
    const struct worker *w = find_worker(s, worker);
    return w ? w->lease_count : 0;
}

uint32_t scheduler_rows_leased(const struct scheduler *s, uint32_t job)
{
    uint32_t rows = 0;
    if (job >= s->job_count || s->jobs[job].over)
        return 0;
    for (size_t i = 0; i < s->jobs[job].band_count; i++)
        if (s->jobs[job].bands[i].state == BAND_LEASED)
            rows += s->jobs[job].bands[i].rows;
    return rows;
}

static uint8_t *readiness_of(struct worker *w, size_t job)
{
    while (w->readiness_count <= job) {
        size_t more = 2 * w->readiness_count + 8;
        w->readiness = memory_resize(w->readiness, more, sizeof *w->readiness);
        for (size_t i = w->readiness_count; i < more; i++)
            w->readiness[i] = READINESS_NONE;
        w->readiness_count = more;
    }
    return &w->readiness[job];
}

static void act(struct scheduler *s, struct action action)
{
    struct action_list *list = s->actions;
    list->items = memory_grow(list->items, &list->capacity, list->count + 1, sizeof *list->items);
    list->items[list->count++] = action;
}

/* --- bands ------------------------------------------------------------------------------------------------ */

static uint32_t rows_of(const struct job *job)
{
    return job->pass_rows[job->pass];
}

/* Where the next kept rows of the pass begin, or its rows end. */
static uint32_t cut_end(const struct job *job)
{
    bool has_kept = job->kept_at < job->kept_count && job->kept[job->kept_at].pass == job->pass;
    return has_kept ? job->kept[job->kept_at].first_row : rows_of(job);
}

/* Passes kept rows at next_row: they count as accepted. */
static void pass_kept(struct job *job)
{
    while (job->next_row < rows_of(job) && job->next_row == cut_end(job)) {
        uint32_t rows = job->kept[job->kept_at++].rows;
        job->next_row += rows;
        job->accepted_rows += rows;
    }
}

static bool has_waiting(const struct job *job)
{
    return !job->over && (job->waiting_at < job->waiting_count || job->next_row < rows_of(job));
}

/* A share of `rows` for a worker that is slower than the mean, so that its bands take as long as those of others; few
 * rows as long as nobody knows. */
static uint64_t rows_for(const struct scheduler *s, uint32_t job_number, const struct worker *w, uint64_t rows)
{
    const struct job *job = &s->jobs[job_number];
    enum { PARTS = 64 }; /* of a millisecond */
    int64_t own = pace_leased_ms(&w->pace, job_number, job->pass, PARTS * rows);
    if (own < 0)
        return BAND_ROWS_MIN;
    int64_t mean = job->answered_ms * PARTS * (int64_t)rows / job->answered_rows;
    return own > mean && own > 0 ? rows * (uint64_t)mean / (uint64_t)own : rows;
}

/* Guided self-scheduling: a share of what remains, so that bands are large while there is much to do and small when
 * the end is near. */
static uint32_t rows_to_cut(const struct scheduler *s, uint32_t job_number, const struct worker *w)
{
    const struct job *job = &s->jobs[job_number];
    bool renders = job->pass == PASS_RENDER;
    uint32_t remaining = rows_of(job) - job->next_row, rows = renders ? s->policy.band_rows : 0;
    uint32_t together = cut_end(job) - job->next_row;
    if (rows == 0) {
        uint64_t share = remaining / (BANDS_A_THREAD * (s->threads ? s->threads : 1));
        uint64_t least = renders ? BAND_ROWS_MIN : 1;
        share = share < BAND_ROWS_MAX ? share : BAND_ROWS_MAX;
        share = renders && share > least ? rows_for(s, job_number, w, share) : share;
        rows = (uint32_t)(share < least ? least : share);
    }
    return rows < together ? rows : together;
}

/* The next band to hand out to this worker, of a job that has_waiting: one that came back, else one cut from the
 * remaining rows. */
static uint32_t take_waiting(struct scheduler *s, uint32_t job_number, const struct worker *w)
{
    struct job *job = &s->jobs[job_number];
    if (job->waiting_at < job->waiting_count)
        return job->waiting[job->waiting_at++];
    job->bands = memory_grow(job->bands, &job->band_capacity, job->band_count + 1, sizeof *job->bands);
    struct band *band = &job->bands[job->band_count];
    *band = (struct band){.first_row = job->next_row, .rows = rows_to_cut(s, job_number, w)};
    job->next_row += band->rows;
    pass_kept(job);
    return (uint32_t)job->band_count++;
}

static void put_back(struct job *job, uint32_t band)
{
    job->bands[band].state = BAND_WAITING;
    job->waiting = memory_grow(job->waiting, &job->waiting_capacity, job->waiting_count + 1, sizeof *job->waiting);
    job->waiting[job->waiting_count++] = band;
}

static void grant(struct scheduler *s, struct worker *w, uint32_t job_number, uint32_t band_number)
{
    struct band *band = &s->jobs[job_number].bands[band_number];
    if (band->holders++ == 0) {
        band->granted_ms = s->now_ms;
        band->worker = w->number;
    }
    band->state = BAND_LEASED;
    if (w->lease_count == 0)
        pace_begin(&w->pace, s->now_ms);
    w->leases = memory_grow(w->leases, &w->lease_capacity, w->lease_count + 1, sizeof *w->leases);
    w->leases[w->lease_count++] = (struct lease){s->next_lease, job_number, band_number, s->now_ms};
    act(s, (struct action){.kind = ACTION_GRANT, .worker = w->number, .job = job_number,
                           .pass = s->jobs[job_number].pass, .first_row = band->first_row, .rows = band->rows,
                           .lease = s->next_lease});
    s->next_lease++;
}

static void drop_lease(struct scheduler *s, struct worker *w, struct lease *lease)
{
    *lease = w->leases[--w->lease_count];
    if (w->lease_count == 0)
        pace_end(&w->pace, s->now_ms);
}

/* Takes the band's leases from whoever still has one. */
static void revoke_band(struct scheduler *s, uint32_t job, uint32_t band)
{
    for (size_t i = 0; i < s->worker_count; i++) {
        struct worker *w = &s->workers[i];
        for (size_t k = w->lease_count; k-- > 0;) {
            if (w->leases[k].job != job || w->leases[k].band != band)
                continue;
            act(s, (struct action){.kind = ACTION_REVOKE, .worker = w->number, .lease = w->leases[k].id});
            drop_lease(s, w, &w->leases[k]);
        }
    }
}

/* --- jobs ------------------------------------------------------------------------------------------------- */

static void end_job(struct scheduler *s, uint32_t number, struct action last)
{
    struct job *job = &s->jobs[number];
    job->over = true;
    for (size_t i = 0; i < job->band_count; i++)
        if (job->bands[i].state == BAND_LEASED)
            revoke_band(s, number, (uint32_t)i);
    for (size_t i = 0; i < s->worker_count; i++)
        if (*readiness_of(&s->workers[i], number) != READINESS_NONE)
            act(s, (struct action){.kind = ACTION_END, .worker = s->workers[i].number, .job = number});
    act(s, last);
    while (s->first_open_job < s->job_count && s->jobs[s->first_open_job].over)
        s->first_open_job++;
}

/* Every band of the survey is done, so no lease is left that could be mistaken for one of the render's. */
static void end_survey(struct scheduler *s, uint32_t number)
{
    struct job *job = &s->jobs[number];
    job->pass = PASS_RENDER;
    job->next_row = job->accepted_rows = 0;
    job->band_count = job->waiting_at = job->waiting_count = 0;
    job->answered_ms = job->answered_rows = job->answered = 0;
    pass_kept(job);
    act(s, (struct action){.kind = ACTION_SURVEYED, .job = number});
}

/* Goes on to the next pass if this one is complete, and ends the job after the last. */
static void end_complete_passes(struct scheduler *s, uint32_t number)
{
    struct job *job = &s->jobs[number];
    if (job->pass == PASS_SURVEY && job->accepted_rows == rows_of(job))
        end_survey(s, number);
    if (job->pass == PASS_RENDER && job->accepted_rows == rows_of(job))
        end_job(s, number, (struct action){.kind = ACTION_DONE, .job = number});
}

static void accept(struct scheduler *s, const struct worker *w, const struct lease *answered)
{
    struct job *job = &s->jobs[answered->job];
    struct band *band = &job->bands[answered->band];
    band->state = BAND_DONE;
    band->holders = 0;
    job->accepted_rows += band->rows;
    int64_t lease_ms = s->now_ms - answered->granted_ms;
    job->answered_ms += lease_ms;
    job->answered++;
    job->answered_rows += band->rows;
    act(s, (struct action){.kind = ACTION_ACCEPT, .worker = w->number, .job = answered->job, .pass = job->pass,
                           .first_row = band->first_row, .rows = band->rows, .lease_ms = lease_ms});
    revoke_band(s, answered->job, answered->band);
    end_complete_passes(s, answered->job);
}

/* --- workers coming and going ----------------------------------------------------------------------------- */

static void lose_lease(struct scheduler *s, const struct lease *lease, uint32_t worker, bool by_fault)
{
    struct job *job = &s->jobs[lease->job];
    struct band *band = &job->bands[lease->band];
    if (job->over || band->state != BAND_LEASED)
        return;
    if (by_fault)
        band->lost_by[band->losses++] = worker;
    if (--band->holders == 0)
        put_back(job, lease->band);
    if (band->losses < SCHEDULER_LOSSES_MAX)
        return;
    struct action failure = {.kind = ACTION_FAIL, .job = lease->job, .pass = job->pass, .first_row = band->first_row,
                             .rows = band->rows};
    for (int i = 0; i < SCHEDULER_LOSSES_MAX; i++)
        failure.lost_by[i] = band->lost_by[i];
    end_job(s, lease->job, failure);
}

static void remove_worker(struct scheduler *s, struct worker *w, bool by_fault)
{
    struct worker gone = *w;
    s->threads -= gone.threads;
    s->worker_count--;
    for (struct worker *to = w; to < s->workers + s->worker_count; to++) /* keeps the order of joining */
        *to = to[1];
    for (size_t i = 0; i < gone.lease_count; i++)
        lose_lease(s, &gone.leases[i], gone.number, by_fault);
    worker_finish(&gone);
}

static int64_t silent_at(const struct scheduler *s, const struct worker *w)
{
    return w->heard_ms + s->policy.silence_ms;
}

/* The last one is never given up for being stuck: a mistake would end the render, and nobody would gain. */
static int64_t stuck_at(const struct scheduler *s, const struct worker *w)
{
    return s->worker_count > 1 ? pace_stuck_at(&w->pace) : INT64_MAX;
}

/* Those from whom nothing more is to be expected. That a worker is stuck is not held against its bands. */
static void expel_hopeless(struct scheduler *s)
{
    for (size_t i = s->worker_count; i-- > 0;) {
        struct worker *w = &s->workers[i];
        bool silent = s->now_ms >= silent_at(s, w);
        if (!silent && s->now_ms < stuck_at(s, w))
            continue;
        act(s, (struct action){.kind = ACTION_EXPEL, .worker = w->number, .stuck = !silent});
        remove_worker(s, w, silent);
    }
}

static void add_worker(struct scheduler *s, const struct event *event)
{
    s->workers = memory_grow(s->workers, &s->worker_capacity, s->worker_count + 1, sizeof *s->workers);
    s->workers[s->worker_count++] = (struct worker){.number = event->worker, .threads = event->threads,
                                                    .credit = event->credit, .heard_ms = s->now_ms};
    s->threads += event->threads;
}

static void add_job(struct scheduler *s, const struct event *event)
{
    s->jobs = memory_grow(s->jobs, &s->job_capacity, s->job_count + 1, sizeof *s->jobs);
    struct job *job = &s->jobs[s->job_count++];
    *job = (struct job){.pass = event->survey_rows > 0 ? PASS_SURVEY : PASS_RENDER,
                        .pass_rows = {event->survey_rows, event->rows}, .kept_count = event->kept_count};
    job->kept = memory_array(event->kept_count, sizeof *job->kept);
    for (size_t i = 0; i < event->kept_count; i++)
        job->kept[i] = event->kept[i];
    pass_kept(job);
    end_complete_passes(s, (uint32_t)(s->job_count - 1));
}

/* --- handing out ------------------------------------------------------------------------------------------ */

static void announce(struct scheduler *s)
{
    size_t told = 0;
    for (size_t job = s->first_open_job; job < s->job_count && told < JOBS_AHEAD; job++) {
        if (s->jobs[job].over)
            continue;
        told++;
        for (size_t i = 0; i < s->worker_count; i++) {
            uint8_t *readiness = readiness_of(&s->workers[i], job);
            if (*readiness != READINESS_NONE || s->workers[i].draining)
                continue;
            *readiness = READINESS_ANNOUNCED;
            act(s, (struct action){.kind = ACTION_ANNOUNCE, .worker = s->workers[i].number, .job = (uint32_t)job});
        }
    }
}

static bool can_take(const struct worker *w)
{
    return !w->draining && w->lease_count < w->credit;
}

/* Gives the worker one band of the first job that has one for it. */
static bool grant_one(struct scheduler *s, struct worker *w)
{
    for (size_t job = s->first_open_job; can_take(w) && job < s->job_count; job++) {
        if (!has_waiting(&s->jobs[job]) || *readiness_of(w, job) != READINESS_READY)
            continue;
        grant(s, w, (uint32_t)job, take_waiting(s, (uint32_t)job, w));
        return true;
    }
    return false;
}

/* One band each in turn, until nobody can take more. */
static void grant_waiting(struct scheduler *s)
{
    bool granted = true;
    while (granted) {
        granted = false;
        for (size_t i = 0; i < s->worker_count; i++)
            granted |= grant_one(s, &s->workers[i]);
    }
}

/* When a leased band counts as a straggler that one more worker should hold; INT64_MAX: never. Each further holder
 * waits as long again, so that no number of workers that live but never answer can keep a band for ever. */
static int64_t straggles_at(const struct job *job, const struct band *band)
{
    if (job->over || band->state != BAND_LEASED)
        return INT64_MAX;
    int64_t patience_ms = BACKUP_BLIND_MS;
    if (job->answered > 0)
        patience_ms = BACKUP_PATIENCE * job->answered_ms / job->answered + BACKUP_LEAST_MS;
    return band->granted_ms + band->holders * patience_ms;
}

static bool holds(const struct worker *w, size_t job, size_t band)
{
    for (size_t i = 0; i < w->lease_count; i++)
        if (w->leases[i].job == job && w->leases[i].band == band)
            return true;
    return false;
}

/* How long the one who has the band is likely to need for it yet, if nobody else has it: by its pace for this band and
 * those that it got before, or where that is unknown or over half as long again as it has had it already. */
static int64_t left_ms(const struct scheduler *s, uint32_t job, uint32_t number)
{
    const struct band *band = &s->jobs[job].bands[number];
    const struct worker *w = band->holders == 1 ? find_worker(s, band->worker) : NULL;
    uint64_t rows = 0, lease = UINT64_MAX;
    if (!w)
        return 0;
    for (size_t i = 0; i < w->lease_count; i++)
        if (w->leases[i].job == job && w->leases[i].band == number)
            lease = w->leases[i].id;
    for (size_t i = 0; i < w->lease_count; i++)
        rows += w->leases[i].job == job && w->leases[i].id <= lease ? band_of(s, &w->leases[i])->rows : 0;
    int64_t needed = pace_alone_ms(&w->pace, job, s->jobs[job].pass, rows, s->now_ms);
    int64_t left = needed - (s->now_ms - w->pace.answered_ms);
    return needed >= 0 && left > 0 ? left : (s->now_ms - band->granted_ms) / 2;
}

enum { PACE_ROWS = 1024 };

/* How long an idle worker would take for PACE_ROWS rows of the job: by its own pace, else by that of all; −1: nobody
 * knows. */
static int64_t idle_pace(const struct scheduler *s, const struct worker *w, uint32_t job)
{
    int64_t own = pace_alone_ms(&w->pace, job, s->jobs[job].pass, PACE_ROWS, s->now_ms), sum = 0, known = 0;
    for (size_t i = 0; own < 0 && i < s->worker_count; i++) {
        int64_t other = pace_alone_ms(&s->workers[i].pace, job, s->jobs[job].pass, PACE_ROWS, s->now_ms);
        sum += other >= 0 ? other : 0;
        known += other >= 0;
    }
    return own >= 0 ? own : known > 0 ? sum / known : -1;
}

/* How much sooner the band would be done if an idle worker of that pace rendered it too; at most 0: no sooner. Bands that
 * are long overdue come before all others: first those that fewest have, and of these the ones that were granted last:
 * if their worker still gets on, the oldest are the ones that it is at. */
static int64_t gain_ms(const struct scheduler *s, int64_t pace, uint32_t job, uint32_t number)
{
    const int64_t overdue = INT64_C(1) << 62, of_a_holder = INT64_C(1) << 48;
    const struct band *band = &s->jobs[job].bands[number];
    if (straggles_at(&s->jobs[job], band) <= s->now_ms)
        return overdue - band->holders * of_a_holder + band->granted_ms;
    if (band->state != BAND_LEASED || pace < 0)
        return 0;
    return left_ms(s, job, number) - pace * (int64_t)band->rows / PACE_ROWS - BACKUP_GAIN_MS;
}

/* The band that this idle worker gains most with. */
static bool find_backup(const struct scheduler *s, struct worker *w, uint32_t *found_job, uint32_t *found_band)
{
    int64_t most = 0;
    for (uint32_t job = (uint32_t)s->first_open_job; job < s->job_count; job++) {
        if (s->jobs[job].over || *readiness_of(w, job) != READINESS_READY)
            continue;
        int64_t pace = idle_pace(s, w, job);
        for (uint32_t i = 0; i < s->jobs[job].band_count; i++) {
            int64_t gain = gain_ms(s, pace, job, i);
            if (gain <= 0 || gain < most || holds(w, job, i)) /* of equals the last, which its worker comes to last */
                continue;
            most = gain;
            *found_job = job;
            *found_band = i;
        }
    }
    return most > 0;
}

/* Idle workers duplicate what holds up the end. */
static void grant_backups(struct scheduler *s)
{
    for (size_t i = 0; i < s->worker_count; i++) {
        struct worker *w = &s->workers[i];
        uint32_t job, band;
        if (w->lease_count == 0 && can_take(w) && find_backup(s, w, &job, &band))
            grant(s, w, job, band);
    }
}

/* --- events ----------------------------------------------------------------------------------------------- */

static void take_result(struct scheduler *s, struct worker *w, uint64_t id)
{
    act(s, (struct action){.kind = ACTION_ACK, .worker = w->number, .lease = id});
    struct lease *lease = find_lease(w, id);
    if (!lease)
        return; /* revoked meanwhile: the band is done already */
    struct lease answered = *lease;
    const struct job *job = &s->jobs[answered.job];
    pace_answer(&w->pace, answered.job, job->pass, job->bands[answered.band].rows, s->now_ms - answered.granted_ms,
                s->now_ms);
    drop_lease(s, w, lease);
    accept(s, w, &answered);
}

static void handle_worker_event(struct scheduler *s, struct worker *w, const struct event *event)
{
    w->heard_ms = s->now_ms;
    switch (event->kind) {
    case EVENT_READY:
        if (event->job < s->job_count && *readiness_of(w, event->job) == READINESS_ANNOUNCED)
            *readiness_of(w, event->job) = READINESS_READY;
        break;
    case EVENT_BEAT:
        pace_beat(&w->pace, event->progress, s->now_ms);
        break;
    case EVENT_RESULT:
        take_result(s, w, event->lease);
        break;
    case EVENT_DRAIN:
        w->draining = true;
        break;
    case EVENT_LEAVE:
    case EVENT_LOST:
        remove_worker(s, w, event->kind == EVENT_LOST);
        break;
    default:
        break;
    }
}

void scheduler_handle(struct scheduler *s, const struct event *event, int64_t now_ms, struct action_list *actions)
{
    s->now_ms = now_ms;
    s->actions = actions;
    struct worker *w = find_worker(s, event->worker);
    if (event->kind == EVENT_JOB)
        add_job(s, event);
    else if (event->kind == EVENT_JOIN && !w)
        add_worker(s, event);
    else if (event->kind != EVENT_TICK && w)
        handle_worker_event(s, w, event);
    if (event->kind == EVENT_TICK) /* before, what the others have said may not have been told yet */
        expel_hopeless(s);
    announce(s);
    grant_waiting(s);
    grant_backups(s);
}

int64_t scheduler_deadline(const struct scheduler *s)
{
    int64_t deadline = INT64_MAX;
    bool someone_idle = false;
    for (size_t i = 0; i < s->worker_count; i++) {
        int64_t silent = silent_at(s, &s->workers[i]), stuck = stuck_at(s, &s->workers[i]);
        deadline = silent < deadline ? silent : deadline;
        deadline = stuck < deadline ? stuck : deadline;
        someone_idle |= s->workers[i].lease_count == 0 && can_take(&s->workers[i]);
    }
    for (size_t job = s->first_open_job; someone_idle && job < s->job_count; job++)
        for (size_t i = 0; i < s->jobs[job].band_count; i++) {
            int64_t straggles = straggles_at(&s->jobs[job], &s->jobs[job].bands[i]);
            deadline = straggles > s->now_ms && straggles < deadline ? straggles : deadline;
        }
    return deadline;
}
