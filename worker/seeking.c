#include "worker/seeking.h"

enum { RETRY_FIRST_MS = 1, RETRY_MAX_MS = 200 }; /* after a HELLO that found no connection; doubled each time */

static int64_t earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

struct seeking seeking_begin(int64_t wait_ms, int64_t pause_ms, int64_t now_ms)
{
    return (struct seeking){
        .since_ms = now_ms,
        .hello_ms = now_ms + pause_ms,
        .retry_ms = RETRY_FIRST_MS,
        .say_ms = now_ms + SEEKING_RENEW_MS,
        .renew_ms = now_ms + SEEKING_RENEW_MS,
        .renew_pause_ms = SEEKING_RENEW_MS,
        .wait_ms = wait_ms,
    };
}

void seeking_pause(struct seeking *s, int64_t pause_ms, int64_t now_ms)
{
    s->hello_ms = now_ms + pause_ms;
}

void seeking_retry(struct seeking *s, int64_t now_ms)
{
    s->hello_ms = now_ms + s->retry_ms;
    s->retry_ms = earlier(2 * s->retry_ms, RETRY_MAX_MS);
}

enum seeking_step seeking_next(struct seeking *s, int64_t now_ms)
{
    if (s->wait_ms >= 0 && now_ms - s->since_ms >= s->wait_ms)
        return SEEKING_GIVE_UP;
    if (now_ms >= s->say_ms) {
        s->say_ms = now_ms + SEEKING_SAY_MS;
        return SEEKING_SAY;
    }
    if (now_ms >= s->renew_ms) { /* a connection can be dead without ZeroMQ noticing */
        s->renew_pause_ms = earlier(2 * s->renew_pause_ms, SEEKING_RENEW_MAX_MS);
        s->renew_ms = now_ms + s->renew_pause_ms;
        return SEEKING_RENEW;
    }
    if (now_ms >= s->hello_ms) {
        s->hello_ms = now_ms + SEEKING_HELLO_MS;
        return SEEKING_HELLO;
    }
    return SEEKING_WAIT;
}

int64_t seeking_deadline(const struct seeking *s)
{
    int64_t deadline = earlier(s->hello_ms, earlier(s->say_ms, s->renew_ms));
    return s->wait_ms >= 0 ? earlier(deadline, s->since_ms + s->wait_ms) : deadline;
}
