/*
 * Which triangles of shared meshes may have to be welded to faces of other objects: those that touch them. Such a mesh
 * may be in a scene many times over, as an instance or as a copy. To sort all its triangles, as plan_weld.c does with
 * those of other meshes, would take the time and memory that instances save; and what touches nothing needs no weld.
 *
 * A triangle touches an object without a mesh if it lies in the plane of one of its faces, and within its box; and
 * one with a mesh if their boxes meet: to within COINCIDENCE. Of an instance, the mesh's tree tells where to look.
 * Triangles of large meshes are not welded to other meshes: where a thousand of those reach into one another, nearly
 * all would be found, and took minutes.
 */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

enum { LARGE_MESH = 1 << 12 }; /* triangles */

/* An object with flat faces. */
struct target {
    struct bounds box; /* of a plane, all */
    size_t object;
    size_t plane_count; /* 0: a mesh */
    struct plane planes[BOX_FACES];
};

struct search {
    const struct plan *plan;
    struct target *targets; /* by box.low.x */
    size_t target_count;
    const struct target **near; /* those that the present object may touch */
    size_t near_count;
    uint32_t *ids; /* what has been found */
    size_t count, capacity;
};

/* --- targets ---------------------------------------------------------------------------------------------- */

static size_t box_planes(const struct box *box, struct plane planes[BOX_FACES])
{
    const struct vec3 rows[3] = {box->frame.x, box->frame.y, box->frame.z};
    const double low[3] = {box->low.x, box->low.y, box->low.z}, high[3] = {box->high.x, box->high.y, box->high.z};
    for (int axis = 0; axis < 3; axis++) {
        planes[2 * axis] = (struct plane){rows[axis], high[axis]};
        planes[2 * axis + 1] = (struct plane){rows[axis], low[axis]};
    }
    return BOX_FACES;
}

static size_t frustum_planes(const struct frustum *frustum, struct plane planes[2])
{
    planes[0] = (struct plane){frustum->axis, frustum->low};
    planes[1] = (struct plane){frustum->axis, frustum->high};
    return 2;
}

/* Returns whether it is one. */
static bool make_target(const struct plan *plan, size_t object, struct target *target)
{
    const struct primitive *primitive = &plan->primitives[plan->objects[object].first_primitive];
    const struct vec3 far = {INFINITY, INFINITY, INFINITY};
    *target = (struct target){.object = object};
    target->box = bounds_of_object(plan, object, &target->box) ? bounds_grown(target->box, COINCIDENCE)
                                                               : (struct bounds){vec3_neg(far), far};
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_PLANE:
    case PRIMITIVE_DISC:
        target->plane_count = 1;
        target->planes[0] = primitive->kind == PRIMITIVE_PLANE ? plan->planes[primitive->index]
                                                               : plan->discs[primitive->index].plane;
        return true;
    case PRIMITIVE_FRUSTUM:
        target->plane_count = frustum_planes(&plan->frustums[primitive->index], target->planes);
        return true;
    case PRIMITIVE_BOX:
        target->plane_count = box_planes(&plan->boxes[primitive->index], target->planes);
        return true;
    default:
        return primitive_is_of_mesh(primitive);
    }
}

static int compare_by_low_x(const void *left, const void *right)
{
    const struct target *a = left, *b = right;
    if (a->box.low.x != b->box.low.x)
        return a->box.low.x < b->box.low.x ? -1 : 1;
    return a->object < b->object ? -1 : a->object > b->object;
}

static void find_targets(struct search *search)
{
    const struct plan *plan = search->plan;
    search->targets = memory_array(plan->object_count, sizeof *search->targets);
    search->near = memory_array(plan->object_count, sizeof *search->near);
    for (size_t i = 0; i < plan->object_count; i++)
        search->target_count += make_target(plan, i, &search->targets[search->target_count]);
    qsort(search->targets, search->target_count, sizeof *search->targets, compare_by_low_x);
}

/* How many triangles the object's mesh has. */
static size_t triangles_of(const struct plan *plan, size_t object)
{
    return plan_end_id(plan, object) - plan->primitives[plan->objects[object].first_primitive].id;
}

static void find_near(struct search *search, size_t object, const struct bounds *box)
{
    bool is_large = triangles_of(search->plan, object) >= LARGE_MESH;
    search->near_count = 0;
    for (size_t i = 0; i < search->target_count && search->targets[i].box.low.x <= box->high.x; i++) {
        const struct target *target = &search->targets[i];
        bool is_welded = target->object != object && !(is_large && target->plane_count == 0);
        if (is_welded && bounds_overlap(&target->box, box))
            search->near[search->near_count++] = target;
    }
}

/* --- what touches them ------------------------------------------------------------------------------------ */

/* Whether all of the box is farther from the plane than its part, and COINCIDENCE, of its coordinates' size. */
static bool is_off(const struct plane *plane, const struct bounds *box)
{
    struct vec3 middle = vec3_mix(box->low, box->high, 0.5), half = vec3_sub(box->high, middle), n = plane->normal;
    double reach = fabs(n.x) * half.x + fabs(n.y) * half.y + fabs(n.z) * half.z;
    double size = vec3_max_abs(middle) + vec3_max_abs(half) + fabs(plane->offset);
    return fabs(vec3_dot(n, middle) - plane->offset) > reach + 4 * COINCIDENCE * size;
}

static bool box_touches(const struct search *search, const struct bounds *box)
{
    for (size_t i = 0; i < search->near_count; i++) {
        const struct target *target = search->near[i];
        if (!bounds_overlap(&target->box, box))
            continue;
        bool touches = target->plane_count == 0;
        for (size_t k = 0; k < target->plane_count; k++)
            touches |= !is_off(&target->planes[k], box);
        if (touches)
            return true;
    }
    return false;
}

static bool lies_in(const struct plane *plane, const struct triangle *triangle)
{
    const struct vec3 corners[3] = {triangle->a, triangle->b, triangle->c};
    for (int i = 0; i < 3; i++)
        if (fabs(vec3_dot(plane->normal, corners[i]) - plane->offset) >
            COINCIDENCE * (vec3_max_abs(corners[i]) + fabs(plane->offset)))
            return false;
    return true;
}

static bool triangle_touches(const struct search *search, const struct triangle *triangle)
{
    struct bounds box = bounds_grown(bounds_of_triangle(triangle), COINCIDENCE);
    for (size_t i = 0; i < search->near_count; i++) {
        const struct target *target = search->near[i];
        if (!bounds_overlap(&target->box, &box))
            continue;
        bool touches = target->plane_count == 0;
        for (size_t k = 0; k < target->plane_count; k++)
            touches |= lies_in(&target->planes[k], triangle);
        if (touches)
            return true;
    }
    return false;
}

static void try_triangle(struct search *search, uint32_t id)
{
    struct triangle triangle = plan_triangle(search->plan, id);
    if (!triangle_touches(search, &triangle))
        return;
    search->ids = memory_grow(search->ids, &search->capacity, search->count + 1, sizeof *search->ids);
    search->ids[search->count++] = id;
}

/* Around a child of the tree, which has room for rounding, in the world. */
static struct bounds child_bounds(const struct instance *instance, const struct bvh_node *node, int child)
{
    struct vec3 low = {node->low[0][child], node->low[1][child], node->low[2][child]};
    struct vec3 high = {node->high[0][child], node->high[1][child], node->high[2][child]};
    const struct mat3 *m = &instance->place.linear;
    struct vec3 middle = vec3_mix(low, high, 0.5), half = vec3_sub(high, middle);
    struct vec3 center = vec3_add(instance->center, mat3_apply(m, middle));
    struct vec3 reach = {fabs(m->x.x) * half.x + fabs(m->x.y) * half.y + fabs(m->x.z) * half.z,
                         fabs(m->y.x) * half.x + fabs(m->y.y) * half.y + fabs(m->y.z) * half.z,
                         fabs(m->z.x) * half.x + fabs(m->z.y) * half.y + fabs(m->z.z) * half.z};
    return bounds_grown((struct bounds){vec3_sub(center, reach), vec3_add(center, reach)}, 4 * COINCIDENCE);
}

/* Recursion is as deep as the tree. */
static void search_node(struct search *search, const struct instance *instance, uint32_t at)
{
    const struct bvh_node *node = &instance->mesh->bvh.nodes[at];
    for (int child = 0; child < BVH_WIDTH; child++) {
        if (node->low[0][child] > node->high[0][child])
            continue;
        struct bounds box = child_bounds(instance, node, child);
        if (!box_touches(search, &box))
            continue;
        for (size_t i = 0; i < node->count[child]; i++)
            try_triangle(search, instance->first_id + instance->mesh->order[node->child[child] + i]);
        if (node->count[child] == 0)
            search_node(search, instance, node->child[child]);
    }
}

static void search_object(struct search *search, size_t object)
{
    const struct plan *plan = search->plan;
    const struct primitive *first = &plan->primitives[plan->objects[object].first_primitive];
    struct bounds box = {{0, 0, 0}, {0, 0, 0}};
    bounds_of_object(plan, object, &box);
    box = bounds_grown(box, COINCIDENCE);
    find_near(search, object, &box);
    if (search->near_count == 0)
        return;
    if (first->kind == PRIMITIVE_INSTANCE) {
        const struct instance *instance = &plan->instances[first->index];
        for (size_t i = 0; i < instance->mesh->bvh.loose_count; i++)
            try_triangle(search, instance->first_id + instance->mesh->bvh.loose[i]);
        search_node(search, instance, 0);
        return;
    }
    for (const struct primitive *one = first; one < plan->primitives + plan->primitive_count; one++) {
        if (one->object != object)
            break;
        try_triangle(search, one->id);
    }
}

static int compare_ids(const void *left, const void *right)
{
    const uint32_t *a = left, *b = right;
    return *a < *b ? -1 : *a > *b;
}

static bool shares_any(const struct plan *plan)
{
    for (size_t i = 0; i < plan->object_count; i++)
        if (plan->objects[i].shares_mesh)
            return true;
    return false;
}

uint32_t *plan_touching(const struct plan *plan, size_t *count)
{
    struct search search = {.plan = plan};
    *count = 0;
    if (!shares_any(plan))
        return NULL;
    find_targets(&search);
    for (size_t i = 0; i < plan->object_count; i++)
        if (plan->objects[i].shares_mesh)
            search_object(&search, i);
    if (search.count > 0)
        qsort(search.ids, search.count, sizeof *search.ids, compare_ids);
    for (size_t i = 0; i < search.count; i++) /* a tree may have a triangle in several leaves */
        if (i == 0 || search.ids[i] != search.ids[i - 1])
            search.ids[(*count)++] = search.ids[i];
    free(search.targets);
    free(search.near);
    return search.ids;
}
