/*
 * Paths are traced generation by generation: all camera rays of a batch, then all their children, and so on. A sample's
 * radiance is the sum of throughput × local radiance over its hits in the order of the batches: by generation, mirrored
 * ones before transmitted ones, and each in the order of their parents. That order is the ray tree's own, so no
 * grouping of rays can change the sum.
 */
#include "trace/tracer_private.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/texture.h"

struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel)
{
    struct tracer *tracer = memory_aligned(1, sizeof *tracer, _Alignof(struct tracer));
    memset(tracer, 0, sizeof *tracer);
    tracer->generation.plan = plan;
    tracer->generation.kernel = kernel;
    tracer->refined = 1;
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
    free(tracer->work);
    free(tracer->list);
    free(tracer->scratch);
    for (int c = 0; c < 3; c++) {
        free(tracer->near[c]);
        free(tracer->wide[c]);
    }
    for (int i = 0; i < 6; i++)
        free(tracer->bound[i]);
    free(tracer);
    *pointer = NULL;
}

void tracer_count_batches(struct tracer *tracer, _Atomic uint64_t *batches)
{
    tracer->batches = batches;
}

static void need_pixels(struct tracer *tracer, size_t pixels)
{
    if (pixels <= tracer->pixel_capacity)
        return;
    tracer->work = memory_grow(tracer->work, &tracer->pixel_capacity, pixels, sizeof *tracer->work);
    tracer->list = memory_resize(tracer->list, tracer->pixel_capacity, sizeof *tracer->list);
    tracer->scratch = memory_resize(tracer->scratch, tracer->pixel_capacity, sizeof *tracer->scratch);
    for (int c = 0; c < 3; c++) {
        tracer->near[c] = memory_resize(tracer->near[c], tracer->pixel_capacity, sizeof *tracer->near[c]);
        tracer->wide[c] = memory_resize(tracer->wide[c], tracer->pixel_capacity, sizeof *tracer->wide[c]);
    }
    for (int i = 0; i < 6; i++)
        tracer->bound[i] = memory_resize(tracer->bound[i], tracer->pixel_capacity, sizeof *tracer->bound[i]);
}

void tracer_add_grid(struct tracer *tracer, struct pixel_grid *grid)
{
    size_t count = (size_t)grid->columns * grid->rows;
    grid->first = (uint32_t)tracer->pixels;
    need_pixels(tracer, tracer->pixels + count);
    struct pixel_work *work = tracer->work + tracer->pixels;
    memset(work, 0, count * sizeof *work);
    for (uint32_t column = 0; column < grid->columns; column++)
        for (uint32_t row = 0; row < grid->rows; row++, work++) {
            work->x = grid->x + column;
            work->y = grid->y + row;
        }
    tracer->pixels += count;
}

/* --- camera rays ------------------------------------------------------------------------------------------ */

static uint32_t camera_medium(struct generation *g)
{
    uint32_t medium = MEDIUM_SPACE;
    medium_pool_clear(&g->media);
    for (size_t i = 0; i < g->plan->camera_media_count; i++)
        medium = medium_push(&g->media, medium, g->plan->camera_media[i]);
    return medium;
}

/* So that samples 0 .. count − 1 have their digits. */
static void need_digits(struct tracer *tracer, uint32_t count)
{
    size_t known = tracer->digit_capacity;
    tracer->digits = memory_grow(tracer->digits, &tracer->digit_capacity, count, sizeof *tracer->digits);
    for (size_t i = known; i < tracer->digit_capacity; i++)
        tracer->digits[i] = sample_digits((uint32_t)i);
}

/* Camera rays first .. first + count − 1 of the batch are samples sample .. of that pixel. */
static void number_pixel(struct tracer *tracer, uint32_t pixel, uint32_t sample, size_t first, size_t count)
{
    const struct sample_digits *digits = tracer->digits + sample;
    uint32_t x = tracer->work[pixel].x, y = tracer->work[pixel].y;
    for (size_t i = 0; i < count; i++) {
        tracer->pixel[first + i] = pixel;
        tracer->pixel_x[first + i] = x;
        tracer->pixel_y[first + i] = y;
        tracer->digits_x[first + i] = digits[i].x;
        tracer->digits_y[first + i] = digits[i].y;
    }
}

/* The paths of the camera rays that have been numbered. */
static void start_paths(struct tracer *tracer, size_t count, uint32_t first, uint32_t end)
{
    struct generation *g = &tracer->generation;
    struct camera_rays rays = {count, end, tracer->salt,
                               sample_cells(first, end * tracer->refined, tracer->generation.plan->settings.filter),
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
        struct vec3 x = lane_get(paths->footprint[2], i), y = lane_get(paths->footprint[3], i);
        struct vec3 middle = lane_get(paths->rays.direction, i);
        middle = vec3_add_scaled(vec3_add_scaled(middle, x, paths->shift[0][i]), y, paths->shift[1][i]);
        struct vec3 color = texture_surroundings(image, middle, x, y);
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

/* Traces the paths that start_paths made, to the end, or returns false where they lack the footprints that they turn
 * out to need. *used says whether any were needed. */
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
static void trace_batch(struct tracer *tracer, size_t count, uint32_t first, uint32_t end)
{
    bool used;
    start_paths(tracer, count, first, end);
    if (!trace(tracer, &used)) {
        tracer->follows_footprints = true;
        start_paths(tracer, count, first, end);
        trace(tracer, &used);
    }
    tracer->follows_footprints = used;
}

/* --- pixels ----------------------------------------------------------------------------------------------- */

/* How many of the batch's camera rays from `first` on, of `count`, are of the same pixel. */
static size_t pixel_run(const struct tracer *tracer, size_t first, size_t count)
{
    size_t end = first + 1;
    while (end < count && tracer->pixel[end] == tracer->pixel[first])
        end++;
    return end - first;
}

static void add_roots(struct pixel_sums *sums, struct vec3 light)
{
    struct vec3 roots = sampling_roots(light);
    sums->roots = vec3_add(sums->roots, roots);
    sums->squares = vec3_add(sums->squares, vec3_mul(roots, roots));
}

/* Camera rays first .. end − 1 of the batch, which are one pixel's next. */
static void add_run(struct tracer *tracer, size_t first, size_t end, uint32_t half, bool roots)
{
    struct pixel_work *work = &tracer->work[tracer->pixel[first]];
    struct vec3 light = work->sums.light;
    for (size_t i = first; i < end; i++) {
        if (work->samples++ == half) {
            work->sums.half = light;
            work->sums.half_roots = work->sums.roots;
        }
        light = vec3_add(light, tracer->radiance[i]);
        if (roots)
            add_roots(&work->sums, tracer->radiance[i]);
        work->secondary += tracer->secondary[i];
        work->shadow += tracer->shadow[i];
    }
    work->sums.light = light;
    work->camera += (uint32_t)(end - first);
}

static void add_samples(struct tracer *tracer, size_t count, uint32_t half, bool roots)
{
    for (size_t first = 0, run; first < count; first += run) {
        run = pixel_run(tracer, first, count);
        add_run(tracer, first, first + run, half, roots);
    }
}

void tracer_sample(struct tracer *tracer, const uint32_t *list, size_t count, uint32_t first, uint32_t end, bool roots)
{
    uint32_t next = first; /* sample of pixel list[at] */
    if (count > 0)
        need_digits(tracer, end);
    for (size_t at = 0; at < count;) {
        size_t rays = 0;
        while (at < count && rays < CAMERA_RAYS_MAX) {
            size_t room = CAMERA_RAYS_MAX - rays, taken = end - next < room ? end - next : room;
            number_pixel(tracer, list[at], next, rays, taken);
            rays += taken;
            next += (uint32_t)taken;
            if (next == end) {
                next = first;
                at++;
            }
        }
        trace_batch(tracer, rays, first, end);
        if (tracer->batches)
            atomic_fetch_add_explicit(tracer->batches, 1, memory_order_relaxed);
        add_samples(tracer, rays, end / 2, roots);
    }
}
