/*
 * A kernel that compares two: it does what the scalar one does, and at each stage tries another on copies of what the
 * stage may write (compared_arrays.h). So whatever drives a kernel, as generation.c does, compares stage by stage.
 */
#ifndef WEFT_TESTS_COMPARED_H
#define WEFT_TESTS_COMPARED_H

#include <stdlib.h>

#include "tests/kernel/compared_arrays.h"

/* --- paths and their hits --------------------------------------------------------------------------------- */

static struct path_batch copy_paths(const struct path_batch *from)
{
    struct path_batch copy = *from;
    copy_arrays(&copy.rays, TABLE(ray_arrays), copy.rays.capacity);
    copy_arrays(&copy, TABLE(throughput_arrays), copy.capacity);
    copy_arrays(&copy, TABLE(footprint_arrays), copy.capacity);
    copy_arrays(&copy, TABLE(found_arrays), copy.capacity);
    copy_arrays(&copy, TABLE(origin_arrays), copy.capacity);
    return copy;
}

/* All but found and the sample and medium. */
static void compare_paths(const char *stage, const struct path_batch *expected, const struct path_batch *found)
{
    size_t count = expected->rays.count;
    if (found->rays.count != count)
        note_difference(stage, "rays", found->rays.count, "not as many");
    compare_arrays(stage, &expected->rays, &found->rays, TABLE(ray_arrays), count);
    compare_arrays(stage, expected, found, TABLE(throughput_arrays), count);
    if (expected->has_footprints)
        compare_arrays(stage, expected, found, TABLE(footprint_arrays), count);
}

static void compared_camera(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths)
{
    struct camera_rays own_rays = *rays;
    struct path_batch own = copy_paths(paths);
    copy_arrays(&own_rays, TABLE(camera_arrays), lanes_in_packets(rays->count));
    kernel_ref.camera(plan, rays, paths);
    trial.kernel->camera(plan, &own_rays, &own);
    compare_arrays("camera", rays, &own_rays, TABLE(camera_arrays), rays->count);
    compare_paths("camera", paths, &own);
    if (rays->count > 0)
        free_arrays(&own_rays, TABLE(camera_arrays));
    path_batch_finish(&own);
}

static void compared_closest(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    struct hit_batch own = *hits;
    copy_arrays(&own, TABLE(hit_arrays), own.capacity);
    kernel_ref.closest(plan, rays, hits);
    trial.kernel->closest(plan, rays, &own);
    compare_arrays("closest", hits, &own, TABLE(hit_arrays), rays->count);
    free_arrays(&own, TABLE(hit_arrays));
}

/* --- surfaces --------------------------------------------------------------------------------------------- */

/* What stages write of them; the rest is shared. */
static struct surfaces copy_surfaces(const struct surfaces *from)
{
    struct surfaces copy = *from;
    copy_arrays(&copy, TABLE(surface_arrays), copy.capacity);
    copy_arrays(&copy.imaged, TABLE(point_arrays), copy.imaged.capacity);
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++)
        copy_arrays(&copy.patterned[kind], TABLE(share_arrays), copy.patterned[kind].capacity);
    return copy;
}

/* Frees the copy, too. */
static void compare_surfaces(const char *stage, const struct surfaces *expected, struct surfaces *found)
{
    compare_arrays(stage, expected, found, TABLE(surface_arrays), expected->count);
    compare_arrays(stage, &expected->imaged, &found->imaged, TABLE(point_arrays), expected->imaged.count);
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++) {
        compare_arrays(stage, &expected->patterned[kind], &found->patterned[kind], TABLE(share_arrays),
                       expected->patterned[kind].count);
        free_arrays(&found->patterned[kind], TABLE(share_arrays));
    }
    free_arrays(&found->imaged, TABLE(point_arrays));
    free_arrays(found, TABLE(surface_arrays));
}

static void compared_collect(const struct plan *plan, const struct path_batch *paths, const struct hit_batch *hits,
                             struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.collect(plan, paths, hits, surfaces);
    trial.kernel->collect(plan, paths, hits, &own);
    compare_surfaces("collect", surfaces, &own);
}

static void compared_surface(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.surface(plan, paths, surfaces);
    trial.kernel->surface(plan, paths, &own);
    compare_surfaces("surface", surfaces, &own);
}

static void compared_face(struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.face(surfaces);
    trial.kernel->face(&own);
    compare_surfaces("face", surfaces, &own);
}

static void compared_pattern(const struct plan *plan, struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.pattern(plan, surfaces);
    trial.kernel->pattern(plan, &own);
    compare_surfaces("pattern", surfaces, &own);
}

static void compared_ambient(const struct plan *plan, struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.ambient(plan, surfaces);
    trial.kernel->ambient(plan, &own);
    compare_surfaces("ambient", surfaces, &own);
}

/* --- light ------------------------------------------------------------------------------------------------ */

static void compared_light(const struct plan *plan, size_t light, const struct surfaces *surfaces,
                           struct lighting *lighting)
{
    struct lighting own = *lighting;
    copy_arrays(&own, TABLE(lighting_arrays), own.capacity);
    kernel_ref.light(plan, light, surfaces, lighting);
    trial.kernel->light(plan, light, surfaces, &own);
    compare_arrays("light", lighting, &own, TABLE(lighting_arrays), surfaces->count);
    lighting_finish(&own);
}

static void compared_shadow_rays(const struct surfaces *surfaces, const struct lighting *lighting,
                                 struct shadow_batch *shadows)
{
    struct shadow_batch own = *shadows;
    copy_arrays(&own.rays, TABLE(ray_arrays), own.rays.capacity);
    kernel_ref.shadow_rays(surfaces, lighting, shadows);
    trial.kernel->shadow_rays(surfaces, lighting, &own);
    compare_arrays("shadow_rays", &shadows->rays, &own.rays, TABLE(ray_arrays), shadows->rays.count);
    ray_batch_finish(&own.rays);
}

static int by_ray_and_place(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->ray != b->ray)
        return a->ray < b->ray ? -1 : 1;
    if (a->t != b->t)
        return a->t < b->t ? -1 : 1;
    uint64_t key_a = hit_key(a->id, a->side), key_b = hit_key(b->id, b->side);
    return key_a < key_b ? -1 : key_a > key_b;
}

/* What the crossings say, in a fixed order: each once, and none of blocked rays. */
static void reduce_crossings(struct crossing_list *list, const uint8_t *blocked)
{
    size_t kept = 0;
    if (list->count > 0)
        qsort(list->items, list->count, sizeof *list->items, by_ray_and_place);
    for (size_t i = 0; i < list->count; i++) {
        const struct crossing *next = &list->items[i];
        bool again = kept > 0 && by_ray_and_place(&list->items[kept - 1], next) == 0;
        if (!again && !blocked[next->ray])
            list->items[kept++] = *next;
    }
    list->count = kept;
}

static void compare_crossings(const struct crossing_list *expected, const struct crossing_list *found)
{
    if (expected->count != found->count)
        note_difference("shadow", "crossings", found->count, "not as many");
    for (size_t i = 0; i < expected->count && i < found->count; i++)
        if (by_ray_and_place(&expected->items[i], &found->items[i]) != 0)
            note_difference("shadow", "crossings", expected->items[i].ray, "another crossing");
}

/* Leaves the crossings reduced. The list is empty before. */
static void compared_shadow(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                            struct crossing_list *crossings)
{
    struct crossing_list own = {0};
    uint8_t *own_blocked = memory_array(rays->count, 1);
    kernel_ref.shadow(plan, rays, blocked, crossings);
    trial.kernel->shadow(plan, rays, own_blocked, &own);
    spoil("shadow", (char *)own_blocked, 1, rays->count);
    for (size_t i = 0; i < rays->count; i++)
        if (blocked[i] != own_blocked[i])
            note_difference("shadow", "blocked", i, blocked[i] ? "expected 1" : "expected 0");
    reduce_crossings(crossings, blocked);
    reduce_crossings(&own, blocked);
    compare_crossings(crossings, &own);
    crossing_list_finish(&own);
    free(own_blocked);
}

static void compared_add_light(const struct lighting *lighting, struct surfaces *surfaces)
{
    struct surfaces own = copy_surfaces(surfaces);
    kernel_ref.add_light(lighting, surfaces);
    trial.kernel->add_light(lighting, &own);
    compare_surfaces("add_light", surfaces, &own);
}

static void compared_find(const struct plan *plan, const struct surfaces *surfaces, struct path_batch *paths)
{
    struct path_batch own = copy_paths(paths);
    kernel_ref.find(plan, surfaces, paths);
    trial.kernel->find(plan, surfaces, &own);
    compare_arrays("find", paths, &own, TABLE(found_arrays), paths->rays.count);
    path_batch_finish(&own);
}

/* --- children --------------------------------------------------------------------------------------------- */

static void compared_refract(const struct plan *plan, const struct surfaces *surfaces, struct transmitted *transmitted)
{
    struct transmitted own = *transmitted;
    copy_arrays(&own, TABLE(transmitted_arrays), own.capacity);
    kernel_ref.refract(plan, surfaces, transmitted);
    trial.kernel->refract(plan, surfaces, &own);
    compare_arrays("refract", transmitted, &own, TABLE(transmitted_arrays), transmitted->count);
    free_arrays(&own, TABLE(transmitted_arrays));
}

/* Children know their sample and medium. Frees the copy, too. */
static void compare_children(const char *stage, const struct path_batch *expected, struct path_batch *found)
{
    compare_paths(stage, expected, found);
    compare_arrays(stage, expected, found, TABLE(origin_arrays), expected->rays.count);
    path_batch_finish(found);
}

static void compared_mirror(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                            const struct mirrored *mirrored, struct path_batch *children)
{
    struct path_batch own = copy_paths(children);
    kernel_ref.mirror(plan, paths, surfaces, mirrored, children);
    trial.kernel->mirror(plan, paths, surfaces, mirrored, &own);
    compare_children("mirror", children, &own);
}

static void compared_transmit(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                              const struct transmitted *transmitted, struct path_batch *children)
{
    struct path_batch own = copy_paths(children);
    kernel_ref.transmit(plan, paths, surfaces, transmitted, children);
    trial.kernel->transmit(plan, paths, surfaces, transmitted, &own);
    compare_children("transmit", children, &own);
}

/* --- the kernel ------------------------------------------------------------------------------------------- */

/* In the order in which a generation needs them. */
static const char *const stage_names[] = {"camera",  "closest",     "collect", "surface",   "face",
                                          "pattern", "ambient",     "light",   "shadow_rays", "shadow",
                                          "add_light", "find",      "refract", "mirror",    "transmit"};
enum { STAGES = sizeof stage_names / sizeof *stage_names };

static const struct kernel kernel_compared = {
    .name = "compared",
    .camera = compared_camera,
    .closest = compared_closest,
    .collect = compared_collect,
    .surface = compared_surface,
    .face = compared_face,
    .pattern = compared_pattern,
    .ambient = compared_ambient,
    .light = compared_light,
    .shadow_rays = compared_shadow_rays,
    .shadow = compared_shadow,
    .add_light = compared_add_light,
    .find = compared_find,
    .refract = compared_refract,
    .mirror = compared_mirror,
    .transmit = compared_transmit,
};

#endif
