/* A Phong surface's whole answer to light, for one ray, by a branch. */
#ifndef WEFT_TESTS_PHONG_H
#define WEFT_TESTS_PHONG_H

#include "trace/light.h"

/* As light_diffuse and light_highlight say; `color` is the surface's own there. */
static inline struct vec3 phong(const struct plan_material *material, struct vec3 color, struct vec3 normal,
                                struct vec3 direction, struct vec3 to_light)
{
    struct vec3 diffuse = light_diffuse(material, vec3_mul(color, material->surface_share), normal, to_light);
    if (!(material->traits & TRAIT_HIGHLIGHTS))
        return diffuse;
    return vec3_add(diffuse, light_highlight(material, normal, direction, to_light));
}

#endif
