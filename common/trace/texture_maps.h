/*
 * From a point of a surface to a point of an image, for each way to map one.
 *
 * For one ray and for lanes of rays: inline functions of doubles, without branches, as intersect.h says. The texture is
 * the same for a whole loop. They give the coordinates for one copy of the image across the map (map_repeated makes
 * more), and nothing for the change where it has no bound, as at a pole.
 */
#ifndef WEFT_TRACE_TEXTURE_MAPS_H
#define WEFT_TRACE_TEXTURE_MAPS_H

#include <math.h>

#include "math/elementary.h"
#include "trace/image_filter.h"
#include "trace/plan.h"
#include "trace/texture_patterns.h"

#define MAP_PI 3.14159265358979323846

/* The texture's three coordinates there. */
static inline struct texture_area map_coordinates(const struct plan_texture *texture, const struct texture_area *area)
{
    const struct texture_row *row = texture->row;
    struct mat3 gradients = {row[0].gradient, row[1].gradient, row[2].gradient};
    struct vec3 c = {row_value(&row[0], area->middle), row_value(&row[1], area->middle),
                     row_value(&row[2], area->middle)};
    return (struct texture_area){c, mat3_apply(&gradients, area->x), mat3_apply(&gradients, area->y)};
}

/* --- round maps ------------------------------------------------------------------------------------------- */

/* A coordinate of an image and its change along the footprint's edges. */
struct map_angle {
    double at, x, y;
};

/* u = 1/2 + atan2(x, z) / 2π: grows to the right, seen from +z. */
static inline struct map_angle map_turn(struct texture_area c)
{
    double x = c.middle.x, z = c.middle.z, square = x * x + z * z;
    double by_x = (z * c.x.x - x * c.x.z) / (2 * MAP_PI * square);
    double by_y = (z * c.y.x - x * c.y.z) / (2 * MAP_PI * square);
    return (struct map_angle){0.5 + math_atan2(x, z) / (2 * MAP_PI), square > 0 ? by_x : 0, square > 0 ? by_y : 0};
}

/* The change of the angle from +y as c moves by `step`, `radius` being that of c about the y axis. */
static inline double map_polar_change(struct vec3 c, double radius, struct vec3 step)
{
    double outwards = c.y * (c.x * step.x + c.z * step.z) / radius;
    double change = (outwards - radius * step.y) / (MAP_PI * vec3_dot(c, c));
    return radius > 0 ? change : 0;
}

/* v = angle from +y / π. */
static inline struct map_angle map_polar(struct texture_area c)
{
    double radius = sqrt(c.middle.x * c.middle.x + c.middle.z * c.middle.z);
    return (struct map_angle){math_atan2(radius, c.middle.y) / MAP_PI, map_polar_change(c.middle, radius, c.x),
                              map_polar_change(c.middle, radius, c.y)};
}

/* Of a direction from the middle and its changes. */
static inline struct image_point map_sphere_of(struct texture_area c)
{
    struct map_angle u = map_turn(c), v = map_polar(c);
    return (struct image_point){u.at, v.at, u.x, v.x, u.y, v.y};
}

static inline struct image_point map_sphere(const struct plan_texture *texture, const struct texture_area *area)
{
    return map_sphere_of(map_coordinates(texture, area));
}

static inline struct image_point map_cylinder(const struct plan_texture *texture, const struct texture_area *area)
{
    struct texture_area c = map_coordinates(texture, area);
    struct map_angle u = map_turn(c);
    return (struct image_point){u.at, c.middle.y, u.x, c.x.y, u.y, c.y.y};
}

/* --- flat maps -------------------------------------------------------------------------------------------- */

static inline struct image_point map_planar(const struct plan_texture *texture, const struct texture_area *area)
{
    struct texture_area c = map_coordinates(texture, area);
    return (struct image_point){c.middle.x, c.middle.y, c.x.x, c.x.y, c.y.x, c.y.y};
}

/* The face, as intersect.h numbers them, that a point looks out of, for coordinates 0..1 across the box. */
static inline double map_box_face(const struct plan_texture *texture, const struct texture_area *area)
{
    struct vec3 c = map_coordinates(texture, area).middle, q = vec3_sub(c, vec3_make(0.5, 0.5, 0.5));
    double x = fabs(q.x), y = fabs(q.y), z = fabs(q.z), most = y >= z ? y : z;
    double by_x = q.x > 0 ? 0 : 1, by_y = q.y > 0 ? 2 : 3, by_z = q.z > 0 ? 4 : 5;
    double other = y >= z ? by_y : by_z;
    return x >= most ? by_x : other;
}

/* u runs along z on the faces ±x, else along x; v along z on ±y, else along y. */
static inline double map_box_u(struct vec3 c, double face)
{
    return face < 2 ? c.z : c.x;
}

static inline double map_box_v(struct vec3 c, double face)
{
    return fabs(face - 2.5) < 1 ? c.z : c.y;
}

/* Upright seen from outside: on the faces ±x, z is across and y up; on ±y, x is across, seen with −z and +z up; on ±z,
 * x is across and y up. So u is reversed on the first and the last face, v on all but one. */
static inline struct image_point map_box(const struct plan_texture *texture, const struct texture_area *area,
                                         double face)
{
    struct texture_area c = map_coordinates(texture, area);
    double way_u = fabs(face - 2.5) > 2 ? -1 : 1, way_v = face == 2 ? 1 : -1;
    double start_u = 0.5 - 0.5 * way_u, start_v = 0.5 - 0.5 * way_v;
    return (struct image_point){
        .u = start_u + way_u * map_box_u(c.middle, face),
        .v = start_v + way_v * map_box_v(c.middle, face),
        .u_x = way_u * map_box_u(c.x, face),
        .v_x = way_v * map_box_v(c.x, face),
        .u_y = way_u * map_box_u(c.y, face),
        .v_y = way_v * map_box_v(c.y, face),
    };
}

/* The texture coordinates of a triangle's corners, in the order of the weights: u and v of each. */
struct corner_uv {
    struct vec3 u, v;
};

/* Weights of a triangle's corners, and their changes along the footprint, in the area's places. The mesh's v points up,
 * as in OBJ files. */
static inline struct image_point map_mesh(const struct corner_uv *corners, const struct texture_area *weights)
{
    return (struct image_point){
        .u = vec3_dot(weights->middle, corners->u),
        .v = 1 - vec3_dot(weights->middle, corners->v),
        .u_x = vec3_dot(weights->x, corners->u),
        .v_x = -vec3_dot(weights->x, corners->v),
        .u_y = vec3_dot(weights->y, corners->u),
        .v_y = -vec3_dot(weights->y, corners->v),
    };
}

/* --- repetition ------------------------------------------------------------------------------------------- */

static inline struct image_point map_repeated(const struct plan_texture *texture, struct image_point at)
{
    double u = texture->repeat_u, v = texture->repeat_v;
    return (struct image_point){at.u * u, at.v * v, at.u_x * u, at.v_x * v, at.u_y * u, at.v_y * v};
}

#endif
