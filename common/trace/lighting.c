#include "trace/lighting.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "math/elementary.h"
#include "trace/kernel.h"
#include "trace/optics.h"
#include "trace/surface.h"

enum { LIGHTING_ARRAYS = 9 };

static void list_arrays(struct lighting *l, double **arrays[LIGHTING_ARRAYS])
{
    double **const all[LIGHTING_ARRAYS] = {&l->direction[0], &l->direction[1], &l->direction[2],
                                           &l->t_min,        &l->t_max,        &l->radiance[0],
                                           &l->radiance[1],  &l->radiance[2],  &l->lit};
    for (int i = 0; i < LIGHTING_ARRAYS; i++)
        arrays[i] = all[i];
}

void lighting_finish(struct lighting *lighting)
{
    double **arrays[LIGHTING_ARRAYS];
    list_arrays(lighting, arrays);
    for (int i = 0; i < LIGHTING_ARRAYS; i++)
        free(*arrays[i]);
    *lighting = (struct lighting){0};
}

void lighting_reserve(struct lighting *lighting, size_t capacity)
{
    double **arrays[LIGHTING_ARRAYS];
    if (capacity <= lighting->capacity)
        return;
    lighting->capacity = lanes_in_packets(capacity);
    list_arrays(lighting, arrays);
    for (int i = 0; i < LIGHTING_ARRAYS; i++)
        lanes_grow(arrays[i], 0, lighting->capacity);
}

/* --- shadow rays ------------------------------------------------------------------------------------------ */

void shadow_batch_finish(struct shadow_batch *batch)
{
    ray_batch_finish(&batch->rays);
    free(batch->surface);
    free(batch->blocked);
    free(batch->crossings);
    free(batch->end);
    *batch = (struct shadow_batch){0};
}

static void shadow_batch_reserve(struct shadow_batch *batch, size_t capacity)
{
    ray_batch_reserve(&batch->rays, capacity);
    if (batch->capacity >= batch->rays.capacity)
        return;
    batch->capacity = batch->rays.capacity;
    batch->surface = memory_resize(batch->surface, batch->capacity, sizeof *batch->surface);
    batch->blocked = memory_resize(batch->blocked, batch->capacity, sizeof *batch->blocked);
    batch->end = memory_resize(batch->end, batch->capacity + 2, sizeof *batch->end);
}

void shadow_batch_collect(struct shadow_batch *batch, const struct lighting *lighting, size_t surface_count)
{
    size_t count = 0;
    shadow_batch_reserve(batch, surface_count + 1);
    for (size_t i = 0; i < surface_count; i++) {
        batch->surface[count] = (uint32_t)i; /* overwritten by the next that is lit, if this one is not */
        count += lighting->lit[i] != 0;
    }
    batch->rays.count = count;
}

/* --- coloured shadows ------------------------------------------------------------------------------------- */

/* Whether the ray that both are of meets a before b. */
static bool is_met_before(const struct crossing *a, const struct crossing *b)
{
    return a->t != b->t ? a->t < b->t : hit_key(a->id, a->side) < hit_key(b->id, b->side);
}

/* One ray's crossings, which are few, in the order in which it meets them. Returns how many are left without what is
 * there twice. */
static size_t sort_run(struct crossing *run, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        struct crossing crossing = run[i];
        size_t at = i;
        for (; at > 0 && is_met_before(&crossing, &run[at - 1]); at--)
            run[at] = run[at - 1];
        run[at] = crossing;
    }
    size_t kept = count > 0;
    for (size_t i = 1; i < count; i++)
        if (is_met_before(&run[kept - 1], &run[i]))
            run[kept++] = run[i];
    return kept;
}

/* Sorts a kernel's crossings by ray: a counting sort. */
static void sort_by_ray(struct shadow_batch *batch, const struct crossing_list *list)
{
    size_t *end = batch->end;
    batch->crossings = memory_grow(batch->crossings, &batch->crossing_capacity, list->count, sizeof *batch->crossings);
    for (size_t i = 0; i < batch->rays.count + 2; i++)
        end[i] = 0;
    for (size_t i = 0; i < list->count; i++)
        end[list->items[i].ray + 2]++;
    for (size_t i = 2; i < batch->rays.count + 2; i++)
        end[i] += end[i - 1];
    for (size_t i = 0; i < list->count; i++) /* what is the start of a ray's place now is its end then */
        batch->crossings[end[list->items[i].ray + 1]++] = list->items[i];
}

static struct vec3 surface_factor(const struct plan *plan, const struct ray *ray, const struct crossing *crossing,
                                  const struct plan_material *material)
{
    if (!material->dielectric)
        return vec3_scale(material->filter, material->transparency);
    struct hit hit = {crossing->t, crossing->id, crossing->side,
                      plan_part(plan, crossing->id, ray->origin, ray->direction, crossing->side)};
    struct vec3 outward = surface_point_at(plan, ray, &hit).normal;
    struct vec3 normal = crossing->side == SIDE_ENTER ? outward : vec3_neg(outward);
    struct refraction refraction = optics_refraction(ray->direction, normal, 1, material->ior);
    return vec3_scale(material->filter, 1 - refraction.reflectance);
}

/* exp(−absorption × length), channel by channel. */
static struct vec3 absorbed(struct vec3 absorption, double length)
{
    return vec3_make(math_exp(-absorption.x * length), math_exp(-absorption.y * length),
                     math_exp(-absorption.z * length));
}

static uint32_t object_of(const struct plan *plan, const struct crossing *crossing)
{
    return plan_primitive(plan, crossing->id)->object;
}

/* Where the object that is left at run[at] was entered: at the nearest crossing before that is not yet paired with a
 * leaving one, or at the ray's start. */
static double entered_at(const struct plan *plan, const struct crossing *run, size_t at)
{
    uint32_t object = object_of(plan, &run[at]);
    int open = 0;
    for (size_t i = at; i-- > 0;) {
        if (object_of(plan, &run[i]) != object)
            continue;
        if (run[i].side == SIDE_ENTER && open-- == 0)
            return run[i].t;
        if (run[i].side == SIDE_LEAVE)
            open++;
    }
    return 0;
}

/* Whether the object entered at run[at] is not left again before the light. */
static bool stays_inside(const struct plan *plan, const struct crossing *run, size_t at, size_t count)
{
    uint32_t object = object_of(plan, &run[at]);
    int depth = 1;
    for (size_t i = at + 1; i < count && depth > 0; i++)
        if (object_of(plan, &run[i]) == object)
            depth += run[i].side == SIDE_ENTER ? 1 : -1;
    return depth > 0;
}

static struct vec3 run_transmittance(const struct plan *plan, const struct ray *ray, const struct crossing *run,
                                     size_t count)
{
    struct vec3 product = {1, 1, 1};
    for (size_t i = 0; i < count; i++) {
        const struct plan_material *material = &plan->materials[plan->objects[object_of(plan, &run[i])].material];
        product = vec3_mul(product, surface_factor(plan, ray, &run[i], material));
        if (!material->absorbs)
            continue;
        if (run[i].side == SIDE_LEAVE)
            product = vec3_mul(product, absorbed(material->absorption, run[i].t - entered_at(plan, run, i)));
        else if (ray->t_max < INFINITY && stays_inside(plan, run, i, count))
            product = vec3_mul(product, absorbed(material->absorption, ray->t_max - run[i].t));
    }
    return product;
}

/* What the solid that the lit point is in absorbs if the ray crosses no wall of it: the light is in there, too. */
static struct vec3 absorbed_around(const struct plan *plan, const struct medium_pool *media, uint32_t medium,
                                   const struct ray *ray, const struct crossing *run, size_t count)
{
    if (medium == MEDIUM_SPACE || ray->t_max == INFINITY)
        return vec3_make(1, 1, 1);
    uint32_t object = medium_top(media, medium);
    for (size_t i = 0; i < count; i++)
        if (object_of(plan, &run[i]) == object)
            return vec3_make(1, 1, 1);
    return absorbed(plan->materials[plan->objects[object].material].absorption, ray->t_max);
}

static void dim(const struct lighting *lighting, uint32_t surface, struct vec3 factor)
{
    lane_put(lighting->radiance, surface, vec3_mul(lane_get(lighting->radiance, surface), factor));
}

/* By the surfaces and solids that ray i passes. */
static void dim_by_run(struct shadow_batch *batch, const struct plan *plan, const struct medium_pool *media,
                       uint32_t medium, size_t i, const struct lighting *lighting)
{
    size_t count = batch->end[i + 1] - batch->end[i];
    struct crossing *run = batch->crossings + batch->end[i];
    if (count == 0 && medium == MEDIUM_SPACE)
        return;
    count = sort_run(run, count);
    struct ray ray = ray_batch_get(&batch->rays, i);
    struct vec3 around = absorbed_around(plan, media, medium, &ray, run, count);
    dim(lighting, batch->surface[i], vec3_mul(around, run_transmittance(plan, &ray, run, count)));
}

void shadow_batch_dim(struct shadow_batch *batch, const struct plan *plan, const struct medium_pool *media,
                      const struct path_batch *paths, const struct surfaces *surfaces,
                      const struct crossing_list *crossings, const struct lighting *lighting)
{
    for (size_t i = 0; i < batch->rays.count; i++)
        if (batch->blocked[i])
            lane_put(lighting->radiance, batch->surface[i], vec3_make(0, 0, 0));
    bool absorbs = plan->absorbs && media->count > 0;
    if (crossings->count == 0 && !absorbs)
        return;
    sort_by_ray(batch, crossings);
    for (size_t i = 0; i < batch->rays.count; i++) {
        uint32_t medium = absorbs ? paths->medium[surfaces->path[batch->surface[i]]] : MEDIUM_SPACE;
        if (!batch->blocked[i])
            dim_by_run(batch, plan, media, medium, i, lighting);
    }
}
