/* What the scheduler decides, carried out. */
#include <assert.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

/* --- sending ---------------------------------------------------------------------------------------------- */

bool dispatcher_send_to(struct dispatcher *d, const struct wire_peer *address, const struct message *message)
{
    struct bytes bytes = {0};
    message_encode(message, &bytes);
    bool sent = d->config.send(d->config.context, address, bytes.data, bytes.size);
    bytes_finish(&bytes);
    return sent;
}

void dispatcher_send_peer(struct dispatcher *d, struct peer *peer, struct message message)
{
    message.epoch = peer->epoch;
    if (peer->gone || dispatcher_send_to(d, &peer->address, &message))
        return;
    dispatcher_let_go(d, peer);
    d->unreachable = memory_grow(d->unreachable, &d->unreachable_capacity, d->unreachable_count + 1,
                                 sizeof *d->unreachable);
    d->unreachable[d->unreachable_count++] = peer->number;
}

static void tell_loss(struct dispatcher *d, struct peer *peer, bool by_fault)
{
    if (by_fault) {
        dispatcher_tell_of_peer(d, peer, LINE_TROUBLE, "is lost");
        dispatcher_note_trouble(d, peer, TROUBLE_LOST, false);
    }
    dispatcher_tell(d, &(struct event){.kind = by_fault ? EVENT_LOST : EVENT_LEAVE, .worker = peer->number}, NULL);
}

void dispatcher_lose_peer(struct dispatcher *d, struct peer *peer, bool by_fault)
{
    if (peer->gone)
        return;
    dispatcher_let_go(d, peer);
    tell_loss(d, peer, by_fault);
}

/* A worker leaves a coordinator that stands still for so long that it seems dead. */
void dispatcher_lose_unreachable(struct dispatcher *d)
{
    size_t count = d->unreachable_count;
    if (count == 0)
        return;
    for (size_t i = 0; i < count; i++) {
        struct peer *peer = dispatcher_peer(d, d->unreachable[i]);
        if (dispatcher_has_slept(d))
            dispatcher_tell_of_peer(d, peer, LINE_COMING, "left while this process stood still");
        tell_loss(d, peer, !dispatcher_has_slept(d));
    }
    d->unreachable_count -= count; /* the last ones have become so just now */
    memmove(d->unreachable, d->unreachable + count, d->unreachable_count * sizeof *d->unreachable);
}

struct peer *dispatcher_peer(struct dispatcher *d, uint32_t number)
{
    return &d->peers[number - 1];
}

/* --- who is gone ------------------------------------------------------------------------------------------ */

/* Workers of this process's own are few, and each counts (coordinator/scheduler.h). */
void dispatcher_let_go(struct dispatcher *d, struct peer *peer)
{
    struct machine *machine = machines_find(&d->machines, peer->machine);
    peer->gone = true;
    peer_finish(peer);
    if (peer->bands_done > 0 || peer->address.own)
        return;
    if (machine->spares++ == 0)
        machine->first_spare = peer->number;
    else
        d->peers[machine->last_spare - 1].next_spare = peer->number;
    machine->last_spare = peer->number;
}

void dispatcher_note_trouble(struct dispatcher *d, struct peer *peer, enum worker_trouble trouble, bool failed)
{
    peer->trouble = trouble;
    machine_note_trouble(machines_find(&d->machines, peer->machine), peer->host, peer->pid, peer->address.own, trouble,
                         failed);
}

void dispatcher_tell_of(struct dispatcher *d, uint32_t number, enum machine_line kind, const char *format, ...)
{
    struct machine *machine = machines_find(&d->machines, number);
    char text[MESSAGE_REASON_BYTES + MESSAGE_HOST_BYTES + 128], more[64] = "";
    uint64_t passed_over;
    va_list arguments;
    if (!machine || !machine_may_tell(machine, kind, d->now_ms, &passed_over))
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (passed_over > 0)
        snprintf(more, sizeof more, " (and %" PRIu64 " more like that from its machine)", passed_over);
    if (kind == LINE_COMING)
        log_info("%s%s", text, more);
    else
        log_warning("%s%s", text, more);
}

void dispatcher_tell_of_peer(struct dispatcher *d, const struct peer *peer, enum machine_line kind,
                             const char *format, ...)
{
    char name[PEER_NAME_BYTES], text[MESSAGE_REASON_BYTES + 64];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    dispatcher_tell_of(d, peer->machine, kind, "%s %s", peer_name(peer, name), text);
}

/* --- carrying out the scheduler's actions ----------------------------------------------------------------- */

void dispatcher_fail_job(struct dispatcher *d, struct render_job *job, enum status status, const struct error *error)
{
    render_job_fail(job, d->now_ms);
    if (d->status != STATUS_OK)
        return;
    d->status = status;
    d->error = *error;
}

/* What an honest worker asks for, and as much again. */
static uint64_t asset_allowance(const struct render_job *job)
{
    uint64_t bytes = job->manifest.size;
    for (size_t i = 0; i < job->assets.count; i++)
        bytes += job->assets.assets[i].bytes.size;
    return 2 * bytes;
}

static void announce(struct dispatcher *d, const struct action *action)
{
    const struct render_job *job = d->jobs[action->job];
    dispatcher_peer(d, action->worker)->asset_allowance += asset_allowance(job);
    dispatcher_send_peer(d, dispatcher_peer(d, action->worker), (struct message){.kind = MESSAGE_JOB, .job = {
        .job = action->job, .manifest = job->manifest_digest, .manifest_bytes = job->manifest.size,
        .settings = job->settings}});
}

/* With its first band, of a survey or of a render without one; or when an earlier run has left nothing to do. */
static void start_job(struct dispatcher *d, uint32_t number, enum render_pass pass)
{
    struct render_job *job = d->jobs[number];
    if (job->state != JOB_WAITING)
        return;
    job->state = pass == PASS_SURVEY ? JOB_SURVEYING : JOB_RUNNING;
    job->started_ms = job->render_ms = d->now_ms;
    dispatcher_begin_forecast(d, number);
}

static void grant(struct dispatcher *d, const struct action *action)
{
    struct render_job *job = d->jobs[action->job];
    const struct sampling *sampling = action->pass == PASS_SURVEY ? &job->surveying : &job->sampling;
    struct peer *peer = dispatcher_peer(d, action->worker);
    start_job(d, action->job, action->pass);
    if (!peer->gone) /* as an action just before this one has shown */
        peer_give_band(peer, &(struct held_band){action->lease, action->job, action->pass, action->first_row,
                                                 action->rows}, d->now_ms);
    dispatcher_send_peer(d, peer, (struct message){.kind = MESSAGE_BAND, .band = {
        .job = action->job, .lease = action->lease, .pass = action->pass, .first_row = action->first_row,
        .rows = action->rows, .sampling = {sampling->least, sampling->most, sampling->threshold}}});
}

static void end_survey(struct dispatcher *d, const struct action *action)
{
    struct render_job *job = d->jobs[action->job];
    if (d->status != STATUS_OK)
        return;
    start_job(d, action->job, PASS_RENDER);
    render_job_end_survey(job);
    dispatcher_tell_forecast_of_survey(d, action->job);
    job->state = JOB_RUNNING;
    job->render_ms = d->now_ms;
    log_debug("%s: surveyed; %" PRIu32 " to %" PRIu32 " samples a pixel, threshold %" PRIu32, job->scene_path,
              job->sampling.least, job->sampling.most, job->sampling.threshold);
}

static void accept_result(struct dispatcher *d, const struct action *action, const uint8_t *result)
{
    struct render_job *job = d->jobs[action->job];
    const struct band_account account = {.first_row = action->first_row, .rows = action->rows,
                                         .worker = action->worker, .lease_ms = action->lease_ms};
    struct error error;
    double work = peer_answer_band(dispatcher_peer(d, action->worker), action->job, action->pass, action->first_row,
                                   d->now_ms);
    enum status status = render_job_take(job, action->pass, account, result, &error);
    if (status != STATUS_OK)
        dispatcher_fail_job(d, job, status, &error);
    else
        dispatcher_add_to_forecast(d, action, work);
}

static void complete_job(struct dispatcher *d, const struct action *action)
{
    struct render_job *job = d->jobs[action->job];
    if (d->status != STATUS_OK)
        return;
    start_job(d, action->job, PASS_RENDER);
    forecast_destroy(&d->forecasts[action->job]);
    render_job_finish_output(job, d->config.bell);
    d->writing = memory_grow(d->writing, &d->writing_capacity, d->writing_count + 1, sizeof(struct render_job *));
    d->writing[d->writing_count++] = job;
    if (d->config.bell < 0)
        dispatcher_take_written(d);
}

static void give_up(struct dispatcher *d, const struct action *action)
{
    static_assert(SCHEDULER_LOSSES_MAX == 3, "the sentence names three");
    struct render_job *job = d->jobs[action->job];
    char lost[SCHEDULER_LOSSES_MAX][PEER_NAME_BYTES], rows[ROWS_NAME_BYTES];
    struct error error;
    for (int i = 0; i < SCHEDULER_LOSSES_MAX; i++)
        peer_name(dispatcher_peer(d, action->lost_by[i]), lost[i]);
    error_set(&error, STATUS_FAILED, "%s: %s cost %s, %s and %s their lives; giving up", job->scene_path,
              render_job_rows_name(action->pass, action->first_row, action->rows, rows), lost[0], lost[1], lost[2]);
    dispatcher_fail_job(d, job, STATUS_FAILED, &error);
}

static void expel(struct dispatcher *d, const struct action *action)
{
    struct peer *peer = dispatcher_peer(d, action->worker);
    if (peer->gone) /* as an action just before this one has shown */
        return;
    const char *why = action->liar ? "returned wrong bytes"
                    : action->stuck ? "has not got on for too long" : "has been silent too long";
    struct message refusal = {.kind = MESSAGE_REFUSE, .epoch = peer->epoch};
    snprintf(refusal.refuse.reason, sizeof refusal.refuse.reason, "it %s", why);
    if (!action->liar) /* of which more has been said */
        dispatcher_tell_of_peer(d, peer, LINE_TROUBLE, "%s; its bands go to others", why);
    dispatcher_send_to(d, &peer->address, &refusal);
    dispatcher_let_go(d, peer);
    dispatcher_note_trouble(d, peer, action->liar ? TROUBLE_LIAR : action->stuck ? TROUBLE_STUCK : TROUBLE_SILENT,
                            action->stuck);
    if (!peer->address.own) /* whatever host and process it says that it is */
        return;
    d->expelled = memory_grow(d->expelled, &d->expelled_capacity, d->expelled_count + 1, sizeof *d->expelled);
    d->expelled[d->expelled_count++] = peer->pid;
}

static void ask_for_trusted(struct dispatcher *d, const struct action *action)
{
    char rows[ROWS_NAME_BYTES];
    d->needs_trusted = true;
    if (action->rows == 0)
        log_info("starting a local worker, to tell whose bytes are right");
    else
        log_warning("%s: %s were lost %d times with workers of the same machines; starting a local worker to try them",
                    d->jobs[action->job]->scene_path,
                    render_job_rows_name(action->pass, action->first_row, action->rows, rows), SCHEDULER_LOSSES_MAX);
}

static void carry_out(struct dispatcher *d, const struct action *action, const uint8_t *result)
{
    switch (action->kind) {
    case ACTION_ANNOUNCE:
        announce(d, action);
        break;
    case ACTION_GRANT:
        grant(d, action);
        break;
    case ACTION_ACCEPT:
        accept_result(d, action, result);
        break;
    case ACTION_ACK:
        dispatcher_send_peer(d, dispatcher_peer(d, action->worker),
                  (struct message){.kind = MESSAGE_ACK, .ack = {action->lease}});
        break;
    case ACTION_REVOKE:
        peer_drop(dispatcher_peer(d, action->worker), action->lease);
        peer_revoke_band(dispatcher_peer(d, action->worker), action->lease, d->now_ms);
        dispatcher_send_peer(d, dispatcher_peer(d, action->worker),
                  (struct message){.kind = MESSAGE_REVOKE, .revoke = {action->lease}});
        break;
    case ACTION_END:
        dispatcher_send_peer(d, dispatcher_peer(d, action->worker),
                  (struct message){.kind = MESSAGE_END, .end = {action->job}});
        break;
    case ACTION_EXPEL:
        expel(d, action);
        break;
    case ACTION_SURVEYED:
        end_survey(d, action);
        break;
    case ACTION_DONE:
        complete_job(d, action);
        break;
    case ACTION_FAIL:
        give_up(d, action);
        break;
    case ACTION_AUDITED:
        dispatcher_audit(d, action, result);
        break;
    case ACTION_UNDO:
        dispatcher_undo(d, action);
        break;
    case ACTION_RESTART:
        dispatcher_restart(d, action);
        break;
    case ACTION_NEED_TRUSTED:
        ask_for_trusted(d, action);
        break;
    }
}

static void answer(struct dispatcher *d, const struct event *event, const uint8_t *result)
{
    struct action_list actions = {0};
    scheduler_handle(d->scheduler, event, d->now_ms, &actions);
    for (size_t i = 0; i < actions.count; i++)
        carry_out(d, &actions.items[i], result);
    dispatcher_end_undoing(d);
    free(actions.items);
}

/* A peer that turns out to be lost while actions are carried out leads to another event. It waits until they all are:
 * the scheduler's answer to it may build on them, as the bands of a render do on the end of its survey. */
void dispatcher_tell(struct dispatcher *d, const struct event *event, const uint8_t *result)
{
    if (d->ending)
        return;
    if (d->answering) {
        d->events = memory_grow(d->events, &d->event_capacity, d->event_count + 1, sizeof *d->events);
        d->events[d->event_count++] = *event;
        return;
    }
    d->answering = true;
    answer(d, event, result);
    for (size_t i = 0; i < d->event_count; i++) { /* to which its answer may add */
        struct event next = d->events[i];
        answer(d, &next, NULL);
    }
    d->event_count = 0;
    d->answering = false;
}
