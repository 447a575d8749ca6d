/* The worker's session at work: fetching files, loading jobs, and returning bands. */
#include "tests/unit/session_help.h"
#include "trace/survey.h"

/* What a coordinator that breaks the protocol gets: everything dropped, and a pause before the next HELLO. */
static void assert_broken_off(const char *reason)
{
    char expected[200];
    snprintf(expected, sizeof expected, "the coordinator broke the protocol (%s); starting anew", reason);
    assert_string_equal(said, expected);
    tick(999, "");
    tick(1, "HELLO");
    receive(plain(MESSAGE_WELCOME), "");
    said[0] = '\0';
}

/* --- fetching --------------------------------------------------------------------------------------------- */

static void test_window(void **state)
{
    (void)state;
    start_joined(false);
    size_t listed[] = {make_file(6 * MESSAGE_CHUNK_MAX + 5, 1)}, manifest = make_manifest(listed, 1);
    receive(job(3, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0, NEED a@1, NEED a@2, NEED a@3");
    receive(asset(0, 0), "NEED a@4");
    receive(asset(0, 1), "NEED a@5");
    receive(asset(0, 2), "NEED a@6");
    for (size_t chunk = 3; chunk < 6; chunk++)
        receive(asset(0, chunk), "");
    receive(asset(0, 6), "LOAD 3");
    struct job_settings settings;
    struct asset_set assets = {0};
    assert_string_equal(session_assets(session, 3, &settings, &assets), "file0");
    assert_int_equal(settings.height, HEIGHT);
    assert_int_equal(assets.count, 1);
    assert_int_equal(assets.assets[0].bytes.size, files[0].bytes.size);
    assert_memory_equal(assets.assets[0].bytes.data, files[0].bytes.data, files[0].bytes.size);
    assert_int_equal(assets.assets[0].bytes.data[files[0].bytes.size], 0); /* the NUL that readers expect */
    asset_set_finish(&assets);
}

/* A whole number of chunks needs no empty one behind them. */
static void test_exact_chunks(void **state)
{
    (void)state;
    start_joined(false);
    size_t listed[] = {make_file(2 * MESSAGE_CHUNK_MAX, 1)}, manifest = make_manifest(listed, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0, NEED a@1");
    receive(asset(0, 0), "");
    receive(asset(0, 1), "LOAD 0");
}

static void test_empty_asset(void **state)
{
    (void)state;
    start_joined(false);
    size_t listed[] = {make_file(10, 1), make_file(0, 0), make_file(0, 9)}, manifest = make_manifest(listed, 3);
    receive(job(0, manifest), "NEED d@0");
    receive(asset(manifest, 0), "NEED a@0");
    receive(asset(0, 0), "NEED b@0");
    receive(asset(1, 0), "LOAD 0"); /* the third file is as empty as the second */
    struct job_settings settings;
    struct asset_set assets = {0};
    session_assets(session, 0, &settings, &assets);
    assert_int_equal(assets.count, 3);
    assert_int_equal(assets.assets[1].bytes.size, 0);
    assert_int_equal(assets.assets[2].bytes.data[0], 0);
    asset_set_finish(&assets);
}

/* Nothing is sent twice: not a file that two jobs share, nor one that a manifest lists twice, nor a whole job. */
static void test_cache(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(10, 1), b = make_file(20, 2);
    size_t first = make_manifest((size_t[]){a, b, a}, 3), second = make_manifest((size_t[]){b, a}, 2);
    receive(job(0, first), "NEED c@0");
    receive(asset(first, 0), "NEED a@0");
    receive(asset(a, 0), "NEED b@0");
    receive(asset(b, 0), "LOAD 0");
    receive(job(1, second), "NEED d@0");
    receive(asset(second, 0), "LOAD 1");
    receive(job(2, first), "LOAD 2");
    receive(end_of(0), "FORGET 0");
    receive(end_of(1), "FORGET 1");
    receive(end_of(2), "FORGET 2");
    receive(job(3, second), "LOAD 3");
}

static void test_wrong_chunks(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(3 * MESSAGE_CHUNK_MAX, 1), manifest = make_manifest(&a, 1);
    for (int wrong = 0; wrong < 4; wrong++) {
        struct message message = asset(a, wrong == 0 ? 1 : 0); /* 0: out of order */
        receive(job(0, manifest), wrong == 0 ? "NEED b@0" : "NEED a@0, NEED a@1, NEED a@2");
        if (wrong == 0)
            receive(asset(manifest, 0), "NEED a@0, NEED a@1, NEED a@2");
        if (wrong == 1)
            message.asset.size--;
        if (wrong == 2)
            message.asset.total++;
        if (wrong == 3)
            receive(message, ""); /* and the same again */
        receive(message, "FORGET 0, RECONNECT");
        assert_broken_off("an asset's chunks do not fit together");
    }
}

static void test_wrong_digest(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(100, 1), manifest = make_manifest(&a, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0");
    struct message message = asset(a, 0);
    files[a].bytes.data[50] ^= 1;
    receive(message, "FORGET 0, RECONNECT");
    assert_broken_off("an asset's bytes do not have its digest");
    files[a].bytes.data[50] ^= 1;
    receive(job(0, manifest), "NEED a@0");
    receive(asset(a, 0), "LOAD 0");
}

/* Chunks that nobody waits for: of files that are complete, or that were never asked for. */
static void test_stray_chunks(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(100, 1), manifest = make_manifest(&a, 1);
    receive(asset(a, 0), "");
    receive(job(0, manifest), "NEED b@0");
    receive(asset(a, 0), "");
    receive(asset(manifest, 0), "NEED a@0");
    receive(asset(manifest, 0), "");
    receive(asset(a, 0), "LOAD 0");
    receive(asset(a, 0), "");
}

static void test_bad_manifest(void **state)
{
    (void)state;
    start_joined(false);
    struct bytes nonsense = {0};
    bytes_put_u32(&nonsense, 5);
    size_t a = make_file(100, 1), good = make_manifest(&a, 1), bad = keep_file(&nonsense);
    receive(job(0, bad), "NEED c@0");
    receive(job(1, good), "");
    receive(asset(bad, 0), "FAILED 0, NEED b@0"); /* and goes on with the other */
    receive(asset(good, 0), "NEED a@0");
    receive(asset(a, 0), "LOAD 1");
    receive(band(0, 1, 0, 1), "FORGET 1, FORGET 0, RECONNECT");
    assert_broken_off("a band that is not of a ready job");
}

/* The end of one job does not disturb what another is fetching, though chunks are on their way. */
static void test_end_while_another_fetches(void **state)
{
    (void)state;
    start_ready(false);
    size_t big = make_file(6 * MESSAGE_CHUNK_MAX, 7), manifest = make_manifest(&big, 1);
    receive(job(1, manifest), "NEED d@0");
    receive(asset(manifest, 0), "NEED c@0, NEED c@1, NEED c@2, NEED c@3");
    receive(asset(big, 0), "NEED c@4");
    receive(end_of(0), "FORGET 0");
    for (size_t chunk = 1; chunk < 5; chunk++)
        receive(asset(big, chunk), chunk == 1 ? "NEED c@5" : "");
    receive(asset(big, 5), "LOAD 1");
}

/* A job ends in the middle of its file. Another one wants the same: it goes on; nobody does: it is dropped. */
static void test_end_while_it_fetches(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(2 * MESSAGE_CHUNK_MAX, 1), manifest = make_manifest(&a, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(job(1, manifest), "");
    receive(asset(manifest, 0), "NEED a@0, NEED a@1");
    receive(asset(a, 0), "");
    receive(end_of(0), "FORGET 0");
    receive(asset(a, 1), "LOAD 1");
    size_t c = make_file(2 * MESSAGE_CHUNK_MAX, 2), other = make_manifest(&c, 1);
    receive(job(2, other), "NEED d@0");
    receive(asset(other, 0), "NEED c@0, NEED c@1");
    receive(asset(c, 0), "");
    receive(end_of(2), "FORGET 2");
    receive(asset(c, 1), "");
    receive(job(3, other), "NEED c@0, NEED c@1");
    receive(asset(c, 0), "");
    receive(asset(c, 1), "LOAD 3");
}

/* --- jobs ------------------------------------------------------------------------------------------------- */

/* The connection is lost with a message that goes before the order to load another job. */
static void test_lost_before_a_load(void **state)
{
    (void)state;
    start_ready(false);
    struct bytes text = {0};
    bytes_put(&text, "no manifest", 12);
    size_t broken = keep_file(&text);
    receive(end_of(0), "FORGET 0");
    receive(job(1, broken), "NEED c@0");
    receive(job(2, 1), ""); /* its files are there already */
    struct message chunk = asset(broken, 0);
    chunk.epoch = EPOCH;
    session_handle(session, &(struct session_event){.kind = SESSION_MESSAGE, .message = &chunk}, now_ms);
    struct session_action action;
    assert_true(session_take(session, &action) && action.kind == SESSION_SEND); /* FAILED 1 */
    bytes_finish(&action.bytes);
    session_send_failed(session, now_ms);
    expect("FORGET 2, FORGET 1, RECONNECT"); /* and no LOAD 2 */
}

static void test_jobs_in_turn(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(10, 1), b = make_file(20, 2);
    size_t first = make_manifest(&a, 1), second = make_manifest(&b, 1);
    receive(job(0, first), "NEED c@0");
    receive(job(1, second), ""); /* one file at a time */
    receive(asset(first, 0), "NEED a@0");
    receive(asset(a, 0), "LOAD 0, NEED d@0");
    receive(asset(second, 0), "NEED b@0");
    loaded(0, "READY 0");
    loaded(0, ""); /* said twice */
    receive(asset(b, 0), "LOAD 1");
    handle((struct session_event){.kind = SESSION_LOAD_FAILED, .job = 1, .reason = "bad"}, "FAILED 1");
    loaded(1, "");
    loaded(9, ""); /* of a job that is over */
    receive(job(0, first), "FORGET 1, FORGET 0, RECONNECT");
    assert_broken_off("a job was announced twice");
}

/* --- bands ------------------------------------------------------------------------------------------------ */

static void test_result(void **state)
{
    (void)state;
    enum { SIZE = 2 * MESSAGE_CHUNK_MAX + 17 };
    start_ready(false);
    receive(band(0, 8, 96, 4), "START 0 #8 96+4");
    rendered(8, SIZE, "RESULT 0 #8, RESULT 0 #8, RESULT 0 #8");
    assert_int_equal(returned.size, SIZE);
    for (size_t i = 0; i < SIZE; i++)
        assert_int_equal(returned.data[i], (uint8_t)(8 + i * 7 + i / 999));
    receive((struct message){.kind = MESSAGE_ACK, .ack = {8}}, "");
    receive((struct message){.kind = MESSAGE_ACK, .ack = {8}}, "");
    receive((struct message){.kind = MESSAGE_ACK, .ack = {123}}, "");
    rendered(8, 10, "");
}

static void test_revoke(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    receive(band(0, 2, 4, 4), "START 0 #2 4+4");
    receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {1}}, "CANCEL #1");
    rendered(1, 50, "");
    rendered(2, 50, "RESULT 0 #2");
    receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {2}}, "CANCEL #2");
    receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {99}}, "CANCEL #99");
    receive(band(0, 1, 0, 4), "START 0 #1 0+4"); /* its number is free again */
}

/* Under a lease that is given anew the band may come back twice. */
static void test_lease_given_twice(void **state)
{
    (void)state;
    start_ready(false);
    receive(band(0, 1, 0, 1), "START 0 #1 0+1");
    receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {1}}, "CANCEL #1");
    receive(band(0, 1, 0, 1), "START 0 #1 0+1");
    rendered(1, 50, "RESULT 0 #1");
    rendered(1, 50, "");
}

static void test_end(void **state)
{
    (void)state;
    start_ready(false);
    receive(job(1, 1), "LOAD 1");
    loaded(1, "READY 1");
    receive(band(0, 1, 0, 4), "START 0 #1 0+4");
    receive(band(1, 2, 0, 4), "START 1 #2 0+4");
    receive(end_of(0), "FORGET 0");
    receive(end_of(0), "");
    rendered(1, 50, "");
    rendered(2, 50, "RESULT 1 #2");
}

static void test_wrong_bands(void **state)
{
    (void)state;
    static const struct {
        uint32_t job;
        uint64_t lease;
        uint32_t first_row, rows;
    } wrong[] = {{1, 5, 0, 1}, {0, 1, 8, 1}, {0, 5, HEIGHT, 1}, {0, 5, HEIGHT - 1, 2}, {0, 5, 60000, 5000}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        finish(NULL);
        start_ready(false);
        receive(band(0, 1, 0, 1), "START 0 #1 0+1");
        receive(band(wrong[i].job, wrong[i].lease, wrong[i].first_row, wrong[i].rows), "FORGET 0, RECONNECT");
        assert_broken_off("a band that is not of a ready job");
    }
}

/* Nor more than the worker said that it can take. */
static void test_too_many_bands(void **state)
{
    (void)state;
    start_ready(false);
    for (uint64_t lease = 1; lease <= 4; lease++) {
        char start[40];
        snprintf(start, sizeof start, "START 0 #%u 0+1", (unsigned)lease);
        receive(band(0, lease, 0, 1), start);
    }
    receive(band(0, 5, 0, 1), "FORGET 0, RECONNECT");
    assert_broken_off("more bands than this worker can take");
}

/* The rows of a survey are those of its grid. */
static void test_survey(void **state)
{
    (void)state;
    uint32_t down = survey_grid(64, HEIGHT).down;
    start_ready(false);
    receive(survey_band(0, 1, 0, 1), "START SURVEY 0 #1 0+1");
    rendered(1, SURVEY_BYTES, "RESULT 0 #1");
    char last[40];
    snprintf(last, sizeof last, "START SURVEY 0 #2 %u+1", down - 1);
    receive(survey_band(0, 2, down - 1, 1), last);
    receive(survey_band(0, 3, down - 1, 2), "FORGET 0, RECONNECT");
    assert_broken_off("a band that is not of a ready job");
}

static void test_sampling_of_bands(void **state)
{
    (void)state;
    static const struct {
        struct band_sampling sampling;
        bool renders, surveys;
    } cases[] = {
        {{1, 1, 0}, true, false},   {{7, 7, 255}, true, false},  {{65536, 65536, 0}, true, false},
        {{1, 4, 0}, true, true},    {{1, 1024, 255}, true, true}, {{1, 65536, 9}, true, true},
        {{4, 16, 100}, true, false}, {{2, 16, 100}, false, false}, {{8, 16, 100}, true, false},
        {{1, 2, 100}, false, false}, {{1, 1000, 9}, false, false}, {{4, 12, 9}, false, false},
    };
    for (size_t i = 0; i < 2 * (sizeof cases / sizeof *cases); i++) {
        bool survey = i % 2, good = survey ? cases[i / 2].surveys : cases[i / 2].renders;
        struct message message = survey ? survey_band(0, 1, 0, 1) : band(0, 1, 0, 1);
        message.band.sampling = cases[i / 2].sampling;
        finish(NULL);
        start_ready(false);
        receive(message, !good ? "FORGET 0, RECONNECT" : survey ? "START SURVEY 0 #1 0+1" : "START 0 #1 0+1");
    }
}

static void test_band_too_early(void **state)
{
    (void)state;
    start_joined(false);
    size_t a = make_file(10, 1), manifest = make_manifest(&a, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0");
    receive(asset(a, 0), "LOAD 0");
    receive(band(0, 1, 0, 1), "FORGET 0, RECONNECT");
    loaded(0, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_window, finish),
        cmocka_unit_test_teardown(test_exact_chunks, finish),
        cmocka_unit_test_teardown(test_empty_asset, finish),
        cmocka_unit_test_teardown(test_cache, finish),
        cmocka_unit_test_teardown(test_wrong_chunks, finish),
        cmocka_unit_test_teardown(test_wrong_digest, finish),
        cmocka_unit_test_teardown(test_stray_chunks, finish),
        cmocka_unit_test_teardown(test_bad_manifest, finish),
        cmocka_unit_test_teardown(test_end_while_another_fetches, finish),
        cmocka_unit_test_teardown(test_end_while_it_fetches, finish),
        cmocka_unit_test_teardown(test_lost_before_a_load, finish),
        cmocka_unit_test_teardown(test_jobs_in_turn, finish),
        cmocka_unit_test_teardown(test_result, finish),
        cmocka_unit_test_teardown(test_revoke, finish),
        cmocka_unit_test_teardown(test_lease_given_twice, finish),
        cmocka_unit_test_teardown(test_end, finish),
        cmocka_unit_test_teardown(test_wrong_bands, finish),
        cmocka_unit_test_teardown(test_too_many_bands, finish),
        cmocka_unit_test_teardown(test_survey, finish),
        cmocka_unit_test_teardown(test_sampling_of_bands, finish),
        cmocka_unit_test_teardown(test_band_too_early, finish),
    };
    return cmocka_run_group_tests_name("session at work", tests, NULL, NULL);
}
