#include "trace/light.h"

#include <math.h>

#include "math/elementary.h"

/* 0 outside the outer cone, 1 inside the inner one, smooth between. */
static double spot_share(const struct plan_light *light, struct vec3 to_light)
{
    double cosine = -vec3_dot(to_light, light->direction);
    if (cosine < light->outer_cosine)
        return 0;
    if (cosine >= light->inner_cosine)
        return 1;
    double s = (cosine - light->outer_cosine) / (light->inner_cosine - light->outer_cosine);
    return s * s * (3 - 2 * s);
}

bool light_arrive(const struct plan_light *light, struct vec3 position, struct light_arrival *arrival)
{
    if (light->kind == LIGHT_DIRECTIONAL) {
        *arrival = (struct light_arrival){vec3_neg(light->direction), INFINITY, light->color};
        return true;
    }
    struct vec3 offset = vec3_sub(light->position, position);
    if (vec3_is_zero(offset))
        return false;
    double distance = vec3_length(offset);
    arrival->direction = vec3_normalize(offset);
    arrival->distance = distance;
    double share = light->kind == LIGHT_SPOT ? spot_share(light, arrival->direction) : 1;
    double falloff = light->falloff[0] + distance * (light->falloff[1] + distance * light->falloff[2]);
    arrival->strength = vec3_scale(light->color, share / falloff);
    return share > 0;
}

struct vec3 light_phong(const struct plan_material *material, struct vec3 color, struct vec3 normal,
                        struct vec3 direction, struct vec3 to_light)
{
    double cosine = vec3_dot(normal, to_light);
    if (cosine <= 0)
        return vec3_make(0, 0, 0);
    struct vec3 diffuse = vec3_scale(vec3_mul(color, material->surface_share), material->diffuse * cosine);
    if (!material->highlights)
        return diffuse;
    struct vec3 mirrored = vec3_sub(vec3_scale(normal, 2 * cosine), to_light);
    double towards_eye = -vec3_dot(mirrored, direction);
    if (towards_eye <= 0)
        return diffuse;
    return vec3_add_scaled(diffuse, material->specular, math_pow(towards_eye, material->shininess));
}
