#include "trace/shade.h"

#include <math.h>

#include "math/elementary.h"
#include "trace/depart.h"
#include "trace/light.h"
#include "trace/optics.h"

/* Where the path's last bend lies on the ray: a path that went straight through a surface keeps its ray. */
static double segment_start(const struct ray *ray)
{
    return ray->key_min == KEY_NONE ? 0 : ray->t_min;
}

struct vec3 shading_throughput(const struct plan *plan, const struct medium_pool *media, const struct path *path,
                               double t)
{
    if (path->medium == MEDIUM_SPACE)
        return path->throughput;
    uint32_t object = medium_top(media, path->medium);
    const struct plan_material *material = &plan->materials[plan->objects[object].material];
    if (!material->absorbs)
        return path->throughput;
    double length = t - segment_start(&path->ray);
    struct vec3 share = {math_exp(-material->absorption.x * length), math_exp(-material->absorption.y * length),
                         math_exp(-material->absorption.z * length)};
    return vec3_mul(path->throughput, share);
}

void shading_init(struct shading *shading, const struct plan *plan, const struct medium_pool *media,
                  const struct path *path, const struct hit *hit)
{
    shading->path = *path;
    shading->path.throughput = shading_throughput(plan, media, path, hit->t);
    shading->hit = *hit;
    shading->material = &plan->materials[plan->objects[plan->primitives[hit->id].object].material];
    shading->surface = surface_at(plan, &path->ray, hit);
    shading->needs_footprints = plan->needs_footprints;
    if (plan->needs_footprints)
        shading->spread = surface_footprint_at(plan, &path->ray, &path->footprint, hit, &shading->surface);
    shading->color = surface_color(plan, hit, &shading->surface, plan->needs_footprints ? &shading->spread : NULL);
    bool inside = hit->side == SIDE_LEAVE;
    shading->normal = inside ? vec3_neg(shading->surface.normal) : shading->surface.normal;
    shading->shading_normal = inside ? vec3_neg(shading->surface.shading_normal) : shading->surface.shading_normal;
    if (vec3_dot(shading->shading_normal, path->ray.direction) > 0)
        shading->shading_normal = shading->normal;
    shading->walls = NULL;
    shading->wall_count = 0;
}

/* A ray from the surface's point. Other surfaces that coincide with this one are not met. */
static struct ray departing_ray(const struct shading *shading, struct vec3 direction, enum departure departure)
{
    return (struct ray){
        .origin = shading->surface.position,
        .direction = direction,
        .t_min = depart_t_min(shading->surface.position, shading->surface.error, shading->surface.normal, direction),
        .t_max = INFINITY,
        .key_min = KEY_NONE,
        .from = shading->hit.id,
        .departure = (uint8_t)departure,
    };
}

/* On the side that the path comes from, or on the other. */
static enum departure departure_to(const struct shading *shading, bool same_side)
{
    return (shading->hit.side == SIDE_ENTER) == same_side ? DEPART_OUTWARD : DEPART_INWARD;
}

void shading_push_shadows(const struct plan *plan, const struct shading *shading, uint32_t owner,
                          struct shadow_batch *shadows)
{
    for (size_t i = 0; i < plan->light_count; i++) {
        struct light_arrival arrival;
        if (!light_arrive(&plan->lights[i], shading->surface.position, &arrival))
            continue;
        if (vec3_dot(shading->normal, arrival.direction) <= 0)
            continue;
        struct vec3 radiance = light_phong(shading->material, shading->color, shading->shading_normal,
                                           shading->path.ray.direction, arrival.direction);
        if (vec3_is_zero(radiance))
            continue;
        struct ray ray = departing_ray(shading, arrival.direction, departure_to(shading, true));
        ray.t_max = depart_t_max(ray.t_min, arrival.distance);
        shadow_batch_push(shadows, &ray, vec3_mul(radiance, arrival.strength), owner, shading->path.medium);
    }
}

static void push_child(struct path_batch *children, const struct path *path)
{
    if (vec3_max(path->throughput) >= THROUGHPUT_MIN)
        path_batch_push(children, path);
}

/* Mirrored about the shading normal, or about the geometric one where that would send it into the surface. */
static void push_mirrored(const struct shading *shading, struct vec3 share, struct path_batch *children)
{
    struct vec3 incoming = shading->path.ray.direction;
    struct mirroring mirroring = depart_mirrored(incoming, shading->shading_normal, shading->normal);
    struct path child = shading->path;
    child.ray = departing_ray(shading, mirroring.direction, departure_to(shading, true));
    child.throughput = vec3_mul(shading->path.throughput, share);
    if (shading->needs_footprints) {
        const struct surface_footprint *spread = &shading->spread;
        const struct footprint *from = &shading->path.footprint;
        /* The formula is even in the normal together with its change, so the outward one serves. */
        struct vec3 outward = shading->hit.side == SIDE_LEAVE ? vec3_neg(mirroring.normal) : mirroring.normal;
        child.footprint = (struct footprint){
            .origin_x = spread->position_x,
            .origin_y = spread->position_y,
            .direction_x = optics_reflect_change(incoming, outward, from->direction_x, spread->normal_x),
            .direction_y = optics_reflect_change(incoming, outward, from->direction_y, spread->normal_y),
        };
    }
    push_child(children, &child);
}

/* The wall of the shading's boundary that the ray meets last. */
static struct crossing last_wall(const struct shading *shading)
{
    struct crossing last = {.t = shading->hit.t, .id = shading->hit.id, .side = (uint8_t)shading->hit.side};
    for (size_t i = 0; i < shading->wall_count; i++) {
        const struct crossing *wall = &shading->walls[i];
        bool same = wall->t == last.t;
        if (same ? hit_key(wall->id, wall->side) > hit_key(last.id, last.side) : wall->t > last.t)
            last = *wall;
    }
    return last;
}

/* Straight on along the same ray, whose next hit must only come after this one. */
static void push_straight(const struct shading *shading, struct vec3 share, uint32_t medium,
                          struct path_batch *children)
{
    struct path child = shading->path;
    struct crossing last = last_wall(shading);
    child.ray.t_min = last.t;
    child.ray.key_min = hit_key(last.id, last.side);
    child.throughput = vec3_mul(shading->path.throughput, share);
    child.medium = medium;
    push_child(children, &child);
}

/* Refracted about `normal`. Other surfaces that coincide with the boundary are met, so that glass does not hide what
 * lies on it; its own walls are passed by boundary_batch_pass_start. */
static void push_refracted(const struct shading *shading, const struct refraction *refraction, struct vec3 normal,
                           struct vec3 share, uint32_t medium, struct path_batch *children)
{
    struct vec3 incoming = shading->path.ray.direction;
    struct path child = shading->path;
    child.ray = departing_ray(shading, optics_refract(refraction, incoming, normal), departure_to(shading, false));
    child.ray.t_min = -child.ray.t_min;
    child.throughput = vec3_mul(shading->path.throughput, share);
    child.medium = medium;
    if (shading->needs_footprints) {
        const struct surface_footprint *spread = &shading->spread;
        const struct footprint *from = &shading->path.footprint;
        double sign = shading->hit.side == SIDE_LEAVE ? -1 : 1; /* from the outward normal to this side's */
        child.footprint = (struct footprint){
            .origin_x = spread->position_x,
            .origin_y = spread->position_y,
            .direction_x = optics_refract_change(refraction, incoming, normal, from->direction_x,
                                                 vec3_scale(spread->normal_x, sign)),
            .direction_y = optics_refract_change(refraction, incoming, normal, from->direction_y,
                                                 vec3_scale(spread->normal_y, sign)),
        };
    }
    push_child(children, &child);
}

static double medium_ior(const struct plan *plan, const struct medium_pool *media, uint32_t medium)
{
    if (medium == MEDIUM_SPACE)
        return 1;
    return plan->materials[plan->objects[medium_top(media, medium)].material].ior;
}

static uint32_t medium_behind(const struct plan *plan, struct medium_pool *media, uint32_t medium, uint32_t wall,
                              enum side side)
{
    uint32_t object = plan->primitives[wall].object;
    return side == SIDE_ENTER ? medium_push(media, medium, object) : medium_remove(media, medium, object);
}

/* What a path is in behind all walls of the boundary. */
static uint32_t medium_beyond(const struct plan *plan, const struct shading *shading, struct medium_pool *media)
{
    uint32_t medium = shading->path.medium;
    if (shading->wall_count == 0)
        return medium_behind(plan, media, medium, shading->hit.id, shading->hit.side);
    for (size_t i = 0; i < shading->wall_count; i++)
        medium = medium_behind(plan, media, medium, shading->walls[i].id, shading->walls[i].side);
    return medium;
}

/* What the boundary's walls together take from what passes them. */
static struct vec3 boundary_filter(const struct plan *plan, const struct shading *shading)
{
    if (shading->wall_count == 0)
        return shading->material->filter;
    struct vec3 product = {1, 1, 1};
    for (size_t i = 0; i < shading->wall_count; i++) {
        const struct plan_object *object = &plan->objects[plan->primitives[shading->walls[i].id].object];
        product = vec3_mul(product, plan->materials[object->material].filter);
    }
    return product;
}

/* The normal to refract about: the shading normal, or the geometric one where that would leave the ray on its side. */
static struct vec3 refracting_normal(const struct shading *shading, double ior_here, double ior_beyond)
{
    struct vec3 incoming = shading->path.ray.direction, normal = shading->shading_normal;
    struct refraction refraction = optics_refraction(incoming, normal, ior_here, ior_beyond);
    if (refraction.total || vec3_dot(optics_refract(&refraction, incoming, normal), shading->normal) < 0)
        return normal;
    return shading->normal;
}

/* The boundary of dielectrics: between what the path is in now and what it would be in beyond. Returns how much of the
 * light is mirrored. */
static double push_dielectric(const struct plan *plan, const struct shading *shading, struct medium_pool *media,
                              struct path_batch *transmitted)
{
    uint32_t here = shading->path.medium, beyond = medium_beyond(plan, shading, media);
    struct vec3 filter = boundary_filter(plan, shading);
    double ior_here = medium_ior(plan, media, here), ior_beyond = medium_ior(plan, media, beyond);
    if (ior_here == ior_beyond) {
        push_straight(shading, filter, beyond, transmitted);
        return 0;
    }
    struct vec3 normal = refracting_normal(shading, ior_here, ior_beyond);
    struct refraction refraction = optics_refraction(shading->path.ray.direction, normal, ior_here, ior_beyond);
    if (refraction.reflectance < 1)
        push_refracted(shading, &refraction, normal, vec3_scale(filter, 1 - refraction.reflectance), beyond, transmitted);
    return refraction.reflectance;
}

struct vec3 shading_push_transmitted(const struct plan *plan, const struct shading *shading, struct medium_pool *media,
                                     struct path_batch *transmitted)
{
    const struct plan_material *material = shading->material;
    if (material->dielectric) {
        double reflectance = push_dielectric(plan, shading, media, transmitted);
        return vec3_make(reflectance, reflectance, reflectance);
    }
    if (material->transmits)
        push_straight(shading, vec3_scale(material->filter, material->transparency), shading->path.medium, transmitted);
    return material->reflection;
}

void shading_push_children(const struct plan *plan, const struct shading *shading, struct medium_pool *media,
                           struct path_batch *children)
{
    struct path_batch transmitted = {0};
    struct vec3 share = shading_push_transmitted(plan, shading, media, &transmitted);
    push_mirrored(shading, share, children);
    path_batch_append(children, &transmitted);
    path_batch_finish(&transmitted);
}
