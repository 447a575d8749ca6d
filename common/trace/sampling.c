#include "trace/sampling.h"

#include <math.h>
#include <string.h>

#include "math/colour.h"

/* How much the measures weigh what they see. Fitted to twelve scenes (pictures by 1 to 64 samples against 1,024) so
 * that one threshold for all stages takes the fewest samples for the same error. Per sample, the squared error of
 * pixels with edges falls as N^-1.5, so what one more sample is worth as N^-2.5; a little more is best, for a pixel
 * that looks even after few samples may have been lucky: N^-2.75, 11 quarters of an octave a doubling. */
#define WEIGHT_FIRST_NEAR (1.0 / 16)
#define WEIGHT_FIRST_WIDE (1.0 / 256)
#define WEIGHT_HALVES 3.0
#define WEIGHT_NEAR 0.5

/* The squared error of edges falls as N^-1.5 with samples of a (0,2)-sequence. So the means of the two halves of N are
 * anticorrelated, and the variance of the mean of both is this share of what independent halves would give. With
 * q = 2^(1 − 1.5): q / (2 − q). */
#define SHARE_OF_HALVES 0.54691816067802712

uint32_t sampling_stage_within(uint32_t samples)
{
    uint32_t stage = 0;
    while (stage + 1 < SAMPLING_STAGES && sampling_stage(stage + 1) <= samples)
        stage++;
    return stage;
}

static double clamped(double x)
{
    x = x > 0 ? x : 0;
    return x < 1 ? x : 1;
}

struct vec3 sampling_roots(struct vec3 light)
{
    return vec3_make(sqrt(clamped(light.x)), sqrt(clamped(light.y)), sqrt(clamped(light.z)));
}

/* −log2 of a positive normal number in quarters, rounded down. */
static int quarters_below_one(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int exponent = (int)(bits >> 52) - 1023;
    bits = (bits & 0xfffffffffffff) | (uint64_t)1023 << 52;
    double fraction;
    memcpy(&fraction, &bits, sizeof fraction);
    int above = (fraction > 1) + (fraction > 0x1.306fe0a31b715p0) + (fraction > 0x1.6a09e667f3bcdp0) +
                (fraction > 0x1.ae89f995ad3adp0); /* 2^(1/4), 2^(2/4), 2^(3/4) */
    return -4 * exponent - above;
}

static uint32_t measure_of(double unevenness, uint32_t doublings)
{
    int quarters = unevenness > 0x1p-100 ? quarters_below_one(unevenness) : 400;
    quarters += SAMPLING_MEASURES_A_DOUBLING * (int)doublings;
    quarters = quarters < 0 ? 0 : quarters;
    return quarters < SAMPLING_THRESHOLDS ? (uint32_t)quarters : SAMPLING_THRESHOLDS - 1;
}

uint32_t sampling_first_measure(struct vec3 near, struct vec3 wide)
{
    double nearest = WEIGHT_FIRST_NEAR * vec3_max(near) * vec3_max(near);
    double widest = WEIGHT_FIRST_WIDE * vec3_max(wide) * vec3_max(wide);
    return measure_of(nearest > widest ? nearest : widest, 0);
}

static double unevenness(double roots, double half_roots, double squares, double near, double samples)
{
    double mean = roots / samples;
    double variance = squares / samples - mean * mean;
    double halves = 2 * (half_roots - (roots - half_roots)) / samples;
    return (variance > 0 ? variance : 0) + WEIGHT_HALVES * halves * halves + WEIGHT_NEAR * near * near / samples;
}

uint32_t sampling_measure(const struct pixel_sums *s, uint32_t samples, struct vec3 near)
{
    struct vec3 of = {unevenness(s->roots.x, s->half_roots.x, s->squares.x, near.x, samples),
                      unevenness(s->roots.y, s->half_roots.y, s->squares.y, near.y, samples),
                      unevenness(s->roots.z, s->half_roots.z, s->squares.z, near.z, samples)};
    return measure_of(vec3_max(of), sampling_stage_within(samples) + 1);
}

double sampling_product(struct vec3 a, struct vec3 b, struct vec3 c)
{
    const struct vec3 light[3] = {a, b, c};
    struct vec3 shown[3];
    colour_encode_srgb_near(light, 3, shown);
    return vec3_dot(vec3_sub(shown[0], shown[1]), vec3_sub(shown[0], shown[2])) / 3;
}

double sampling_difference(struct vec3 a, struct vec3 b)
{
    const struct vec3 light[2] = {a, b};
    struct vec3 shown[2];
    colour_encode_srgb_near(light, 2, shown);
    struct vec3 apart = vec3_sub(shown[0], shown[1]);
    return vec3_dot(apart, apart) / 3;
}

double sampling_error(const struct pixel_sums *sums, uint32_t samples)
{
    uint32_t half = samples / 2;
    struct vec3 rest = vec3_sub(sums->light, sums->half);
    if (rest.x == sums->half.x && rest.y == sums->half.y && rest.z == sums->half.z && samples % 2 == 0)
        return 0; /* as over most of many pictures */
    struct vec3 first = vec3_scale(sums->half, 1.0 / half);
    struct vec3 second = vec3_scale(rest, 1.0 / (samples - half));
    return SHARE_OF_HALVES * sampling_difference(first, second) / 4;
}

double sampling_first_error(struct vec3 near)
{
    return vec3_dot(near, near) / 3 / 12;
}
