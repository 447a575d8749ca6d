/*
 * What a liar says beside what its session does: anything but pixels that are wrong and fit their band, which only a
 * second opinion could tell (or, from strangers on the way, CURVE).
 */
#ifndef WEFT_TESTS_LIES_H
#define WEFT_TESTS_LIES_H

#include "tests/sim/worker_loop.h"

static void say_lie(struct worker *w, struct message lie)
{
    struct bytes bytes = {0};
    bool first = lie.kind == MESSAGE_HELLO || lie.kind == MESSAGE_REFUSE || lie.kind == MESSAGE_ASK;
    lie.epoch = first ? 0 : w->epoch ^ chance(10);
    message_encode(&lie, &bytes);
    network_send_up(w->link, bytes.data, bytes.size);
    bytes_finish(&bytes);
}

/* Bytes that are no message, or begin like one. */
static void say_garbage(struct worker *w)
{
    struct bytes bytes = {0};
    if (chance(50)) {
        bytes_put(&bytes, "WEFT", 4);
        bytes_put_u16(&bytes, PROTOCOL_VERSION);
        bytes_put_u8(&bytes, (uint8_t)draw(0, MESSAGE_KINDS));
        bytes_put_u64(&bytes, w->epoch);
    }
    for (uint32_t i = draw(1, 100); i > 0; i--)
        bytes_put_u8(&bytes, (uint8_t)draw(0, 255));
    network_send_up(w->link, bytes.data, bytes.size);
    bytes_finish(&bytes);
}

/* A result that does not fit: a wrong size, a wrong place, or the beginning of one that never goes on. */
static void say_result(struct worker *w, uint64_t lease)
{
    static const uint8_t data[1000];
    uint32_t total = chance(60) && w->lease_bytes > 0 ? (uint32_t)w->lease_bytes : draw(1, 200000);
    uint32_t offset = chance(70) ? 0 : draw(0, total - 1), most = total - offset - 1;
    say_lie(w, (struct message){.kind = MESSAGE_RESULT, .result = {
        .job = draw(0, 3), .lease = lease, .offset = offset, .total = total, .data = data,
        .size = draw(0, most < sizeof data ? most : sizeof data)}});
}

static void say_hello(struct worker *w)
{
    say_lie(w, (struct message){.kind = MESSAGE_HELLO, .hello = {
        .host = "liar", .kernel = "none", .pid = draw(90, 110), .threads = MESSAGE_THREADS_MAX,
        .credit = 4 * MESSAGE_THREADS_MAX}});
}

/* What only a coordinator has to say, or who is no worker. */
static void say_out_of_place(struct worker *w)
{
    static const enum message_kind kinds[] = {MESSAGE_WELCOME, MESSAGE_REFUSE, MESSAGE_ACK, MESSAGE_REVOKE,
                                              MESSAGE_END,     MESSAGE_ASK};
    say_lie(w, (struct message){.kind = kinds[draw(0, sizeof kinds / sizeof *kinds - 1)]});
}

/* Of what it has said before, word by word. */
static void say_again(struct worker *w)
{
    if (w->told.size > 0)
        network_send_up(w->link, w->told.data, w->told.size);
}

static void tell_lie(struct worker *w)
{
    const uint32_t jobs[] = {0, 1, 2, 1000, UINT32_MAX};
    switch (draw(0, 11)) {
    case 0:
        return say_garbage(w);
    case 1:
        return say_result(w, w->lease);
    case 2:
        return say_result(w, draw(0, (uint32_t)w->lease + 2)); /* another's, or one that is over, or nobody's */
    case 3:
        return say_lie(w, (struct message){.kind = MESSAGE_READY, .ready = {jobs[draw(0, 4)]}});
    case 4:
        return say_hello(w);
    case 5:
        return say_lie(w, (struct message){.kind = MESSAGE_NEED, .need = {.digest = {{(uint8_t)draw(0, 255)}}}});
    case 6:
        return say_lie(w, (struct message){.kind = MESSAGE_NEED, .need = {
            .digest = farm.pictures[0]->manifest, .offset = (uint64_t)draw(0, UINT32_MAX - 1) << draw(0, 32)}});
    case 7:
        return say_out_of_place(w);
    case 8:
    case 9:
        return say_again(w);
    case 10:
        return say_lie(w, (struct message){.kind = MESSAGE_BEAT, .beat = {UINT64_MAX, UINT64_MAX}});
    default:
        if (chance(20))
            say_lie(w, (struct message){.kind = chance(50) ? MESSAGE_FAILED : MESSAGE_DRAIN, .failed = {.job = 0}});
        else if (chance(20))
            say_lie(w, (struct message){.kind = MESSAGE_GOODBYE});
    }
}

#endif
