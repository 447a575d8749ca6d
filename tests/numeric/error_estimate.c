/*
 * Renders say how far off they are, and meet the error that they were asked for: small pictures of scenes
 * against pictures by many samples. The table is printed. Errors are RMSE of what is shown, 0..1.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/sanitized.h"
#include "tests/scene_builder.h"
#include "tests/scene_file.h"
#include "trace/survey.h"

/* With sanitizers the code is the same but ten times slower: there, smaller pictures. */
#ifdef SANITIZED
enum { WIDTH = 48, HEIGHT = 27, TRUE_SAMPLES = 256 };
#else
enum { WIDTH = 96, HEIGHT = 54, TRUE_SAMPLES = 1024 };
#endif
enum { PIXELS = WIDTH * HEIGHT, MOST = 1024 };

/* A scene and its true picture. */
struct view {
    struct scene scene;
    struct plan *plan;
    struct tracer *tracer;
    struct pixel *truth;
};

/* One render's figures. */
struct outcome {
    double samples; /* a pixel */
    double error, estimate;
};

/* The whole image, which the caller frees. */
static struct pixel *render(struct tracer *tracer, const struct sampling *sampling)
{
    struct pixel *pixels = memory_array(PIXELS, sizeof *pixels);
    struct ray_counts counts[HEIGHT] = {{0}};
    tracer_area(tracer, sampling, &(struct pixel_area){0, WIDTH, 0, HEIGHT}, pixels, counts);
    return pixels;
}

/* The view stays where it is: its plan borrows from the scene. */
static void view_begin(struct view *view, const char *path)
{
    view->scene = scene_of_file(path, WIDTH, HEIGHT);
    struct trace_settings settings = settings_of(&view->scene);
    view->plan = plan_create(&view->scene, &settings, 1);
    view->tracer = tracer_create(view->plan, kernel_default());
    view->truth = render(view->tracer, &(struct sampling){TRUE_SAMPLES, TRUE_SAMPLES, 0});
}

static void view_end(struct view *view)
{
    free(view->truth);
    tracer_destroy(&view->tracer);
    plan_destroy(&view->plan);
    scene_finish(&view->scene);
}

/* --- figures ---------------------------------------------------------------------------------------------- */

/* The estimate is the pixels' own, which is all that there is for a fixed number of samples. */
static struct outcome outcome_of(const struct view *view, const struct pixel *pixels)
{
    struct outcome sum = {0};
    for (uint32_t i = 0; i < PIXELS; i++) {
        sum.samples += pixels[i].samples;
        sum.error += sampling_difference(pixels[i].light, view->truth[i].light);
        sum.estimate += pixels[i].error;
    }
    return (struct outcome){sum.samples / PIXELS, sqrt(sum.error / PIXELS), sqrt(sum.estimate / PIXELS)};
}

static struct outcome render_fixed(const struct view *view, uint32_t samples)
{
    struct pixel *pixels = render(view->tracer, &(struct sampling){samples, samples, 0});
    struct outcome outcome = outcome_of(view, pixels);
    free(pixels);
    return outcome;
}

static struct survey survey_image(const struct view *view, const struct sampling *sampling)
{
    struct survey survey = {0};
    struct survey_grid grid = survey_grid(WIDTH, HEIGHT);
    for (uint32_t y = 0; y < grid.down; y++)
        survey_cells(view->tracer, sampling, &grid, 0, grid.across, y, &survey, &(struct ray_counts){0});
    return survey;
}

/* As survey_outcome sums them. */
static void sum_estimates(const struct pixel *pixels, uint64_t estimated[2])
{
    for (uint32_t i = 0; i < PIXELS; i++)
        estimated[pixels[i].samples > 1] += (uint64_t)(pixels[i].error / PIXEL_ERROR_UNIT);
}

/* As a render on the farm goes about it. */
static struct outcome render_to(const struct view *view, double error, struct sampling *chosen)
{
    uint64_t estimated[2] = {0};
    struct sampling surveyed = survey_sampling(MOST, error);
    struct survey survey = survey_image(view, &surveyed);
    *chosen = survey_choose(&survey, &surveyed, error);
    struct pixel *pixels = render(view->tracer, chosen);
    struct outcome outcome = outcome_of(view, pixels);
    sum_estimates(pixels, estimated);
    outcome.estimate = survey_error(&survey, chosen, PIXELS, estimated);
    free(pixels);
    return outcome;
}

/* --- what they must be ------------------------------------------------------------------------------------ */

/* Estimates of adaptive renders lean on a survey, here of most pixels; what is left to chance makes up to 1.2, and 1.4
 * with images, for what filters blur is found by narrower ones, but not whole. Those of fixed samples lean on one law of
 * how errors fall, which holds for edges: with patterns that are averaged over the samples' cells they are up to 1.45
 * times too high, and with images up to 2.1 times, for samples side by side differ though their mean is right. */
static const double estimate_factor = 1.5, image_factor = 2.25;

/* Renders aim at 0.8 of what is asked for, and come to 0.9; with images in a picture so small, to 1.03. */
static const double asked_factor = 1.1;

/* Estimates are at most `above` times too high. */
static void check_estimate(const struct outcome *outcome, double above)
{
    assert_true(outcome->estimate < above * outcome->error);
    assert_true(outcome->error < estimate_factor * outcome->estimate);
}

static void check_fixed(const struct view *view, uint32_t samples, double above)
{
    struct outcome outcome = render_fixed(view, samples);
    print_message("#   %4u samples a pixel                error %.5f, estimated %.5f (x %.2f)\n", samples,
                  outcome.error, outcome.estimate, outcome.estimate / outcome.error);
    check_estimate(&outcome, above);
}

static void check_adaptive(const struct view *view, double error)
{
    struct sampling chosen;
    struct outcome outcome = render_to(view, error, &chosen);
    print_message("# %6.2f samples, least %2u, threshold %3u: error %.5f, estimated %.5f (x %.2f), ", outcome.samples,
                  chosen.least, chosen.threshold, outcome.error, outcome.estimate, outcome.estimate / outcome.error);
    print_message("asked %.4f (x %.2f)\n", error, outcome.error / error);
    check_estimate(&outcome, estimate_factor);
    assert_true(outcome.error < asked_factor * error);
}

static void check_scene(const char *path, double fixed_above)
{
    struct view view;
    view_begin(&view, path);
    print_message("# %s\n", path);
    check_fixed(&view, 4, fixed_above);
    check_fixed(&view, 16, fixed_above);
    for (double error = 0.02; error >= 0.005; error /= 2)
        check_adaptive(&view, error);
    view_end(&view);
}

static void showcase(void **state)
{
    (void)state;
    check_scene("scenes/showcase.json", estimate_factor);
}

static void glass(void **state)
{
    (void)state;
    check_scene("scenes/glass.json", estimate_factor);
}

static void images(void **state)
{
    (void)state;
    check_scene("scenes/textures-image.json", image_factor);
}

static void transparency(void **state)
{
    (void)state;
    check_scene("scenes/transparency.json", estimate_factor);
}

/* A floor far away under the tent. (In pictures so small, adaptive sampling misses the ends of the rods before it, which are
 * thinner than a pixel: nobody's first sample meets them.) */
static void tent(void **state)
{
    (void)state;
    struct view view;
    view_begin(&view, "scenes/filter.json");
    print_message("# scenes/filter.json\n");
    for (uint32_t samples = 4; samples <= 64; samples *= 4)
        check_fixed(&view, samples, estimate_factor);
    view_end(&view);
}

#ifndef SANITIZED
/* Every pixel is uneven, and errors so small need more samples than surveys take. The true picture must have many times as
 * many, for its first samples are the render's. */
static void fractal(void **state)
{
    (void)state;
    struct view view;
    view_begin(&view, "tests/bench/scenes/tetra.nff");
    print_message("# tests/bench/scenes/tetra.nff\n");
    check_adaptive(&view, 0.0025);
    view_end(&view);
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(showcase),
        cmocka_unit_test(glass),
        cmocka_unit_test(images),
        cmocka_unit_test(transparency),
        cmocka_unit_test(tent),
#ifndef SANITIZED
        cmocka_unit_test(fractal),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
