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
#include "trace/survey.h"
#include "trace/tracer.h"
#include "wire/rows.h"
#include "worker/pool.h"

enum {
    WIDTH = 330, HEIGHT = 37, /* no multiples of a tile's sides; more cells across than a survey's tile has */
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

static void begin_load(uint32_t job, const char *text, bool maps)
{
    const struct job_settings settings = {
        .width = WIDTH, .height = HEIGHT, .filter = FILTER_TENT, .pixel_format = PIXEL_SRGB16, .maps = maps};
    struct asset_set assets = assets_of(text);
    pool_load(pool, job, "scene.json", &assets, &settings);
    assert_int_equal(assets.count, 0);
    assert_null(assets.assets);
}

static void load_with(uint32_t job, bool maps)
{
    begin_load(job, scene_text, maps);
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.kind, POOL_LOADED);
    assert_int_equal(outcome.job, job);
}

static void load(uint32_t job)
{
    load_with(job, false);
}

static struct sampling fixed(uint32_t samples)
{
    return (struct sampling){samples, samples, 0};
}

/* Asks for rows of a render. */
static bool ask(uint64_t lease, uint32_t job, uint32_t first_row, uint32_t rows, struct sampling sampling)
{
    return pool_start(pool, lease, job, &(struct order){PASS_RENDER, first_row, rows, sampling});
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

static const struct row_layout layout = {WIDTH * 6, 0}, mapped_layout = {WIDTH * 6, WIDTH};

static size_t record_bytes(void)
{
    return row_record_bytes(&layout);
}

static struct row_figures figures_of(const struct ray_counts *counts, const struct pixel pixels[WIDTH])
{
    struct row_figures figures = {counts->camera, counts->secondary, counts->shadow, {0}, {0}};
    for (uint32_t x = 0; x < WIDTH; x++) {
        figures.error[pixels[x].samples > 1] += (uint64_t)(pixels[x].error / PIXEL_ERROR_UNIT);
        figures.stages[sampling_stage_within(pixels[x].samples)]++;
    }
    return figures;
}

/* Appends the record of row y, which the tracer renders in one piece. */
static void put_record(struct bytes *records, const struct row_layout *as, struct tracer *tracer,
                       const struct sampling *sampling, uint32_t y)
{
    struct pixel pixels[WIDTH];
    struct vec3 light[WIDTH];
    struct ray_counts counts = {0};
    uint8_t *record = bytes_extend(records, row_record_bytes(as));
    tracer_area(tracer, sampling, &(struct pixel_area){0, WIDTH, y, y + 1}, pixels, &counts);
    struct row_figures figures = figures_of(&counts, pixels);
    for (uint32_t x = 0; x < WIDTH; x++) {
        light[x] = pixels[x].light;
        if (as->map_bytes == 0)
            continue;
        record[row_stages_at(as) + x] = (uint8_t)sampling_stage_within(pixels[x].samples);
        record[row_errors_at(as) + x] = row_error_code(pixels[x].error);
    }
    row_figures_write(record, &figures);
    pixel_format_encode(PIXEL_SRGB16, light, WIDTH, record + ROW_FIGURES_BYTES);
}

/* What the scene is without a pool. */
struct traced {
    struct scene scene;
    struct plan *plan;
    struct tracer *tracer;
};

static void traced_init(struct traced *traced)
{
    struct asset_set assets = assets_of(scene_text);
    struct error error;
    if (scene_load(&traced->scene, "scene.json", &assets, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    traced->plan = plan_create(&traced->scene, &(struct trace_settings){WIDTH, HEIGHT, FILTER_TENT}, 1);
    traced->tracer = tracer_create(traced->plan, &kernel_ref);
    asset_set_finish(&assets);
}

static void traced_finish(struct traced *traced)
{
    tracer_destroy(&traced->tracer);
    plan_destroy(&traced->plan);
    scene_finish(&traced->scene);
}

/* The records of the whole picture without a pool: what every split must give. The caller frees. */
static struct bytes records_as(const struct row_layout *as, struct sampling sampling)
{
    struct bytes records = {0};
    struct traced traced;
    traced_init(&traced);
    for (uint32_t y = 0; y < HEIGHT; y++)
        put_record(&records, as, traced.tracer, &sampling, y);
    traced_finish(&traced);
    return records;
}

static struct bytes expected_records(struct sampling sampling)
{
    return records_as(&layout, sampling);
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
static size_t start_bands(uint32_t job, uint32_t band_rows, struct sampling sampling)
{
    size_t count = 0;
    for (uint32_t row = 0; row < HEIGHT; row += band_rows, count++)
        assert_true(ask(row + 1, job, row, HEIGHT - row < band_rows ? HEIGHT - row : band_rows, sampling));
    return count;
}

/* --- rendering -------------------------------------------------------------------------------------------- */

static void check_equal_bytes(struct sampling sampling)
{
    static const int threads[] = {1, 2, 3, 7};
    static const uint32_t band_rows[] = {1, 2, 3, 4, 5, 8, 17, HEIGHT};
    struct bytes expected = expected_records(sampling);
    for (size_t t = 0; t < sizeof threads / sizeof *threads; t++) {
        start(threads[t]);
        load(0);
        for (size_t b = 0; b < sizeof band_rows / sizeof *band_rows; b++)
            for (size_t left = start_bands(0, band_rows[b], sampling); left > 0; left--)
                take_band(&expected);
    }
    bytes_finish(&expected);
}

static void test_equal_bytes(void **state)
{
    (void)state;
    check_equal_bytes(fixed(1));
}

static void test_equal_bytes_of_adaptive_sampling(void **state)
{
    (void)state;
    check_equal_bytes((struct sampling){1, 16, 40});
}

static void test_maps(void **state)
{
    (void)state;
    const struct sampling sampling = {1, 64, 40};
    struct bytes expected = records_as(&mapped_layout, sampling);
    start(2);
    load_with(0, true);
    assert_true(ask(1, 0, 0, HEIGHT, sampling));
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.bytes.size, expected.size);
    assert_memory_equal(outcome.bytes.data, expected.data, expected.size);
    bytes_finish(&outcome.bytes);
    bytes_finish(&expected);
}

/* --- surveys ---------------------------------------------------------------------------------------------- */

static const struct sampling surveying = {1, 64, 60};

/* The survey of rows of cells without a pool. */
static void survey_rows(struct tracer *tracer, uint32_t first_row, uint32_t rows, struct survey *survey)
{
    struct survey_grid grid = survey_grid(WIDTH, HEIGHT);
    struct ray_counts counts = {0};
    for (uint32_t y = first_row; y < first_row + rows; y++)
        survey_cells(tracer, &surveying, &grid, 0, grid.across, y, survey, &counts);
}

/* Row by row and all at once, on one thread and several. */
static void test_survey(void **state)
{
    (void)state;
    struct traced traced;
    uint32_t down = survey_grid(WIDTH, HEIGHT).down;
    assert_true(survey_grid(WIDTH, HEIGHT).across > SURVEY_RUN);
    traced_init(&traced);
    for (int threads = 1; threads <= 3; threads += 2) {
        start(threads);
        load(0);
        for (uint32_t rows = 1; rows <= down; rows += down - 1) {
            for (uint32_t row = 0; row < down; row += rows)
                assert_true(pool_start(pool, row, 0, &(struct order){PASS_SURVEY, row, rows, surveying}));
            for (uint32_t left = down / rows; left > 0; left--) {
                struct pool_outcome outcome = wait_for_outcome();
                struct survey survey = {0};
                uint8_t expected[SURVEY_BYTES];
                survey_rows(traced.tracer, (uint32_t)outcome.lease, rows, &survey);
                survey_write(&survey, expected);
                assert_int_equal(outcome.bytes.size, SURVEY_BYTES);
                assert_memory_equal(outcome.bytes.data, expected, SURVEY_BYTES);
                bytes_finish(&outcome.bytes);
            }
        }
    }
    traced_finish(&traced);
}

/* Two jobs at once, and a picture whose bands belong to both. */
static void test_two_jobs(void **state)
{
    (void)state;
    struct bytes expected = expected_records(fixed(1));
    start(3);
    load(4);
    load(5);
    for (uint32_t row = 0; row < HEIGHT; row++)
        assert_true(ask(row + 1, 4 + row % 2, row, 1, fixed(1)));
    for (uint32_t row = 0; row < HEIGHT; row++)
        take_band(&expected);
    bytes_finish(&expected);
}

static void test_progress(void **state)
{
    (void)state;
    uint64_t batches, rays, expected_rays = 0;
    struct bytes expected = expected_records(fixed(1));
    for (uint32_t y = 0; y < HEIGHT; y++) {
        struct row_figures figures;
        row_figures_read(expected.data + y * record_bytes(), &figures);
        expected_rays += row_figures_rays(&figures);
    }
    start(2);
    load(0);
    pool_progress(pool, &batches, &rays);
    assert_int_equal(batches, 0);
    assert_int_equal(rays, 0);
    assert_true(ask(1, 0, 0, HEIGHT, fixed(1)));
    take_band(&expected);
    pool_progress(pool, &batches, &rays);
    assert_in_range(batches, 6 * 2, 6 * 2 * 3); /* one or some for each tile, of 64 × 32 pixels and 1,024 rays */
    assert_int_equal(rays, expected_rays);
    bytes_finish(&expected);
}

/* --- what cannot be --------------------------------------------------------------------------------------- */

static void test_load_failure(void **state)
{
    (void)state;
    start(2);
    begin_load(3, "{\"camera\": 5}", false);
    struct pool_outcome outcome = wait_for_outcome();
    assert_int_equal(outcome.kind, POOL_LOAD_FAILED);
    assert_int_equal(outcome.job, 3);
    assert_non_null(strstr(outcome.error.text, "scene.json"));
    assert_false(ask(1, 3, 0, 1, fixed(1)));
    pool_forget(pool, 3);
    load(3);
    assert_true(ask(1, 3, 0, 1, fixed(1)));
}

static void test_wrong_rows(void **state)
{
    (void)state;
    start(1);
    assert_false(ask(1, 0, 0, 1, fixed(1)));
    begin_load(1, scene_text, false);
    pool_forget(pool, 1); /* before, while or after it loads */
    assert_false(ask(1, 1, 0, 1, fixed(1)));
    pool_cancel(pool, 7);
    pool_forget(pool, 7);
    start(1);
    load(0);
    assert_false(ask(1, 0, 0, 0, fixed(1)));
    assert_false(ask(1, 0, HEIGHT, 1, fixed(1)));
    assert_false(ask(1, 0, HEIGHT - 1, 2, fixed(1)));
    assert_false(ask(1, 0, 1, UINT32_MAX, fixed(1)));
    assert_false(ask(1, 1, 0, 1, fixed(1)));
    assert_false(ask(1, 0, 0, 1, fixed(0)));
    assert_false(ask(1, 0, 0, 1, (struct sampling){2, 16, 40}));
    assert_false(ask(1, 0, 0, 1, (struct sampling){16, 4, 40}));
    assert_false(pool_start(pool, 1, 0, &(struct order){PASS_SURVEY, 0, 1, fixed(4)}));
    assert_false(pool_start(pool, 1, 0, &(struct order){PASS_SURVEY, survey_grid(WIDTH, HEIGHT).down, 1, surveying}));
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
    load(0);
    assert_true(ask(1, 0, 0, 4, fixed(1)));
    outcome = wait_for_outcome();
    bytes_finish(&outcome.bytes);
    assert_false(pool_take(pool, &outcome));
    assert_false(is_readable()); /* once pool_take has said that there is no more */
    assert_true(ask(2, 0, 4, 4, fixed(1)));
    assert_true(ask(3, 0, 8, 4, fixed(1)));
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
    struct bytes expected = expected_records(fixed(SLOW_SAMPLES));
    bool seen[HEIGHT + 1] = {false};
    start(3);
    load(0);
    start_bands(0, 1, fixed(SLOW_SAMPLES));
    for (uint64_t lease = 2; lease <= HEIGHT; lease += 2)
        pool_cancel(pool, lease);
    take_waiting(seen);
    size_t left = 0;
    for (uint64_t lease = 1; lease <= HEIGHT; lease += 2)
        left += !seen[lease];
    for (; left > 0; left--)
        assert_int_equal(take_band(&expected) % 2, 1);
    assert_true(ask(2, 0, 1, 1, fixed(SLOW_SAMPLES))); /* a lease that was cancelled, again */
    assert_int_equal(take_band(&expected), 2);
    bytes_finish(&expected);
}

/* A job forgotten under way can be had again under its number at once. */
static void test_forget(void **state)
{
    (void)state;
    struct bytes expected = expected_records(fixed(1));
    bool seen[HEIGHT + 1] = {false};
    start(3);
    load(0);
    load(1);
    start_bands(0, 1, fixed(SLOW_SAMPLES));
    pool_forget(pool, 0);
    take_waiting(seen);
    assert_false(ask(1, 0, 0, 1, fixed(1)));
    for (size_t left = start_bands(1, 5, fixed(1)); left > 0; left--)
        take_band(&expected); /* would show bands of the old job, by their bytes */
    load(0);
    for (size_t left = start_bands(0, 3, fixed(1)); left > 0; left--)
        take_band(&expected);
    bytes_finish(&expected);
}

static void test_destroy_while_busy(void **state)
{
    (void)state;
    for (int threads = 1; threads <= 4; threads++) {
        start(threads);
        begin_load(0, scene_text, false);
        begin_load(1, scene_text, false);
        pool_destroy(&pool); /* while it loads */
        start(threads);
        load(0);
        start_bands(0, 1, fixed(SLOW_SAMPLES));
        pool_cancel(pool, 3);
        pool_destroy(&pool); /* while it renders */
        start(threads);
        load(0);
        start_bands(0, 2, fixed(1));
        struct pollfd descriptor = {.fd = pool_descriptor(pool), .events = POLLIN};
        assert_int_equal(poll(&descriptor, 1, PATIENCE_MS), 1);
        pool_destroy(&pool); /* with outcomes that nobody took */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_equal_bytes, finish),
        cmocka_unit_test_teardown(test_equal_bytes_of_adaptive_sampling, finish),
        cmocka_unit_test_teardown(test_maps, finish),         cmocka_unit_test_teardown(test_survey, finish),
        cmocka_unit_test_teardown(test_two_jobs, finish),
        cmocka_unit_test_teardown(test_progress, finish),     cmocka_unit_test_teardown(test_load_failure, finish),
        cmocka_unit_test_teardown(test_wrong_rows, finish),   cmocka_unit_test_teardown(test_descriptor, finish),
        cmocka_unit_test_teardown(test_cancel, finish),       cmocka_unit_test_teardown(test_forget, finish),
        cmocka_unit_test_teardown(test_destroy_while_busy, finish),
    };
    return cmocka_run_group_tests_name("pool", tests, NULL, NULL);
}
