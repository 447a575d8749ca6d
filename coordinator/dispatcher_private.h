/* Private to the dispatcher. */
#ifndef WEFT_COORDINATOR_DISPATCHER_PRIVATE_H
#define WEFT_COORDINATOR_DISPATCHER_PRIVATE_H

#include "coordinator/askers.h"
#include "coordinator/audit.h"
#include "coordinator/dispatcher.h"
#include "coordinator/forecast.h"
#include "coordinator/machines.h"
#include "coordinator/peer.h"
#include "coordinator/peer_index.h"
#include "coordinator/scheduler.h"

enum {
    DISPATCHER_SILENCE_MS = 4500,   /* of a worker that is given up: four beats, and a little */
    DISPATCHER_NEWCOMER_BANDS = 32, /* of the least size they are tiles enough for hundreds of threads */
};

struct dispatcher {
    struct dispatcher_config config;
    int64_t now_ms;  /* of the call in progress */
    int64_t woke_ms; /* when it was called after it had stood still so long that workers may have left it */
    struct scheduler *scheduler;
    struct audit audit;
    bool needs_trusted;     /* to be taken */
    struct error doubtful;  /* a picture that was complete turned out to hold wrong rows; "": none did */
    struct render_job **jobs; /* the scheduler's job i is jobs[i] */
    size_t job_count, job_capacity;
    struct render_job **writing; /* all of their rows are there, but not yet written */
    size_t writing_count, writing_capacity;
    struct forecast **forecasts; /* of each job that is under way, else NULL */
    size_t forecast_capacity;
    struct render_job **done; /* in the order of completion; told up to done_at */
    size_t done_at, done_count, done_capacity;
    uint32_t *unreachable; /* workers, yet to be lost */
    size_t unreachable_count, unreachable_capacity;
    uint32_t *expelled; /* processes of this machine, yet to be taken */
    size_t expelled_count, expelled_capacity;
    struct peer *peers; /* all that ever joined, but for some that left with nothing done (dispatcher_let_go) */
    size_t peer_count, peer_capacity;
    struct peer_index peers_by_address;
    struct machines machines;
    bool undoing; /* some jobs were undone in part, and are yet to be summed up anew */
    bool earlier_lied; /* who rendered what an earlier run had kept */
    int64_t started_ms, beat_ms;
    uint32_t refused; /* HELLOs */
    struct askers askers;
    struct job_snapshot *job_views; /* of dispatcher_snapshot */
    struct worker_snapshot *worker_views;
    struct stretch_snapshot *stretch_views;
    size_t job_view_capacity, worker_view_capacity, stretch_view_capacity;
    bool answering; /* dispatcher_tell is at work */
    struct event *events; /* that came about meanwhile */
    size_t event_count, event_capacity;
    bool ending; /* nothing is handed out and nobody joins any more */
    enum status status; /* other than STATUS_OK: it has stopped, and says why in error */
    struct error error;
};

/* Begins a call, after the last one has ended. */
void dispatcher_note_time(struct dispatcher *dispatcher, int64_t now_ms);

/* Tells the scheduler and carries out what it answers. `result`: the bytes of an EVENT_RESULT, else NULL. */
void dispatcher_tell(struct dispatcher *dispatcher, const struct event *event, const uint8_t *result);

/* To any address: false if it cannot be reached. */
bool dispatcher_send_to(struct dispatcher *dispatcher, const struct wire_peer *address, const struct message *message);

/* Whether it was called after it had stood still so long that workers may have left it. */
bool dispatcher_has_slept(const struct dispatcher *dispatcher);

/* Sends to a worker. One that cannot be reached is gone, and is lost (dispatcher_lose_unreachable) when the next call
 * begins: only then is it known how long this one took, and so whether the worker is to blame. */
void dispatcher_send_peer(struct dispatcher *dispatcher, struct peer *peer, struct message message);

void dispatcher_lose_unreachable(struct dispatcher *dispatcher);

/* The job cannot be completed; what it ends with, unless something else did before. */
void dispatcher_fail_job(struct dispatcher *dispatcher, struct render_job *job, enum status status,
                         const struct error *error);

/* Completes the jobs whose outputs are written. */
void dispatcher_take_written(struct dispatcher *dispatcher);

/* Borrowed, until the next worker joins. */
struct peer *dispatcher_peer(struct dispatcher *dispatcher, uint32_t number);

/* The worker is gone: frees what it holds. Its number may be given to another one of its machine if nothing of it was
 * ever taken, so that who comes and goes again and again costs no memory. */
void dispatcher_let_go(struct dispatcher *dispatcher, struct peer *peer);

/* Notes what was the matter with the worker, and whether it counts as a failure. */
void dispatcher_note_trouble(struct dispatcher *dispatcher, struct peer *peer, enum worker_trouble trouble,
                             bool failed);

/* A line about a peer of that machine (machines.h), unless it is one too many. */
void dispatcher_tell_of(struct dispatcher *dispatcher, uint32_t machine, enum machine_line kind,
                        const char *format, ...) __attribute__((format(printf, 4, 5)));

/* The same about a worker, whose name goes before the text. */
void dispatcher_tell_of_peer(struct dispatcher *dispatcher, const struct peer *peer, enum machine_line kind,
                             const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Carries out ACTION_AUDITED, ACTION_UNDO, ACTION_RESTART. */
void dispatcher_audit(struct dispatcher *dispatcher, const struct action *action, const uint8_t *result);
void dispatcher_undo(struct dispatcher *dispatcher, const struct action *action);
void dispatcher_end_undoing(struct dispatcher *dispatcher); /* after the last of an event's */
void dispatcher_restart(struct dispatcher *dispatcher, const struct action *action);

/* Takes what somebody says who asks how things stand; false: it is a worker's. */
bool dispatcher_take_asker(struct dispatcher *dispatcher, const struct wire_peer *from, const struct message *message);

/* Answers those whose turn it is; when the dispatcher ends, for the last time, all that wait. */
void dispatcher_answer_askers(struct dispatcher *dispatcher);

/* Remaining time of a job. It begins, or begins anew: what is done counts, at unknown cost. */
void dispatcher_begin_forecast(struct dispatcher *dispatcher, uint32_t job);

/* All of its survey is done, and the render's sampling chosen. */
void dispatcher_tell_forecast_of_survey(struct dispatcher *dispatcher, uint32_t job);

/* A band was accepted, as the action says, and took so much work. */
void dispatcher_add_to_forecast(struct dispatcher *dispatcher, const struct action *accepted, double work);

/* A scheduler_policy's expects; context: the dispatcher. */
const double *dispatcher_expected_work(void *context, uint32_t job);

/* In seconds; negative: unknown. */
double dispatcher_remaining_seconds(const struct dispatcher *dispatcher, uint32_t job);

/* The worker is gone: tells the scheduler, unless it knows. */
void dispatcher_lose_peer(struct dispatcher *dispatcher, struct peer *peer, bool by_fault);

#endif
