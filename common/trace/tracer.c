/*
 * Paths are traced generation by generation: all camera rays of a batch, then all their children, and so on. A sample's
 * radiance is the sum of throughput × local radiance over its hits in the order of the batches: by generation, then by
 * parent, mirrored before transmitted. That order is the ray tree's own, so no grouping of rays can change the sum.
 */
#include "trace/tracer.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "math/elementary.h"
#include "trace/boundary.h"
#include "trace/sample.h"
#include "trace/shade.h"
#include "trace/shadow.h"

enum { CAMERA_RAYS_MAX = 1024 }; /* a batch */

struct tracer {
    const struct plan *plan;
    const struct kernel *kernel;
    struct medium_pool media;
    struct path_batch paths, children;
    struct hit_batch hits;
    struct boundary_batch boundaries;
    struct shading *shadings; /* of the paths that hit something, in their order */
    struct vec3 *local;       /* radiance that leaves each of those hits towards its path */
    uint32_t *shading_of;     /* of each path: index into shadings, or UINT32_MAX */
    size_t path_capacity;
    struct shadow_batch shadows;
    struct crossing_list crossings;
    uint8_t *blocked;
    struct vec3 *transmittance;
    size_t shadow_capacity;
    struct vec3 radiance[CAMERA_RAYS_MAX]; /* of each camera ray */
};

struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel)
{
    struct tracer *tracer = memory_array(1, sizeof *tracer);
    tracer->plan = plan;
    tracer->kernel = kernel;
    return tracer;
}

void tracer_destroy(struct tracer **pointer)
{
    struct tracer *tracer = *pointer;
    if (!tracer)
        return;
    medium_pool_finish(&tracer->media);
    path_batch_finish(&tracer->paths);
    path_batch_finish(&tracer->children);
    hit_batch_finish(&tracer->hits);
    boundary_batch_finish(&tracer->boundaries);
    shadow_batch_finish(&tracer->shadows);
    crossing_list_finish(&tracer->crossings);
    free(tracer->shadings);
    free(tracer->local);
    free(tracer->shading_of);
    free(tracer->blocked);
    free(tracer->transmittance);
    free(tracer);
    *pointer = NULL;
}

static void reserve_paths(struct tracer *tracer, size_t count)
{
    hit_batch_reserve(&tracer->hits, count);
    if (count <= tracer->path_capacity)
        return;
    tracer->shadings = memory_resize(tracer->shadings, count, sizeof *tracer->shadings);
    tracer->local = memory_resize(tracer->local, count, sizeof *tracer->local);
    tracer->shading_of = memory_resize(tracer->shading_of, count, sizeof *tracer->shading_of);
    tracer->path_capacity = count;
}

static void reserve_shadows(struct tracer *tracer, size_t count)
{
    if (count <= tracer->shadow_capacity)
        return;
    tracer->blocked = memory_resize(tracer->blocked, count, sizeof *tracer->blocked);
    tracer->transmittance = memory_resize(tracer->transmittance, count, sizeof *tracer->transmittance);
    tracer->shadow_capacity = count;
}

/* --- camera rays ------------------------------------------------------------------------------------------ */

/* The ray through image position (x, y) in pixels; its footprint is `share` of a pixel wide. */
static struct path camera_path(const struct plan *plan, double x, double y, double share)
{
    const struct plan_camera *camera = &plan->camera;
    struct vec3 v = vec3_add_scaled(vec3_add_scaled(camera->corner, camera->right, x), camera->down, y);
    struct vec3 d = vec3_normalize(v);
    struct path path = {
        .ray = {.direction = d, .t_max = INFINITY, .key_min = KEY_NONE, .from = PRIMITIVE_NONE},
        .throughput = {1, 1, 1},
    };
    if (plan->needs_footprints) {
        double scale = share / vec3_length(v);
        struct vec3 across = vec3_add_scaled(camera->right, d, -vec3_dot(camera->right, d));
        struct vec3 along = vec3_add_scaled(camera->down, d, -vec3_dot(camera->down, d));
        path.footprint.direction_x = vec3_scale(across, scale);
        path.footprint.direction_y = vec3_scale(along, scale);
    }
    return path;
}

static uint32_t camera_medium(struct tracer *tracer)
{
    uint32_t medium = MEDIUM_SPACE;
    for (size_t i = 0; i < tracer->plan->camera_media_count; i++)
        medium = medium_push(&tracer->media, medium, tracer->plan->camera_media[i]);
    return medium;
}

/* Camera rays first..first + count − 1 of a row, which are numbered pixel by pixel from x0. */
static void start_paths(struct tracer *tracer, uint32_t x0, uint32_t y, uint64_t first, size_t count)
{
    uint32_t samples = tracer->plan->settings.samples;
    double share = 1 / sqrt(samples);
    medium_pool_clear(&tracer->media);
    path_batch_clear(&tracer->paths);
    uint32_t medium = camera_medium(tracer);
    for (size_t i = 0; i < count; i++) {
        uint32_t x = x0 + (uint32_t)((first + i) / samples), index = (uint32_t)((first + i) % samples);
        struct sample_position at = sample_position(x, y, index, samples);
        struct path path = camera_path(tracer->plan, x + at.x, y + at.y, share);
        path.sample = (uint32_t)i;
        path.medium = medium;
        path_batch_push(&tracer->paths, &path);
        tracer->radiance[i] = vec3_make(0, 0, 0);
    }
}

/* --- one generation --------------------------------------------------------------------------------------- */

static struct vec3 background_radiance(const struct plan *plan, const struct path *path)
{
    const struct background *background = &plan->background;
    struct vec3 direction = path->ray.direction;
    switch (background->kind) {
    case BACKGROUND_CONSTANT:
        return background->color[0];
    case BACKGROUND_GRADIENT:
        return vec3_mix(background->color[0], background->color[1], 0.5 * (direction.y + 1));
    case BACKGROUND_IMAGE:
        return texture_surroundings(&plan->images[background->image], direction, path->footprint.direction_x,
                                    path->footprint.direction_y);
    }
    return background->color[0];
}

static void find_hits(struct tracer *tracer)
{
    const struct plan *plan = tracer->plan;
    reserve_paths(tracer, tracer->paths.rays.count);
    tracer->kernel->closest(plan, &tracer->paths.rays, &tracer->hits);
    boundary_batch_pass_start(&tracer->boundaries, plan, tracer->kernel, &tracer->media, &tracer->paths, &tracer->hits);
    if (plan->walls_may_touch)
        boundary_batch_find(&tracer->boundaries, plan, tracer->kernel, &tracer->paths.rays, &tracer->hits);
}

/* Shades every hit but for the lights, and collects the shadow rays. */
static void shade_hits(struct tracer *tracer)
{
    const struct plan *plan = tracer->plan;
    const struct crossing_list *walls = &tracer->boundaries.walls;
    uint32_t shadings = 0;
    size_t wall = 0;
    tracer->shadows.rays.count = 0;
    for (size_t i = 0; i < tracer->paths.rays.count; i++) {
        tracer->shading_of[i] = UINT32_MAX;
        if (hit_batch_id(&tracer->hits, i) == PRIMITIVE_NONE)
            continue;
        struct path path = path_batch_get(&tracer->paths, i);
        struct hit hit = hit_at(plan, &tracer->paths.rays, &tracer->hits, i);
        struct shading *shading = &tracer->shadings[shadings];
        shading_init(shading, plan, &tracer->media, &path, &hit);
        size_t wall_count = crossing_list_run(walls, wall, (uint32_t)i);
        if (wall_count > 0)
            shading_set_boundary(shading, &walls->items[wall], wall_count);
        wall += wall_count;
        tracer->local[shadings] = shading_ambient(plan, shading);
        shading_push_shadows(plan, shading, shadings, &tracer->shadows);
        tracer->shading_of[i] = shadings++;
    }
}

/* Adds each light's radiance to its hit, in the order of the lights. */
static void add_lights(struct tracer *tracer)
{
    struct shadow_batch *shadows = &tracer->shadows;
    reserve_shadows(tracer, shadows->rays.count);
    tracer->crossings.count = 0;
    tracer->kernel->shadow(tracer->plan, &shadows->rays, tracer->blocked, &tracer->crossings);
    shadow_transmittance(tracer->plan, &tracer->media, shadows, tracer->blocked, &tracer->crossings,
                         tracer->transmittance);
    for (size_t i = 0; i < shadows->rays.count; i++) {
        struct vec3 *local = &tracer->local[shadows->owner[i]];
        *local = vec3_add(*local, vec3_mul(shadows->radiance[i], tracer->transmittance[i]));
    }
}

/* Adds what every path found to its sample, in the order of the batch. */
static void gather(struct tracer *tracer)
{
    for (size_t i = 0; i < tracer->paths.rays.count; i++) {
        uint32_t index = tracer->shading_of[i];
        struct vec3 found;
        if (index == UINT32_MAX) {
            struct path path = path_batch_get(&tracer->paths, i);
            found = vec3_mul(path.throughput, background_radiance(tracer->plan, &path));
        } else {
            found = vec3_mul(tracer->shadings[index].path.throughput, tracer->local[index]);
        }
        struct vec3 *radiance = &tracer->radiance[tracer->paths.sample[i]];
        *radiance = vec3_add(*radiance, found);
    }
}

static void push_children(struct tracer *tracer)
{
    path_batch_clear(&tracer->children);
    for (size_t i = 0; i < tracer->paths.rays.count; i++) {
        uint32_t index = tracer->shading_of[i];
        if (index != UINT32_MAX)
            shading_push_children(tracer->plan, &tracer->shadings[index], &tracer->media, &tracer->children);
    }
}

/* Traces the paths that start_paths made, to the end. */
static void trace(struct tracer *tracer, struct ray_counts *counts)
{
    counts->camera += tracer->paths.rays.count;
    for (uint32_t generation = 0; tracer->paths.rays.count > 0; generation++) {
        if (generation > 0)
            counts->secondary += tracer->paths.rays.count;
        find_hits(tracer);
        shade_hits(tracer);
        counts->shadow += tracer->shadows.rays.count;
        add_lights(tracer);
        gather(tracer);
        if (generation == tracer->plan->depth)
            break;
        push_children(tracer);
        struct path_batch done = tracer->paths;
        tracer->paths = tracer->children;
        tracer->children = done;
    }
}

void tracer_row(struct tracer *tracer, uint32_t x0, uint32_t x1, uint32_t y, struct vec3 *pixels,
                struct ray_counts *counts)
{
    uint32_t samples = tracer->plan->settings.samples;
    uint64_t total = (uint64_t)(x1 - x0) * samples;
    for (uint32_t i = 0; i < x1 - x0; i++)
        pixels[i] = vec3_make(0, 0, 0);
    for (uint64_t first = 0; first < total; first += CAMERA_RAYS_MAX) {
        size_t count = total - first < CAMERA_RAYS_MAX ? (size_t)(total - first) : CAMERA_RAYS_MAX;
        start_paths(tracer, x0, y, first, count);
        trace(tracer, counts);
        for (size_t i = 0; i < count; i++) {
            struct vec3 *pixel = &pixels[(first + i) / samples];
            *pixel = vec3_add(*pixel, tracer->radiance[i]);
        }
    }
    for (uint32_t i = 0; i < x1 - x0; i++)
        pixels[i] = vec3_make(pixels[i].x / samples, pixels[i].y / samples, pixels[i].z / samples);
}
