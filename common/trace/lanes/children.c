/* The paths that go on from surfaces: mirrored, refracted, and straight on. */
#include "trace/depart.h"
#include "trace/lanes.h"
#include "trace/lanes/exports.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* What every kind of child has from its parent. */
static void inherit(const struct path_batch *paths, const struct surfaces *surfaces, const uint32_t *surface,
                    size_t count, const struct path_batch *children)
{
    const uint32_t *path = surfaces->path, *from_sample = paths->sample, *from_medium = paths->medium;
    uint32_t *sample = children->sample + children->rays.count, *medium = children->medium + children->rays.count;
    LANES_LOOP
    for (size_t i = 0; i < count; i++) {
        sample[i] = from_sample[path[surface[i]]];
        medium[i] = from_medium[path[surface[i]]];
    }
    for (int axis = 0; axis < 2 && paths->has_footprints; axis++) {
        const double *from = paths->shift[axis];
        double *to = children->shift[axis] + children->rays.count;
        LANES_LOOP
        for (size_t i = 0; i < count; i++)
            to[i] = from[path[surface[i]]];
    }
}

/* --- mirrored --------------------------------------------------------------------------------------------- */

/* `smooth`, here and below: whether shading normals may differ from the geometric ones. Where they do not, the same
 * comes of less work. */
static inline __attribute__((always_inline)) struct mirroring mirroring_at(const struct surface_lanes *s, size_t i,
                                                                           bool smooth)
{
    struct vec3 incoming = lane_get(s->direction, i), facing = lane_get(s->facing, i);
    if (smooth)
        return depart_mirrored(incoming, lane_get(s->shading_normal, i), facing);
    return (struct mirroring){optics_reflect(incoming, facing), facing};
}

/* Path `to` of the children, from surface i. */
static inline __attribute__((always_inline)) void put_mirrored(const struct surface_lanes *s, size_t i, bool smooth,
                                                               struct vec3 share, const struct path_batch *children,
                                                               size_t to)
{
    struct vec3 position = lane_get(s->position, i), direction = mirroring_at(s, i, smooth).direction;
    lane_put(children->rays.origin, to, position);
    lane_put(children->rays.direction, to, direction);
    children->rays.t_min[to] = depart_t_min(position, s->error[i], lane_get(s->normal, i), direction);
    children->rays.t_max[to] = INFINITY;
    children->rays.key_min[to] = LANE_KEY_NONE;
    children->rays.from[to] = s->id[i];
    children->rays.inward[to] = s->side[i] == SIDE_LEAVE ? 1 : 0; /* it stays inside */
    lane_put(children->throughput, to, vec3_mul(lane_get(s->throughput, i), share));
}

/* The formula is even in the normal together with its change, so the outward one serves. */
static inline __attribute__((always_inline)) void put_mirrored_footprint(const struct surface_lanes *s, size_t i,
                                                                         bool smooth, struct vec3 direction_x,
                                                                         struct vec3 direction_y,
                                                                         const struct path_batch *children, size_t to)
{
    struct vec3 incoming = lane_get(s->direction, i), normal = mirroring_at(s, i, smooth).normal;
    struct vec3 outward = vec3_scale(normal, s->side[i] == SIDE_LEAVE ? -1 : 1);
    lane_put(children->footprint[0], to, lane_get(s->spread[0], i));
    lane_put(children->footprint[1], to, lane_get(s->spread[1], i));
    lane_put(children->footprint[2], to,
             optics_reflect_change(incoming, outward, direction_x, lane_get(s->spread[2], i)));
    lane_put(children->footprint[3], to,
             optics_reflect_change(incoming, outward, direction_y, lane_get(s->spread[3], i)));
}

static inline __attribute__((always_inline)) void put_all_mirrored(bool smooth,
                                                                   const struct path_batch *paths,
                                                                   const struct surfaces *surfaces,
                                                                   const struct mirrored *mirrored,
                                                                   const struct path_batch *children)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct path_batch from = *paths, to = *children;
    const struct mirrored list = *mirrored;
    const uint32_t *surface = list.surface, *path = surfaces->path;
    size_t first = to.rays.count;
    LANES_LOOP
    for (size_t i = 0; i < list.count; i++)
        put_mirrored(&s, surface[i], smooth, lane_get(list.share, i), &to, first + i);
    if (!from.has_footprints)
        return;
    LANES_LOOP
    for (size_t i = 0; i < list.count; i++) {
        uint32_t parent = path[surface[i]];
        put_mirrored_footprint(&s, surface[i], smooth, lane_get(from.footprint[2], parent),
                               lane_get(from.footprint[3], parent), &to, first + i);
    }
}

void LANES_NAME(mirror)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                        const struct mirrored *mirrored, struct path_batch *children)
{
    path_batch_reserve(children, children->rays.count + mirrored->count);
    if (plan->is_smooth)
        put_all_mirrored(true, paths, surfaces, mirrored, children);
    else
        put_all_mirrored(false, paths, surfaces, mirrored, children);
    inherit(paths, surfaces, mirrored->surface, mirrored->count, children);
    children->rays.count += mirrored->count;
}

/* --- through a boundary ----------------------------------------------------------------------------------- */

/* How the path of surface i is refracted, and about which normal. */
static inline __attribute__((always_inline)) struct bending bending_at(const struct surface_lanes *s, size_t i,
                                                                       bool smooth, double ior_here,
                                                                       double ior_beyond)
{
    struct vec3 incoming = lane_get(s->direction, i), facing = lane_get(s->facing, i);
    if (smooth)
        return depart_refracted(incoming, lane_get(s->shading_normal, i), facing, ior_here, ior_beyond);
    return (struct bending){optics_refraction(incoming, facing, ior_here, ior_beyond), facing};
}

static inline __attribute__((always_inline)) void find_shares(const struct surfaces *surfaces, bool smooth,
                                                              const struct transmitted *transmitted)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct transmitted list = *transmitted;
    const uint32_t *surface = list.surface;
    LANES_LOOP
    for (size_t i = 0; i < list.count; i++) {
        struct bending bending = bending_at(&s, surface[i], smooth, list.ior_here[i], list.ior_beyond[i]);
        double mirrored = list.straight[i] != 0 ? 0 : bending.refraction.reflectance;
        list.reflectance[i] = mirrored;
        lane_put(list.share, i, vec3_scale(lane_get(list.share, i), 1 - mirrored));
    }
}

void LANES_NAME(refract)(const struct plan *plan, const struct surfaces *surfaces, struct transmitted *transmitted)
{
    if (plan->is_smooth)
        find_shares(surfaces, true, transmitted);
    else
        find_shares(surfaces, false, transmitted);
}

/* Path `to` of the children, refracted at surface i. It meets other surfaces that coincide with the boundary, so that
 * glass does not hide what lies on it; the boundary's own walls are passed by boundary_batch_pass_start. */
static inline __attribute__((always_inline)) void put_refracted(const struct surface_lanes *s, size_t i, bool smooth,
                                                                const struct transmitted *list, size_t at,
                                                                const struct path_batch *children, size_t to)
{
    struct bending bending = bending_at(s, i, smooth, list->ior_here[at], list->ior_beyond[at]);
    struct vec3 position = lane_get(s->position, i);
    struct vec3 direction = optics_refract(&bending.refraction, lane_get(s->direction, i), bending.normal);
    lane_put(children->rays.origin, to, position);
    lane_put(children->rays.direction, to, direction);
    children->rays.t_min[to] = -depart_t_min(position, s->error[i], lane_get(s->normal, i), direction);
    children->rays.t_max[to] = INFINITY;
    children->rays.key_min[to] = LANE_KEY_NONE;
    children->rays.from[to] = s->id[i];
    children->rays.inward[to] = s->side[i] == SIDE_LEAVE ? 0 : 1;
    lane_put(children->throughput, to, vec3_mul(lane_get(s->throughput, i), lane_get(list->share, at)));
}

static inline __attribute__((always_inline)) void put_refracted_footprint(
    const struct surface_lanes *s, size_t i, bool smooth, const struct transmitted *list, size_t at,
    struct vec3 direction_x, struct vec3 direction_y, const struct path_batch *children, size_t to)
{
    struct bending bending = bending_at(s, i, smooth, list->ior_here[at], list->ior_beyond[at]);
    struct vec3 incoming = lane_get(s->direction, i);
    double sign = s->side[i] == SIDE_LEAVE ? -1 : 1; /* from the outward normal to this side's */
    lane_put(children->footprint[0], to, lane_get(s->spread[0], i));
    lane_put(children->footprint[1], to, lane_get(s->spread[1], i));
    lane_put(children->footprint[2], to,
             optics_refract_change(&bending.refraction, incoming, bending.normal, direction_x,
                                   vec3_scale(lane_get(s->spread[2], i), sign)));
    lane_put(children->footprint[3], to,
             optics_refract_change(&bending.refraction, incoming, bending.normal, direction_y,
                                   vec3_scale(lane_get(s->spread[3], i), sign)));
}

static inline __attribute__((always_inline)) void put_all_refracted(bool smooth,
                                                                    const struct path_batch *paths,
                                                                    const struct surfaces *surfaces,
                                                                    const struct transmitted *transmitted,
                                                                    const struct path_batch *children)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct transmitted list = *transmitted;
    const struct path_batch from = *paths, to = *children;
    const uint32_t *surface = list.surface, *path = surfaces->path;
    size_t first = to.rays.count;
    LANES_LOOP
    for (size_t i = 0; i < list.count; i++)
        put_refracted(&s, surface[i], smooth, &list, i, &to, first + i);
    if (!from.has_footprints)
        return;
    LANES_LOOP
    for (size_t i = 0; i < list.count; i++) {
        uint32_t parent = path[surface[i]];
        put_refracted_footprint(&s, surface[i], smooth, &list, i, lane_get(from.footprint[2], parent),
                                lane_get(from.footprint[3], parent), &to, first + i);
    }
}

/* A path that goes straight on keeps its ray, whose next hit must only come after the last wall. */
static void put_straight(const struct transmitted *list, size_t at, const struct path_batch *paths, size_t path,
                         const struct path_batch *children, size_t to)
{
    lane_put(children->rays.origin, to, lane_get(paths->rays.origin, path));
    lane_put(children->rays.direction, to, lane_get(paths->rays.direction, path));
    children->rays.t_min[to] = list->t_last[at];
    children->rays.t_max[to] = paths->rays.t_max[path];
    children->rays.key_min[to] = list->key_last[at];
    children->rays.from[to] = paths->rays.from[path];
    children->rays.inward[to] = paths->rays.inward[path];
    for (int part = 0; part < 4 && paths->has_footprints; part++)
        lane_put(children->footprint[part], to, lane_get(paths->footprint[part], path));
}

void LANES_NAME(transmit)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                          const struct transmitted *list, struct path_batch *children)
{
    size_t first = children->rays.count;
    path_batch_reserve(children, first + list->count);
    if (plan->is_smooth)
        put_all_refracted(true, paths, surfaces, list, children);
    else
        put_all_refracted(false, paths, surfaces, list, children);
    inherit(paths, surfaces, list->surface, list->count, children);
    for (size_t i = 0; i < list->count; i++) {
        children->medium[first + i] = list->medium[i];
        if (list->straight[i] != 0)
            put_straight(list, i, paths, surfaces->path[list->surface[i]], children, first + i);
    }
    children->rays.count += list->count;
}
