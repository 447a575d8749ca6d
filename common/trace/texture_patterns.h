/*
 * Procedural textures: how much of the second colour there is at a point, as the mean over a footprint.
 *
 * For one ray and for lanes of rays: inline functions of doubles, without branches, as intersect.h says. The texture is
 * the same for a whole loop.
 */
#ifndef WEFT_TRACE_TEXTURE_PATTERNS_H
#define WEFT_TRACE_TEXTURE_PATTERNS_H

#include <math.h>

#include "math/elementary.h"
#include "trace/plan.h"

/* A point and the two edges of the footprint around it; both zero for a point alone. */
struct texture_area {
    struct vec3 middle, x, y;
};

static inline double row_value(const struct texture_row *row, struct vec3 position)
{
    return vec3_dot(row->gradient, position) + row->offset;
}

/* How far the coordinate ranges over the footprint. */
static inline double row_width(const struct texture_row *row, const struct texture_area *area)
{
    return fabs(vec3_dot(row->gradient, area->x)) + fabs(vec3_dot(row->gradient, area->y));
}

/* 0 for an even whole number, 1 for an odd one. */
static inline double parity(double cell)
{
    return cell - 2 * math_floor(cell / 2);
}

/* The integral from 0 of the square wave that is +1 where floor(s) is even and −1 where it is odd: a triangle
 * wave between 0 and 1. */
static inline double square_wave_integral(double s)
{
    return 1 - fabs(1 - parity(s));
}

/* The mean of that square wave over s ± width/2. Over a million cells, and where the width is not a number, it is 0 to
 * six digits. */
static inline double square_wave_mean(double s, double width)
{
    double low = s - width / 2, high = s + width / 2, cell = math_floor(low);
    double mean = (square_wave_integral(high) - square_wave_integral(low)) / width;
    mean = mean > 1 ? 1 : mean;
    mean = mean < -1 ? -1 : mean;
    mean = width < 1e6 ? mean : 0;
    double alone = parity(cell) == 0 ? 1 : -1;
    return cell == math_floor(high) ? alone : mean;
}

static inline double row_wave_mean(const struct texture_row *row, const struct texture_area *area)
{
    return square_wave_mean(row_value(row, area->middle), row_width(row, area));
}

static inline double stripes_share(const struct plan_texture *texture, const struct texture_area *area)
{
    return (1 - row_wave_mean(&texture->row[0], area)) / 2;
}

/* The parity of a cell is the product of its coordinates' square waves. A coordinate that is constant over a flat
 * surface (flat_axis 0, 1 or 2; none: −1) is left out: there, rounding alone would decide its parity. */
static inline double checker_share(const struct plan_texture *texture, const struct texture_area *area,
                                   double flat_axis)
{
    double x = row_wave_mean(&texture->row[0], area);
    double y = row_wave_mean(&texture->row[1], area);
    double z = row_wave_mean(&texture->row[2], area);
    x = flat_axis == 0 ? 1 : x;
    y = flat_axis == 1 ? 1 : y;
    z = flat_axis == 2 ? 1 : z;
    return (1 - x * y * z) / 2;
}

static inline double gradient_share(const struct plan_texture *texture, const struct texture_area *area)
{
    double share = row_value(&texture->row[0], area->middle);
    share = share < 0 ? 0 : share;
    return share > 1 ? 1 : share;
}

#endif
