/*
 * Lights: what arrives at a point if nothing is in the way.
 */
#ifndef WEFT_TRACE_LIGHT_H
#define WEFT_TRACE_LIGHT_H

#include <stdbool.h>

#include "trace/plan.h"

struct light_arrival {
    struct vec3 direction; /* unit, towards the light */
    double distance;       /* INFINITY for a directional light */
    struct vec3 strength;  /* light on a surface that faces it */
};

/* False if the light cannot reach the position at all: outside a spot's cone, or at the light itself. */
bool light_arrive(const struct plan_light *light, struct vec3 position, struct light_arrival *arrival);

/* The Phong surface's answer to light from `to_light`, seen against `direction`: unit vectors, normal on the
 * viewer's side. `color` is the surface's own colour there. Both terms are 0 if the light is behind it. */
struct vec3 light_phong(const struct plan_material *material, struct vec3 color, struct vec3 normal,
                        struct vec3 direction, struct vec3 to_light);

#endif
