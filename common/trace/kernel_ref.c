/* The scalar kernel: one ray, one primitive at a time, behind a plain tree. The others are measured against it. */
#include <math.h>

#include "trace/intersect_flat.h"
#include "trace/lanes/exports.h"

/* --- walking ---------------------------------------------------------------------------------------------- */

/* One ray on its way through the scene, and what has been found of it. */
struct walk {
    const struct plan *plan;
    struct ray ray;
    struct window window;
    struct shear shear;
    double t_limit; /* nothing beyond is of interest */
    struct crossing hit;
    struct crossing_list *crossings;
};

/* Takes a primitive that the ray may meet. Returns false to end the walk. */
typedef bool visit(struct walk *walk, uint32_t id);

/* Whether the ray is within the child's box for some t of interest. The far end is widened by the error of the two
 * roundings that lead to it (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013); in this order of the operands a ray
 * that runs in the plane of a face (0 × ∞) is not lost. */
static bool meets(const struct walk *walk, const double inverse[3], const struct bvh_node *node, int child)
{
    const double origin[3] = {walk->ray.origin.x, walk->ray.origin.y, walk->ray.origin.z};
    double near = walk->ray.t_min, far = walk->t_limit;
    for (int axis = 0; axis < 3; axis++) {
        double t0 = (node->low[axis][child] - origin[axis]) * inverse[axis];
        double t1 = (node->high[axis][child] - origin[axis]) * inverse[axis];
        double enter = inverse[axis] < 0 ? t1 : t0, leave = (inverse[axis] < 0 ? t0 : t1) * (1 + 0x1p-50);
        near = enter > near ? enter : near;
        far = leave < far ? leave : far;
    }
    return near <= far;
}

static bool walk_leaf(struct walk *walk, const struct bvh_node *node, int child, visit *take)
{
    const uint32_t *ids = walk->plan->ids[node->kind[child]] + node->child[child];
    for (int i = 0; i < node->count[child]; i++)
        if (!take(walk, ids[i]))
            return false;
    return true;
}

static bool walk_tree(struct walk *walk, visit *take)
{
    const struct bvh *bvh = &walk->plan->bvh;
    const struct vec3 d = walk->ray.direction;
    const double inverse[3] = {1 / d.x, 1 / d.y, 1 / d.z};
    uint32_t stack[BVH_STACK_MAX];
    size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const struct bvh_node *node = &bvh->nodes[stack[--depth]];
        for (int child = 0; child < BVH_WIDTH; child++) {
            if (!meets(walk, inverse, node, child))
                continue;
            if (node->count[child] == 0)
                stack[depth++] = node->child[child];
            else if (!walk_leaf(walk, node, child, take))
                return false;
        }
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
    walk.window = window_of(&walk.ray);
    walk.shear = shear_of(walk.ray.direction);
    walk.t_limit = walk.ray.t_max;
    walk.hit = (struct crossing){.t = walk.ray.t_max, .ray = (uint32_t)index, .id = PRIMITIVE_NONE};
    return walk;
}

/* --- the kernel's two calls ------------------------------------------------------------------------------- */

/* The roots at which the ray can hit the primitive. */
static struct roots walk_roots(const struct walk *walk, uint32_t id)
{
    struct roots roots = plan_roots(walk->plan, id, walk->ray.origin, walk->ray.direction, &walk->shear);
    return roots_ahead(roots, &walk->window, id, plan_wall(walk->plan, id));
}

/* Keeps the nearest root; of equally near ones that of the lowest id. */
static bool take_closest(struct walk *walk, uint32_t id)
{
    struct roots roots = walk_roots(walk, id);
    double t = roots_nearest(roots);
    if (t < walk->hit.t || (t == walk->hit.t && id < walk->hit.id && walk->hit.id != PRIMITIVE_NONE)) {
        walk->hit.t = walk->t_limit = t;
        walk->hit.id = id;
        walk->hit.side = roots.enter < INFINITY ? SIDE_ENTER : SIDE_LEAVE;
    }
    return true;
}

static void ref_closest(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    for (size_t i = 0; i < rays->count; i++) {
        struct walk walk = start_walk(plan, rays, i);
        walk_scene(&walk, take_closest);
        hits->t[i] = walk.hit.t;
        hits->key[i] = walk.hit.id == PRIMITIVE_NONE ? LANE_HIT_NONE : (double)hit_key(walk.hit.id, walk.hit.side);
    }
}

static void push_crossing(struct walk *walk, uint32_t id, double t, enum side side)
{
    struct crossing crossing = {t, walk->hit.ray, id, (uint8_t)side};
    crossing_list_push(walk->crossings, &crossing);
}

static bool take_shadow(struct walk *walk, uint32_t id)
{
    struct roots roots = walk_roots(walk, id);
    bool enters = roots.enter < INFINITY, leaves = roots.leave < INFINITY;
    if (walk->plan->primitives[id].blocks_light) {
        walk->hit.id = enters || leaves ? id : PRIMITIVE_NONE;
        return walk->hit.id == PRIMITIVE_NONE;
    }
    if (enters)
        push_crossing(walk, id, roots.enter, SIDE_ENTER);
    if (leaves)
        push_crossing(walk, id, roots.leave, SIDE_LEAVE);
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

/* The rest is the source of the other kernels, compiled for one lane. */
LANES_DECLARE(ref);

const struct kernel kernel_ref = {.name = "ref", .closest = ref_closest, .shadow = ref_shadow, LANES_STAGES(ref)};
