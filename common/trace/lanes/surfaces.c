/* Points, normals and footprints of the surfaces that were hit. */
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
#include "trace/surface_shapes.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* The loops below are over surfaces i of one kind, each on its own primitive. */
static inline void put_point(const struct surface_lanes *s, size_t i, double part, struct surface_point on)
{
    s->part[i] = part;
    lane_put(s->position, i, on.position);
    s->error[i] = on.error;
    lane_put(s->normal, i, on.normal);
    lane_put(s->shading_normal, i, on.normal);
}

#define DEFINE_POINTS(name, type, array, part_of, point)                                                     \
    static void find_##name##_points(const struct plan *plan, const struct path_batch *paths,                \
                                     const struct surfaces *surfaces, size_t first, size_t end)              \
    {                                                                                                        \
        const struct surface_lanes s = surfaces->lanes;                                                      \
        const uint32_t *path = surfaces->path, *index = surfaces->index;                                     \
        const struct type *all = array;                                                                      \
        (void)plan;                                                                                          \
        LANES_LOOP                                                                                           \
        for (size_t i = first; i < end; i++) {                                                               \
            const struct type *primitive = &all[index[i]];                                                   \
            struct vec3 o = lane_get(paths->rays.origin, path[i]), d = lane_get(s.direction, i);             \
            struct vec3 near = surface_near(o, d, s.t[i], s.side[i], s.leave_share[i]);                      \
            double part = part_of, extent = s.extent[i];                                                     \
            struct surface_point on = point;                                                                 \
            (void)extent;                                                                                    \
            put_point(&s, i, part, on);                                                                      \
        }                                                                                                    \
    }

DEFINE_POINTS(sphere, sphere, plan->spheres, 0, sphere_surface(primitive, near, extent))
DEFINE_POINTS(globe, globe, plan->globes, 0, globe_surface(primitive, near, extent))
DEFINE_POINTS(ellipsoid, ellipsoid, plan->ellipsoids, 0, ellipsoid_surface(primitive, near, extent))
DEFINE_POINTS(plane, plane, plan->planes, 0, plane_surface(primitive, near, extent))
DEFINE_POINTS(disc, disc, plan->discs, 0, plane_surface(&primitive->plane, near, extent))
DEFINE_POINTS(frustum, frustum, plan->frustums,
              s.part[i] != 0 ? PART_SIDE : frustum_capped_part(primitive, o, d, s.side[i]),
              frustum_surface(primitive, near, part, extent))
DEFINE_POINTS(box, box, plan->boxes, box_part(primitive, o, d, s.side[i]), box_surface(primitive, near, part, extent))
DEFINE_POINTS(triangle, triangle, plan->triangles, 0, triangle_surface(primitive, near))
DEFINE_POINTS(instance, triangle, surfaces->placed, 0, triangle_surface(primitive, near))

/* Gathering a truth value does not vectorise. */
static void mark_open_frustums(const struct plan *plan, const struct surfaces *surfaces)
{
    for (size_t i = surfaces->first[PRIMITIVE_FRUSTUM]; i < surfaces->first[PRIMITIVE_FRUSTUM + 1]; i++)
        surfaces->lanes.part[i] = plan->frustums[surfaces->index[i]].open;
}

/* --- footprints ------------------------------------------------------------------------------------------- */

/* The change of the normal is 0 on what is flat. */
#define DEFINE_SPREADS(name, type, array, change_x, change_y)                                                \
    static void find_##name##_spreads(const struct plan *plan, const struct path_batch *paths,               \
                                      const struct surfaces *surfaces, size_t first, size_t end)             \
    {                                                                                                        \
        const struct surface_lanes s = surfaces->lanes;                                                      \
        const uint32_t *path = surfaces->path, *index = surfaces->index;                                     \
        const struct type *all = array;                                                                      \
        (void)plan;                                                                                          \
        LANES_LOOP                                                                                           \
        for (size_t i = first; i < end; i++) {                                                               \
            const struct type *primitive = &all[index[i]];                                                   \
            struct vec3 d = lane_get(s.direction, i), n = lane_get(s.normal, i), p = lane_get(s.position, i); \
            struct vec3 x = surface_transfer(d, s.t[i], n, lane_get(paths->footprint[0], path[i]),           \
                                             lane_get(paths->footprint[2], path[i]));                        \
            struct vec3 y = surface_transfer(d, s.t[i], n, lane_get(paths->footprint[1], path[i]),           \
                                             lane_get(paths->footprint[3], path[i]));                        \
            double along_x = paths->shift[0][path[i]], along_y = paths->shift[1][path[i]];                   \
            lane_put(s.middle, i, vec3_add_scaled(vec3_add_scaled(p, x, along_x), y, along_y));              \
            lane_put(s.spread[0], i, x);                                                                     \
            lane_put(s.spread[1], i, y);                                                                     \
            lane_put(s.spread[2], i, change_x);                                                              \
            lane_put(s.spread[3], i, change_y);                                                              \
            (void)primitive, (void)p;                                                                        \
        }                                                                                                    \
    }

#define FLAT vec3_make(0, 0, 0)
DEFINE_SPREADS(sphere, sphere, plan->spheres, sphere_normal_change(primitive, p, n, x),
               sphere_normal_change(primitive, p, n, y))
DEFINE_SPREADS(globe, globe, plan->globes, sphere_normal_change(&primitive->sphere, p, n, x),
               sphere_normal_change(&primitive->sphere, p, n, y))
DEFINE_SPREADS(ellipsoid, ellipsoid, plan->ellipsoids, ellipsoid_normal_change(primitive, p, n, x),
               ellipsoid_normal_change(primitive, p, n, y))
DEFINE_SPREADS(plane, plane, plan->planes, FLAT, FLAT)
DEFINE_SPREADS(disc, disc, plan->discs, FLAT, FLAT)
DEFINE_SPREADS(frustum, frustum, plan->frustums, frustum_normal_change(primitive, p, s.part[i], n, x),
               frustum_normal_change(primitive, p, s.part[i], n, y))
DEFINE_SPREADS(box, box, plan->boxes, FLAT, FLAT)
DEFINE_SPREADS(triangle, triangle, plan->triangles, FLAT, FLAT)
DEFINE_SPREADS(instance, triangle, surfaces->placed, FLAT, FLAT)

/* --- all kinds -------------------------------------------------------------------------------------------- */

typedef void find(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                  size_t first, size_t end);

static find *const find_points[PRIMITIVE_KINDS] = {
    [PRIMITIVE_SPHERE] = find_sphere_points, [PRIMITIVE_GLOBE] = find_globe_points,
    [PRIMITIVE_ELLIPSOID] = find_ellipsoid_points,
    [PRIMITIVE_PLANE] = find_plane_points, [PRIMITIVE_DISC] = find_disc_points,
    [PRIMITIVE_FRUSTUM] = find_frustum_points, [PRIMITIVE_BOX] = find_box_points,
    [PRIMITIVE_TRIANGLE] = find_triangle_points, [PRIMITIVE_INSTANCE] = find_instance_points,
};

static find *const find_spreads[PRIMITIVE_KINDS] = {
    [PRIMITIVE_SPHERE] = find_sphere_spreads, [PRIMITIVE_GLOBE] = find_globe_spreads,
    [PRIMITIVE_ELLIPSOID] = find_ellipsoid_spreads,
    [PRIMITIVE_PLANE] = find_plane_spreads, [PRIMITIVE_DISC] = find_disc_spreads,
    [PRIMITIVE_FRUSTUM] = find_frustum_spreads, [PRIMITIVE_BOX] = find_box_spreads,
    [PRIMITIVE_TRIANGLE] = find_triangle_spreads, [PRIMITIVE_INSTANCE] = find_instance_spreads,
};

void LANES_NAME(surface)(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces)
{
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++) {
        size_t first = surfaces->first[kind], end = surfaces->first[kind + 1];
        if (first == end)
            continue;
        if (kind == PRIMITIVE_FRUSTUM)
            mark_open_frustums(plan, surfaces);
        find_points[kind](plan, paths, surfaces, first, end);
        if (paths->has_footprints)
            find_spreads[kind](plan, paths, surfaces, first, end);
    }
}

/* Turns normals to the side that each path comes from. */
void LANES_NAME(face)(struct surfaces *surfaces)
{
    const struct surface_lanes s = surfaces->lanes;
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++) {
        double sign = s.side[i] == SIDE_LEAVE ? -1 : 1;
        struct vec3 facing = vec3_scale(lane_get(s.normal, i), sign);
        struct vec3 shading = vec3_scale(lane_get(s.shading_normal, i), sign);
        double away = vec3_dot(shading, lane_get(s.direction, i));
        lane_put(s.facing, i, facing);
        s.shading_normal[0][i] = away > 0 ? facing.x : shading.x;
        s.shading_normal[1][i] = away > 0 ? facing.y : shading.y;
        s.shading_normal[2][i] = away > 0 ? facing.z : shading.z;
    }
}
