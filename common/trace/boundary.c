#include "trace/boundary.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"

double boundary_window(struct vec3 origin, double t)
{
    return 2 * COINCIDENCE * (fabs(t) + vec3_max_abs(origin));
}

void boundary_batch_finish(struct boundary_batch *batch)
{
    crossing_list_finish(&batch->walls);
    ray_batch_finish(&batch->probes);
    hit_batch_finish(&batch->found);
    free(batch->start);
    *batch = (struct boundary_batch){0};
}

/* --- probing ---------------------------------------------------------------------------------------------- */

/* Hit `index`, as one of ray `ray`. */
static struct crossing crossing_at(const struct hit_batch *hits, size_t index, uint32_t ray)
{
    return (struct crossing){hits->t[index], ray, hit_batch_id(hits, index), (uint8_t)hit_batch_side(hits, index)};
}

static bool is_wall(const struct plan *plan, uint32_t id)
{
    return id != PRIMITIVE_NONE && (plan_primitive(plan, id)->traits & TRAIT_REFRACTS);
}

static void replace_hit(struct hit_batch *hits, const struct crossing *by)
{
    hits->t[by->ray] = by->t;
    hits->key[by->ray] = by->id == PRIMITIVE_NONE ? LANE_HIT_NONE : (double)hit_key(by->id, by->side);
}

/* Forgets the probes, and makes room for one of each of `count` rays. */
static void start_probes(struct boundary_batch *batch, size_t count)
{
    batch->start = memory_grow(batch->start, &batch->capacity, count, sizeof *batch->start);
    hit_batch_reserve(&batch->found, count);
    batch->probes.count = 0;
}

/* Adds the ray that goes on behind a wall, up to t_max. */
static void push_probe(struct boundary_batch *batch, const struct ray_batch *rays, const struct crossing *wall,
                       double t_max)
{
    struct ray probe = ray_batch_get(rays, wall->ray);
    probe.t_min = wall->t;
    probe.key_min = hit_key(wall->id, wall->side);
    probe.t_max = t_max;
    batch->start[batch->probes.count] = *wall;
    ray_batch_push(&batch->probes, &probe);
}

/* --- walls at the start of a path ------------------------------------------------------------------------- */

/* Whether path i hit, within the error of its start, a wall that it crossed there. */
static bool is_crossed_already(const struct plan *plan, const struct medium_pool *media,
                               const struct path_batch *paths, const struct hit_batch *hits, size_t i)
{
    if (!(hits->t[i] <= -paths->rays.t_min[i])) /* nearly always */
        return false;
    uint32_t id = hit_batch_id(hits, i);
    if (!is_wall(plan, id))
        return false;
    bool is_inside = medium_holds(media, paths->medium[i], plan_primitive(plan, id)->object);
    return is_inside == (hit_batch_side(hits, i) == SIDE_ENTER);
}

void boundary_batch_pass_start(struct boundary_batch *batch, const struct plan *plan, const struct kernel *kernel,
                               const struct medium_pool *media, const struct path_batch *paths,
                               struct hit_batch *hits)
{
    do {
        start_probes(batch, paths->rays.count);
        for (size_t i = 0; i < paths->rays.count; i++) {
            if (!is_crossed_already(plan, media, paths, hits, i))
                continue;
            struct crossing wall = crossing_at(hits, i, (uint32_t)i);
            push_probe(batch, &paths->rays, &wall, INFINITY);
        }
        if (batch->probes.count > 0)
            kernel->closest(plan, &batch->probes, &batch->found);
        for (size_t i = 0; i < batch->probes.count; i++) {
            struct crossing found = crossing_at(&batch->found, i, batch->start[i].ray);
            replace_hit(hits, &found);
        }
    } while (batch->probes.count > 0);
}

/* --- boundaries ------------------------------------------------------------------------------------------- */

/* From a wall to the end of the boundary whose first wall was hit. */
static void push_boundary_probe(struct boundary_batch *batch, const struct ray_batch *rays,
                                const struct hit_batch *hits, const struct crossing *wall)
{
    double first = hits->t[wall->ray];
    struct vec3 origin = lane_get(rays->origin, wall->ray);
    push_probe(batch, rays, wall, first + boundary_window(origin, first));
}

/* Whether walls of two solids may coincide at t of the ray. All of a boundary is within a window and a half from there,
 * and within the boxes of both solids. */
static bool may_touch(const struct plan *plan, const struct ray_batch *rays, size_t ray, double t)
{
    struct vec3 origin = lane_get(rays->origin, ray), direction = lane_get(rays->direction, ray);
    struct vec3 at = vec3_add_scaled(origin, direction, t);
    double by = 2 * boundary_window(origin, t);
    for (size_t i = 0; i < plan->contact_count; i++) {
        struct vec3 low = plan->contacts[i].low, high = plan->contacts[i].high;
        if (at.x >= low.x - by && at.x <= high.x + by && at.y >= low.y - by && at.y <= high.y + by &&
            at.z >= low.z - by && at.z <= high.z + by)
            return true;
    }
    return false;
}

/* A probe behind each wall that was hit where others may be. */
static void push_first_probes(struct boundary_batch *batch, const struct plan *plan, const struct ray_batch *rays,
                              const struct hit_batch *hits)
{
    start_probes(batch, rays->count);
    for (size_t i = 0; i < rays->count; i++) {
        if (!is_wall(plan, hit_batch_id(hits, i)) || !may_touch(plan, rays, i, hits->t[i]))
            continue;
        struct crossing wall = crossing_at(hits, i, (uint32_t)i);
        push_boundary_probe(batch, rays, hits, &wall);
    }
}

/* Notes the walls that the probes found, after the hits where they are the first, and puts in the probes' place those
 * that go on behind them. */
static void push_next_probes(struct boundary_batch *batch, const struct plan *plan, const struct ray_batch *rays,
                             const struct hit_batch *hits, bool first)
{
    size_t count = batch->probes.count;
    batch->probes.count = 0;
    for (size_t i = 0; i < count; i++) {
        struct crossing start = batch->start[i];
        if (!is_wall(plan, hit_batch_id(&batch->found, i)))
            continue;
        if (first)
            crossing_list_push(&batch->walls, &start);
        struct crossing wall = crossing_at(&batch->found, i, start.ray);
        crossing_list_push(&batch->walls, &wall);
        push_boundary_probe(batch, rays, hits, &wall);
    }
}

/* In the order of crossing. */
static int compare_walls(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->ray != b->ray)
        return a->ray < b->ray ? -1 : 1;
    if (a->side != b->side)
        return a->side == SIDE_ENTER ? -1 : 1;
    return a->id < b->id ? -1 : a->id > b->id;
}

/* The last of `count` sorted walls by which the ray enters, or leaves if it enters by none. */
static const struct crossing *representative(const struct crossing *walls, size_t count)
{
    const struct crossing *wall = &walls[count - 1];
    while (wall->side != walls->side)
        wall--;
    return wall;
}

/* Each boundary's hit by the wall that stands for it. */
static void replace_hits(const struct crossing_list *walls, struct hit_batch *hits)
{
    for (size_t start = 0, count; start < walls->count; start += count) {
        count = crossing_list_run(walls, start, walls->items[start].ray);
        replace_hit(hits, representative(&walls->items[start], count));
    }
}

void boundary_batch_find(struct boundary_batch *batch, const struct plan *plan, const struct kernel *kernel,
                         const struct ray_batch *rays, struct hit_batch *hits)
{
    batch->walls.count = 0;
    push_first_probes(batch, plan, rays, hits);
    for (bool first = true; batch->probes.count > 0; first = false) {
        kernel->closest(plan, &batch->probes, &batch->found);
        push_next_probes(batch, plan, rays, hits, first);
    }
    if (batch->walls.count > 1)
        qsort(batch->walls.items, batch->walls.count, sizeof *batch->walls.items, compare_walls);
    replace_hits(&batch->walls, hits);
}

size_t boundary_batch_first(const struct boundary_batch *batch, uint32_t ray)
{
    size_t first = 0, end = batch->walls.count;
    while (first < end) {
        size_t middle = first + (end - first) / 2;
        if (batch->walls.items[middle].ray < ray)
            first = middle + 1;
        else
            end = middle;
    }
    return first;
}
