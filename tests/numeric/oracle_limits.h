/*
 * What a kernel may answer for a ray and a shape: an oracle with 113-bit numbers, for any one ray however
 * nasty, which shares no code with the kernels. (oracle_picture.h is for whole pictures.) It takes the scene
 * model as exact, and works in each object's own coordinates by the textbook's quadratics: b² − ac loses
 * D² · 2^-113 at a distance of D radii, which is 1e-22 at D = 10^6.
 *
 * What a kernel may answer is bounded by growing and shrinking the shape by a slack: the root of a convex solid
 * that some ray moved by at most the slack has lies between the roots with the grown and with the shrunk solid.
 * So a root is right if it is the exact one for an impact parameter moved by at most the slack, also where the
 * root itself is ill-conditioned.
 */
#ifndef WEFT_TESTS_ORACLE_LIMITS_H
#define WEFT_TESTS_ORACLE_LIMITS_H

#include <float.h>
#include <math.h>
#include <stdbool.h>

#include "scene/model.h"
#include "tests/numeric/quad.h"
#include "trace/ray.h"

static inline real limits_max(real a, real b)
{
    return a > b ? a : b;
}

static inline real limits_min(real a, real b)
{
    return a < b ? a : b;
}

/* --- rays in an object's coordinates ---------------------------------------------------------------------- */

/* The way from rays relative to the eye into an object's own coordinates. */
struct limits_frame {
    struct quad_matrix inverse;
    struct quad3 offset; /* of the transform, minus the eye */
};

/* origin + t direction, with the same t as in the world. */
struct limits_ray {
    struct quad3 origin, direction;
};

static inline struct limits_frame limits_frame_of(const struct affine *transform, struct vec3 eye)
{
    return (struct limits_frame){quad_inverse(&transform->linear),
                                 quad_sub(quad_of(transform->offset), quad_of(eye))};
}

static inline struct limits_ray limits_ray_in(const struct limits_frame *frame, struct vec3 origin,
                                              struct vec3 direction)
{
    struct quad3 from = quad_sub(quad_of(origin), frame->offset);
    return (struct limits_ray){quad_apply(&frame->inverse, from),
                               quad_apply(&frame->inverse, quad_of(direction))};
}

static inline struct quad3 limits_point(const struct limits_ray *ray, real t)
{
    return quad_add_scaled(ray->origin, ray->direction, t);
}

/* --- convex solids, grown or shrunk ----------------------------------------------------------------------- */

/* A stretch of the ray; empty if low > high. */
struct limits_interval {
    real low, high;
};

static const struct limits_interval limits_all = {-INFINITY, INFINITY};
static const struct limits_interval limits_empty = {INFINITY, -INFINITY};

static inline struct limits_interval limits_both(struct limits_interval a, struct limits_interval b)
{
    return (struct limits_interval){limits_max(a.low, b.low), limits_min(a.high, b.high)};
}

/* Where rate · t + start >= 0. */
static inline struct limits_interval limits_half(real start, real rate)
{
    if (rate == 0)
        return start >= 0 ? limits_all : limits_empty;
    real root = -start / rate;
    return rate > 0 ? (struct limits_interval){root, INFINITY} : (struct limits_interval){-INFINITY, root};
}

/* Where low <= o + t d <= high. */
static inline struct limits_interval limits_between(real o, real d, real low, real high)
{
    return limits_both(limits_half(o - low, d), limits_half(high - o, -d));
}

/* Where a t² + 2 b t + c <= 0 within a stretch in which that is known to be one stretch. */
static inline struct limits_interval limits_not_positive(real a, real b, real c, struct limits_interval within)
{
    if (a == 0)
        return limits_both(limits_half(-c, -2 * b), within);
    real discriminant = b * b - a * c;
    if (a > 0 && discriminant < 0)
        return limits_empty;
    real root = quad_sqrt(discriminant), q = b > 0 ? -b - root : -b + root;
    real r0 = q == 0 ? 0 : c / q, r1 = q / a;
    if (a > 0)
        return limits_both((struct limits_interval){limits_min(r0, r1), limits_max(r0, r1)}, within);
    struct limits_interval before =
        limits_both((struct limits_interval){-INFINITY, limits_min(r0, r1)}, within);
    struct limits_interval after = limits_both((struct limits_interval){limits_max(r0, r1), INFINITY}, within);
    return after.high - after.low > before.high - before.low ? after : before;
}

static inline struct limits_interval limits_sphere(const struct shape *shape, const struct limits_ray *ray,
                                                   real grow)
{
    struct quad3 o = quad_sub(ray->origin, quad_of(shape->sphere.center));
    real radius = shape->sphere.radius + grow;
    if (radius < 0)
        return limits_empty;
    return limits_not_positive(quad_dot(ray->direction, ray->direction), quad_dot(o, ray->direction),
                               quad_dot(o, o) - radius * radius, limits_all);
}

/* The frustum's axis and its radius as a function of the height above its base. */
struct limits_axis {
    struct quad3 unit;
    real length, radius, slope, steepness; /* steepness: √(1 + slope²) */
};

static inline struct limits_axis limits_axis_of(const struct shape *shape)
{
    struct quad3 along = quad_sub(quad_of(shape->frustum.top), quad_of(shape->frustum.base));
    struct limits_axis axis = {.length = quad_length(along), .radius = shape->frustum.base_radius};
    axis.unit = quad_scale(along, 1 / axis.length);
    axis.slope = ((real)shape->frustum.top_radius - shape->frustum.base_radius) / axis.length;
    axis.steepness = quad_sqrt(1 + axis.slope * axis.slope);
    return axis;
}

/* Within the frustum's side, extended without end on the nappe on which it lies. */
static inline struct limits_interval limits_side(const struct shape *shape, const struct limits_ray *ray,
                                                 real grow)
{
    struct limits_axis axis = limits_axis_of(shape);
    struct quad3 o = quad_sub(ray->origin, quad_of(shape->frustum.base));
    struct quad3 across_o = quad_cross(o, axis.unit), across_d = quad_cross(ray->direction, axis.unit);
    real rho = axis.radius + grow * axis.steepness + axis.slope * quad_dot(o, axis.unit);
    real rate = axis.slope * quad_dot(ray->direction, axis.unit);
    return limits_not_positive(quad_dot(across_d, across_d) - rate * rate,
                               quad_dot(across_o, across_d) - rho * rate,
                               quad_dot(across_o, across_o) - rho * rho, limits_half(rho, rate));
}

/* Between the frustum's ends. */
static inline struct limits_interval limits_ends(const struct shape *shape, const struct limits_ray *ray,
                                                 real grow)
{
    struct limits_axis axis = limits_axis_of(shape);
    struct quad3 o = quad_sub(ray->origin, quad_of(shape->frustum.base));
    return limits_between(quad_dot(o, axis.unit), quad_dot(ray->direction, axis.unit), -grow,
                          axis.length + grow);
}

static inline struct limits_interval limits_box(const struct shape *shape, const struct limits_ray *ray,
                                                real grow)
{
    struct quad3 min = quad_of(shape->box.min), max = quad_of(shape->box.max);
    struct limits_interval x = limits_between(ray->origin.x, ray->direction.x, min.x - grow, max.x + grow);
    struct limits_interval y = limits_between(ray->origin.y, ray->direction.y, min.y - grow, max.y + grow);
    struct limits_interval z = limits_between(ray->origin.z, ray->direction.z, min.z - grow, max.z + grow);
    return limits_both(x, limits_both(y, z));
}

/* Where the ray is inside a closed shape (a frustum as if it had its caps) that has grown on all sides. */
static inline struct limits_interval limits_inside(const struct shape *shape, const struct limits_ray *ray,
                                                   real grow)
{
    if (shape->kind == SHAPE_SPHERE)
        return limits_sphere(shape, ray, grow);
    if (shape->kind == SHAPE_BOX)
        return limits_box(shape, ray, grow);
    return limits_both(limits_side(shape, ray, grow), limits_ends(shape, ray, grow));
}

/* --- flat shapes ------------------------------------------------------------------------------------------ */

struct limits_plane {
    struct quad3 point, normal; /* unit, on the front */
};

static inline struct limits_plane limits_plane_of(const struct shape *shape)
{
    if (shape->kind == SHAPE_PLANE)
        return (struct limits_plane){quad_of(shape->plane.point), quad_normalize(quad_of(shape->plane.normal))};
    if (shape->kind == SHAPE_DISC)
        return (struct limits_plane){quad_of(shape->disc.center), quad_normalize(quad_of(shape->disc.normal))};
    const struct vec3 *points = shape->mesh.points; /* of the first triangle */
    struct quad3 a = quad_of(points[0]), b = quad_of(points[1]), c = quad_of(points[2]);
    return (struct limits_plane){a, quad_normalize(quad_cross(quad_sub(b, a), quad_sub(c, a)))};
}

/* How far inside the outline a ray passes, and how far some ray passes that is moved by `slack`, at worst
 * and at best: below 0 outside. */
struct limits_margin {
    real worst, best;
};

/* A ray moved by slack meets the plane farther along by up to slack / |cosine|, and moved sideways by slack. */
static inline struct limits_margin limits_disc_margin(const struct shape *shape, const struct limits_ray *ray,
                                                      const struct limits_plane *plane, real cosine, real slack)
{
    real t = -quad_dot(quad_sub(ray->origin, plane->point), plane->normal) / cosine;
    struct quad3 p = quad_sub(limits_point(ray, t), plane->point);
    struct quad3 along = quad_sub(ray->direction, quad_scale(plane->normal, cosine));
    real length = quad_length(along), reach = slack / quad_abs(cosine);
    real at = length > 0 ? quad_dot(p, along) / length : 0;
    real aside = length > 0 ? quad_length(quad_cross(p, along)) / length : quad_length(p);
    real near = limits_max(quad_abs(at) - reach, 0), far = quad_abs(at) + reach, radius = shape->disc.radius;
    return (struct limits_margin){radius - slack - quad_sqrt(far * far + aside * aside),
                                  radius + slack - quad_sqrt(near * near + aside * aside)};
}

/* The distance of the ray's line from that through p and q, positive where the line runs counter-clockwise
 * around the ray as seen against its direction. */
static inline real limits_edge_distance(const struct limits_ray *ray, struct quad3 p, struct quad3 q)
{
    struct quad3 across = quad_cross(quad_sub(q, p), ray->direction);
    return quad_dot(quad_sub(p, ray->origin), across) / quad_length(across);
}

static inline struct limits_margin limits_triangle_margin(const struct shape *shape,
                                                          const struct limits_ray *ray, real slack)
{
    struct quad3 p[3];
    real least = INFINITY, most = -INFINITY;
    for (int i = 0; i < 3; i++)
        p[i] = quad_of(shape->mesh.points[i]);
    for (int i = 0; i < 3; i++) {
        real distance = limits_edge_distance(ray, p[i], p[(i + 1) % 3]);
        least = limits_min(least, distance);
        most = limits_max(most, distance);
    }
    real inside = limits_max(least, -most);
    return (struct limits_margin){inside - slack, inside + slack};
}

/* --- what a kernel may answer ----------------------------------------------------------------------------- */

/* low <= t <= high for a root that may be there; one that must be there is there for every ray moved by the
 * slack. */
struct limits_root {
    real low, high;
    bool may, must;
};

struct limits_roots {
    struct limits_root side[2]; /* by enum side */
};

static inline struct limits_roots limits_roots_of(struct limits_interval grown, struct limits_interval shrunk)
{
    bool may = grown.low <= grown.high, must = shrunk.low <= shrunk.high;
    return (struct limits_roots){{{grown.low, must ? shrunk.low : grown.high, may, must},
                                  {must ? shrunk.high : grown.low, grown.high, may, must}}};
}

/* Keeps a root of the side as far as it lies between the ends. */
static inline struct limits_root limits_cut(struct limits_root root, struct limits_interval grown_ends,
                                            struct limits_interval shrunk_ends)
{
    bool finite = quad_abs(root.low) < (real)INFINITY || quad_abs(root.high) < (real)INFINITY;
    root.must = root.must && finite && root.low >= shrunk_ends.low && root.high <= shrunk_ends.high;
    root.low = limits_max(root.low, grown_ends.low);
    root.high = limits_min(root.high, grown_ends.high);
    root.may = root.may && finite && root.low <= root.high;
    return root;
}

/* A triangle is seen from the side from which its corners are, each moved by the slack: by a tilt of as
 * much. */
static inline struct limits_roots limits_flat_roots(const struct shape *shape, const struct limits_ray *ray,
                                                    real slack)
{
    struct limits_plane plane = limits_plane_of(shape);
    real cosine = quad_dot(plane.normal, ray->direction), length = quad_length(ray->direction);
    real height = quad_dot(plane.normal, quad_sub(ray->origin, plane.point));
    struct limits_interval near = limits_between(height, cosine, -slack, slack);
    struct limits_margin margin = {INFINITY, INFINITY};
    if (shape->kind == SHAPE_DISC && cosine != 0)
        margin = limits_disc_margin(shape, ray, &plane, cosine, slack);
    if (shape->kind == SHAPE_MESH)
        margin = limits_triangle_margin(shape, ray, slack);
    real tilt = 8 * (real)DBL_EPSILON + (shape->kind == SHAPE_MESH ? slack : 0);
    bool sure = quad_abs(cosine) > tilt * length; /* from which side the ray comes */
    struct limits_root root = {near.low, near.high, near.low <= near.high && margin.best >= 0,
                               sure && margin.worst >= 0};
    struct limits_root other = {near.low, near.high, root.may && !sure, false};
    return cosine < 0 ? (struct limits_roots){{root, other}} : (struct limits_roots){{other, root}};
}

/* The roots of a ray (in the shape's own coordinates) moved by at most `slack` > 0, a length in those
 * coordinates. A mesh is its first triangle. */
static inline struct limits_roots limits_roots(const struct shape *shape, const struct limits_ray *ray,
                                               real slack)
{
    if (shape->kind == SHAPE_PLANE || shape->kind == SHAPE_DISC || shape->kind == SHAPE_MESH)
        return limits_flat_roots(shape, ray, slack);
    if (shape->kind != SHAPE_FRUSTUM || !shape->frustum.open)
        return limits_roots_of(limits_inside(shape, ray, slack), limits_inside(shape, ray, -slack));
    struct limits_roots roots =
        limits_roots_of(limits_side(shape, ray, slack), limits_side(shape, ray, -slack));
    struct limits_interval grown = limits_ends(shape, ray, slack), shrunk = limits_ends(shape, ray, -slack);
    roots.side[SIDE_ENTER] = limits_cut(roots.side[SIDE_ENTER], grown, shrunk);
    roots.side[SIDE_LEAVE] = limits_cut(roots.side[SIDE_LEAVE], grown, shrunk);
    return roots;
}

/* The exact t at which the ray meets the shape on that side; NAN if it does not. */
static inline real limits_t(const struct shape *shape, const struct limits_ray *ray, enum side side)
{
    struct limits_roots roots = limits_roots(shape, ray, 0);
    struct limits_root root = roots.side[side];
    return !root.may ? (real)NAN : side == SIDE_ENTER ? root.low : root.high;
}

/* How far a point (in the shape's own coordinates) is from the shape's surface, to first order; above 0
 * outside. */
static inline real limits_distance(const struct shape *shape, struct quad3 p)
{
    if (shape->kind == SHAPE_SPHERE)
        return quad_length(quad_sub(p, quad_of(shape->sphere.center))) - shape->sphere.radius;
    if (shape->kind == SHAPE_BOX) {
        struct quad3 low = quad_sub(quad_of(shape->box.min), p), high = quad_sub(p, quad_of(shape->box.max));
        return limits_max(limits_max(limits_max(low.x, low.y), limits_max(low.z, high.x)),
                          limits_max(high.y, high.z));
    }
    if (shape->kind == SHAPE_FRUSTUM) {
        struct limits_axis axis = limits_axis_of(shape);
        struct quad3 q = quad_sub(p, quad_of(shape->frustum.base));
        real z = quad_dot(q, axis.unit), across = quad_length(quad_cross(q, axis.unit));
        real side = (across - axis.radius - axis.slope * z) / axis.steepness;
        return shape->frustum.open ? side : limits_max(side, limits_max(-z, z - axis.length));
    }
    struct limits_plane plane = limits_plane_of(shape);
    return quad_dot(quad_sub(p, plane.point), plane.normal);
}

#endif
