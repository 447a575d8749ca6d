/*
 * The floating-point environment: numbers below the normal range survive in a process as it starts and in the render
 * threads of a worker. A library's constructor that turns flushing to zero on (as linking with -ffast-math does) would
 * change pixels of every thread made after it.
 */
#include <fenv.h>
#include <float.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __x86_64__
#include <xmmintrin.h>
#endif

#include <cmocka.h>

#include "tests/scene_builder.h"
#include "wire/rows.h"
#include "worker/pool.h"

static void the_process_rounds_to_nearest_and_flushes_nothing(void **state)
{
    (void)state;
    volatile double least_normal = DBL_MIN, least = DBL_TRUE_MIN, one = 1, tiny = 0x0.8p-53;
    assert_int_equal(fegetround(), FE_TONEAREST);
    assert_true(one + tiny == 1);
    assert_true(least_normal / 2 == DBL_MIN / 2); /* a result */
    assert_true(least / DBL_TRUE_MIN == 1);       /* an operand */
}

/* --- in a render thread ----------------------------------------------------------------------------------- */

static void await(struct pool *pool, enum pool_outcome_kind kind, struct pool_outcome *outcome)
{
    struct pollfd ready = {.fd = pool_descriptor(pool), .events = POLLIN};
    while (!pool_take(pool, outcome))
        assert_int_equal(poll(&ready, 1, 10000), 1);
    assert_int_equal(outcome->kind, kind);
}

/* A worker's way with a picture of one pixel: its red, as a float. */
static float pool_look(const char *text)
{
    struct asset_set assets = {0};
    struct bytes bytes = {0};
    bytes_put(&bytes, text, strlen(text) + 1);
    bytes.size--; /* the NUL follows the text and is not part of it */
    asset_set_add(&assets, "look.json", &bytes);
    const struct job_settings settings = {.width = 1, .height = 1, .pixel_format = PIXEL_LINEAR};
    const struct order order = {PASS_RENDER, 0, 1, {1, 1, 0}};
    struct error error;
    struct pool *pool = pool_create(1, kernel_default(), &error);
    assert_non_null(pool);
    struct pool_outcome outcome;
    pool_load(pool, 1, "look.json", &assets, &settings);
    await(pool, POOL_LOADED, &outcome);
    assert_true(pool_start(pool, 1, 1, &order));
    await(pool, POOL_BAND, &outcome);
    float red;
    memcpy(&red, outcome.bytes.data + ROW_FIGURES_BYTES, sizeof red); /* AArch64 and x86 are little-endian */
    bytes_finish(&outcome.bytes);
    pool_destroy(&pool);
    return red;
}

static void a_render_thread_keeps_subnormal_numbers(void **state)
{
    (void)state;
    float red = pool_look("{\"camera\": {\"from\": [0, 0, 1], \"at\": [0, 0, 0], \"fov\": 45}, \"background\": 1e-40}");
    assert_true(red == 1e-40f);
    assert_true(red > 0);
}

/* --- that it would be seen -------------------------------------------------------------------------------- */

static struct vec3 look_at_faint_surroundings(void)
{
    struct scene scene = scene_at(vec3_make(0, 0, 1), 45);
    scene.background.color[0] = vec3_make(1e-310, 1e-310, 1e-310);
    struct vec3 seen = scene_look(&scene);
    scene_finish(&scene);
    return seen;
}

static void flushing_would_be_seen(void **state)
{
    (void)state;
    assert_true(look_at_faint_surroundings().x == 1e-310);
#ifdef __x86_64__
    enum { FLUSH_TO_ZERO = 0x8000, DENORMALS_ARE_ZERO = 0x0040 };
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | FLUSH_TO_ZERO | DENORMALS_ARE_ZERO);
    struct vec3 flushed = look_at_faint_surroundings();
    _mm_setcsr(before);
    assert_true(flushed.x == 0);
#endif
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_process_rounds_to_nearest_and_flushes_nothing),
        cmocka_unit_test(a_render_thread_keeps_subnormal_numbers),
        cmocka_unit_test(flushing_would_be_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
