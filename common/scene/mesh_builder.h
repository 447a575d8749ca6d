/*
 * A mesh that grows vertex by vertex and face by face, as a file is read.
 */
#ifndef WEFT_SCENE_MESH_BUILDER_H
#define WEFT_SCENE_MESH_BUILDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "scene/model.h"

struct mesh_vertex {
    struct vec3 point;
    struct vec3 normal; /* unit; zero: none */
    double uv[2];
    bool has_uv;
};

/* All zero is an empty one. */
struct mesh_builder {
    struct mesh mesh;
    size_t vertex_capacity, triangle_capacity;
    uint32_t *slots;   /* a hash table with open addressing: a vertex's number + 1, or 0 */
    size_t slot_count; /* 0 or a power of 2 */
};

void mesh_builder_discard(struct mesh_builder *builder);

/* Adds a vertex and returns its number. */
uint32_t mesh_builder_append(struct mesh_builder *builder, const struct mesh_vertex *vertex);

/* The number of the vertex that has these values to the last bit, which is added if there is none; not to be
 * mixed with mesh_builder_append. */
uint32_t mesh_builder_vertex(struct mesh_builder *builder, const struct mesh_vertex *vertex);

/* Adds a face of `count` corners, at least 3, as count - 2 triangles: those from its first corner if they cut
 * it properly (polygon_is_fan), else by polygon_triangulate. False, and nothing added, if the latter is needed
 * and there are more than POLYGON_CORNERS_MAX. */
bool mesh_builder_face(struct mesh_builder *builder, const uint32_t *corners, size_t count);

/* Moves the mesh, of at least one triangle, to *mesh, with memory cut to its size and mesh_close done; the
 * builder is empty afterwards. If some vertices have normals, and those of most triangles point to the back, all
 * faces are turned round; then each corner without a normal gets its triangle's, on a vertex of its own in the
 * same place. If some have uv, it is 0, 0 at the others. */
void mesh_builder_finish(struct mesh_builder *builder, struct mesh *mesh);

/* A direction as a file gives it: made a unit vector, or zero if it has no length. */
struct vec3 mesh_normal(struct vec3 direction);

#endif
