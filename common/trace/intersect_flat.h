/* Where rays meet planes, discs, boxes and triangles. Without branches: see intersect.h. */
#ifndef WEFT_TRACE_INTERSECT_FLAT_H
#define WEFT_TRACE_INTERSECT_FLAT_H

#include "trace/intersect.h"

/* The one root: entering if the ray runs to the front (towards > 0), leaving if to the back, none along the plane. */
static inline struct roots flat_roots(double t, double towards)
{
    return (struct roots){towards > 0 ? t : NAN, towards < 0 ? t : NAN};
}

static inline double plane_distance(const struct plane *plane, struct vec3 origin, struct vec3 direction)
{
    return (plane->offset - vec3_dot(plane->normal, origin)) / vec3_dot(plane->normal, direction);
}

static inline struct roots plane_roots(const struct plane *plane, struct vec3 origin, struct vec3 direction)
{
    return flat_roots(plane_distance(plane, origin, direction), -vec3_dot(plane->normal, direction));
}

static inline struct roots disc_roots(const struct disc *disc, struct vec3 origin, struct vec3 direction)
{
    double t = plane_distance(&disc->plane, origin, direction);
    struct vec3 q = vec3_add_scaled(vec3_sub(origin, disc->center), direction, t);
    double u = vec3_dot(disc->u, q), v = vec3_dot(disc->v, q);
    return flat_roots(u * u + v * v <= 1 ? t : NAN, -vec3_dot(disc->plane.normal, direction));
}

static inline struct roots box_roots(const struct box *box, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&box->frame, origin);
    struct vec3 d = mat3_apply(&box->frame, direction);
    struct interval inside = interval_of_slab(o.x, d.x, box->low.x, box->high.x);
    inside = interval_cut(inside, interval_of_slab(o.y, d.y, box->low.y, box->high.y));
    inside = interval_cut(inside, interval_of_slab(o.z, d.z, box->low.z, box->high.z));
    return interval_ends(inside);
}

/* Where a ray meets the slab that bounds it last on its way to the nearer (SIDE_ENTER) or farther side of a box,
 * counted so that the largest is the one that it meets there; and which of the two faces that is: 0 or 1. */
struct box_wall {
    double rank, face;
};

static inline struct box_wall box_wall(double o, double d, double low, double high, double side)
{
    struct interval slab = interval_of_slab(o, d, low, high);
    double inwards = side == SIDE_ENTER ? d : -d;
    return (struct box_wall){side == SIDE_ENTER ? slab.low : -slab.high, inwards > 0 ? 1 : 0};
}

/* The face at that root (SIDE_ENTER or SIDE_LEAVE) of the ray, which has it. */
static inline double box_part(const struct box *box, struct vec3 origin, struct vec3 direction, double side)
{
    struct vec3 o = mat3_apply(&box->frame, origin), d = mat3_apply(&box->frame, direction);
    struct box_wall x = box_wall(o.x, d.x, box->low.x, box->high.x, side);
    struct box_wall y = box_wall(o.y, d.y, box->low.y, box->high.y, side);
    struct box_wall z = box_wall(o.z, d.z, box->low.z, box->high.z, side);
    double part = y.rank > x.rank ? 2 + y.face : x.face, rank = y.rank > x.rank ? y.rank : x.rank;
    return z.rank > rank ? 4 + z.face : part;
}

/* --- triangles -------------------------------------------------------------------------------------------- */

/* v with z and that axis exchanged. */
static inline struct vec3 axis_to_z(struct vec3 v, double axis)
{
    double y_or_z = axis == 1 ? v.y : v.z;
    return vec3_make(axis == 0 ? v.z : v.x, axis == 1 ? v.z : v.y, axis == 0 ? v.x : y_or_z);
}

static inline struct shear shear_of(struct vec3 direction)
{
    double x = fabs(direction.x), y = fabs(direction.y), z = fabs(direction.z);
    double other = y > z ? 1 : 2;
    double axis = x > y ? (x > z ? 0 : 2) : other;
    struct vec3 d = axis_to_z(direction, axis);
    return (struct shear){axis, d.x / d.z, d.y / d.z, copysign(1, d.z) * (axis == 2 ? 1 : -1)};
}

/* A vertex as seen along the ray: x and y across it. */
static inline struct vec3 sheared(struct vec3 vertex, struct vec3 origin, const struct shear *shear)
{
    struct vec3 v = axis_to_z(vec3_sub(vertex, origin), shear->axis);
    return vec3_make(v.x - shear->x * v.z, v.y - shear->y * v.z, v.z);
}

/* Twice the signed areas that the ray spans with the edges opposite a, b and c. The sign of each is exact or
 * zero: a rounded difference of rounded products cannot turn it. */
static inline struct vec3 edge_areas(struct vec3 a, struct vec3 b, struct vec3 c)
{
    return vec3_make(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
}

/* Its sign is the side of the edge from p to q on which the ray passes, given their area. A ray through the edge itself
 * is taken to pass beside it by an infinitesimal step along x and a yet smaller one along y (Edelsbrunner and Mücke,
 * "Simulation of Simplicity", ACM TOG 9(1), 1990): so it meets exactly one of the triangles around an edge or a
 * vertex. Zero only if p and q are seen in one point. */
static inline double edge_side(struct vec3 p, struct vec3 q, double area)
{
    double across = p.y - q.y, along = q.x - p.x;
    double tie = across == 0 ? along : across;
    return area == 0 ? tie : area;
}

/* The root t of a ray that meets the triangle's plane there, if it passes through the triangle. `shear` is
 * shear_of(direction).
 *
 * Watertight (Woop, Benthin and Wald, JCGT 2(1), 2013): two triangles that share an edge leave no gap and no overlap,
 * because each edge's sign comes from one difference of products of the same numbers, and where that is zero from the
 * direction in which the edge runs. */
static inline struct roots triangle_roots_at(const struct triangle *triangle, struct vec3 origin,
                                             const struct shear *shear, double t)
{
    struct vec3 a = sheared(triangle->a, origin, shear);
    struct vec3 b = sheared(triangle->b, origin, shear);
    struct vec3 c = sheared(triangle->c, origin, shear);
    struct vec3 area = edge_areas(a, b, c);
    double bc = edge_side(c, b, area.x), ca = edge_side(a, c, area.y), ab = edge_side(b, a, area.z);
    bool met = ((bc > 0) & (ca > 0) & (ab > 0)) | ((bc < 0) & (ca < 0) & (ab < 0));
    /* Counter-clockwise, so seen from the front, makes the areas positive. */
    return flat_roots(met ? t : NAN, (area.x + area.y + area.z) * shear->winding);
}

/* t comes from the triangle's plane: weights of a needle's corners are far less exact than its plane, and flat faces in
 * one plane get equal t. Rounding puts it off by about 16 u (|origin| + |corner|) / |normal · direction|, u = 2^-53.
 * Where that sine is below GRAZED, t is kept to where the ray is within the triangle. */
#define GRAZED 0x1p-12

static inline bool triangle_is_grazed(const struct triangle *triangle, struct vec3 direction)
{
    return fabs(vec3_dot(triangle->plane.normal, direction)) < GRAZED;
}

/* Of a ray that does not graze the triangle. */
static inline struct roots triangle_steep_roots(const struct triangle *triangle, struct vec3 origin,
                                                struct vec3 direction, const struct shear *shear)
{
    return triangle_roots_at(triangle, origin, shear, plane_distance(&triangle->plane, origin, direction));
}

/* Adds to a range of depths the one at which the edge from p to q, as seen along a ray, crosses x = 0, if it does. */
static inline struct interval edge_depth(struct interval range, struct vec3 p, struct vec3 q)
{
    double share = p.x == q.x ? 0 : p.x / (p.x - q.x);
    double z = p.z + share * (q.z - p.z);
    bool passes = ((p.x <= 0) & (q.x >= 0)) | ((p.x >= 0) & (q.x <= 0));
    struct interval joined = {z < range.low ? z : range.low, z > range.high ? z : range.high};
    return passes ? joined : range;
}

/* Where along a ray that passes through the triangle it may be within it: where the plane does that holds the ray and
 * one of the axes across it. Of the two axes that for which this plane cuts the triangle's own more steeply. */
static inline struct interval triangle_stay(const struct triangle *triangle, struct vec3 origin, struct vec3 direction,
                                            const struct shear *shear)
{
    struct vec3 a = sheared(triangle->a, origin, shear);
    struct vec3 b = sheared(triangle->b, origin, shear);
    struct vec3 c = sheared(triangle->c, origin, shear);
    struct vec3 d = axis_to_z(direction, shear->axis), normal = axis_to_z(triangle->plane.normal, shear->axis);
    if (fabs(normal.x) > fabs(normal.y)) {
        a.x = a.y;
        b.x = b.y;
        c.x = c.y;
    }
    struct interval depths = {INFINITY, -INFINITY};
    depths = edge_depth(edge_depth(edge_depth(depths, a, b), b, c), c, a);
    double first = depths.low / d.z, last = depths.high / d.z;
    return (struct interval){first < last ? first : last, first < last ? last : first};
}

/* Of a ray that grazes the triangle.
 *
 * The ray is then near a point of the triangle at t, as it is for steeper rays, and so within every box that holds the
 * point, or for a triangle in pieces within that of the piece that does: no tree can lose the hit, because of nearer
 * ones or of where the ray begins and ends, and from every leaf that has the triangle it is the same hit. For the signs
 * of the areas are exact for corners that are moved by a few u (|origin| + |corner|). There the stay holds the place
 * where the ray meets the plane, and at each of its depths the triangle has a point beside the ray along one axis. How
 * far beside is told by the ray's distance from the plane, at most 3 times that, as the normal is across the ray: a few
 * u at the plane's t, and less at an end of the stay that lies between that and the place. */
static inline struct roots triangle_grazed_roots(const struct triangle *triangle, struct vec3 origin,
                                                 struct vec3 direction, const struct shear *shear)
{
    struct interval stay = triangle_stay(triangle, origin, direction, shear);
    double t = plane_distance(&triangle->plane, origin, direction);
    double kept = t > stay.low ? t : stay.low; /* also where t is 0 / 0 */
    kept = kept < stay.high ? kept : stay.high;
    return triangle_roots_at(triangle, origin, shear, vec3_is_zero(triangle->plane.normal) ? NAN : kept);
}

/* For one ray: by a branch. */
static inline struct roots triangle_roots(const struct triangle *triangle, struct vec3 origin, struct vec3 direction,
                                          const struct shear *shear)
{
    return triangle_is_grazed(triangle, direction) ? triangle_grazed_roots(triangle, origin, direction, shear)
                                                   : triangle_steep_roots(triangle, origin, direction, shear);
}

/* Not below 0 where triangle_roots has a root, and seldom elsewhere. */
static inline double triangle_slack(const struct triangle *triangle, struct vec3 origin, const struct shear *shear)
{
    struct vec3 area = edge_areas(sheared(triangle->a, origin, shear), sheared(triangle->b, origin, shear),
                                  sheared(triangle->c, origin, shear));
    double least = area.x < area.y ? area.x : area.y, most = area.x > area.y ? area.x : area.y;
    least = area.z < least ? area.z : least;
    most = area.z > most ? area.z : most;
    return least > -most ? least : -most;
}

/* The barycentric weights (of a, b, c; not negative, sum 1 to rounding) of the point where the ray meets the
 * triangle, which it does. */
static inline struct vec3 triangle_weights(const struct triangle *triangle, struct vec3 origin,
                                           const struct shear *shear)
{
    struct vec3 area = edge_areas(sheared(triangle->a, origin, shear), sheared(triangle->b, origin, shear),
                                  sheared(triangle->c, origin, shear));
    double total = area.x + area.y + area.z;
    return vec3_make(area.x / total, area.y / total, area.z / total);
}

#endif
