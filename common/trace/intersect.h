/*
 * Where a ray meets each kind of primitive: scalar, in double, in the numerically stable forms.
 *
 * Every primitive is given in coordinates relative to the camera. Solids are intersected as intervals (the quadric's
 * interval and the slab's), so that no ray slips through between side and cap. Discriminants come from forms whose error
 * grows as the distance and not as its square: from the point nearest to the solid, or by Lagrange's identity
 * |o|²|d|² − (o · d)² = |o × d|².
 */
#ifndef WEFT_TRACE_INTERSECT_H
#define WEFT_TRACE_INTERSECT_H

#include <stdbool.h>
#include <stdint.h>

#include "math/transform.h"
#include "math/vec3.h"

/* The roots of a ray with one primitive. */
enum { SPAN_ENTER = 1, SPAN_LEAVE = 2 };

struct span {
    double enter, leave; /* any sign; meaningful if the root's bit is set */
    uint8_t roots;       /* SPAN_ENTER | SPAN_LEAVE */
    uint8_t enter_part, leave_part;
};

/* The pieces of a primitive's surface. */
enum { PART_SIDE = 0, PART_NARROW_CAP = 1, PART_WIDE_CAP = 2 }; /* frustum */
/* Boxes use the face's index 0..5: +x −x +y −y +z −z. All else has part 0. */

struct sphere {
    struct vec3 center;
    double radius;
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

/* The points of the plane with (u · q)² + (v · q)² <= 1, q = p − center. */
struct disc {
    struct plane plane;
    struct vec3 center, u, v;
};

/* Cone, cylinder and frustum. With (x, y, z) = frame (p − origin): x² + y² <= ρ(z)², 0 <= z <= height, where
 * ρ(z) = radius + slope z is the local radius, radius >= 0 that of the narrow end (0 at a cone's apex) and
 * slope >= 0 constant. open: only the side belongs to it. */
struct frustum {
    struct mat3 frame;
    struct vec3 origin; /* centre of the narrow end */
    double radius, slope, height;
    bool open;
};

/* With q = frame p: low.x <= q.x <= high.x and so on. Without a centre, faces in one plane have equal bits, and
 * nothing is lost far from the origin. */
struct box {
    struct mat3 frame;
    struct vec3 low, high;
};

/* Front: a, b, c counter-clockwise. The plane's normal is zero if the triangle has no area. */
struct triangle {
    struct vec3 a, b, c;
    struct plane plane;
};

struct triangle triangle_make(struct vec3 a, struct vec3 b, struct vec3 c);

/* What the triangle test needs of a ray: its largest direction axis z, the other two in an order that keeps
 * the winding, and the shear that makes the direction (0, 0, 1). */
struct shear {
    uint8_t x, y, z;
    double sx, sy, sz;
};

struct span sphere_span(const struct sphere *sphere, struct vec3 origin, struct vec3 direction);
struct span ellipsoid_span(const struct ellipsoid *ellipsoid, struct vec3 origin, struct vec3 direction);
struct span plane_span(const struct plane *plane, struct vec3 origin, struct vec3 direction);
struct span disc_span(const struct disc *disc, struct vec3 origin, struct vec3 direction);
struct span frustum_span(const struct frustum *frustum, struct vec3 origin, struct vec3 direction);
struct span box_span(const struct box *box, struct vec3 origin, struct vec3 direction);

struct shear shear_of(struct vec3 direction);

/* Watertight (Woop, Benthin and Wald, JCGT 2(1), 2013), but for t, which comes from the plane: weights of a
 * needle's corners are far less exact than its plane, and flat faces in one plane get equal t. Two triangles
 * that share an edge leave no gap and no overlap, because each edge's sign comes from one difference of products
 * of the same numbers, and where that is zero from the direction in which the edge runs. */
struct span triangle_span(const struct triangle *triangle, struct vec3 origin, struct vec3 direction,
                          const struct shear *shear);

/* The barycentric weights (of a, b, c; not negative, sum 1 to rounding) of the point where the ray meets the
 * triangle, which it does. */
struct vec3 triangle_weights(const struct triangle *triangle, struct vec3 origin, const struct shear *shear);

#endif
