/*
 * A worker of a farm on a virtual clock, which worker_loop.h runs: what it is, its connection, a pool whose renders
 * take time, but no work (pictures.h), and what it owes the coordinator.
 */
#ifndef WEFT_TESTS_WORKER_H
#define WEFT_TESTS_WORKER_H

#include "tests/sim/network.h"
#include "tests/sim/pictures.h"
#include "worker/session.h"

enum { WORKERS_MAX = 7, POOL_JOBS_MAX = 8, JOBS_MAX = 2, SENSELESS_BYTES_MAX = 1 << 24 };

/* A job or a band in the pool. */
struct pool_job {
    uint32_t number;
    struct job_settings settings;
    const struct picture *picture;
    int64_t loaded_ms; /* INT64_MAX: it is */
};

struct pool_band {
    uint64_t lease;
    const struct pool_job *job;
    struct order order;
    int64_t done_ms;
};

struct owed {
    uint32_t job;
    uint64_t lease;
};

struct worker {
    uint32_t number;
    /* What it is. */
    uint32_t host, pid, threads, credit;
    uint32_t low_ms, high_ms, load_ms, ms_a_row;
    uint32_t evil;   /* of its connections: struct link */
    bool once;
    bool hangs;      /* it says that it lives, and renders nothing */
    bool unfit;      /* it cannot load scenes */
    bool stranger;   /* of another core */
    bool liar;
    bool crooked;    /* it renders wrong bytes now and then */
    bool own;        /* the coordinator's, which believes it */
    /* How it fares. */
    bool disturbed;  /* it has reason to look for a coordinator again */
    bool joined; /* it has been welcomed by the present coordinator */
    bool stopped, draining, exited;
    struct session *session; /* NULL: it does not run */
    size_t link;
    uint32_t socket;         /* number of the socket that it has now */
    int64_t unreachable_ms;  /* until when it gets no connection */
    int64_t stopped_ms;
    int64_t turn_ms;         /* when its next turn is at the latest, if that is to come */
    enum message_kind said;  /* last, or tried to */
    struct pool_job jobs[POOL_JOBS_MAX];
    uint32_t job_count;
    struct pool_band *bands;
    size_t band_count, band_capacity;
    int64_t busy_ms;         /* until when its threads are */
    uint64_t rays, batches;
    struct owed *owed;       /* what it was given in this conversation, and neither acknowledged nor taken back */
    size_t owed_count, owed_capacity;
    /* What a liar has heard and said. */
    uint64_t epoch, lease;
    size_t lease_bytes;      /* of the result */
    struct bytes told;       /* its last result */
};

static struct worker workers[WORKERS_MAX]; /* the first is never disturbed */
static uint32_t worker_count;

/* What the workers are told of the coordinator. */
static struct {
    bool up;                                  /* it takes connections */
    bool disturbed;                           /* it was stopped, or is no more: they may look for it again */
    bool audits;                              /* of all bands */
    uint32_t judge;                           /* a worker that the coordinator started to tell who is right; 0: none */
    bool altered;                             /* evil has altered what decides a pixel */
    const struct picture *pictures[JOBS_MAX]; /* of its jobs */
} farm;

/* --- connections ------------------------------------------------------------------------------------------ */

static void look_for_coordinator(struct worker *w)
{
    int64_t at_ms = history.now_ms + draw(1, 5) + w->low_ms;
    w->link = NO_LINK;
    w->joined = false;
    happen(CONNECTION, w->number, ++w->socket, at_ms > w->unreachable_ms ? at_ms : w->unreachable_ms);
}

/* It takes the conversation for over. */
static void part(struct worker *w)
{
    require(!w->joined || w->disturbed || farm.disturbed, "worker %u gave up a coordinator that was there", w->number);
    w->joined = false;
    w->owed_count = 0;
}

static void reconnect(struct worker *w)
{
    part(w);
    if (w->link != NO_LINK)
        network_close(w->link);
    look_for_coordinator(w);
}

/* ZeroMQ replaces a connection that broke, and tells nobody. */
static void notice_cut(struct worker *w)
{
    if (w->link != NO_LINK && network.links[w->link].worker_knows_ms <= history.now_ms)
        look_for_coordinator(w);
}

/* --- the pool --------------------------------------------------------------------------------------------- */

static struct pool_job *find_job(struct worker *w, uint32_t number)
{
    for (uint32_t i = 0; i < w->job_count; i++)
        if (w->jobs[i].number == number)
            return &w->jobs[i];
    return NULL;
}

/* Where evil altered a job it may be any. */
static void load(struct worker *w, uint32_t number)
{
    struct asset_set assets = {0};
    struct pool_job job = {.number = number, .loaded_ms = history.now_ms + draw(0, w->load_ms)};
    require(w->job_count < POOL_JOBS_MAX && !find_job(w, number), "worker %u loads job %u again", w->number, number);
    session_assets(w->session, number, &job.settings, &assets);
    job.picture = picture_of(&assets, &job.settings);
    require(farm.altered || (job.picture && (!w->joined || job.picture == farm.pictures[number])),
            "worker %u was told another job than number %u", w->number, number);
    asset_set_finish(&assets);
    w->jobs[w->job_count++] = job;
}

static void start_band(struct worker *w, const struct session_action *action)
{
    struct pool_job *job = find_job(w, action->job);
    require(job && job->loaded_ms == INT64_MAX, "worker %u is to render job %u, not loaded", w->number, action->job);
    int64_t ms = (int64_t)action->order.rows * w->ms_a_row * draw(50, 150) / 100 / w->threads;
    w->busy_ms = (w->busy_ms > history.now_ms ? w->busy_ms : history.now_ms) + ms;
    w->bands = memory_grow(w->bands, &w->band_capacity, w->band_count + 1, sizeof *w->bands);
    w->bands[w->band_count++] = (struct pool_band){action->lease, job, action->order,
                                                   w->hangs ? INT64_MAX : w->busy_ms};
}

static void drop_band(struct worker *w, size_t band)
{
    w->band_count--;
    for (size_t i = band; i < w->band_count; i++) /* keeps the order */
        w->bands[i] = w->bands[i + 1];
}

static void cancel_band(struct worker *w, uint64_t lease)
{
    for (size_t i = w->band_count; i-- > 0;)
        if (w->bands[i].lease == lease)
            drop_band(w, i);
}

static void forget_job(struct worker *w, uint32_t number)
{
    struct pool_job *job = find_job(w, number);
    if (!job)
        return;
    for (size_t i = w->band_count; i-- > 0;) {
        if (w->bands[i].job == job)
            drop_band(w, i);
        else if (w->bands[i].job == &w->jobs[w->job_count - 1])
            w->bands[i].job = job;
    }
    *job = w->jobs[--w->job_count];
}

/* --- what it owes ----------------------------------------------------------------------------------------- */

/* Who neither lies nor hears lies. */
static bool is_honest(const struct worker *w)
{
    return !w->liar && w->evil == 0;
}

/* The coordinator settles every lease before it ends the job. */
static void check_settled(const struct worker *w, uint32_t job)
{
    for (size_t i = 0; i < w->owed_count; i++)
        require(!is_honest(w) || w->owed[i].job != job, "worker %u is not told what becomes of lease %llu",
                w->number, (unsigned long long)w->owed[i].lease);
}

static void owe(struct worker *w, const struct message *band)
{
    const struct pool_job *job = find_job(w, band->band.job);
    w->lease = band->band.lease;
    w->lease_bytes = job ? answer_bytes(&job->settings, (enum render_pass)band->band.pass, band->band.rows) : 1;
    w->owed = memory_grow(w->owed, &w->owed_capacity, w->owed_count + 1, sizeof *w->owed);
    w->owed[w->owed_count++] = (struct owed){band->band.job, band->band.lease};
}

static bool owes(const struct worker *w, uint64_t lease)
{
    for (size_t i = 0; i < w->owed_count; i++)
        if (w->owed[i].lease == lease)
            return true;
    return false;
}

static void settle(struct worker *w, uint64_t lease)
{
    for (size_t i = w->owed_count; i-- > 0;)
        if (w->owed[i].lease == lease)
            w->owed[i] = w->owed[--w->owed_count];
}

#endif
