/*
 * Adaptive pictures: the same bits and the same rays from every kernel and however the image is cut up, samples
 * within the bounds, and patterns that are averaged over a pixel's cells without gaps.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/scene_builder.h"
#include "trace/sampling.h"

enum { WIDTH = 71, HEIGHT = 45, PIXELS = WIDTH * HEIGHT };

static struct material checkered(double size)
{
    struct material material = material_glowing(grey(1));
    material.color =
        (struct texture){.kind = TEXTURE_CHECKER, .color = {{0.9, 0.8, 0.7}, {0.1, 0.2, 0.3}}, .size = size};
    return material;
}

/* Of everything that a tracer does: a textured floor up to the horizon, mirrors, glass, smooth triangles, shadows and
 * large even areas. */
static struct scene mixed_scene(enum pixel_filter filter)
{
    struct scene scene = scene_at(vec3_make(1.3, 3.1, 5.7), 50);
    struct material floor = checkered(0.5);
    scene.width = WIDTH;
    scene.height = HEIGHT;
    scene.filter = filter;
    scene.ambient = grey(0.3);
    scene.background.color[0] = vec3_make(0.2, 0.3, 0.4);
    floor.diffuse = 0.7;
    scene_add(&scene, shape_plane(vec3_make(0, -1, 0), vec3_make(0, 1, 0)), floor);
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 1), material_glass(1.5, vec3_make(0.1, 0.3, 0.2)));
    scene_add(&scene, shape_box(vec3_make(0.3, -1, -0.6), vec3_make(1.1, 0.3, 0.4)), material_mirror(grey(0.8)));
    scene_add(&scene, shape_globe(vec3_make(1.6, -0.5, 1), 0.5, 6, 8), material_matte(vec3_make(0.9, 0.2, 0.1)));
    scene_add_light(&scene, light_point(vec3_make(3, 8, 2), grey(0.9)));
    return scene;
}

/* --- renders ---------------------------------------------------------------------------------------------- */

/* A whole picture, and the rays of each of its rows. */
struct picture {
    struct pixel pixels[PIXELS];
    struct ray_counts rows[HEIGHT];
};

static void render_tile(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *tile,
                        struct picture *picture)
{
    static struct pixel pixels[PIXELS];
    uint32_t width = tile->x1 - tile->x0;
    tracer_area(tracer, sampling, tile, pixels, &picture->rows[tile->y0]);
    for (uint32_t y = tile->y0; y < tile->y1; y++)
        memcpy(&picture->pixels[y * WIDTH + tile->x0], &pixels[(y - tile->y0) * width], width * sizeof *pixels);
}

/* By tiles of that size, those at the edges smaller, all by one tracer. The caller frees the picture. */
static struct picture *render(const struct plan *plan, const struct kernel *kernel, const struct sampling *sampling,
                              uint32_t width, uint32_t height)
{
    struct picture *picture = memory_array(1, sizeof *picture);
    struct tracer *tracer = tracer_create(plan, kernel);
    for (uint32_t y = 0; y < HEIGHT; y += height)
        for (uint32_t x = 0; x < WIDTH; x += width) {
            struct pixel_area tile = {x, x + width < WIDTH ? x + width : WIDTH,
                                      y, y + height < HEIGHT ? y + height : HEIGHT};
            render_tile(tracer, sampling, &tile, picture);
        }
    tracer_destroy(&tracer);
    return picture;
}

static struct picture *render_whole(const struct plan *plan, uint32_t least, uint32_t most, uint32_t threshold)
{
    return render(plan, kernel_default(), &(struct sampling){least, most, threshold}, WIDTH, HEIGHT);
}

static bool same_pixels(const struct pixel *a, const struct pixel *b)
{
    return memcmp(&a->light, &b->light, sizeof a->light) == 0 && memcmp(&a->error, &b->error, sizeof a->error) == 0 &&
           a->samples == b->samples;
}

static void assert_same(const struct picture *found, const struct picture *expected, const char *label)
{
    for (uint32_t i = 0; i < PIXELS; i++)
        if (!same_pixels(&found->pixels[i], &expected->pixels[i]))
            fail_msg("%s: pixel (%u, %u) is another", label, i % WIDTH, i / WIDTH);
    for (uint32_t y = 0; y < HEIGHT; y++)
        if (memcmp(&found->rows[y], &expected->rows[y], sizeof *found->rows) != 0)
            fail_msg("%s: row %u has other counts of rays", label, y);
}

/* How many pixels have so many samples. */
static uint32_t count_with(const struct picture *picture, uint32_t samples)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        count += picture->pixels[i].samples == samples;
    return count;
}

static struct plan *plan_of(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    return plan_create(scene, &settings, 1);
}

/* --- the same bits ---------------------------------------------------------------------------------------- */

/* Some pixels are done with each of the stages, so that lists of every kind are traced. */
static const struct sampling mixed = {1, 16, 54};

static void assert_is_mixed(const struct picture *picture)
{
    for (uint32_t stage = 0; sampling_stage(stage) <= mixed.most; stage++)
        assert_true(count_with(picture, sampling_stage(stage)) > PIXELS / 50);
}

static void check_kernels(enum pixel_filter filter)
{
    struct scene scene = mixed_scene(filter);
    struct plan *plan = plan_of(&scene);
    struct picture *expected = render(plan, &kernel_ref, &mixed, WIDTH, HEIGHT);
    assert_is_mixed(expected);
    for (size_t k = 0; kernel_at(k); k++) {
        struct picture *found = render(plan, kernel_at(k), &mixed, WIDTH, HEIGHT);
        assert_same(found, expected, kernel_at(k)->name);
        free(found);
    }
    free(expected);
    plan_destroy(&plan);
    scene_finish(&scene);
}

static void every_kernel_makes_the_same_picture(void **state)
{
    (void)state;
    check_kernels(FILTER_BOX);
    check_kernels(FILTER_TENT);
}

static void check_tiles(const struct plan *plan, const struct sampling *sampling)
{
    const uint32_t sizes[][2] = {{64, 16}, {7, 5}, {1, 1}, {WIDTH, 1}, {1, HEIGHT}};
    struct picture *expected = render(plan, kernel_default(), sampling, WIDTH, HEIGHT);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char label[32];
        snprintf(label, sizeof label, "tiles of %u x %u", sizes[i][0], sizes[i][1]);
        struct picture *found = render(plan, kernel_default(), sampling, sizes[i][0], sizes[i][1]);
        assert_same(found, expected, label);
        free(found);
    }
    free(expected);
}

/* Neighbours that tiles look at beyond their edges change neither pixels nor the counts of rays. */
static void tiles_of_any_size_make_the_same_picture(void **state)
{
    (void)state;
    struct scene scene = mixed_scene(FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    check_tiles(plan, &mixed);
    check_tiles(plan, &(struct sampling){4, 8, 60});
    check_tiles(plan, &(struct sampling){4, 4, 0});
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* --- how many samples ------------------------------------------------------------------------------------- */

static void check_bounds(const struct plan *plan, uint32_t least, uint32_t most, uint32_t threshold)
{
    struct picture *picture = render_whole(plan, least, most, threshold);
    for (uint32_t i = 0; i < PIXELS; i++) {
        uint32_t samples = picture->pixels[i].samples;
        assert_true(samples >= least && samples <= most);
        assert_int_equal(sampling_stage(sampling_stage_within(samples)), samples);
    }
    assert_true(count_with(picture, least) > 0 && count_with(picture, most) > 0);
    free(picture);
}

static void pixels_have_samples_within_the_bounds(void **state)
{
    (void)state;
    struct scene scene = mixed_scene(FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    check_bounds(plan, 1, 4, 45);
    check_bounds(plan, 1, 16, 60);
    check_bounds(plan, 4, 32, 70);
    check_bounds(plan, 16, 32, 65);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* No pixel gets fewer of them, and the ends are: all least, and all most but for those that look quite even. */
static void higher_thresholds_take_more_samples(void **state)
{
    (void)state;
    struct scene scene = mixed_scene(FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    struct picture *last = render_whole(plan, 1, 16, 0);
    assert_int_equal(count_with(last, 1), PIXELS);
    for (uint32_t threshold = 15; threshold < SAMPLING_THRESHOLDS; threshold += 15) {
        struct picture *next = render_whole(plan, 1, 16, threshold);
        for (uint32_t i = 0; i < PIXELS; i++)
            assert_true(next->pixels[i].samples >= last->pixels[i].samples);
        free(last);
        last = next;
    }
    assert_true(count_with(last, 16) > 3 * PIXELS / 4);
    free(last);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* A wall whose upper edge lies somewhere in the first row: its middles are all on one side, and the other side may be seen
 * only beyond the image. */
static bool check_edge(double height)
{
    struct scene scene = scene_at(vec3_make(0, 0, 4), 50);
    scene.width = WIDTH;
    scene.height = HEIGHT;
    scene_add(&scene, shape_box(vec3_make(-9, -9, -1), vec3_make(9, height, 0)), material_glowing(grey(1)));
    struct plan *plan = plan_of(&scene);
    struct picture *truth = render_whole(plan, 256, 256, 0), *picture = render_whole(plan, 1, 16, 54);
    double covered = truth->pixels[WIDTH / 2].light.x;
    bool crossed = covered > 0.02 && covered < 0.98;
    for (uint32_t x = 0; crossed && x < WIDTH; x++)
        assert_true(picture->pixels[x].samples > 1);
    free(truth);
    free(picture);
    plan_destroy(&plan);
    scene_finish(&scene);
    return crossed;
}

static void edges_along_the_first_row_are_seen(void **state)
{
    (void)state;
    uint32_t crossed = 0;
    double top = 4 * tan(25 * 3.14159265358979 / 180), pixel = 2 * top / HEIGHT; /* of what is seen of the wall */
    for (int i = 1; i < 16; i++)
        crossed += check_edge(top - i / 16.0 * pixel);
    assert_true(crossed > 10);
}

static uint64_t camera_rays(const struct picture *picture)
{
    uint64_t rays = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        rays += picture->rows[y].camera;
    return rays;
}

/* The first sample of pixels that go on is a ray, too, though their light is without it. */
static void camera_rays_are_samples_and_first_looks(void **state)
{
    (void)state;
    struct scene scene = mixed_scene(FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    struct picture *picture = render_whole(plan, 1, 16, 45);
    uint64_t expected = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        expected += picture->pixels[i].samples + (picture->pixels[i].samples > 1);
    assert_true(camera_rays(picture) == expected);
    free(picture);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Pixels that are done with 1 or 4 samples are those of pictures by 1 and 4. */
static void first_stages_are_fixed_pictures(void **state)
{
    (void)state;
    struct scene scene = mixed_scene(FILTER_TENT);
    struct plan *plan = plan_of(&scene);
    struct picture *adaptive = render_whole(plan, 1, 16, 45), *by[2] = {render_whole(plan, 1, 1, 0),
                                                                        render_whole(plan, 4, 4, 0)};
    for (uint32_t i = 0; i < PIXELS; i++) {
        const struct pixel *pixel = &adaptive->pixels[i];
        if (pixel->samples <= 4)
            assert_memory_equal(&pixel->light, &by[pixel->samples == 4]->pixels[i].light, sizeof pixel->light);
        if (pixel->samples == 4)
            assert_true(same_pixels(pixel, &by[1]->pixels[i]));
    }
    free(adaptive);
    free(by[0]);
    free(by[1]);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* --- cells ------------------------------------------------------------------------------------------------ */

/* Checkers of `pixels` pixels each, seen straight from above, and nothing else. */
static struct scene checkers_from_above(double pixels, enum pixel_filter filter)
{
    struct scene scene = scene_at(vec3_make(0, 4, 0), 40);
    double pixel = 2 * 4 * tan(0.5 * 40 * 3.141592653589793 / 180) / HEIGHT;
    scene.width = WIDTH;
    scene.height = HEIGHT;
    scene.filter = filter;
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), checkered(pixels * pixel));
    return scene;
}

/* How far two pictures' pixels lie apart: RMSE of linear light. */
static double distance(const struct picture *a, const struct picture *b)
{
    double sum = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        struct vec3 off = vec3_sub(a->pixels[i].light, b->pixels[i].light);
        sum += vec3_dot(off, off) / 3;
    }
    return sqrt(sum / PIXELS);
}

/* Cells cut the pixel up. Over rectangles along the checkers the mean is exact, so 4, 16 and 64 samples give what the
 * whole pixel as one gives, wherever they lie; what is left is a few roundings. Numbers of samples that make no cells
 * give each a footprint around itself, with gaps and overlaps: 0.005 to 0.07 here. */
static void check_from_above(double pixels)
{
    struct scene scene = checkers_from_above(pixels, FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    struct picture *whole = render_whole(plan, 1, 1, 0);
    for (uint32_t samples = 4; samples <= 64; samples *= 4) {
        struct picture *cells = render_whole(plan, samples, samples, 0);
        struct picture *around = render_whole(plan, samples + 1, samples + 1, 0);
        print_message("# checkers of %.2f pixels, %2u samples: off by %.1e, by %.1e with one more and no cells\n", pixels,
                      samples, distance(cells, whole), distance(around, whole));
        assert_true(distance(cells, whole) < 1e-14);
        assert_true(distance(around, whole) > 0.001);
        free(cells);
        free(around);
    }
    free(whole);
    plan_destroy(&plan);
    scene_finish(&scene);
}

static void cells_leave_no_gaps(void **state)
{
    (void)state;
    check_from_above(0.37);
    check_from_above(0.81);
    check_from_above(2.3);
}

/* So does an adaptive picture, whichever stages its pixels are done with: each stage's new samples are a block of
 * cells. */
static void stages_leave_no_gaps(void **state)
{
    (void)state;
    struct scene scene = checkers_from_above(2.3, FILTER_BOX);
    struct plan *plan = plan_of(&scene);
    struct picture *whole = render_whole(plan, 1, 1, 0), *adaptive = render_whole(plan, 1, 64, 30);
    assert_true(count_with(adaptive, 1) < PIXELS);
    assert_true(distance(adaptive, whole) < 1e-14);
    free(whole);
    free(adaptive);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* In perspective up to the horizon, where footprints are long and lie askew, means are not exact: but a few samples
 * are still 2.4 to 3 times as near to many as with footprints of their own. */
static void cells_help_up_to_the_horizon(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(1.3, 1.1, 5.7), 50);
    scene.width = WIDTH;
    scene.height = HEIGHT;
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), checkered(0.5));
    struct plan *plan = plan_of(&scene);
    struct picture *truth = render_whole(plan, 4096, 4096, 0);
    for (uint32_t samples = 4; samples <= 64; samples *= 4) {
        struct picture *cells = render_whole(plan, samples, samples, 0);
        struct picture *around = render_whole(plan, samples + 1, samples + 1, 0);
        double with = distance(cells, truth), without = distance(around, truth);
        print_message("# a floor, %2u samples: off by %.5f, by %.5f with one more and no cells\n", samples, with, without);
        assert_true(with < 0.5 * without);
        free(cells);
        free(around);
    }
    free(truth);
    plan_destroy(&plan);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kernel_makes_the_same_picture),
        cmocka_unit_test(tiles_of_any_size_make_the_same_picture),
        cmocka_unit_test(pixels_have_samples_within_the_bounds),
        cmocka_unit_test(higher_thresholds_take_more_samples),
        cmocka_unit_test(edges_along_the_first_row_are_seen),
        cmocka_unit_test(camera_rays_are_samples_and_first_looks),
        cmocka_unit_test(first_stages_are_fixed_pictures),
        cmocka_unit_test(cells_leave_no_gaps),
        cmocka_unit_test(stages_leave_no_gaps),
        cmocka_unit_test(cells_help_up_to_the_horizon),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
