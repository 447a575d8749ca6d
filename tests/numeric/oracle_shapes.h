/*
 * Where a line crosses each shape of the model, by textbook formulas in quadruple precision: sides and caps
 * apart, b² − ac as it stands. Nothing is shared with the tracing core but the model.
 */
#ifndef WEFT_TESTS_ORACLE_SHAPES_H
#define WEFT_TESTS_ORACLE_SHAPES_H

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>

#include "scene/model.h"
#include "tests/numeric/quad.h"

enum { ORACLE_CROSSINGS_MAX = 256 };

struct oracle_ray {
    struct quad3 origin, direction;
};

/* Where a line crosses the surface of an object. */
struct oracle_crossing {
    real t;
    size_t object;
    bool enters;         /* against the normal */
    struct quad3 normal; /* in the object's own coordinates, of any length; outward, or on the front */
};

struct oracle_crossings {
    struct oracle_crossing at[ORACLE_CROSSINGS_MAX];
    size_t count;
};

/* An object, and the way from the world to its own coordinates. */
struct oracle_object {
    const struct object *object;
    struct quad_matrix inverse;
    struct quad3 offset;
};

static inline struct quad3 oracle_point_at(const struct oracle_ray *ray, real t)
{
    return quad_add_scaled(ray->origin, ray->direction, t);
}

/* What the functions below add to: crossings of one object, met along `ray` in its own coordinates. */
struct oracle_search {
    const struct oracle_object *of;
    size_t index;
    struct oracle_ray ray;
    struct oracle_crossings *found;
};

static inline void oracle_found(struct oracle_search *search, real t, struct quad3 normal)
{
    real along = quad_dot(normal, search->ray.direction);
    if (along == 0)
        return;
    assert(search->found->count < ORACLE_CROSSINGS_MAX);
    search->found->at[search->found->count++] = (struct oracle_crossing){t, search->index, along < 0, normal};
}

/* The real roots of a t² + 2 b t + c. */
static inline int oracle_roots(real a, real b, real c, real roots[2])
{
    real square = b * b - a * c;
    if (square < 0)
        return 0;
    real q = b < 0 ? -b + quad_sqrt(square) : -b - quad_sqrt(square);
    int count = 0;
    if (a != 0)
        roots[count++] = q / a;
    if (q != 0)
        roots[count++] = c / q;
    return count;
}

/* The ray's point that is nearest to `center`, as seen from there, and its t: so that b² − ac is of the shape's
 * size and not of the distance's. */
static inline real oracle_approach(const struct oracle_ray *ray, struct vec3 center, struct quad3 *point)
{
    struct quad3 o = quad_sub(ray->origin, quad_of(center));
    real t = -quad_dot(o, ray->direction) / quad_dot(ray->direction, ray->direction);
    *point = quad_add_scaled(o, ray->direction, t);
    return t;
}

static inline void oracle_sphere(struct oracle_search *search, const struct shape *shape)
{
    struct quad3 d = search->ray.direction, o;
    real radius = shape->sphere.radius, roots[2];
    real shift = oracle_approach(&search->ray, shape->sphere.center, &o);
    int count = oracle_roots(quad_dot(d, d), quad_dot(o, d), quad_dot(o, o) - radius * radius, roots);
    for (int i = 0; i < count; i++)
        oracle_found(search, shift + roots[i], quad_add_scaled(o, d, roots[i]));
}

/* *t of the ray's point in the plane; false along it. */
static inline bool oracle_plane_t(const struct oracle_ray *ray, struct quad3 point, struct quad3 normal,
                                  real *t)
{
    real along = quad_dot(normal, ray->direction);
    if (along == 0)
        return false;
    *t = quad_dot(normal, quad_sub(point, ray->origin)) / along;
    return true;
}

static inline void oracle_plane(struct oracle_search *search, const struct shape *shape)
{
    real t;
    struct quad3 normal = quad_of(shape->plane.normal);
    if (oracle_plane_t(&search->ray, quad_of(shape->plane.point), normal, &t))
        oracle_found(search, t, normal);
}

/* A round plate. */
static inline void oracle_plate(struct oracle_search *search, struct quad3 center, struct quad3 normal,
                                real radius)
{
    real t;
    if (!oracle_plane_t(&search->ray, center, normal, &t))
        return;
    struct quad3 p = quad_sub(oracle_point_at(&search->ray, t), center);
    if (quad_dot(p, p) <= radius * radius)
        oracle_found(search, t, normal);
}

static inline void oracle_disc(struct oracle_search *search, const struct shape *shape)
{
    oracle_plate(search, quad_of(shape->disc.center), quad_of(shape->disc.normal), shape->disc.radius);
}

/* The side x² + y² = ρ(z)², with z along the axis from the base and ρ = base_radius + slope z. */
static inline void oracle_frustum(struct oracle_search *search, const struct shape *shape)
{
    struct quad3 base = quad_of(shape->frustum.base), top = quad_of(shape->frustum.top);
    real height = quad_length(quad_sub(top, base)), base_radius = shape->frustum.base_radius;
    real top_radius = shape->frustum.top_radius, slope = (top_radius - base_radius) / height;
    struct quad3 axis = quad_scale(quad_sub(top, base), 1 / height), d = search->ray.direction, o;
    real shift = oracle_approach(&search->ray, shape->frustum.base, &o);
    real oz = quad_dot(o, axis), dz = quad_dot(d, axis), rho = base_radius + slope * oz, roots[2];
    struct quad3 across = quad_add_scaled(o, axis, -oz), turn = quad_add_scaled(d, axis, -dz);
    int count = oracle_roots(quad_dot(turn, turn) - slope * slope * dz * dz,
                             quad_dot(across, turn) - slope * dz * rho,
                             quad_dot(across, across) - rho * rho, roots);
    for (int i = 0; i < count; i++) {
        real z = oz + roots[i] * dz, radius = rho + roots[i] * slope * dz;
        if (z < 0 || z > height || radius < 0)
            continue;
        struct quad3 outward = quad_add_scaled(across, turn, roots[i]);
        oracle_found(search, shift + roots[i], quad_add_scaled(outward, axis, -slope * radius));
    }
    if (shape->frustum.open)
        return;
    oracle_plate(search, base, quad_scale(axis, -1), base_radius);
    oracle_plate(search, top, axis, top_radius);
}

static inline void oracle_box(struct oracle_search *search, const struct shape *shape)
{
    const struct vec3 low = shape->box.min, high = shape->box.max;
    const double at[2][3] = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, side = face % 2;
        real along[3] = {0, 0, 0}, t;
        along[axis] = side ? 1 : -1;
        struct quad3 normal = {along[0], along[1], along[2]};
        if (!oracle_plane_t(&search->ray, quad_of(side ? high : low), normal, &t))
            continue;
        struct quad3 p = oracle_point_at(&search->ray, t);
        const real place[3] = {p.x, p.y, p.z};
        bool inside = true;
        for (int other = 0; other < 3; other++)
            inside = inside && (other == axis ||
                                (place[other] >= at[0][other] && place[other] <= at[1][other]));
        if (inside)
            oracle_found(search, t, normal);
    }
}

/* Flat faces; smooth normals are not for the oracle. */
static inline void oracle_mesh(struct oracle_search *search, const struct shape *shape)
{
    const struct mesh *mesh = &shape->mesh;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        struct quad3 corner[3];
        for (int c = 0; c < 3; c++)
            corner[c] = quad_of(mesh->points[mesh->index[3 * i + (size_t)c]]);
        struct quad3 normal = quad_cross(quad_sub(corner[1], corner[0]), quad_sub(corner[2], corner[0]));
        real t;
        if (!oracle_plane_t(&search->ray, corner[0], normal, &t))
            continue;
        struct quad3 p = oracle_point_at(&search->ray, t);
        bool inside = true;
        for (int c = 0; c < 3 && inside; c++) {
            struct quad3 edge = quad_sub(corner[(c + 1) % 3], corner[c]);
            inside = quad_dot(quad_cross(edge, quad_sub(p, corner[c])), normal) >= 0;
        }
        if (inside)
            oracle_found(search, t, normal);
    }
}

/* Adds all crossings of the line with the object, at any t, in no order. */
static inline void oracle_cross(const struct oracle_object *of, size_t index, const struct oracle_ray *ray,
                                struct oracle_crossings *found)
{
    static void (*const cross[SHAPE_KINDS])(struct oracle_search *, const struct shape *) = {
        [SHAPE_SPHERE] = oracle_sphere,   [SHAPE_PLANE] = oracle_plane, [SHAPE_DISC] = oracle_disc,
        [SHAPE_FRUSTUM] = oracle_frustum, [SHAPE_BOX] = oracle_box,     [SHAPE_MESH] = oracle_mesh,
    };
    struct oracle_search search = {of, index, {quad_apply(&of->inverse, quad_sub(ray->origin, of->offset)),
                                               quad_apply(&of->inverse, ray->direction)}, found};
    cross[of->object->shape.kind](&search, &of->object->shape);
}

#endif
