/* The worker's session: finding a coordinator, losing it, and ending. */
#include "tests/unit/session_help.h"

/* --- seeking ---------------------------------------------------------------------------------------------- */

static void test_hello_again(void **state)
{
    (void)state;
    start(false, -1);
    assert_true(session_deadline(session) == now_ms);
    tick(0, "HELLO");
    assert_true(session_deadline(session) == now_ms + SEEKING_HELLO_MS);
    tick(SEEKING_HELLO_MS - 1, "");
    tick(1, "HELLO");
    for (int64_t ms = 2 * SEEKING_HELLO_MS; ms < SEEKING_RENEW_MS; ms += SEEKING_HELLO_MS)
        tick(SEEKING_HELLO_MS, "HELLO");
    assert_string_equal(said, "");
    tick(SEEKING_HELLO_MS, "RECONNECT, HELLO"); /* a connection may be dead without anybody noticing */
    assert_string_equal(said, "waiting for a coordinator");
}

/* The connection is given up after a while, then after longer ones: perhaps thousands knock. */
static void test_renewal(void **state)
{
    (void)state;
    static const int64_t pauses_ms[] = {5000, 10000, 20000, 20000};
    start(false, -1);
    for (size_t i = 0; i < sizeof pauses_ms / sizeof *pauses_ms; i++) {
        tick(pauses_ms[i] - 1, "HELLO");
        tick(1, "RECONNECT");
    }
    receive(plain(MESSAGE_WELCOME), "");
    tick(SESSION_SILENCE_MS, "RECONNECT");
    tick(SEEKING_RENEW_MS, "RECONNECT, HELLO"); /* it begins anew */
}

/* Without a connection it tries again soon, then less and less often. */
static void test_hello_without_connection(void **state)
{
    (void)state;
    static const int64_t pauses_ms[] = {1, 2, 4, 8, 16, 32, 64, 128, 200, 200};
    start(false, -1);
    tick(0, "HELLO");
    for (size_t i = 0; i < sizeof pauses_ms / sizeof *pauses_ms; i++) {
        session_send_failed(session, now_ms);
        assert_true(session_deadline(session) == now_ms + pauses_ms[i]);
        tick(pauses_ms[i] - 1, "");
        tick(1, "HELLO");
    }
}

static void test_waiting_ends(void **state)
{
    (void)state;
    start(false, 3000 + SEEKING_HELLO_MS / 2);
    tick(0, "HELLO");
    tick(3000, "HELLO");
    assert_true(session_deadline(session) == now_ms + SEEKING_HELLO_MS / 2);
    tick(SEEKING_HELLO_MS / 2 - 1, "");
    tick(1, "EXIT 1");
    assert_string_equal(said, "no coordinator answered within 3 s");
    assert_true(session_deadline(session) == INT64_MAX);
    tick(100000, ""); /* over is over */
}

/* A coordinator that refuses a key, or has another, cannot be told from one that is not there. */
static void test_waiting_with_keys(void **state)
{
    (void)state;
    start_with((struct session_config){.keyed = true, .wait_ms = 6000});
    tick(0, "HELLO");
    tick(SEEKING_RENEW_MS, "RECONNECT, HELLO");
    assert_string_equal(said, "waiting for a coordinator (if there is one, its keys and this worker's may not match)");
    tick(1000, "EXIT 1");
    assert_string_equal(said, "no coordinator answered within 6 s (if there is one, its keys and this worker's may not "
                              "match)");
}

/* The wait counts anew from when a coordinator was lost. */
static void test_waiting_begins_anew(void **state)
{
    (void)state;
    start(false, 7000);
    tick(6000, "RECONNECT, HELLO");
    receive(plain(MESSAGE_WELCOME), "");
    tick(SESSION_SILENCE_MS, "RECONNECT");
    tick(6999, "RECONNECT, HELLO");
    tick(1, "EXIT 1");
}

static void test_refusal(void **state)
{
    (void)state;
    struct message refusal = {.kind = MESSAGE_REFUSE, .refuse = {"other sources"}};
    start(false, -1);
    tick(0, "HELLO");
    receive_from(0, refusal, "");
    assert_string_equal(said, "the coordinator refused this worker: other sources");
    tick(4999, "");
    tick(1, "RECONNECT");
    tick(4999, "");
    tick(1, "HELLO"); /* perhaps another one listens there now */
    receive(plain(MESSAGE_WELCOME), "");
    assert_int_equal(beats, 1);
    receive_from(0, refusal, ""); /* a welcome cannot be taken back */
    start(true, -1);
    tick(0, "HELLO");
    receive_from(0, refusal, "EXIT 1");
}

/* --- being there ------------------------------------------------------------------------------------------ */

static void test_beats(void **state)
{
    (void)state;
    start_joined(false);
    assert_string_equal(said, "joined a coordinator");
    assert_int_equal(beats, 1);
    now_ms += SESSION_BEAT_MS;
    assert_true(session_deadline(session) == now_ms);
    handle((struct session_event){.kind = SESSION_TICK, .progress = 12, .rays = 3456}, "");
    assert_int_equal(beats, 2);
    assert_int_equal(beat.beat.progress, 12);
    assert_int_equal(beat.beat.rays, 3456);
    tick(SESSION_BEAT_MS - 1, "");
    assert_int_equal(beats, 2);
    tick(1, "");
    assert_int_equal(beats, 3);
}

static void test_silence(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    tick(SESSION_SILENCE_MS - 1, "");
    receive(plain(MESSAGE_BEAT), ""); /* heard again */
    tick(SESSION_SILENCE_MS - 1, "");
    receive_from(EPOCH + 1, plain(MESSAGE_BEAT), ""); /* that was another */
    tick(1, "FORGET 0, RECONNECT");
    assert_string_equal(said, "no word from the coordinator for 5 s; looking for it again");
    rendered(1, 50, "HELLO"); /* nobody wants it now */
    receive(plain(MESSAGE_WELCOME), "");
    rendered(1, 50, "");
}

static void test_lost_connection(void **state)
{
    (void)state;
    start_ready(false);
    session_send_failed(session, now_ms);
    expect("FORGET 0, RECONNECT");
    assert_true(session_deadline(session) == now_ms);
    tick(0, "HELLO");
}

static void test_other_epochs(void **state)
{
    (void)state;
    start_ready(false);
    receive_from(EPOCH - 1, band(0, 1, 0, 4), "");
    receive_from(EPOCH - 1, end_of(0), "");
    receive_from(EPOCH - 1, plain(MESSAGE_WELCOME), "");
    receive_from(EPOCH - 1, plain(MESSAGE_GOODBYE), "");
    receive_from(0, plain(MESSAGE_GOODBYE), "");
    receive(plain(MESSAGE_WELCOME), ""); /* the same said again, since HELLO was said twice */
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
}

/* Before the welcome nothing counts. */
static void test_strangers(void **state)
{
    (void)state;
    start(false, -1);
    size_t listed[] = {make_file(10, 1)}, manifest = make_manifest(listed, 1);
    tick(0, "HELLO");
    receive(job(0, manifest), "");
    receive(band(0, 1, 0, 4), "");
    receive_from(0, plain(MESSAGE_GOODBYE), "");
    receive(plain(MESSAGE_DRAIN), ""); /* what no coordinator says */
}

/* --- going ------------------------------------------------------------------------------------------------ */

static void test_goodbye(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    receive(plain(MESSAGE_GOODBYE), "GOODBYE, FORGET 0, RECONNECT, HELLO");
    receive(plain(MESSAGE_WELCOME), "");
    receive(job(0, 1), "LOAD 0"); /* its files are still there */
    finish(NULL);
    start_ready(true);
    receive(plain(MESSAGE_GOODBYE), "GOODBYE, FORGET 0, EXIT 0");
}

/* A coordinator that took this worker for dead goes on without it, and would rather have it back. */
static void test_given_up(void **state)
{
    (void)state;
    for (int once = 0; once < 2; once++) {
        start_ready(once);
        receive(band(0, 1, 0, 4), "START 0 #1 0+4");
        receive((struct message){.kind = MESSAGE_REFUSE, .refuse = {"it was silent"}}, "FORGET 0, RECONNECT, HELLO");
        assert_string_equal(said, "the coordinator gave this worker up (it was silent); joining anew");
        receive(plain(MESSAGE_WELCOME), "");
        finish(NULL);
    }
}

/* A coordinator whose job could not be loaded would say goodbye and welcome in turn for ever. */
static void test_goodbye_to_the_unfit(void **state)
{
    (void)state;
    start_joined(false);
    size_t listed[] = {make_file(10, 1)}, manifest = make_manifest(listed, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0");
    receive(asset(listed[0], 0), "LOAD 0");
    handle((struct session_event){.kind = SESSION_LOAD_FAILED, .job = 0, .reason = "no such thing"}, "FAILED 0");
    assert_string_equal(said, "cannot work on job 0: no such thing");
    receive(plain(MESSAGE_GOODBYE), "GOODBYE, FORGET 0, RECONNECT");
    tick(4999, "");
    tick(1, "RECONNECT");
    tick(4999, "");
    tick(1, "HELLO");
    receive(plain(MESSAGE_WELCOME), "");
    receive(plain(MESSAGE_GOODBYE), "GOODBYE, RECONNECT, HELLO"); /* of this one it said nothing */
}

static void test_drain_while_seeking(void **state)
{
    (void)state;
    start(false, -1);
    handle((struct session_event){.kind = SESSION_DRAIN}, "EXIT 0");
}

static void test_drain_while_idle(void **state)
{
    (void)state;
    start_ready(false);
    handle((struct session_event){.kind = SESSION_DRAIN}, "DRAIN, GOODBYE, EXIT 0");
    rendered(5, 10, "");
    receive(plain(MESSAGE_GOODBYE), "");
}

/* Bands are finished first, and each result stays until it is acknowledged. */
static void test_drain_while_rendering(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    receive(band(0, 2, 4, 4), "START 0 #2 4+4");
    handle((struct session_event){.kind = SESSION_DRAIN}, "DRAIN");
    rendered(1, 50, "RESULT 0 #1");
    bytes_finish(&returned);
    receive((struct message){.kind = MESSAGE_ACK, .ack = {1}}, "");
    rendered(2, 50, "RESULT 0 #2");
    tick(1000, "");
    receive((struct message){.kind = MESSAGE_ACK, .ack = {2}}, "GOODBYE, EXIT 0");
}

static void test_drain_ends_otherwise(void **state)
{
    (void)state;
    for (int how = 0; how < 4; how++) {
        finish(NULL);
        start_ready(false);
        receive(band(0, 1, 0, 4), "START 0 #1 0+4");
        handle((struct session_event){.kind = SESSION_DRAIN}, "DRAIN");
        if (how == 0)
            receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {1}}, "CANCEL #1, GOODBYE, EXIT 0");
        else if (how == 1)
            receive(end_of(0), "FORGET 0, GOODBYE, EXIT 0");
        else if (how == 2)
            receive(plain(MESSAGE_GOODBYE), "GOODBYE, FORGET 0, EXIT 0");
        else
            tick(SESSION_SILENCE_MS, "FORGET 0, EXIT 0");
    }
}

static void test_drain_while_fetching(void **state)
{
    (void)state;
    start_joined(false);
    size_t listed[] = {make_file(10, 1)}, manifest = make_manifest(listed, 1);
    receive(job(0, manifest), "NEED b@0");
    handle((struct session_event){.kind = SESSION_DRAIN}, "DRAIN, GOODBYE, EXIT 0");
}

/* Whatever is left inside, in actions that nobody took too, is freed with the session. */
static void test_destroy(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    struct bytes records = {0};
    bytes_extend(&records, 300000);
    memset(records.data, 0, records.size);
    session_handle(session, &(struct session_event){.kind = SESSION_RENDERED, .lease = 1, .records = &records}, now_ms);
    session_destroy(&session);
    session_destroy(&session);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_hello_again, finish),
        cmocka_unit_test_teardown(test_renewal, finish),
        cmocka_unit_test_teardown(test_hello_without_connection, finish),
        cmocka_unit_test_teardown(test_waiting_ends, finish),
        cmocka_unit_test_teardown(test_waiting_with_keys, finish),
        cmocka_unit_test_teardown(test_waiting_begins_anew, finish),
        cmocka_unit_test_teardown(test_refusal, finish),
        cmocka_unit_test_teardown(test_beats, finish),
        cmocka_unit_test_teardown(test_silence, finish),
        cmocka_unit_test_teardown(test_lost_connection, finish),
        cmocka_unit_test_teardown(test_other_epochs, finish),
        cmocka_unit_test_teardown(test_strangers, finish),
        cmocka_unit_test_teardown(test_goodbye, finish),
        cmocka_unit_test_teardown(test_given_up, finish),
        cmocka_unit_test_teardown(test_goodbye_to_the_unfit, finish),
        cmocka_unit_test_teardown(test_drain_while_seeking, finish),
        cmocka_unit_test_teardown(test_drain_while_idle, finish),
        cmocka_unit_test_teardown(test_drain_while_rendering, finish),
        cmocka_unit_test_teardown(test_drain_ends_otherwise, finish),
        cmocka_unit_test_teardown(test_drain_while_fetching, finish),
        cmocka_unit_test_teardown(test_destroy, finish),
    };
    return cmocka_run_group_tests_name("session", tests, NULL, NULL);
}
