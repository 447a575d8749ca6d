#include "trace/surfaces.h"

#include <stdlib.h>

#include "base/memory.h"

enum { LANE_ARRAYS = sizeof(struct surface_lanes) / sizeof(double *) };

void surfaces_finish(struct surfaces *s)
{
    double **arrays = (double **)&s->lanes;
    for (size_t i = 0; i < LANE_ARRAYS; i++)
        free(arrays[i]);
    free(s->path);
    free(s->index);
    free(s->material);
    free(s->of_path);
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++) {
        free(s->patterned[kind].surface);
        free(s->patterned[kind].texture);
        free(s->patterned[kind].flat_axis);
        free(s->patterned[kind].share);
    }
    *s = (struct surfaces){0};
}

static void reserve(struct surfaces *s, size_t capacity)
{
    if (capacity <= s->capacity)
        return;
    s->capacity = lanes_in_packets(capacity);
    double **arrays = (double **)&s->lanes;
    for (size_t i = 0; i < LANE_ARRAYS; i++)
        lanes_grow(&arrays[i], 0, s->capacity);
    s->path = memory_resize(s->path, s->capacity, sizeof *s->path);
    s->index = memory_resize(s->index, s->capacity, sizeof *s->index);
    s->material = memory_resize(s->material, s->capacity, sizeof *s->material);
    s->of_path = memory_resize(s->of_path, s->capacity, sizeof *s->of_path);
}

/* How many surfaces of each kind there are, as the places where each kind begins. */
static void find_places(struct surfaces *s, const struct plan *plan, const struct hit_batch *hits, size_t count)
{
    size_t of_kind[PRIMITIVE_KINDS] = {0};
    for (size_t i = 0; i < count; i++)
        if (hits->key[i] >= 0)
            of_kind[plan->primitives[hit_batch_id(hits, i)].kind]++;
    s->first[0] = 0;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        s->first[kind + 1] = s->first[kind] + of_kind[kind];
    s->count = s->first[PRIMITIVE_KINDS];
}

static void place(struct surfaces *s, size_t at, const struct plan *plan, const struct path_batch *paths,
                  const struct hit_batch *hits, size_t path)
{
    uint32_t id = hit_batch_id(hits, path);
    const struct primitive *primitive = &plan->primitives[id];
    const struct plan_object *object = &plan->objects[primitive->object];
    s->path[at] = (uint32_t)path;
    s->index[at] = primitive->index;
    s->material[at] = object->material;
    s->lanes.t[at] = hits->t[path];
    s->lanes.side[at] = hit_batch_side(hits, path);
    s->lanes.id[at] = id;
    s->lanes.leave_share[at] = primitive_leave_share(primitive);
    s->lanes.extent[at] = object->extent;
    lane_put(s->lanes.direction, at, lane_get(paths->rays.direction, path));
    lane_put(s->lanes.throughput, at, lane_get(paths->throughput, path));
}

void surfaces_collect(struct surfaces *s, const struct plan *plan, const struct path_batch *paths,
                      const struct hit_batch *hits)
{
    size_t count = paths->rays.count, next[PRIMITIVE_KINDS];
    reserve(s, count);
    find_places(s, plan, hits, count);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        next[kind] = s->first[kind];
    for (size_t path = 0; path < count; path++) {
        s->of_path[path] = SURFACE_NONE;
        if (hits->key[path] < 0)
            continue;
        size_t at = next[plan->primitives[hit_batch_id(hits, path)].kind]++;
        place(s, at, plan, paths, hits, path);
        s->of_path[path] = (uint32_t)at;
    }
}

struct hit surfaces_hit(const struct surfaces *s, size_t at)
{
    return (struct hit){s->lanes.t[at], (uint32_t)s->lanes.id[at], s->lanes.side[at] == SIDE_LEAVE ? SIDE_LEAVE : SIDE_ENTER,
                        (uint8_t)s->lanes.part[at]};
}

struct surface surfaces_get(const struct surfaces *s, size_t at)
{
    return (struct surface){.position = lane_get(s->lanes.position, at),
                            .error = s->lanes.error[at],
                            .normal = lane_get(s->lanes.normal, at),
                            .shading_normal = lane_get(s->lanes.shading_normal, at)};
}

struct surface_footprint surfaces_spread(const struct surfaces *s, size_t at)
{
    return (struct surface_footprint){lane_get(s->lanes.spread[0], at), lane_get(s->lanes.spread[1], at),
                                      lane_get(s->lanes.spread[2], at), lane_get(s->lanes.spread[3], at)};
}

/* --- what meshes add --------------------------------------------------------------------------------------- */

static const struct plan_object *object_of(const struct surfaces *s, const struct plan *plan, size_t at)
{
    return &plan->objects[plan->primitives[(uint32_t)s->lanes.id[at]].object];
}

void surfaces_smooth(struct surfaces *s, const struct plan *plan, const struct path_batch *paths)
{
    for (size_t at = s->first[PRIMITIVE_TRIANGLE]; at < s->first[PRIMITIVE_TRIANGLE + 1]; at++) {
        if (!plan->meshes[object_of(s, plan, at)->mesh].normals)
            continue;
        struct path path = path_batch_get(paths, s->path[at]);
        struct hit hit = surfaces_hit(s, at);
        struct surface surface = surface_at(plan, &path.ray, &hit);
        lane_put(s->lanes.shading_normal, at, surface.shading_normal);
        if (!plan->needs_footprints)
            continue;
        struct surface_footprint spread = surface_footprint_at(plan, &path.ray, &path.footprint, &hit, &surface);
        lane_put(s->lanes.spread[2], at, spread.normal_x);
        lane_put(s->lanes.spread[3], at, spread.normal_y);
    }
}

/* --- colour ------------------------------------------------------------------------------------------------ */

static struct vec3 textured(const struct surfaces *s, const struct plan *plan, const struct path_batch *paths, size_t at)
{
    struct hit hit = surfaces_hit(s, at);
    struct surface surface = surfaces_get(s, at);
    struct surface_footprint spread = surfaces_spread(s, at);
    if (plan->primitives[hit.id].kind == PRIMITIVE_TRIANGLE) { /* for the weights of its corners */
        struct ray ray = ray_batch_get(&paths->rays, s->path[at]);
        surface = surface_at(plan, &ray, &hit);
    }
    return surface_color(plan, &hit, &surface, &spread);
}

static void push_patterned(struct patterned *to, const struct plan *plan, const struct surfaces *s, uint32_t at,
                           uint32_t texture)
{
    if (to->count == to->capacity) {
        size_t capacity = lanes_in_packets(2 * to->capacity + 1);
        to->surface = memory_resize(to->surface, capacity, sizeof *to->surface);
        to->texture = memory_resize(to->texture, capacity, sizeof *to->texture);
        lanes_grow(&to->flat_axis, to->count, capacity);
        lanes_grow(&to->share, 0, capacity);
        to->capacity = capacity;
    }
    const struct primitive *primitive = &plan->primitives[(uint32_t)s->lanes.id[at]];
    to->surface[to->count] = at;
    to->texture[to->count] = texture;
    to->flat_axis[to->count++] = surface_flat_axis(primitive, (uint8_t)s->lanes.part[at]);
}

void surfaces_color(struct surfaces *s, const struct plan *plan, const struct path_batch *paths)
{
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++)
        s->patterned[kind].count = 0;
    for (uint32_t at = 0; at < s->count; at++) {
        uint32_t index = object_of(s, plan, at)->texture;
        const struct plan_texture *texture = &plan->textures[index];
        if (texture->kind == TEXTURE_CONSTANT)
            lane_put(s->lanes.color, at, texture->color[0]);
        else if (texture->kind == TEXTURE_IMAGE)
            lane_put(s->lanes.color, at, textured(s, plan, paths, at));
        else
            push_patterned(&s->patterned[texture->kind], plan, s, at, index);
    }
}

void surfaces_mix_patterns(struct surfaces *s, const struct plan *plan)
{
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++) {
        const struct patterned *from = &s->patterned[kind];
        for (size_t i = 0; i < from->count; i++) {
            const struct vec3 *color = plan->textures[from->texture[i]].color;
            lane_put(s->lanes.color, from->surface[i], vec3_mix(color[0], color[1], from->share[i]));
        }
    }
}
