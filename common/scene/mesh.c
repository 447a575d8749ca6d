#include "scene/mesh.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
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

/* --- is it closed? ---------------------------------------------------------------------------------------- */

uint32_t mesh_hash(const double *values, size_t count)
{
    uint64_t hash = 0;
    for (size_t i = 0; i < count; i++) {
        double value = values[i] + 0.0; /* −0 becomes 0 */
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u; /* 2^64 / golden ratio: Knuth, vol. 3, 6.4 */
        hash ^= hash >> 32;
    }
    return hash_u32((uint32_t)hash);
}

/* For each vertex the first one in the same place, by a hash table with open addressing whose slots hold a
 * vertex's number + 1. The caller frees. */
static uint32_t *find_twins(const struct mesh *mesh)
{
    size_t slot_count = 8;
    while (slot_count < 2 * mesh->vertex_count)
        slot_count *= 2;
    uint32_t *slots = memory_array(slot_count, sizeof *slots);
    uint32_t *twin = memory_array(mesh->vertex_count, sizeof *twin);
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        struct vec3 here = mesh->points[i];
        size_t slot = mesh_hash(&here.x, 3) & (slot_count - 1);
        while (slots[slot] && !vec3_is_zero(vec3_sub(here, mesh->points[slots[slot] - 1])))
            slot = (slot + 1) & (slot_count - 1);
        if (!slots[slot])
            slots[slot] = (uint32_t)i + 1;
        twin[i] = slots[slot] - 1;
    }
    free(slots);
    return twin;
}

/* The edges of all triangles with area, each at its lower vertex: those of vertex v are the entries first[v] up
 * to first[v + 1] of `far`, each twice the higher vertex, plus 1 if the triangle runs along it downwards. */
struct edge_table {
    size_t *first;
    uint32_t *far;
};

/* Calls visit(table, from, to) for each directed edge. */
static void visit_edges(const struct mesh *mesh, const uint32_t *twin, struct edge_table *table,
                        void (*visit)(struct edge_table *, uint32_t, uint32_t))
{
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corner = mesh->index + 3 * i;
        uint32_t a = twin[corner[0]], b = twin[corner[1]], c = twin[corner[2]];
        if (a == b || b == c || c == a)
            continue;
        visit(table, a, b);
        visit(table, b, c);
        visit(table, c, a);
    }
}

static void count_edge(struct edge_table *table, uint32_t from, uint32_t to)
{
    table->first[from < to ? from : to]++;
}

/* first[v] is the end of v's entries that are not filled yet; once all are, it is where they start. */
static void fill_edge(struct edge_table *table, uint32_t from, uint32_t to)
{
    uint32_t low = from < to ? from : to, high = from < to ? to : from;
    table->far[--table->first[low]] = 2 * high + (from > to);
}

static struct edge_table list_edges(const struct mesh *mesh, const uint32_t *twin)
{
    assert(mesh->vertex_count < (size_t)1 << 31);
    struct edge_table table = {
        .first = memory_array(mesh->vertex_count + 1, sizeof *table.first),
        .far = memory_array(3 * mesh->triangle_count, sizeof *table.far),
    };
    visit_edges(mesh, twin, &table, count_edge);
    for (size_t v = 1; v <= mesh->vertex_count; v++)
        table.first[v] += table.first[v - 1];
    visit_edges(mesh, twin, &table, fill_edge);
    return table;
}

static int compare_edges(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

static void sort_edges(uint32_t *edges, size_t count)
{
    enum { FEW = 24 };
    if (count > FEW) {
        qsort(edges, count, sizeof *edges, compare_edges);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        uint32_t edge = edges[i];
        size_t at = i;
        for (; at > 0 && edges[at - 1] > edge; at--)
            edges[at] = edges[at - 1];
        edges[at] = edge;
    }
}

/* Every directed edge once, and its opposite too: sorted, they are pairs of 2 v and 2 v + 1, no two alike. */
static bool edges_match(struct edge_table *table, size_t vertex_count)
{
    for (size_t v = 0; v < vertex_count; v++) {
        uint32_t *edges = table->far + table->first[v];
        size_t count = table->first[v + 1] - table->first[v];
        if (count % 2 != 0)
            return false;
        sort_edges(edges, count);
        for (size_t i = 0; i < count; i += 2)
            if (edges[i] % 2 != 0 || edges[i + 1] != edges[i] + 1 || (i > 0 && edges[i] == edges[i - 2]))
                return false;
    }
    return table->first[vertex_count] > 0;
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

void mesh_turn_round(struct mesh *mesh)
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
    struct edge_table table = list_edges(mesh, twin);
    bool matched = edges_match(&table, mesh->vertex_count);
    free(table.first);
    free(table.far);
    free(twin);
    double volume = signed_volume(mesh);
    mesh->closed = matched && volume != 0;
    if (mesh->closed && volume < 0)
        mesh_turn_round(mesh);
}
