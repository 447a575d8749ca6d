/*
 * Single paths followed by hand: what a ray hits, and the paths that go on from there as the tracer would make
 * them.
 */
#ifndef WEFT_TESTS_BOUNCE_H
#define WEFT_TESTS_BOUNCE_H

#include "tests/numeric/shoot.h"
#include "trace/generation.h"
#include "trace/optics.h"

/* The hit, and what follows from it: a mirrored and a transmitted path, as far as there are any. */
struct bounce {
    bool met, is_mirrored, is_transmitted;
    struct hit hit;
    struct surface surface;
    struct vec3 facing; /* the normal on the path's side */
    struct path mirrored, transmitted;
};

static inline struct path path_along(struct ray ray)
{
    return (struct path){.ray = ray, .throughput = {1, 1, 1}, .medium = MEDIUM_SPACE};
}

/* A generation of one path whose hit is known, as far as its surface. It has the media until the caller takes them
 * back, and is the same one every time, so that its arrays need not grow anew. */
static inline struct generation *generation_at(const struct world *world, const struct medium_pool *media,
                                               const struct path *path, const struct hit *hit)
{
    static struct generation g;
    g.plan = world->plan;
    g.kernel = kernel_default();
    g.media = *media;
    path_batch_clear(&g.paths);
    path_batch_push(&g.paths, path);
    hit_batch_reserve(&g.hits, 1);
    g.hits.t[0] = hit->t;
    g.hits.key[0] = (double)hit_key(hit->id, hit->side);
    surfaces_count(&g.surfaces, g.plan, &g.hits, 1);
    generation_find_surfaces(&g);
    return &g;
}

/* What follows from a hit that is already known. */
static inline struct bounce bounce_at(const struct world *world, struct medium_pool *media,
                                      const struct path *path, const struct hit *hit)
{
    struct bounce bounce = {.met = hit->id != PRIMITIVE_NONE, .hit = *hit};
    if (!bounce.met)
        return bounce;
    struct generation *g = generation_at(world, media, path, hit);
    g->mirrored.count = g->transmitted.count = 0;
    generation_find_children(g);
    bounce.surface = surfaces_get(&g->surfaces, 0);
    bounce.facing = lane_get(g->surfaces.lanes.facing, 0);
    bounce.is_mirrored = g->mirrored.count > 0;
    bounce.is_transmitted = g->transmitted.count > 0;
    if (bounce.is_mirrored)
        bounce.mirrored = path_batch_get(&g->children, 0);
    if (bounce.is_transmitted)
        bounce.transmitted = path_batch_get(&g->children, g->mirrored.count);
    *media = g->media;
    return bounce;
}

static inline struct bounce bounce_of(const struct world *world, struct medium_pool *media,
                                      const struct path *path)
{
    struct hit hit = shoot_ray(world, &path->ray);
    return bounce_at(world, media, path, &hit);
}

/* One object of the material, seen from the origin of coordinates. */
static inline struct world world_made_of(struct shape shape, struct material material)
{
    struct world world = world_begin(vec3_make(0, 0, 0));
    scene_add(&world.scene, shape, material);
    world_compile(&world);
    return world;
}

#endif
