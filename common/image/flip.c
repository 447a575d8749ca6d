#include "image/flip.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "image/flip_filter.h"
#include "math/elementary.h"

/* --- colours ---------------------------------------------------------------------------------------------- */

/* The curve of CIE L*a*b*, for 0 <= t <= 1. */
static double lab_curve(double t)
{
    const double delta = 6.0 / 29;
    double root = math_pow_unit(t, 1.0 / 3);
    return t > delta * delta * delta ? root : t / (3 * delta * delta) + 4.0 / 29;
}

/* Opponent colours, clamped to what linear red, green and blue of 0..1 give, in L*a*b* with a* and b* times L* / 100:
 * the brighter a colour, the stronger it looks (Hunt). */
static inline struct vec3 hunt_lab(const struct flip_colours *colours, struct vec3 opponent)
{
    struct vec3 linear = mat3_apply(&colours->from_opponent, opponent);
    linear = vec3_make(flip_clamp(linear.x), flip_clamp(linear.y), flip_clamp(linear.z));
    struct vec3 clamped = mat3_apply(&colours->to_opponent, linear);
    double y = lab_curve(clamped.x), x = lab_curve(clamped.x + clamped.y), z = lab_curve(clamped.x - clamped.z);
    double lightness = 116 * y - 16;
    return vec3_make(lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z));
}

/* HyAB: the distance of lightness plus that of chroma. */
static double hyab(struct vec3 a, struct vec3 b)
{
    struct vec3 d = vec3_sub(a, b);
    return fabs(d.x) + sqrt(d.y * d.y + d.z * d.z);
}

/* The largest HyAB that there is: green against blue. */
static double hyab_max(const struct flip_colours *colours)
{
    struct vec3 green = mat3_apply(&colours->to_opponent, vec3_make(0, 1, 0));
    struct vec3 blue = mat3_apply(&colours->to_opponent, vec3_make(0, 0, 1));
    return hyab(hunt_lab(colours, green), hunt_lab(colours, blue));
}

/* HyAB, compressed and spread over 0..1; `distance` is relative to the largest. */
static double colour_error(double distance)
{
    const double exponent = 0.7, knee = 0.4, knee_error = 0.95; /* q_c, p_c and p_t */
    double error = math_pow_unit(distance, exponent);
    double below = knee_error / knee * error, above = knee_error + (error - knee) / (1 - knee) * (1 - knee_error);
    return error < knee ? below : above;
}

/* --- one pixel -------------------------------------------------------------------------------------------- */

static double gradient(const struct flip_tile *tile, size_t at, enum flip_plane along)
{
    double x = tile->planes[along][at], y = tile->planes[along + 1][at];
    return sqrt(x * x + y * y);
}

/* An edge or point that only one of the images has: 0..1, but below 1, for a gradient cannot be 1 both ways. */
static double feature_error(const struct flip_tile *a, const struct flip_tile *b, size_t at)
{
    double edges = fabs(gradient(a, at, FLIP_EDGE_ALONG) - gradient(b, at, FLIP_EDGE_ALONG));
    double points = fabs(gradient(a, at, FLIP_POINT_ALONG) - gradient(b, at, FLIP_POINT_ALONG));
    return sqrt((edges > points ? edges : points) * M_SQRT1_2);
}

static struct vec3 opponent_of(const struct flip_tile *tile, size_t at)
{
    return vec3_make(tile->planes[FLIP_Y][at], tile->planes[FLIP_X_Y][at], tile->planes[FLIP_Y_Z][at]);
}

/* The errors of `count` pixels of two tiles. A loop without branches, for vector instructions. */
static void compare_pixels(const struct flip_colours *colours_in, double largest, const struct flip_tile *a,
                           const struct flip_tile *b, size_t start, size_t count, float *restrict errors)
{
    const struct flip_colours colours = *colours_in;
    for (size_t i = 0; i < count; i++) {
        size_t at = start + i;
        struct vec3 lab_a = hunt_lab(&colours, opponent_of(a, at)), lab_b = hunt_lab(&colours, opponent_of(b, at));
        double error = colour_error(hyab(lab_a, lab_b) / largest);
        errors[i] = (float)math_pow_unit(error, 1 - feature_error(a, b, at));
    }
}

/* --- images ----------------------------------------------------------------------------------------------- */

struct flip_job {
    const struct image *a, *b;
    float *errors;
    struct flip_filters filters;
    double largest; /* HyAB */
};

/* What a thread has in hand. */
struct flip_hand {
    struct flip_workspace workspace;
    struct flip_tile a, b;
};

static uint32_t at_most(uint32_t size, uint32_t limit)
{
    return size < limit ? size : limit;
}

static void compare_tile(const struct flip_job *job, uint32_t x0, uint32_t y0, struct flip_hand *hand)
{
    uint32_t width = at_most(job->a->width - x0, FLIP_TILE_WIDTH);
    uint32_t height = at_most(job->a->height - y0, FLIP_TILE_HEIGHT);
    flip_filter_tile(&job->filters, job->a, x0, y0, width, height, &hand->workspace, &hand->a);
    flip_filter_tile(&job->filters, job->b, x0, y0, width, height, &hand->workspace, &hand->b);
    for (uint32_t j = 0; j < height; j++)
        compare_pixels(&job->filters.colours, job->largest, &hand->a, &hand->b, j * FLIP_TILE_WIDTH, width,
                       job->errors + (size_t)(y0 + j) * job->a->width + x0);
}

static void compare_strip(void *context, size_t index)
{
    const struct flip_job *job = context;
    struct flip_hand *hand = memory_array(1, sizeof *hand);
    flip_workspace_init(&hand->workspace, &job->filters);
    for (uint32_t x0 = 0; x0 < job->a->width; x0 += FLIP_TILE_WIDTH)
        compare_tile(job, x0, (uint32_t)index * FLIP_TILE_HEIGHT, hand);
    flip_workspace_finish(&hand->workspace);
    free(hand);
}

void flip_errors(const struct image *a, const struct image *b, double pixels_per_degree, int threads, float *errors)
{
    assert(a->width == b->width && a->height == b->height && a->rgb && b->rgb);
    assert(pixels_per_degree >= FLIP_PPD_MIN && pixels_per_degree <= FLIP_PPD_MAX);
    struct flip_job *job = memory_array(1, sizeof *job);
    job->a = a, job->b = b, job->errors = errors;
    flip_filters_init(&job->filters, pixels_per_degree);
    job->largest = hyab_max(&job->filters.colours);
    parallel_for(threads, ((size_t)a->height + FLIP_TILE_HEIGHT - 1) / FLIP_TILE_HEIGHT, compare_strip, job);
    free(job);
}

/* Row by row, so that few numbers are added to a large sum. */
double flip_mean(const float *errors, uint32_t width, uint32_t height)
{
    double sum = 0;
    for (uint32_t y = 0; y < height; y++) {
        double row = 0;
        for (uint32_t x = 0; x < width; x++)
            row += errors[(size_t)y * width + x];
        sum += row;
    }
    return sum / width / height;
}

void flip_colour(float error, uint8_t codes[3])
{
    /* Every sixteenth colour of magma (by Stéfan van der Walt and Nathaniel Smith, in the public domain by CC0);
     * between them lie straight lines. */
    static const uint8_t magma[][3] = {
        {0, 0, 4},      {10, 8, 34},    {29, 17, 71},   {54, 16, 107},   {81, 18, 124},   {106, 28, 129},
        {131, 38, 129}, {156, 46, 127}, {183, 55, 121}, {207, 64, 112},  {229, 80, 100},  {244, 105, 92},
        {251, 135, 97}, {254, 165, 113}, {254, 194, 135}, {253, 224, 161}, {252, 253, 191},
    };
    enum { LAST = sizeof magma / sizeof *magma - 1 };
    double at = LAST * flip_clamp(error);
    int below = at < LAST ? (int)at : LAST - 1;
    for (int c = 0; c < 3; c++) {
        double code = magma[below][c] + (at - below) * (magma[below + 1][c] - magma[below][c]);
        codes[c] = (uint8_t)(code + 0.5);
    }
}
