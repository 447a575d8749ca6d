/*
 * A worker's side of the conversation with a coordinator (wire/message.h): a pure state machine. It is told events
 * with the time at which they happened and answers with actions; it has no clock, no sockets and no threads.
 *
 * It seeks a coordinator until it is welcomed, fetches what jobs need, has bands rendered, and keeps each result until
 * it is acknowledged. A coordinator that falls silent is forgotten with all its jobs, and sought anew; after one that
 * broke the protocol or could not use this worker, only after a pause.
 */
#ifndef WEFT_WORKER_SESSION_H
#define WEFT_WORKER_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "base/bytes.h"
#include "scene/assets.h"
#include "wire/message.h"
#include "worker/order.h"

/* Who the worker is: the fields of HELLO, and how it behaves. */
struct session_config {
    struct message hello;
    bool once;        /* end with the coordinator's goodbye or refusal */
    bool keyed;       /* a coordinator that has other keys cannot be heard */
    int64_t wait_ms;  /* how long to seek before giving up; negative: for ever */
};

enum { SESSION_BEAT_MS = 1000, SESSION_SILENCE_MS = 5000 };

enum session_event_kind {
    SESSION_TICK,        /* only the time */
    SESSION_MESSAGE,     /* message */
    SESSION_LOADED,      /* job is ready */
    SESSION_LOAD_FAILED, /* job, reason */
    SESSION_RENDERED,    /* lease, records */
    SESSION_DRAIN,       /* finish what is held, then end */
};

struct session_event {
    enum session_event_kind kind;
    const struct message *message; /* borrowed */
    uint32_t job;
    const char *reason; /* borrowed */
    uint64_t lease;
    struct bytes *records;   /* moved into the session */
    uint64_t progress, rays; /* TICK: for the beats */
};

enum session_action_kind {
    SESSION_SEND,      /* bytes: a message */
    SESSION_LOAD,      /* job: its assets are complete (session_assets) */
    SESSION_START,     /* carry out order on job for lease */
    SESSION_CANCEL,    /* stop rendering for lease */
    SESSION_FORGET,    /* drop job and whatever is rendered for it */
    SESSION_RECONNECT, /* drop the connection and make a new one; what was sent on the old one may still leave */
    SESSION_SAY,       /* text: something the user should know */
    SESSION_EXIT,      /* end the program with exit_status */
};

struct session_action {
    enum session_action_kind kind;
    struct bytes bytes; /* SEND; the receiver frees */
    uint32_t job;
    uint64_t lease;
    struct order order;
    int exit_status;
    char text[1100];
};

struct session;

struct session *session_create(const struct session_config *config, int64_t now_ms);

/* Frees *session and sets it to NULL; *session may be NULL. */
void session_destroy(struct session **session);

/* Takes an event that happened at now_ms. What is to be done is then taken by session_take. */
void session_handle(struct session *session, const struct session_event *event, int64_t now_ms);

/* The next action, in order. False if there is none. */
bool session_take(struct session *session, struct session_action *action);

/* A message could not be sent for want of a connection: it counts as lost. */
void session_send_failed(struct session *session, int64_t now_ms);

/* When to send a SESSION_TICK at the latest. */
int64_t session_deadline(const struct session *session);

/* Copies what a job needs, complete when SESSION_LOAD says so: its settings, and its assets into an empty set.
 * Returns the scene's name in the set, borrowed from it. */
const char *session_assets(const struct session *session, uint32_t job, struct job_settings *settings,
                           struct asset_set *assets);

#endif
