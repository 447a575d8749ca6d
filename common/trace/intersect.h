/*
 * What rays are intersected with, and what comes of it. The arithmetic is in intersect_round.h (sphere, ellipsoid,
 * frustum) and intersect_flat.h (plane, disc, box, triangle).
 *
 * Every primitive is given in coordinates relative to the camera. Solids are intersected as intervals (the
 * quadric's interval and the slab's), so that no ray slips through between side and cap. Discriminants come from
 * forms whose error grows as the distance and not as its square: from the point nearest to the solid, or by
 * Lagrange's identity |o|²|d|² − (o · d)² = |o × d|².
 *
 * There is one source for one ray and for lanes of rays: inline functions of doubles alone, without branches. Both
 * sides of a choice are computed and one is selected, conditions are joined by & and |, and what does not exist is NaN.
 * So a loop over rays vectorises at any width, and every width rounds alike.
 */
#ifndef WEFT_TRACE_INTERSECT_H
#define WEFT_TRACE_INTERSECT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "math/transform.h"
#include "math/vec3.h"
#include "trace/ray.h"

/* Where a ray enters and leaves a primitive, as its parameter, of any sign; NaN where there is no such root. A flat
 * primitive is entered at the front or left at the back. An infinite root is none either: t_min < t < t_max is false
 * for it. enter > leave: the ray misses the solid, and leave is where it would leave if it were inside by rounding. */
struct roots {
    double enter, leave;
};

/* The pieces of a primitive's surface; those of box and frustum are found by box_part and frustum_part. */
enum { PART_SIDE = 0, PART_NARROW_CAP = 1, PART_WIDE_CAP = 2 }; /* frustum */
/* Boxes use the face's index 0..5: +x −x +y −y +z −z. All else has part 0. */

struct sphere {
    struct vec3 center;
    double radius;
};

/* A sphere whose surface passes near the eye, compared with its size. power is that of the eye, |center|² − radius²,
 * from the unrounded centre. */
struct globe {
    struct sphere sphere;
    double power;
};

/* A sphere under a transform that is no similarity: frame (p − center) is on the unit sphere. */
struct ellipsoid {
    struct mat3 frame;
    struct vec3 center;
};

/* normal · p = offset; normal is a unit vector and shows the front. */
struct plane {
    struct vec3 normal;
    double offset;
};

/* The points of the plane with (u · q)² + (v · q)² <= 1, q = p − center, which is a point of the plane to rounding. */
struct disc {
    struct plane plane;
    struct vec3 center, u, v;
};

/* Cone, cylinder and frustum. With (x, y, z) = frame (p − origin): x² + y² <= ρ(z)², between the planes z = 0 and
 * z = height, where ρ(z) = radius + slope z is the local radius, radius >= 0 that of the narrow end (0 at a cone's
 * apex) and slope >= 0 constant. open: only the side belongs to it. */
struct frustum {
    struct mat3 frame;
    struct vec3 origin; /* centre of the narrow end */
    double radius, slope, height;
    double balance;   /* see frustum_approach */
    struct vec3 axis; /* unit vector from the narrow end to the wide one, across both */
    double low, high; /* the ends again, as planes: low <= axis · p <= high */
    bool open;
};

/* With q = frame p: low.x <= q.x <= high.x and so on. The frame's rows are unit vectors. Without a centre, faces in one
 * plane have equal bits, and nothing is lost far from the origin. */
struct box {
    struct mat3 frame;
    struct vec3 low, high;
};

/* Front: a, b, c counter-clockwise. The plane's normal is zero if the triangle has no area. */
struct triangle {
    struct vec3 a, b, c;
    struct plane plane;
};

/* What the triangle test needs of a ray: the direction's largest axis, 0..2, which changes places with z; how far the
 * ray runs along x and y for a step along it; and −1 where that turns the winding over, else 1. */
struct shear {
    double axis, x, y, winding;
};

struct triangle triangle_make(struct vec3 a, struct vec3 b, struct vec3 c);

/* narrow and wide: the centres of the ends. */
struct frustum frustum_make(struct mat3 frame, struct vec3 narrow, struct vec3 wide, double radius, double slope,
                            double height, bool open);

/* --- intervals -------------------------------------------------------------------------------------------- */

/* A part of the ray, empty if low > high or one of them is NaN. */
struct interval {
    double low, high;
};

static inline struct interval interval_shifted(struct interval interval, double by)
{
    return (struct interval){interval.low + by, interval.high + by};
}

/* The common part; NaN in a goes on to the result, but not from b. */
static inline struct interval interval_cut(struct interval a, struct interval b)
{
    return (struct interval){b.low > a.low ? b.low : a.low, b.high < a.high ? b.high : a.high};
}

static inline struct roots interval_ends(struct interval interval)
{
    return (struct roots){interval.low <= interval.high ? interval.low : INFINITY, interval.high};
}

/* Where low <= o + t d <= high. */
static inline struct interval interval_of_slab(double o, double d, double low, double high)
{
    double t0 = (low - o) / d, t1 = (high - o) / d;
    double along = ((o >= low) & (o <= high)) ? INFINITY : -INFINITY; /* for a ray that runs along it */
    double first = d > 0 ? t0 : t1, last = d > 0 ? t1 : t0;
    return (struct interval){d == 0 ? -along : first, d == 0 ? along : last};
}

#endif
