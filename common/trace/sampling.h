/*
 * How many samples a pixel gets: a fixed number, or more where they pay.
 *
 * Adaptive sampling goes by stages: 1 sample, 4, 8, 16 and so on, doubling. After each stage the pixel's measure,
 * −4 log2 of how uneven what it has seen is, allowing for how many samples it has, says how well it is known; it is
 * done once that reaches the threshold. Measures are whole numbers, so that the decision is exact, and a function of
 * the pixel's own samples and of the first samples of its neighbours: so a pixel does not depend on what else is
 * rendered with it.
 */
#ifndef WEFT_TRACE_SAMPLING_H
#define WEFT_TRACE_SAMPLING_H

#include <stdbool.h>
#include <stdint.h>

#include "math/vec3.h"

enum {
    SAMPLING_STAGES = 16,         /* 1, 4, 8 … 65536 samples */
    SAMPLING_THRESHOLDS = 256,    /* 0 .. 255 */
    SAMPLING_REACH = 2,           /* pixels: so far away first samples of others count */
    SAMPLING_MEASURES_A_DOUBLING = 11, /* so much a measure grows if there are twice the samples, just as uneven */
};

/* Samples of each pixel. Fixed: least == most. Else both are of sampling_stage's, and a pixel is done with a stage
 * from `least` on whose measure is at least `threshold`, which is below SAMPLING_THRESHOLDS. */
struct sampling {
    uint32_t least, most;
    uint32_t threshold;
};

static inline bool sampling_is_fixed(const struct sampling *sampling)
{
    return sampling->least == sampling->most;
}

/* Samples of a pixel that is done with that stage, 0 <= stage < SAMPLING_STAGES. */
static inline uint32_t sampling_stage(uint32_t stage)
{
    return stage == 0 ? 1 : 2u << stage;
}

/* The last stage with at most so many samples (at least 1). */
uint32_t sampling_stage_within(uint32_t samples);

/* What a pixel's samples so far came to. Roots are those of the channels, clamped to 0..1: near to how bright they
 * look. */
struct pixel_sums {
    struct vec3 light;   /* linear radiance, of all samples in the order of their indices */
    struct vec3 half;    /* of the first half of them (rounded down) */
    struct vec3 roots;
    struct vec3 half_roots;
    struct vec3 squares; /* of the roots */
};

/* The roots of a sample's channels, clamped. */
struct vec3 sampling_roots(struct vec3 light);

/* The measure after stage 0: 0 .. SAMPLING_THRESHOLDS − 1, the larger the better the pixel is known. `near` is how far
 * apart the roots of first samples lie, in each channel, over the 3×3 pixels around this one, in the image or not,
 * and `wide` over 5×5: thin things that fall between samples are mostly next to an edge that was seen. */
uint32_t sampling_first_measure(struct vec3 near, struct vec3 wide);

/* The measure after a later stage. */
uint32_t sampling_measure(const struct pixel_sums *sums, uint32_t samples, struct vec3 near);

/* Of colours (linear light) as they are shown (clamped to 0..1, sRGB-encoded, within 2^-28): the mean over the channels
 * of a's difference to b times that to c, and the squared difference of two, likewise. */
double sampling_product(struct vec3 a, struct vec3 b, struct vec3 c);
double sampling_difference(struct vec3 a, struct vec3 b);

/* Estimates of the squared error of the pixel's mean as it is shown, mean of the channels: from the light of the
 * samples' halves, 2 samples or more; and from `near` alone (rough), for one sample. */
double sampling_error(const struct pixel_sums *sums, uint32_t samples);
double sampling_first_error(struct vec3 near);

#endif
