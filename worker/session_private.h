/* Private to the session. */
#ifndef WEFT_WORKER_SESSION_PRIVATE_H
#define WEFT_WORKER_SESSION_PRIVATE_H

#include "worker/fetching.h"
#include "worker/seeking.h"
#include "worker/session.h"

enum session_state { STATE_SEEKING, STATE_JOINED, STATE_ENDED };

enum job_state { JOB_FETCHING, JOB_LOADING, JOB_READY, JOB_UNUSABLE };

struct session_job {
    uint32_t number;
    enum job_state state;
    struct job_settings settings;
};

/* A band that the worker holds; records are there from when it is rendered until it is acknowledged. */
struct held_band {
    uint64_t lease;
    uint32_t job;
    struct bytes records;
};

struct session {
    struct session_config config;
    enum session_state state;
    bool draining;
    bool unfit; /* said FAILED in this conversation */
    uint64_t epoch;
    struct seeking seeking; /* while there is no coordinator */
    int64_t heard_ms, beat_ms;
    uint64_t progress, rays;
    struct fetching fetching; /* has the same jobs as the session */
    struct session_job *jobs; /* in the order of announcement */
    size_t job_count, job_capacity;
    struct held_band *bands;
    size_t band_count, band_capacity;
    struct session_action *actions; /* taken up to action_at */
    size_t action_at, action_count, action_capacity;
};

/* --- actions ---------------------------------------------------------------------------------------------- */

/* Adds an action, to be filled in until the next is added. */
struct session_action *session_act(struct session *session, enum session_action_kind kind);

/* SESSION_SEND, in the conversation's epoch. */
void session_send(struct session *session, struct message message);

/* SESSION_SAY */
void session_say(struct session *session, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* What is still to be done for the job is not done: a message before it may have met a lost connection. */
void session_drop_actions(struct session *session, uint32_t job);

/* --- jobs and bands: of a conversation, all forgotten with it --------------------------------------------- */

void session_forget_jobs(struct session *session);

/* Take a JOB, ASSET or BAND message. NULL, or how its sender does not keep the protocol. */
const char *session_take_job(struct session *session, const struct message *message);
const char *session_take_asset(struct session *session, const struct message *message);
const char *session_take_band(struct session *session, const struct message *message);

void session_take_loaded(struct session *session, const struct session_event *event); /* or LOAD_FAILED */
void session_take_rendered(struct session *session, const struct session_event *event);
void session_end_job(struct session *session, uint32_t job); /* if there is one of that number */
void session_drop_band(struct session *session, uint64_t lease); /* if there is one of that lease */

#endif
