/* The scalar kernel: one ray, one primitive at a time, behind a plain tree. The others are measured against it. */
#include <math.h>

#include "trace/kernel.h"

/* Whether what goes into it must come out of it again. */
static bool is_solid(const struct plan *plan, const struct primitive *primitive)
{
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
    case PRIMITIVE_ELLIPSOID:
    case PRIMITIVE_BOX:
        return true;
    case PRIMITIVE_FRUSTUM:
        return !plan->frustums[primitive->index].open;
    default:
        return false;
    }
}

/* In the order of (t, key), after where the ray begins. */
static bool is_beyond(const struct ray *ray, double t, uint32_t id, enum side side)
{
    return t > ray->t_min || (t == ray->t_min && hit_key(id, side) > ray->key_min);
}

/* The roots of the primitive that the ray itself starts on: none, or its far wall if the ray goes in. What goes into a
 * solid comes out, also where rounding puts the far wall behind the ray's start or has the ray miss altogether. */
static struct span own_roots(const struct plan *plan, const struct ray *ray, uint32_t id, struct span span)
{
    const struct primitive *primitive = &plan->primitives[id];
    bool solid = is_solid(plan, primitive);
    if (ray->departure == DEPART_OUTWARD || (!solid && primitive->kind != PRIMITIVE_FRUSTUM))
        span.roots = 0;
    else
        span.roots = solid ? SPAN_LEAVE : span.roots & SPAN_LEAVE;
    if (ray->key_min == KEY_NONE)
        span.leave = span.leave > 0 ? span.leave : 0;
    else if (!is_beyond(ray, span.leave, id, SIDE_LEAVE))
        span.roots = 0;
    return span;
}

/* The roots at which the ray can hit the primitive. */
static struct span roots_ahead(const struct plan *plan, const struct ray *ray, const struct shear *shear, uint32_t id)
{
    struct span span = plan_span(plan, id, ray->origin, ray->direction, shear);
    if (id == ray->from) {
        span = own_roots(plan, ray, id, span);
    } else {
        if (!is_beyond(ray, span.enter, id, SIDE_ENTER))
            span.roots &= (uint8_t)~SPAN_ENTER;
        if (!is_beyond(ray, span.leave, id, SIDE_LEAVE))
            span.roots &= (uint8_t)~SPAN_LEAVE;
    }
    if (!(span.enter < ray->t_max))
        span.roots &= (uint8_t)~SPAN_ENTER;
    if (!(span.leave < ray->t_max))
        span.roots &= (uint8_t)~SPAN_LEAVE;
    return span;
}

/* --- walking ---------------------------------------------------------------------------------------------- */

/* One ray on its way through the scene, and what has been found of it. */
struct walk {
    const struct plan *plan;
    struct ray ray;
    struct shear shear;
    double t_limit; /* nothing beyond is of interest */
    struct crossing hit;
    struct crossing_list *crossings;
};

/* Takes a primitive that the ray may meet. Returns false to end the walk. */
typedef bool visit(struct walk *walk, uint32_t id);

/* Whether the ray is within the node's box for some t of interest. The far end is widened by the error of the two
 * roundings that lead to it (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013); in this order of the operands a ray
 * that runs in the plane of a face (0 × ∞) is not lost. */
static bool meets(const struct walk *walk, const double inverse[3], const struct bvh_node *node)
{
    const double origin[3] = {walk->ray.origin.x, walk->ray.origin.y, walk->ray.origin.z};
    double near = walk->ray.t_min, far = walk->t_limit;
    for (int axis = 0; axis < 3; axis++) {
        double t0 = (node->low[axis] - origin[axis]) * inverse[axis];
        double t1 = (node->high[axis] - origin[axis]) * inverse[axis];
        double enter = inverse[axis] < 0 ? t1 : t0, leave = (inverse[axis] < 0 ? t0 : t1) * (1 + 0x1p-50);
        near = enter > near ? enter : near;
        far = leave < far ? leave : far;
    }
    return near <= far;
}

static bool walk_leaf(struct walk *walk, const struct bvh_node *leaf, visit *take)
{
    for (uint32_t i = 0; i < leaf->count; i++)
        if (!take(walk, walk->plan->bvh.ids[leaf->first + i]))
            return false;
    return true;
}

static bool walk_tree(struct walk *walk, visit *take)
{
    const struct bvh *bvh = &walk->plan->bvh;
    const struct vec3 d = walk->ray.direction;
    const double inverse[3] = {1 / d.x, 1 / d.y, 1 / d.z};
    uint32_t stack[2 * BVH_DEPTH_MAX + 2];
    size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const struct bvh_node *node = &bvh->nodes[stack[--depth]];
        if (!meets(walk, inverse, node))
            continue;
        if (node->count > 0) {
            if (!walk_leaf(walk, node, take))
                return false;
            continue;
        }
        stack[depth++] = node->first + 1;
        stack[depth++] = node->first;
    }
    return true;
}

static void walk_scene(struct walk *walk, visit *take)
{
    const struct plan *plan = walk->plan;
    if (plan->bvh.node_count == 0) {
        for (uint32_t id = 0; id < plan->primitive_count; id++)
            if (!take(walk, id))
                return;
        return;
    }
    for (size_t i = 0; i < plan->bvh.loose_count; i++)
        if (!take(walk, plan->bvh.loose[i]))
            return;
    walk_tree(walk, take);
}

static struct walk start_walk(const struct plan *plan, const struct ray_batch *rays, size_t index)
{
    struct walk walk = {.plan = plan, .ray = ray_batch_get(rays, index)};
    walk.shear = shear_of(walk.ray.direction);
    walk.t_limit = walk.ray.t_max;
    walk.hit = (struct crossing){.t = INFINITY, .ray = (uint32_t)index, .id = PRIMITIVE_NONE};
    return walk;
}

/* --- the kernel's two calls ------------------------------------------------------------------------------- */

/* Keeps the nearest root; of equally near ones that of the lowest id. */
static bool take_closest(struct walk *walk, uint32_t id)
{
    struct span span = roots_ahead(walk->plan, &walk->ray, &walk->shear, id);
    if (!span.roots)
        return true;
    bool enters = span.roots & SPAN_ENTER;
    double t = enters ? span.enter : span.leave;
    if (!(t < walk->hit.t || (t == walk->hit.t && id < walk->hit.id)))
        return true;
    walk->hit.t = walk->t_limit = t;
    walk->hit.id = id;
    walk->hit.side = enters ? SIDE_ENTER : SIDE_LEAVE;
    walk->hit.part = enters ? span.enter_part : span.leave_part;
    return true;
}

static void ref_closest(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    for (size_t i = 0; i < rays->count; i++) {
        struct walk walk = start_walk(plan, rays, i);
        walk_scene(&walk, take_closest);
        hits->t[i] = walk.hit.t;
        hits->id[i] = walk.hit.id;
        hits->side[i] = walk.hit.side;
        hits->part[i] = walk.hit.part;
    }
}

static bool take_shadow(struct walk *walk, uint32_t id)
{
    struct span span = roots_ahead(walk->plan, &walk->ray, &walk->shear, id);
    if (walk->plan->primitives[id].blocks_light) {
        walk->hit.id = span.roots ? id : PRIMITIVE_NONE;
        return !span.roots;
    }
    struct crossing crossing = {.ray = walk->hit.ray, .id = id};
    if (span.roots & SPAN_ENTER) {
        crossing.t = span.enter;
        crossing.side = SIDE_ENTER;
        crossing.part = span.enter_part;
        crossing_list_push(walk->crossings, &crossing);
    }
    if (span.roots & SPAN_LEAVE) {
        crossing.t = span.leave;
        crossing.side = SIDE_LEAVE;
        crossing.part = span.leave_part;
        crossing_list_push(walk->crossings, &crossing);
    }
    return true;
}

static void ref_shadow(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                       struct crossing_list *crossings)
{
    for (size_t i = 0; i < rays->count; i++) {
        struct walk walk = start_walk(plan, rays, i);
        walk.crossings = crossings;
        walk_scene(&walk, take_shadow);
        blocked[i] = walk.hit.id != PRIMITIVE_NONE;
    }
}

const struct kernel kernel_ref = {"ref", ref_closest, ref_shadow};
