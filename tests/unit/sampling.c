/*
 * How many samples a pixel needs, and how far off it is by those that it has.
 */
#include "trace/sampling.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "math/colour.h"
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/sample.h"

/* --- stages ----------------------------------------------------------------------------------------------- */

static void stages_double_from_four_on(void **state)
{
    (void)state;
    assert_int_equal(sampling_stage(0), 1);
    assert_int_equal(sampling_stage(1), 4);
    for (uint32_t stage = 2; stage < SAMPLING_STAGES; stage++)
        assert_int_equal(sampling_stage(stage), 2 * sampling_stage(stage - 1));
    assert_int_equal(sampling_stage(SAMPLING_STAGES - 1), 65536);
}

static void a_stage_within_is_the_last_that_fits(void **state)
{
    (void)state;
    const uint32_t last = SAMPLING_STAGES - 1;
    for (uint32_t samples = 1; samples <= 65536; samples++) {
        uint32_t stage = sampling_stage_within(samples);
        assert_true(sampling_stage(stage) <= samples);
        assert_true(stage == last || sampling_stage(stage + 1) > samples);
    }
    assert_int_equal(sampling_stage_within(UINT32_MAX), last);
}

/* --- measures --------------------------------------------------------------------------------------------- */

/* One channel's range, in a channel that the index chooses. */
static struct vec3 range_in_channel(uint32_t index, double range)
{
    return vec3_make(index % 3 == 0 ? range : 0, index % 3 == 1 ? range : 0, index % 3 == 2 ? range : 0);
}

static uint32_t first_measure(uint32_t index, double range)
{
    return sampling_first_measure(range_in_channel(index, range), grey(0));
}

/* A quarter of an octave of the range's square is an eighth of one of the range. Ranges are random, so that rounding
 * meets no border between two measures. */
static void first_measures_are_quarter_octaves(void **state)
{
    (void)state;
    const double eighth = 0x1.172b83c7d517bp0; /* 2^(1/8) */
    for (uint32_t i = 0; i < 10000; i++) {
        double range = ldexp(random_between(i, 0, 1, 2), -(int)(i % 20) - 2);
        int measure = (int)first_measure(i, range);
        assert_int_equal((int)first_measure(i, range * eighth), measure - 1);
        assert_int_equal((int)first_measure(i, 2 * range), measure - 8);
    }
}

static void the_widest_channel_makes_the_first_measure(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) {
        struct vec3 range = {random_between(i, 0, 0, 1), random_between(i, 1, 0, 1), random_between(i, 2, 0, 1)};
        assert_int_equal(sampling_first_measure(range, grey(0)), first_measure(0, vec3_max(range)));
    }
}

/* Samples farther away must lie four times as far apart to count as much. */
static void what_lies_around_counts_less(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10000; i++) {
        double near = random_between(i, 0, 0.01, 0.25), wide = random_between(i, 1, near, 1);
        uint32_t expected = first_measure(i, 4 * near > wide ? near : wide / 4);
        assert_int_equal(sampling_first_measure(range_in_channel(i, near), range_in_channel(i / 3, wide)), expected);
    }
}

/* Sums of samples of which half have roots mean + off and half mean − off, with `lean` more in the first half. */
static struct pixel_sums sums_of(uint32_t samples, double mean, double off, double lean)
{
    double roots = samples * mean, half = samples * (mean + lean) / 2, squares = samples * (mean * mean + off * off);
    return (struct pixel_sums){.roots = grey(roots), .half_roots = grey(half), .squares = grey(squares)};
}

static uint32_t measure_of(uint32_t samples, double mean, double off, double lean, double range)
{
    struct pixel_sums sums = sums_of(samples, mean, off, lean);
    return sampling_measure(&sums, samples, grey(range));
}

/* What a threshold means: unevenness 1/16 is 16 quarters of an octave below 1, and 4 samples are two doublings. */
static void measures_start_where_they_did(void **state)
{
    (void)state;
    assert_int_equal(sampling_first_measure(grey(1), grey(1)), 16);
    assert_int_equal(measure_of(4, 0.5, 0.25, 0, 0), 16 + 2 * SAMPLING_MEASURES_A_DOUBLING);
}

static void an_even_pixel_gets_the_largest_measure(void **state)
{
    (void)state;
    assert_int_equal(sampling_first_measure(grey(0), grey(0)), SAMPLING_THRESHOLDS - 1);
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++)
        assert_int_equal(measure_of(sampling_stage(stage), 0.25, 0, 0, 0), SAMPLING_THRESHOLDS - 1);
}

/* Twice the sums are exact, so that the measures differ exactly. */
static void twice_the_samples_raise_the_measure(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) {
        double mean = random_between(i, 0, 0.3, 0.7), off = random_between(i, 1, 0.05, 0.3);
        double lean = random_between(i, 2, 0, 0.3);
        uint32_t least = measure_of(4, mean, off, lean, 0);
        for (uint32_t stage = 2; stage < 8; stage++)
            assert_int_equal(measure_of(sampling_stage(stage), mean, off, lean, 0),
                             least + (stage - 1) * SAMPLING_MEASURES_A_DOUBLING);
    }
}

/* Whichever kind of unevenness grows, the measure falls, and at last it has fallen. */
static void more_uneven_pixels_get_smaller_measures(void **state)
{
    (void)state;
    uint32_t first = first_measure(0, 0.001), off = measure_of(8, 0.5, 0.001, 0, 0);
    uint32_t lean = measure_of(8, 0.5, 0, 0.001, 0), range = measure_of(8, 0.5, 0, 0, 0.001), last[4];
    const uint32_t begun[4] = {first, off, lean, range};
    memcpy(last, begun, sizeof last);
    for (double x = 0.001; x < 0.5; x *= 1.01) {
        const uint32_t next[4] = {first_measure(0, x), measure_of(8, 0.5, x, 0, 0), measure_of(8, 0.5, 0, x, 0),
                                  measure_of(8, 0.5, 0, 0, x)};
        for (int kind = 0; kind < 4; kind++) {
            assert_true(next[kind] <= last[kind]);
            last[kind] = next[kind];
        }
    }
    for (int kind = 0; kind < 4; kind++) /* by 0.5 / 0.001, nine octaves, less a step */
        assert_true(begun[kind] - last[kind] >= 8 * 8);
}

static void roots_are_of_clamped_channels(void **state)
{
    (void)state;
    struct vec3 roots = sampling_roots(vec3_make(-1, 0.25, 7));
    assert_true(roots.x == 0 && roots.y == 0.5 && roots.z == 1);
    assert_true(sampling_roots(grey(NAN)).x == 0);
}

/* --- differences ------------------------------------------------------------------------------------------ */

/* With light that is too dark or too bright to show, too. */
static struct vec3 random_light(uint32_t index, uint32_t draw)
{
    return vec3_make(random_between(index, draw, -0.2, 1.2), random_between(index, draw + 1, -0.2, 1.2),
                     random_between(index, draw + 2, 0, 0.05));
}

static double shown_difference(double a, double b)
{
    double difference = colour_encode_srgb(a) - colour_encode_srgb(b);
    return difference * difference;
}

/* Encoded values are within 2^-28 (colour.h) and their differences d at most 1, so squares of these within 2 d 2^-27
 * and a little; and products likewise. */
static const double margin = 0x1.01p-26;

static void differences_are_of_colours_as_shown(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 100000; i++) {
        struct vec3 a = random_light(i, 0), b = random_light(i, 3);
        double expected = (shown_difference(a.x, b.x) + shown_difference(a.y, b.y) + shown_difference(a.z, b.z)) / 3;
        assert_true(fabs(sampling_difference(a, b) - expected) <= margin);
        assert_true(sampling_difference(a, b) == sampling_difference(b, a));
        assert_true(sampling_product(a, b, b) == sampling_difference(a, b));
    }
}

static void products_are_of_differences_as_shown(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10000; i++) {
        struct vec3 a = random_light(i, 0), b = random_light(i, 3), c = random_light(i, 6);
        struct vec3 dark = vec3_make(-1, 0, -0.5);
        double bc = sampling_product(a, b, c), to_dark = sampling_product(a, dark, c);
        assert_true(bc == sampling_product(a, c, b));
        /* (a − b)(a − c) − (a − 0)(a − c) = (0 − b)(0 + a − (0 + c)) */
        double expected = sampling_product(dark, b, c) - sampling_product(dark, b, a);
        assert_true(fabs(bc - to_dark - expected) <= 4 * margin);
    }
}

static void light_that_is_shown_alike_does_not_differ(void **state)
{
    (void)state;
    struct vec3 a = {0.25, 0.5, 0.75};
    assert_true(sampling_difference(a, a) == 0);
    assert_true(sampling_difference(grey(1), grey(2)) == 0);
    assert_true(sampling_difference(grey(-1), grey(0)) == 0);
    assert_true(sampling_difference(grey(0), grey(1)) == 1);
}

/* --- estimates of errors ---------------------------------------------------------------------------------- */

static void equal_halves_estimate_no_error(void **state)
{
    (void)state;
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        uint32_t samples = sampling_stage(stage);
        struct vec3 light = {0.3, 0.2, 0.9};
        struct pixel_sums sums = {.light = vec3_scale(light, samples), .half = vec3_scale(light, samples / 2)};
        assert_true(sampling_error(&sums, samples) == 0);
    }
    assert_true(sampling_first_error(grey(0)) == 0 && sampling_first_error(grey(0.5)) > 0);
}

/* Two colours that meet at a straight edge through a pixel: the second where normal · (x, y) < place. */
struct edge {
    double normal[2], place;
    struct vec3 color[2];
};

static struct edge random_edge(uint32_t index)
{
    double turn = random_between(index, 0, 0, 6.283185307179586);
    struct edge edge = {.normal = {cos(turn), sin(turn)}};
    edge.place = random_between(index, 1, 0, 1) * edge.normal[0] + random_between(index, 2, 0, 1) * edge.normal[1];
    edge.color[0] = vec3_scale(vec3_add(random_vector(index, 3), grey(1)), 0.5);
    edge.color[1] = vec3_scale(vec3_add(random_vector(index, 6), grey(1)), 0.5);
    return edge;
}

static double square_above_zero(double x)
{
    return x > 0 ? x * x : 0;
}

/* The second colour's share of the unit square: the right triangle below the edge, less the two of it that stick out of
 * the square, plus the one that both of these hold. */
static double second_share(const struct edge *edge)
{
    double a = fabs(edge->normal[0]), b = fabs(edge->normal[1]), place = edge->place;
    place -= edge->normal[0] < 0 ? edge->normal[0] : 0; /* as if both went up */
    place -= edge->normal[1] < 0 ? edge->normal[1] : 0;
    return (square_above_zero(place) - square_above_zero(place - a) - square_above_zero(place - b) +
            square_above_zero(place - a - b)) / (2 * a * b);
}

static struct pixel_sums sample_edge(const struct edge *edge, uint32_t pixel, uint32_t samples)
{
    struct pixel_sums sums = {0};
    for (uint32_t i = 0; i < samples; i++) {
        struct sample_position at = sample_position(pixel, pixel / 7, i, samples, FILTER_BOX);
        bool second = at.x * edge->normal[0] + at.y * edge->normal[1] < edge->place;
        if (i == samples / 2)
            sums.half = sums.light;
        sums.light = vec3_add(sums.light, edge->color[second]);
    }
    return sums;
}

/* A factor of 1.1 in the error, squared: by 4 samples it is 1.07, for means of 2 are far apart on the bent curve that
 * encodes them; by more it is below 1.04, of which chance is half. */
static const double allowed = 1.1 * 1.1;

/* Sums of squared errors over many edges, true and estimated. */
static void check_edges(uint32_t samples)
{
    double error = 0, estimated = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        struct edge edge = random_edge(i);
        struct pixel_sums sums = sample_edge(&edge, i, samples);
        struct vec3 mean = vec3_scale(sums.light, 1.0 / samples), between = vec3_sub(edge.color[1], edge.color[0]);
        error += sampling_difference(mean, vec3_add_scaled(edge.color[0], between, second_share(&edge)));
        estimated += sampling_error(&sums, samples);
    }
    print_message("# %2u samples: true RMSE %.4f, estimated %.4f, seed %d\n", samples, sqrt(error / 20000),
                  sqrt(estimated / 20000), TEST_SEED);
    assert_true(estimated < error * allowed && error < estimated * allowed);
}

static void errors_at_edges_are_estimated_right_on_average(void **state)
{
    (void)state;
    const uint32_t samples[] = {4, 8, 16, 64, 256};
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++)
        check_edges(samples[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stages_double_from_four_on),
        cmocka_unit_test(a_stage_within_is_the_last_that_fits),
        cmocka_unit_test(first_measures_are_quarter_octaves),
        cmocka_unit_test(the_widest_channel_makes_the_first_measure),
        cmocka_unit_test(what_lies_around_counts_less),
        cmocka_unit_test(measures_start_where_they_did),
        cmocka_unit_test(an_even_pixel_gets_the_largest_measure),
        cmocka_unit_test(twice_the_samples_raise_the_measure),
        cmocka_unit_test(more_uneven_pixels_get_smaller_measures),
        cmocka_unit_test(roots_are_of_clamped_channels),
        cmocka_unit_test(differences_are_of_colours_as_shown),
        cmocka_unit_test(products_are_of_differences_as_shown),
        cmocka_unit_test(light_that_is_shown_alike_does_not_differ),
        cmocka_unit_test(equal_halves_estimate_no_error),
        cmocka_unit_test(errors_at_edges_are_estimated_right_on_average),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
