/*
 * For benchmarks: timing, and scenes full of one kind of shape.
 *
 * Times are CPU time of the calling thread, so that other work on the machine disturbs them little, and the least of
 * several runs, which it disturbs least.
 */
#ifndef WEFT_BENCH_BENCH_H
#define WEFT_BENCH_BENCH_H

#include <time.h>

#include "base/options.h"
#include "scene/load.h"
#include "tests/random.h"
#include "tests/scene_builder.h"

static inline double bench_thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Runs work(context) again and again, three times and 0.1 s at least; the least seconds of one run. */
static inline double bench_least_seconds(void (*work)(void *context), void *context)
{
    double least = INFINITY, all = 0;
    for (int run = 0; run < 3 || all < 0.1; run++) {
        double start = bench_thread_seconds();
        work(context);
        double took = bench_thread_seconds() - start;
        least = fmin(least, took);
        all += took;
    }
    return least;
}

/* --- scenes from files ------------------------------------------------------------------------------------ */

/* Of "PROGRAM WIDTH SCENE...": the width. */
static inline enum status bench_width(int argc, char **argv, const char *program, uint32_t *width, struct error *error)
{
    int64_t number = 0;
    if (argc < 3)
        return error_set(error, STATUS_USAGE, "usage: %s WIDTH SCENE...", program);
    enum status status = options_integer("WIDTH", argv[1], 1, 4096, &number, error);
    *width = (uint32_t)number;
    return status;
}

/* The scene of that file, as wide as that and as high as its shape demands; the caller finishes it if all is well. */
static inline enum status bench_load(const char *path, uint32_t width, uint32_t samples, struct scene *scene,
                                     struct error *error)
{
    struct asset_set assets;
    const char *name;
    asset_set_init_disk(&assets, path, &name);
    *scene = (struct scene){0};
    enum status status = scene_load(scene, name, &assets, error);
    asset_set_finish(&assets);
    if (status != STATUS_OK) {
        scene_finish(scene);
        return status;
    }
    scene->height = (width * scene->height + scene->width - 1) / scene->width;
    scene->width = width;
    scene->samples = samples;
    return STATUS_OK;
}

/* --- scenes of one shape ---------------------------------------------------------------------------------- */

enum bench_shape {
    BENCH_SPHERE,
    BENCH_ELLIPSOID,
    BENCH_PLANE,
    BENCH_DISC,
    BENCH_CYLINDER,
    BENCH_CONE,
    BENCH_BOX,
    BENCH_TRIANGLE,
    BENCH_SHAPES,
};

static const char *const bench_shape_names[BENCH_SHAPES] = {"sphere", "ellipsoid", "plane", "disc",
                                                            "cylinder", "cone", "box", "triangle"};

/* Number i of those that fill the cube from −1 to 1, about `size` large. Not for triangles. */
static inline struct shape bench_shape_at(enum bench_shape kind, uint32_t i, double size)
{
    struct vec3 center = random_vector(i, 0), axis = random_unit(i, 3);
    struct vec3 top = vec3_add_scaled(center, axis, size), half = vec3_make(size / 2, size / 2, size / 2);
    switch (kind) {
    case BENCH_PLANE:
        return shape_plane(center, axis);
    case BENCH_DISC:
        return shape_disc(center, axis, size / 2);
    case BENCH_CYLINDER:
        return shape_frustum(center, top, size / 3, size / 3);
    case BENCH_CONE:
        return shape_frustum(center, top, size / 2, 0);
    case BENCH_BOX:
        return shape_box(vec3_sub(center, half), vec3_add(center, half));
    default:
        return shape_sphere(center, size / 2);
    }
}

/* One mesh of `count` triangles that touch nothing. */
static inline struct shape bench_triangles(size_t count, double size)
{
    struct mesh mesh = {.vertex_count = 3 * count, .triangle_count = count};
    mesh.points = memory_array(mesh.vertex_count, sizeof *mesh.points);
    mesh.index = memory_array(mesh.vertex_count, sizeof *mesh.index);
    for (uint32_t i = 0; i < mesh.vertex_count; i++) {
        mesh.points[i] = vec3_add_scaled(random_vector(i / 3, 0), random_unit(i, 3), size);
        mesh.index[i] = i;
    }
    return (struct shape){.kind = SHAPE_MESH, .mesh = mesh};
}

/* `count` shapes in the cube from −1 to 1, of a size at which a ray meets about one at any count; a camera in front of
 * them. scene_finish frees it. */
static inline struct scene bench_scene(enum bench_shape kind, size_t count)
{
    struct scene scene = scene_at(vec3_make(0, 0, 4), 30);
    double size = 2 / sqrt((double)count);
    scene_add(&scene, kind == BENCH_TRIANGLE ? bench_triangles(count, size) : bench_shape_at(kind, 0, size),
              material_matte(grey(1)));
    for (uint32_t i = 1; kind != BENCH_TRIANGLE && i < count; i++)
        scene_add_object(&scene)->shape = bench_shape_at(kind, i, size);
    if (kind == BENCH_ELLIPSOID)
        for (size_t i = 0; i < scene.object_count; i++)
            scene.objects[i].transform = affine_scaling(vec3_make(1, 0.7, 0.8));
    return scene;
}

/* --- rays ------------------------------------------------------------------------------------------------- */

/* coherent: a square of camera rays; random: from anywhere in the cube to anywhere; shadow: from anywhere to one
 * light. */
enum bench_rays { BENCH_COHERENT, BENCH_RANDOM, BENCH_SHADOW, BENCH_RAY_SORTS };

static const char *const bench_ray_names[BENCH_RAY_SORTS] = {"coherent", "random", "shadow"};

enum { BENCH_RAYS_SIDE = 64, BENCH_RAYS = BENCH_RAYS_SIDE * BENCH_RAYS_SIDE };

/* ray_batch_finish frees it. */
static inline struct ray_batch bench_rays_of(const struct plan *plan, enum bench_rays sort)
{
    const struct vec3 lamp = vec3_sub(vec3_make(3, 5, 4), plan->eye);
    struct ray_batch batch = {0};
    for (uint32_t i = 0; i < BENCH_RAYS; i++) {
        struct ray ray = {.t_max = INFINITY, .key_min = KEY_NONE, .from = PRIMITIVE_NONE};
        uint32_t column = i % BENCH_RAYS_SIDE, row = i / BENCH_RAYS_SIDE;
        double x = 2.0 * column / BENCH_RAYS_SIDE - 1, y = 2.0 * row / BENCH_RAYS_SIDE - 1;
        ray.direction = vec3_normalize(vec3_make(0.25 * x, 0.25 * y, -1));
        if (sort != BENCH_COHERENT) {
            ray.origin = vec3_sub(random_vector(i, 6), plan->eye);
            ray.direction = random_unit(i, 9);
        }
        if (sort == BENCH_SHADOW) {
            struct vec3 way = vec3_sub(lamp, ray.origin);
            ray.t_max = vec3_length(way);
            ray.direction = vec3_normalize(way);
        }
        ray_batch_push(&batch, &ray);
    }
    return batch;
}

/* --- one kernel on one batch: the only place here that calls kernels ---------------------------------------- */

struct bench_shot {
    const struct kernel *kernel;
    const struct plan *plan;
    struct ray_batch rays;
    struct hit_batch hits;
    uint8_t blocked[BENCH_RAYS];
    struct crossing_list crossings;
};

static inline void bench_shoot_closest(void *context)
{
    struct bench_shot *shot = context;
    shot->kernel->closest(shot->plan, &shot->rays, &shot->hits);
}

static inline void bench_shoot_shadow(void *context)
{
    struct bench_shot *shot = context;
    shot->crossings.count = 0;
    shot->kernel->shadow(shot->plan, &shot->rays, shot->blocked, &shot->crossings);
}

/* Nanoseconds a ray. */
static inline double bench_ns_a_ray(const struct kernel *kernel, const struct plan *plan, enum bench_rays sort)
{
    struct bench_shot shot = {.kernel = kernel, .plan = plan, .rays = bench_rays_of(plan, sort)};
    hit_batch_reserve(&shot.hits, BENCH_RAYS);
    double seconds = bench_least_seconds(sort == BENCH_SHADOW ? bench_shoot_shadow : bench_shoot_closest, &shot);
    ray_batch_finish(&shot.rays);
    hit_batch_finish(&shot.hits);
    crossing_list_finish(&shot.crossings);
    return 1e9 * seconds / BENCH_RAYS;
}

static inline struct plan *bench_plan(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    return plan_create(scene, &settings, 1);
}

#endif
