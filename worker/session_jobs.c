/* A session's jobs, from their announcement to their end, and the bands that the worker holds of them. */
#include <assert.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "worker/session_private.h"

/* --- jobs ------------------------------------------------------------------------------------------------- */

static struct session_job *find_job(const struct session *s, uint32_t number)
{
    for (size_t i = 0; i < s->job_count; i++)
        if (s->jobs[i].number == number)
            return &s->jobs[i];
    return NULL;
}

static void forget_job(struct session *s, size_t index)
{
    struct session_job *job = &s->jobs[index];
    session_drop_actions(s, job->number);
    session_act(s, SESSION_FORGET)->job = job->number;
    for (size_t i = s->band_count; i-- > 0;) {
        if (s->bands[i].job != job->number)
            continue;
        bytes_finish(&s->bands[i].records);
        s->bands[i] = s->bands[--s->band_count];
    }
    fetching_remove(&s->fetching, job->number);
    s->job_count--;
    for (struct session_job *to = job; to < s->jobs + s->job_count; to++) /* keeps the order */
        *to = to[1];
}

void session_forget_jobs(struct session *s)
{
    while (s->job_count > 0)
        forget_job(s, s->job_count - 1);
}

static void fail_job(struct session *s, struct session_job *job, const char *reason)
{
    struct message message = {.kind = MESSAGE_FAILED, .failed = {.job = job->number}};
    snprintf(message.failed.reason, sizeof message.failed.reason, "%s", reason);
    job->state = JOB_UNUSABLE;
    s->unfit = true;
    session_send(s, message);
    session_say(s, "cannot work on job %u: %s", job->number, reason);
}

/* Has loaded what is complete, and asks for what is not. */
static void fetch_on(struct session *s)
{
    struct fetching_step step;
    while (fetching_next(&s->fetching, &step))
        if (step.kind == FETCHING_NEED) {
            session_send(s, (struct message){.kind = MESSAGE_NEED,
                                             .need = {.digest = step.digest, .offset = step.offset}});
        } else if (step.kind == FETCHING_COMPLETE) {
            find_job(s, step.job)->state = JOB_LOADING;
            session_act(s, SESSION_LOAD)->job = step.job;
        } else {
            fail_job(s, find_job(s, step.job), step.error.text);
        }
}

const char *session_take_job(struct session *s, const struct message *message)
{
    if (find_job(s, message->job.job))
        return "a job was announced twice";
    s->jobs = memory_grow(s->jobs, &s->job_capacity, s->job_count + 1, sizeof *s->jobs);
    s->jobs[s->job_count++] = (struct session_job){.number = message->job.job, .settings = message->job.settings};
    fetching_add(&s->fetching, message->job.job, &message->job.manifest, message->job.manifest_bytes);
    fetch_on(s);
    return NULL;
}

const char *session_take_asset(struct session *s, const struct message *message)
{
    const char *broken = fetching_take(&s->fetching, message);
    if (!broken)
        fetch_on(s);
    return broken;
}

const char *session_assets(const struct session *s, uint32_t number, struct job_settings *settings,
                           struct asset_set *assets)
{
    const struct session_job *job = find_job(s, number);
    assert(job);
    *settings = job->settings;
    return fetching_copy(&s->fetching, number, assets);
}

void session_take_loaded(struct session *s, const struct session_event *event)
{
    struct session_job *job = find_job(s, event->job);
    if (!job || job->state != JOB_LOADING)
        return;
    if (event->kind == SESSION_LOAD_FAILED) {
        fail_job(s, job, event->reason);
        return;
    }
    job->state = JOB_READY;
    session_send(s, (struct message){.kind = MESSAGE_READY, .ready = {.job = job->number}});
}

void session_end_job(struct session *s, uint32_t number)
{
    struct session_job *job = find_job(s, number);
    if (!job)
        return;
    forget_job(s, (size_t)(job - s->jobs));
    fetch_on(s);
}

/* --- bands ------------------------------------------------------------------------------------------------ */

static struct held_band *find_band(const struct session *s, uint64_t lease)
{
    for (size_t i = 0; i < s->band_count; i++)
        if (s->bands[i].lease == lease)
            return &s->bands[i];
    return NULL;
}

void session_drop_band(struct session *s, uint64_t lease)
{
    struct held_band *band = find_band(s, lease);
    if (!band)
        return;
    bytes_finish(&band->records);
    *band = s->bands[--s->band_count];
}

const char *session_take_band(struct session *s, const struct message *message)
{
    const struct session_job *job = find_job(s, message->band.job);
    struct order order = order_of(message);
    bool fits = job && job->state == JOB_READY && order_fits(&order, &job->settings);
    if (!fits || find_band(s, message->band.lease))
        return "a band that is not of a ready job";
    if (s->band_count == s->config.hello.hello.credit)
        return "more bands than this worker can take";
    s->bands = memory_grow(s->bands, &s->band_capacity, s->band_count + 1, sizeof *s->bands);
    s->bands[s->band_count++] = (struct held_band){.lease = message->band.lease, .job = message->band.job};
    struct session_action *action = session_act(s, SESSION_START);
    action->job = message->band.job;
    action->lease = message->band.lease;
    action->order = order;
    return NULL;
}

void session_take_rendered(struct session *s, const struct session_event *event)
{
    struct held_band *band = find_band(s, event->lease);
    if (!band || band->records.data) { /* revoked meanwhile, and perhaps given anew with the same lease */
        bytes_finish(event->records);
        return;
    }
    band->records = *event->records;
    *event->records = (struct bytes){0};
    for (size_t offset = 0; offset < band->records.size; offset += MESSAGE_CHUNK_MAX) {
        size_t left = band->records.size - offset;
        session_send(s, (struct message){.kind = MESSAGE_RESULT, .result = {
            .job = band->job, .lease = band->lease, .offset = offset, .total = band->records.size,
            .data = band->records.data + offset,
            .size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX)}});
    }
}
