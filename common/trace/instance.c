#include "trace/instance.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

/* See instance.h. */
static const double growth = 0x1p-18, spread_max = 0x1p22, residual_max = 0x1p-20, slop_share = 0x1p-20;

/* Of the mesh and of the inverse: so floats neither overflow nor underflow in the tree. */
static const double size_max = 0x1p40;

static double larger(double a, double b)
{
    return a > b ? a : b;
}

int8_t mesh_flat_axis(const struct mesh *mesh, size_t number)
{
    const uint32_t *v = &mesh->index[3 * number];
    struct vec3 a = mesh->points[v[0]], b = mesh->points[v[1]], c = mesh->points[v[2]];
    if (a.x == b.x && a.x == c.x)
        return 0;
    if (a.y == b.y && a.y == c.y)
        return 1;
    return a.z == b.z && a.z == c.z ? 2 : -1;
}

/* --- the mesh's tree -------------------------------------------------------------------------------------- */

static void find_vertices(struct shared_mesh *shared)
{
    const struct mesh *mesh = shared->mesh;
    bool *used = memory_array(mesh->vertex_count, sizeof *used);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
        shared->vertex_count += !used[mesh->index[i]];
        used[mesh->index[i]] = true;
    }
    shared->vertices = memory_array(shared->vertex_count, sizeof *shared->vertices);
    for (uint32_t i = 0, next = 0; i < mesh->vertex_count; i++)
        if (used[i])
            shared->vertices[next++] = i;
    free(used);
}

/* Around the mesh under that transform. */
static struct bounds placed_bounds(const struct shared_mesh *shared, const struct affine *place)
{
    struct vec3 first = affine_point(place, shared->mesh->points[shared->vertices[0]]);
    struct bounds bounds = {first, first};
    for (size_t i = 1; i < shared->vertex_count; i++) {
        struct vec3 at = affine_point(place, shared->mesh->points[shared->vertices[i]]);
        struct bounds point = {at, at};
        bounds = bounds_join(&bounds, &point);
    }
    return bounds;
}

static double farthest_of(const struct bounds *bounds)
{
    return larger(vec3_max_abs(bounds->low), vec3_max_abs(bounds->high));
}

/* What the tree's builder reads of a plan, with nothing but the mesh in it, its centre at 0. */
static struct plan plan_of_mesh(const struct mesh *mesh, struct vec3 center)
{
    struct plan plan = {.primitive_count = mesh->triangle_count,
                        .count = {[PRIMITIVE_TRIANGLE] = mesh->triangle_count}};
    plan.primitives = memory_array(mesh->triangle_count, sizeof *plan.primitives);
    plan.triangles = memory_array(mesh->triangle_count, sizeof *plan.triangles);
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *v = &mesh->index[3 * i];
        plan.primitives[i] = (struct primitive){.kind = PRIMITIVE_TRIANGLE, .index = (uint32_t)i, .id = (uint32_t)i};
        plan.triangles[i] = (struct triangle){.a = vec3_sub(mesh->points[v[0]], center),
                                              .b = vec3_sub(mesh->points[v[1]], center),
                                              .c = vec3_sub(mesh->points[v[2]], center)};
    }
    return plan;
}

static void grow_boxes(struct bvh *bvh, double by)
{
    for (size_t i = 0; i < bvh->node_count; i++)
        for (int child = 0; child < BVH_WIDTH; child++) {
            struct bvh_node *node = &bvh->nodes[i];
            node->kind[child] = PRIMITIVE_INSTANCE;
            for (int axis = 0; axis < 3; axis++) {
                node->low[axis][child] = (float)(node->low[axis][child] - by);
                node->high[axis][child] = (float)(node->high[axis][child] + by);
            }
        }
}

struct shared_mesh shared_mesh_make(const struct mesh *mesh, int threads)
{
    struct shared_mesh shared = {.mesh = mesh};
    struct affine unmoved = affine_identity();
    find_vertices(&shared);
    struct bounds bounds = placed_bounds(&shared, &unmoved);
    shared.farthest = farthest_of(&bounds);
    shared.center = vec3_mix(bounds.low, bounds.high, 0.5);
    struct plan plan = plan_of_mesh(mesh, shared.center);
    shared.order = bvh_build(&shared.bvh, &plan, threads, &shared.order_count);
    grow_boxes(&shared.bvh, growth * shared.bvh.extent);
    free(plan.primitives);
    free(plan.triangles);
    return shared;
}

void shared_mesh_finish(struct shared_mesh *shared)
{
    bvh_finish(&shared->bvh);
    free(shared->vertices);
    free(shared->order);
    *shared = (struct shared_mesh){0};
}

size_t shared_mesh_bytes(const struct shared_mesh *shared)
{
    return shared->bvh.node_count * sizeof *shared->bvh.nodes + shared->bvh.loose_count * sizeof *shared->bvh.loose +
           shared->order_count * sizeof *shared->order + shared->vertex_count * sizeof *shared->vertices;
}

/* --- instances -------------------------------------------------------------------------------------------- */

static double row_sum(struct vec3 row)
{
    return fabs(row.x) + fabs(row.y) + fabs(row.z);
}

static double largest_row_sum(const struct mat3 *m)
{
    return larger(row_sum(m->x), larger(row_sum(m->y), row_sum(m->z)));
}

static bool is_of_sane_size(double size)
{
    return size < size_max && size > 1 / size_max; /* false for NaN */
}

bool instance_is_sane(const struct shared_mesh *shared, const struct affine *transform, struct vec3 eye)
{
    struct mat3 inverse = mat3_inverse(&transform->linear), unit = mat3_identity();
    struct mat3 product = mat3_multiply(&inverse, &transform->linear);
    struct mat3 residual = {vec3_sub(product.x, unit.x), vec3_sub(product.y, unit.y), vec3_sub(product.z, unit.z)};
    double stretch = largest_row_sum(&transform->linear), shrink = largest_row_sum(&inverse);
    double sum = vec3_max_abs(vec3_sub(transform->offset, eye)) + stretch * shared->farthest;
    double error = largest_row_sum(&residual) + 4 * DBL_EPSILON * stretch * shrink;
    double extent = shared->bvh.extent, spread = shrink * sum + shared->farthest;
    return is_of_sane_size(extent) && is_of_sane_size(shrink) && spread <= spread_max * extent && error < residual_max;
}

struct instance instance_make(const struct shared_mesh *mesh, const struct affine *transform, struct vec3 eye)
{
    struct instance instance = {
        .place = {transform->linear, vec3_sub(transform->offset, eye)},
        .inverse = mat3_inverse(&transform->linear),
        .mesh = mesh,
        .mirrored = mat3_determinant(&transform->linear) < 0,
    };
    instance.center = affine_point(&instance.place, mesh->center);
    instance.bounds = placed_bounds(mesh, &instance.place);
    instance.slop = slop_share * farthest_of(&instance.bounds);
    return instance;
}

struct vec3 instance_normal(const struct instance *instance, uint32_t vertex)
{
    return vec3_normalize(mat3_apply_transposed(&instance->inverse, instance->mesh->mesh->normals[vertex]));
}

static const struct welded *find_welded(const struct instance *instance, uint32_t id)
{
    size_t first = 0, end = instance->welded_count;
    while (first < end) {
        size_t middle = first + (end - first) / 2;
        if (instance->welded[middle].id < id)
            first = middle + 1;
        else
            end = middle;
    }
    return first < instance->welded_count && instance->welded[first].id == id ? &instance->welded[first] : NULL;
}

void instance_set_plane(const struct instance *instance, uint32_t number, struct triangle *triangle)
{
    const struct welded *welded = find_welded(instance, instance->first_id + number);
    *triangle = triangle_make(triangle->a, triangle->b, triangle->c);
    if (welded)
        triangle->plane = welded->plane;
}
