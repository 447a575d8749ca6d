#include "scene/mesh.h"

#include <stdlib.h>

#include "base/memory.h"
#include "scene/polygon.h"

void mesh_finish(struct mesh *mesh)
{
    free(mesh->points);
    free(mesh->normals);
    free(mesh->uv);
    free(mesh->index);
    *mesh = (struct mesh){0};
}

void mesh_add_face(struct mesh *mesh, size_t *capacity, const uint32_t *corners, size_t count)
{
    size_t added = count - 2;
    mesh->index = memory_grow(mesh->index, capacity, mesh->triangle_count + added, 3 * sizeof *mesh->index);
    polygon_triangulate(mesh->points, corners, count, mesh->index + 3 * mesh->triangle_count);
    mesh->triangle_count += added;
}

/* --- is it closed? --------------------------------------------------------------------------------------- */

/* By place, then by number. */
static int compare_places(const void *a, const void *b, void *points)
{
    uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    struct vec3 p = ((const struct vec3 *)points)[i], q = ((const struct vec3 *)points)[j];
    if (p.x != q.x)
        return p.x < q.x ? -1 : 1;
    if (p.y != q.y)
        return p.y < q.y ? -1 : 1;
    if (p.z != q.z)
        return p.z < q.z ? -1 : 1;
    return i < j ? -1 : i > j;
}

/* For each vertex the first one in the same place. The caller frees. */
static uint32_t *find_twins(const struct mesh *mesh)
{
    uint32_t *order = memory_array(mesh->vertex_count, sizeof *order);
    uint32_t *twin = memory_array(mesh->vertex_count, sizeof *twin);
    for (size_t i = 0; i < mesh->vertex_count; i++)
        order[i] = (uint32_t)i;
    qsort_r(order, mesh->vertex_count, sizeof *order, compare_places, mesh->points);
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        struct vec3 here = mesh->points[order[i]];
        bool same = i > 0 && vec3_is_zero(vec3_sub(here, mesh->points[order[i - 1]]));
        twin[order[i]] = same ? twin[order[i - 1]] : order[i];
    }
    free(order);
    return twin;
}

static uint64_t edge_key(uint32_t from, uint32_t to)
{
    return (uint64_t)from << 32 | to;
}

static int compare_edges(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* Writes the directed edges of all triangles with area; returns how many. */
static size_t list_edges(const struct mesh *mesh, const uint32_t *twin, uint64_t *edges)
{
    size_t count = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corner = mesh->index + 3 * i;
        uint32_t a = twin[corner[0]], b = twin[corner[1]], c = twin[corner[2]];
        if (a == b || b == c || c == a)
            continue;
        edges[count++] = edge_key(a, b);
        edges[count++] = edge_key(b, c);
        edges[count++] = edge_key(c, a);
    }
    return count;
}

/* Every directed edge once, and its opposite there too. */
static bool edges_match(uint64_t *edges, size_t count)
{
    qsort(edges, count, sizeof *edges, compare_edges);
    for (size_t i = 0; i < count; i++) {
        uint64_t opposite = edges[i] << 32 | edges[i] >> 32;
        if ((i > 0 && edges[i] == edges[i - 1]) ||
            !bsearch(&opposite, edges, count, sizeof *edges, compare_edges))
            return false;
    }
    return count > 0;
}

/* Six times the volume, positive if the outside is seen counter-clockwise (divergence theorem). */
static double signed_volume(const struct mesh *mesh)
{
    double volume = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corner = mesh->index + 3 * i;
        struct vec3 a = vec3_sub(mesh->points[corner[0]], mesh->points[0]);
        struct vec3 b = vec3_sub(mesh->points[corner[1]], mesh->points[0]);
        struct vec3 c = vec3_sub(mesh->points[corner[2]], mesh->points[0]);
        volume += vec3_dot(a, vec3_cross(b, c));
    }
    return volume;
}

static void turn_inside_out(struct mesh *mesh)
{
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        uint32_t *corner = mesh->index + 3 * i, second = corner[1];
        corner[1] = corner[2];
        corner[2] = second;
    }
}

void mesh_close(struct mesh *mesh)
{
    uint32_t *twin = find_twins(mesh);
    uint64_t *edges = memory_array(3 * mesh->triangle_count, sizeof *edges);
    bool matched = edges_match(edges, list_edges(mesh, twin, edges));
    free(edges);
    free(twin);
    double volume = signed_volume(mesh);
    mesh->closed = matched && volume != 0;
    if (mesh->closed && volume < 0)
        turn_inside_out(mesh);
}
