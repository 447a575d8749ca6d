/* What workers say, taken and answered. */
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sodium.h>

#include "base/log.h"
#include "base/memory.h"
#include "coordinator/dispatcher_private.h"

/* --- joining ---------------------------------------------------------------------------------------------- */

static void refuse(struct dispatcher *d, const struct wire_peer *address, const struct message *hello,
                   const char *reason)
{
    struct message message = {.kind = MESSAGE_REFUSE};
    snprintf(message.refuse.reason, sizeof message.refuse.reason, "%s", reason);
    dispatcher_send_to(d, address, &message);
    d->refused++;
    dispatcher_tell_of(d, machines_number(&d->machines, &address->machine), LINE_REFUSAL,
                       "refused a worker on %s (process %u): %s", hello->hello.host, hello->hello.pid, reason);
}

static struct peer *find_peer(struct dispatcher *d, const struct wire_peer *address)
{
    uint32_t number = peer_index_find(&d->peers_by_address, d->peers, address);
    return number && !d->peers[number - 1].gone ? &d->peers[number - 1] : NULL;
}

/* A number that is free, for a worker of that machine. Those that went last keep theirs, to be looked at. */
static uint32_t free_number(struct dispatcher *d, struct machine *machine)
{
    enum { SPARES_KEPT = 4 };
    if (machine->spares <= SPARES_KEPT) {
        d->peers = memory_grow(d->peers, &d->peer_capacity, d->peer_count + 1, sizeof *d->peers);
        return (uint32_t)++d->peer_count;
    }
    uint32_t number = machine->first_spare;
    machine->first_spare = d->peers[number - 1].next_spare;
    machine->spares--;
    peer_index_remove(&d->peers_by_address, d->peers, number);
    return number;
}

static struct peer *add_peer(struct dispatcher *d, const struct wire_peer *address, uint32_t machine,
                             const struct message *hello)
{
    uint32_t number = free_number(d, machines_find(&d->machines, machine));
    struct peer *peer = &d->peers[number - 1];
    *peer = (struct peer){.number = number, .address = *address, .machine = machine, .pid = hello->hello.pid,
                          .threads = hello->hello.threads, .joined_ms = d->now_ms};
    peer->rate_from_ms = peer->joined_ms;
    randombytes_buf(&peer->epoch, sizeof peer->epoch);
    memcpy(peer->host, hello->hello.host, sizeof peer->host);
    memcpy(peer->kernel, hello->hello.kernel, sizeof peer->kernel);
    peer->trouble = machine_trouble(machines_find(&d->machines, machine), peer->host, peer->pid, address->own);
    peer_index_add(&d->peers_by_address, d->peers, peer->number);
    return peer;
}

/* Why the worker may not join; NULL: it may. What made one process of a machine compute wrong bytes is likely to do the
 * same to the next. */
static const char *objection(const struct dispatcher *d, const struct wire_peer *address, const struct machine *machine,
                             const struct message *hello)
{
    if (!digest_equal(&hello->hello.core_revision, &d->config.core_revision))
        return "its tracing core was built from other sources than the coordinator's";
    if (!digest_equal(&hello->hello.proof, &d->config.proof))
        return "it computes other bytes than the coordinator (its proof picture differs)";
    if (!machine)
        return "too many machines have come";
    if (machine_fails_too_often(machine, hello->hello.host, hello->hello.pid, address->own))
        return "it has failed too often in this render";
    if (!address->own && machine->lied)
        return "a worker of that machine returned wrong bytes";
    return NULL;
}

/* A worker that asks for more gets along with this: its threads share bands. Sockets have room for so many messages. */
static uint32_t credit_of(const struct message *hello)
{
    enum { CREDIT_MAX = 512 };
    return hello->hello.credit < CREDIT_MAX ? hello->hello.credit : CREDIT_MAX;
}

static void take_hello(struct dispatcher *d, const struct wire_peer *address, const struct message *hello)
{
    struct peer *known = find_peer(d, address);
    if (known) { /* it asked again before it heard the answer */
        dispatcher_send_peer(d, known, (struct message){.kind = MESSAGE_WELCOME});
        return;
    }
    uint32_t machine = machines_number(&d->machines, &address->machine);
    const char *reason = objection(d, address, machines_find(&d->machines, machine), hello);
    if (reason) {
        refuse(d, address, hello, reason);
        return;
    }
    struct peer *peer = add_peer(d, address, machine, hello);
    uint32_t number = peer->number;
    dispatcher_tell_of_peer(d, peer, LINE_COMING, "joined: %u thread%s, kernel %s", peer->threads,
                            peer->threads == 1 ? "" : "s", peer->kernel);
    dispatcher_send_peer(d, peer, (struct message){.kind = MESSAGE_WELCOME});
    if (peer->gone) /* its connection is: the scheduler need not know that it was there */
        return;
    dispatcher_tell(d, &(struct event){.kind = EVENT_JOIN, .worker = number, .machine = machine,
                                    .threads = hello->hello.threads, .credit = credit_of(hello),
                                    .trusted = address->own}, NULL);
}

/* What it does is against the protocol: it is told so, and is there no more. */
__attribute__((format(printf, 3, 4)))
static void drop(struct dispatcher *d, struct peer *peer, const char *format, ...)
{
    char why[MESSAGE_REASON_BYTES / 2];
    struct message refusal = {.kind = MESSAGE_REFUSE, .epoch = peer->epoch};
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    snprintf(refusal.refuse.reason, sizeof refusal.refuse.reason, "it %s", why);
    dispatcher_tell_of_peer(d, peer, LINE_TROUBLE, "%s", why);
    dispatcher_send_to(d, &peer->address, &refusal);
    dispatcher_lose_peer(d, peer, true);
}

/* --- answering -------------------------------------------------------------------------------------------- */

static void take_need(struct dispatcher *d, struct peer *peer, const struct message *message)
{
    const struct bytes *asset = NULL;
    for (size_t i = 0; i < d->job_count && !asset; i++)
        if (render_job_is_open(d->jobs[i]))
            asset = render_job_find(d->jobs[i], &message->need.digest);
    if (!asset || message->need.offset > asset->size)
        return; /* of a job that has ended */
    uint64_t left = asset->size - message->need.offset;
    uint32_t size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX);
    if (size > peer->asset_allowance) { /* what it does not read would pile up here */
        drop(d, peer, "asks for the same again and again");
        return;
    }
    peer->asset_allowance -= size;
    dispatcher_send_peer(d, peer, (struct message){.kind = MESSAGE_ASSET, .asset = {
        .digest = message->need.digest, .offset = message->need.offset, .total = asset->size,
        .data = asset->data + message->need.offset, .size = size}});
}

static void take_failure(struct dispatcher *d, struct peer *peer, const struct message *message)
{
    dispatcher_note_trouble(d, peer, TROUBLE_UNFIT, true);
    dispatcher_tell_of_peer(d, peer, LINE_TROUBLE, "cannot work on %s: %s",
                            message->failed.job < d->job_count ? d->jobs[message->failed.job]->scene_path : "a scene",
                            message->failed.reason);
    dispatcher_send_peer(d, peer, (struct message){.kind = MESSAGE_GOODBYE});
    dispatcher_lose_peer(d, peer, false);
}

static void take_result(struct dispatcher *d, struct peer *peer, const struct message *message)
{
    struct action grant;
    if (!scheduler_lease(d->scheduler, peer->number, message->result.lease, &grant)) {
        peer_drop(peer, message->result.lease); /* revoked meanwhile */
        return;
    }
    const struct render_job *job = d->jobs[grant.job];
    uint64_t total = render_job_result_bytes(job, grant.pass, grant.rows);
    struct bytes result = {0};
    bool fits, whole = peer_take_chunk(peer, message, total, &result, &fits);
    if (!fits) {
        char rows[ROWS_NAME_BYTES];
        drop(d, peer, "sent a result that does not fit %s of %s",
             render_job_rows_name(grant.pass, grant.first_row, grant.rows, rows), job->scene_path);
        dispatcher_note_trouble(d, peer, TROUBLE_MISFIT, true);
    }
    if (!whole)
        return;
    peer->bands_done++;
    if (grant.pass == PASS_RENDER) {
        struct row_figures figures = assembly_sum(job->assembly, grant.rows, result.data);
        peer->rows_done += grant.rows;
        peer->rays_returned += row_figures_rays(&figures);
    }
    dispatcher_tell(d, &(struct event){.kind = EVENT_RESULT, .worker = peer->number, .lease = message->result.lease},
                    result.data);
    bytes_finish(&result);
}

static void take_peer_message(struct dispatcher *d, struct peer *peer, const struct message *message)
{
    switch (message->kind) {
    case MESSAGE_NEED:
        take_need(d, peer, message);
        break;
    case MESSAGE_READY:
        dispatcher_tell(d, &(struct event){.kind = EVENT_READY, .worker = peer->number, .job = message->ready.job},
                        NULL);
        break;
    case MESSAGE_FAILED:
        take_failure(d, peer, message);
        break;
    case MESSAGE_RESULT:
        take_result(d, peer, message);
        break;
    case MESSAGE_BEAT:
        peer_take_beat(peer, message->beat.rays, d->now_ms);
        dispatcher_tell(d, &(struct event){.kind = EVENT_BEAT, .worker = peer->number,
                                           .progress = message->beat.progress}, NULL);
        break;
    case MESSAGE_DRAIN:
        peer->draining = true;
        dispatcher_tell(d, &(struct event){.kind = EVENT_DRAIN, .worker = peer->number}, NULL);
        break;
    case MESSAGE_GOODBYE:
        if (!d->ending)
            dispatcher_tell_of_peer(d, peer, LINE_COMING, "said goodbye");
        dispatcher_lose_peer(d, peer, false);
        break;
    default:
        break; /* what a worker has no business sending */
    }
}

/* Of a conversation that this side does not know, or no longer: its connection was lost and made anew, the worker was
 * given up, or another coordinator was here before. Told so it joins at once instead of after a silence. */
static void end_unknown(struct dispatcher *d, const struct wire_peer *address, const struct message *message)
{
    if (!d->ending && message->kind != MESSAGE_GOODBYE)
        dispatcher_send_to(d, address, &(struct message){.kind = MESSAGE_REFUSE, .epoch = message->epoch,
                                                      .refuse.reason = "its connection was lost"});
}

/* All that its reader can understand are the first fields, which name this side's version. */
static void refuse_version(struct dispatcher *d, const struct wire_peer *address)
{
    dispatcher_send_to(d, address, &(struct message){.kind = MESSAGE_REFUSE,
                                                  .refuse.reason = "it speaks another version of the protocol"});
}

void dispatcher_take_message(struct dispatcher *d, const struct wire_peer *from, const void *data, size_t size,
                             int64_t now_ms)
{
    struct message message;
    struct error error;
    dispatcher_note_time(d, now_ms);
    if (d->status != STATUS_OK && !d->ending)
        return;
    if (message_decode(&message, data, size, &error) != STATUS_OK) {
        unsigned version = message_version(data, size);
        if (from->may_work)
            dispatcher_tell_of(d, machines_number(&d->machines, &from->machine), LINE_NONSENSE,
                               "ignored a message: %s", error.text);
        if (version > 0 && version != PROTOCOL_VERSION)
            refuse_version(d, from);
        return;
    }
    if (dispatcher_take_asker(d, from, &message) || !from->may_work)
        return;
    struct peer *peer = find_peer(d, from);
    if (message.kind == MESSAGE_HELLO && !d->ending)
        take_hello(d, from, &message);
    else if (peer && message.epoch == peer->epoch)
        take_peer_message(d, peer, &message);
    else if (!peer)
        end_unknown(d, from, &message);
}
