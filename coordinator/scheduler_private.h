/*
 * Private to the scheduler: what it knows, and what its files do for one another.
 *
 *   scheduler.c          events, and what may be asked
 *   scheduler_jobs.c     jobs: which of them workers are told of, how their passes end
 *   scheduler_cutting.c  how the rows of a pass are cut into bands, and in which order these come
 *   scheduler_bands.c    bands: handed out, answered, given back
 *   scheduler_workers.c  workers: coming, going, silent, stuck
 *   scheduler_backups.c  second copies of what holds up the end
 *   scheduler_audits.c   bands that another renders to see whether the first lied, and liars
 *
 * There may be ten thousand workers and hundreds of jobs, and an event comes with every band of each. So few events (a
 * worker that comes or goes, a job, a pass that ends, a liar) look through all workers or a job's bands. For the
 * others, what is to be found is at the head of a list, or what the event names points to it.
 */
#ifndef WEFT_COORDINATOR_SCHEDULER_PRIVATE_H
#define WEFT_COORDINATOR_SCHEDULER_PRIVATE_H

#include "coordinator/list.h"
#include "coordinator/pace.h"
#include "coordinator/scheduler.h"

enum {
    JOBS_AHEAD = 2, /* unfinished jobs that workers are told of at least: the one in work and the one to come, */
    JOBS_AHEAD_MAX = 256, /* and at most: ten thousand workers need so many, since slow ones hold up some jobs */
};

enum band_state { BAND_WAITING, BAND_LEASED, BAND_UNSETTLED, BAND_DONE };

struct band {
    uint32_t first_row, rows;
    enum band_state state;
    struct list in_job; /* among its job's bands of that state; in none if it is done */
    struct list leases; /* on it, in the order of granting */
    uint32_t holders;   /* how many those are */
    uint32_t losses;    /* leases that ended with their worker's loss, */
    struct loser {
        uint64_t party;
        uint32_t worker; /* one of that party */
    } losers[SCHEDULER_LOSSES_MAX]; /* and with whose */
    uint32_t loser_count;
    int64_t granted_ms; /* its first lease since it last waited, */
    int64_t copied_ms;  /* and its last */
    uint32_t worker, machine; /* from whom its rows, or those that it audits, were accepted; 0: kept */
    bool audits;        /* it is no band of the picture: rows that are accepted are rendered once more */
    bool judges;        /* only a trusted worker may */
    bool lenient;       /* one of the same machine may, if both are trusted: there is nobody else */
    uint32_t *auditors; /* who has */
    size_t auditor_count, auditor_capacity;
};

/* Rows first_row .. first_row + rows − 1. */
struct span {
    uint32_t first_row, rows;
};

struct job {
    uint32_t number;
    enum render_pass pass;
    uint32_t pass_rows[PASSES], rows_most; /* the latter: of a band; 0: any number */
    bool over;
    bool sounded; /* scheduler_lay_soundings has been called for the present pass */
    uint32_t *surveyors; /* from whom bands of the survey were accepted, and who confirmed some */
    size_t surveyor_count, surveyor_capacity;
    struct kept_rows *kept;
    size_t kept_count;
    /* Of the present pass, which began with no band and so with no lease: */
    uint32_t next_row; /* rows from there on, but for those ahead, are not yet cut into bands; it is none of these */
    struct span *ahead; /* kept rows and soundings, by rising rows; those at ahead_at and later are beyond next_row */
    size_t ahead_at, ahead_count, ahead_capacity;
    uint32_t accepted_rows, leased_rows; /* kept rows are accepted ones */
    struct band **bands; /* all, in the order of cutting */
    size_t band_count, band_capacity;
    struct list waiting; /* bands to be handed out again, first in first out */
    struct list reserved; /* audits and bands that were lost too often, which not everybody may take; likewise */
    struct list unsettled; /* audits that are answered */
    uint32_t open_audits; /* that wait, are leased or unsettled */
    bool has_dreaded;     /* some band was lost too often */
    struct list leased;  /* bands and audits: the one that was granted last comes last */
    int64_t answered_ms; /* sum over accepted bands of the time that the worker needed which answered; what others
                          * wasted on them must not lengthen the patience */
    uint32_t answered;
    int64_t answered_rows;
    /* During a look for backups: */
    int64_t pace_sum_ms, paces;      /* of workers that know theirs */
    size_t candidate, candidate_end; /* what is worth a copy: candidates from candidate on */
};

struct lease {
    uint64_t id;
    struct worker *worker;
    struct job *job;
    struct band *band;
    int64_t granted_ms;
    struct list in_worker, in_band;
};

enum readiness { READINESS_NONE, READINESS_ANNOUNCED, READINESS_READY };

struct worker {
    uint32_t number, machine, threads, credit;
    uint64_t party; /* the same for workers whose losses count as one */
    bool draining, trusted;
    bool proven;    /* it has answered */
    uint32_t counted_threads; /* of the scheduler's: until then no more than it may hold bands */
    int64_t heard_ms;
    int64_t told_ms; /* when it was told of a job last */
    struct pace pace;
    struct list leases; /* in the order of granting */
    size_t lease_count;
    uint8_t *readiness; /* of each job */
    size_t readiness_count;
    size_t loading; /* jobs not over of which it was told, and of which it has not said that they are ready; */
    size_t loaded;  /* and those of which it has */
    struct list in_heard, in_room, in_idle, in_turn, in_suspects; /* of the scheduler */
};

struct scheduler {
    struct scheduler_policy policy;
    int64_t now_ms;
    struct job **jobs;
    size_t job_count, job_capacity;
    struct job *told[JOBS_AHEAD_MAX]; /* those not over of which workers are told, in their order */
    size_t told_count, next_job;      /* next_job: the first of which nobody was told */
    struct worker **workers; /* by their numbers; NULL: not present */
    size_t worker_capacity, worker_count; /* count: of those present */
    uint64_t threads; /* of all present, as far as they count */
    size_t trusted_count; /* of those present */
    bool asked; /* for a trusted worker, and none has joined since */
    bool slept; /* of the TICK in progress */
    uint64_t next_lease;
    size_t lease_count;
    struct list heard;    /* all workers, who was heard last comes last */
    struct list room;     /* workers that can take more, */
    struct list idle;     /* and those of them that hold nothing, but could: who has waited longest comes first */
    struct list turn;     /* during an event: whom it may get a band; */
    bool everyones_turn;  /* all that have room: bands wait that did not wait before */
    struct list suspects; /* workers that beat without progress for too long */
    int64_t look_ms;      /* backups are not looked for before then; */
    bool look_put_off;    /* it was put off until then */
    struct candidate *candidates; /* of the last look */
    size_t candidate_count, candidate_capacity;
    struct action_list *actions; /* during scheduler_handle */
};

void scheduler_act(struct scheduler *scheduler, struct action action);

/* --- workers ---------------------------------------------------------------------------------------------- */

/* The worker of that number, if it is present; else NULL. */
struct worker *scheduler_worker(const struct scheduler *scheduler, uint32_t number);

void scheduler_add_worker(struct scheduler *scheduler, const struct event *event);

/* Its bands go to others; if it is by its fault, that is held against them. Frees the worker. */
void scheduler_remove_worker(struct scheduler *scheduler, struct worker *worker, bool by_fault);

/* It has answered for the first time. */
void scheduler_prove(struct scheduler *scheduler, struct worker *worker);

/* To be told whenever its leases, its jobs, or its will to take some have changed. */
void scheduler_update_room(struct scheduler *scheduler, struct worker *worker);

/* What the worker has loaded of that job. */
uint8_t *scheduler_readiness(struct worker *worker, uint32_t job);

/* It has loaded one of the jobs that it was told of, or need not any more; it may forget one that it has loaded. */
void scheduler_end_loading(struct scheduler *scheduler, struct worker *worker, bool loaded);
void scheduler_unload(struct scheduler *scheduler, struct worker *worker);

void scheduler_take_beat(struct scheduler *scheduler, struct worker *worker, uint64_t progress);

/* When the worker is to be considered dead. */
int64_t scheduler_silent_at(const struct scheduler *scheduler, const struct worker *worker);

/* Expels those from whom nothing more is to be expected. */
void scheduler_expel_hopeless(struct scheduler *scheduler);

/* --- jobs ------------------------------------------------------------------------------------------------- */

void scheduler_add_job(struct scheduler *scheduler, const struct event *event);

/* All that is known of it is forgotten: it begins again. */
void scheduler_restart_job(struct scheduler *scheduler, struct job *job);

void scheduler_finish_job(struct job *job);

/* Tells a worker of the jobs of which others know; tells all of further jobs, if it is time. */
void scheduler_tell_worker(struct scheduler *scheduler, struct worker *worker);
void scheduler_tell_jobs(struct scheduler *scheduler);

/* Goes on to the next pass if this one is complete, and ends the job after the last. */
void scheduler_end_complete_passes(struct scheduler *scheduler, struct job *job);

/* Its band was lost too often. */
void scheduler_fail_job(struct scheduler *scheduler, struct job *job, const struct band *band);

/* --- cutting ---------------------------------------------------------------------------------------------- */

/* Begins that pass with nothing done but what is kept. Nothing may be leased. */
void scheduler_begin_pass(struct scheduler *scheduler, struct job *job, enum render_pass pass);

/* Forgets all bands. Nothing may be leased. */
void scheduler_clear_bands(struct job *job);

/* A new band or audit, as yet in no list. */
struct band *scheduler_add_band(struct job *job, uint32_t first_row, uint32_t rows);

/* The next band from the rows that are not yet cut, of which there is one, for this worker; as yet in no list. */
struct band *scheduler_cut_band(const struct scheduler *scheduler, struct job *job, const struct worker *worker);

/* To be called before the first band of a pass is handed out: now its soundings wait. */
void scheduler_lay_soundings(const struct scheduler *scheduler, struct job *job);

/* There were not enough rows in the picture for bands of the usual size, and now there is not one for each thread. */
bool scheduler_is_scarce(const struct scheduler *scheduler, const struct job *job);

/* --- bands ------------------------------------------------------------------------------------------------ */

/* Rows of the present pass that nobody has; and whether there are some that anybody may take. */
static inline uint32_t scheduler_rows_waiting(const struct job *job)
{
    return job->over ? 0 : job->pass_rows[job->pass] - job->accepted_rows - job->leased_rows;
}

static inline bool scheduler_has_rows(const struct job *job)
{
    return !job->over && (job->next_row < job->pass_rows[job->pass] || !list_is_empty(&job->waiting));
}

/* The worker's lease of that number; NULL: it has none. */
struct lease *scheduler_find_lease(const struct worker *worker, uint64_t id);

void scheduler_grant(struct scheduler *scheduler, struct worker *worker, struct job *job, struct band *band);

/* The band or audit waits to be handed out. */
void scheduler_put_waiting(struct scheduler *scheduler, struct job *job, struct band *band);

/* Takes a leased band from whoever still has it: it is done, or nobody needs it. */
void scheduler_revoke(struct scheduler *scheduler, struct job *job, struct band *band);

void scheduler_take_result(struct scheduler *scheduler, struct worker *worker, uint64_t lease);

/* The worker is gone: all that it holds goes to others. */
void scheduler_give_back(struct scheduler *scheduler, struct worker *worker, bool by_fault);

/* Whether the worker, or another one that counts as the same, has lost the band. */
bool scheduler_has_lost(const struct band *band, const struct worker *worker);

/* Gives bands to those whose turn it is, one each in turn, until nobody can take more. */
void scheduler_deal(struct scheduler *scheduler);

/* --- audits ----------------------------------------------------------------------------------------------- */

/* These rows were accepted from that worker, or kept (NULL): if the policy wants it, they are audited. */
void scheduler_choose_audit(struct scheduler *scheduler, struct job *job, uint32_t first_row, uint32_t rows,
                            const struct worker *worker);

/* Whether the band was lost so often that who lost it may not try again. */
static inline bool scheduler_is_dreaded(const struct band *band)
{
    return band->losses >= SCHEDULER_LOSSES_MAX;
}

/* Whether the worker may render the band. */
bool scheduler_may_take(const struct scheduler *scheduler, const struct band *band, const struct worker *worker);

/* What of the job's reserved bands the worker may take; NULL: none. */
struct band *scheduler_next_reserved(const struct scheduler *scheduler, const struct job *job,
                                     const struct worker *worker);

/* The worker has answered the audit, which nobody has any more. */
void scheduler_answer_audit(struct scheduler *scheduler, struct worker *worker, struct job *job, struct band *audit);

/* What the caller found; who lied. */
void scheduler_settle_audit(struct scheduler *scheduler, const struct event *event);
void scheduler_judge_audit(struct scheduler *scheduler, const struct event *event);
void scheduler_take_liar(struct scheduler *scheduler, uint32_t worker);

/* All of the job's render rests on that worker too. */
void scheduler_note_surveyor(struct job *job, uint32_t worker);

/* Asks for a trusted worker, if there is no going on without. */
void scheduler_ask_for_trusted(struct scheduler *scheduler);

/* --- backups ---------------------------------------------------------------------------------------------- */

/* Gives idle workers copies of bands that others have. */
void scheduler_grant_backups(struct scheduler *scheduler);

/* When one more worker should hold the leased band. */
int64_t scheduler_straggles_at(const struct job *job, const struct band *band);

/* When scheduler_grant_backups is to be called again at the latest. */
int64_t scheduler_backups_due(const struct scheduler *scheduler);

#endif
