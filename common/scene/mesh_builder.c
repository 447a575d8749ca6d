#include "scene/mesh_builder.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/mesh.h"
#include "scene/polygon.h"

void mesh_builder_discard(struct mesh_builder *builder)
{
    mesh_finish(&builder->mesh);
    free(builder->slots);
    *builder = (struct mesh_builder){0};
}

struct vec3 mesh_normal(struct vec3 direction)
{
    return vec3_is_zero(direction) ? direction : vec3_normalize(direction);
}

/* --- vertices --------------------------------------------------------------------------------------------- */

/* Room for `capacity` vertices in all arrays that there are. */
static void resize_vertices(struct mesh *mesh, size_t capacity)
{
    mesh->points = memory_resize(mesh->points, capacity, sizeof *mesh->points);
    if (mesh->normals)
        mesh->normals = memory_resize(mesh->normals, capacity, sizeof *mesh->normals);
    if (mesh->uv)
        mesh->uv = memory_resize(mesh->uv, capacity, 2 * sizeof *mesh->uv);
}

/* Makes room for one more vertex, and arrays for what the mesh had none of so far: zero for the vertices
 * before. */
static void make_room(struct mesh_builder *builder, const struct mesh_vertex *vertex)
{
    struct mesh *mesh = &builder->mesh;
    if (mesh->vertex_count == builder->vertex_capacity) {
        builder->vertex_capacity = builder->vertex_capacity ? 2 * builder->vertex_capacity : 16;
        resize_vertices(mesh, builder->vertex_capacity);
    }
    if (!mesh->normals && !vec3_is_zero(vertex->normal))
        mesh->normals = memory_array(builder->vertex_capacity, sizeof *mesh->normals);
    if (!mesh->uv && vertex->has_uv)
        mesh->uv = memory_array(builder->vertex_capacity, 2 * sizeof *mesh->uv);
}

uint32_t mesh_builder_append(struct mesh_builder *builder, const struct mesh_vertex *vertex)
{
    struct mesh *mesh = &builder->mesh;
    make_room(builder, vertex);
    size_t number = mesh->vertex_count++;
    mesh->points[number] = vertex->point;
    if (mesh->normals)
        mesh->normals[number] = vertex->normal;
    if (mesh->uv)
        memcpy(mesh->uv + 2 * number, vertex->uv, sizeof vertex->uv);
    return (uint32_t)number;
}

static struct mesh_vertex vertex_of(const struct mesh *mesh, size_t number)
{
    struct mesh_vertex vertex = {.point = mesh->points[number], .has_uv = mesh->uv != NULL};
    if (mesh->normals)
        vertex.normal = mesh->normals[number];
    if (mesh->uv)
        memcpy(vertex.uv, mesh->uv + 2 * number, sizeof vertex.uv);
    return vertex;
}

static bool vertices_equal(const struct mesh_vertex *a, const struct mesh_vertex *b)
{
    return vec3_is_zero(vec3_sub(a->point, b->point)) && vec3_is_zero(vec3_sub(a->normal, b->normal)) &&
           a->uv[0] == b->uv[0] && a->uv[1] == b->uv[1];
}

/* Where the vertex is in the table, or the free slot where it belongs. */
static size_t find_slot(const struct mesh_builder *builder, const struct mesh_vertex *vertex)
{
    const double values[] = {vertex->point.x,  vertex->point.y,  vertex->point.z, vertex->normal.x,
                             vertex->normal.y, vertex->normal.z, vertex->uv[0],   vertex->uv[1]};
    size_t slot = mesh_hash(values, sizeof values / sizeof *values) & (builder->slot_count - 1);
    for (; builder->slots[slot]; slot = (slot + 1) & (builder->slot_count - 1)) {
        struct mesh_vertex there = vertex_of(&builder->mesh, builder->slots[slot] - 1);
        if (vertices_equal(&there, vertex))
            break;
    }
    return slot;
}

/* Twice the slots, with all vertices in them anew. */
static void grow_slots(struct mesh_builder *builder)
{
    const struct mesh *mesh = &builder->mesh;
    free(builder->slots);
    builder->slot_count = builder->slot_count ? 2 * builder->slot_count : 64;
    builder->slots = memory_array(builder->slot_count, sizeof *builder->slots);
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        struct mesh_vertex vertex = vertex_of(mesh, i);
        builder->slots[find_slot(builder, &vertex)] = (uint32_t)i + 1;
    }
}

uint32_t mesh_builder_vertex(struct mesh_builder *builder, const struct mesh_vertex *vertex)
{
    if (builder->slot_count <= 2 * builder->mesh.vertex_count)
        grow_slots(builder);
    size_t slot = find_slot(builder, vertex);
    if (!builder->slots[slot])
        builder->slots[slot] = mesh_builder_append(builder, vertex) + 1;
    return builder->slots[slot] - 1;
}

/* --- faces ------------------------------------------------------------------------------------------------ */

static void add_fan(struct mesh_builder *builder, const uint32_t *corners, size_t count)
{
    struct mesh *mesh = &builder->mesh;
    mesh->index = memory_grow(mesh->index, &builder->triangle_capacity, mesh->triangle_count + count - 2,
                              3 * sizeof *mesh->index);
    for (size_t i = 1; i + 1 < count; i++) {
        uint32_t *triangle = mesh->index + 3 * mesh->triangle_count++;
        triangle[0] = corners[0];
        triangle[1] = corners[i];
        triangle[2] = corners[i + 1];
    }
}

bool mesh_builder_face(struct mesh_builder *builder, const uint32_t *corners, size_t count)
{
    if (count == 3 || polygon_is_fan(builder->mesh.points, corners, count))
        add_fan(builder, corners, count);
    else if (count <= POLYGON_CORNERS_MAX)
        mesh_add_face(&builder->mesh, &builder->triangle_capacity, corners, count);
    else
        return false;
    return true;
}

/* --- the whole -------------------------------------------------------------------------------------------- */

/* A unit vector even where the triangle has no area, since no ray hits it there. */
static struct vec3 triangle_normal(const struct mesh *mesh, const uint32_t *corner)
{
    struct vec3 a = mesh->points[corner[0]];
    struct vec3 ab = vec3_sub(mesh->points[corner[1]], a), ac = vec3_sub(mesh->points[corner[2]], a);
    struct vec3 normal = vec3_cross(ab, ac);
    return vec3_is_zero(normal) ? vec3_make(0, 1, 0) : vec3_normalize(normal);
}

/* Gives the triangle a vertex of its own in place of each corner without normal. */
static void fill_corner_normals(struct mesh_builder *builder, size_t triangle)
{
    struct mesh *mesh = &builder->mesh;
    for (size_t k = 0; k < 3; k++) {
        uint32_t *corner = mesh->index + 3 * triangle, from = corner[k];
        if (!vec3_is_zero(mesh->normals[from]))
            continue;
        struct mesh_vertex vertex = {.point = mesh->points[from], .normal = triangle_normal(mesh, corner)};
        if (mesh->uv)
            memcpy(vertex.uv, mesh->uv + 2 * from, sizeof vertex.uv);
        corner[k] = mesh_builder_append(builder, &vertex);
    }
}

static void fill_normals(struct mesh_builder *builder)
{
    struct mesh *mesh = &builder->mesh;
    size_t named = mesh->vertex_count;
    for (size_t i = 0; i < mesh->triangle_count; i++)
        fill_corner_normals(builder, i);
    for (size_t i = 0; i < named; i++)
        if (vec3_is_zero(mesh->normals[i]))
            mesh->normals[i] = vec3_make(0, 1, 0); /* no triangle's any more */
}

/* Whether more triangles have corners whose normals together point to their back than to their front. */
static bool faces_against_normals(const struct mesh *mesh)
{
    size_t against = 0, with = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corner = mesh->index + 3 * i;
        struct vec3 sum = vec3_add(mesh->normals[corner[0]], mesh->normals[corner[1]]);
        double cosine = vec3_dot(triangle_normal(mesh, corner), vec3_add(sum, mesh->normals[corner[2]]));
        against += cosine < 0;
        with += cosine > 0;
    }
    return against > with;
}

void mesh_builder_finish(struct mesh_builder *builder, struct mesh *mesh)
{
    if (builder->mesh.normals && faces_against_normals(&builder->mesh))
        mesh_turn_round(&builder->mesh);
    if (builder->mesh.normals)
        fill_normals(builder);
    *mesh = builder->mesh;
    builder->mesh = (struct mesh){0};
    mesh_builder_discard(builder);
    resize_vertices(mesh, mesh->vertex_count);
    mesh->index = memory_resize(mesh->index, mesh->triangle_count, 3 * sizeof *mesh->index);
    mesh_close(mesh);
}
