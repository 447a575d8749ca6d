/* A session's conversation with coordinators: seeking one, joining it, what it says, and how that ends. */
#include <stdlib.h>

#include "base/memory.h"
#include "worker/session_private.h"

enum {
    REFUSED_PAUSE_MS = 10000, /* before asking again a coordinator that has no use for this worker */
    BROKEN_PAUSE_MS = 1000,   /* before asking again one that broke the protocol */
};

static void end(struct session *s, int exit_status)
{
    s->state = STATE_ENDED;
    session_act(s, SESSION_EXIT)->exit_status = exit_status;
}

/* --- seeking ---------------------------------------------------------------------------------------------- */

struct session *session_create(const struct session_config *config, int64_t now_ms)
{
    struct session *s = memory_array(1, sizeof *s);
    s->config = *config;
    s->seeking = seeking_begin(config->wait_ms, 0, now_ms);
    return s;
}

void session_destroy(struct session **pointer)
{
    struct session *s = *pointer;
    if (!s)
        return;
    session_forget_jobs(s);
    struct session_action action;
    while (session_take(s, &action))
        bytes_finish(&action.bytes);
    fetching_finish(&s->fetching);
    free(s->jobs);
    free(s->bands);
    free(s->actions);
    free(s);
    *pointer = NULL;
}

/* Makes no new connection: a coordinator that is still there would take one that breaks off at once for that of a
 * stranger. */
static void leave(struct session *s)
{
    session_forget_jobs(s);
    end(s, 0);
}

/* Looks for a coordinator, on a new connection, from pause_ms on; a worker that drains leaves instead. */
static void seek(struct session *s, int64_t pause_ms, int64_t now_ms)
{
    if (s->draining) {
        leave(s);
        return;
    }
    session_forget_jobs(s);
    session_act(s, SESSION_RECONNECT);
    s->state = STATE_SEEKING;
    s->epoch = 0;
    s->unfit = false;
    s->seeking = seeking_begin(s->config.wait_ms, pause_ms, now_ms);
}

/* The coordinator does not keep the protocol: its bytes cannot be trusted further. */
static void break_off(struct session *s, const char *reason, int64_t now_ms)
{
    session_say(s, "the coordinator broke the protocol (%s); starting anew", reason);
    seek(s, BROKEN_PAUSE_MS, now_ms);
}

void session_send_failed(struct session *s, int64_t now_ms)
{
    if (s->state == STATE_SEEKING) {
        seeking_retry(&s->seeking, now_ms);
    } else if (s->state == STATE_JOINED) {
        session_say(s, "lost the connection to the coordinator; looking for it again");
        seek(s, 0, now_ms);
    }
}

/* What else can be the matter when no coordinator is heard. */
static const char *doubt(const struct session *s)
{
    return s->config.keyed ? " (if there is one, its keys and this worker's may not match)" : "";
}

static void give_up(struct session *s)
{
    session_say(s, "no coordinator answered within %lld s%s", (long long)(s->config.wait_ms / 1000), doubt(s));
    end(s, STATUS_FAILED);
}

static void seek_on(struct session *s, int64_t now_ms)
{
    enum seeking_step step;
    while (s->state == STATE_SEEKING && (step = seeking_next(&s->seeking, now_ms)) != SEEKING_WAIT)
        if (step == SEEKING_HELLO)
            session_send(s, s->config.hello);
        else if (step == SEEKING_RENEW)
            session_act(s, SESSION_RECONNECT);
        else if (step == SEEKING_SAY)
            session_say(s, "waiting for a coordinator%s", doubt(s));
        else
            give_up(s);
}

/* --- events ----------------------------------------------------------------------------------------------- */

static void take_refusal(struct session *s, const struct message *message, int64_t now_ms)
{
    session_say(s, "the coordinator refused this worker: %s", message->refuse.reason);
    if (s->config.once)
        end(s, STATUS_FAILED);
    seeking_pause(&s->seeking, REFUSED_PAUSE_MS, now_ms);
}

/* A coordinator that ends stays until it hears the answer; then it is gone. One whose job this worker could not load
 * stays too, and would welcome it again at once, and again. */
static void take_goodbye(struct session *s, int64_t now_ms)
{
    session_send(s, (struct message){.kind = MESSAGE_GOODBYE});
    if (s->config.once)
        leave(s);
    else
        seek(s, s->unfit ? REFUSED_PAUSE_MS : 0, now_ms);
}

static void join(struct session *s, uint64_t epoch, int64_t now_ms)
{
    s->state = STATE_JOINED;
    s->epoch = epoch;
    s->beat_ms = now_ms;
    session_say(s, "joined a coordinator");
}

static void handle_joined_message(struct session *s, const struct message *message, int64_t now_ms)
{
    const char *broken = NULL;
    switch (message->kind) {
    case MESSAGE_JOB:
        broken = session_take_job(s, message);
        break;
    case MESSAGE_ASSET:
        broken = session_take_asset(s, message);
        break;
    case MESSAGE_BAND:
        broken = session_take_band(s, message);
        break;
    case MESSAGE_ACK:
        session_drop_band(s, message->ack.lease);
        break;
    case MESSAGE_REVOKE:
        session_drop_band(s, message->revoke.lease);
        session_act(s, SESSION_CANCEL)->lease = message->revoke.lease;
        break;
    case MESSAGE_END:
        session_end_job(s, message->end.job);
        break;
    case MESSAGE_REFUSE: /* the coordinator goes on without it, but not for ever: not even --once ends with this */
        session_say(s, "the coordinator gave this worker up (%s); joining anew", message->refuse.reason);
        seek(s, 0, now_ms);
        break;
    case MESSAGE_GOODBYE:
        take_goodbye(s, now_ms);
        break;
    default:
        break; /* beats, and what a coordinator has no business sending */
    }
    if (broken)
        break_off(s, broken, now_ms);
}

static void handle_message(struct session *s, const struct message *message, int64_t now_ms)
{
    if (s->state == STATE_SEEKING && message->kind == MESSAGE_REFUSE)
        take_refusal(s, message, now_ms);
    else if (s->state == STATE_SEEKING && message->kind == MESSAGE_WELCOME)
        join(s, message->epoch, now_ms);
    else if (s->state != STATE_JOINED || message->epoch != s->epoch)
        return;
    s->heard_ms = now_ms;
    if (message->kind != MESSAGE_WELCOME && s->state == STATE_JOINED)
        handle_joined_message(s, message, now_ms);
}

static void drain(struct session *s)
{
    s->draining = true;
    if (s->state == STATE_SEEKING)
        end(s, 0);
    else
        session_send(s, (struct message){.kind = MESSAGE_DRAIN});
}

static void keep_alive(struct session *s, int64_t now_ms)
{
    if (now_ms - s->heard_ms >= SESSION_SILENCE_MS) {
        session_say(s, "no word from the coordinator for %d s; looking for it again", SESSION_SILENCE_MS / 1000);
        seek(s, 0, now_ms);
        return;
    }
    if (now_ms >= s->beat_ms) {
        session_send(s, (struct message){.kind = MESSAGE_BEAT, .beat = {s->progress, s->rays}});
        s->beat_ms = now_ms + SESSION_BEAT_MS;
    }
}

void session_handle(struct session *s, const struct session_event *event, int64_t now_ms)
{
    if (s->state == STATE_ENDED) {
        if (event->kind == SESSION_RENDERED)
            bytes_finish(event->records);
        return;
    }
    switch (event->kind) {
    case SESSION_TICK:
        s->progress = event->progress;
        s->rays = event->rays;
        break;
    case SESSION_MESSAGE:
        handle_message(s, event->message, now_ms);
        break;
    case SESSION_LOADED:
    case SESSION_LOAD_FAILED:
        session_take_loaded(s, event);
        break;
    case SESSION_RENDERED:
        session_take_rendered(s, event);
        break;
    case SESSION_DRAIN:
        drain(s);
        break;
    }
    seek_on(s, now_ms);
    if (s->state == STATE_JOINED)
        keep_alive(s, now_ms);
    if (s->state == STATE_JOINED && s->draining && s->band_count == 0) {
        session_send(s, (struct message){.kind = MESSAGE_GOODBYE});
        end(s, 0);
    }
}

int64_t session_deadline(const struct session *s)
{
    if (s->state == STATE_ENDED)
        return INT64_MAX;
    if (s->state == STATE_SEEKING)
        return seeking_deadline(&s->seeking);
    return s->beat_ms < s->heard_ms + SESSION_SILENCE_MS ? s->beat_ms : s->heard_ms + SESSION_SILENCE_MS;
}
