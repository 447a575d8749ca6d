/* The light that surfaces give back: of what is all around, and of each light if nothing stood between. */
#include "trace/depart.h"
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
#include "trace/light.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* --- all around ------------------------------------------------------------------------------------------- */

void LANES_NAME(ambient)(const struct plan *plan, struct surfaces *surfaces)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct plan_material *materials = plan->materials;
    const uint32_t *material = surfaces->material;
    const struct vec3 ambient = plan->ambient;
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++) {
        const struct plan_material *of = &materials[material[i]];
        struct vec3 own = vec3_mul(lane_get(s.color, i), of->surface_share);
        lane_put(s.own, i, own);
        lane_put(s.local, i, vec3_mul(vec3_scale(own, of->ambient), ambient));
    }
}

/* --- one light -------------------------------------------------------------------------------------------- */

/* Surface i under a light from there. glossy: some of the surfaces have highlights; where none has, the same comes of
 * less work. */
static inline __attribute__((always_inline)) void put_light(const struct plan_material *material,
                                                            const struct surface_lanes *s, size_t i, bool glossy,
                                                            struct light_arrival arrival, const struct lighting *to)
{
    struct vec3 shading = lane_get(s->shading_normal, i), seen = lane_get(s->direction, i), d = arrival.direction;
    struct vec3 radiance = light_diffuse(material, lane_get(s->own, i), shading, d);
    if (glossy)
        radiance = vec3_add(radiance, light_highlight(material, shading, seen, d));
    radiance = vec3_mul(radiance, arrival.strength);
    double before = vec3_dot(lane_get(s->facing, i), d); /* > 0: the light is on the path's side */
    double t_min = depart_t_min(lane_get(s->position, i), s->error[i], lane_get(s->normal, i), d);
    double lit = vec3_max(radiance);
    lane_put(to->direction, i, d);
    to->t_min[i] = t_min;
    to->t_max[i] = depart_t_max(t_min, arrival.distance);
    to->radiance[0][i] = before > 0 ? radiance.x : 0;
    to->radiance[1][i] = before > 0 ? radiance.y : 0;
    to->radiance[2][i] = before > 0 ? radiance.z : 0;
    lit = lit > 0 ? 1 : 0;
    to->lit[i] = before > 0 ? lit : 0;
}

#define DEFINE_LIGHT(name, glossy, arrival)                                                             \
    static void light_##name(const struct plan *plan, const struct plan_light *light,                   \
                             const struct surfaces *surfaces, const struct lighting *lighting)          \
    {                                                                                                   \
        const struct surface_lanes s = surfaces->lanes;                                                 \
        const struct lighting to = *lighting;                                                           \
        const struct plan_light copy = *light, *from = &copy;                                           \
        const struct plan_material *materials = plan->materials;                                        \
        const uint32_t *material = surfaces->material;                                                  \
        LANES_LOOP                                                                                      \
        for (size_t i = 0; i < surfaces->count; i++)                                                    \
            put_light(&materials[material[i]], &s, i, glossy, arrival, &to);                            \
    }

DEFINE_LIGHT(point_matte, false, light_from_point(from, lane_get(s.position, i)))
DEFINE_LIGHT(point_glossy, true, light_from_point(from, lane_get(s.position, i)))
DEFINE_LIGHT(spot_matte, false, light_from_spot(from, lane_get(s.position, i)))
DEFINE_LIGHT(spot_glossy, true, light_from_spot(from, lane_get(s.position, i)))
DEFINE_LIGHT(directional_matte, false, light_from_afar(from))
DEFINE_LIGHT(directional_glossy, true, light_from_afar(from))

void LANES_NAME(light)(const struct plan *plan, size_t light, const struct surfaces *surfaces,
                       struct lighting *lighting)
{
    typedef void add(const struct plan *plan, const struct plan_light *light, const struct surfaces *surfaces,
                     const struct lighting *lighting);
    static add *const matte[] = {[LIGHT_POINT] = light_point_matte, [LIGHT_SPOT] = light_spot_matte,
                                 [LIGHT_DIRECTIONAL] = light_directional_matte};
    static add *const glossy[] = {[LIGHT_POINT] = light_point_glossy, [LIGHT_SPOT] = light_spot_glossy,
                                  [LIGHT_DIRECTIONAL] = light_directional_glossy};
    const struct plan_light *from = &plan->lights[light];
    lighting_reserve(lighting, surfaces->count);
    (surfaces->traits & TRAIT_HIGHLIGHTS ? glossy : matte)[from->kind](plan, from, surfaces, lighting);
}

void LANES_NAME(shadow_rays)(const struct surfaces *surfaces, const struct lighting *lighting,
                             struct shadow_batch *shadows)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct lighting from = *lighting;
    const struct ray_batch to = shadows->rays;
    const uint32_t *surface = shadows->surface;
    LANES_LOOP
    for (size_t i = 0; i < to.count; i++) {
        lane_put(to.origin, i, lane_get(s.position, surface[i]));
        lane_put(to.direction, i, lane_get(from.direction, surface[i]));
        to.t_min[i] = from.t_min[surface[i]];
        to.t_max[i] = from.t_max[surface[i]];
        to.key_min[i] = LANE_KEY_NONE;
        to.from[i] = s.id[surface[i]];
        to.inward[i] = s.side[surface[i]] == SIDE_LEAVE ? 1 : 0;
    }
}

/* --- sums ------------------------------------------------------------------------------------------------- */

void LANES_NAME(add_light)(const struct lighting *lighting, struct surfaces *surfaces)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct lighting from = *lighting;
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++)
        lane_put(s.local, i, vec3_add(lane_get(s.local, i), lane_get(from.radiance, i)));
}

static void find_background(const struct plan *plan, const struct path_batch *paths)
{
    const struct path_batch to = *paths;
    const struct vec3 below = plan->background.color[0], above = plan->background.color[1];
    if (plan->background.kind == BACKGROUND_GRADIENT)
        LANES_LOOP
        for (size_t i = 0; i < to.rays.count; i++) {
            struct vec3 color = vec3_mix(below, above, 0.5 * (to.rays.direction[1][i] + 1));
            lane_put(to.found, i, vec3_mul(lane_get(to.throughput, i), color));
        }
    else
        LANES_LOOP
        for (size_t i = 0; i < to.rays.count; i++)
            lane_put(to.found, i, vec3_mul(lane_get(to.throughput, i), below));
}

void LANES_NAME(find)(const struct plan *plan, const struct surfaces *surfaces, struct path_batch *paths)
{
    const struct surface_lanes s = surfaces->lanes;
    if (surfaces->count < paths->rays.count)
        find_background(plan, paths);
    for (size_t i = 0; i < surfaces->count; i++)
        lane_put(paths->found, surfaces->path[i], vec3_mul(lane_get(s.throughput, i), lane_get(s.local, i)));
}
