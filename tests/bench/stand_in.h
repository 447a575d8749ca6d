/*
 * For benchmarks: stand-ins for workers, thousands in one process. Each has a real session (worker/session.h) on a
 * connection of its own, and fetches and holds what a worker would; but instead of rendering it answers a band at once
 * with rows of zeros, or never. Between wire_start and wire_stop.
 */
#ifndef WEFT_BENCH_STAND_IN_H
#define WEFT_BENCH_STAND_IN_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"
#include "image/encode.h"
#include "trace/proof.h"
#include "wire/rows.h"
#include "wire/socket.h"
#include "worker/session.h"

enum { STAND_IN_CREDIT = 2 }; /* as a worker with one thread */

struct stand_in {
    struct wire_client *client;
    struct session *session;
    bool loaded;    /* it has all that `job` needs */
    bool dismissed; /* the coordinator said goodbye */
    bool ended;
    uint32_t job;
};

/* All that play in one render. Its settings are those of every job, and its sampling is fixed: a survey of nothing
 * would not be believed. */
struct crowd {
    const char *endpoint, *keys; /* borrowed; keys: folder, or NULL */
    struct session_config config;
    bool ready;                  /* whoever has loaded a job says so; else only crowd_get_ready does */
    bool mute;                   /* no band is answered */
    struct stand_in *members;
    size_t count, loaded, ended;
    size_t bands;                /* asked for */
    uint64_t reconnections;      /* because a coordinator was not heard any more */
    struct bytes record;
};

static inline struct crowd crowd_of(size_t most, const char *endpoint, const char *keys)
{
    struct crowd crowd = {.endpoint = endpoint, .keys = keys, .members = memory_array(most, sizeof *crowd.members)};
    crowd.config = (struct session_config){.once = true, .keyed = keys, .wait_ms = -1};
    crowd.config.hello = (struct message){.kind = MESSAGE_HELLO, .hello = {
        .core_revision = proof_revision(), .proof = proof_render(kernel_default()), .host = "stand-in",
        .kernel = "none", .pid = (uint32_t)getpid(), .threads = 1, .credit = STAND_IN_CREDIT}};
    return crowd;
}

static inline void crowd_check(enum status status, const struct error *error)
{
    if (status == STATUS_OK)
        return;
    fprintf(stderr, "stand-in: %s\n", error->text);
    exit(status);
}

/* One more, at most as many as crowd_of was told. */
static inline void crowd_add(struct crowd *crowd)
{
    struct stand_in *member = &crowd->members[crowd->count++];
    struct worker_keys keys;
    struct error error;
    if (crowd->keys)
        crowd_check(worker_keys_read(&keys, crowd->keys, &error), &error);
    member->client = wire_client_create(crowd->endpoint, crowd->keys ? &keys : NULL, &error);
    crowd_check(member->client ? STATUS_OK : STATUS_FAILED, &error);
    member->session = session_create(&crowd->config, clock_now_ms());
}

static inline void crowd_finish(struct crowd *crowd)
{
    for (size_t i = 0; i < crowd->count; i++) {
        session_destroy(&crowd->members[i].session);
        wire_client_destroy(&crowd->members[i].client);
    }
    free(crowd->members);
    bytes_finish(&crowd->record);
}

/* --- what a member does ------------------------------------------------------------------------------------- */

/* The record of a row of such a job: one sample a pixel, black. */
static inline void crowd_note_job(struct crowd *crowd, const struct job_settings *settings)
{
    struct row_layout layout = row_layout_of(settings->width, pixel_format_bytes(settings->pixel_format),
                                             settings->maps);
    bytes_finish(&crowd->record);
    memset(bytes_extend(&crowd->record, row_record_bytes(&layout)), 0, row_record_bytes(&layout));
    row_figures_write(crowd->record.data, &(struct row_figures){.samples = settings->width,
                                                                .stages = {settings->width}});
}

static inline void stand_in_load(struct crowd *crowd, struct stand_in *member, uint32_t job)
{
    struct job_settings settings;
    struct asset_set assets = {0};
    session_assets(member->session, job, &settings, &assets);
    asset_set_finish(&assets);
    crowd_note_job(crowd, &settings);
    crowd->loaded += !member->loaded;
    member->loaded = true;
    member->job = job;
    if (crowd->ready)
        session_handle(member->session, &(struct session_event){.kind = SESSION_LOADED, .job = job}, clock_now_ms());
}

static inline void stand_in_answer(struct crowd *crowd, struct stand_in *member, const struct session_action *action)
{
    struct bytes records = {0};
    crowd->bands++;
    if (crowd->mute)
        return;
    for (uint32_t i = 0; i < action->order.rows; i++)
        bytes_put(&records, crowd->record.data, crowd->record.size);
    session_handle(member->session, &(struct session_event){.kind = SESSION_RENDERED, .lease = action->lease,
                                                            .records = &records}, clock_now_ms());
}

static inline void stand_in_act(struct crowd *crowd, struct stand_in *member, struct session_action *action)
{
    struct error error;
    switch (action->kind) {
    case SESSION_SEND:
        if (!wire_client_send(member->client, action->bytes.data, action->bytes.size))
            session_send_failed(member->session, clock_now_ms());
        bytes_finish(&action->bytes);
        break;
    case SESSION_LOAD:
        stand_in_load(crowd, member, action->job);
        break;
    case SESSION_START:
        stand_in_answer(crowd, member, action);
        break;
    case SESSION_RECONNECT:
        if (member->dismissed)
            break;
        crowd->reconnections++;
        crowd_check(wire_client_reconnect(member->client, &error), &error);
        break;
    case SESSION_EXIT:
        crowd->ended += !member->ended;
        member->ended = true;
        break;
    default:
        break;
    }
}

static inline void stand_in_handle(struct crowd *crowd, struct stand_in *member, const struct session_event *event)
{
    struct session_action action;
    session_handle(member->session, event, clock_now_ms());
    while (session_take(member->session, &action))
        stand_in_act(crowd, member, &action);
}

/* --- all together ------------------------------------------------------------------------------------------- */

/* All that a member has to do now. Returns whether it had a message. */
static inline bool stand_in_work(struct crowd *crowd, struct stand_in *member, struct bytes *data)
{
    bool busy = false;
    while (!member->ended && wire_client_receive(member->client, data)) {
        struct message message;
        struct error error;
        crowd_check(message_decode(&message, data->data, data->size, &error), &error);
        member->dismissed |= message.kind == MESSAGE_GOODBYE;
        stand_in_handle(crowd, member, &(struct session_event){.kind = SESSION_MESSAGE, .message = &message});
        busy = true;
    }
    if (!member->ended && clock_now_ms() >= session_deadline(member->session))
        stand_in_handle(crowd, member, &(struct session_event){.kind = SESSION_TICK});
    return busy;
}

/* Every member in turn does what it has to; waits a millisecond if none has anything. With thousands of sockets that
 * are busy this costs less than to ask the system again and again which of them are. */
static inline void crowd_work(struct crowd *crowd)
{
    struct bytes data = {0};
    bool busy = false;
    for (size_t i = 0; i < crowd->count; i++)
        busy |= stand_in_work(crowd, &crowd->members[i], &data);
    bytes_finish(&data);
    if (!busy)
        usleep(1000);
}

/* All say that they have loaded their job, and will as soon as they have loaded another. */
static inline void crowd_get_ready(struct crowd *crowd)
{
    crowd->ready = true;
    for (size_t i = 0; i < crowd->count; i++)
        if (crowd->members[i].loaded)
            stand_in_handle(crowd, &crowd->members[i], &(struct session_event){
                .kind = SESSION_LOADED, .job = crowd->members[i].job});
}

#endif
