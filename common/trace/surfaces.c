#include "trace/surfaces.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/texture.h"

enum { LANE_ARRAYS = sizeof(struct surface_lanes) / sizeof(double *) };

void surfaces_finish(struct surfaces *s)
{
    double **arrays = (double **)&s->lanes;
    for (size_t i = 0; i < LANE_ARRAYS; i++)
        free(arrays[i]);
    free(s->path);
    free(s->primitive);
    free(s->index);
    free(s->material);
    free(s->texture);
    free(s->of_path);
    free(s->hit);
    free(s->kind);
    free(s->placed);
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++) {
        free(s->patterned[kind].surface);
        free(s->patterned[kind].texture);
        free(s->patterned[kind].flat_axis);
        free(s->patterned[kind].share);
    }
    free(s->imaged.surface);
    free(s->imaged.texture);
    free(s->imaged.face);
    for (int i = 0; i < 6; i++)
        free(s->imaged.point[i]);
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
    s->primitive = memory_resize(s->primitive, s->capacity, sizeof *s->primitive);
    s->index = memory_resize(s->index, s->capacity, sizeof *s->index);
    s->material = memory_resize(s->material, s->capacity, sizeof *s->material);
    s->texture = memory_resize(s->texture, s->capacity, sizeof *s->texture);
    s->of_path = memory_resize(s->of_path, s->capacity, sizeof *s->of_path);
    s->hit = memory_resize(s->hit, s->capacity, sizeof *s->hit);
    s->kind = memory_resize(s->kind, s->capacity, sizeof *s->kind);
}

void surfaces_count(struct surfaces *s, const struct plan *plan, const struct hit_batch *hits, size_t count)
{
    size_t of_kind[PRIMITIVE_KINDS] = {0};
    reserve(s, count);
    s->traits = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t id = hit_batch_id(hits, i);
        s->hit[i] = PRIMITIVE_NONE;
        s->kind[i] = PRIMITIVE_KINDS;
        if (id == PRIMITIVE_NONE)
            continue;
        s->hit[i] = plan_number(plan, id);
        const struct primitive *primitive = &plan->primitives[s->hit[i]];
        s->kind[i] = primitive->kind;
        of_kind[s->kind[i]]++;
        s->traits |= primitive->traits;
    }
    s->first[0] = 0;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        s->first[kind + 1] = s->first[kind] + of_kind[kind];
    s->count = s->first[PRIMITIVE_KINDS];
}

void surfaces_sort(struct surfaces *s, size_t count)
{
    size_t next[PRIMITIVE_KINDS];
    memcpy(next, s->first, sizeof next);
    for (size_t i = 0; i < count; i++) {
        s->of_path[i] = SURFACE_NONE;
        if (s->kind[i] == PRIMITIVE_KINDS)
            continue;
        size_t at = next[s->kind[i]]++;
        s->path[at] = (uint32_t)i;
        s->primitive[at] = s->hit[i];
        s->of_path[i] = (uint32_t)at;
    }
}

void surfaces_place(struct surfaces *s, const struct plan *plan)
{
    size_t first = s->first[PRIMITIVE_INSTANCE], end = s->first[PRIMITIVE_INSTANCE + 1];
    s->placed = memory_grow(s->placed, &s->placed_capacity, end - first, sizeof *s->placed);
    for (size_t at = first; at < end; at++) {
        s->index[at] = (uint32_t)(at - first);
        s->placed[at - first] = plan_triangle(plan, (uint32_t)s->lanes.id[at]);
    }
}

struct hit surfaces_hit(const struct surfaces *s, size_t at)
{
    return (struct hit){s->lanes.t[at], (uint32_t)s->lanes.id[at],
                        s->lanes.side[at] == SIDE_LEAVE ? SIDE_LEAVE : SIDE_ENTER,
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
    return (struct surface_footprint){lane_get(s->lanes.middle, at), lane_get(s->lanes.spread[0], at),
                                      lane_get(s->lanes.spread[1], at), lane_get(s->lanes.spread[2], at),
                                      lane_get(s->lanes.spread[3], at)};
}

/* --- what meshes add --------------------------------------------------------------------------------------- */

static const struct plan_object *object_of(const struct surfaces *s, const struct plan *plan, size_t at)
{
    return &plan->objects[plan->primitives[s->primitive[at]].object];
}

void surfaces_smooth(struct surfaces *s, const struct plan *plan, const struct path_batch *paths)
{
    for (size_t at = s->first[PRIMITIVE_TRIANGLE]; at < s->first[PRIMITIVE_INSTANCE + 1]; at++) {
        if (!plan->meshes[object_of(s, plan, at)->mesh].smooth)
            continue;
        struct ray ray = ray_batch_get(&paths->rays, s->path[at]);
        struct surface surface = surfaces_get(s, at);
        surface_add_mesh(plan, (uint32_t)s->lanes.id[at], &ray, &surface);
        lane_put(s->lanes.shading_normal, at, surface.shading_normal);
        if (!paths->has_footprints)
            continue;
        struct path path = path_batch_get(paths, s->path[at]);
        struct hit hit = surfaces_hit(s, at);
        struct surface_footprint spread = surface_footprint_at(plan, &path.ray, &path.footprint, &hit, &surface);
        lane_put(s->lanes.spread[2], at, spread.normal_x);
        lane_put(s->lanes.spread[3], at, spread.normal_y);
    }
}

/* --- colour ------------------------------------------------------------------------------------------------ */

static struct vec3 textured(const struct surfaces *s, const struct plan *plan, const struct path_batch *paths,
                            size_t at)
{
    struct hit hit = surfaces_hit(s, at);
    struct surface surface = surfaces_get(s, at);
    struct surface_footprint spread = surfaces_spread(s, at);
    if (primitive_is_of_mesh(&plan->primitives[s->primitive[at]])) { /* for the weights of its corners */
        struct ray ray = ray_batch_get(&paths->rays, s->path[at]);
        surface_add_mesh(plan, hit.id, &ray, &surface);
    }
    return surface_color(plan, &hit, &surface, &spread);
}

static void push_patterned(struct patterned *to, const struct plan *plan, const struct surfaces *s, uint32_t at)
{
    if (to->count == to->capacity) {
        size_t capacity = lanes_in_packets(2 * to->capacity + 1);
        to->surface = memory_resize(to->surface, capacity, sizeof *to->surface);
        to->texture = memory_resize(to->texture, capacity, sizeof *to->texture);
        lanes_grow(&to->flat_axis, to->count, capacity);
        lanes_grow(&to->share, 0, capacity);
        to->capacity = capacity;
    }
    to->surface[to->count] = at;
    to->texture[to->count] = s->texture[at];
    to->flat_axis[to->count++] = surface_flat_axis(plan, (uint32_t)s->lanes.id[at], (uint8_t)s->lanes.part[at]);
}

static void push_imaged(struct imaged *to, const struct plan *plan, const struct surfaces *s, uint32_t at)
{
    if (to->count == to->capacity) {
        size_t capacity = lanes_in_packets(2 * to->capacity + 1);
        to->surface = memory_resize(to->surface, capacity, sizeof *to->surface);
        to->texture = memory_resize(to->texture, capacity, sizeof *to->texture);
        lanes_grow(&to->face, to->count, capacity);
        for (int i = 0; i < 6; i++)
            lanes_grow(&to->point[i], 0, capacity);
        to->capacity = capacity;
    }
    bool is_box = plan->primitives[s->primitive[at]].kind == PRIMITIVE_BOX;
    to->surface[to->count] = at;
    to->texture[to->count] = s->texture[at];
    to->face[to->count++] = is_box && plan->textures[s->texture[at]].map == MAP_BOX ? s->lanes.part[at] : -1;
}

void surfaces_find_textures(struct surfaces *s, const struct plan *plan, const struct path_batch *paths)
{
    s->imaged.count = 0;
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++)
        s->patterned[kind].count = 0;
    for (uint32_t at = 0; at < s->count; at++) {
        const struct plan_texture *texture = &plan->textures[s->texture[at]];
        if (texture->kind == TEXTURE_CONSTANT)
            continue;
        if (texture->kind != TEXTURE_IMAGE)
            push_patterned(&s->patterned[texture->kind], plan, s, at);
        else if (texture->map != MAP_MESH)
            push_imaged(&s->imaged, plan, s, at);
        else
            lane_put(s->lanes.color, at, textured(s, plan, paths, at));
    }
}

void surfaces_look_up(struct surfaces *s, const struct plan *plan)
{
    for (int kind = 0; kind < TEXTURE_IMAGE; kind++) {
        const struct patterned *from = &s->patterned[kind];
        for (size_t i = 0; i < from->count; i++) {
            const struct vec3 *color = plan->textures[from->texture[i]].color;
            lane_put(s->lanes.color, from->surface[i], vec3_mix(color[0], color[1], from->share[i]));
        }
    }
    const struct imaged *from = &s->imaged;
    for (size_t i = 0; i < from->count; i++) {
        struct image_point at = {from->point[0][i], from->point[1][i], from->point[2][i],
                                 from->point[3][i], from->point[4][i], from->point[5][i]};
        const struct plan_texture *texture = &plan->textures[from->texture[i]];
        lane_put(s->lanes.color, from->surface[i], texture_image_color(plan, texture, &at, (int)from->face[i]));
    }
}
