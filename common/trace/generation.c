#include "trace/generation.h"

#include <math.h>

#include "math/elementary.h"

void generation_finish(struct generation *g)
{
    medium_pool_finish(&g->media);
    path_batch_finish(&g->paths);
    path_batch_finish(&g->children);
    hit_batch_finish(&g->hits);
    boundary_batch_finish(&g->boundaries);
    surfaces_finish(&g->surfaces);
    mirrored_finish(&g->mirrored);
    transmitted_finish(&g->transmitted);
}

void generation_find_hits(struct generation *g)
{
    hit_batch_reserve(&g->hits, g->paths.rays.count);
    g->kernel->closest(g->plan, &g->paths.rays, &g->hits);
    g->boundaries.walls.count = 0;
    surfaces_count(&g->surfaces, g->plan, &g->hits, g->paths.rays.count);
    if (!(g->surfaces.traits & TRAIT_REFRACTS))
        return;
    boundary_batch_pass_start(&g->boundaries, g->plan, g->kernel, &g->media, &g->paths, &g->hits);
    if (g->plan->contact_count > 0)
        boundary_batch_find(&g->boundaries, g->plan, g->kernel, &g->paths.rays, &g->hits);
    surfaces_count(&g->surfaces, g->plan, &g->hits, g->paths.rays.count);
}

/* --- surfaces --------------------------------------------------------------------------------------------- */

/* Where the path's last bend lies on the ray: a path that went straight through a surface keeps its ray. */
static double segment_start(const struct ray_batch *rays, uint32_t path)
{
    return rays->key_min[path] == LANE_KEY_NONE ? 0 : rays->t_min[path];
}

/* What media take from the paths on their way. */
static void absorb(struct generation *g)
{
    const struct surfaces *s = &g->surfaces;
    for (size_t i = 0; i < s->count; i++) {
        uint32_t medium = g->paths.medium[s->path[i]];
        if (medium == MEDIUM_SPACE)
            continue;
        const struct plan_object *object = &g->plan->objects[medium_top(&g->media, medium)];
        const struct plan_material *material = &g->plan->materials[object->material];
        if (!material->absorbs)
            continue;
        struct vec3 absorption = material->absorption;
        double length = s->lanes.t[i] - segment_start(&g->paths.rays, s->path[i]);
        struct vec3 share = {math_exp(-absorption.x * length), math_exp(-absorption.y * length),
                             math_exp(-absorption.z * length)};
        lane_put(s->lanes.throughput, i, vec3_mul(lane_get(s->lanes.throughput, i), share));
    }
}

/* The walls of a boundary are as far apart, on either side: the true places are within 3/2 windows of one another along
 * the ray; the rest is for rounding. */
static void widen_boundaries(struct generation *g)
{
    const struct crossing_list *walls = &g->boundaries.walls;
    const struct surface_lanes *s = &g->surfaces.lanes;
    for (size_t first = 0, count; first < walls->count; first += count) {
        uint32_t ray = walls->items[first].ray, i = g->surfaces.of_path[ray];
        count = crossing_list_run(walls, first, ray);
        double cosine = fabs(vec3_dot(lane_get(s->direction, i), lane_get(s->normal, i)));
        s->error[i] += 2 * boundary_window(lane_get(g->paths.rays.origin, ray), s->t[i]) * cosine;
    }
}

/* Whether footprints decide what the paths see. */
static bool needs_footprints(const struct generation *g)
{
    bool meets_image = g->plan->background.kind == BACKGROUND_IMAGE && g->surfaces.count < g->paths.rays.count;
    return meets_image || (g->surfaces.traits & TRAIT_TEXTURED);
}

bool generation_find_surfaces(struct generation *g)
{
    const struct plan *plan = g->plan;
    surfaces_sort(&g->surfaces, g->paths.rays.count);
    g->kernel->collect(plan, &g->paths, &g->hits, &g->surfaces);
    surfaces_place(&g->surfaces, plan);
    g->used_footprints = needs_footprints(g);
    if (g->used_footprints && !g->paths.has_footprints)
        return false;
    g->kernel->surface(plan, &g->paths, &g->surfaces);
    if (plan->is_smooth)
        surfaces_smooth(&g->surfaces, plan, &g->paths);
    g->kernel->face(&g->surfaces);
    if (g->used_footprints) {
        surfaces_find_textures(&g->surfaces, plan, &g->paths);
        g->kernel->pattern(plan, &g->surfaces);
        surfaces_look_up(&g->surfaces, plan);
    }
    if (plan->absorbs && g->media.count > 0)
        absorb(g);
    widen_boundaries(g);
    return true;
}

/* --- children --------------------------------------------------------------------------------------------- */

void generation_find_children(struct generation *g)
{
    path_batch_clear(&g->children);
    g->children.has_footprints = g->paths.has_footprints;
    if (!(g->surfaces.traits & (TRAIT_MIRRORS | TRAIT_TRANSMITS)))
        return;
    transmitted_collect(&g->transmitted, g->plan, &g->media, &g->paths, &g->surfaces, &g->boundaries);
    g->kernel->refract(g->plan, &g->surfaces, &g->transmitted);
    children_choose(&g->mirrored, &g->transmitted, g->plan, &g->surfaces, g->paths.rays.count);
    g->kernel->mirror(g->plan, &g->paths, &g->surfaces, &g->mirrored, &g->children);
    g->kernel->transmit(g->plan, &g->paths, &g->surfaces, &g->transmitted, &g->children);
}

void generation_pass(struct generation *g)
{
    struct path_batch parents = g->paths;
    g->paths = g->children;
    g->children = parents;
}
