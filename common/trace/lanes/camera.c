/* Camera rays. */
#include "trace/lanes.h"
#include "trace/lanes/exports.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

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

/* How the direction, v normalised, changes along a step of v; each ray's share of the pixel is `share` wide. */
static inline struct vec3 direction_change(struct vec3 v, struct vec3 step, double share)
{
    struct vec3 d = vec3_normalize(v);
    return vec3_scale(vec3_add_scaled(step, d, -vec3_dot(step, d)), share / vec3_length(v));
}

void LANES_NAME(camera)(const struct plan *plan, const double *x, const double *y, size_t count,
                        struct path_batch *paths)
{
    path_batch_reserve(paths, count);
    paths->rays.count = count;
    const struct plan_camera camera = plan->camera;
    const struct path_batch to = *paths;
    double share = 1 / sqrt(plan->settings.samples);
    LANES_LOOP
    for (size_t i = 0; i < count; i++) {
        put_ray(&to.rays, i, vec3_normalize(through(&camera, x[i], y[i])));
        lane_put(to.throughput, i, vec3_make(1, 1, 1));
    }
    if (!plan->needs_footprints)
        return;
    LANES_LOOP
    for (size_t i = 0; i < count; i++) {
        struct vec3 v = through(&camera, x[i], y[i]);
        lane_put(to.footprint[0], i, vec3_make(0, 0, 0));
        lane_put(to.footprint[1], i, vec3_make(0, 0, 0));
        lane_put(to.footprint[2], i, direction_change(v, camera.right, share));
        lane_put(to.footprint[3], i, direction_change(v, camera.down, share));
    }
}
