/*
 * The survey: where it looks, what it notes, and its bytes.
 */
#include "trace/survey.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"

enum { BLOCK = 6 }; /* pixels each way, where the image has them */

/* --- the grid --------------------------------------------------------------------------------------------- */

static void check_stretch(uint32_t length, uint32_t side, uint32_t cells)
{
    assert_true((uint64_t)cells * side >= length);
    assert_true((uint64_t)(cells - 1) * side < length);
}

static void check_grid(uint32_t width, uint32_t height)
{
    struct survey_grid grid = survey_grid(width, height);
    assert_true(grid.width == width && grid.height == height && grid.side >= BLOCK);
    check_stretch(width, grid.side, grid.across);
    check_stretch(height, grid.side, grid.down);
}

/* Any order of magnitude is as likely. */
static uint32_t random_side(uint32_t index, uint32_t draw)
{
    return (uint32_t)pow(65535, random_between(index, draw, 0, 1));
}

static void cells_cover_the_image(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {7, 3}, {8, 8}, {9, 8}, {65535, 1},
                                {1, 65535}, {65535, 65535}, {1920, 1080}};
    print_message("# seed %d\n", TEST_SEED);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        check_grid(sizes[i][0], sizes[i][1]);
    for (uint32_t i = 0; i < 1000; i++)
        check_grid(random_side(i, 0), random_side(i, 1));
}

/* Of an image as wide as high, about as many cells as the survey means to have: of a small one as many as have room for
 * blocks, of larger ones 128, then one for every 16×16 pixels, and at last 1,024. Cells have sides of whole pixels, and
 * those at the edges are whole ones' equals: a quarter more or less. */
static void surveys_see_enough_but_not_too_much(void **state)
{
    (void)state;
    const struct {
        uint32_t side, cells;
    } cases[] = {{8, 4}, {40, 49}, {128, 128}, {400, 625}, {2000, 1024}, {60000, 1024}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct survey_grid grid = survey_grid(cases[i].side, cases[i].side);
        double cells = (double)grid.across * grid.down;
        assert_true(cells >= 0.75 * cases[i].cells && cells <= 1.25 * cases[i].cells);
    }
}

/* --- blocks ----------------------------------------------------------------------------------------------- */

/* The scalar kernel, which marks pixels as it takes samples of them. A kernel's calls take no context, so this is
 * global. */
enum { WATCHED = 1 << 16 };
static struct {
    uint32_t width, height;   /* of the image */
    uint8_t sampled[WATCHED]; /* more than once: those of the block that are followed, not its neighbours */
} watched;

static void watching_camera(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths)
{
    for (size_t i = 0; i < rays->count && rays->samples > 1; i++) {
        assert_true(rays->pixel_x[i] < watched.width && rays->pixel_y[i] < watched.height);
        watched.sampled[rays->pixel_y[i] * watched.width + rays->pixel_x[i]] = 1;
    }
    kernel_ref.camera(plan, rays, paths);
}

static bool is_in_cell(const struct survey_grid *grid, uint32_t x, uint32_t y, uint32_t cell_x, uint32_t cell_y)
{
    return x / grid->side == cell_x && y / grid->side == cell_y;
}

/* The pixels that were sampled more than once: `expected`, and all in the cell. */
static void check_sampled(const struct survey_grid *grid, uint32_t cell_x, uint32_t cell_y, uint64_t expected)
{
    uint64_t found = 0;
    for (uint32_t i = 0; i < watched.width * watched.height; i++)
        if (watched.sampled[i]) {
            assert_true(is_in_cell(grid, i % watched.width, i / watched.width, cell_x, cell_y));
            found++;
        }
    assert_int_equal(found, expected);
}

static uint32_t length_within(uint32_t length, uint32_t side, uint32_t cell)
{
    uint32_t left = length - cell * side;
    return left < BLOCK ? left : BLOCK;
}

static void check_blocks(uint32_t width, uint32_t height)
{
    struct scene scene = scene_at(vec3_make(0, 0, 4), 40);
    struct kernel watching = kernel_ref;
    struct survey_grid grid = survey_grid(width, height);
    watching.camera = watching_camera;
    scene.width = watched.width = width;
    scene.height = watched.height = height;
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct tracer *tracer = tracer_create(plan, &watching);
    for (uint32_t y = 0; y < grid.down; y++)
        for (uint32_t x = 0; x < grid.across; x++) {
            struct survey survey = {0};
            uint64_t pixels = (uint64_t)length_within(width, grid.side, x) * length_within(height, grid.side, y);
            uint64_t share = pixels / 3 + 1; /* where all is even, one of so many is followed */
            memset(watched.sampled, 0, sizeof watched.sampled);
            survey_cells(tracer, &(struct sampling){1, 16, 80}, &grid, x, 1, y, &survey, &(struct ray_counts){0});
            assert_int_equal(survey.pixels, HISTORY_TRIALS * pixels);
            check_sampled(&grid, x, y, (pixels + share - 1) / share);
        }
    tracer_destroy(&tracer);
    plan_destroy(&plan);
    scene_finish(&scene);
}

static void blocks_lie_within_their_cells(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {7, 3}, {9, 8}, {100, 60}, {331, 97}, {3000, 1}, {5, 999}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        check_blocks(sizes[i][0], sizes[i][1]);
}

/* --- what is noted ---------------------------------------------------------------------------------------- */

/* Wide, so that a row has more cells than are traced together. */
static struct scene balls_scene(void)
{
    struct scene scene = scene_at(vec3_make(1.3, 3.1, 5.7), 40);
    scene.width = 600;
    scene.height = 20;
    scene.background.color[0] = vec3_make(0.2, 0.3, 0.4);
    scene_add(&scene, shape_plane(vec3_make(0, -1, 0), vec3_make(0, 1, 0)), material_matte(grey(0.8)));
    scene_add(&scene, shape_sphere(vec3_make(0, 0, 0), 1), material_mirror(grey(0.7)));
    scene_add(&scene, shape_sphere(vec3_make(1.4, 0, 0.5), 0.6), material_matte(vec3_make(0.9, 0.2, 0.1)));
    scene_add_light(&scene, light_point(vec3_make(3, 8, 2), grey(0.9)));
    return scene;
}

/* All cells, so many of a row at a time, from the first or from the last on, each time noted on its own and then added,
 * or all into one. */
static struct survey survey_image(const struct plan *plan, const struct sampling *sampling, uint32_t run, bool backwards,
                                  bool apart)
{
    struct survey survey = {0};
    struct survey_grid grid = survey_grid(plan->settings.width, plan->settings.height);
    struct tracer *tracer = tracer_create(plan, kernel_default());
    uint32_t runs = (grid.across + run - 1) / run;
    for (uint32_t i = 0; i < runs * grid.down; i++) {
        uint32_t at = backwards ? runs * grid.down - 1 - i : i, x = at % runs * run, left = grid.across - x;
        struct survey part = {0};
        survey_cells(tracer, sampling, &grid, x, left < run ? left : run, at / runs, apart ? &part : &survey,
                     &(struct ray_counts){0});
        survey_add(&survey, &part);
    }
    tracer_destroy(&tracer);
    return survey;
}

static void a_survey_is_the_same_in_any_order(void **state)
{
    (void)state;
    struct scene scene = balls_scene();
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct sampling sampling = survey_sampling(64, 0.01);
    struct survey expected = survey_image(plan, &sampling, 1, false, false);
    assert_true(survey_grid(scene.width, scene.height).across > SURVEY_RUN);
    for (uint32_t i = 1; i < 8; i++) {
        struct survey found = survey_image(plan, &sampling, i < 4 ? i : 10 * i, i & 1, i & 2);
        assert_memory_equal(&found, &expected, sizeof found);
    }
    assert_true(expected.rays > expected.pixels);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* What is known beforehand of any picture: with a higher threshold or a greater least no pixel gets fewer samples,
 * each gets as many as the policy's least or more, and none more than the most. */
static void noted_samples_rise_with_the_threshold(void **state)
{
    (void)state;
    struct scene scene = balls_scene();
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct sampling sampling = survey_sampling(256, 0.01);
    struct survey survey = survey_image(plan, &sampling, 1000, false, false);
    for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++) {
        assert_int_equal(survey_outcome(&survey, policy, 0).samples, survey.pixels << 2 * policy);
        assert_true(survey_outcome(&survey, policy, SAMPLING_THRESHOLDS - 1).samples <= (int64_t)(256 * survey.pixels));
        for (uint32_t i = 1; i < SAMPLING_THRESHOLDS; i++) {
            assert_true(survey.steps[policy][i].samples >= 0);
            assert_true(policy == 0 || survey_outcome(&survey, policy, i).samples >=
                                           survey_outcome(&survey, policy - 1, i).samples);
        }
    }
    assert_true(survey_outcome(&survey, 0, sampling.threshold).samples > (int64_t)(2 * survey.pixels));
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* --- sums and bytes --------------------------------------------------------------------------------------- */

/* A survey is numbers of 8 bytes and nothing else. */
enum { NUMBERS = sizeof(struct survey) / 8 };

/* Both signs, below 2^63 / divisor. */
static struct survey random_survey(uint32_t index, int64_t divisor)
{
    static int64_t numbers[NUMBERS];
    struct survey survey;
    assert_int_equal(sizeof survey, SURVEY_BYTES);
    for (uint32_t i = 0; i < NUMBERS; i++) {
        uint64_t high = hash_u32(TEST_SEED + index * NUMBERS + i), low = hash_u32(i ^ index << 16);
        numbers[i] = (int64_t)(high << 32 | low) / divisor;
    }
    memcpy(&survey, numbers, sizeof survey);
    return survey;
}

static void surveys_survive_their_bytes(void **state)
{
    (void)state;
    uint8_t bytes[SURVEY_BYTES], again[SURVEY_BYTES];
    for (uint32_t i = 0; i < 20; i++) {
        struct survey survey = random_survey(i, 1), read;
        survey.pixels = 0x0807060504030201;
        survey_write(&survey, bytes);
        for (int k = 0; k < 8; k++)
            assert_int_equal(bytes[k], k + 1);
        survey_read(&read, bytes);
        assert_memory_equal(&read, &survey, sizeof read);
        survey_write(&read, again);
        assert_memory_equal(again, bytes, SURVEY_BYTES);
    }
}

/* The order in which they are members. */
static void bytes_are_in_order(void **state)
{
    (void)state;
    uint8_t bytes[SURVEY_BYTES];
    struct survey survey = {.pixels = 1, .rays = 2};
    survey.steps[0][0] = (struct survey_outcome){3, {-1, 5}, {6, 7}};
    survey.steps[SURVEY_POLICIES - 1][SAMPLING_THRESHOLDS - 1].estimated[1] = 8;
    survey_write(&survey, bytes);
    const uint8_t first[7] = {1, 2, 3, 0xff, 5, 6, 7};
    for (int i = 0; i < 7; i++) {
        assert_int_equal(bytes[8 * i], first[i]);
        assert_int_equal(bytes[8 * i + 7], i == 3 ? 0xff : 0);
    }
    assert_int_equal(bytes[SURVEY_BYTES - 8], 8);
}

/* Three surveys in two orders; every number is added, so that both sums are of all of them. */
static void addition_has_no_order(void **state)
{
    (void)state;
    struct survey part[3], ab = {0}, ba = {0};
    for (uint32_t i = 0; i < 3; i++)
        part[i] = random_survey(i, 4);
    for (int i = 0; i < 3; i++) {
        survey_add(&ab, &part[i]);
        survey_add(&ba, &part[2 - i]);
    }
    assert_memory_equal(&ab, &ba, sizeof ab);
    assert_true(ab.rays == part[0].rays + part[1].rays + part[2].rays);
    const struct survey_outcome *sum = &ab.steps[3][255], *first = &part[0].steps[3][255];
    assert_true(sum->estimated[1] == first->estimated[1] + part[1].steps[3][255].estimated[1] +
                                         part[2].steps[3][255].estimated[1]);
    assert_true(sum->error[0] == first->error[0] + part[1].steps[3][255].error[0] + part[2].steps[3][255].error[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_cover_the_image),
        cmocka_unit_test(surveys_see_enough_but_not_too_much),
        cmocka_unit_test(blocks_lie_within_their_cells),
        cmocka_unit_test(a_survey_is_the_same_in_any_order),
        cmocka_unit_test(noted_samples_rise_with_the_threshold),
        cmocka_unit_test(surveys_survive_their_bytes),
        cmocka_unit_test(bytes_are_in_order),
        cmocka_unit_test(addition_has_no_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
