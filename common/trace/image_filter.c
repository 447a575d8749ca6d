#include "trace/image_filter.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/plan_parts.h"

/* --- halving ---------------------------------------------------------------------------------------------- */

/* Each texel is the mean of the 2×2 it covers; an odd last row or column counts twice. */
static void halve(const float *from, uint32_t width, uint32_t height, float *to)
{
    uint32_t half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    for (uint32_t y = 0; y < half_height; y++) {
        const float *upper = from + (size_t)3 * width * (2 * y);
        const float *lower = 2 * y + 1 < height ? upper + (size_t)3 * width : upper;
        for (uint32_t x = 0; x < half_width; x++) {
            size_t left = (size_t)3 * (2 * x), right = 2 * x + 1 < width ? left + 3 : left;
            for (size_t c = 0; c < 3; c++) {
                double above = (double)upper[left + c] + upper[right + c];
                double sum = above + ((double)lower[left + c] + lower[right + c]);
                to[((size_t)y * half_width + x) * 3 + c] = (float)(sum / 4);
            }
        }
    }
}

void plan_image_build(struct plan_image *to, const struct image *image)
{
    *to = (struct plan_image){.levels = 1};
    to->level[0].width = image->width;
    to->level[0].height = image->height;
    to->level[0].rgb = image->rgb;
    while (to->levels < MIP_LEVELS_MAX) {
        uint32_t width = to->level[to->levels - 1].width, height = to->level[to->levels - 1].height;
        if (width == 1 && height == 1)
            break;
        uint32_t half_width = (width + 1) / 2, half_height = (height + 1) / 2;
        float *rgb = memory_array((size_t)half_width * half_height, 3 * sizeof *rgb);
        halve(to->level[to->levels - 1].rgb, width, height, rgb);
        to->level[to->levels].width = half_width;
        to->level[to->levels].height = half_height;
        to->level[to->levels].rgb = rgb;
        to->levels++;
    }
}

void plan_image_finish(struct plan_image *image)
{
    for (uint32_t i = 1; i < image->levels; i++)
        free((void *)image->level[i].rgb);
    *image = (struct plan_image){0};
}

/* --- looking up ------------------------------------------------------------------------------------------- */

/* Texel indices within 0..size−1 for any finite whole position: of the image again and again, or of its edge. */
static uint32_t repeated_index(double position, uint32_t size)
{
    double wrapped = position - floor(position / size) * size;
    return wrapped > 0 && wrapped < size ? (uint32_t)wrapped : 0;
}

static uint32_t clamped_index(double position, uint32_t size)
{
    return position <= 0 ? 0 : position >= size - 1.0 ? size - 1 : (uint32_t)position;
}

/* The two texels on either side of a position, counted from the first one's middle, and the second one's share. */
struct neighbours {
    uint32_t first, second;
    double share;
};

static inline struct neighbours neighbours_of(double position, uint32_t size, bool repeat)
{
    if (position >= 0 && position < size - 1.0) { /* nearly always, and without floor and division */
        uint32_t first = (uint32_t)position;
        return (struct neighbours){first, first + 1, position - first};
    }
    double below = floor(position), share = position - below;
    if (!repeat)
        return (struct neighbours){clamped_index(below, size), clamped_index(below + 1, size), share};
    uint32_t first = repeated_index(below, size);
    return (struct neighbours){first, first + 1 < size ? first + 1 : 0, share};
}

static struct vec3 texel(const float *row, uint32_t x)
{
    const float *at = row + 3 * (size_t)x;
    return vec3_make(at[0], at[1], at[2]);
}

static inline struct vec3 bilinear(const struct plan_image *image, uint32_t level, double u, double v,
                                   struct image_edges edges)
{
    uint32_t width = image->level[level].width, height = image->level[level].height;
    struct neighbours x = neighbours_of(u * width - 0.5, width, edges.repeat_u);
    struct neighbours y = neighbours_of(v * height - 0.5, height, edges.repeat_v);
    const float *upper_row = image->level[level].rgb + (size_t)3 * width * y.first;
    const float *lower_row = image->level[level].rgb + (size_t)3 * width * y.second;
    struct vec3 upper = vec3_mix(texel(upper_row, x.first), texel(upper_row, x.second), x.share);
    struct vec3 lower = vec3_mix(texel(lower_row, x.first), texel(lower_row, x.second), x.share);
    return vec3_mix(upper, lower, y.share);
}

/* A look as wide as a box of b texels. The image is what interpolating between texels makes of it, which spreads their
 * weights by a variance of 1/6, and the box spreads them by b²/12 more. A level's texels are means of w × w of the
 * image's, and interpolating between those spreads weights by (w² − 1)/12 + w²/6: so w² is 1 + b²/3, between two levels
 * by the share that gives the same variance. */
static struct vec3 trilinear(const struct plan_image *image, double b, double u, double v, struct image_edges edges)
{
    int exponent;
    double over = 2 * frexp(sqrt(1 + b * b / 3), &exponent); /* w = over × 2^finer, 1 <= over < 2 */
    uint32_t finer = (uint32_t)exponent - 1;
    if (finer + 1 >= image->levels)
        return bilinear(image, image->levels - 1, u, v, edges);
    struct vec3 color = bilinear(image, finer, u, v, edges);
    return vec3_mix(color, bilinear(image, finer + 1, u, v, edges), (over * over - 1) / 3);
}

#define NARROW 0.7 /* texels: hardly wider than a point */

/* Several looks along the footprint's longer edge, each as wide as the shorter one or wider. n looks of variance t²/12,
 * d apart, spread weights by t²/12 + d² (n² − 1)/12 in all: for a box that is `longer` wide, d² is
 * (longer² − t²)/(n² − 1). */
struct vec3 image_filter(const struct plan_image *image, const struct image_point *at, struct image_edges edges)
{
    enum { TAPS_MAX = 8 };
    double width = image->level[0].width, height = image->level[0].height;
    double edge_x = sqrt(at->u_x * width * (at->u_x * width) + at->v_x * height * (at->v_x * height));
    double edge_y = sqrt(at->u_y * width * (at->u_y * width) + at->v_y * height * (at->v_y * height));
    bool x_is_long = edge_x > edge_y;
    double longer = x_is_long ? edge_x : edge_y, shorter = x_is_long ? edge_y : edge_x;
    if (!(longer > NARROW)) /* or not a number, at a pole */
        return bilinear(image, 0, at->u, at->v, edges);
    if (longer > 4 * (width + height)) /* far beyond the whole image, and perhaps infinite */
        return bilinear(image, image->levels - 1, at->u, at->v, edges);
    double least = shorter > 1 ? shorter : 1;
    int taps = longer >= TAPS_MAX * least ? TAPS_MAX : (int)(longer / least) + (longer > least);
    taps = taps > TAPS_MAX ? TAPS_MAX : taps;
    if (taps <= 1)
        return trilinear(image, longer, at->u, at->v, edges);
    double tap_width = longer / taps > least ? longer / taps : least;
    double apart = sqrt((longer * longer - tap_width * tap_width) / (taps * taps - 1)) / longer;
    double step_u = x_is_long ? at->u_x : at->u_y, step_v = x_is_long ? at->v_x : at->v_y;
    struct vec3 sum = {0, 0, 0};
    for (int i = 0; i < taps; i++) {
        double along = (i + 0.5 - 0.5 * taps) * apart;
        sum = vec3_add(sum, trilinear(image, tap_width, at->u + along * step_u, at->v + along * step_v, edges));
    }
    return vec3_scale(sum, 1.0 / taps);
}
