/*
 * The coordinator's side of the conversation with its workers (wire/message.h): admits them, lets the scheduler decide,
 * hands out jobs, assets and bands, has the results woven together, and tells who asks how things stand. It is told
 * what arrives and what time it is, and sends through a function that it is given: it has no clock, no sockets, no
 * processes and no threads, so that a test can drive it through any history.
 */
#ifndef WEFT_COORDINATOR_DISPATCHER_H
#define WEFT_COORDINATOR_DISPATCHER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "base/hash.h"
#include "coordinator/render_job.h"
#include "coordinator/snapshot.h"
#include "wire/socket.h"

/* Sends data[size] to a worker. False if it cannot be reached any more. */
typedef bool dispatcher_send(void *context, const struct wire_peer *to, const void *data, size_t size);

struct dispatcher_config {
    uint32_t band_rows;                 /* 0: automatic */
    double audit_percent;               /* of the bands, that are rendered by two workers and compared; 0: none */
    struct digest core_revision, proof; /* what a worker must match */
    int bell; /* an eventfd, to which 1 is added when dispatcher_take_done is to be called; −1: outputs are awaited */
    dispatcher_send *send;
    void *context; /* of send; borrowed */
};

struct dispatcher;

/* Times are in milliseconds, of a clock that never goes back. */
struct dispatcher *dispatcher_create(const struct dispatcher_config *config, int64_t now_ms);

/* Frees *dispatcher and sets it to NULL; *dispatcher may be NULL. The jobs are the caller's. */
void dispatcher_destroy(struct dispatcher **dispatcher);

/* Adds a job; it is rendered after those added before. Borrowed; must stay until dispatcher_destroy. */
void dispatcher_add_job(struct dispatcher *dispatcher, struct render_job *job, int64_t now_ms);

/* Takes and answers a message: data[size], as it came from there. */
void dispatcher_take_message(struct dispatcher *dispatcher, const struct wire_peer *from, const void *data, size_t size,
                             int64_t now_ms);

/* Does what is due by now, all messages that have arrived having been taken: who has been silent too long is given up.
 * To be called at dispatcher_deadline at the latest. */
void dispatcher_tick(struct dispatcher *dispatcher, int64_t now_ms);
int64_t dispatcher_deadline(const struct dispatcher *dispatcher);

/* A process that this one has started has died; it may have been a worker, and may have joined more than once. */
void dispatcher_lose_process(struct dispatcher *dispatcher, uint32_t pid, int64_t now_ms);

/* A worker process of this machine from which nothing more is expected, though it has not died; false: there is
 * none. */
bool dispatcher_take_expelled(struct dispatcher *dispatcher, uint32_t *pid);

/* Whether one more worker of this process's own is needed, as is then told: to settle which of two others is right, or
 * to try rows that others were lost with. True once each time. */
bool dispatcher_take_need_of_trusted(struct dispatcher *dispatcher);

/* Gives up all jobs that are open, and says why. */
void dispatcher_give_up(struct dispatcher *dispatcher, enum status status, const struct error *error, int64_t now_ms);

/* The next job whose output has been completed, each once, in the order of their completion; NULL: no other has. It
 * counts as ended now, so that the time it took to complete its files counts. To be called when the bell has rung. */
const struct render_job *dispatcher_take_done(struct dispatcher *dispatcher, int64_t now_ms);

/* The loop ends early: outputs that are about to be complete are waited for, since their files may be there already. */
void dispatcher_finish_written(struct dispatcher *dispatcher);

/* Whether there is nothing more to do: all is done, or it cannot be. */
bool dispatcher_is_over(const struct dispatcher *dispatcher);

/* STATUS_OK, or what went wrong, with *error set. */
enum status dispatcher_status(const struct dispatcher *dispatcher, struct error *error);

/* Says goodbye to all workers, and to those who watch how things stand now; from then on only their answers are taken.
 * dispatcher_present says how many have not answered. */
void dispatcher_say_goodbye(struct dispatcher *dispatcher, int64_t now_ms);
size_t dispatcher_present(const struct dispatcher *dispatcher);

/* A number that is another one (but for a chance of 2^-32) when a job has come, or the state of one has changed. */
uint32_t dispatcher_states(const struct dispatcher *dispatcher);

/* The present state; borrowed, until the next call or dispatcher_destroy. */
struct snapshot dispatcher_snapshot(struct dispatcher *dispatcher, int64_t now_ms);

#endif
