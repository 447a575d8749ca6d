/*
 * The surface of each kind of primitive near a point: the point on it, its normal, and how normal and barycentric
 * weights change along it.
 *
 * For one ray and for lanes of rays: inline functions of doubles, without branches, as intersect.h says. The kind of
 * primitive is the same for a whole loop; `part` is box_part's or frustum_part's (PART_SIDE for an open frustum).
 */
#ifndef WEFT_TRACE_SURFACE_SHAPES_H
#define WEFT_TRACE_SURFACE_SHAPES_H

#include <float.h>
#include <math.h>

#include "trace/ahead.h"
#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"

struct surface_point {
    struct vec3 position; /* on the surface to within `error` in every coordinate */
    double error;
    struct vec3 normal; /* unit; outward, or towards the front of a flat primitive */
};

/* Near the surface, by the ray's error, which grows with t: the point of the ray at the root t of that side, without
 * the delay of leaving roots, whose share of |t| + |origin| is `leave_share`. */
static inline struct vec3 surface_near(struct vec3 origin, struct vec3 direction, double t, double side,
                                       double leave_share)
{
    double leave = t - leave_delay(leave_share, t, vec3_max_abs(origin));
    return vec3_add_scaled(origin, direction, side == SIDE_LEAVE ? leave : t);
}

/* A few roundings of coordinates of that size: the error of a point on a surface. */
static inline double surface_error(double size)
{
    return 8 * DBL_EPSILON * size;
}

/* The component of a step that is across the unit normal. */
static inline struct vec3 surface_across(struct vec3 step, struct vec3 normal)
{
    return vec3_add_scaled(step, normal, -vec3_dot(step, normal));
}

/* --- what is given by F(p) = 0 ---------------------------------------------------------------------------- */

struct implicit {
    double value;
    struct vec3 gradient;
};

static inline struct implicit sphere_implicit(const struct sphere *sphere, struct vec3 p)
{
    struct vec3 q = vec3_sub(p, sphere->center);
    return (struct implicit){0.5 * (vec3_dot(q, q) - sphere->radius * sphere->radius), q};
}

static inline struct implicit globe_implicit(const struct globe *globe, struct vec3 p)
{
    return (struct implicit){0.5 * globe_power(globe, p), vec3_sub(p, globe->sphere.center)};
}

static inline struct implicit ellipsoid_implicit(const struct ellipsoid *ellipsoid, struct vec3 p)
{
    struct vec3 q = mat3_apply(&ellipsoid->frame, vec3_sub(p, ellipsoid->center));
    return (struct implicit){0.5 * (vec3_dot(q, q) - 1), mat3_apply_transposed(&ellipsoid->frame, q)};
}

/* Of the side or an end plane. The apex, where the gradient vanishes, looks along the axis. */
static inline struct implicit frustum_implicit(const struct frustum *frustum, struct vec3 p, double part)
{
    struct vec3 q = mat3_apply(&frustum->frame, vec3_sub(p, frustum->origin));
    double rho = frustum->radius + frustum->slope * q.z;
    struct vec3 side = {q.x, q.y, -frustum->slope * rho};
    double steepest = vec3_max_abs(side);
    double value = steepest == 0 ? 0 : 0.5 * (q.x * q.x + q.y * q.y - rho * rho);
    double along = steepest == 0 ? -1 : side.z;
    value = part == PART_NARROW_CAP ? -q.z : value;
    value = part == PART_WIDE_CAP ? q.z - frustum->height : value;
    along = part == PART_NARROW_CAP ? -1 : along;
    along = part == PART_WIDE_CAP ? 1 : along;
    struct vec3 gradient = {part == PART_SIDE ? side.x : 0, part == PART_SIDE ? side.y : 0, along};
    return (struct implicit){value, mat3_apply_transposed(&frustum->frame, gradient)};
}

/* Of one face's plane. */
static inline struct implicit box_implicit(const struct box *box, struct vec3 p, double face)
{
    struct vec3 x = box->frame.x, y = box->frame.y, z = box->frame.z;
    struct vec3 row = {face < 2 ? x.x : face < 4 ? y.x : z.x, face < 2 ? x.y : face < 4 ? y.y : z.y,
                       face < 2 ? x.z : face < 4 ? y.z : z.z};
    double low = face < 2 ? box->low.x : face < 4 ? box->low.y : box->low.z;
    double high = face < 2 ? box->high.x : face < 4 ? box->high.y : box->high.z;
    double which = face < 2 ? face : face < 4 ? face - 2 : face - 4; /* 0: at the high side */
    double at = vec3_dot(row, p), sign = 1 - 2 * which;
    return (struct implicit){which == 0 ? at - high : low - at, vec3_scale(row, sign)};
}

/* One of Newton's steps takes the point to within its coordinates' rounding errors. */
static inline struct vec3 implicit_step(struct implicit at, struct vec3 p)
{
    return vec3_add_scaled(p, at.gradient, -at.value / vec3_dot(at.gradient, at.gradient));
}

/* --- points and normals ----------------------------------------------------------------------------------- */

/* All take a point near the surface (surface_near) and the object's extent. */

static inline struct surface_point sphere_surface(const struct sphere *sphere, struct vec3 near, double extent)
{
    struct vec3 p = implicit_step(sphere_implicit(sphere, near), near);
    double size = vec3_max_abs(p) + vec3_max_abs(sphere->center) + extent;
    return (struct surface_point){p, surface_error(size), vec3_normalize(sphere_implicit(sphere, p).gradient)};
}

static inline struct surface_point globe_surface(const struct globe *globe, struct vec3 near, double extent)
{
    struct vec3 p = implicit_step(globe_implicit(globe, near), near);
    double far = vec3_max_abs(p) + vec3_max_abs(globe->sphere.center) + extent;
    double size = globe_is_near(globe, p) ? 2 * vec3_max_abs(p) : far;
    return (struct surface_point){p, surface_error(size), vec3_normalize(globe_implicit(globe, p).gradient)};
}

static inline struct surface_point ellipsoid_surface(const struct ellipsoid *ellipsoid, struct vec3 near,
                                                     double extent)
{
    struct vec3 p = implicit_step(ellipsoid_implicit(ellipsoid, near), near);
    struct vec3 normal = vec3_normalize(ellipsoid_implicit(ellipsoid, p).gradient);
    return (struct surface_point){
        p, surface_error(vec3_max_abs(p) + vec3_max_abs(ellipsoid->center) + extent), normal};
}

static inline struct surface_point frustum_surface(const struct frustum *frustum, struct vec3 near, double part,
                                                   double extent)
{
    struct vec3 p = implicit_step(frustum_implicit(frustum, near, part), near);
    struct vec3 normal = vec3_normalize(frustum_implicit(frustum, p, part).gradient);
    return (struct surface_point){
        p, surface_error(vec3_max_abs(p) + vec3_max_abs(frustum->origin) + extent), normal};
}

static inline struct surface_point box_surface(const struct box *box, struct vec3 near, double face, double extent)
{
    struct implicit at = box_implicit(box, near, face);
    struct vec3 p = implicit_step(at, near);
    return (struct surface_point){p, surface_error(vec3_max_abs(p) + extent), vec3_normalize(at.gradient)};
}

static inline struct vec3 plane_nearest(const struct plane *plane, struct vec3 p)
{
    return vec3_add_scaled(p, plane->normal, plane->offset - vec3_dot(plane->normal, p));
}

static inline struct surface_point plane_surface(const struct plane *plane, struct vec3 near, double extent)
{
    struct vec3 p = plane_nearest(plane, near);
    return (struct surface_point){p, surface_error(vec3_max_abs(p) + extent), plane->normal};
}

static inline struct surface_point triangle_surface(const struct triangle *triangle, struct vec3 near)
{
    double a = vec3_max_abs(triangle->a), b = vec3_max_abs(triangle->b), c = vec3_max_abs(triangle->c);
    double size = b > a ? b : a;
    size = c > size ? c : size;
    const struct plane plane = triangle->plane; /* gcc 12 does not gather through a pointer to a part */
    return (struct surface_point){plane_nearest(&plane, near), surface_error(size), plane.normal};
}

/* --- curvature -------------------------------------------------------------------------------------------- */

/* The change of the unit normal at a position on the surface for a step along it: the shape operator, which is the
 * matrix of F's second derivatives over |gradient|, across the normal. Faces and planes have none. */

static inline struct vec3 sphere_normal_change(const struct sphere *sphere, struct vec3 position, struct vec3 normal,
                                               struct vec3 step)
{
    double length = vec3_length(sphere_implicit(sphere, position).gradient);
    return surface_across(vec3_scale(step, 1 / length), normal);
}

static inline struct vec3 ellipsoid_normal_change(const struct ellipsoid *ellipsoid, struct vec3 position,
                                                  struct vec3 normal, struct vec3 step)
{
    double length = vec3_length(ellipsoid_implicit(ellipsoid, position).gradient);
    struct vec3 change = mat3_apply_transposed(&ellipsoid->frame, mat3_apply(&ellipsoid->frame, step));
    return surface_across(vec3_scale(change, 1 / length), normal);
}

static inline struct vec3 frustum_normal_change(const struct frustum *frustum, struct vec3 position, double part,
                                                struct vec3 normal, struct vec3 step)
{
    double length = vec3_length(frustum_implicit(frustum, position, PART_SIDE).gradient);
    double share = part == PART_SIDE ? 1 / length : 0;
    struct vec3 second = {1, 1, -frustum->slope * frustum->slope};
    struct vec3 change = vec3_mul(second, mat3_apply(&frustum->frame, step));
    change = mat3_apply_transposed(&frustum->frame, change);
    return surface_across(vec3_scale(change, share), normal);
}

/* --- triangles -------------------------------------------------------------------------------------------- */

/* The change of the barycentric weights (of a, b, c) of the triangle's plane along a step. */
static inline struct vec3 triangle_weights_change(const struct triangle *triangle, struct vec3 step)
{
    struct vec3 ab = vec3_sub(triangle->b, triangle->a), ac = vec3_sub(triangle->c, triangle->a);
    struct vec3 n = vec3_cross(ab, ac);
    double square = vec3_dot(n, n);
    double b = vec3_dot(vec3_cross(step, ac), n) / square, c = vec3_dot(vec3_cross(ab, step), n) / square;
    return vec3_make(-(b + c), b, c);
}

/* The normals at a triangle's corners, in the order of the weights below. */
struct corner_normals {
    struct vec3 a, b, c;
};

/* The sum of the corners' normals with these weights. */
static inline struct vec3 normals_sum(const struct corner_normals *corners, struct vec3 weights)
{
    struct vec3 n = vec3_scale(corners->a, weights.x);
    n = vec3_add_scaled(n, corners->b, weights.y);
    return vec3_add_scaled(n, corners->c, weights.z);
}

/* That sum as a unit vector; `flat` if it is zero. */
static inline struct vec3 normals_blend(const struct corner_normals *corners, struct vec3 weights, struct vec3 flat)
{
    struct vec3 sum = normals_sum(corners, weights), unit = vec3_normalize(sum);
    double largest = vec3_max_abs(sum);
    return vec3_make(largest == 0 ? flat.x : unit.x, largest == 0 ? flat.y : unit.y, largest == 0 ? flat.z : unit.z);
}

/* The change of the blended normal where the weights change so. */
static inline struct vec3 normals_blend_change(const struct corner_normals *corners, struct vec3 weights,
                                               struct vec3 blended, struct vec3 weights_change)
{
    double length = vec3_length(normals_sum(corners, weights));
    double share = length == 0 ? 0 : 1 / length;
    struct vec3 change = vec3_scale(normals_sum(corners, weights_change), share);
    return surface_across(change, blended);
}

/* --- footprints ------------------------------------------------------------------------------------------- */

/* How far a neighbouring ray's meeting with the tangent plane at t is from this ray's (Igehy's transfer): it is a
 * little farther or nearer. */
static inline struct vec3 surface_transfer(struct vec3 direction, double t, struct vec3 normal,
                                           struct vec3 origin_change, struct vec3 direction_change)
{
    struct vec3 step = vec3_add_scaled(origin_change, direction_change, t);
    double cosine = vec3_dot(direction, normal), farther = -vec3_dot(step, normal) / cosine;
    return vec3_add_scaled(step, direction, cosine == 0 ? 0 : farther);
}

#endif
