/* Private to the farm. */
#ifndef WEFT_COORDINATOR_FARM_PRIVATE_H
#define WEFT_COORDINATOR_FARM_PRIVATE_H

#include "base/hash.h"
#include "coordinator/farm.h"
#include "coordinator/local.h"
#include "coordinator/peer.h"
#include "coordinator/scheduler.h"

struct farm {
    struct farm_config config;
    struct progress *progress;
    struct wire_server *server;
    char private_endpoint[WIRE_ENDPOINT_BYTES];
    struct local_workers local;
    struct digest core_revision, proof; /* what a worker must match */
    int signals;                        /* descriptor */
    struct scheduler *scheduler;
    struct render_job **jobs; /* the scheduler's job i is jobs[i] */
    size_t job_count, job_capacity, jobs_over;
    struct peer *peers; /* all that ever joined */
    size_t peer_count, peer_capacity;
    int64_t started_ms, beat_ms;
    struct job_snapshot *job_views; /* of farm_snapshot */
    struct worker_snapshot *worker_views;
    size_t job_view_capacity, worker_view_capacity;
    bool answering; /* farm_tell is at work */
    struct event *events; /* that came about meanwhile */
    size_t event_count, event_capacity;
    bool ending; /* nothing is handed out and nobody joins any more */
    farm_job_done *job_done;
    void *job_done_context;
    enum status status; /* other than STATUS_OK: the farm stops, and says why in error */
    struct error error;
};

/* farm_messages.c */

/* Tells the scheduler and carries out what it answers. `result`: the bytes of an EVENT_RESULT, else NULL. */
void farm_tell(struct farm *farm, const struct event *event, const uint8_t *result);

/* Takes and answers all messages that wait. */
void farm_take_messages(struct farm *farm);

/* Sends to a peer; one that cannot be reached is lost. */
void farm_send(struct farm *farm, struct peer *peer, struct message message);

/* The peer is gone: tells the scheduler, unless it knows. */
void farm_lose_peer(struct farm *farm, struct peer *peer, bool by_fault);

/* farm_snapshot.c */

/* Shows the farm's present state, if progress is shown and it is time to; `last` shows it in any case. */
void farm_show(struct farm *farm, bool last);

#endif
