/*
 * Instances: objects that wear the same mesh share its corners and one tree over them, in the mesh's own coordinates.
 *
 * Only the walk through that tree is in the mesh's space, where a ray runs from inverse (origin − centre) along
 * inverse direction, which is not normalised: so t means the same as in the world. What comes to a leaf is placed in
 * the world by the arithmetic that places a copy, and tested there against the ray as it is. Every hit thus has the
 * bits that it would have with a copy; the tree has only to leave out nothing that such a test would find.
 *
 * That takes a margin. Let S bound what is added up where a corner is placed, E the mesh's extent around its centre, N
 * the largest row sum of the inverse's magnitudes, and u = 2^-53. A placed corner is off by 5 u S at most; tests in
 * the world put hits outside the triangle by a few u of S and the ray's origin o; and rounding moves a ray in the
 * mesh's space, as far as the mesh, by 4 u N |o| at its origin and 6 u N (S + |o|) by its direction. Together that is
 * below 2^-48 N (S + |o|) there. To it come u |p| for subtracting the centre; E times the residual inverse × linear
 * − 1, as the inverse is rounded too; and less than 2^-21 E for the roundings to float (lanes/packet.h). An instance
 * has N S + |p| <= 2^22 E and a residual below 2^-20, else it is copied (instance_is_sane); and boxes are grown by
 * 2^-18 E: enough for rays that start within 60 S.
 *
 * Along the ray, t comes from the triangle's plane, which a ray that grazes it meets anywhere to within rounding of
 * its offset. Boxes in the world have room for that in their growth, by 2^-20 of the tree's extent; here the ray's
 * own ends are moved, by as large a share of the instance's coordinates.
 */
#ifndef WEFT_TRACE_INSTANCE_H
#define WEFT_TRACE_INSTANCE_H

#include "scene/model.h"
#include "trace/bounds.h"
#include "trace/bvh.h"
#include "trace/plan.h"

/* A mesh that several objects wear. */
struct shared_mesh {
    const struct mesh *mesh; /* borrowed from the scene */
    uint32_t *vertices;      /* those that its triangles have, rising */
    size_t vertex_count;
    double farthest;         /* coordinate of those */
    struct vec3 center;      /* where the tree's coordinates have their origin */
    struct bvh bvh;          /* its leaves are of kind PRIMITIVE_INSTANCE, and of order's triangles */
    uint32_t *order;         /* triangles in the order of the tree's leaves */
    size_t order_count;
};

/* A triangle of an instance that shares a plane with faces of other objects. */
struct welded {
    uint32_t id;
    struct plane plane;
};

/* One object that wears such a mesh; coordinates relative to the eye. */
struct instance {
    struct affine place;  /* takes the mesh there */
    struct mat3 inverse;  /* of its linear part */
    struct vec3 center;   /* the placed centre of the mesh's tree */
    struct bounds bounds; /* around all placed corners */
    double slop;          /* how far the ends of rays are moved in the tree */
    const struct shared_mesh *mesh;
    uint32_t first_id, object;
    bool mirrored;        /* its triangles are a, c, b */
    bool blocks_light;
    const struct welded *welded; /* those of the plan's that are its own, by id */
    size_t welded_count;
};

/* The mesh's coordinate that is constant on triangle `number`, 0..2, or −1. */
int8_t mesh_flat_axis(const struct mesh *mesh, size_t number);

/* Whether a tree in the mesh's space finds all that rays can hit of the mesh under this transform. */
bool instance_is_sane(const struct shared_mesh *mesh, const struct affine *transform, struct vec3 eye);

/* The tree of a mesh of at least one triangle, on up to `threads` threads; the mesh must outlive it. */
struct shared_mesh shared_mesh_make(const struct mesh *mesh, int threads);
void shared_mesh_finish(struct shared_mesh *shared);

/* What it takes in memory beside the scene's mesh. */
size_t shared_mesh_bytes(const struct shared_mesh *shared);

/* Under an invertible transform. */
struct instance instance_make(const struct shared_mesh *mesh, const struct affine *transform, struct vec3 eye);

/* The normal of corner `vertex` of a mesh that has normals, placed. */
struct vec3 instance_normal(const struct instance *instance, uint32_t vertex);

/* Sets the plane of triangle `number`, whose corners are there. */
void instance_set_plane(const struct instance *instance, uint32_t number, struct triangle *triangle);

static inline struct vec3 instance_point(const struct instance *instance, uint32_t vertex)
{
    return affine_point(&instance->place, instance->mesh->mesh->points[vertex]);
}

/* Triangle `number` of the mesh, placed, without its plane. */
static inline struct triangle instance_corners(const struct instance *instance, uint32_t number)
{
    const uint32_t *v = &instance->mesh->mesh->index[3 * (size_t)number];
    return (struct triangle){.a = instance_point(instance, v[0]),
                             .b = instance_point(instance, v[instance->mirrored ? 2 : 1]),
                             .c = instance_point(instance, v[instance->mirrored ? 1 : 2])};
}

/* A ray as the mesh's tree sees it. */
static inline struct vec3 instance_origin(const struct instance *instance, struct vec3 origin)
{
    return mat3_apply(&instance->inverse, vec3_sub(origin, instance->center));
}

static inline struct vec3 instance_direction(const struct instance *instance, struct vec3 direction)
{
    return mat3_apply(&instance->inverse, direction);
}

#endif
