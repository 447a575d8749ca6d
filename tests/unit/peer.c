/* A worker as the coordinator knows it: results that come in parts, and how fast it is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/peer.h"

enum { TOTAL = 1000 };

static struct peer peer;
static uint8_t records[TOTAL];

static int start(void **state)
{
    (void)state;
    peer = (struct peer){.number = 1};
    for (size_t i = 0; i < TOTAL; i++)
        records[i] = (uint8_t)(i * 13 + i / 256);
    return 0;
}

static int finish(void **state)
{
    (void)state;
    peer_finish(&peer);
    assert_null(peer.incoming);
    assert_int_equal(peer.incoming_count, 0);
    return 0;
}

enum taken { PART, WHOLE, WRONG };

/* Sends records[offset..offset + size) under a lease; a whole is compared. */
static enum taken send_part(uint64_t lease, uint64_t offset, uint32_t size, uint64_t total)
{
    struct message message = {.kind = MESSAGE_RESULT, .result = {.lease = lease, .offset = offset, .total = total,
                                                                 .data = records + offset, .size = size}};
    struct bytes whole = {0};
    bool fits;
    bool complete = peer_take_chunk(&peer, &message, TOTAL, &whole, &fits);
    assert_true(fits || !complete);
    assert_int_equal(whole.size, complete ? TOTAL : 0);
    if (complete)
        assert_memory_equal(whole.data, records, TOTAL);
    bytes_finish(&whole);
    return complete ? WHOLE : fits ? PART : WRONG;
}

static void test_one_chunk(void **state)
{
    (void)state;
    assert_int_equal(send_part(7, 0, TOTAL, TOTAL), WHOLE);
    assert_int_equal(peer.incoming_count, 0);
    assert_int_equal(send_part(7, 0, TOTAL, TOTAL), WHOLE); /* what a lease is, others know */
}

/* The parts of several bands mix; of each band they come in order. */
static void test_mixed_chunks(void **state)
{
    (void)state;
    for (uint32_t offset = 0; offset < TOTAL; offset += 100)
        for (uint64_t lease = 1; lease <= 5; lease++)
            assert_int_equal(send_part(lease, offset, 100, TOTAL), offset + 100 < TOTAL ? PART : WHOLE);
    assert_int_equal(peer.incoming_count, 0);
}

static void test_empty_chunk(void **state)
{
    (void)state;
    assert_int_equal(send_part(1, 0, 0, TOTAL), PART);
    assert_int_equal(send_part(1, 0, TOTAL, TOTAL), WHOLE);
}

static void test_chunks_that_do_not_fit(void **state)
{
    (void)state;
    assert_int_equal(send_part(1, 0, 400, TOTAL), PART);
    assert_int_equal(send_part(1, 0, 400, TOTAL), WRONG);       /* again */
    assert_int_equal(send_part(1, 500, 100, TOTAL), WRONG);     /* a gap */
    assert_int_equal(send_part(1, 400, 601, TOTAL), WRONG);     /* too long */
    assert_int_equal(send_part(1, 400, 600, TOTAL + 1), WRONG); /* of something else */
    assert_int_equal(send_part(2, 10, 100, TOTAL), WRONG);      /* not from the start */
    assert_int_equal(send_part(3, 0, 100, TOTAL - 1), WRONG);
    assert_int_equal(send_part(1, 400, 600, TOTAL), WHOLE);     /* the rest is untouched */
}

static void test_drop(void **state)
{
    (void)state;
    for (uint64_t lease = 1; lease <= 3; lease++)
        assert_int_equal(send_part(lease, 0, 400, TOTAL), PART);
    peer_drop(&peer, 1);
    peer_drop(&peer, 99);
    assert_int_equal(peer.incoming_count, 2);
    assert_int_equal(send_part(1, 400, 600, TOTAL), WRONG); /* it would begin anew */
    assert_int_equal(send_part(3, 400, 600, TOTAL), WHOLE);
    assert_int_equal(send_part(2, 400, 600, TOTAL), WHOLE);
}

/* A worker that had traced a thousand million rays before it joined is not fast for that. */
static void test_rate(void **state)
{
    (void)state;
    const uint64_t before = 1000000000;
    peer.joined_ms = peer.rate_from_ms = 10000;
    peer_take_beat(&peer, before, 10000);
    assert_int_equal(peer_rays(&peer), 0);
    assert_true(peer_rate(&peer, 10000) == 0);
    peer_take_beat(&peer, before + 3000, 11000);
    assert_int_equal(peer_rays(&peer), 3000);
    assert_true(peer_rate(&peer, 11000) == 3000);
    peer_take_beat(&peer, before + 4000, 12000); /* the first span is over */
    assert_true(peer_rate(&peer, 12000) == 2000);
    peer_take_beat(&peer, before + 9000, 13000); /* in the middle of the next */
    assert_true(peer_rate(&peer, 13000) == 2000);
    peer_take_beat(&peer, before + 14000, 14000);
    assert_true(peer_rate(&peer, 14000) == 5000);
    peer.rays_returned = 20000; /* more than the last beat knew */
    assert_int_equal(peer_rays(&peer), 20000);
    peer.gone = true;
    assert_true(peer_rate(&peer, 15000) == 0);
}

/* Figures that go backwards are a peer's nonsense, and no more. */
static void test_rays_backwards(void **state)
{
    (void)state;
    peer_take_beat(&peer, 5000, 0);
    peer_take_beat(&peer, 9000, 2000);
    assert_true(peer.rays_per_second == 2000);
    peer_take_beat(&peer, 100, 4000);
    assert_true(peer.rays_per_second == 2000);
    assert_int_equal(peer.rays, 0);
    peer_take_beat(&peer, UINT64_MAX, 6000);
    assert_true(peer.rays_per_second > 0);
}

/* --- bands ------------------------------------------------------------------------------------------------ */

static void give(uint64_t lease, uint32_t first_row, int64_t now_ms)
{
    peer_give_band(&peer, &(struct held_band){lease, 0, PASS_RENDER, first_row, 4}, now_ms);
}

static double answer(uint32_t first_row, int64_t now_ms)
{
    return peer_answer_band(&peer, 0, PASS_RENDER, first_row, now_ms);
}

/* All of its threads work on what it was given first, and begin when that comes or what was before it is done. */
static void test_work(void **state)
{
    (void)state;
    peer.threads = 3;
    give(1, 0, 1000);
    give(2, 4, 1000);
    give(3, 8, 1050);
    assert_true(answer(0, 1100) == 300);
    assert_true(answer(8, 1110) == 30); /* out of turn: there was work on both */
    assert_true(answer(4, 1130) == 60);
    assert_int_equal(peer.held_count, 0);
    give(4, 12, 5000);
    assert_true(answer(12, 5010) == 30);
}

static void test_work_on_a_revoked_band_is_lost(void **state)
{
    (void)state;
    peer.threads = 1;
    for (uint32_t i = 0; i < 3; i++)
        give(i, 4 * i, 0);
    peer_revoke_band(&peer, 1, 50);
    peer_revoke_band(&peer, 0, 70);
    peer_revoke_band(&peer, 99, 80); /* unknown */
    assert_int_equal(peer.held_count, 1);
    assert_true(answer(8, 100) == 30);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_one_chunk, start, finish),
        cmocka_unit_test_setup_teardown(test_mixed_chunks, start, finish),
        cmocka_unit_test_setup_teardown(test_empty_chunk, start, finish),
        cmocka_unit_test_setup_teardown(test_chunks_that_do_not_fit, start, finish),
        cmocka_unit_test_setup_teardown(test_drop, start, finish),
        cmocka_unit_test_setup_teardown(test_rate, start, finish),
        cmocka_unit_test_setup_teardown(test_rays_backwards, start, finish),
        cmocka_unit_test_setup_teardown(test_work, start, finish),
        cmocka_unit_test_setup_teardown(test_work_on_a_revoked_band_is_lost, start, finish),
    };
    return cmocka_run_group_tests_name("peer", tests, NULL, NULL);
}
