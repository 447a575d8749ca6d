/* Which objects are instances of a shared mesh (instance.h), and where their triangles' ids are. */
#include <stdlib.h>

#include "base/memory.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

/* An object that wears a mesh. */
struct wearer {
    const uint32_t *index; /* the mesh's: the same for those that share it */
    uint32_t object;
};

/* By mesh, each mesh's in the order of the scene. Where meshes lie in memory decides only which of them is dealt with
 * first, which leaves no trace in a picture. */
static int compare_wearers(const void *left, const void *right)
{
    const struct wearer *a = left, *b = right;
    if (a->index != b->index)
        return (uintptr_t)a->index < (uintptr_t)b->index ? -1 : 1;
    return a->object < b->object ? -1 : a->object > b->object;
}

static struct wearer *find_wearers(const struct scene *scene, size_t *count)
{
    struct wearer *wearers = memory_array(scene->object_count, sizeof *wearers);
    *count = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].shape.kind == SHAPE_MESH && scene->objects[i].shape.mesh.triangle_count > 0)
            wearers[(*count)++] = (struct wearer){scene->objects[i].shape.mesh.index, (uint32_t)i};
    qsort(wearers, *count, sizeof *wearers, compare_wearers);
    return wearers;
}

/* Makes instances of those of `count` wearers of one mesh that can be. */
static void share(struct plan *plan, const struct scene *scene, const struct wearer *wearers, size_t count,
                  int threads, uint32_t *shared)
{
    struct shared_mesh mesh = shared_mesh_make(&scene->objects[wearers->object].shape.mesh, threads);
    size_t sane = 0;
    for (size_t i = 0; i < count; i++) {
        bool is_sane = instance_is_sane(&mesh, &scene->objects[wearers[i].object].transform, plan->eye);
        shared[wearers[i].object] = is_sane ? (uint32_t)plan->shared_mesh_count : MESH_COPIED;
        sane += is_sane;
    }
    if (sane > 0)
        plan->shared_meshes[plan->shared_mesh_count++] = mesh;
    else
        shared_mesh_finish(&mesh);
}

uint32_t *plan_share_meshes(struct plan *plan, const struct scene *scene, size_t least, int threads)
{
    size_t count;
    struct wearer *wearers = find_wearers(scene, &count);
    uint32_t *shared = memory_array(scene->object_count, sizeof *shared);
    for (size_t i = 0; i < scene->object_count; i++)
        shared[i] = MESH_NONE;
    plan->shared_meshes = memory_array(count / 2, sizeof *plan->shared_meshes);
    for (size_t start = 0, end; start < count; start = end) {
        for (end = start + 1; end < count && wearers[end].index == wearers[start].index;)
            end++;
        size_t triangles = scene->objects[wearers[start].object].shape.mesh.triangle_count;
        for (size_t i = start; end - start > 1 && i < end; i++)
            shared[wearers[i].object] = MESH_COPIED;
        if (end - start > 1 && (end - start) * triangles >= least)
            share(plan, scene, &wearers[start], end - start, threads, shared);
    }
    free(wearers);
    return shared;
}

uint32_t plan_number_among_instances(const struct plan *plan, uint32_t id)
{
    size_t first = 0, end = plan->count[PRIMITIVE_INSTANCE];
    while (first < end) { /* the first instance whose ids are all beyond */
        size_t middle = first + (end - first) / 2;
        if (plan->instance_ids[middle].first <= id)
            first = middle + 1;
        else
            end = middle;
    }
    const struct instance_ids *before = &plan->instance_ids[first - 1];
    return id < before->end ? before->number : before->number + 1 + (id - before->end);
}
