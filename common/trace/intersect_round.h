/* Where rays meet spheres, globes, ellipsoids and frustums. Without branches: see intersect.h. */
#ifndef WEFT_TRACE_INTERSECT_ROUND_H
#define WEFT_TRACE_INTERSECT_ROUND_H

#include "trace/intersect.h"

/* A ray that misses takes the root of a negative number, which is NaN. */
static inline struct roots sphere_roots(const struct sphere *sphere, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = vec3_sub(origin, sphere->center);
    double middle = -vec3_dot(o, direction);
    struct vec3 nearest = vec3_add_scaled(o, direction, middle);
    double half_chord = sqrt(sphere->radius * sphere->radius - vec3_dot(nearest, nearest));
    return (struct roots){middle - half_chord, middle + half_chord};
}

/* Not below 0 where sphere_roots has roots. */
static inline double sphere_slack(const struct sphere *sphere, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = vec3_sub(origin, sphere->center);
    struct vec3 nearest = vec3_add_scaled(o, direction, -vec3_dot(o, direction));
    return sphere->radius * sphere->radius - vec3_dot(nearest, nearest);
}

/* The two roots of a t² + 2 b t + c, not constant, in order, from the discriminant b² − ac; NaN if that is negative.
 * The smaller root comes from c / q, so nothing cancels; but for a ray that starts where it touches the surface, q
 * and c are both rounding errors, and their quotient must not exceed the larger root. */
static inline struct interval quadratic_roots(double a, double b, double c, double discriminant)
{
    double q = -(b + copysign(sqrt(discriminant), b));
    double r0 = c / q, r1 = q / a;
    r0 = fabs(r0) > fabs(r1) ? copysign(r1, r0) : r0;
    r0 = q == 0 ? 0 : r0;
    return (struct interval){r0 < r1 ? r0 : r1, r0 < r1 ? r1 : r0};
}

static inline struct roots ellipsoid_roots(const struct ellipsoid *ellipsoid, struct vec3 origin,
                                           struct vec3 direction)
{
    struct vec3 o = mat3_apply(&ellipsoid->frame, vec3_sub(origin, ellipsoid->center));
    struct vec3 d = mat3_apply(&ellipsoid->frame, direction);
    struct vec3 moment = vec3_cross(o, d);
    double a = vec3_dot(d, d), discriminant = a - vec3_dot(moment, moment);
    struct interval inside = quadratic_roots(a, vec3_dot(o, d), vec3_dot(o, o) - 1, discriminant);
    return (struct roots){inside.low, inside.high};
}

/* --- globes ----------------------------------------------------------------------------------------------- */

/* Whether p is nearer to the eye than half the radius. */
static inline bool globe_is_near(const struct globe *globe, struct vec3 p)
{
    return vec3_dot(p, p) < 0.25 * globe->sphere.radius * globe->sphere.radius;
}

/* The power of point p, |p − center|² − radius². Near the eye it is p² − 2 p · center plus the eye's power, where only
 * numbers of the size of |p| radius are rounded, instead of radius²: what there is lost of a height above the ground is
 * 2^-53 of the distance, not of the radius. */
static inline double globe_power(const struct globe *globe, struct vec3 p)
{
    const struct sphere *sphere = &globe->sphere;
    struct vec3 q = vec3_sub(p, sphere->center);
    double near = vec3_dot(p, p) - 2 * vec3_dot(p, sphere->center) + globe->power;
    double far = vec3_dot(q, q) - sphere->radius * sphere->radius;
    return globe_is_near(globe, p) ? near : far;
}

/* The product of the roots is the origin's power; and their sum twice the way to the middle, `middle`. From there
 * farther away than the radius, the discriminant middle² − power would lose more than that of sphere_roots. */
static inline struct roots globe_roots(const struct globe *globe, struct vec3 origin, struct vec3 direction)
{
    const struct sphere *sphere = &globe->sphere;
    struct vec3 o = vec3_sub(origin, sphere->center);
    double middle = -vec3_dot(o, direction), power = globe_power(globe, origin);
    struct vec3 nearest = vec3_add_scaled(o, direction, middle);
    double far = sphere->radius * sphere->radius - vec3_dot(nearest, nearest);
    double discriminant = globe_is_near(globe, origin) ? middle * middle - power : far;
    struct interval inside = quadratic_roots(1, -middle, power, discriminant);
    return (struct roots){inside.low, inside.high};
}

/* --- frustums --------------------------------------------------------------------------------------------- */

/* Where a ray is within the infinite cone or cylinder x² + y² <= (ρ + δ t)² on the nappe where ρ + δ t >= 0. With
 * the form ⟨p, q⟩ = px qx + py qy − pρ qρ: a = ⟨d, d⟩, b = ⟨o, d⟩, c = ⟨o, o⟩. The start must be near the solid
 * (frustum_approach): then no large numbers cancel.
 *
 * a > 0: between two roots, or nowhere. a < 0: the ray is steeper than the side, meets each nappe once, and is inside
 * beyond both roots. a = 0: it is parallel to a generator, and one root is infinite; if b = 0 too, it never meets the
 * side. */
static inline struct interval quadric_interval(double ox, double oy, double rho, double dx, double dy, double delta)
{
    double a = dx * dx + dy * dy - delta * delta;
    double b = ox * dx + oy * dy - rho * delta;
    double c = ox * ox + oy * oy - rho * rho;
    double discriminant = b * b - a * c;
    struct interval roots = quadratic_roots(a, b, c, ((a < 0) & (discriminant < 0)) ? 0 : discriminant);
    struct interval nappe = {delta > 0 ? roots.high : -INFINITY, delta > 0 ? INFINITY : roots.low};
    struct interval inside = {a < 0 ? nappe.low : roots.low, a < 0 ? nappe.high : roots.high};
    bool constant = (a == 0) & (b == 0);
    double always = c <= 0 ? INFINITY : -INFINITY;
    return (struct interval){constant ? -always : inside.low, constant ? always : inside.high};
}

/* From far away, a, b and c are small differences of large numbers, whose errors grow as the square of the distance. So
 * the ray is first taken to where it comes nearest to the narrow end, lengths along the axis counted in units in which
 * the solid is as long as it is wide: a ray that meets the solid is then at most about a radius from the axis, and all
 * that is lost is one rounding of the distance. The parameter of that point. */
static inline double frustum_approach(const struct frustum *frustum, struct vec3 o, struct vec3 d)
{
    struct vec3 weighted = vec3_mul(d, vec3_make(1, 1, frustum->balance));
    return -vec3_dot(o, weighted) / vec3_dot(d, weighted);
}

/* Not below 0 where a ray meets the side, continued without end. */
static inline double frustum_slack(const struct frustum *frustum, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&frustum->frame, vec3_sub(origin, frustum->origin));
    struct vec3 d = mat3_apply(&frustum->frame, direction);
    o = vec3_add_scaled(o, d, frustum_approach(frustum, o, d));
    double rho = frustum->radius + frustum->slope * o.z, delta = frustum->slope * d.z;
    double a = d.x * d.x + d.y * d.y - delta * delta;
    double b = o.x * d.x + o.y * d.y - rho * delta;
    double c = o.x * o.x + o.y * o.y - rho * rho;
    double discriminant = b * b - a * c;
    return -a > discriminant ? -a : discriminant;
}

/* Where a ray is within the side, continued without end, and where between the end planes. */
struct frustum_cut {
    struct interval side, ends;
};

static inline struct frustum_cut frustum_cut(const struct frustum *frustum, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&frustum->frame, vec3_sub(origin, frustum->origin));
    struct vec3 d = mat3_apply(&frustum->frame, direction);
    double start = frustum_approach(frustum, o, d);
    o = vec3_add_scaled(o, d, start);
    struct interval side = quadric_interval(o.x, o.y, frustum->radius + frustum->slope * o.z, d.x, d.y,
                                            frustum->slope * d.z);
    struct interval ends = interval_of_slab(vec3_dot(frustum->axis, origin), vec3_dot(frustum->axis, direction),
                                            frustum->low, frustum->high);
    return (struct frustum_cut){interval_shifted(side, start), ends};
}

static inline struct roots frustum_capped_roots(const struct frustum *frustum, struct vec3 origin,
                                                struct vec3 direction)
{
    struct frustum_cut cut = frustum_cut(frustum, origin, direction);
    return interval_ends(interval_cut(cut.side, cut.ends));
}

/* Of the side alone: each end of its interval that lies between the end planes. */
static inline struct roots frustum_open_roots(const struct frustum *frustum, struct vec3 origin,
                                              struct vec3 direction)
{
    struct frustum_cut cut = frustum_cut(frustum, origin, direction);
    struct interval side = cut.side, ends = cut.ends;
    bool some = side.low <= side.high;
    bool enters = some & (side.low >= ends.low) & (side.low <= ends.high) & (side.low > -INFINITY);
    bool leaves = some & (side.high >= ends.low) & (side.high <= ends.high) & (side.high < INFINITY);
    return (struct roots){enters ? side.low : NAN, leaves ? side.high : NAN};
}

/* For one ray: by a branch. */
static inline struct roots frustum_roots(const struct frustum *frustum, struct vec3 origin, struct vec3 direction)
{
    return frustum->open ? frustum_open_roots(frustum, origin, direction)
                         : frustum_capped_roots(frustum, origin, direction);
}

/* The piece of a capped frustum's surface at that root (SIDE_ENTER or SIDE_LEAVE) of the ray, which has it. */
static inline double frustum_capped_part(const struct frustum *frustum, struct vec3 origin, struct vec3 direction,
                                         double side)
{
    struct frustum_cut cut = frustum_cut(frustum, origin, direction);
    double axial = vec3_dot(frustum->axis, direction);
    double into_wide = side == SIDE_ENTER ? -axial : axial;
    double end = side == SIDE_ENTER ? cut.ends.low : -cut.ends.high;
    double wall = side == SIDE_ENTER ? cut.side.low : -cut.side.high;
    double cap = into_wide < 0 ? PART_NARROW_CAP : PART_WIDE_CAP;
    double part = end >= wall ? cap : PART_SIDE;
    return cut.ends.low <= cut.ends.high ? part : PART_SIDE;
}

static inline double frustum_part(const struct frustum *frustum, struct vec3 origin, struct vec3 direction,
                                  double side)
{
    return frustum->open ? PART_SIDE : frustum_capped_part(frustum, origin, direction, side);
}

#endif
