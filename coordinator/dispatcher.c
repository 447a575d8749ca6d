#include "coordinator/dispatcher.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

enum { BEAT_MS = 1000 };

struct dispatcher *dispatcher_create(const struct dispatcher_config *config, int64_t now_ms)
{
    struct dispatcher *d = memory_array(1, sizeof *d);
    d->config = *config;
    d->now_ms = d->started_ms = d->beat_ms = now_ms;
    d->woke_ms = now_ms - DISPATCHER_SILENCE_MS;
    audit_init(&d->audit, config->audit_percent);
    d->scheduler = scheduler_create(&(struct scheduler_policy){
        .band_rows = config->band_rows, .silence_ms = DISPATCHER_SILENCE_MS,
        .newcomer_bands = DISPATCHER_NEWCOMER_BANDS,
        .audits = config->audit_percent > 0 ? audit_chooses : NULL, .audits_context = &d->audit,
        .expects = dispatcher_expected_work, .expects_context = d});
    return d;
}

void dispatcher_destroy(struct dispatcher **pointer)
{
    struct dispatcher *d = *pointer;
    if (!d)
        return;
    for (size_t i = 0; i < d->peer_count; i++)
        peer_finish(&d->peers[i]);
    peer_index_finish(&d->peers_by_address);
    machines_finish(&d->machines);
    scheduler_destroy(&d->scheduler);
    audit_finish(&d->audit);
    free(d->events);
    free(d->job_views);
    free(d->worker_views);
    free(d->stretch_views);
    for (size_t i = 0; i < d->job_count; i++)
        forecast_destroy(&d->forecasts[i]);
    free(d->forecasts);
    free(d->peers);
    free(d->writing);
    free(d->done);
    free(d->unreachable);
    free(d->expelled);
    free(d->jobs);
    free(d);
    *pointer = NULL;
}

bool dispatcher_has_slept(const struct dispatcher *d)
{
    return d->now_ms - d->woke_ms < DISPATCHER_SILENCE_MS;
}

/* Between the beginnings of calls there is a beat's time at most, unless one took long, or the process or its machine
 * was suspended. */
void dispatcher_note_time(struct dispatcher *d, int64_t now_ms)
{
    if (now_ms - d->now_ms >= DISPATCHER_SILENCE_MS)
        d->woke_ms = now_ms;
    d->now_ms = now_ms;
    dispatcher_lose_unreachable(d);
}

/* --- what happens ----------------------------------------------------------------------------------------- */

/* Workers refuse bands whose results would be larger. */
static uint32_t rows_most(const struct render_job *job)
{
    return (uint32_t)(MESSAGE_RESULT_MAX / render_job_result_bytes(job, PASS_RENDER, 1));
}

void dispatcher_add_job(struct dispatcher *d, struct render_job *job, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    d->jobs = memory_grow(d->jobs, &d->job_capacity, d->job_count + 1, sizeof(struct render_job *));
    d->forecasts = memory_grow(d->forecasts, &d->forecast_capacity, d->job_count + 1, sizeof(struct forecast *));
    d->forecasts[d->job_count] = NULL;
    d->jobs[d->job_count++] = job;
    dispatcher_tell(d, &(struct event){.kind = EVENT_JOB, .survey_rows = render_job_survey_rows(job),
                                       .rows = job->settings.height, .rows_most = rows_most(job), .kept = job->kept,
                                       .kept_count = job->kept_count}, NULL);
}

static void beat(struct dispatcher *d)
{
    if (d->now_ms < d->beat_ms)
        return;
    d->beat_ms = d->now_ms + BEAT_MS;
    for (size_t i = 0; i < d->peer_count; i++)
        dispatcher_send_peer(d, &d->peers[i], (struct message){.kind = MESSAGE_BEAT});
}

void dispatcher_tick(struct dispatcher *d, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    dispatcher_tell(d, &(struct event){.kind = EVENT_TICK, .slept = dispatcher_has_slept(d)}, NULL);
    beat(d);
    dispatcher_answer_askers(d);
}

int64_t dispatcher_deadline(const struct dispatcher *d)
{
    int64_t deadline_ms = scheduler_deadline(d->scheduler), due_ms = askers_due_ms(&d->askers);
    deadline_ms = due_ms < deadline_ms ? due_ms : deadline_ms;
    deadline_ms = d->unreachable_count > 0 ? d->now_ms + 1 : deadline_ms;
    return deadline_ms < d->beat_ms ? deadline_ms : d->beat_ms;
}

void dispatcher_lose_process(struct dispatcher *d, uint32_t pid, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    for (size_t i = 0; i < d->peer_count; i++)
        if (d->peers[i].address.own && d->peers[i].pid == pid)
            dispatcher_lose_peer(d, &d->peers[i], true);
}

bool dispatcher_take_expelled(struct dispatcher *d, uint32_t *pid)
{
    if (d->expelled_count == 0)
        return false;
    *pid = d->expelled[--d->expelled_count];
    return true;
}

bool dispatcher_take_need_of_trusted(struct dispatcher *d)
{
    bool needed = d->needs_trusted;
    d->needs_trusted = false;
    return needed;
}

/* --- the end ---------------------------------------------------------------------------------------------- */

void dispatcher_give_up(struct dispatcher *d, enum status status, const struct error *error, int64_t now_ms)
{
    d->status = status;
    d->error = *error;
    for (size_t i = 0; i < d->job_count; i++)
        if (render_job_is_open(d->jobs[i]))
            render_job_fail(d->jobs[i], now_ms);
}

static void end_job(struct dispatcher *d, struct render_job *job)
{
    struct error error;
    enum status status = render_job_complete(job, &error);
    if (status != STATUS_OK) {
        dispatcher_fail_job(d, job, status, &error);
        return;
    }
    job->state = JOB_DONE;
    d->done = memory_grow(d->done, &d->done_capacity, d->done_count + 1, sizeof(struct render_job *));
    d->done[d->done_count++] = job;
}

void dispatcher_take_written(struct dispatcher *d)
{
    size_t left = 0;
    for (size_t i = 0; i < d->writing_count && d->status == STATUS_OK; i++) {
        struct render_job *job = d->writing[i];
        if (d->config.bell >= 0 && !render_job_output_is_finished(job))
            d->writing[left++] = job;
        else
            end_job(d, job);
    }
    d->writing_count = left;
}

void dispatcher_finish_written(struct dispatcher *d)
{
    for (size_t i = 0; i < d->writing_count && d->status == STATUS_OK; i++)
        if (render_job_output_is_written(d->writing[i]))
            end_job(d, d->writing[i]);
    d->writing_count = 0;
}

const struct render_job *dispatcher_take_done(struct dispatcher *d, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    dispatcher_take_written(d);
    if (d->done_at == d->done_count)
        return NULL;
    struct render_job *job = d->done[d->done_at++];
    job->ended_ms = now_ms;
    return job;
}

bool dispatcher_is_over(const struct dispatcher *d)
{
    return d->done_count == d->job_count || d->status != STATUS_OK;
}

enum status dispatcher_status(const struct dispatcher *d, struct error *error)
{
    bool doubtful = d->status == STATUS_OK && d->doubtful.text[0];
    *error = doubtful ? d->doubtful : d->error;
    return doubtful ? STATUS_FAILED : d->status;
}

void dispatcher_say_goodbye(struct dispatcher *d, int64_t now_ms)
{
    dispatcher_note_time(d, now_ms);
    for (size_t i = 0; i < d->peer_count; i++)
        dispatcher_send_peer(d, &d->peers[i], (struct message){.kind = MESSAGE_GOODBYE});
    d->ending = true;
    dispatcher_answer_askers(d);
}

size_t dispatcher_present(const struct dispatcher *d)
{
    size_t present = askers_watching(&d->askers, d->now_ms);
    for (size_t i = 0; i < d->peer_count; i++)
        present += !d->peers[i].gone;
    return present;
}
