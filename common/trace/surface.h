/*
 * The surface at a hit: its point, normals and, for textures, the footprint that the ray covers on it.
 */
#ifndef WEFT_TRACE_SURFACE_H
#define WEFT_TRACE_SURFACE_H

#include "trace/plan.h"
#include "trace/ray.h"
#include "trace/surface_shapes.h"
#include "trace/texture.h"

struct hit {
    double t;
    uint32_t id;
    enum side side;
    uint8_t part;
};

struct surface {
    struct vec3 position; /* on the surface to within `error` in every coordinate */
    double error;
    struct vec3 normal;         /* unit; outward, or towards the front of a flat primitive */
    struct vec3 shading_normal; /* unit; interpolated on a smooth mesh, else equal to normal */
    struct vec3 weights;        /* on triangles: of the mesh's corners in the mesh's order */
};

/* What a sample stands for on the surface (or its tangent plane there): its middle and edges, and the change of the
 * shading normal along the edges. */
struct surface_footprint {
    struct vec3 middle;
    struct vec3 position_x, position_y;
    struct vec3 normal_x, normal_y;
};

/* What ray `index` of a batch hit; id is PRIMITIVE_NONE if nothing. */
struct hit hit_at(const struct plan *plan, const struct ray_batch *rays, const struct hit_batch *hits, size_t index);

/* The point where the ray meets primitive hit->id at hit->t, and the normal there. */
struct surface_point surface_point_at(const struct plan *plan, const struct ray *ray, const struct hit *hit);

/* What a mesh's triangle `id`, which the ray meets, adds to its surface, whose normal is known: weights, and
 * shading_normal if the mesh is smooth. */
void surface_add_mesh(const struct plan *plan, uint32_t id, const struct ray *ray, struct surface *surface);

/* The whole surface there. */
struct surface surface_at(const struct plan *plan, const struct ray *ray, const struct hit *hit);

/* Carries a ray's footprint to the surface that it hits at t. */
struct surface_footprint surface_footprint_at(const struct plan *plan, const struct ray *ray,
                                              const struct footprint *footprint, const struct hit *hit,
                                              const struct surface *surface);

/* The object coordinate that is constant on this piece of primitive `id`, 0..2, or −1. */
int8_t surface_flat_axis(const struct plan *plan, uint32_t id, uint8_t part);

/* The colour of the primitive's material there. spread may be NULL: a point. */
struct vec3 surface_color(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                          const struct surface_footprint *spread);

#endif
