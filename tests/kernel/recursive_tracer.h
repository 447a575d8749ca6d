/*
 * A plain recursive tracer to measure the streaming one against: the same rays one at a time, media as arrays,
 * and what each ray finds noted down with its place in the ray tree and added up in the documented order.
 */
#ifndef WEFT_TESTS_KERNEL_RECURSIVE_TRACER_H
#define WEFT_TESTS_KERNEL_RECURSIVE_TRACER_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "math/elementary.h"
#include "tests/phong.h"
#include "trace/children.h"
#include "trace/intersect_flat.h"
#include "trace/optics.h"
#include "trace/sample.h"
#include "trace/surface.h"
#include "trace/texture.h"

/* --- hits ------------------------------------------------------------------------------------------------- */

/* A ray of the recursive tracer, and the objects that it is inside of, outermost first. */
enum { INSIDE_MAX = 32 };
struct walk {
    struct ray ray;
    struct vec3 throughput;
    struct footprint footprint;
    uint32_t inside[INSIDE_MAX];
    unsigned depth_inside;
};

/* Every root that the ray may hit, in no order; the count. A hit's (t, id, side) orders it. */
static size_t roots_of(const struct plan *plan, const struct ray *ray, struct hit *hits, size_t capacity)
{
    struct shear shear = shear_of(ray->direction);
    size_t count = 0;
    for (uint32_t id = 0; id < plan->primitive_count; id++) {
        struct roots roots = plan_roots(plan, id, ray->origin, ray->direction, &shear);
        if (id != ray->from && roots.enter > roots.leave)
            continue;
        enum primitive_kind kind = plan->primitives[id].kind;
        bool flat = kind == PRIMITIVE_PLANE || kind == PRIMITIVE_DISC || kind == PRIMITIVE_TRIANGLE;
        bool open = kind == PRIMITIVE_FRUSTUM && plan->frustums[plan->primitives[id].index].open;
        for (enum side side = SIDE_ENTER; side <= SIDE_LEAVE; side++) {
            double t = side == SIDE_ENTER ? roots.enter : roots.leave;
            bool after = t > ray->t_min || (t == ray->t_min && hit_key(id, side) > ray->key_min);
            if (id == ray->from) {
                /* What goes in comes out. */
                bool far_wall = side == SIDE_LEAVE && !flat && ray->departure == DEPART_INWARD && !(open && isnan(t));
                if (far_wall && ray->key_min == KEY_NONE) {
                    t = t > 0 ? t : 0;
                    after = true;
                }
                after = after && far_wall;
            }
            if (!after || !(t < ray->t_max))
                continue;
            assert_true(count < capacity);
            hits[count++] = (struct hit){t, id, side, plan_part(plan, id, ray->origin, ray->direction, side)};
        }
    }
    return count;
}

static bool is_before(const struct hit *a, const struct hit *b)
{
    return a->t < b->t || (a->t == b->t && hit_key(a->id, a->side) < hit_key(b->id, b->side));
}

static void sort_hits(struct hit *hits, size_t count)
{
    for (size_t i = 1; i < count; i++)
        for (size_t k = i; k > 0 && is_before(&hits[k], &hits[k - 1]); k--) {
            struct hit swap = hits[k];
            hits[k] = hits[k - 1];
            hits[k - 1] = swap;
        }
}

static uint32_t object_of(const struct plan *plan, const struct hit *hit)
{
    return plan->primitives[hit->id].object;
}

static const struct plan_material *material_of(const struct plan *plan, const struct hit *hit)
{
    return &plan->materials[plan->objects[object_of(plan, hit)].material];
}

static struct vec3 absorbed(const struct plan_material *material, double length)
{
    return vec3_make(math_exp(-material->absorption.x * length), math_exp(-material->absorption.y * length),
                     math_exp(-material->absorption.z * length));
}

/* --- shadows ---------------------------------------------------------------------------------------------- */

/* Of crossings first..last of one object: where the one at `at` began, found by matching from the front. */
static double began_at(const struct plan *plan, const struct hit *hits, size_t at)
{
    double open[64];
    size_t depth = 0;
    for (size_t i = 0; i < at; i++) {
        if (object_of(plan, &hits[i]) != object_of(plan, &hits[at]))
            continue;
        if (hits[i].side == SIDE_ENTER)
            open[depth++] = hits[i].t;
        else if (depth > 0)
            depth--;
    }
    return depth > 0 ? open[depth - 1] : 0;
}

static bool is_left_again(const struct plan *plan, const struct hit *hits, size_t at, size_t count)
{
    int depth = 1;
    for (size_t i = at + 1; i < count; i++)
        if (object_of(plan, &hits[i]) == object_of(plan, &hits[at])) {
            depth += hits[i].side == SIDE_ENTER ? 1 : -1;
            if (depth == 0)
                return true;
        }
    return false;
}

/* Whether the ray, which starts inside the object, ends there without meeting a wall of it. */
static bool stays_within(const struct plan *plan, uint32_t object, const struct ray *ray, const struct hit *hits,
                         size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (object_of(plan, &hits[i]) == object)
            return false;
    return isfinite(ray->t_max);
}

/* From a point that is inside of what the walk is inside of. */
static struct vec3 light_through(const struct plan *plan, const struct walk *walk, const struct ray *ray)
{
    struct hit hits[256];
    size_t count = roots_of(plan, ray, hits, 256);
    sort_hits(hits, count);
    struct vec3 product = {1, 1, 1};
    for (size_t i = 0; i < count; i++)
        if (plan->primitives[hits[i].id].blocks_light)
            return vec3_make(0, 0, 0);
    for (size_t i = 0; i < count; i++) {
        const struct plan_material *material = material_of(plan, &hits[i]);
        struct vec3 share = vec3_scale(material->filter, material->transparency);
        if (material->dielectric) {
            struct vec3 normal = surface_at(plan, ray, &hits[i]).normal;
            normal = hits[i].side == SIDE_ENTER ? normal : vec3_neg(normal);
            share = vec3_scale(material->filter,
                               1 - optics_refraction(ray->direction, normal, 1, material->ior).reflectance);
        }
        product = vec3_mul(product, share);
        if (!material->absorbs)
            continue;
        if (hits[i].side == SIDE_LEAVE)
            product = vec3_mul(product, absorbed(material, hits[i].t - began_at(plan, hits, i)));
        else if (isfinite(ray->t_max) && !is_left_again(plan, hits, i, count))
            product = vec3_mul(product, absorbed(material, ray->t_max - hits[i].t));
    }
    if (walk->depth_inside > 0) {
        uint32_t around = walk->inside[walk->depth_inside - 1];
        if (stays_within(plan, around, ray, hits, count))
            product = vec3_mul(product, absorbed(&plan->materials[plan->objects[around].material], ray->t_max));
    }
    return product;
}

/* --- the tree --------------------------------------------------------------------------------------------- */

/* What a ray found. Its place in the tree: path[k] is 0 for mirrored and 1 for transmitted at level k. */
struct finding {
    unsigned level;
    uint8_t path[SCENE_DEPTH_MAX];
    struct vec3 radiance;
};

struct findings {
    struct finding *items;
    size_t count, capacity;
};

static void note(struct findings *findings, unsigned level, const uint8_t *path, struct vec3 radiance)
{
    findings->items =
        memory_grow(findings->items, &findings->capacity, findings->count + 1, sizeof *findings->items);
    struct finding *finding = &findings->items[findings->count++];
    *finding = (struct finding){.level = level, .radiance = radiance};
    memcpy(finding->path, path, level);
}

/* By level, then mirrored before transmitted, from the last step back to the first. */
static int compare_findings(const void *left, const void *right)
{
    const struct finding *a = left, *b = right;
    if (a->level != b->level)
        return a->level < b->level ? -1 : 1;
    unsigned step = a->level;
    while (step > 0 && a->path[step - 1] == b->path[step - 1])
        step--;
    return step > 0 ? a->path[step - 1] - b->path[step - 1] : 0;
}

/* What shading needs of a hit, worked out anew. */
struct view {
    struct hit hit;
    const struct hit *walls; /* where it is one of several walls in one place, in the order of crossing */
    size_t wall_count;
    struct hit last;     /* the one met last */
    double wall_spacing; /* how far apart they may be, across */
    struct surface surface;
    struct surface_footprint spread;
    struct vec3 normal, shading_normal, color;
    const struct plan_material *material;
};

static struct view view_of(const struct plan *plan, const struct walk *walk, const struct hit *hit)
{
    struct view view = {.hit = *hit, .walls = hit, .wall_count = 1, .last = *hit, .material = material_of(plan, hit)};
    view.surface = surface_at(plan, &walk->ray, hit);
    if (plan->needs_footprints)
        view.spread = surface_footprint_at(plan, &walk->ray, &walk->footprint, hit, &view.surface);
    view.color = surface_color(plan, hit, &view.surface, plan->needs_footprints ? &view.spread : NULL);
    double sign = hit->side == SIDE_ENTER ? 1 : -1;
    view.normal = vec3_scale(view.surface.normal, sign);
    view.shading_normal = vec3_scale(view.surface.shading_normal, sign);
    if (vec3_dot(view.shading_normal, walk->ray.direction) > 0)
        view.shading_normal = view.normal;
    return view;
}

static bool is_crossed_before(const struct hit *a, const struct hit *b)
{
    return a->side != b->side ? a->side == SIDE_ENTER : a->id < b->id;
}

/* The view of the walls in one place that hits[0], a wall itself, is the first of. They come into the order of
 * crossing: first those entered by, in the order of the scene, the last of which is seen. */
static struct view boundary_view(const struct plan *plan, const struct walk *walk, struct hit *hits, size_t count)
{
    double window = 2 * COINCIDENCE * (fabs(hits[0].t) + vec3_max_abs(walk->ray.origin)), end = hits[0].t + window;
    size_t walls = 1, seen = 0;
    while (walls < count && material_of(plan, &hits[walls])->dielectric && hits[walls].t < end)
        walls++;
    struct hit last = hits[walls - 1];
    for (size_t i = 1; i < walls; i++)
        for (size_t k = i; k > 0 && is_crossed_before(&hits[k], &hits[k - 1]); k--) {
            struct hit swap = hits[k];
            hits[k] = hits[k - 1];
            hits[k - 1] = swap;
        }
    while (seen + 1 < walls && hits[seen + 1].side == hits[0].side)
        seen++;
    struct view view = view_of(plan, walk, &hits[seen]);
    view.walls = hits;
    view.wall_count = walls;
    view.last = last;
    if (walls > 1) {
        window = 2 * COINCIDENCE * (fabs(hits[seen].t) + vec3_max_abs(walk->ray.origin));
        view.wall_spacing = 2 * window * fabs(vec3_dot(walk->ray.direction, view.surface.normal));
    }
    return view;
}

static struct ray leaving(const struct view *view, struct vec3 direction, bool same_side)
{
    double cosine = fabs(vec3_dot(direction, view->surface.normal));
    double error = view->surface.error + view->wall_spacing;
    error = cosine > 0 ? error / cosine : error;
    bool outward = (view->hit.side == SIDE_ENTER) == same_side;
    return (struct ray){view->surface.position,
                        direction,
                        error + COINCIDENCE * vec3_max_abs(view->surface.position),
                        INFINITY,
                        KEY_NONE,
                        view->hit.id,
                        outward ? DEPART_OUTWARD : DEPART_INWARD};
}

static struct vec3 local_radiance(const struct plan *plan, const struct walk *walk, const struct view *view)
{
    struct vec3 own = vec3_scale(vec3_mul(view->color, view->material->surface_share), view->material->ambient);
    struct vec3 sum = vec3_mul(own, plan->ambient);
    for (size_t i = 0; i < plan->light_count; i++) {
        struct light_arrival arrival;
        if (!light_arrive(&plan->lights[i], view->surface.position, &arrival) ||
            vec3_dot(view->normal, arrival.direction) <= 0)
            continue;
        struct vec3 answer = phong(view->material, view->color, view->shading_normal, walk->ray.direction,
                                         arrival.direction);
        struct ray ray = leaving(view, arrival.direction, true);
        ray.t_max = arrival.distance * (1 - COINCIDENCE) - ray.t_min;
        if (!vec3_is_zero(answer))
            sum = vec3_add(sum, vec3_mul(vec3_mul(answer, arrival.strength), light_through(plan, walk, &ray)));
    }
    return sum;
}

static struct vec3 surroundings(const struct plan *plan, const struct walk *walk)
{
    const struct background *background = &plan->background;
    if (background->kind == BACKGROUND_CONSTANT)
        return background->color[0];
    if (background->kind == BACKGROUND_GRADIENT)
        return vec3_mix(background->color[0], background->color[1], 0.5 * (walk->ray.direction.y + 1));
    const struct footprint *footprint = &walk->footprint;
    struct vec3 middle = vec3_add_scaled(walk->ray.direction, footprint->direction_x, footprint->shift_x);
    middle = vec3_add_scaled(middle, footprint->direction_y, footprint->shift_y);
    return texture_surroundings(&plan->images[background->image], middle, footprint->direction_x,
                                footprint->direction_y);
}

static void follow(const struct plan *plan, struct walk *walk, unsigned level, uint8_t *path,
                   struct findings *findings);

/* Goes on if the throughput is worth it. */
static void follow_child(const struct plan *plan, struct walk *child, unsigned level, uint8_t *path,
                         uint8_t step, struct findings *findings)
{
    if (vec3_max(child->throughput) < THROUGHPUT_MIN)
        return;
    path[level] = step;
    follow(plan, child, level + 1, path, findings);
}

static struct walk mirrored(const struct plan *plan, const struct walk *walk, const struct view *view,
                            struct vec3 share)
{
    struct walk child = *walk;
    struct vec3 in = walk->ray.direction, normal = view->shading_normal;
    if (vec3_dot(optics_reflect(in, normal), view->normal) <= 0)
        normal = view->normal;
    child.ray = leaving(view, optics_reflect(in, normal), true);
    child.throughput = vec3_mul(walk->throughput, share);
    if (plan->needs_footprints) {
        double sign = view->hit.side == SIDE_ENTER ? 1 : -1;
        struct vec3 by_x = vec3_scale(view->spread.normal_x, sign),
                    by_y = vec3_scale(view->spread.normal_y, sign);
        child.footprint =
            (struct footprint){view->spread.position_x, view->spread.position_y,
                               optics_reflect_change(in, normal, walk->footprint.direction_x, by_x),
                               optics_reflect_change(in, normal, walk->footprint.direction_y, by_y),
                               walk->footprint.shift_x, walk->footprint.shift_y};
    }
    return child;
}

static struct walk straight(const struct walk *walk, const struct view *view, struct vec3 share)
{
    struct walk child = *walk;
    child.ray.t_min = view->last.t;
    child.ray.key_min = hit_key(view->last.id, view->last.side);
    child.throughput = vec3_mul(walk->throughput, share);
    return child;
}

static struct walk refracted(const struct plan *plan, const struct walk *walk, const struct view *view,
                             const struct refraction *refraction, struct vec3 normal, struct vec3 filter)
{
    struct walk child = *walk;
    struct vec3 in = walk->ray.direction;
    child.ray = leaving(view, optics_refract(refraction, in, normal), false);
    child.ray.t_min = -child.ray.t_min;
    child.throughput = vec3_mul(walk->throughput, vec3_scale(filter, 1 - refraction->reflectance));
    if (plan->needs_footprints) {
        double sign = view->hit.side == SIDE_ENTER ? 1 : -1;
        struct vec3 by_x = vec3_scale(view->spread.normal_x, sign),
                    by_y = vec3_scale(view->spread.normal_y, sign);
        child.footprint = (struct footprint){
            view->spread.position_x, view->spread.position_y,
            optics_refract_change(refraction, in, normal, walk->footprint.direction_x, by_x),
            optics_refract_change(refraction, in, normal, walk->footprint.direction_y, by_y),
            walk->footprint.shift_x, walk->footprint.shift_y};
    }
    return child;
}

static double ior_of(const struct plan *plan, const struct walk *walk)
{
    if (walk->depth_inside == 0)
        return 1;
    return plan->materials[plan->objects[walk->inside[walk->depth_inside - 1]].material].ior;
}

/* The innermost place of an object among those that the walk is inside of, or −1. */
static int find_inside(const struct walk *walk, uint32_t object)
{
    int at = (int)walk->depth_inside - 1;
    while (at >= 0 && walk->inside[at] != object)
        at--;
    return at;
}

/* Into the object of the hit, or out of it. */
static void cross(struct walk *walk, uint32_t object, enum side side)
{
    int at = find_inside(walk, object);
    if (side == SIDE_ENTER) {
        assert_true(walk->depth_inside < INSIDE_MAX);
        walk->inside[walk->depth_inside++] = object;
    } else if (at >= 0) {
        memmove(&walk->inside[at], &walk->inside[at + 1],
                (size_t)(walk->depth_inside - 1 - (unsigned)at) * sizeof *walk->inside);
        walk->depth_inside--;
    }
}

static void follow_dielectric(const struct plan *plan, const struct walk *walk, const struct view *view,
                              unsigned level, uint8_t *path, struct findings *findings)
{
    struct walk beyond = *walk, child;
    struct vec3 filter = {1, 1, 1};
    for (size_t i = 0; i < view->wall_count; i++) {
        cross(&beyond, object_of(plan, &view->walls[i]), view->walls[i].side);
        filter = vec3_mul(filter, material_of(plan, &view->walls[i])->filter);
    }
    double from = ior_of(plan, walk), to = ior_of(plan, &beyond);
    if (from == to) {
        child = straight(&beyond, view, filter);
        follow_child(plan, &child, level, path, 1, findings);
        return;
    }
    struct vec3 normal = view->shading_normal, in = walk->ray.direction;
    struct refraction refraction = optics_refraction(in, normal, from, to);
    if (!refraction.total && vec3_dot(optics_refract(&refraction, in, normal), view->normal) >= 0) {
        normal = view->normal;
        refraction = optics_refraction(in, normal, from, to);
    }
    double reflectance = refraction.reflectance;
    child = mirrored(plan, walk, view, vec3_make(reflectance, reflectance, reflectance));
    follow_child(plan, &child, level, path, 0, findings);
    if (reflectance < 1) {
        child = refracted(plan, &beyond, view, &refraction, normal, filter);
        follow_child(plan, &child, level, path, 1, findings);
    }
}

/* Whether the hit is, where a refracted walk starts, a wall that it crossed there. */
static bool is_crossed_already(const struct plan *plan, const struct walk *walk, const struct hit *hit)
{
    bool is_inside = find_inside(walk, object_of(plan, hit)) >= 0;
    return hit->t <= -walk->ray.t_min && material_of(plan, hit)->dielectric &&
           is_inside == (hit->side == SIDE_ENTER);
}

static void follow(const struct plan *plan, struct walk *walk, unsigned level, uint8_t *path,
                   struct findings *findings)
{
    struct hit all[256], *hits = all;
    size_t count = roots_of(plan, &walk->ray, hits, 256);
    sort_hits(hits, count);
    for (; count > 0 && is_crossed_already(plan, walk, hits); count--)
        hits++;
    if (count == 0) {
        note(findings, level, path, vec3_mul(walk->throughput, surroundings(plan, walk)));
        return;
    }
    bool is_wall = material_of(plan, hits)->dielectric;
    struct view view = is_wall ? boundary_view(plan, walk, hits, count) : view_of(plan, walk, hits);
    if (walk->depth_inside > 0) {
        const struct plan_material *medium =
            &plan->materials[plan->objects[walk->inside[walk->depth_inside - 1]].material];
        double start = walk->ray.key_min == KEY_NONE ? 0 : walk->ray.t_min;
        if (medium->absorbs)
            walk->throughput = vec3_mul(walk->throughput, absorbed(medium, view.hit.t - start));
    }
    note(findings, level, path, vec3_mul(walk->throughput, local_radiance(plan, walk, &view)));
    if (level == plan->depth)
        return;
    if (view.material->dielectric) {
        follow_dielectric(plan, walk, &view, level, path, findings);
        return;
    }
    if (view.material->traits & TRAIT_MIRRORS) {
        struct walk child = mirrored(plan, walk, &view, view.material->reflection);
        follow_child(plan, &child, level, path, 0, findings);
    }
    if (view.material->traits & TRAIT_TRANSMITS) {
        struct walk child =
            straight(walk, &view, vec3_scale(view.material->filter, view.material->transparency));
        follow_child(plan, &child, level, path, 1, findings);
    }
}

/* --- pixels ----------------------------------------------------------------------------------------------- */

/* The sample's middle and width in one coordinate, where its position is `at`. */
static struct sample_cell cell_of(double at, double share, uint32_t cells, uint32_t samples, enum pixel_filter filter)
{
    return cells ? sample_cell(share, cells, filter) : (struct sample_cell){at, sample_width(samples, filter)};
}

static struct walk camera_walk(const struct plan *plan, uint32_t x, uint32_t y, uint32_t index, uint32_t samples)
{
    enum pixel_filter filter = plan->settings.filter;
    struct sample_position at = sample_position(x, y, index, samples, filter);
    struct sample_position share = sample_shares(x, y, sample_digits(index), 0);
    struct sample_cells cells = sample_cells(0, samples, filter);
    const struct plan_camera *camera = &plan->camera;
    struct vec3 v = vec3_add_scaled(camera->corner, camera->right, x + at.x);
    v = vec3_add_scaled(v, camera->down, y + at.y);
    struct vec3 d = vec3_normalize(v);
    struct walk walk = {.ray = {.direction = d, .t_max = INFINITY, .key_min = KEY_NONE, .from = PRIMITIVE_NONE},
                        .throughput = {1, 1, 1},
                        .depth_inside = (unsigned)plan->camera_media_count};
    for (size_t i = 0; i < plan->camera_media_count; i++)
        walk.inside[i] = plan->camera_media[i];
    if (plan->needs_footprints) {
        struct sample_cell across = cell_of(at.x, share.x, cells.across, samples, filter);
        struct sample_cell down = cell_of(at.y, share.y, cells.down, samples, filter);
        struct vec3 right = vec3_add_scaled(camera->right, d, -vec3_dot(camera->right, d));
        struct vec3 below = vec3_add_scaled(camera->down, d, -vec3_dot(camera->down, d));
        walk.footprint.direction_x = vec3_scale(right, across.width / vec3_length(v));
        walk.footprint.direction_y = vec3_scale(below, down.width / vec3_length(v));
        walk.footprint.shift_x = (across.middle - at.x) / across.width;
        walk.footprint.shift_y = (down.middle - at.y) / down.width;
    }
    return walk;
}

/* The mean of the pixel's samples. */
static struct vec3 recursive_pixel(const struct plan *plan, uint32_t x, uint32_t y, uint32_t samples)
{
    struct vec3 pixel = {0, 0, 0};
    for (uint32_t index = 0; index < samples; index++) {
        struct findings findings = {0};
        uint8_t path[SCENE_DEPTH_MAX + 1] = {0};
        struct walk walk = camera_walk(plan, x, y, index, samples);
        follow(plan, &walk, 0, path, &findings);
        qsort(findings.items, findings.count, sizeof *findings.items, compare_findings);
        struct vec3 radiance = {0, 0, 0};
        for (size_t i = 0; i < findings.count; i++)
            radiance = vec3_add(radiance, findings.items[i].radiance);
        pixel = vec3_add(pixel, radiance);
        free(findings.items);
    }
    return vec3_make(pixel.x / samples, pixel.y / samples, pixel.z / samples);
}

#endif
