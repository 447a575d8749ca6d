/*
 * Paths are traced generation by generation: all camera rays of a batch, then all their children, and so on. A sample's
 * radiance is the sum of throughput × local radiance over its hits in the order of the batches: by generation, mirrored
 * ones before transmitted ones, and each in the order of their parents. That order is the ray tree's own, so no grouping
 * of rays can change the sum.
 */
#include "trace/tracer.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/boundary.h"
#include "trace/sample.h"
#include "trace/shade.h"
#include "trace/shadow.h"

enum { CAMERA_RAYS_MAX = 1024 }; /* a batch */

struct tracer {
    const struct plan *plan;
    const struct kernel *kernel;
    struct medium_pool media;
    struct path_batch paths, children, transmitted;
    struct hit_batch hits;
    struct boundary_batch boundaries;
    struct surfaces surfaces;
    struct lighting lighting;
    struct mirrored mirrored;
    struct shadow_batch shadows;
    struct crossing_list crossings;
    uint8_t *blocked;
    struct vec3 *transmittance;
    size_t shadow_capacity;
    /* Of each camera ray: what has come of it, its place in the image, in pixels, and its row in the area. */
    struct vec3 radiance[CAMERA_RAYS_MAX];
    _Alignas(64) double x[CAMERA_RAYS_MAX], y[CAMERA_RAYS_MAX];
    uint32_t row[CAMERA_RAYS_MAX];
};

struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel)
{
    struct tracer *tracer = memory_aligned(1, sizeof *tracer, _Alignof(struct tracer));
    *tracer = (struct tracer){0};
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
    path_batch_finish(&tracer->transmitted);
    hit_batch_finish(&tracer->hits);
    boundary_batch_finish(&tracer->boundaries);
    surfaces_finish(&tracer->surfaces);
    lighting_finish(&tracer->lighting);
    mirrored_finish(&tracer->mirrored);
    shadow_batch_finish(&tracer->shadows);
    crossing_list_finish(&tracer->crossings);
    free(tracer->blocked);
    free(tracer->transmittance);
    free(tracer);
    *pointer = NULL;
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

static uint32_t camera_medium(struct tracer *tracer)
{
    uint32_t medium = MEDIUM_SPACE;
    for (size_t i = 0; i < tracer->plan->camera_media_count; i++)
        medium = medium_push(&tracer->media, medium, tracer->plan->camera_media[i]);
    return medium;
}

/* Camera rays first .. first + count − 1 of an area, which are numbered pixel by pixel, down each column: so rays in a
 * row stay near one another in both directions. */
static void start_paths(struct tracer *tracer, const struct pixel_area *area, uint64_t first, size_t count)
{
    uint32_t samples = tracer->plan->settings.samples, rows = area->y1 - area->y0;
    medium_pool_clear(&tracer->media);
    path_batch_clear(&tracer->paths);
    for (size_t i = 0; i < count; i++) {
        uint64_t pixel = (first + i) / samples;
        uint32_t row = (uint32_t)(pixel % rows), x = area->x0 + (uint32_t)(pixel / rows), y = area->y0 + row;
        struct sample_position at = sample_position(x, y, (uint32_t)((first + i) % samples), samples);
        tracer->x[i] = x + at.x;
        tracer->y[i] = y + at.y;
        tracer->row[i] = row;
        tracer->radiance[i] = vec3_make(0, 0, 0);
    }
    tracer->kernel->camera(tracer->plan, tracer->x, tracer->y, count, &tracer->paths);
    uint32_t medium = camera_medium(tracer);
    for (uint32_t i = 0; i < count; i++) {
        tracer->paths.sample[i] = i;
        tracer->paths.medium[i] = medium;
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

static const struct plan_material *material_of(const struct tracer *tracer, size_t surface)
{
    return &tracer->plan->materials[tracer->surfaces.material[surface]];
}

static void find_hits(struct tracer *tracer)
{
    const struct plan *plan = tracer->plan;
    hit_batch_reserve(&tracer->hits, tracer->paths.rays.count);
    tracer->kernel->closest(plan, &tracer->paths.rays, &tracer->hits);
    boundary_batch_pass_start(&tracer->boundaries, plan, tracer->kernel, &tracer->media, &tracer->paths, &tracer->hits);
    if (plan->walls_may_touch)
        boundary_batch_find(&tracer->boundaries, plan, tracer->kernel, &tracer->paths.rays, &tracer->hits);
}

/* What media take from the paths on their way. */
static void absorb(struct tracer *tracer)
{
    const struct surfaces *surfaces = &tracer->surfaces;
    for (size_t i = 0; i < surfaces->count; i++) {
        if (tracer->paths.medium[surfaces->path[i]] == MEDIUM_SPACE)
            continue;
        struct path path = path_batch_get(&tracer->paths, surfaces->path[i]);
        struct vec3 left = shading_throughput(tracer->plan, &tracer->media, &path, surfaces->lanes.t[i]);
        lane_put(surfaces->lanes.throughput, i, left);
    }
}

/* The walls of a boundary are as far apart, on either side: the true places are within 3/2 windows of one another along
 * the ray; the rest is for rounding. */
static void widen_boundaries(struct tracer *tracer)
{
    const struct crossing_list *walls = &tracer->boundaries.walls;
    const struct surface_lanes *s = &tracer->surfaces.lanes;
    if (!tracer->plan->walls_may_touch)
        return;
    for (size_t first = 0, count; first < walls->count; first += count) {
        uint32_t ray = walls->items[first].ray, i = tracer->surfaces.of_path[ray];
        count = crossing_list_run(walls, first, ray);
        double cosine = fabs(vec3_dot(lane_get(s->direction, i), lane_get(s->normal, i)));
        s->error[i] += 2 * boundary_window(lane_get(tracer->paths.rays.origin, ray), s->t[i]) * cosine;
    }
}

/* Points, normals and colours of everything that was hit. */
static void find_surfaces(struct tracer *tracer)
{
    const struct plan *plan = tracer->plan;
    surfaces_collect(&tracer->surfaces, plan, &tracer->paths, &tracer->hits);
    tracer->kernel->surface(plan, &tracer->paths, &tracer->surfaces);
    surfaces_smooth(&tracer->surfaces, plan, &tracer->paths);
    tracer->kernel->face(&tracer->surfaces);
    surfaces_color(&tracer->surfaces, plan, &tracer->paths);
    tracer->kernel->pattern(plan, &tracer->surfaces);
    surfaces_mix_patterns(&tracer->surfaces, plan);
    absorb(tracer);
    widen_boundaries(tracer);
}

/* --- light ------------------------------------------------------------------------------------------------ */

static void add_ambient(struct tracer *tracer)
{
    const struct surface_lanes *s = &tracer->surfaces.lanes;
    for (size_t i = 0; i < tracer->surfaces.count; i++) {
        const struct plan_material *material = material_of(tracer, i);
        struct vec3 own = vec3_mul(lane_get(s->color, i), material->surface_share);
        lane_put(s->local, i, vec3_mul(vec3_scale(own, material->ambient), tracer->plan->ambient));
    }
}

/* A shadow ray for each surface that a light would add something to. */
static void push_shadows(struct tracer *tracer)
{
    const struct surfaces *surfaces = &tracer->surfaces;
    const struct lighting *lighting = &tracer->lighting;
    shadow_batch_reserve(&tracer->shadows, tracer->shadows.rays.count + surfaces->count);
    const struct shadow_batch to = tracer->shadows;
    size_t at = to.rays.count;
    for (uint32_t i = 0; i < surfaces->count; i++) {
        struct vec3 radiance = lane_get(lighting->radiance, i);
        if (vec3_is_zero(radiance))
            continue;
        lane_put(to.rays.origin, at, lane_get(surfaces->lanes.position, i));
        lane_put(to.rays.direction, at, lane_get(lighting->direction, i));
        to.rays.t_min[at] = lighting->t_min[i];
        to.rays.t_max[at] = lighting->t_max[i];
        to.rays.key_min[at] = LANE_KEY_NONE;
        to.rays.from[at] = surfaces->lanes.id[i];
        to.rays.inward[at] = surfaces->lanes.side[i] == SIDE_LEAVE;
        to.radiance[at] = radiance;
        to.owner[at] = i;
        to.medium[at++] = tracer->paths.medium[surfaces->path[i]];
    }
    tracer->shadows.rays.count = at;
}

/* Adds to each surface what comes of each light, in the order of the lights. */
static void add_lights(struct tracer *tracer)
{
    struct shadow_batch *shadows = &tracer->shadows;
    shadows->rays.count = 0;
    tracer->crossings.count = 0;
    for (size_t light = 0; light < tracer->plan->light_count; light++) {
        tracer->kernel->light(tracer->plan, light, &tracer->surfaces, &tracer->lighting);
        push_shadows(tracer);
    }
    reserve_shadows(tracer, shadows->rays.count);
    tracer->kernel->shadow(tracer->plan, &shadows->rays, tracer->blocked, &tracer->crossings);
    shadow_transmittance(tracer->plan, &tracer->media, shadows, tracer->blocked, &tracer->crossings,
                         tracer->transmittance);
    double *const *local = tracer->surfaces.lanes.local;
    for (size_t i = 0; i < shadows->rays.count; i++) {
        struct vec3 light = vec3_mul(shadows->radiance[i], tracer->transmittance[i]);
        lane_put(local, shadows->owner[i], vec3_add(lane_get(local, shadows->owner[i]), light));
    }
}

/* Adds what every path found to its sample, in the order of the batch. */
static void gather(struct tracer *tracer)
{
    const struct surface_lanes *s = &tracer->surfaces.lanes;
    for (size_t i = 0; i < tracer->paths.rays.count; i++) {
        uint32_t surface = tracer->surfaces.of_path[i];
        struct vec3 found;
        if (surface == SURFACE_NONE) {
            struct path path = path_batch_get(&tracer->paths, i);
            found = vec3_mul(path.throughput, background_radiance(tracer->plan, &path));
        } else {
            found = vec3_mul(lane_get(s->throughput, surface), lane_get(s->local, surface));
        }
        struct vec3 *radiance = &tracer->radiance[tracer->paths.sample[i]];
        *radiance = vec3_add(*radiance, found);
    }
}

/* --- the next generation ---------------------------------------------------------------------------------- */

/* Surface `i` as the scalar code of shade.h takes it. */
static struct shading shading_of(const struct tracer *tracer, uint32_t i)
{
    const struct surfaces *surfaces = &tracer->surfaces;
    uint32_t path = surfaces->path[i];
    struct shading shading = {
        .path = path_batch_get(&tracer->paths, path),
        .hit = surfaces_hit(surfaces, i),
        .material = material_of(tracer, i),
        .surface = surfaces_get(surfaces, i),
        .spread = surfaces_spread(surfaces, i),
        .normal = lane_get(surfaces->lanes.facing, i),
        .shading_normal = lane_get(surfaces->lanes.shading_normal, i),
        .needs_footprints = tracer->plan->needs_footprints,
    };
    shading.path.throughput = lane_get(surfaces->lanes.throughput, i);
    const struct crossing_list *walls = &tracer->boundaries.walls;
    if (tracer->plan->walls_may_touch && walls->count > 0) {
        size_t first = boundary_batch_first(&tracer->boundaries, path);
        shading.wall_count = crossing_list_run(walls, first, path);
        shading.walls = shading.wall_count ? &walls->items[first] : NULL;
    }
    return shading;
}

/* The mirrored paths, then the transmitted ones, each in the order of their parents. */
static void push_children(struct tracer *tracer)
{
    const struct plan *plan = tracer->plan;
    path_batch_clear(&tracer->children);
    tracer->mirrored.count = 0;
    path_batch_clear(&tracer->transmitted);
    for (size_t path = 0; path < tracer->paths.rays.count; path++) {
        uint32_t i = tracer->surfaces.of_path[path];
        if (i == SURFACE_NONE)
            continue;
        const struct plan_material *material = material_of(tracer, i);
        if (!material->mirrors && !material->transmits)
            continue;
        struct vec3 share = material->reflection;
        if (material->transmits) {
            struct shading shading = shading_of(tracer, i);
            share = shading_push_transmitted(plan, &shading, &tracer->media, &tracer->transmitted);
        }
        if (vec3_max(vec3_mul(lane_get(tracer->surfaces.lanes.throughput, i), share)) >= THROUGHPUT_MIN)
            mirrored_push(&tracer->mirrored, i, share);
    }
    tracer->kernel->mirror(plan, &tracer->paths, &tracer->surfaces, &tracer->mirrored, &tracer->children);
    path_batch_append(&tracer->children, &tracer->transmitted);
}

static void count_rays(struct tracer *tracer, uint32_t generation, struct ray_counts *counts)
{
    const struct path_batch *paths = &tracer->paths;
    for (size_t i = 0; i < paths->rays.count; i++) {
        struct ray_counts *of_row = &counts[tracer->row[paths->sample[i]]];
        of_row->camera += generation == 0;
        of_row->secondary += generation > 0;
    }
    for (size_t i = 0; i < tracer->shadows.rays.count; i++)
        counts[tracer->row[paths->sample[tracer->surfaces.path[tracer->shadows.owner[i]]]]].shadow++;
}

/* Traces the paths that start_paths made, to the end. */
static void trace(struct tracer *tracer, struct ray_counts *counts)
{
    for (uint32_t generation = 0; tracer->paths.rays.count > 0; generation++) {
        find_hits(tracer);
        find_surfaces(tracer);
        add_ambient(tracer);
        add_lights(tracer);
        count_rays(tracer, generation, counts);
        gather(tracer);
        if (generation == tracer->plan->depth)
            break;
        push_children(tracer);
        struct path_batch done = tracer->paths;
        tracer->paths = tracer->children;
        tracer->children = done;
    }
}

void tracer_area(struct tracer *tracer, const struct pixel_area *area, struct vec3 *pixels, struct ray_counts *counts)
{
    uint32_t samples = tracer->plan->settings.samples;
    size_t rows = area->y1 - area->y0, width = area->x1 - area->x0;
    uint64_t total = (uint64_t)width * rows * samples;
    for (size_t i = 0; i < width * rows; i++)
        pixels[i] = vec3_make(0, 0, 0);
    for (uint64_t first = 0; first < total; first += CAMERA_RAYS_MAX) {
        size_t count = total - first < CAMERA_RAYS_MAX ? (size_t)(total - first) : CAMERA_RAYS_MAX;
        start_paths(tracer, area, first, count);
        trace(tracer, counts);
        for (size_t i = 0; i < count; i++) {
            size_t pixel = (size_t)((first + i) / samples);
            struct vec3 *to = &pixels[pixel % rows * width + pixel / rows];
            *to = vec3_add(*to, tracer->radiance[i]);
        }
    }
    for (size_t i = 0; i < width * rows; i++)
        pixels[i] = vec3_make(pixels[i].x / samples, pixels[i].y / samples, pixels[i].z / samples);
}
