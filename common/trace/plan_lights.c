/*
 * The lights of a scene, but for those that reach nothing. A light is left out only where every surface would find it
 * black: with wide margins for rounding, so that no picture depends on it.
 */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "math/elementary.h"
#include "trace/bounds.h"
#include "trace/plan_parts.h"

/* Far more than rounding can make of a cosine, or of a place as a share of its coordinates. */
static const double margin = 1e-6;

struct plan_light plan_light_compile(const struct light *light, struct vec3 eye)
{
    return (struct plan_light){
        .kind = (uint8_t)light->kind,
        .color = light->color,
        .position = vec3_sub(light->position, eye),
        .direction = light->direction,
        .falloff = {light->falloff[0], light->falloff[1], light->falloff[2]},
        .outer_cosine = math_cos_degrees(light->outer_degrees),
        .inner_cosine = math_cos_degrees(light->inner_degrees),
    };
}

/* --- what lights could reach ------------------------------------------------------------------------------ */

/* An object whose surface answers to light: a plane, or what lies within a box. */
struct target {
    const struct plane *plane; /* or NULL */
    struct bounds box;
};

static bool answers_light(const struct plan_material *material)
{
    return (material->traits & TRAIT_HIGHLIGHTS) || (material->diffuse > 0 && !vec3_is_zero(material->surface_share));
}

static struct target target_of(const struct plan *plan, size_t object)
{
    struct bounds box;
    if (!bounds_of_object(plan, object, &box)) {
        const struct primitive *primitive = &plan->primitives[plan->objects[object].first_primitive];
        return (struct target){.plane = &plan->planes[primitive->index]};
    }
    double low = vec3_max_abs(box.low), high = vec3_max_abs(box.high), by = margin * (low > high ? low : high);
    struct vec3 more = vec3_make(by, by, by);
    return (struct target){NULL, {vec3_sub(box.low, more), vec3_add(box.high, more)}};
}

static size_t find_targets(const struct plan *plan, struct target *targets)
{
    size_t count = 0;
    for (size_t i = 0; i < plan->object_count; i++)
        if (answers_light(&plan->materials[plan->objects[i].material]))
            targets[count++] = target_of(plan, i);
    return count;
}

/* --- spots ------------------------------------------------------------------------------------------------ */

/* Around the box is a ball. With its middle at an angle β from the cone's axis, and its edge at γ from there, no point
 * of it is nearer to the axis than β − γ. */
static bool cone_misses_ball(const struct plan_light *light, const struct bounds *box)
{
    struct vec3 center = vec3_mix(box->low, box->high, 0.5), way = vec3_sub(center, light->position);
    double radius = vec3_length(vec3_sub(box->high, center)), distance = vec3_length(way);
    if (!(distance > radius))
        return false;
    double sine = radius / distance, cosine = sqrt(1 - sine * sine);
    double middle_cosine = vec3_dot(way, light->direction) / distance;
    double middle_sine = vec3_length(vec3_cross(way, light->direction)) / distance;
    if (middle_cosine >= cosine)
        return false; /* the axis goes through it */
    return middle_cosine * cosine + middle_sine * sine < light->outer_cosine - margin;
}

/* Whether even the edge of the cone that is turned most that way (a unit vector) goes the other way. */
static bool cone_leaves(const struct plan_light *light, struct vec3 towards)
{
    double axis_cosine = vec3_dot(light->direction, towards);
    double axis_sine = vec3_length(vec3_cross(light->direction, towards));
    double outer_sine = sqrt(1 - light->outer_cosine * light->outer_cosine);
    return axis_cosine < light->outer_cosine && axis_cosine * light->outer_cosine + axis_sine * outer_sine < -margin;
}

/* Where all of the box is on one side of the light, along an axis, and the cone goes to the other. */
static bool cone_misses_box(const struct plan_light *light, const struct bounds *box)
{
    struct vec3 above = vec3_sub(box->low, light->position), below = vec3_sub(light->position, box->high);
    return (above.x > 0 && cone_leaves(light, vec3_make(1, 0, 0))) ||
           (above.y > 0 && cone_leaves(light, vec3_make(0, 1, 0))) ||
           (above.z > 0 && cone_leaves(light, vec3_make(0, 0, 1))) ||
           (below.x > 0 && cone_leaves(light, vec3_make(-1, 0, 0))) ||
           (below.y > 0 && cone_leaves(light, vec3_make(0, -1, 0))) ||
           (below.z > 0 && cone_leaves(light, vec3_make(0, 0, -1))) || cone_misses_ball(light, box);
}

static bool cone_misses_plane(const struct plan_light *light, const struct plane *plane)
{
    double height = vec3_dot(plane->normal, light->position) - plane->offset;
    if (!(fabs(height) > margin * (vec3_max_abs(light->position) + fabs(plane->offset))))
        return false;
    return cone_leaves(light, vec3_scale(plane->normal, height > 0 ? -1 : 1));
}

static bool reaches_any(const struct plan_light *light, const struct target *targets, size_t count)
{
    if (light->kind != LIGHT_SPOT)
        return count > 0;
    for (size_t i = 0; i < count; i++)
        if (targets[i].plane ? !cone_misses_plane(light, targets[i].plane) : !cone_misses_box(light, &targets[i].box))
            return true;
    return false;
}

void plan_lights_build(struct plan *plan, const struct scene *scene)
{
    struct target *targets = memory_array(plan->object_count, sizeof *targets);
    size_t count = find_targets(plan, targets);
    plan->lights = memory_array(scene->light_count, sizeof *plan->lights);
    for (size_t i = 0; i < scene->light_count; i++) {
        struct plan_light light = plan_light_compile(&scene->lights[i], plan->eye);
        if (!vec3_is_zero(light.color) && reaches_any(&light, targets, count))
            plan->lights[plan->light_count++] = light;
    }
    free(targets);
}
