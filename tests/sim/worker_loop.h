/*
 * Workers for whole farms, on a virtual clock: real sessions, each in a loop as in worker/main.c, over the network of
 * network.h.
 */
#ifndef WEFT_TESTS_WORKER_LOOP_H
#define WEFT_TESTS_WORKER_LOOP_H

#include "tests/sim/worker.h"

/* --- carrying out the session's actions ------------------------------------------------------------------- */

static void carry_out(struct worker *w, struct session_action *action)
{
    struct message message;
    struct error error;
    switch (action->kind) {
    case SESSION_SEND:
        if (message_decode(&message, action->bytes.data, action->bytes.size, &error) != STATUS_OK)
            require(false, "worker %u: %s", w->number, error.text);
        w->said = message.kind;
        if (w->liar && message.kind == MESSAGE_RESULT) {
            w->told.size = 0;
            bytes_put(&w->told, action->bytes.data, action->bytes.size);
        }
        if (!network_send_up(w->link, action->bytes.data, action->bytes.size))
            session_send_failed(w->session, history.now_ms);
        bytes_finish(&action->bytes);
        break;
    case SESSION_LOAD:
        load(w, action->job);
        break;
    case SESSION_START:
        start_band(w, action);
        break;
    case SESSION_CANCEL:
        cancel_band(w, action->lease);
        break;
    case SESSION_FORGET:
        forget_job(w, action->job);
        break;
    case SESSION_RECONNECT:
        reconnect(w);
        break;
    case SESSION_SAY:
        break;
    case SESSION_EXIT:
        w->exited = true;
        break;
    }
}

static void handle(struct worker *w, struct session_event event)
{
    struct session_action action;
    session_handle(w->session, &event, history.now_ms);
    while (session_take(w->session, &action))
        carry_out(w, &action);
}

/* --- a turn of its loop ----------------------------------------------------------------------------------- */

static void take_loaded(struct worker *w)
{
    for (uint32_t i = 0; i < w->job_count; i++) {
        struct pool_job *job = &w->jobs[i];
        if (job->loaded_ms > history.now_ms)
            continue;
        job->loaded_ms = INT64_MAX;
        handle(w, (struct session_event){.kind = w->unfit ? SESSION_LOAD_FAILED : SESSION_LOADED, .job = job->number,
                                         .reason = "it has no memory left"});
        return take_loaded(w); /* the jobs may be others now */
    }
}

/* A senseless answer that would be huge is never done. */
static void take_rendered(struct worker *w)
{
    while (w->band_count > 0 && w->bands[0].done_ms <= history.now_ms) {
        struct pool_band band = w->bands[0];
        bool sound;
        drop_band(w, 0);
        if ((uint64_t)band.order.rows * band.job->settings.width > SENSELESS_BYTES_MAX / 16)
            continue;
        require(!is_honest(w) || owes(w, band.lease), "worker %u renders what nobody wants any more", w->number);
        struct bytes records = picture_answer(band.job->picture, &band.job->settings, &band.order, &sound);
        require(sound || farm.altered, "worker %u was told to render other rows than the picture's", w->number);
        w->rays += records.size;
        if (w->crooked && chance(30))
            records.data[draw(0, (uint32_t)records.size - 1)] ^= (uint8_t)(1 << draw(0, 7));
        handle(w, (struct session_event){.kind = SESSION_RENDERED, .lease = band.lease, .records = &records});
    }
}

static void overhear(struct worker *w, const struct message *message)
{
    if (message->kind == MESSAGE_WELCOME) {
        w->joined = !network.links[w->link].cut; /* or it is the word of one that has died since */
        w->epoch = message->epoch;
    }
    if (message->kind == MESSAGE_BAND)
        owe(w, message);
    if (message->kind == MESSAGE_ACK)
        settle(w, message->ack.lease);
    if (message->kind == MESSAGE_REVOKE)
        settle(w, message->revoke.lease);
    if (message->kind == MESSAGE_END)
        check_settled(w, message->end.job);
    if (message->kind == MESSAGE_GOODBYE && message->epoch == w->epoch)
        part(w);
}

static void take_messages(struct worker *w)
{
    struct packet packet;
    size_t link = w->link;
    while (!w->exited && link != NO_LINK && w->link == link && pipe_take(&network.links[link].down, &packet)) {
        struct message message;
        struct error error;
        if (message_decode(&message, packet.bytes.data, packet.bytes.size, &error) == STATUS_OK) {
            farm.altered |= packet.altered && decides_pixels(message.kind);
            overhear(w, &message);
            handle(w, (struct session_event){.kind = SESSION_MESSAGE, .message = &message});
        }
        bytes_finish(&packet.bytes);
    }
}

/* When it has to do something even if it hears nothing. */
static int64_t next_turn_ms(const struct worker *w)
{
    int64_t next_ms = session_deadline(w->session);
    if (w->band_count > 0 && w->bands[0].done_ms < next_ms)
        next_ms = w->bands[0].done_ms;
    for (uint32_t i = 0; i < w->job_count; i++)
        next_ms = w->jobs[i].loaded_ms < next_ms ? w->jobs[i].loaded_ms : next_ms;
    return next_ms;
}

static void end_worker(struct worker *w)
{
    session_destroy(&w->session);
    w->job_count = 0;
    w->band_count = w->owed_count = 0;
    w->socket++;
    bytes_finish(&w->told);
    if (w->link != NO_LINK)
        network_close(w->link);
    w->link = NO_LINK;
}

static void worker_turn(struct worker *w)
{
    if (!w->session || w->stopped)
        return;
    notice_cut(w);
    take_loaded(w);
    take_rendered(w);
    take_messages(w);
    w->batches += w->band_count > 0 && w->bands[0].done_ms < INT64_MAX;
    handle(w, (struct session_event){.kind = SESSION_TICK, .rays = w->rays, .progress = w->batches});
    if (w->exited) {
        if (w->said != MESSAGE_GOODBYE)
            part(w);
        require(!is_honest(w) || !w->joined || w->owed_count == 0, "worker %u ends with bands in hand", w->number);
        end_worker(w);
        return;
    }
    int64_t next_ms = next_turn_ms(w);
    next_ms = next_ms > history.now_ms ? next_ms : history.now_ms;
    if (next_ms >= w->turn_ms && w->turn_ms > history.now_ms)
        return;
    w->turn_ms = next_ms;
    happen(WORKER_TURN, w->number, 0, next_ms);
}

/* --- what happens to it ----------------------------------------------------------------------------------- */

static void connection_is_made(struct worker *w, uint32_t socket)
{
    if (!w->session || socket != w->socket || w->link != NO_LINK)
        return;
    if (!farm.up || w->stopped) {
        happen(CONNECTION, w->number, socket, history.now_ms + 200);
        return;
    }
    if (history.now_ms < w->unreachable_ms) {
        happen(CONNECTION, w->number, socket, w->unreachable_ms);
        return;
    }
    w->link = network_open(w->number, w->low_ms, w->high_ms, w->evil);
    network.links[w->link].own = w->own;
    network.links[w->link].machine = w->host;
    worker_turn(w);
}

static void start_worker(struct worker *w)
{
    struct session_config config = {.once = w->once, .wait_ms = -1};
    config.hello = (struct message){.kind = MESSAGE_HELLO, .hello = {
        .core_revision = {{w->stranger}}, .kernel = "ref", .pid = w->pid, .threads = w->threads, .credit = w->credit}};
    if (w->session)
        return;
    bool honest = is_honest(w) && !w->crooked; /* others borrow names */
    snprintf(config.hello.hello.host, sizeof config.hello.hello.host, "host%u", honest ? w->host : draw(0, 15));
    w->stopped = w->draining = w->exited = false;
    w->busy_ms = 0;
    w->rays = draw(0, 1000);
    w->session = session_create(&config, history.now_ms);
    look_for_coordinator(w);
    worker_turn(w);
}

static void stop_worker(struct worker *w, int64_t until_ms)
{
    if (!w->session || w->stopped)
        return;
    w->stopped = true;
    w->stopped_ms = history.now_ms;
    happen(CONTINUE, w->number, 0, until_ms);
}

/* Its threads stood still as well. */
static void continue_worker(struct worker *w)
{
    int64_t ms = history.now_ms - w->stopped_ms;
    if (!w->session || !w->stopped)
        return;
    w->stopped = false;
    for (size_t i = 0; i < w->band_count; i++)
        w->bands[i].done_ms += w->bands[i].done_ms == INT64_MAX ? 0 : ms;
    w->busy_ms += ms;
    worker_turn(w);
}

static void drain_worker(struct worker *w)
{
    if (!w->session || w->stopped)
        return;
    w->draining = true;
    handle(w, (struct session_event){.kind = SESSION_DRAIN});
    worker_turn(w);
}

#endif
