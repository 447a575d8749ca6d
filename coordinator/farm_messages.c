#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sodium.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "coordinator/farm_private.h"

/* --- sending ---------------------------------------------------------------------------------------------- */

static bool send_to(struct farm *farm, const struct wire_peer *address, const struct message *message)
{
    struct bytes bytes = {0};
    message_encode(message, &bytes);
    bool sent = wire_server_send(farm->server, address, bytes.data, bytes.size);
    bytes_finish(&bytes);
    return sent;
}

void farm_send(struct farm *farm, struct peer *peer, struct message message)
{
    message.epoch = peer->epoch;
    if (!peer->gone && !send_to(farm, &peer->address, &message))
        farm_lose_peer(farm, peer, true);
}

void farm_lose_peer(struct farm *farm, struct peer *peer, bool by_fault)
{
    if (peer->gone)
        return;
    peer->gone = true;
    peer_finish(peer);
    if (by_fault)
        log_warning("worker %u (%s, process %u) is lost", peer->number, peer->host, peer->pid);
    farm_tell(farm, &(struct event){.kind = by_fault ? EVENT_LOST : EVENT_LEAVE, .worker = peer->number}, NULL);
}

static struct peer *peer_numbered(struct farm *farm, uint32_t number)
{
    return &farm->peers[number - 1];
}

/* --- carrying out the scheduler's actions ----------------------------------------------------------------- */

static void fail_job(struct farm *farm, struct render_job *job, enum status status, const struct error *error)
{
    render_job_fail(job);
    if (farm->status != STATUS_OK)
        return;
    farm->status = status;
    farm->error = *error;
}

static void announce(struct farm *farm, const struct action *action)
{
    const struct render_job *job = farm->jobs[action->job];
    farm_send(farm, peer_numbered(farm, action->worker), (struct message){.kind = MESSAGE_JOB, .job = {
        .job = action->job, .manifest = job->manifest_digest, .manifest_bytes = job->manifest.size,
        .settings = job->settings}});
}

/* Its first band, of a survey or of a render without one. */
static void start_job(struct render_job *job, enum render_pass pass)
{
    if (job->state != JOB_WAITING)
        return;
    job->state = pass == PASS_SURVEY ? JOB_SURVEYING : JOB_RUNNING;
    job->started_ms = job->render_ms = clock_now_ms();
}

static void grant(struct farm *farm, const struct action *action)
{
    struct render_job *job = farm->jobs[action->job];
    const struct sampling *sampling = action->pass == PASS_SURVEY ? &job->surveying : &job->sampling;
    start_job(job, action->pass);
    farm_send(farm, peer_numbered(farm, action->worker), (struct message){.kind = MESSAGE_BAND, .band = {
        .job = action->job, .lease = action->lease, .pass = action->pass, .first_row = action->first_row,
        .rows = action->rows, .sampling = {sampling->least, sampling->most, sampling->threshold}}});
}

static void end_survey(struct farm *farm, const struct action *action)
{
    struct render_job *job = farm->jobs[action->job];
    render_job_end_survey(job);
    job->state = JOB_RUNNING;
    job->render_ms = clock_now_ms();
    log_debug("%s: surveyed; %" PRIu32 " to %" PRIu32 " samples a pixel, threshold %" PRIu32, job->scene_path,
              job->sampling.least, job->sampling.most, job->sampling.threshold);
}

static void accept_result(struct farm *farm, const struct action *action, const uint8_t *result)
{
    struct render_job *job = farm->jobs[action->job];
    struct error error;
    if (action->pass == PASS_SURVEY) {
        render_job_take_survey(job, result);
        return;
    }
    enum status status = render_job_take_band(job, (struct band_account){
        .first_row = action->first_row, .rows = action->rows, .worker = action->worker,
        .lease_ms = action->lease_ms}, result, &error);
    if (status != STATUS_OK)
        fail_job(farm, job, status, &error);
}

static void complete_job(struct farm *farm, const struct action *action)
{
    struct render_job *job = farm->jobs[action->job];
    struct error error;
    if (farm->status != STATUS_OK)
        return;
    enum status status = assembly_complete(&job->assembly, &error);
    if (status != STATUS_OK) {
        fail_job(farm, job, status, &error);
        return;
    }
    job->ended_ms = clock_now_ms();
    job->state = JOB_DONE;
    farm->jobs_over++;
    if (farm->job_done)
        farm->job_done(job, farm->job_done_context);
}

static void give_up(struct farm *farm, const struct action *action)
{
    struct render_job *job = farm->jobs[action->job];
    struct error error;
    error_set(&error, STATUS_FAILED, "%s: rows %u to %u%s cost %d workers their lives; giving up", job->scene_path,
              action->first_row, action->first_row + action->rows - 1,
              action->pass == PASS_SURVEY ? " of the survey" : "", SCHEDULER_LOSSES_MAX);
    fail_job(farm, job, STATUS_FAILED, &error);
}

static void expel(struct farm *farm, const struct action *action)
{
    struct peer *peer = peer_numbered(farm, action->worker);
    log_warning("worker %u (%s, process %u) has been silent too long; its bands go to others", peer->number, peer->host,
                peer->pid);
    send_to(farm, &peer->address, &(struct message){.kind = MESSAGE_GOODBYE, .epoch = peer->epoch});
    peer->gone = true;
    peer_finish(peer);
}

static void carry_out(struct farm *farm, const struct action *action, const uint8_t *result)
{
    switch (action->kind) {
    case ACTION_ANNOUNCE:
        announce(farm, action);
        break;
    case ACTION_GRANT:
        grant(farm, action);
        break;
    case ACTION_ACCEPT:
        accept_result(farm, action, result);
        break;
    case ACTION_ACK:
        farm_send(farm, peer_numbered(farm, action->worker),
                  (struct message){.kind = MESSAGE_ACK, .ack = {action->lease}});
        break;
    case ACTION_REVOKE:
        peer_drop(peer_numbered(farm, action->worker), action->lease);
        farm_send(farm, peer_numbered(farm, action->worker),
                  (struct message){.kind = MESSAGE_REVOKE, .revoke = {action->lease}});
        break;
    case ACTION_END:
        farm_send(farm, peer_numbered(farm, action->worker),
                  (struct message){.kind = MESSAGE_END, .end = {action->job}});
        break;
    case ACTION_EXPEL:
        expel(farm, action);
        break;
    case ACTION_SURVEYED:
        end_survey(farm, action);
        break;
    case ACTION_DONE:
        complete_job(farm, action);
        break;
    case ACTION_FAIL:
        give_up(farm, action);
        break;
    }
}

static void answer(struct farm *farm, const struct event *event, const uint8_t *result)
{
    struct action_list actions = {0};
    scheduler_handle(farm->scheduler, event, clock_now_ms(), &actions);
    for (size_t i = 0; i < actions.count; i++)
        carry_out(farm, &actions.items[i], result);
    free(actions.items);
}

/* A peer that turns out to be lost while actions are carried out leads to another event. It waits until they all are: the
 * scheduler's answer to it may build on them, as the bands of a render do on the end of its survey. */
void farm_tell(struct farm *farm, const struct event *event, const uint8_t *result)
{
    if (farm->ending)
        return;
    if (farm->answering) {
        farm->events = memory_grow(farm->events, &farm->event_capacity, farm->event_count + 1, sizeof *farm->events);
        farm->events[farm->event_count++] = *event;
        return;
    }
    farm->answering = true;
    answer(farm, event, result);
    for (size_t i = 0; i < farm->event_count; i++) { /* to which its answer may add */
        struct event next = farm->events[i];
        answer(farm, &next, NULL);
    }
    farm->event_count = 0;
    farm->answering = false;
}

/* --- joining ---------------------------------------------------------------------------------------------- */

static void refuse(struct farm *farm, const struct wire_peer *address, const struct message *hello, const char *reason)
{
    struct message message = {.kind = MESSAGE_REFUSE};
    snprintf(message.refuse.reason, sizeof message.refuse.reason, "%s", reason);
    send_to(farm, address, &message);
    log_warning("refused a worker on %s (process %u): %s", hello->hello.host, hello->hello.pid, reason);
}

static struct peer *find_peer(struct farm *farm, const struct wire_peer *address)
{
    for (size_t i = farm->peer_count; i-- > 0;)
        if (!farm->peers[i].gone && wire_peer_equal(&farm->peers[i].address, address))
            return &farm->peers[i];
    return NULL;
}

static struct peer *add_peer(struct farm *farm, const struct wire_peer *address, const struct message *hello)
{
    farm->peers = memory_grow(farm->peers, &farm->peer_capacity, farm->peer_count + 1, sizeof *farm->peers);
    struct peer *peer = &farm->peers[farm->peer_count++];
    *peer = (struct peer){.number = (uint32_t)farm->peer_count, .address = *address, .pid = hello->hello.pid,
                          .threads = hello->hello.threads, .joined_ms = clock_now_ms()};
    peer->rate_from_ms = peer->joined_ms;
    randombytes_buf(&peer->epoch, sizeof peer->epoch);
    memcpy(peer->host, hello->hello.host, sizeof peer->host);
    memcpy(peer->kernel, hello->hello.kernel, sizeof peer->kernel);
    return peer;
}

static void take_hello(struct farm *farm, const struct wire_peer *address, const struct message *hello)
{
    struct peer *known = find_peer(farm, address);
    if (known) { /* it asked again before it heard the answer */
        farm_send(farm, known, (struct message){.kind = MESSAGE_WELCOME});
        return;
    }
    if (!digest_equal(&hello->hello.core_revision, &farm->core_revision)) {
        refuse(farm, address, hello, "its tracing core was built from other sources than the coordinator's");
        return;
    }
    if (!digest_equal(&hello->hello.proof, &farm->proof)) {
        refuse(farm, address, hello, "it computes other bytes than the coordinator (its proof picture differs)");
        return;
    }
    struct peer *peer = add_peer(farm, address, hello);
    uint32_t number = peer->number;
    log_info("worker %u joined: %s, process %u, %u threads, kernel %s", number, peer->host, peer->pid, peer->threads,
             peer->kernel);
    farm_send(farm, peer, (struct message){.kind = MESSAGE_WELCOME});
    farm_tell(farm, &(struct event){.kind = EVENT_JOIN, .worker = number, .threads = hello->hello.threads,
                                    .credit = hello->hello.credit}, NULL);
}

/* --- answering -------------------------------------------------------------------------------------------- */

static void take_need(struct farm *farm, struct peer *peer, const struct message *message)
{
    const struct bytes *asset = NULL;
    for (size_t i = 0; i < farm->job_count && !asset; i++)
        if (render_job_is_open(farm->jobs[i]))
            asset = render_job_find(farm->jobs[i], &message->need.digest);
    if (!asset || message->need.offset > asset->size)
        return; /* of a job that has ended */
    uint64_t left = asset->size - message->need.offset;
    farm_send(farm, peer, (struct message){.kind = MESSAGE_ASSET, .asset = {
        .digest = message->need.digest, .offset = message->need.offset, .total = asset->size,
        .data = asset->data + message->need.offset,
        .size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX)}});
}

static void take_failure(struct farm *farm, struct peer *peer, const struct message *message)
{
    log_warning("worker %u (%s) cannot work on job %" PRIu32 ": %s", peer->number, peer->host, message->failed.job,
                message->failed.reason);
    farm_send(farm, peer, (struct message){.kind = MESSAGE_GOODBYE});
    farm_lose_peer(farm, peer, false);
}

static void take_result(struct farm *farm, struct peer *peer, const struct message *message)
{
    struct action grant;
    if (!scheduler_lease(farm->scheduler, peer->number, message->result.lease, &grant)) {
        peer_drop(peer, message->result.lease); /* revoked meanwhile */
        return;
    }
    const struct assembly *assembly = farm->jobs[grant.job]->assembly;
    bool survey = grant.pass == PASS_SURVEY;
    uint64_t total = survey ? SURVEY_BYTES : (uint64_t)grant.rows * assembly_record_bytes(assembly);
    struct bytes result = {0};
    bool fits, whole = peer_take_chunk(peer, message, total, &result, &fits);
    if (!fits) {
        log_warning("worker %u (%s) sent a result that does not fit its band", peer->number, peer->host);
        farm_lose_peer(farm, peer, true);
    }
    if (!whole)
        return;
    peer->bands_done++;
    if (!survey) {
        struct row_figures figures = assembly_sum(assembly, grant.rows, result.data);
        peer->rows_done += grant.rows;
        peer->rays_returned += row_figures_rays(&figures);
    }
    farm_tell(farm, &(struct event){.kind = EVENT_RESULT, .worker = peer->number, .lease = message->result.lease},
              result.data);
    bytes_finish(&result);
}

static void take_peer_message(struct farm *farm, struct peer *peer, const struct message *message)
{
    switch (message->kind) {
    case MESSAGE_NEED:
        take_need(farm, peer, message);
        break;
    case MESSAGE_READY:
        farm_tell(farm, &(struct event){.kind = EVENT_READY, .worker = peer->number, .job = message->ready.job}, NULL);
        break;
    case MESSAGE_FAILED:
        take_failure(farm, peer, message);
        break;
    case MESSAGE_RESULT:
        take_result(farm, peer, message);
        break;
    case MESSAGE_BEAT:
        peer_take_beat(peer, message->beat.rays, clock_now_ms());
        farm_tell(farm, &(struct event){.kind = EVENT_BEAT, .worker = peer->number}, NULL);
        break;
    case MESSAGE_DRAIN:
        peer->draining = true;
        farm_tell(farm, &(struct event){.kind = EVENT_DRAIN, .worker = peer->number}, NULL);
        break;
    case MESSAGE_GOODBYE:
        if (!farm->ending)
            log_info("worker %u (%s) said goodbye", peer->number, peer->host);
        farm_lose_peer(farm, peer, false);
        break;
    default:
        break; /* what a worker has no business sending */
    }
}

void farm_take_messages(struct farm *farm)
{
    struct bytes data = {0};
    struct wire_peer address;
    while (farm->status == STATUS_OK && wire_server_receive(farm->server, &address, &data)) {
        struct message message;
        struct error error;
        if (message_decode(&message, data.data, data.size, &error) != STATUS_OK) {
            log_warning("ignored a message: %s", error.text);
            continue;
        }
        struct peer *peer = find_peer(farm, &address);
        if (message.kind == MESSAGE_HELLO && !farm->ending)
            take_hello(farm, &address, &message);
        else if (peer && message.epoch == peer->epoch)
            take_peer_message(farm, peer, &message);
    }
    bytes_finish(&data);
}
