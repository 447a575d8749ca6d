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

/* A footprint is cut into STRIPS across its longer edge. Within one, widths along both edges are added up, and rows are
 * taken to be independent of one another; over the whole of a long one neither would do (RMSE of a floor up to the
 * horizon by 16 samples: 0.0040 without, 0.0029 with 4 strips, and no better with more). */
enum { STRIPS = 4 };

struct strips {
    struct texture_area first;
    struct vec3 step; /* from one to the next */
};

/* How far all rows together range along an edge. */
static inline double rows_range(const struct texture_row row[3], struct vec3 edge)
{
    return fabs(vec3_dot(row[0].gradient, edge)) + fabs(vec3_dot(row[1].gradient, edge)) +
           fabs(vec3_dot(row[2].gradient, edge));
}

static inline struct strips strips_of(const struct texture_row row[3], const struct texture_area *area)
{
    double cut_x = rows_range(row, area->x) > rows_range(row, area->y) ? 1 : 0;
    double share_x = cut_x != 0 ? 1.0 / STRIPS : 1, share_y = cut_x != 0 ? 1 : 1.0 / STRIPS;
    struct vec3 x = vec3_scale(area->x, share_x), y = vec3_scale(area->y, share_y);
    struct vec3 step = vec3_make(cut_x != 0 ? x.x : y.x, cut_x != 0 ? x.y : y.y, cut_x != 0 ? x.z : y.z);
    return (struct strips){{vec3_add_scaled(area->middle, step, -0.5 * (STRIPS - 1)), x, y}, step};
}

static inline struct texture_area strip_at(const struct strips *strips, double index)
{
    struct texture_area area = strips->first;
    area.middle = vec3_add_scaled(area.middle, strips->step, index);
    return area;
}

static inline double stripes_wave(const struct texture_row row[3], const struct strips *strips, double index)
{
    struct texture_area area = strip_at(strips, index);
    return row_wave_mean(&row[0], &area);
}

static inline double stripes_share(const struct plan_texture *texture, const struct texture_area *area)
{
    const struct texture_row *row = texture->row;
    struct strips strips = strips_of(row, area);
    double sum = stripes_wave(row, &strips, 0) + stripes_wave(row, &strips, 1) + stripes_wave(row, &strips, 2) +
                 stripes_wave(row, &strips, 3);
    return (1 - sum / STRIPS) / 2;
}

/* The parity of a cell is the product of its coordinates' square waves. A coordinate that is constant over a flat
 * surface (flat_axis 0, 1 or 2; none: −1) is left out: there, rounding alone would decide its parity. */
static inline double checker_wave(const struct texture_row row[3], double flat_axis, const struct strips *strips,
                                  double index)
{
    struct texture_area area = strip_at(strips, index);
    double x = row_wave_mean(&row[0], &area);
    double y = row_wave_mean(&row[1], &area);
    double z = row_wave_mean(&row[2], &area);
    x = flat_axis == 0 ? 1 : x;
    y = flat_axis == 1 ? 1 : y;
    z = flat_axis == 2 ? 1 : z;
    return x * y * z;
}

static inline double checker_share(const struct plan_texture *texture, const struct texture_area *area,
                                   double flat_axis)
{
    const struct texture_row *row = texture->row;
    struct strips strips = strips_of(row, area);
    double sum = checker_wave(row, flat_axis, &strips, 0) + checker_wave(row, flat_axis, &strips, 1) +
                 checker_wave(row, flat_axis, &strips, 2) + checker_wave(row, flat_axis, &strips, 3);
    return (1 - sum / STRIPS) / 2;
}

static inline double gradient_share(const struct plan_texture *texture, const struct texture_area *area)
{
    double share = row_value(&texture->row[0], area->middle);
    share = share < 0 ? 0 : share;
    return share > 1 ? 1 : share;
}

#endif
