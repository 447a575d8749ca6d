/*
 * The coordinator of a farm on a virtual clock: a real dispatcher with real jobs, whose files are written, in a loop as
 * in coordinator/farm.c; and what must be true of it at any time, and in the end.
 */
#ifndef WEFT_TESTS_COORDINATOR_H
#define WEFT_TESTS_COORDINATOR_H

#include <sys/eventfd.h>
#include <unistd.h>

#include "coordinator/dispatcher_private.h"
#include "tests/sim/network.h"
#include "tests/sim/pictures.h"
#include "tests/sim/worker.h"

enum {
    GOODBYE_MS = 500,     /* as long as coordinator/farm.c waits for answers */
    STANDSTILL_MS = 2500, /* nobody minds that a coordinator stands still for so long, */
    RECOVERY_MS = 1000,   /* or again and again without so much time between */
};

static struct {
    struct dispatcher *dispatcher; /* NULL: it does not run */
    struct render_job jobs[JOBS_MAX];
    uint32_t job_count, jobs_added;
    bool ending, crashed;
    int64_t stopped_until_ms, stopping_ms; /* stopping: since when it has stood still, again and again */
    uint64_t epoch;  /* of the message that it is taking, */
    bool deaf;       /* which nobody present has said */
    uint32_t hellos; /* that it has taken */
} coordinator;

static const char *const job_files[JOBS_MAX] = {"first", "second"};

/* What the histories held, over all seeds. */
static struct {
    unsigned renders, done, failed, crashed, altered, joined, lost, bands, audited, exposed;
} tally;

/* --- what it says ----------------------------------------------------------------------------------------- */

/* The worker that has this address and this epoch, which is drawn anew for each, and is not gone. */
static const struct peer *find_present(const struct wire_peer *address, uint64_t epoch)
{
    const struct dispatcher *d = coordinator.dispatcher;
    for (size_t i = 0; i < d->peer_count; i++)
        if (!d->peers[i].gone && d->peers[i].epoch == epoch && wire_peer_equal(&d->peers[i].address, address))
            return &d->peers[i];
    return NULL;
}

/* Nothing is said to those that are gone; what belongs to no conversation is answered by a refusal of that alone. */
static void check_said(const struct link *link, const struct peer *peer, const struct message *message)
{
    bool refusal = message->kind == MESSAGE_REFUSE;
    if (message->kind == MESSAGE_STATUS) /* of no conversation: whoever asks is told */
        return;
    require(peer || refusal, "something is said to worker %u, which is gone", link->worker);
    require(!coordinator.deaf || (refusal && message->epoch == coordinator.epoch),
            "a message of no conversation is answered");
    require(!peer || message->kind != MESSAGE_BAND || !peer->draining, "worker %u, which drains, gets a band",
            link->worker);
    require(!peer || coordinator.ending || message->epoch != link->farewell,
            "something is said to worker %u after its goodbye", link->worker);
}

/* Who is given up for its silence has said nothing that waits to be heard. */
static void check_given_up(const struct link *link, const struct message *message)
{
    bool for_silence = message->kind == MESSAGE_REFUSE && strstr(message->refuse.reason, "silent");
    require(!for_silence || !network_waits(link), "worker %u is expelled though it spoke", link->worker);
}

/* Takes the place of wire_server_send. */
static bool send_down(void *context, const struct wire_peer *to, const void *data, size_t size)
{
    (void)context;
    struct message message;
    struct error error;
    struct link *link = link_at(to);
    if (message_decode(&message, data, size, &error) != STATUS_OK)
        require(false, "the coordinator says: %s", error.text);
    const struct peer *peer = find_present(to, message.epoch);
    check_said(link, peer, &message);
    if (peer && (message.kind == MESSAGE_GOODBYE || message.kind == MESSAGE_REFUSE)) {
        check_given_up(link, &message);
        link->farewell = message.epoch;
    }
    return network_send_down(to, data, size);
}

static void add_job(void)
{
    struct render_job *job = &coordinator.jobs[coordinator.jobs_added++];
    dispatcher_add_job(coordinator.dispatcher, job, history.now_ms);
}

/* Nobody listens to it: take_outputs looks. */
static int bell(void)
{
    static int descriptor = -1;
    if (descriptor < 0)
        descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    return descriptor;
}

static void start_coordinator(void)
{
    const struct dispatcher_config config = {.band_rows = chance(50) ? 0 : draw(1, 10), .send = send_down, .bell = bell(),
                                             .audit_percent = farm.audits ? 100 : 0};
    coordinator.dispatcher = dispatcher_create(&config, history.now_ms);
    for (uint32_t i = 0; i < coordinator.job_count; i++)
        picture_job(farm.pictures[i], job_files[i], &coordinator.jobs[i]);
    coordinator.jobs_added = 0;
    coordinator.crashed = coordinator.ending = false;
    coordinator.hellos = 0;
    farm.up = true;
    farm.disturbed = false;
    add_job();
    if (coordinator.job_count > 1 && chance(70))
        add_job();
    else if (coordinator.job_count > 1)
        happen(LATE_JOB, 0, 0, history.now_ms + draw(0, 20000));
}

static bool is_over(void)
{
    return coordinator.crashed || (dispatcher_is_over(coordinator.dispatcher) &&
                                   (coordinator.jobs_added == coordinator.job_count ||
                                    dispatcher_status(coordinator.dispatcher, &(struct error){""}) != STATUS_OK));
}

/* What it keeps of a worker is bounded by what it gave that worker to do. */
static void check_peer(const struct peer *peer)
{
    struct scheduler *scheduler = coordinator.dispatcher->scheduler;
    struct action grant;
    if (coordinator.ending) /* the scheduler is told nothing any more */
        return;
    require(!peer->gone || (peer->incoming_count == 0 && peer->held_count == 0), "worker %u is gone and holds bands",
            peer->number);
    for (size_t i = 0; i < peer->held_count; i++)
        require(scheduler_lease(scheduler, peer->number, peer->held[i].lease, &grant),
                "worker %u holds a band of which the scheduler does not know", peer->number);
    for (size_t i = 0; i < peer->incoming_count; i++)
        require(scheduler_lease(scheduler, peer->number, peer->incoming[i].lease, &grant),
                "results are kept that worker %u does not owe", peer->number);
}

static void check_rest(void)
{
    const struct dispatcher *d = coordinator.dispatcher;
    require(!d->answering && d->event_count == 0, "the dispatcher is not at rest");
    require(d->peer_count <= coordinator.hellos, "%zu workers of %u HELLOs", d->peer_count, coordinator.hellos);
    for (size_t i = 0; i < d->peer_count; i++)
        check_peer(&d->peers[i]);
}

/* What is shown of a job agrees with itself: its stretches are the picture, from the top without gaps. */
static void check_shown(const struct job_snapshot *job)
{
    uint32_t next = 0, rows[] = {[STRETCH_WAITING] = 0, [STRETCH_IN_WORK] = 0, [STRETCH_DONE] = 0};
    for (size_t i = 0; i < job->stretch_count; i++) {
        const struct stretch_snapshot *stretch = &job->stretches[i];
        require(stretch->first_row == next && stretch->rows > 0, "a stretch begins at row %u, not %u", stretch->first_row,
                next);
        next += stretch->rows;
        rows[stretch->state] += stretch->rows;
    }
    require(next == job->height, "stretches of %u rows are shown of %u", next, job->height);
    require(rows[STRETCH_DONE] == job->rows_done, "%u rows are shown as done, not %u", rows[STRETCH_DONE], job->rows_done);
    require(job->state != JOB_RUNNING || rows[STRETCH_IN_WORK] == job->rows_in_work,
            "%u rows are shown in work, not %u", rows[STRETCH_IN_WORK], job->rows_in_work);
    require(job->remaining_seconds == -1 || (job->remaining_seconds >= 0 && job->remaining_seconds < 1e9),
            "%g seconds are said to remain", job->remaining_seconds);
}

/* Now and then, without a draw, which would change the history. */
static void check_snapshot(void)
{
    if (history.now_ms % 8 != 0)
        return;
    struct snapshot snapshot = dispatcher_snapshot(coordinator.dispatcher, history.now_ms);
    for (size_t i = 0; i < snapshot.job_count; i++)
        check_shown(&snapshot.jobs[i]);
}

static void hear(const struct packet *packet, size_t from)
{
    struct message message;
    struct error error;
    const struct wire_peer address = address_of(from);
    bool sound = message_decode(&message, packet->bytes.data, packet->bytes.size, &error) == STATUS_OK;
    farm.altered |= sound && packet->altered && decides_pixels(message.kind);
    coordinator.epoch = sound ? message.epoch : 0;
    coordinator.deaf = !sound || (message.kind != MESSAGE_HELLO && !find_present(&address, message.epoch));
    coordinator.deaf &= coordinator.dispatcher->unreachable_count == 0; /* whose bands go to others now */
    coordinator.hellos += sound && message.kind == MESSAGE_HELLO;
    dispatcher_take_message(coordinator.dispatcher, &address, packet->bytes.data, packet->bytes.size, history.now_ms);
    coordinator.deaf = false;
    check_rest();
}

/* Outputs are written by threads, in their own time: so they are looked for now and then, and waited for. */
static void take_outputs(void)
{
    struct dispatcher *d = coordinator.dispatcher;
    if (d->writing_count == 0 || chance(50))
        return;
    for (size_t i = 0; i < d->writing_count; i++)
        while (!render_job_output_is_finished(d->writing[i]))
            usleep(20);
    while (dispatcher_take_done(d, history.now_ms))
        continue;
}

static void stop_coordinator(uint32_t ms)
{
    if (history.now_ms > coordinator.stopped_until_ms + RECOVERY_MS)
        coordinator.stopping_ms = history.now_ms;
    coordinator.stopped_until_ms = history.now_ms + ms;
    farm.disturbed |= coordinator.stopped_until_ms - coordinator.stopping_ms > STANDSTILL_MS;
    happen(COORDINATOR_TURN, 0, 0, coordinator.stopped_until_ms);
}

/* One more worker of this machine, as coordinator/farm.c starts it; if it has ended, again. */
static void start_judge(void)
{
    if (farm.judge == 0) {
        farm.judge = worker_count++;
        workers[farm.judge] = (struct worker){.number = farm.judge, .link = NO_LINK, .own = true, .pid = 1000,
                                              .threads = 1, .credit = 2, .high_ms = 2, .ms_a_row = draw(1, 100)};
    }
    happen(START, farm.judge, 0, history.now_ms + draw(0, 2000));
}

/* As the loop of coordinator/farm.c, and while it ends, as that of its end. */
static void coordinator_turn(void)
{
    struct packet packet;
    size_t from;
    if (!coordinator.dispatcher || history.now_ms < coordinator.stopped_until_ms)
        return;
    while (network_take_up(&packet, &from)) {
        hear(&packet, from);
        bytes_finish(&packet.bytes);
    }
    if (coordinator.ending)
        return;
    if (chance(1))
        stop_coordinator(draw(1, 300)); /* it has other things to do too */
    dispatcher_tick(coordinator.dispatcher, history.now_ms);
    if (dispatcher_take_need_of_trusted(coordinator.dispatcher))
        start_judge();
    take_outputs();
    check_rest();
    check_snapshot();
    require(dispatcher_deadline(coordinator.dispatcher) > history.now_ms, "the dispatcher's deadline is past");
}

static int64_t coordinator_deadline(void)
{
    if (!coordinator.dispatcher || coordinator.ending)
        return INT64_MAX;
    int64_t deadline_ms = dispatcher_deadline(coordinator.dispatcher);
    return deadline_ms > coordinator.stopped_until_ms ? deadline_ms : coordinator.stopped_until_ms;
}

/* Of a worker that the coordinator has started. */
static void tell_death(uint32_t pid)
{
    const struct dispatcher *d = coordinator.dispatcher;
    if (!d)
        return;
    if (history.now_ms < coordinator.stopped_until_ms) {
        happen(DEATH_IS_TOLD, 0, pid, coordinator.stopped_until_ms);
        return;
    }
    dispatcher_lose_process(coordinator.dispatcher, pid, history.now_ms);
    for (size_t i = 0; i < d->peer_count; i++)
        require(d->peers[i].gone || d->peers[i].pid != pid || !d->peers[i].address.own,
                "process %u is dead and still there", pid);
    check_rest();
}

/* --- its end ---------------------------------------------------------------------------------------------- */

/* Every row was accepted once. */
static void check_rows(const struct render_job *job)
{
    uint32_t seen[128] = {0};
    for (uint32_t first_row = 0; first_row < job->settings.height; first_row++) {
        const struct band_account *band = &job->bands[PASS_RENDER][first_row];
        for (uint32_t row = 0; row < band->rows; row++)
            seen[first_row + row]++;
        tally.bands += band->rows > 0;
    }
    for (uint32_t row = 0; row < job->settings.height; row++)
        require(seen[row] == 1, "row %u was accepted %u times", row, seen[row]);
}

static uint32_t count_gone(void)
{
    struct snapshot snapshot = dispatcher_snapshot(coordinator.dispatcher, history.now_ms);
    uint32_t gone = 0;
    for (size_t i = 0; i < snapshot.worker_count; i++)
        gone += snapshot.workers[i].state == WORKER_GONE;
    for (size_t i = 0; i < coordinator.dispatcher->peer_count; i++)
        tally.exposed += coordinator.dispatcher->peers[i].lied;
    tally.joined += (unsigned)snapshot.worker_count;
    tally.lost += gone;
    return gone;
}

static void check_done(void)
{
    const struct dispatcher *d = coordinator.dispatcher;
    for (uint32_t i = 0; i < coordinator.job_count; i++) {
        require(coordinator.jobs[i].state == JOB_DONE, "job %u is not done", i);
        require(scheduler_rows_leased(d->scheduler, i) == 0, "job %u is done and leased", i);
        check_rows(&coordinator.jobs[i]);
        tally.audited += coordinator.jobs[i].audited;
    }
    tally.done++;
}

static void check_outcome(void)
{
    struct error error = {""};
    uint32_t gone = count_gone();
    tally.renders++;
    if (coordinator.crashed) {
        tally.crashed++;
    } else if (dispatcher_status(coordinator.dispatcher, &error) == STATUS_OK) {
        check_done();
    } else {
        require(error.text[0] && gone >= SCHEDULER_LOSSES_MAX, "failed with %u workers gone: %s", gone, error.text);
        tally.failed++;
    }
}

/* Whether the job's files were being written when the coordinator ended. */
static bool is_being_written(const struct render_job *job)
{
    const struct dispatcher *d = coordinator.dispatcher;
    bool writing = false;
    for (size_t i = 0; i < d->writing_count; i++)
        writing |= d->writing[i] == job;
    return writing;
}

/* A file is there if its job is done, or may be if it was being written; and then it is the right one. */
static void check_files(uint32_t number, bool done, bool writing)
{
    struct bytes files[PICTURE_FILES], none[PICTURE_FILES] = {{0}};
    const struct picture *picture = farm.pictures[number];
    take_files(picture, job_files[number], files);
    require(!done || files[0].size > 0, "job %u is done, but not there", number);
    require(done || writing || same_files(files, none), "job %u is there, but not done", number);
    for (int i = 0; writing && i < PICTURE_FILES; i++)
        if (files[i].size == 0)
            bytes_put(&files[i], picture->files[i].data, picture->files[i].size);
    require((!done && !writing) || farm.altered || same_files(files, picture->files), "job %u is another picture", number);
    finish_files(files);
}

static void end_coordinator(void)
{
    bool writing[JOBS_MAX] = {false};
    for (uint32_t i = 0; i < coordinator.job_count; i++)
        writing[i] = is_being_written(&coordinator.jobs[i]);
    dispatcher_destroy(&coordinator.dispatcher);
    network_lose_coordinator();
    farm.up = false;
    for (uint32_t i = 0; i < coordinator.job_count; i++) {
        bool done = coordinator.jobs[i].state == JOB_DONE;
        render_job_finish(&coordinator.jobs[i]);
        check_files(i, done, writing[i]);
    }
    for (uint32_t i = 0; i < worker_count; i++)
        workers[i].joined = false;
}

#endif
