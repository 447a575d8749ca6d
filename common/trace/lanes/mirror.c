/* Paths that surfaces mirror. */
#include "trace/depart.h"
#include "trace/lanes.h"
#include "trace/lanes/exports.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* Path `to` of the children, from surface i. */
static inline void put_path(const struct surface_lanes *s, size_t i, struct vec3 share, const struct path_batch *children,
                            size_t to)
{
    struct vec3 position = lane_get(s->position, i), normal = lane_get(s->normal, i);
    struct mirroring mirroring = depart_mirrored(lane_get(s->direction, i), lane_get(s->shading_normal, i),
                                                 lane_get(s->facing, i));
    lane_put(children->rays.origin, to, position);
    lane_put(children->rays.direction, to, mirroring.direction);
    children->rays.t_min[to] = depart_t_min(position, s->error[i], normal, mirroring.direction);
    children->rays.t_max[to] = INFINITY;
    children->rays.key_min[to] = LANE_KEY_NONE;
    children->rays.from[to] = s->id[i];
    children->rays.inward[to] = s->side[i] == SIDE_LEAVE ? 1 : 0; /* it stays inside */
    lane_put(children->throughput, to, vec3_mul(lane_get(s->throughput, i), share));
}

/* The formula is even in the normal together with its change, so the outward one serves. */
static inline void put_footprint(const struct surface_lanes *s, size_t i, struct vec3 direction_x,
                                 struct vec3 direction_y, const struct path_batch *children, size_t to)
{
    struct vec3 incoming = lane_get(s->direction, i);
    struct vec3 normal = depart_mirrored(incoming, lane_get(s->shading_normal, i), lane_get(s->facing, i)).normal;
    struct vec3 outward = vec3_scale(normal, s->side[i] == SIDE_LEAVE ? -1 : 1);
    lane_put(children->footprint[0], to, lane_get(s->spread[0], i));
    lane_put(children->footprint[1], to, lane_get(s->spread[1], i));
    lane_put(children->footprint[2], to,
             optics_reflect_change(incoming, outward, direction_x, lane_get(s->spread[2], i)));
    lane_put(children->footprint[3], to,
             optics_reflect_change(incoming, outward, direction_y, lane_get(s->spread[3], i)));
}

void LANES_NAME(mirror)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                        const struct mirrored *mirrored, struct path_batch *children)
{
    size_t first = children->rays.count;
    path_batch_reserve(children, first + mirrored->count);
    const struct surface_lanes s = surfaces->lanes;
    const struct path_batch to = *children;
    const uint32_t *surface = mirrored->surface, *path = surfaces->path;
    LANES_LOOP
    for (size_t i = 0; i < mirrored->count; i++)
        put_path(&s, surface[i], lane_get(mirrored->share, i), &to, first + i);
    if (plan->needs_footprints)
        LANES_LOOP
        for (size_t i = 0; i < mirrored->count; i++) {
            uint32_t from = path[surface[i]];
            put_footprint(&s, surface[i], lane_get(paths->footprint[2], from), lane_get(paths->footprint[3], from), &to,
                          first + i);
        }
    for (size_t i = 0; i < mirrored->count; i++) {
        children->sample[first + i] = paths->sample[path[surface[i]]];
        children->medium[first + i] = paths->medium[path[surface[i]]];
    }
    children->rays.count += mirrored->count;
}
