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

/* Where a ray meets the slab that bounds it last on its way to the nearer (SIDE_ENTER) or farther side of a box, counted
 * so that the largest is the one that it meets there; and which of the two faces that is: 0 or 1. */
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

/* Watertight (Woop, Benthin and Wald, JCGT 2(1), 2013), but for t, which comes from the plane: weights of a
 * needle's corners are far less exact than its plane, and flat faces in one plane get equal t. Two triangles
 * that share an edge leave no gap and no overlap, because each edge's sign comes from one difference of products
 * of the same numbers, and where that is zero from the direction in which the edge runs. `shear` is
 * shear_of(direction). */
static inline struct roots triangle_roots(const struct triangle *triangle, struct vec3 origin, struct vec3 direction,
                                          const struct shear *shear)
{
    struct vec3 a = sheared(triangle->a, origin, shear);
    struct vec3 b = sheared(triangle->b, origin, shear);
    struct vec3 c = sheared(triangle->c, origin, shear);
    struct vec3 area = edge_areas(a, b, c);
    double bc = edge_side(c, b, area.x), ca = edge_side(a, c, area.y), ab = edge_side(b, a, area.z);
    bool met = ((bc > 0) & (ca > 0) & (ab > 0)) | ((bc < 0) & (ca < 0) & (ab < 0));
    double t = plane_distance(&triangle->plane, origin, direction);
    /* Counter-clockwise, so seen from the front, makes the areas positive. */
    return flat_roots(met ? t : NAN, (area.x + area.y + area.z) * shear->winding);
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
