/*
 * Single paths followed by hand: what a ray hits, and the paths that go on from there as the tracer would make
 * them.
 */
#ifndef WEFT_TESTS_BOUNCE_H
#define WEFT_TESTS_BOUNCE_H

#include "tests/numeric/shoot.h"
#include "trace/medium.h"
#include "trace/optics.h"
#include "trace/shade.h"

/* The hit, and what follows from it: a mirrored and a transmitted path, as far as there are any. */
struct bounce {
    struct shading shading;
    bool met, is_mirrored, is_transmitted;
    struct path mirrored, transmitted;
};

static inline struct path path_along(struct ray ray)
{
    return (struct path){.ray = ray, .throughput = {1, 1, 1}, .medium = MEDIUM_SPACE};
}

/* What follows from a hit that is already known. */
static inline struct bounce bounce_at(const struct world *world, struct medium_pool *media,
                                      const struct path *path, const struct hit *hit)
{
    struct bounce bounce = {.met = hit->id != PRIMITIVE_NONE};
    if (!bounce.met)
        return bounce;
    struct path_batch children = {0};
    shading_init(&bounce.shading, world->plan, media, path, hit);
    shading_push_children(world->plan, &bounce.shading, media, &children);
    for (size_t i = 0; i < children.rays.count; i++) {
        struct path child = path_batch_get(&children, i);
        bool departs_outward = child.ray.departure == DEPART_OUTWARD;
        if (child.ray.key_min == KEY_NONE && departs_outward == (hit->side == SIDE_ENTER)) {
            bounce.is_mirrored = true;
            bounce.mirrored = child;
        } else {
            bounce.is_transmitted = true;
            bounce.transmitted = child;
        }
    }
    path_batch_finish(&children);
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
