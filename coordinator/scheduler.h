/*
 * Who renders which rows: a pure state machine. It is told events with the time at which they happened and answers
 * with actions; it has no clock, no sockets and no threads, so that a test can drive it through any history.
 *
 * A job is the rows 0..rows−1 of one picture, which may be surveyed first: then it has two passes (wire/message.h),
 * each over rows of its own, and the second begins when every row of the first is accepted; meanwhile idle workers go
 * on with the next job. Rows are handed out as bands, each under a lease to one worker: of a render first a few low
 * ones all over the picture, then the others from the top. When none are left, a band is leased to an idle worker too
 * that would be done with it before the one who has it, by what both have shown (pace.h),
 * and to one more each time that patience with its last holder runs out. The first answer is accepted and every other
 * lease of the band revoked. A worker that is lost loses its leases, and their bands are handed out again; so does one
 * that is stuck, unless it loads a job or nobody else is there. Every row is accepted exactly once a pass, and a job
 * ends if one worker answers, whatever the others do.
 *
 * Some bands are audited, which the caller chooses: a worker of another machine renders the rows once more (of the same
 * one if both workers are trusted and nobody else does), and the caller compares. If they differ it has a trusted
 * worker judge, and tells who lied: that worker's bands are handed out again, and what it audited is audited again. A
 * pass ends when nothing of it is open to doubt.
 */
#ifndef WEFT_COORDINATOR_SCHEDULER_H
#define WEFT_COORDINATOR_SCHEDULER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "wire/message.h"

struct scheduler_policy {
    uint32_t band_rows; /* of the render, not of surveys; 0: chosen by what remains, less towards the end */
    int64_t silence_ms; /* a worker that is silent for so long is dead */
    uint32_t newcomer_bands; /* a worker that has answered nothing yet holds no more, nor more than one a thread,
                              * whatever it says of itself, unless it is trusted; 0: its credit */
    /* Whether a band of which these rows are accepted, or a job's kept rows, are to be audited; NULL: none are. */
    bool (*audits)(const void *context, uint32_t job, enum render_pass pass, uint32_t first_row);
    const void *audits_context; /* borrowed */
    /* What the rows of job's render are expected to take, in any unit, summed from the top: sums[rows + 1], never falling,
     * valid until the next call; what is done counts nothing. NULL (the function or its answer): all rows are alike. */
    const double *(*expects)(void *context, uint32_t job);
    void *expects_context; /* borrowed */
};

/* A band that was lost with so many workers fails its job. Workers of one machine count as one, unless they are
 * trusted: so once it was lost so often with fewer, only others may take it, and a trusted one is asked for if nobody
 * else is there. */
enum { SCHEDULER_LOSSES_MAX = 3 };

enum event_kind {
    EVENT_JOB,    /* a new job: survey_rows, rows, kept. Jobs are numbered 0, 1, … in the order of these events */
    EVENT_JOIN,   /* worker, machine, threads, credit, trusted. Worker numbers are the caller's, from 1. One may be used
                   * again, by a worker of the same machine, if it is not trusted and has answered nothing */
    EVENT_READY,  /* worker has loaded the job */
    EVENT_BEAT,   /* worker is alive: progress */
    EVENT_RESULT, /* worker returned all of a lease's rows */
    EVENT_DRAIN,  /* worker wants no more bands */
    EVENT_LEAVE,  /* worker said goodbye */
    EVENT_LOST,   /* worker died or broke the protocol */
    EVENT_SETTLED, /* job, pass, first_row: the audit is over; who lied in it has been told */
    EVENT_JUDGE,  /* job, pass, first_row: a trusted worker that has not rendered it yet is to do so too */
    EVENT_LIAR,   /* worker, be it gone, or 0 for who rendered what was kept: nothing that it said is to be believed */
    EVENT_TICK,   /* slept; all that came until then has been told, and who was silent for too long is dead */
};

/* Rows of a pass that need no rendering. */
struct kept_rows {
    enum render_pass pass;
    uint32_t first_row, rows; /* rows >= 1 */
};

struct event {
    enum event_kind kind;
    uint32_t worker, job;
    uint32_t survey_rows;     /* JOB: 0: without a survey */
    uint32_t rows;            /* JOB: at least 1 */
    uint32_t rows_most;       /* JOB: of a band of the render; 0: as many as the policy says */
    const struct kept_rows *kept; /* JOB: kept[kept_count], from an earlier run, by pass and rising rows, none twice; */
    size_t kept_count;            /* borrowed. Of the render only if all of the survey are */
    uint32_t machine;         /* JOIN: its number, from 1; 0: one that no other worker is of */
    uint32_t threads, credit; /* JOIN: at least 1 each */
    bool trusted;             /* JOIN: what it renders is right */
    bool slept;               /* TICK: the caller has stood still, so that silence is not the worker's fault */
    enum render_pass pass;    /* SETTLED, JUDGE: of an audit after ACTION_AUDITED; others are passed over */
    uint32_t first_row;
    uint64_t lease;           /* RESULT */
    uint64_t progress;        /* BEAT: grows while it works */
};

enum action_kind {
    ACTION_ANNOUNCE, /* tell worker about job */
    ACTION_GRANT,    /* give worker rows first_row..first_row + rows − 1 of this pass of job under lease */
    ACTION_ACCEPT,   /* the result of this event, by worker, is the one for these rows of this pass of job; lease_ms */
    ACTION_ACK,      /* worker may forget the result of lease */
    ACTION_REVOKE,   /* worker may stop working on lease */
    ACTION_END,      /* worker may forget job */
    ACTION_EXPEL,    /* worker is considered dead, or (stuck) it lives but does not get on, or it is a liar */
    ACTION_SURVEYED, /* all rows of job's survey are accepted; what is granted of it from now on is of the render */
    ACTION_DONE,     /* job is complete */
    ACTION_AUDITED,  /* the result of this event, by worker, is of rows that were accepted from `about` (0: kept). The
                      * caller is to answer with EVENT_SETTLED or EVENT_JUDGE, in its time */
    ACTION_UNDO,     /* these accepted rows of this pass of job are not to be believed; they are rendered again */
    ACTION_RESTART,  /* nothing that was accepted or kept of job is to be believed; it begins again */
    ACTION_NEED_TRUSTED, /* an audit waits that nobody here may render, or only who seems not to answer: a trusted
                          * worker should join. Said once, until one has joined. With rows > 0: the same of a band of
                          * job that was lost too often */
    ACTION_FAIL,     /* job cannot be completed: these rows of this pass were lost with the workers lost_by */
};

struct action {
    enum action_kind kind;
    uint32_t worker, job;
    enum render_pass pass;
    uint32_t first_row, rows;
    uint64_t lease;
    int64_t lease_ms; /* ACCEPT: how long worker held its lease */
    bool stuck, liar; /* EXPEL */
    uint32_t about;   /* AUDITED */
    uint32_t lost_by[SCHEDULER_LOSSES_MAX]; /* FAIL */
};

/* All zero is empty; the caller frees items. */
struct action_list {
    struct action *items;
    size_t count, capacity;
};

struct scheduler;

struct scheduler *scheduler_create(const struct scheduler_policy *policy);

/* Frees *scheduler and sets it to NULL; *scheduler may be NULL. */
void scheduler_destroy(struct scheduler **scheduler);

/* Takes an event that happened at now_ms (never before an earlier one's) and appends what is to be done. Events that
 * name workers, jobs or leases that are unknown or over are harmless. */
void scheduler_handle(struct scheduler *scheduler, const struct event *event, int64_t now_ms,
                      struct action_list *actions);

/* When to send an EVENT_TICK at the latest; INT64_MAX: no need. */
int64_t scheduler_deadline(const struct scheduler *scheduler);

/* Whether worker holds this lease, and which rows of which job and pass it is for. */
bool scheduler_lease(const struct scheduler *scheduler, uint32_t worker, uint64_t lease, struct action *grant);

/* Rows of the job's present pass that are out under a lease. */
uint32_t scheduler_rows_leased(const struct scheduler *scheduler, uint32_t job);

/* As how many bands those rows of the job's present pass will about be handed out that nobody has. 0 also without any
 * worker. */
uint32_t scheduler_bands_to_come(const struct scheduler *scheduler, uint32_t job);

#endif
