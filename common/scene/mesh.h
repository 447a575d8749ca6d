/*
 * Building a mesh from the faces that a file gives.
 */
#ifndef WEFT_SCENE_MESH_H
#define WEFT_SCENE_MESH_H

#include <stddef.h>
#include <stdint.h>

#include "scene/model.h"

/* Frees what the mesh owns and makes it empty. */
void mesh_finish(struct mesh *mesh);

/* Adds a face with `count` corners, 3..POLYGON_CORNERS_MAX, each below mesh->vertex_count, as count - 2
 * triangles. *capacity is that of mesh->index, in triangles; it starts at 0. The first triangle begins with
 * the face's first edge. */
void mesh_add_face(struct mesh *mesh, size_t *capacity, const uint32_t *corners, size_t count);

/* Turns all faces round, so that what was seen clockwise is seen counter-clockwise. Normals stay. */
void mesh_turn_round(struct mesh *mesh);

/* A hash of doubles, bit by bit; −0 counts as 0. */
uint32_t mesh_hash(const double *values, size_t count);

/* After the last face: finds out whether the mesh is closed. Vertices in one place count as one, and
 * triangles without area (two corners in one place) as none. A closed mesh whose outside is seen clockwise
 * is turned inside out. Takes linear time unless thousands of faces meet in
 * one vertex. */
void mesh_close(struct mesh *mesh);

#endif
