/* What a light would add to surfaces if nothing stood between. */
#include "trace/depart.h"
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
#include "trace/light.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* Surface i under a light from there. */
static inline __attribute__((always_inline)) void put_light(const struct plan_material *material, const struct surface_lanes *s, size_t i,
                             struct light_arrival arrival, const struct lighting *to)
{
    struct vec3 shading = lane_get(s->shading_normal, i), seen = lane_get(s->direction, i), d = arrival.direction;
    struct vec3 radiance = vec3_add(light_diffuse(material, lane_get(s->color, i), shading, d),
                                    light_highlight(material, shading, seen, d));
    radiance = vec3_mul(radiance, arrival.strength);
    double before = vec3_dot(lane_get(s->facing, i), d); /* > 0: the light is on the path's side */
    double t_min = depart_t_min(lane_get(s->position, i), s->error[i], lane_get(s->normal, i), d);
    lane_put(to->direction, i, d);
    to->t_min[i] = t_min;
    to->t_max[i] = depart_t_max(t_min, arrival.distance);
    to->radiance[0][i] = before > 0 ? radiance.x : 0;
    to->radiance[1][i] = before > 0 ? radiance.y : 0;
    to->radiance[2][i] = before > 0 ? radiance.z : 0;
}

#define DEFINE_LIGHT(name, arrival)                                                                     \
    static void put_##name(const struct plan *plan, const struct plan_light *light,                     \
                           const struct surfaces *surfaces, const struct lighting *lighting)            \
    {                                                                                                   \
        const struct surface_lanes s = surfaces->lanes;                                                 \
        const struct lighting to = *lighting;                                                           \
        const struct plan_light copy = *light, *from = &copy;                                           \
        const struct plan_material *materials = plan->materials;                                        \
        const uint32_t *material = surfaces->material;                                                  \
        LANES_LOOP                                                                                      \
        for (size_t i = 0; i < surfaces->count; i++)                                                    \
            put_light(&materials[material[i]], &s, i, arrival, &to);                                    \
    }

DEFINE_LIGHT(point, light_from_point(from, lane_get(s.position, i)))
DEFINE_LIGHT(spot, light_from_spot(from, lane_get(s.position, i)))
DEFINE_LIGHT(directional, light_from_afar(from))

void LANES_NAME(light)(const struct plan *plan, size_t light, const struct surfaces *surfaces,
                       struct lighting *lighting)
{
    const struct plan_light *from = &plan->lights[light];
    lighting_reserve(lighting, surfaces->count);
    switch ((enum light_kind)from->kind) {
    case LIGHT_POINT:
        put_point(plan, from, surfaces, lighting);
        break;
    case LIGHT_SPOT:
        put_spot(plan, from, surfaces, lighting);
        break;
    case LIGHT_DIRECTIONAL:
        put_directional(plan, from, surfaces, lighting);
        break;
    }
}
