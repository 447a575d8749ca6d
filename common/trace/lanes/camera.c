/* Camera rays. */
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
#include "trace/sample.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* Positions in the image, in pixels: at the pixels' centres. */
static void place_centres(const struct camera_rays *rays)
{
    const struct camera_rays of = *rays;
    LANES_LOOP
    for (size_t i = 0; i < of.count; i++) {
        of.x[i] = (int32_t)of.pixel_x[i] + 0.5;
        of.y[i] = (int32_t)of.pixel_y[i] + 0.5;
    }
}

/* The same, of several samples a pixel. The filter must be a constant where this is called. */
static inline __attribute__((always_inline)) void place_samples(const struct camera_rays *rays,
                                                                enum pixel_filter filter)
{
    const struct camera_rays of = *rays;
    LANES_LOOP
    for (size_t i = 0; i < of.count; i++) {
        struct sample_digits digits = {of.digits_x[i], of.digits_y[i]};
        struct sample_position share = sample_shares(of.pixel_x[i], of.pixel_y[i], digits, of.salt);
        of.x[i] = (int32_t)of.pixel_x[i] + sample_spread(share.x, filter);
        of.y[i] = (int32_t)of.pixel_y[i] + sample_spread(share.y, filter);
    }
}

static void place(const struct camera_rays *rays, enum pixel_filter filter)
{
    if (rays->samples == 1)
        place_centres(rays);
    else if (filter == FILTER_TENT)
        place_samples(rays, FILTER_TENT);
    else
        place_samples(rays, FILTER_BOX);
}

static inline void put_ray(const struct ray_batch *rays, size_t i, struct vec3 direction)
{
    lane_put(rays->origin, i, vec3_make(0, 0, 0));
    lane_put(rays->direction, i, direction);
    rays->t_min[i] = 0;
    rays->t_max[i] = INFINITY;
    rays->key_min[i] = LANE_KEY_NONE;
    rays->from[i] = LANE_FROM_NONE;
    rays->inward[i] = 0;
}

static inline struct vec3 through(const struct plan_camera *camera, double x, double y)
{
    return vec3_add_scaled(vec3_add_scaled(camera->corner, camera->right, x), camera->down, y);
}

/* How the direction, v normalised, changes along a step of v; `width` pixels of it. */
static inline struct vec3 direction_change(struct vec3 v, struct vec3 step, double width)
{
    struct vec3 d = vec3_normalize(v);
    return vec3_scale(vec3_add_scaled(step, d, -vec3_dot(step, d)), width / vec3_length(v));
}

static inline void put_footprint(const struct plan_camera *camera, const struct camera_rays *of, double width_x,
                                 double width_y, const struct path_batch *to, size_t i)
{
    struct vec3 v = through(camera, of->x[i], of->y[i]);
    lane_put(to->footprint[0], i, vec3_make(0, 0, 0));
    lane_put(to->footprint[1], i, vec3_make(0, 0, 0));
    lane_put(to->footprint[2], i, direction_change(v, camera->right, width_x));
    lane_put(to->footprint[3], i, direction_change(v, camera->down, width_y));
}

/* Samples that stand for no cell, but for what is around them. */
static void put_centred(const struct plan_camera *from, const struct camera_rays *rays, double width,
                        const struct path_batch *paths)
{
    const struct plan_camera camera = *from;
    const struct camera_rays of = *rays;
    const struct path_batch to = *paths;
    LANES_LOOP
    for (size_t i = 0; i < of.count; i++) {
        put_footprint(&camera, &of, width, width, &to, i);
        to.shift[0][i] = 0;
        to.shift[1][i] = 0;
    }
}

/* Samples that stand for cells. The filter must be a constant where this is called. */
static inline __attribute__((always_inline)) void put_cells(const struct plan_camera *from,
                                                            const struct camera_rays *rays,
                                                            const struct path_batch *paths,
                                                            enum pixel_filter filter)
{
    const struct plan_camera camera = *from;
    const struct camera_rays of = *rays;
    const struct path_batch to = *paths;
    const double across = of.cells.across, down = of.cells.down;
    LANES_LOOP
    for (size_t i = 0; i < of.count; i++) {
        struct sample_digits digits = {of.digits_x[i], of.digits_y[i]};
        struct sample_position share = sample_shares(of.pixel_x[i], of.pixel_y[i], digits, of.salt);
        struct sample_cell x = sample_cell(share.x, across, filter), y = sample_cell(share.y, down, filter);
        put_footprint(&camera, &of, x.width, y.width, &to, i);
        to.shift[0][i] = (x.middle - sample_spread(share.x, filter)) / x.width;
        to.shift[1][i] = (y.middle - sample_spread(share.y, filter)) / y.width;
    }
}

static void put_footprints(const struct plan *plan, const struct camera_rays *rays, const struct path_batch *paths)
{
    if (rays->cells.across == 0)
        put_centred(&plan->camera, rays, sample_width(rays->samples, plan->settings.filter), paths);
    else if (plan->settings.filter == FILTER_TENT)
        put_cells(&plan->camera, rays, paths, FILTER_TENT);
    else
        put_cells(&plan->camera, rays, paths, FILTER_BOX);
}

void LANES_NAME(camera)(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths)
{
    path_batch_reserve(paths, rays->count);
    paths->rays.count = rays->count;
    place(rays, plan->settings.filter);
    const struct plan_camera camera = plan->camera;
    const struct camera_rays of = *rays;
    const struct path_batch to = *paths;
    LANES_LOOP
    for (size_t i = 0; i < of.count; i++) {
        put_ray(&to.rays, i, vec3_normalize(through(&camera, of.x[i], of.y[i])));
        lane_put(to.throughput, i, vec3_make(1, 1, 1));
    }
    if (paths->has_footprints)
        put_footprints(plan, rays, paths);
}
