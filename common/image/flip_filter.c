#include "image/flip_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "math/elementary.h"

/* --- colours ---------------------------------------------------------------------------------------------- */

/* Linear red, green and blue to X, Y and Z divided by white's: exact for the primaries of sRGB (IEC 61966-2-1) and a
 * white of x = 0.31271, y = 0.32902, the digits of D65 that the authors' own programs have. The rows add up to 1. */
static const struct mat3 to_xyz = {
    {10135552.0 / 23359437, 8788810.0 / 23359437, 4435075.0 / 23359437},
    {871024.0 / 4096299, 8788810.0 / 12288897, 887015.0 / 12288897},
    {158368.0 / 8920923, 8788810.0 / 80288307, 70074185.0 / 80288307},
};

/* The paper's YCxCz is 116 y − 16, 500 (x − y), 200 (y − z). Factors and offset are left out here: the filters are
 * linear and their weights add up to 1 (or, those of features, to 0), so nothing would be different. */
static struct flip_colours make_colours(void)
{
    struct mat3 to = {to_xyz.y, vec3_sub(to_xyz.x, to_xyz.y), vec3_sub(to_xyz.y, to_xyz.z)};
    return (struct flip_colours){to, mat3_inverse(&to)};
}

/* --- kernels ---------------------------------------------------------------------------------------------- */

static double sum_of(const double *weights, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += weights[i];
    return sum;
}

static void scale(double *weights, size_t count, double factor)
{
    for (size_t i = 0; i < count; i++)
        weights[i] *= factor;
}

/* One of the Gaussians a √(π / b) exp(−π² d² / b), d in degrees, whose sum is a contrast sensitivity function. */
struct sensitivity {
    double a, b;
};

static const struct sensitivity achromatic = {1, 0.0047}, red_green = {1, 0.0053}, blue_yellow_wide = {34.1, 0.04},
                                blue_yellow_narrow = {13.5, 0.025};

/* exp(−π² d² / b) */
static double *init_gaussian(struct flip_filters *filters, enum flip_kernel which, double b, double pixels_per_degree)
{
    double *kernel = filters->kernels[which];
    for (size_t i = 0; i < filters->taps; i++) {
        double d = ((double)i - (double)filters->radius) / pixels_per_degree;
        kernel[i] = math_exp(-M_PI * M_PI * d * d / b);
    }
    return kernel;
}

static void init_single(struct flip_filters *filters, enum flip_kernel which, double b, double pixels_per_degree)
{
    double *kernel = init_gaussian(filters, which, b, pixels_per_degree);
    scale(kernel, filters->taps, 1 / sum_of(kernel, filters->taps));
}

/* The two products of blue and yellow add up to 1 together; √π, which both have, is left out. */
static void init_double(struct flip_filters *filters, double pixels_per_degree)
{
    const struct sensitivity *of[2] = {&blue_yellow_wide, &blue_yellow_narrow};
    double *kernels[2], amplitudes[2], sum = 0;
    for (int i = 0; i < 2; i++) {
        kernels[i] = init_gaussian(filters, (enum flip_kernel)(FLIP_BLUE_YELLOW_WIDE + i), of[i]->b, pixels_per_degree);
        double taps = sum_of(kernels[i], filters->taps);
        amplitudes[i] = of[i]->a / sqrt(of[i]->b);
        sum += amplitudes[i] * taps * taps;
    }
    for (int i = 0; i < 2; i++)
        scale(kernels[i], filters->taps, sqrt(amplitudes[i] / sum));
}

/* The positive weights then add up to 1, the negative ones to −1. */
static void balance(double *weights, size_t count)
{
    double positive = 0, negative = 0;
    for (size_t i = 0; i < count; i++)
        *(weights[i] > 0 ? &positive : &negative) += weights[i];
    for (size_t i = 0; i < count; i++)
        weights[i] /= weights[i] > 0 ? positive : -negative;
}

/* The first and second derivatives of a Gaussian, and the Gaussian for the other direction. From peak to trough of the
 * first is 0.082 degrees, which is twice the standard deviation; the kernels end at three of these. */
static void init_features(struct flip_filters *filters, double pixels_per_degree)
{
    const double deviation = 0.5 * 0.082 * pixels_per_degree, reach = ceil(3 * deviation);
    for (size_t i = 0; i < filters->taps; i++) {
        double x = (double)i - (double)filters->radius, s = x / deviation;
        double gaussian = fabs(x) <= reach ? math_exp(-0.5 * s * s) : 0;
        filters->kernels[FLIP_SMOOTH][i] = gaussian;
        filters->kernels[FLIP_EDGE][i] = -x * gaussian;
        filters->kernels[FLIP_POINT][i] = (s * s - 1) * gaussian;
    }
    double *smooth = filters->kernels[FLIP_SMOOTH];
    scale(smooth, filters->taps, 1 / sum_of(smooth, filters->taps));
    balance(filters->kernels[FLIP_EDGE], filters->taps);
    balance(filters->kernels[FLIP_POINT], filters->taps);
}

/* All reach as far as the widest sensitivity does: three standard deviations √(b / 2π²). Features reach less far. */
void flip_filters_init(struct flip_filters *filters, double pixels_per_degree)
{
    filters->radius = (size_t)ceil(3 * sqrt(blue_yellow_wide.b / 2) / M_PI * pixels_per_degree);
    filters->taps = 2 * filters->radius + 1;
    init_single(filters, FLIP_ACHROMATIC, achromatic.b, pixels_per_degree);
    init_single(filters, FLIP_RED_GREEN, red_green.b, pixels_per_degree);
    init_double(filters, pixels_per_degree);
    init_features(filters, pixels_per_degree);
    filters->colours = make_colours();
}

/* --- filtering -------------------------------------------------------------------------------------------- */

void flip_workspace_init(struct flip_workspace *workspace, const struct flip_filters *filters)
{
    workspace->patch_width = FLIP_TILE_WIDTH + 2 * filters->radius;
    workspace->patch_height = FLIP_TILE_HEIGHT + 2 * filters->radius;
    for (int c = 0; c < 3; c++)
        workspace->patch[c] = memory_array(workspace->patch_width * workspace->patch_height, sizeof(double));
    workspace->rows = memory_array(workspace->patch_height * FLIP_TILE_WIDTH, sizeof(double));
}

void flip_workspace_finish(struct flip_workspace *workspace)
{
    for (int c = 0; c < 3; c++)
        free(workspace->patch[c]);
    free(workspace->rows);
}

/* Coordinate `at` of the patch, in the image: radius less, and no further than the borders. */
static size_t inside(uint32_t start, size_t at, size_t radius, uint32_t size)
{
    size_t shifted = start + at;
    shifted = shifted < radius ? 0 : shifted - radius;
    return shifted < size ? shifted : size - 1;
}

static void load_patch(const struct flip_filters *filters, const struct image *image, uint32_t x0, uint32_t y0,
                       struct flip_workspace *workspace)
{
    for (size_t j = 0; j < workspace->patch_height; j++) {
        const float *row = image->rgb + 3 * image->width * inside(y0, j, filters->radius, image->height);
        for (size_t i = 0; i < workspace->patch_width; i++) {
            const float *rgb = row + 3 * inside(x0, i, filters->radius, image->width);
            struct vec3 linear = vec3_make(flip_clamp(rgb[0]), flip_clamp(rgb[1]), flip_clamp(rgb[2]));
            struct vec3 opponent = mat3_apply(&filters->colours.to_opponent, linear);
            size_t at = j * workspace->patch_width + i;
            workspace->patch[0][at] = opponent.x;
            workspace->patch[1][at] = opponent.y;
            workspace->patch[2][at] = opponent.z;
        }
    }
}

/* Adds to each of to[count] its neighbours from[i], from[i + step] ... times the weights; four at a time, to load and
 * store the sums less often. */
static void add_weighted(const double *restrict from, size_t step, const double *weights, size_t taps,
                         double *restrict to, size_t count)
{
    size_t tap = 0;
    for (; tap + 4 <= taps; tap += 4, from += 4 * step) {
        double w0 = weights[tap], w1 = weights[tap + 1], w2 = weights[tap + 2], w3 = weights[tap + 3];
        for (size_t i = 0; i < count; i++)
            to[i] += (w0 * from[i] + w1 * from[i + step]) + (w2 * from[i + 2 * step] + w3 * from[i + 3 * step]);
    }
    for (; tap < taps; tap++, from += step)
        for (size_t i = 0; i < count; i++)
            to[i] += weights[tap] * from[i];
}

/* The products of kernels, of which plane `to` is the sum. */
static const struct {
    int patch;
    enum flip_kernel along, across; /* the row */
    enum flip_plane to;
} products[] = {
    {0, FLIP_ACHROMATIC, FLIP_ACHROMATIC, FLIP_Y},
    {1, FLIP_RED_GREEN, FLIP_RED_GREEN, FLIP_X_Y},
    {2, FLIP_BLUE_YELLOW_WIDE, FLIP_BLUE_YELLOW_WIDE, FLIP_Y_Z},
    {2, FLIP_BLUE_YELLOW_NARROW, FLIP_BLUE_YELLOW_NARROW, FLIP_Y_Z},
    {0, FLIP_EDGE, FLIP_SMOOTH, FLIP_EDGE_ALONG},
    {0, FLIP_SMOOTH, FLIP_EDGE, FLIP_EDGE_ACROSS},
    {0, FLIP_POINT, FLIP_SMOOTH, FLIP_POINT_ALONG},
    {0, FLIP_SMOOTH, FLIP_POINT, FLIP_POINT_ACROSS},
};

void flip_filter_tile(const struct flip_filters *filters, const struct image *image, uint32_t x0, uint32_t y0,
                      uint32_t width, uint32_t height, struct flip_workspace *workspace, struct flip_tile *tile)
{
    load_patch(filters, image, x0, y0, workspace);
    memset(tile, 0, sizeof *tile);
    for (size_t p = 0; p < sizeof products / sizeof *products; p++) {
        const double *along = filters->kernels[products[p].along], *across = filters->kernels[products[p].across];
        const double *patch = workspace->patch[products[p].patch];
        size_t rows = height + 2 * filters->radius;
        memset(workspace->rows, 0, rows * FLIP_TILE_WIDTH * sizeof(double));
        for (size_t j = 0; j < rows; j++)
            add_weighted(patch + j * workspace->patch_width, 1, along, filters->taps,
                         workspace->rows + j * FLIP_TILE_WIDTH, width);
        for (size_t j = 0; j < height; j++)
            add_weighted(workspace->rows + j * FLIP_TILE_WIDTH, FLIP_TILE_WIDTH, across, filters->taps,
                         tile->planes[products[p].to] + j * FLIP_TILE_WIDTH, width);
    }
}
