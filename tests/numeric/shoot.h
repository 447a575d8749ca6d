/*
 * Worlds of a few objects, and single rays at them, on every kernel that this machine can run: all must give
 * the same bits at any place in a batch, and their shadows must agree with what their nearest hits say.
 */
#ifndef WEFT_TESTS_NUMERIC_SHOOT_H
#define WEFT_TESTS_NUMERIC_SHOOT_H

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "tests/numeric/oracle_limits.h"
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/surface.h"

/* --- worlds ----------------------------------------------------------------------------------------------- */

/* The scene lives as long as the plan. world_end frees both. */
struct world {
    struct scene scene;
    struct plan *plan;
};

/* An empty world with the camera at `eye`, to be filled by scene_add and then compiled. */
static inline struct world world_begin(struct vec3 eye)
{
    struct world world = {.scene = scene_at(eye, 40)};
    world.scene.camera.up = vec3_make(0, 1, 0);
    world.scene.camera.at = vec3_add(eye, vec3_make(0, 0, -vec3_max_abs(eye) - 1));
    return world;
}

static inline void world_compile(struct world *world)
{
    struct trace_settings settings = settings_of(&world->scene);
    world->plan = plan_create(&world->scene, &settings, 1);
}

static inline struct world world_of(struct shape shape, struct affine transform, struct vec3 eye)
{
    struct world world = world_begin(eye);
    scene_add(&world.scene, shape, material_matte(grey(1)))->transform = transform;
    world_compile(&world);
    return world;
}

/* One object that is not moved, seen from the origin of coordinates. */
static inline struct world world_plain(struct shape shape)
{
    return world_of(shape, affine_identity(), vec3_make(0, 0, 0));
}

static inline void world_end(struct world *world)
{
    plan_destroy(&world->plan);
    scene_finish(&world->scene);
}

/* --- rays ------------------------------------------------------------------------------------------------- */

/* From a place in the world, in free space. */
static inline struct ray ray_from(const struct world *world, struct vec3 origin, struct vec3 direction)
{
    return (struct ray){.origin = vec3_sub(origin, world->scene.camera.from),
                        .direction = vec3_normalize(direction),
                        .t_max = INFINITY,
                        .key_min = KEY_NONE,
                        .from = PRIMITIVE_NONE};
}

/* The same ray with what it has hit behind it. */
static inline struct ray ray_beyond(struct ray ray, const struct hit *hit)
{
    ray.t_min = hit->t;
    ray.key_min = hit_key(hit->id, hit->side);
    return ray;
}

static inline bool hits_are_equal(const struct hit *a, const struct hit *b)
{
    if (a->id != b->id)
        return false;
    return a->id == PRIMITIVE_NONE ||
           (memcmp(&a->t, &b->t, sizeof a->t) == 0 && a->side == b->side && a->part == b->part);
}

/* Every kernel's hits of a batch must be those of the first, which are left in *hits. */
static inline void shoot_batch(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    struct hit_batch others = {0};
    hit_batch_reserve(hits, rays->count);
    hit_batch_reserve(&others, rays->count);
    kernel_at(0)->closest(plan, rays, hits);
    for (size_t k = 1; kernel_at(k); k++) {
        kernel_at(k)->closest(plan, rays, &others);
        for (size_t i = 0; i < rays->count; i++) {
            struct hit expected = hit_at(plan, rays, hits, i), found = hit_at(plan, rays, &others, i);
            if (!hits_are_equal(&expected, &found))
                fail_msg("kernel %s: ray %zu of %zu meets %u at %a; the first kernel says %u at %a",
                         kernel_at(k)->name, i, rays->count, found.id, found.t, expected.id, expected.t);
        }
    }
    hit_batch_finish(&others);
}

/* What blocks light and is hit first must shadow, and what hits nothing must not. */
static inline void check_shadows(const struct plan *plan, const struct ray_batch *rays,
                                 const struct hit_batch *hits)
{
    uint8_t *blocked = memory_array(rays->count, 1);
    for (size_t k = 0; kernel_at(k); k++) {
        struct crossing_list crossings = {0};
        kernel_at(k)->shadow(plan, rays, blocked, &crossings);
        for (size_t i = 0; i < rays->count; i++) {
            bool met = hit_batch_id(hits, i) != PRIMITIVE_NONE;
            assert_true(met || !blocked[i]);
            assert_true(!met || blocked[i] || !plan->primitives[hit_batch_id(hits, i)].blocks_light);
        }
        crossing_list_finish(&crossings);
    }
    free(blocked);
}

enum { LANES = 11 }; /* more than the widest kernel has, and odd */

/* The hit of one ray, with id PRIMITIVE_NONE if there is none. It is shot at several places in a batch of
 * others. */
static inline struct hit shoot_ray(const struct world *world, const struct ray *ray)
{
    struct ray_batch rays = {0};
    struct hit_batch hits = {0};
    for (uint32_t i = 0; i < LANES; i++) {
        struct ray other = *ray;
        if (i % 5 != 0)
            other.direction = random_unit(i, 90);
        ray_batch_push(&rays, &other);
    }
    shoot_batch(world->plan, &rays, &hits);
    check_shadows(world->plan, &rays, &hits);
    struct hit first = hit_at(world->plan, &rays, &hits, 0);
    for (size_t i = 5; i < LANES; i += 5) {
        struct hit again = hit_at(world->plan, &rays, &hits, i);
        assert_true(hits_are_equal(&first, &again));
    }
    assert_true(first.id == PRIMITIVE_NONE || (isfinite(first.t) && first.id < world->plan->primitive_count));
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
    return first;
}

static inline struct hit shoot(const struct world *world, struct vec3 origin, struct vec3 direction)
{
    struct ray ray = ray_from(world, origin, direction);
    return shoot_ray(world, &ray);
}

/* What is seen in a world at `at` from `from`. */
static inline double look(struct scene *scene, struct vec3 from, struct vec3 at)
{
    scene->camera.from = from;
    scene->camera.at = at;
    return scene_look(scene).x;
}

/* --- what must come out ----------------------------------------------------------------------------------- */

#define assert_misses(world, origin, direction)                                                                \
    assert_int_equal(shoot(world, origin, direction).id, PRIMITIVE_NONE)

/* t within tolerance, on that side. */
static inline void check_hit(const struct hit *hit, enum side side, double t, double tolerance)
{
    if (hit->id == PRIMITIVE_NONE)
        fail_msg("missed what is at t = %.17g", t);
    if (hit->side != side || !(fabs(hit->t - t) <= tolerance))
        fail_msg("met side %d at t = %.17g, expected side %d at %.17g ± %g", hit->side, hit->t, side, t,
                 tolerance);
}

static inline void check_shot(const struct world *world, struct vec3 origin, struct vec3 direction,
                              enum side side, double t, double tolerance)
{
    struct hit hit = shoot(world, origin, direction);
    check_hit(&hit, side, t, tolerance);
}

/* The ray in the coordinates of the world's object. */
static inline struct limits_ray limits_ray_to(const struct world *world, size_t object, const struct ray *ray)
{
    struct limits_frame frame =
        limits_frame_of(&world->scene.objects[object].transform, world->scene.camera.from);
    return limits_ray_in(&frame, ray->origin, ray->direction);
}

/* The oracle's t for the only object of a world; NAN if there is none on that side. */
static inline double exact_t(const struct world *world, const struct ray *ray, enum side side)
{
    struct limits_ray exact = limits_ray_to(world, 0, ray);
    return (double)limits_t(&world->scene.objects[0].shape, &exact, side);
}

/* The first and second hit of a ray with the only (solid) object of a world, against the oracle's. */
static inline void check_against_oracle(const struct world *world, const struct ray *ray, double tolerance)
{
    double enter = exact_t(world, ray, SIDE_ENTER), leave = exact_t(world, ray, SIDE_LEAVE);
    struct hit hit = shoot_ray(world, ray);
    if (enter > 0) {
        check_hit(&hit, SIDE_ENTER, enter, tolerance);
        struct ray rest = ray_beyond(*ray, &hit);
        hit = shoot_ray(world, &rest);
    }
    if (leave > 0)
        check_hit(&hit, SIDE_LEAVE, leave, tolerance);
    else
        assert_int_equal(hit.id, PRIMITIVE_NONE);
}

#endif
