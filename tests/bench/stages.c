/*
 * Where a render's time goes, stage by stage: stages WIDTH SCENE... renders each scene in this process, on one thread,
 * 4 samples a pixel, with every kernel.
 *
 * Of each scene it prints how fast rays find what they hit, without all that is done with it: rays that come from the
 * camera, those that surfaces send out, those to lights. Then, over all the scenes, what each stage takes an item.
 */
#include <stdio.h>

#include "tests/bench/bench.h"

enum { SAMPLES = 4, RUNS = 3, KERNELS_MAX = 8 };

/* As in struct kernel; `closest` is that of camera rays, and STAGE_CLOSEST_NEXT that of the generations after them. */
#define STAGES_EACH(DO)                                                                                          \
    DO(camera) DO(closest) DO(closest_next) DO(collect) DO(surface) DO(face) DO(pattern) DO(ambient) DO(light)           \
    DO(shadow_rays) DO(shadow) DO(add_light) DO(find) DO(refract) DO(mirror) DO(transmit)
#define STAGE_NAME(name) #name,
#define STAGE_NUMBER(name) STAGE_##name,
static const char *const stage_names[] = {STAGES_EACH(STAGE_NAME)};
enum stage {
    STAGES_EACH(STAGE_NUMBER) STAGES
};

struct stage_time {
    double seconds;
    size_t items; /* that the stage was called for: rays, surfaces, lights' surfaces, children */
};

/* The kernel that is timed, and what came of it. A kernel's calls take no context, so this is global. */
static struct {
    const struct kernel *kernel;
    bool is_first; /* generation of its batch */
    struct stage_time times[STAGES];
} timed;

/* --- a kernel that takes its time ------------------------------------------------------------------------- */

/* (That of the wall is read in a hundredth of the time that the thread's own takes.) */
static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void add_time(enum stage stage, double start, size_t items)
{
    timed.times[stage].seconds += now() - start;
    timed.times[stage].items += items;
}

static void timed_camera(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths)
{
    double start = now();
    timed.kernel->camera(plan, rays, paths);
    add_time(STAGE_camera, start, rays->count);
    timed.is_first = true;
}

static void timed_closest(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    double start = now();
    timed.kernel->closest(plan, rays, hits);
    add_time(timed.is_first ? STAGE_closest : STAGE_closest_next, start, rays->count);
    timed.is_first = false;
}

#define TIMED(name, items, parameters, arguments)                                                                \
    static void timed_##name parameters                                                                          \
    {                                                                                                            \
        double start = now();                                                                                    \
        timed.kernel->name arguments;                                                                            \
        add_time(STAGE_##name, start, items);                                                                    \
    }

TIMED(collect, surfaces->count,
      (const struct plan *plan, const struct path_batch *paths, const struct hit_batch *hits, struct surfaces *surfaces),
      (plan, paths, hits, surfaces))
TIMED(surface, surfaces->count, (const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces),
      (plan, paths, surfaces))
TIMED(face, surfaces->count, (struct surfaces *surfaces), (surfaces))
TIMED(pattern, surfaces->count, (const struct plan *plan, struct surfaces *surfaces), (plan, surfaces))
TIMED(ambient, surfaces->count, (const struct plan *plan, struct surfaces *surfaces), (plan, surfaces))
TIMED(light, surfaces->count,
      (const struct plan *plan, size_t light, const struct surfaces *surfaces, struct lighting *lighting),
      (plan, light, surfaces, lighting))
TIMED(shadow_rays, shadows->rays.count,
      (const struct surfaces *surfaces, const struct lighting *lighting, struct shadow_batch *shadows),
      (surfaces, lighting, shadows))
TIMED(shadow, rays->count,
      (const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked, struct crossing_list *crossings),
      (plan, rays, blocked, crossings))
TIMED(add_light, surfaces->count, (const struct lighting *lighting, struct surfaces *surfaces), (lighting, surfaces))
TIMED(find, paths->rays.count,
      (const struct plan *plan, const struct surfaces *surfaces, struct path_batch *paths), (plan, surfaces, paths))
TIMED(refract, transmitted->count,
      (const struct plan *plan, const struct surfaces *surfaces, struct transmitted *transmitted),
      (plan, surfaces, transmitted))
TIMED(mirror, mirrored->count,
      (const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
       const struct mirrored *mirrored, struct path_batch *children),
      (plan, paths, surfaces, mirrored, children))
TIMED(transmit, transmitted->count,
      (const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
       const struct transmitted *transmitted, struct path_batch *children),
      (plan, paths, surfaces, transmitted, children))

static const struct kernel kernel_timed = {
    .name = "timed",
    .camera = timed_camera,
    .closest = timed_closest,
    .collect = timed_collect,
    .surface = timed_surface,
    .face = timed_face,
    .pattern = timed_pattern,
    .ambient = timed_ambient,
    .light = timed_light,
    .shadow_rays = timed_shadow_rays,
    .shadow = timed_shadow,
    .add_light = timed_add_light,
    .find = timed_find,
    .refract = timed_refract,
    .mirror = timed_mirror,
    .transmit = timed_transmit,
};

/* --- one scene -------------------------------------------------------------------------------------------- */

/* All pixels, in tiles as workers take them; the seconds of it. */
static double render_tiles(const struct plan *plan)
{
    enum { TILE_WIDTH = 64, TILE_HEIGHT = 4 };
    struct tracer *tracer = tracer_create(plan, &kernel_timed);
    const struct sampling sampling = {SAMPLES, SAMPLES, 0};
    struct pixel *pixels = memory_array(TILE_WIDTH * TILE_HEIGHT, sizeof *pixels);
    struct ray_counts rows[TILE_HEIGHT] = {{0}};
    uint32_t width = plan->settings.width, height = plan->settings.height;
    double start = now();
    for (uint32_t y = 0; y < height; y += TILE_HEIGHT)
        for (uint32_t x = 0; x < width; x += TILE_WIDTH) {
            struct pixel_area area = {x, x + TILE_WIDTH < width ? x + TILE_WIDTH : width,
                                      y, y + TILE_HEIGHT < height ? y + TILE_HEIGHT : height};
            tracer_area(tracer, &sampling, &area, pixels, rows);
        }
    double seconds = now() - start;
    free(pixels);
    tracer_destroy(&tracer);
    return seconds;
}

/* The times of the fastest of several runs; how long it took in all. */
static double render_timed(const struct plan *plan, const struct kernel *kernel, struct stage_time times[STAGES])
{
    double least = INFINITY;
    timed.kernel = kernel;
    for (int run = 0; run < RUNS; run++) {
        memset(timed.times, 0, sizeof timed.times);
        double seconds = render_tiles(plan);
        if (seconds < least)
            memcpy(times, timed.times, sizeof timed.times);
        least = fmin(least, seconds);
    }
    return least;
}

static void print_rate(const struct stage_time *time)
{
    if (time->items > 0)
        printf(" %8.2f", 1e-6 * (double)time->items / time->seconds);
    else
        printf(" %8s", "");
}

static void print_scene(const char *name, const struct kernel *kernel, const struct stage_time times[STAGES],
                        double seconds)
{
    double camera = (double)times[STAGE_camera].items, traversal = 0, stages = 0;
    for (int stage = 0; stage < STAGES; stage++)
        stages += times[stage].seconds;
    traversal = times[STAGE_closest].seconds + times[STAGE_closest_next].seconds + times[STAGE_shadow].seconds;
    printf("%-36s %-7s", name, kernel->name);
    print_rate(&times[STAGE_closest]);
    print_rate(&times[STAGE_closest_next]);
    print_rate(&times[STAGE_shadow]);
    printf(" %8.1f %8.1f %8.1f\n", 1e9 * traversal / camera, 1e9 * (stages - traversal) / camera,
           1e9 * (seconds - stages) / camera);
    fflush(stdout);
}

/* Adds the scene's times to those of all. */
static void add_scene(const char *name, const struct scene *scene, struct stage_time all[KERNELS_MAX][STAGES])
{
    struct trace_settings settings = settings_of(scene);
    struct plan *plan = plan_create(scene, &settings, 1);
    for (size_t k = 0; kernel_at(k); k++) {
        struct stage_time times[STAGES] = {{0}};
        double seconds = render_timed(plan, kernel_at(k), times);
        print_scene(name, kernel_at(k), times, seconds);
        for (int stage = 0; stage < STAGES; stage++) {
            all[k][stage].seconds += times[stage].seconds;
            all[k][stage].items += times[stage].items;
        }
    }
    plan_destroy(&plan);
}

/* --- all -------------------------------------------------------------------------------------------------- */

static void print_stages(struct stage_time all[KERNELS_MAX][STAGES])
{
    printf("\nns an item, over all these scenes\n%-14s", "stage");
    for (size_t k = 0; kernel_at(k); k++)
        printf(" %8s", kernel_at(k)->name);
    printf("\n");
    for (int stage = 0; stage < STAGES; stage++) {
        printf("%-14s", stage_names[stage]);
        for (size_t k = 0; kernel_at(k); k++)
            printf(" %8.2f", 1e9 * all[k][stage].seconds / fmax(1, (double)all[k][stage].items));
        printf("\n");
    }
}

int main(int argc, char **argv)
{
    static struct stage_time all[KERNELS_MAX][STAGES];
    struct error error;
    uint32_t width = 0;
    enum status status = bench_width(argc, argv, "stages", &width, &error);
    if (status == STATUS_OK)
        printf("%d pixels wide, %d samples a pixel; million rays a second from the camera, from surfaces and to lights\n"
               "(finding hits alone), and ns a camera ray for finding hits, for the other stages and between them\n"
               "%-36s %-7s %8s %8s %8s %8s %8s %8s\n",
               (int)width, SAMPLES, "scene", "kernel", "camera", "surfaces", "lights", "hits", "stages", "between");
    for (int i = 2; i < argc && status == STATUS_OK; i++) {
        struct scene scene;
        status = bench_load(argv[i], width, SAMPLES, &scene, &error);
        if (status != STATUS_OK)
            break;
        add_scene(argv[i], &scene, all);
        scene_finish(&scene);
    }
    if (status == STATUS_OK)
        print_stages(all);
    else
        fprintf(stderr, "%s\n", error.text);
    return status;
}
