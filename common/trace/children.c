#include "trace/children.h"

#include <stdlib.h>

#include "base/memory.h"
#include "trace/boundary.h"

/* --- lists ------------------------------------------------------------------------------------------------ */

static void mirrored_reserve(struct mirrored *list, size_t capacity)
{
    if (capacity <= list->capacity)
        return;
    list->capacity = lanes_in_packets(capacity);
    list->surface = memory_resize(list->surface, list->capacity, sizeof *list->surface);
    for (int channel = 0; channel < 3; channel++)
        lanes_grow(&list->share[channel], 0, list->capacity);
}

void mirrored_finish(struct mirrored *list)
{
    free(list->surface);
    for (int channel = 0; channel < 3; channel++)
        free(list->share[channel]);
    *list = (struct mirrored){0};
}

enum { TRANSMITTED_LANES = 9 };

static void list_lanes(struct transmitted *list, double **lanes[TRANSMITTED_LANES])
{
    double **const all[TRANSMITTED_LANES] = {&list->straight, &list->ior_here, &list->ior_beyond,
                                             &list->t_last,   &list->key_last, &list->share[0],
                                             &list->share[1], &list->share[2], &list->reflectance};
    for (int i = 0; i < TRANSMITTED_LANES; i++)
        lanes[i] = all[i];
}

static void transmitted_reserve(struct transmitted *list, size_t capacity)
{
    double **lanes[TRANSMITTED_LANES];
    if (capacity <= list->capacity)
        return;
    list->capacity = lanes_in_packets(capacity);
    list->surface = memory_resize(list->surface, list->capacity, sizeof *list->surface);
    list->medium = memory_resize(list->medium, list->capacity, sizeof *list->medium);
    list_lanes(list, lanes);
    for (int i = 0; i < TRANSMITTED_LANES; i++)
        lanes_grow(lanes[i], 0, list->capacity);
}

void transmitted_finish(struct transmitted *list)
{
    double **lanes[TRANSMITTED_LANES];
    list_lanes(list, lanes);
    for (int i = 0; i < TRANSMITTED_LANES; i++)
        free(*lanes[i]);
    free(list->surface);
    free(list->medium);
    *list = (struct transmitted){0};
}

/* --- what is behind --------------------------------------------------------------------------------------- */

/* The walls that a path crosses at one place. */
struct walls {
    const struct crossing *items; /* in the order of crossing */
    size_t count;                 /* at least 1 */
};

static const struct plan_material *material_of(const struct plan *plan, const struct crossing *wall)
{
    return &plan->materials[plan->objects[plan_primitive(plan, wall->id)->object].material];
}

static double medium_ior(const struct plan *plan, const struct medium_pool *media, uint32_t medium)
{
    if (medium == MEDIUM_SPACE)
        return 1;
    return plan->materials[plan->objects[medium_top(media, medium)].material].ior;
}

/* What a path is in behind the walls. */
static uint32_t medium_beyond(const struct plan *plan, struct medium_pool *media, uint32_t medium, struct walls walls)
{
    for (size_t i = 0; i < walls.count; i++) {
        uint32_t object = plan_primitive(plan, walls.items[i].id)->object;
        medium = walls.items[i].side == SIDE_ENTER ? medium_push(media, medium, object)
                                                   : medium_remove(media, medium, object);
    }
    return medium;
}

/* What the walls together take from what passes them. */
static struct vec3 walls_filter(const struct plan *plan, struct walls walls)
{
    struct vec3 product = material_of(plan, &walls.items[0])->filter;
    for (size_t i = 1; i < walls.count; i++)
        product = vec3_mul(product, material_of(plan, &walls.items[i])->filter);
    return product;
}

/* The one that the ray meets last. */
static struct crossing last_wall(struct walls walls)
{
    struct crossing last = walls.items[0];
    for (size_t i = 1; i < walls.count; i++) {
        const struct crossing *wall = &walls.items[i];
        bool later_of_tied = hit_key(wall->id, wall->side) > hit_key(last.id, last.side);
        if (wall->t == last.t ? later_of_tied : wall->t > last.t)
            last = *wall;
    }
    return last;
}

static void push_transmitted(struct transmitted *list, const struct plan *plan, struct medium_pool *media,
                             uint32_t medium, uint32_t surface, struct walls walls)
{
    const struct plan_material *material = material_of(plan, &walls.items[0]);
    struct crossing last = last_wall(walls);
    size_t at = list->count++;
    list->surface[at] = surface;
    list->t_last[at] = last.t;
    list->key_last[at] = (double)hit_key(last.id, last.side);
    if (material->dielectric) {
        uint32_t beyond = medium_beyond(plan, media, medium, walls);
        list->medium[at] = beyond;
        list->ior_here[at] = medium_ior(plan, media, medium);
        list->ior_beyond[at] = medium_ior(plan, media, beyond);
        list->straight[at] = list->ior_here[at] == list->ior_beyond[at];
        lane_put(list->share, at, walls_filter(plan, walls));
    } else {
        list->medium[at] = medium;
        list->ior_here[at] = list->ior_beyond[at] = list->straight[at] = 1;
        lane_put(list->share, at, vec3_scale(material->filter, material->transparency));
    }
}

void transmitted_collect(struct transmitted *list, const struct plan *plan, struct medium_pool *media,
                         const struct path_batch *paths, const struct surfaces *surfaces,
                         const struct boundary_batch *boundaries)
{
    list->count = 0;
    transmitted_reserve(list, surfaces->count);
    for (uint32_t path = 0; path < paths->rays.count && (surfaces->traits & TRAIT_TRANSMITS); path++) {
        uint32_t i = surfaces->of_path[path];
        if (i == SURFACE_NONE || !(plan->materials[surfaces->material[i]].traits & TRAIT_TRANSMITS))
            continue;
        struct hit hit = surfaces_hit(surfaces, i);
        struct crossing only = {hit.t, path, hit.id, (uint8_t)hit.side};
        struct walls walls = {&only, 1};
        if (boundaries->walls.count > 0) {
            size_t first = boundary_batch_first(boundaries, path);
            size_t count = crossing_list_run(&boundaries->walls, first, path);
            walls = count > 0 ? (struct walls){&boundaries->walls.items[first], count} : walls;
        }
        push_transmitted(list, plan, media, paths->medium[path], i, walls);
    }
}

/* --- what is worth following ------------------------------------------------------------------------------ */

static bool is_worth(const struct surfaces *surfaces, uint32_t surface, struct vec3 share)
{
    return vec3_max(vec3_mul(lane_get(surfaces->lanes.throughput, surface), share)) >= THROUGHPUT_MIN;
}

/* Entry `from` of the list becomes its last. */
static void keep_transmitted(struct transmitted *list, size_t from)
{
    double **lanes[TRANSMITTED_LANES];
    size_t to = list->count++;
    list_lanes(list, lanes);
    for (int i = 0; i < TRANSMITTED_LANES; i++)
        (*lanes[i])[to] = (*lanes[i])[from];
    list->surface[to] = list->surface[from];
    list->medium[to] = list->medium[from];
}

void children_choose(struct mirrored *mirrored, struct transmitted *transmitted, const struct plan *plan,
                     const struct surfaces *surfaces, size_t path_count)
{
    size_t next = 0;
    mirrored->count = transmitted->count = 0;
    mirrored_reserve(mirrored, surfaces->count);
    for (size_t path = 0; path < path_count; path++) {
        uint32_t i = surfaces->of_path[path];
        if (i == SURFACE_NONE)
            continue;
        const struct plan_material *material = &plan->materials[surfaces->material[i]];
        if (!(material->traits & (TRAIT_MIRRORS | TRAIT_TRANSMITS)))
            continue;
        struct vec3 share = material->reflection;
        if (material->traits & TRAIT_TRANSMITS) {
            double mirrored_share = transmitted->reflectance[next];
            if (material->dielectric)
                share = vec3_make(mirrored_share, mirrored_share, mirrored_share);
            if (mirrored_share < 1 && is_worth(surfaces, i, lane_get(transmitted->share, next)))
                keep_transmitted(transmitted, next);
            next++;
        }
        if (!is_worth(surfaces, i, share))
            continue;
        mirrored->surface[mirrored->count] = i;
        lane_put(mirrored->share, mirrored->count++, share);
    }
}
