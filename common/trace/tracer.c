/*
 * Paths are traced generation by generation: all camera rays of a batch, then all their children, and so on. A sample's
 * radiance is the sum of throughput × local radiance over its hits in the order of the batches: by generation, mirrored
 * ones before transmitted ones, and each in the order of their parents. That order is the ray tree's own, so no grouping
 * of rays can change the sum.
 */
#include "trace/tracer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/generation.h"
#include "trace/sample.h"
#include "trace/texture.h"

enum { CAMERA_RAYS_MAX = 1024 }; /* a batch */

struct tracer {
    struct generation generation;
    struct lighting lighting;
    struct shadow_batch shadows;
    struct crossing_list crossings;
    struct sample_digits *digits; /* of each sample of a pixel */
    bool follows_footprints;      /* the next batch begins with them */
    /* Of each camera ray. */
    struct vec3 radiance[CAMERA_RAYS_MAX]; /* what has come of it */
    uint32_t secondary[CAMERA_RAYS_MAX], shadow[CAMERA_RAYS_MAX]; /* rays that it led to */
    _Alignas(64) double x[CAMERA_RAYS_MAX];
    double y[CAMERA_RAYS_MAX];
    uint32_t pixel_x[CAMERA_RAYS_MAX], pixel_y[CAMERA_RAYS_MAX];
    uint32_t digits_x[CAMERA_RAYS_MAX], digits_y[CAMERA_RAYS_MAX];
};

struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel)
{
    struct tracer *tracer = memory_aligned(1, sizeof *tracer, _Alignof(struct tracer));
    memset(tracer, 0, sizeof *tracer);
    tracer->generation.plan = plan;
    tracer->generation.kernel = kernel;
    tracer->digits = memory_array(plan->settings.samples, sizeof *tracer->digits);
    for (uint32_t i = 0; i < plan->settings.samples; i++)
        tracer->digits[i] = sample_digits(i);
    return tracer;
}

void tracer_destroy(struct tracer **pointer)
{
    struct tracer *tracer = *pointer;
    if (!tracer)
        return;
    generation_finish(&tracer->generation);
    lighting_finish(&tracer->lighting);
    shadow_batch_finish(&tracer->shadows);
    crossing_list_finish(&tracer->crossings);
    free(tracer->digits);
    free(tracer);
    *pointer = NULL;
}

/* --- camera rays ------------------------------------------------------------------------------------------ */

/* The next camera ray of an area. They are numbered pixel by pixel, down each column: so rays in a row stay near one
 * another in both directions. */
struct cursor {
    uint32_t x, row, sample;
};

static uint32_t camera_medium(struct generation *g)
{
    uint32_t medium = MEDIUM_SPACE;
    medium_pool_clear(&g->media);
    for (size_t i = 0; i < g->plan->camera_media_count; i++)
        medium = medium_push(&g->media, medium, g->plan->camera_media[i]);
    return medium;
}

/* Camera rays first .. first + count − 1 of the batch are the cursor's pixel's next samples. */
static void number_pixel(struct tracer *tracer, const struct pixel_area *area, const struct cursor *at, size_t first,
                         size_t count)
{
    const struct sample_digits *digits = tracer->digits + at->sample;
    for (size_t i = 0; i < count; i++) {
        tracer->pixel_x[first + i] = at->x;
        tracer->pixel_y[first + i] = area->y0 + at->row;
        tracer->digits_x[first + i] = digits[i].x;
        tracer->digits_y[first + i] = digits[i].y;
    }
}

/* Takes `count` camera rays from the cursor on, and moves it behind them. */
static void number_rays(struct tracer *tracer, const struct pixel_area *area, struct cursor *at, size_t count)
{
    uint32_t samples = tracer->generation.plan->settings.samples, rows = area->y1 - area->y0;
    for (size_t i = 0, taken; i < count; i += taken) {
        taken = samples - at->sample < count - i ? samples - at->sample : count - i;
        number_pixel(tracer, area, at, i, taken);
        at->sample += (uint32_t)taken;
        if (at->sample < samples)
            break;
        at->sample = 0;
        at->row = at->row + 1 < rows ? at->row + 1 : 0;
        at->x += at->row == 0;
    }
}

/* The paths of the camera rays that have been numbered. */
static void start_paths(struct tracer *tracer, size_t count)
{
    struct generation *g = &tracer->generation;
    struct camera_rays rays = {count, g->plan->settings.samples,
                               tracer->pixel_x, tracer->pixel_y, tracer->digits_x, tracer->digits_y,
                               tracer->x, tracer->y};
    uint32_t medium = camera_medium(g);
    path_batch_clear(&g->paths);
    g->paths.has_footprints = tracer->follows_footprints;
    g->kernel->camera(g->plan, &rays, &g->paths);
    for (uint32_t i = 0; i < count; i++) {
        g->paths.sample[i] = i;
        g->paths.medium[i] = medium;
    }
    memset(tracer->radiance, 0, count * sizeof *tracer->radiance);
    memset(tracer->secondary, 0, count * sizeof *tracer->secondary);
    memset(tracer->shadow, 0, count * sizeof *tracer->shadow);
}

/* --- light ------------------------------------------------------------------------------------------------ */

static void count_shadows(struct tracer *tracer)
{
    const struct generation *g = &tracer->generation;
    const uint32_t *surface = tracer->shadows.surface, *path = g->surfaces.path, *sample = g->paths.sample;
    for (size_t i = 0; i < tracer->shadows.rays.count; i++)
        tracer->shadow[sample[path[surface[i]]]]++;
}

/* Adds to each surface what comes of each light, in the order of the lights. */
static void add_lights(struct tracer *tracer)
{
    struct generation *g = &tracer->generation;
    struct shadow_batch *shadows = &tracer->shadows;
    for (size_t light = 0; light < g->plan->light_count; light++) {
        g->kernel->light(g->plan, light, &g->surfaces, &tracer->lighting);
        shadow_batch_collect(shadows, &tracer->lighting, g->surfaces.count);
        g->kernel->shadow_rays(&g->surfaces, &tracer->lighting, shadows);
        tracer->crossings.count = 0;
        g->kernel->shadow(g->plan, &shadows->rays, shadows->blocked, &tracer->crossings);
        shadow_batch_dim(shadows, g->plan, &g->media, &g->paths, &g->surfaces, &tracer->crossings,
                         &tracer->lighting);
        g->kernel->add_light(&tracer->lighting, &g->surfaces);
        count_shadows(tracer);
    }
}

/* --- sums ------------------------------------------------------------------------------------------------- */

/* Where paths go past everything, an image of the surroundings. */
static void look_around(const struct generation *g)
{
    const struct path_batch *paths = &g->paths;
    const struct plan_image *image = &g->plan->images[g->plan->background.image];
    for (size_t i = 0; i < paths->rays.count; i++) {
        if (g->surfaces.of_path[i] != SURFACE_NONE)
            continue;
        struct vec3 color = texture_surroundings(image, lane_get(paths->rays.direction, i),
                                                 lane_get(paths->footprint[2], i), lane_get(paths->footprint[3], i));
        lane_put(paths->found, i, vec3_mul(lane_get(paths->throughput, i), color));
    }
}

/* Adds what every path finds to its sample, in the order of the batch. */
static void gather(struct tracer *tracer)
{
    struct generation *g = &tracer->generation;
    g->kernel->find(g->plan, &g->surfaces, &g->paths);
    if (g->plan->background.kind == BACKGROUND_IMAGE)
        look_around(g);
    for (size_t i = 0; i < g->paths.rays.count; i++) {
        struct vec3 *radiance = &tracer->radiance[g->paths.sample[i]];
        *radiance = vec3_add(*radiance, lane_get(g->paths.found, i));
    }
}

static void count_secondary(struct tracer *tracer)
{
    const struct path_batch *paths = &tracer->generation.paths;
    for (size_t i = 0; i < paths->rays.count; i++)
        tracer->secondary[paths->sample[i]]++;
}

/* Traces the paths that start_paths made, to the end, or returns false where they lack the footprints that they turn out
 * to need. *used says whether any were needed. */
static bool trace(struct tracer *tracer, bool *used)
{
    struct generation *g = &tracer->generation;
    *used = false;
    for (uint32_t generation = 0; g->paths.rays.count > 0; generation++) {
        generation_find_hits(g);
        bool found = generation_find_surfaces(g);
        *used |= g->used_footprints;
        if (!found)
            return false;
        g->kernel->ambient(g->plan, &g->surfaces);
        add_lights(tracer);
        gather(tracer);
        if (generation == g->plan->depth)
            break;
        generation_find_children(g);
        generation_pass(g);
        count_secondary(tracer);
    }
    return true;
}

/* Footprints are followed only where textures are met, and then from the camera on: a batch that meets one without them
 * begins again, and the next ones begin with them for as long as textures are met. */
static void trace_batch(struct tracer *tracer, size_t count)
{
    bool used;
    start_paths(tracer, count);
    if (!trace(tracer, &used)) {
        tracer->follows_footprints = true;
        start_paths(tracer, count);
        trace(tracer, &used);
    }
    tracer->follows_footprints = used;
}

/* How many of the batch's camera rays from `first` on, of `count`, are of the same pixel. */
static size_t pixel_run(const struct tracer *tracer, size_t first, size_t count)
{
    uint32_t x = tracer->pixel_x[first], y = tracer->pixel_y[first];
    size_t end = first + 1;
    while (end < count && tracer->pixel_x[end] == x && tracer->pixel_y[end] == y)
        end++;
    return end - first;
}

/* Adds the batch's first `count` samples, and the rays that they took, to the pixels and rows of the area. */
static void add_samples(const struct tracer *tracer, const struct pixel_area *area, size_t count, struct vec3 *pixels,
                        struct ray_counts *counts)
{
    size_t width = area->x1 - area->x0;
    for (size_t first = 0, run; first < count; first += run) {
        size_t row = tracer->pixel_y[first] - area->y0, pixel = tracer->pixel_x[first] - area->x0 + row * width;
        struct vec3 sum = pixels[pixel];
        run = pixel_run(tracer, first, count);
        counts[row].camera += run;
        for (size_t i = first; i < first + run; i++) {
            sum = vec3_add(sum, tracer->radiance[i]);
            counts[row].secondary += tracer->secondary[i];
            counts[row].shadow += tracer->shadow[i];
        }
        pixels[pixel] = sum;
    }
}

void tracer_area(struct tracer *tracer, const struct pixel_area *area, struct vec3 *pixels, struct ray_counts *counts)
{
    uint32_t samples = tracer->generation.plan->settings.samples;
    size_t rows = area->y1 - area->y0, width = area->x1 - area->x0;
    uint64_t total = (uint64_t)width * rows * samples;
    struct cursor next = {.x = area->x0};
    for (size_t i = 0; i < width * rows; i++)
        pixels[i] = vec3_make(0, 0, 0);
    for (uint64_t first = 0; first < total; first += CAMERA_RAYS_MAX) {
        size_t count = total - first < CAMERA_RAYS_MAX ? (size_t)(total - first) : CAMERA_RAYS_MAX;
        number_rays(tracer, area, &next, count);
        trace_batch(tracer, count);
        add_samples(tracer, area, count, pixels, counts);
    }
    for (size_t i = 0; i < width * rows; i++)
        pixels[i] = vec3_make(pixels[i].x / samples, pixels[i].y / samples, pixels[i].z / samples);
}
