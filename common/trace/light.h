/*
 * Lights: what arrives at a point if nothing is in the way, and what a surface gives back of it.
 *
 * For one ray and for lanes of rays: inline functions of doubles, without branches, as intersect.h says. The kind of
 * light and whether a material has highlights are the same for a whole loop, so there is a function for each.
 */
#ifndef WEFT_TRACE_LIGHT_H
#define WEFT_TRACE_LIGHT_H

#include <math.h>
#include <stdbool.h>

#include "math/elementary.h"
#include "trace/plan.h"

struct light_arrival {
    struct vec3 direction; /* unit, towards the light */
    double distance;       /* INFINITY for a directional light */
    struct vec3 strength;  /* light on a surface that faces it; 0 where the light cannot reach */
};

/* --- arrival ---------------------------------------------------------------------------------------------- */

static inline struct light_arrival light_from_afar(const struct plan_light *light)
{
    return (struct light_arrival){vec3_neg(light->direction), INFINITY, light->color};
}

/* The way from a position to a light in space; at the light itself, of no length and upwards. */
static inline struct vec3_way light_way(const struct plan_light *light, struct vec3 position)
{
    struct vec3 offset = vec3_sub(light->position, position);
    double away = vec3_max_abs(offset);
    offset.y = away == 0 ? 1 : offset.y;
    struct vec3_way way = vec3_way(offset);
    way.length = away == 0 ? 0 : way.length;
    return way;
}

/* At the end of that way, with `share` of the light going there. */
static inline struct light_arrival light_fallen_off(const struct plan_light *light, struct vec3_way way, double share)
{
    double falloff = light->falloff[0] + way.length * (light->falloff[1] + way.length * light->falloff[2]);
    double left = share / falloff;
    left = share > 0 ? left : 0;
    left = way.length > 0 ? left : 0;
    return (struct light_arrival){way.direction, way.length, vec3_scale(light->color, left)};
}

static inline struct light_arrival light_from_point(const struct plan_light *light, struct vec3 position)
{
    return light_fallen_off(light, light_way(light, position), 1);
}

/* 0 outside the outer cone, 1 inside the inner one, smooth between. s says how far inside; where both cones are the
 * same, it is ±∞ or, right on them, NaN, which counts as inside. Choices by s, because by the cosine gcc 12 moves the
 * division into a branch and does not vectorise. */
static inline double light_spot_share(const struct plan_light *light, struct vec3 to_light)
{
    double cosine = -vec3_dot(to_light, light->direction);
    double s = (cosine - light->outer_cosine) / (light->inner_cosine - light->outer_cosine);
    s = s < 1 ? s : 1;
    s = s > 0 ? s : 0;
    return s * s * (3 - 2 * s);
}

static inline struct light_arrival light_from_spot(const struct plan_light *light, struct vec3 position)
{
    struct vec3_way way = light_way(light, position);
    return light_fallen_off(light, way, light_spot_share(light, way.direction));
}

/* For one ray: by a branch. False if none of the light can reach the position: outside a spot's cone, or at the light
 * itself. */
static inline bool light_arrive(const struct plan_light *light, struct vec3 position, struct light_arrival *arrival)
{
    *arrival = light->kind == LIGHT_DIRECTIONAL ? light_from_afar(light)
               : light->kind == LIGHT_SPOT      ? light_from_spot(light, position)
                                                : light_from_point(light, position);
    return !vec3_is_zero(arrival->strength);
}

/* --- Phong surfaces --------------------------------------------------------------------------------------- */

/* A surface's answers to light from `to_light`, seen against `direction`: unit vectors, normal on the viewer's side.
 * `own` is the surface's colour there times the material's surface_share. Both are 0 if the light is behind it. */
static inline struct vec3 light_diffuse(const struct plan_material *material, struct vec3 own, struct vec3 normal,
                                        struct vec3 to_light)
{
    double cosine = vec3_dot(normal, to_light);
    double lit = cosine > 0 ? cosine : 0;
    return vec3_scale(own, material->diffuse * lit);
}

static inline struct vec3 light_highlight(const struct plan_material *material, struct vec3 normal,
                                          struct vec3 direction, struct vec3 to_light)
{
    double cosine = vec3_dot(normal, to_light);
    struct vec3 mirrored = vec3_sub(vec3_scale(normal, 2 * cosine), to_light);
    double towards_eye = -vec3_dot(mirrored, direction);
    return vec3_scale(material->specular, math_pow_unit(cosine > 0 ? towards_eye : 0, material->shininess));
}

#endif
