/*
 * A picture by definition: each pixel's ray through its centre, all crossings, the nearest one's light; one
 * sample a pixel, in quadruple precision, recursively. Constant colours without highlights, point and
 * directional lights without falloff, mirrors, filters and dielectrics.
 *
 * Crossings at the same place are one: of surfaces the lowest object wins, or if it lets light through comes
 * first; walls of solids that touch are one boundary between what is before and what is behind them all, and
 * count as one surface where the depth is limited.
 */
#ifndef WEFT_TESTS_ORACLE_PICTURE_H
#define WEFT_TESTS_ORACLE_PICTURE_H

#include <stdlib.h>

#include "base/memory.h"
#include "tests/numeric/oracle_shapes.h"

enum { ORACLE_NESTING_MAX = 8 };

struct oracle {
    const struct scene *scene;
    struct oracle_object *objects;
};

/* The dielectrics around a place, the innermost last. */
struct oracle_media {
    size_t object[ORACLE_NESTING_MAX];
    size_t count;
};

struct oracle_path {
    struct oracle_ray ray;
    real start; /* crossings up to here are done with */
    struct oracle_media media;
    struct quad3 throughput;
    uint32_t depth; /* how often it may still be mirrored or pass a surface */
};

static inline struct oracle oracle_create(const struct scene *scene)
{
    struct oracle oracle = {scene, memory_array(scene->object_count, sizeof *oracle.objects)};
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct object *object = &scene->objects[i];
        oracle.objects[i] = (struct oracle_object){object, quad_inverse(&object->transform.linear),
                                                   quad_of(object->transform.offset)};
    }
    return oracle;
}

static inline void oracle_destroy(struct oracle *oracle)
{
    free(oracle->objects);
}

static inline const struct material *oracle_material(const struct oracle *oracle, size_t object)
{
    const struct material *material = &oracle->scene->materials[oracle->objects[object].object->material];
    assert(material->color.kind == TEXTURE_CONSTANT && vec3_is_zero(material->specular));
    assert(vec3_is_zero(material->absorption));
    return material;
}

/* What is nearer than this share of the scene's coordinates is in one place. Computed places are off by some
 * 1e-30 of them, coordinates that a scene writes differently by 1e-16. */
static inline real oracle_same_place(const struct oracle_ray *ray, real t)
{
    const struct quad3 o = ray->origin;
    return 1e-22 * (1 + quad_abs(t) + quad_abs(o.x) + quad_abs(o.y) + quad_abs(o.z));
}

static inline int oracle_by_object(const void *left, const void *right)
{
    const struct oracle_crossing *a = left, *b = right;
    return (a->object > b->object) - (a->object < b->object);
}

/* Crossings in one place, by object; the same object's once, where the ray meets an edge. */
static inline void oracle_sort_cluster(struct oracle_crossings *cluster)
{
    qsort(cluster->at, cluster->count, sizeof *cluster->at, oracle_by_object);
    size_t kept = 0;
    for (size_t i = 0; i < cluster->count; i++)
        if (kept == 0 || cluster->at[kept - 1].object != cluster->at[i].object)
            cluster->at[kept++] = cluster->at[i];
    cluster->count = kept;
}

static inline void oracle_cross_all(const struct oracle *oracle, const struct oracle_ray *ray,
                                    struct oracle_crossings *found)
{
    found->count = 0;
    for (size_t i = 0; i < oracle->scene->object_count; i++)
        oracle_cross(&oracle->objects[i], i, ray, found);
}

/* The nearest crossings beyond the path's start. */
static inline void oracle_nearest(const struct oracle *oracle, const struct oracle_path *path,
                                  struct oracle_crossings *cluster)
{
    struct oracle_crossings all;
    oracle_cross_all(oracle, &path->ray, &all);
    real nearest = -1;
    for (size_t i = 0; i < all.count; i++)
        if (all.at[i].t > path->start && (nearest < 0 || all.at[i].t < nearest))
            nearest = all.at[i].t;
    cluster->count = 0;
    for (size_t i = 0; i < all.count; i++)
        if (nearest >= 0 && quad_abs(all.at[i].t - nearest) <= oracle_same_place(&path->ray, nearest))
            cluster->at[cluster->count++] = all.at[i];
    oracle_sort_cluster(cluster);
}

/* --- light ------------------------------------------------------------------------------------------------ */

static inline bool oracle_is_opaque(const struct material *material)
{
    return material->ior == 0 && (material->transparency == 0 || vec3_is_zero(material->filter));
}

/* What comes through from a light at `distance` along the ray, which starts on a surface. */
static inline struct quad3 oracle_transmittance(const struct oracle *oracle, const struct oracle_ray *ray,
                                                real distance)
{
    struct oracle_crossings all;
    struct quad3 through = {1, 1, 1};
    oracle_cross_all(oracle, ray, &all);
    for (size_t i = 0; i < all.count; i++) {
        if (!(all.at[i].t > oracle_same_place(ray, 0) && all.at[i].t < distance))
            continue;
        const struct material *material = oracle_material(oracle, all.at[i].object);
        assert(material->ior == 0);
        through = quad_mul(through, quad_scale(quad_of(material->filter), material->transparency));
    }
    return through;
}

static inline struct quad3 oracle_light(const struct oracle *oracle, const struct light *light,
                                        struct quad3 place, struct quad3 normal)
{
    assert(light->kind != LIGHT_SPOT);
    assert(light->kind == LIGHT_DIRECTIONAL || (light->falloff[1] == 0 && light->falloff[2] == 0));
    bool endless = light->kind == LIGHT_DIRECTIONAL;
    struct quad3 to = endless ? quad_scale(quad_of(light->direction), -1)
                              : quad_sub(quad_of(light->position), place);
    real distance = quad_length(to), share = endless ? 1 : 1 / (real)light->falloff[0];
    struct oracle_ray ray = {place, quad_scale(to, 1 / distance)};
    real cosine = quad_dot(normal, ray.direction);
    if (cosine <= 0)
        return (struct quad3){0, 0, 0};
    struct quad3 through = oracle_transmittance(oracle, &ray, endless ? (real)INFINITY : distance);
    return quad_mul(through, quad_scale(quad_of(light->color), cosine * share));
}

/* The world's unit normal, on the side that the ray comes from. */
static inline struct quad3 oracle_facing(const struct oracle *oracle, const struct oracle_crossing *crossing)
{
    const struct oracle_object *object = &oracle->objects[crossing->object];
    struct quad3 normal = quad_normalize(quad_apply_transposed(&object->inverse, crossing->normal));
    return crossing->enters ? normal : quad_scale(normal, -1);
}

static inline struct quad3 oracle_local(const struct oracle *oracle, const struct oracle_ray *ray,
                                        const struct oracle_crossing *crossing)
{
    const struct material *material = oracle_material(oracle, crossing->object);
    if (material->ior > 0)
        return (struct quad3){0, 0, 0};
    real left = 1 - (real)material->transparency;
    struct vec3 mirrored = material->reflection;
    struct quad3 share = {left - mirrored.x, left - mirrored.y, left - mirrored.z};
    struct quad3 light = quad_scale(quad_of(oracle->scene->ambient), material->ambient);
    struct quad3 place = oracle_point_at(ray, crossing->t), normal = oracle_facing(oracle, crossing);
    for (size_t i = 0; i < oracle->scene->light_count && material->diffuse > 0; i++)
        light = quad_add_scaled(light, oracle_light(oracle, &oracle->scene->lights[i], place, normal),
                                material->diffuse);
    return quad_mul(quad_mul(share, quad_of(material->color.color[0])), light);
}

static inline struct quad3 oracle_background(const struct oracle *oracle, struct quad3 direction)
{
    const struct background *background = &oracle->scene->background;
    assert(background->kind != BACKGROUND_IMAGE);
    struct quad3 low = quad_of(background->color[0]), high = quad_of(background->color[1]);
    if (background->kind == BACKGROUND_CONSTANT)
        return low;
    return quad_add_scaled(low, quad_sub(high, low), (direction.y + 1) / 2);
}

/* --- dielectrics ------------------------------------------------------------------------------------------ */

static inline struct oracle_media oracle_without(struct oracle_media media, size_t object)
{
    for (size_t i = media.count; i-- > 0;)
        if (media.object[i] == object) {
            for (media.count--; i < media.count; i++)
                media.object[i] = media.object[i + 1];
            break;
        }
    return media;
}

/* Behind all walls of a cluster: without what they leave, and with what they enter. */
static inline struct oracle_media oracle_beyond(const struct oracle *oracle, struct oracle_media media,
                                                const struct oracle_crossings *cluster)
{
    for (size_t i = 0; i < cluster->count; i++)
        if (!cluster->at[i].enters)
            media = oracle_without(media, cluster->at[i].object);
    for (size_t i = 0; i < cluster->count; i++)
        if (cluster->at[i].enters && oracle_material(oracle, cluster->at[i].object)->ior > 0) {
            assert(media.count < ORACLE_NESTING_MAX);
            media.object[media.count++] = cluster->at[i].object;
        }
    return media;
}

static inline real oracle_ior(const struct oracle *oracle, const struct oracle_media *media)
{
    return media->count == 0 ? 1 : oracle_material(oracle, media->object[media->count - 1])->ior;
}

static struct quad3 oracle_radiance(const struct oracle *oracle, struct oracle_path path);

/* The radiance that a path finds which goes on from `place`, where it has passed or been mirrored by one surface. */
static inline struct quad3 oracle_go_on(const struct oracle *oracle, const struct oracle_path *path,
                                        struct quad3 place, struct quad3 direction,
                                        const struct oracle_media *media, struct quad3 share)
{
    struct oracle_path child = {.ray = {place, quad_normalize(direction)}, .media = *media,
                                .throughput = quad_mul(path->throughput, share),
                                .depth = path->depth - 1};
    child.start = oracle_same_place(&child.ray, 0);
    if (path->depth == 0 || (double)quad_max(child.throughput) < 0x1p-12)
        return (struct quad3){0, 0, 0};
    return oracle_radiance(oracle, child);
}

/* Snell's and Fresnel's laws, with the angles' cosines c and k on the two sides. */
static inline struct quad3 oracle_boundary(const struct oracle *oracle, const struct oracle_path *path,
                                           const struct oracle_crossings *cluster)
{
    struct quad3 d = path->ray.direction, normal = oracle_facing(oracle, &cluster->at[0]);
    struct quad3 place = oracle_point_at(&path->ray, cluster->at[0].t), filter = {1, 1, 1};
    for (size_t i = 0; i < cluster->count; i++)
        filter = quad_mul(filter, quad_of(oracle_material(oracle, cluster->at[i].object)->filter));
    struct oracle_media beyond = oracle_beyond(oracle, path->media, cluster);
    real from = oracle_ior(oracle, &path->media), to = oracle_ior(oracle, &beyond), c = -quad_dot(d, normal);
    real eta = from / to, square = 1 - eta * eta * (1 - c * c), mirrored = 1, k = 0;
    if (square >= 0) {
        k = quad_sqrt(square);
        real s = (from * c - to * k) / (from * c + to * k), p = (to * c - from * k) / (to * c + from * k);
        mirrored = (s * s + p * p) / 2;
    }
    struct quad3 sum = {0, 0, 0}, one = {1, 1, 1};
    if (mirrored > 0)
        sum = oracle_go_on(oracle, path, place, quad_add_scaled(d, normal, 2 * c), &path->media,
                           quad_scale(one, mirrored));
    if (mirrored < 1)
        sum = quad_add(sum, oracle_go_on(oracle, path, place,
                                         quad_add_scaled(quad_scale(d, eta), normal, eta * c - k), &beyond,
                                         quad_scale(filter, 1 - mirrored)));
    return sum;
}

static inline bool oracle_is_boundary(const struct oracle *oracle, const struct oracle_crossings *cluster)
{
    for (size_t i = 0; i < cluster->count; i++)
        if (oracle_material(oracle, cluster->at[i].object)->ior == 0)
            return false;
    return true;
}

/* --- paths ------------------------------------------------------------------------------------------------ */

/* Adds the light of the surfaces in one place, lowest object first, and takes from the path's throughput what
 * they keep. False if nothing is left to go on. */
static inline bool oracle_pass(const struct oracle *oracle, struct oracle_path *path,
                               const struct oracle_crossings *cluster, struct quad3 *sum)
{
    for (size_t i = 0; i < cluster->count; i++) {
        const struct oracle_crossing *crossing = &cluster->at[i];
        const struct material *material = oracle_material(oracle, crossing->object);
        if (material->ior > 0)
            continue;
        struct quad3 d = path->ray.direction, place = oracle_point_at(&path->ray, crossing->t);
        *sum = quad_add(*sum, quad_mul(path->throughput, oracle_local(oracle, &path->ray, crossing)));
        if (!vec3_is_zero(material->reflection)) {
            struct quad3 normal = oracle_facing(oracle, crossing);
            struct quad3 mirrored = quad_add_scaled(d, normal, -2 * quad_dot(d, normal));
            *sum = quad_add(*sum, oracle_go_on(oracle, path, place, mirrored, &path->media,
                                               quad_of(material->reflection)));
        }
        struct quad3 share = quad_scale(quad_of(material->filter), material->transparency);
        path->throughput = quad_mul(path->throughput, share);
        if (path->depth == 0 || oracle_is_opaque(material) || (double)quad_max(path->throughput) < 0x1p-12)
            return false;
        path->depth--;
    }
    return true;
}

static struct quad3 oracle_radiance(const struct oracle *oracle, struct oracle_path path)
{
    struct quad3 sum = {0, 0, 0};
    struct oracle_crossings cluster;
    for (;;) {
        oracle_nearest(oracle, &path, &cluster);
        if (cluster.count == 0)
            return quad_add(sum, quad_mul(path.throughput, oracle_background(oracle, path.ray.direction)));
        if (oracle_is_boundary(oracle, &cluster))
            return quad_add(sum, oracle_boundary(oracle, &path, &cluster));
        if (!oracle_pass(oracle, &path, &cluster, &sum))
            return sum;
        path.start = cluster.at[0].t + oracle_same_place(&path.ray, cluster.at[0].t);
    }
}

/* The direction through image position (x, y), in pixels from the top left corner; length 1. */
static inline struct quad3 oracle_direction(const struct scene *scene, real x, real y)
{
    const struct camera *camera = &scene->camera;
    struct quad3 forward = quad_normalize(quad_sub(quad_of(camera->at), quad_of(camera->from)));
    struct quad3 right = quad_normalize(quad_cross(forward, quad_of(camera->up)));
    struct quad3 up = quad_cross(right, forward);
    real sine, cosine;
    quad_sin_cos((real)camera->fov_degrees / 2, &sine, &cosine);
    real step = 2 * sine / cosine / scene->height;
    struct quad3 d = quad_add_scaled(forward, right, (x - (real)scene->width / 2) * step);
    return quad_normalize(quad_add_scaled(d, up, ((real)scene->height / 2 - y) * step));
}

/* What the camera sees along `direction`. */
static inline struct vec3 oracle_look(const struct oracle *oracle, struct quad3 direction)
{
    struct oracle_path path = {.ray = {quad_of(oracle->scene->camera.from), direction}, .throughput = {1, 1, 1},
                               .depth = oracle->scene->depth};
    return quad_round(oracle_radiance(oracle, path));
}

#endif
