/* The render pool with real threads: equal bytes in any split, and bands and jobs that are taken away under way. */
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "scene/load.h"
#include "trace/tracer.h"
#include "wire/rows.h"
#include "worker/pool.h"

enum {
    WIDTH = 150, HEIGHT = 37, /* no multiples of a tile's sides */
    PATIENCE_MS = 60000,      /* longer than anything here takes on a busy machine; a test that meets it has failed */
    SLOW_SAMPLES = 50,        /* a pixel, where work is to be disturbed */
};

static const char scene_text[] =
    "{\"camera\": {\"from\": [0, 1, 5], \"at\": [0, 0.7, 0]}, \"background\": \"#8ac\","
    " \"lights\": [{\"type\": \"point\", \"position\": [3, 5, 4]},"
    "  {\"type\": \"directional\", \"direction\": [1, -2, -1]}],"
    " \"objects\": [{\"type\": \"plane\", \"point\": [0, 0, 0], \"normal\": [0, 1, 0],"
    "   \"material\": {\"color\": {\"type\": \"checker\", \"colors\": [\"#eee\", \"#234\"], \"size\": 0.5}}},"
    "  {\"type\": \"sphere\", \"center\": [-1, 1, 0], \"radius\": 1, \"material\": {\"reflection\": 0.6}},"
    "  {\"type\": \"sphere\", \"center\": [1.2, 0.8, 1], \"radius\": 0.8, \"material\": {\"ior\": 1.5}}]}";

static struct pool *pool;

/* --- help ------------------------------------------------------------------------------------------------- */

static struct asset_set assets_of(const char *text)
{
    struct asset_set assets = {0};
    struct bytes bytes = {0};
    bytes_put(&bytes, text, strlen(text) + 1);
    bytes.size--;
    asset_set_add(&assets, "scene.json", &bytes);
    return assets;
}

static bool is_readable(void)
{
    struct pollfd descriptor = {.fd = pool_descriptor(pool), .events = POLLIN};
    return poll(&descriptor, 1, 0) == 1;
}

static struct pool_outcome wait_for_outcome(void)
{
    struct pool_outcome outcome;
    while (!pool_take(pool, &outcome)) {
        struct pollfd descriptor = {.fd = pool_descriptor(pool), .events = POLLIN};
        assert_int_equal(poll(&descriptor, 1, PATIENCE_MS), 1);
    }
    return outcome;
}

static void begin_load(uint32_t job, const char *text, uint32_t samples)
{
    struct asset_set assets = assets_of(text);
    const struct trace_settings settings = {WIDTH, HEIGHT, samples, FILTER_TENT};
    pool_load(pool, job, "scene.json", &assets, &settings, PIXEL_SRGB16);
    assert_int_equal(assets.count, 0);
    assert_null(assets.assets);
}

static void load(uint32_t job, uint32_t samples)
{
    begin_load(job, scene_text, samples);
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.kind, POOL_LOADED);
    assert_int_equal(outcome.job, job);
}

static void start(int threads)
{
    pool_destroy(&pool);
    struct error error;
    pool = pool_create(threads, &kernel_ref, &error);
    assert_non_null(pool);
}

static int finish(void **state)
{
    (void)state;
    pool_destroy(&pool);
    assert_null(pool);
    pool_destroy(&pool);
    return 0;
}

static size_t record_bytes(void)
{
    return row_record_bytes(WIDTH * pixel_format_bytes(PIXEL_SRGB16));
}

/* Appends the record of row y, which the tracer renders in one piece. */
static void put_record(struct bytes *records, struct tracer *tracer, uint32_t y)
{
    struct vec3 pixels[WIDTH];
    struct ray_counts counts = {0};
    tracer_area(tracer, &(struct pixel_area){0, WIDTH, y, y + 1}, pixels, &counts);
    uint8_t *record = bytes_extend(records, record_bytes());
    row_figures_write(record, &(struct row_figures){counts.camera, counts.secondary, counts.shadow});
    pixel_format_encode(PIXEL_SRGB16, pixels, WIDTH, record + ROW_FIGURES_BYTES);
}

/* The records of the whole picture without a pool: what every split must give. The caller frees. */
static struct bytes expected_records(uint32_t samples)
{
    struct asset_set assets = assets_of(scene_text);
    struct scene scene;
    struct error error;
    struct bytes records = {0};
    if (scene_load(&scene, "scene.json", &assets, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    struct plan *plan = plan_create(&scene, &(struct trace_settings){WIDTH, HEIGHT, samples, FILTER_TENT}, 1);
    struct tracer *tracer = tracer_create(plan, &kernel_ref);
    for (uint32_t y = 0; y < HEIGHT; y++)
        put_record(&records, tracer, y);
    tracer_destroy(&tracer);
    plan_destroy(&plan);
    scene_finish(&scene);
    asset_set_finish(&assets);
    return records;
}

/* Takes the next band, frees it, and compares it: its lease is its first row + 1. */
static uint64_t take_band(const struct bytes *expected)
{
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.kind, POOL_BAND);
    size_t start_bytes = (outcome.lease - 1) * record_bytes();
    assert_true(outcome.bytes.size > 0 && start_bytes + outcome.bytes.size <= expected->size);
    assert_memory_equal(outcome.bytes.data, expected->data + start_bytes, outcome.bytes.size);
    bytes_finish(&outcome.bytes);
    return outcome.lease;
}

/* Starts bands of the whole picture at once; returns how many. */
static size_t start_bands(uint32_t job, uint32_t band_rows)
{
    size_t count = 0;
    for (uint32_t row = 0; row < HEIGHT; row += band_rows, count++)
        assert_true(pool_start(pool, row + 1, job, row, HEIGHT - row < band_rows ? HEIGHT - row : band_rows));
    return count;
}

/* --- rendering -------------------------------------------------------------------------------------------- */

static void test_equal_bytes(void **state)
{
    (void)state;
    static const int threads[] = {1, 2, 3, 7};
    static const uint32_t band_rows[] = {1, 2, 3, 4, 5, 8, HEIGHT};
    struct bytes expected = expected_records(1);
    for (size_t t = 0; t < sizeof threads / sizeof *threads; t++) {
        start(threads[t]);
        load(0, 1);
        for (size_t b = 0; b < sizeof band_rows / sizeof *band_rows; b++)
            for (size_t left = start_bands(0, band_rows[b]); left > 0; left--)
                take_band(&expected);
    }
    bytes_finish(&expected);
}

/* Two jobs at once, and a picture whose bands belong to both. */
static void test_two_jobs(void **state)
{
    (void)state;
    struct bytes expected = expected_records(1);
    start(3);
    load(4, 1);
    load(5, 1);
    for (uint32_t row = 0; row < HEIGHT; row++)
        assert_true(pool_start(pool, row + 1, 4 + row % 2, row, 1));
    for (uint32_t row = 0; row < HEIGHT; row++)
        take_band(&expected);
    bytes_finish(&expected);
}

static void test_progress(void **state)
{
    (void)state;
    uint64_t tiles, rays, expected_rays = 0;
    struct bytes expected = expected_records(1);
    for (uint32_t y = 0; y < HEIGHT; y++) {
        struct row_figures figures;
        row_record_decode(expected.data + y * record_bytes(), &figures);
        expected_rays += row_figures_rays(&figures);
    }
    start(2);
    load(0, 1);
    pool_progress(pool, &tiles, &rays);
    assert_int_equal(tiles, 0);
    assert_int_equal(rays, 0);
    assert_true(pool_start(pool, 1, 0, 0, HEIGHT));
    take_band(&expected);
    pool_progress(pool, &tiles, &rays);
    assert_int_equal(tiles, 3 * 10); /* of 64 × 4 pixels */
    assert_int_equal(rays, expected_rays);
    bytes_finish(&expected);
}

/* --- what cannot be --------------------------------------------------------------------------------------- */

static void test_load_failure(void **state)
{
    (void)state;
    start(2);
    begin_load(3, "{\"camera\": 5}", 1);
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.kind, POOL_LOAD_FAILED);
    assert_int_equal(outcome.job, 3);
    assert_non_null(strstr(outcome.error.text, "scene.json"));
    assert_false(pool_start(pool, 1, 3, 0, 1));
    pool_forget(pool, 3);
    load(3, 1);
    assert_true(pool_start(pool, 1, 3, 0, 1));
}

static void test_wrong_rows(void **state)
{
    (void)state;
    start(1);
    assert_false(pool_start(pool, 1, 0, 0, 1));
    begin_load(1, scene_text, 1);
    pool_forget(pool, 1); /* before, while or after it loads */
    assert_false(pool_start(pool, 1, 1, 0, 1));
    pool_cancel(pool, 7);
    pool_forget(pool, 7);
    start(1);
    load(0, 1);
    assert_false(pool_start(pool, 1, 0, 0, 0));
    assert_false(pool_start(pool, 1, 0, HEIGHT, 1));
    assert_false(pool_start(pool, 1, 0, HEIGHT - 1, 2));
    assert_false(pool_start(pool, 1, 0, 1, UINT32_MAX));
    assert_false(pool_start(pool, 1, 1, 0, 1));
    struct pool_outcome outcome;
    assert_false(pool_take(pool, &outcome));
}

/* --- the descriptor --------------------------------------------------------------------------------------- */

static void test_descriptor(void **state)
{
    (void)state;
    struct pool_outcome outcome;
    start(2);
    assert_false(is_readable());
    assert_false(pool_take(pool, &outcome));
    load(0, 1);
    assert_true(pool_start(pool, 1, 0, 0, 4));
    outcome = wait_for_outcome();
    bytes_finish(&outcome.bytes);
    assert_false(pool_take(pool, &outcome));
    assert_false(is_readable()); /* once pool_take has said that there is no more */
    assert_true(pool_start(pool, 2, 0, 4, 4));
    assert_true(pool_start(pool, 3, 0, 8, 4));
    struct pollfd descriptor = {.fd = pool_descriptor(pool), .events = POLLIN};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(poll(&descriptor, 1, PATIENCE_MS), 1);
        outcome = wait_for_outcome();
        bytes_finish(&outcome.bytes);
    }
    assert_false(pool_take(pool, &outcome));
    assert_false(is_readable());
}

/* --- taking away ------------------------------------------------------------------------------------------ */

/* Takes what waits; sets seen[] of its leases. */
static void take_waiting(bool seen[HEIGHT + 1])
{
    struct pool_outcome outcome;
    while (pool_take(pool, &outcome)) {
        assert_int_equal(outcome.kind, POOL_BAND);
        assert_false(seen[outcome.lease]);
        seen[outcome.lease] = true;
        bytes_finish(&outcome.bytes);
    }
}

/* Every second band is cancelled at once; the others come, and none of those that had not come by then. */
static void test_cancel(void **state)
{
    (void)state;
    struct bytes expected = expected_records(SLOW_SAMPLES);
    bool seen[HEIGHT + 1] = {false};
    start(3);
    load(0, SLOW_SAMPLES);
    start_bands(0, 1);
    for (uint64_t lease = 2; lease <= HEIGHT; lease += 2)
        pool_cancel(pool, lease);
    take_waiting(seen);
    size_t left = 0;
    for (uint64_t lease = 1; lease <= HEIGHT; lease += 2)
        left += !seen[lease];
    for (; left > 0; left--)
        assert_int_equal(take_band(&expected) % 2, 1);
    assert_true(pool_start(pool, 2, 0, 1, 1)); /* a lease that was cancelled, again */
    assert_int_equal(take_band(&expected), 2);
    bytes_finish(&expected);
}

/* A job forgotten under way can be had again under its number at once. */
static void test_forget(void **state)
{
    (void)state;
    struct bytes expected = expected_records(1);
    bool seen[HEIGHT + 1] = {false};
    start(3);
    load(0, SLOW_SAMPLES);
    load(1, 1);
    start_bands(0, 1);
    pool_forget(pool, 0);
    take_waiting(seen);
    assert_false(pool_start(pool, 1, 0, 0, 1));
    for (size_t left = start_bands(1, 5); left > 0; left--) /* would show bands of the old job, by their bytes */
        take_band(&expected);
    load(0, 1);
    for (size_t left = start_bands(0, 3); left > 0; left--)
        take_band(&expected);
    bytes_finish(&expected);
}

static void test_destroy_while_busy(void **state)
{
    (void)state;
    for (int threads = 1; threads <= 4; threads++) {
        start(threads);
        begin_load(0, scene_text, 1);
        begin_load(1, scene_text, 1);
        pool_destroy(&pool); /* while it loads */
        start(threads);
        load(0, SLOW_SAMPLES);
        start_bands(0, 1);
        pool_cancel(pool, 3);
        pool_destroy(&pool); /* while it renders */
        start(threads);
        load(0, 1);
        start_bands(0, 2);
        struct pollfd descriptor = {.fd = pool_descriptor(pool), .events = POLLIN};
        assert_int_equal(poll(&descriptor, 1, PATIENCE_MS), 1);
        pool_destroy(&pool); /* with outcomes that nobody took */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_equal_bytes, finish),  cmocka_unit_test_teardown(test_two_jobs, finish),
        cmocka_unit_test_teardown(test_progress, finish),     cmocka_unit_test_teardown(test_load_failure, finish),
        cmocka_unit_test_teardown(test_wrong_rows, finish),   cmocka_unit_test_teardown(test_descriptor, finish),
        cmocka_unit_test_teardown(test_cancel, finish),       cmocka_unit_test_teardown(test_forget, finish),
        cmocka_unit_test_teardown(test_destroy_while_busy, finish),
    };
    return cmocka_run_group_tests_name("pool", tests, NULL, NULL);
}
