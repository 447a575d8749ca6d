/*
 * When a worker without a coordinator does what to find one: HELLO again and again, a new connection where the old one
 * leads nowhere, a word to the user now and then, and giving up.
 */
#ifndef WEFT_WORKER_SEEKING_H
#define WEFT_WORKER_SEEKING_H

#include <stdint.h>

enum {
    SEEKING_HELLO_MS = 250,
    SEEKING_SAY_MS = 15000,
    SEEKING_RENEW_MS = 5000, /* a connection is given up after so long, then after twice that, …, up to */
    SEEKING_RENEW_MAX_MS = 20000, /* this: a server on which thousands knock needs its time */
};

struct seeking {
    int64_t since_ms, hello_ms, retry_ms, say_ms, renew_ms, renew_pause_ms;
    int64_t wait_ms; /* how long to seek before giving up; negative: for ever */
};

enum seeking_step { SEEKING_WAIT, SEEKING_HELLO, SEEKING_RENEW, SEEKING_SAY, SEEKING_GIVE_UP };

/* Begins at now_ms, on a connection that is new, with a HELLO pause_ms later. */
struct seeking seeking_begin(int64_t wait_ms, int64_t pause_ms, int64_t now_ms);

/* The coordinator that was found has no use for this worker: the next HELLO is pause_ms later. */
void seeking_pause(struct seeking *seeking, int64_t pause_ms, int64_t now_ms);

/* A HELLO found no connection: the next one is soon, and later each time. */
void seeking_retry(struct seeking *seeking, int64_t now_ms);

/* What to do now; to be called again until that is to wait. */
enum seeking_step seeking_next(struct seeking *seeking, int64_t now_ms);

/* When seeking_next is to be called again at the latest. */
int64_t seeking_deadline(const struct seeking *seeking);

#endif
