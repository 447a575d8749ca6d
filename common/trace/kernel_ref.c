/* The scalar kernel: one ray, one primitive at a time, behind a plain tree. The others are measured against it. */
#include <math.h>

#include "trace/instance.h"
#include "trace/intersect_flat.h"
#include "trace/lanes/exports.h"

/* --- walking ---------------------------------------------------------------------------------------------- */

/* One ray on its way through the scene, and what has been found of it. */
struct walk {
    const struct plan *plan;
    struct ray ray;
    struct window window;
    struct shear shear;
    struct vec3 start; /* the origin, or where a distant ray is taken to start */
    double shift;      /* what is between them */
    double t_limit; /* nothing beyond is of interest */
    struct crossing hit;
    struct crossing_list *crossings;
};

/* Takes a primitive that the ray may meet. Returns false to end the walk. */
typedef bool visit(struct walk *walk, uint32_t id);

/* Where a tree is walked through: the world, or the mesh of an instance. */
struct space {
    const struct bvh_node *nodes;
    const struct instance *instance; /* or NULL */
    double origin[3], inverse[3];    /* the ray's, the latter of its direction's coordinates */
    double slop;                     /* by how much the ends of what is of interest are moved */
};

static struct space space_make(const struct bvh *bvh, struct vec3 origin, struct vec3 direction)
{
    return (struct space){.nodes = bvh->nodes,
                          .origin = {origin.x, origin.y, origin.z},
                          .inverse = {1 / direction.x, 1 / direction.y, 1 / direction.z}};
}

/* Whether the ray is within the child's box for some t of interest. The far end is widened by the error of the two
 * roundings that lead to it (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013); in this order of the operands a ray
 * that runs in the plane of a face (0 × ∞) is not lost. */
static bool meets(const struct walk *walk, const struct space *space, const struct bvh_node *node, int child)
{
    const double *origin = space->origin, *inverse = space->inverse;
    double slop = space->slop + shift_slop(walk->shift);
    double near = walk->ray.t_min - walk->shift - slop, far = walk->t_limit - walk->shift + slop;
    for (int axis = 0; axis < 3; axis++) {
        double t0 = (node->low[axis][child] - origin[axis]) * inverse[axis];
        double t1 = (node->high[axis][child] - origin[axis]) * inverse[axis];
        double enter = inverse[axis] < 0 ? t1 : t0, leave = (inverse[axis] < 0 ? t0 : t1) * (1 + 0x1p-50);
        near = enter > near ? enter : near;
        far = leave < far ? leave : far;
    }
    return near <= far;
}

static bool walk_tree(struct walk *walk, const struct space *space, visit *take);

/* Takes all triangles of an instance that the ray may meet. */
static bool walk_instance(struct walk *walk, const struct instance *instance, visit *take)
{
    const struct bvh *bvh = &instance->mesh->bvh;
    struct space space = space_make(bvh, instance_origin(instance, walk->start),
                                    instance_direction(instance, walk->ray.direction));
    space.instance = instance;
    space.slop = instance->slop;
    for (size_t i = 0; i < bvh->loose_count; i++)
        if (!take(walk, instance->first_id + bvh->loose[i]))
            return false;
    return walk_tree(walk, &space, take);
}

static bool walk_primitive(struct walk *walk, const struct primitive *primitive, visit *take)
{
    if (primitive->kind == PRIMITIVE_INSTANCE)
        return walk_instance(walk, &walk->plan->instances[primitive->index], take);
    return take(walk, primitive->id);
}

static bool walk_leaf(struct walk *walk, const struct space *space, const struct bvh_node *node, int child,
                      visit *take)
{
    const struct plan *plan = walk->plan;
    for (size_t i = node->child[child]; i < node->child[child] + node->count[child]; i++) {
        bool goes_on = space->instance
                           ? take(walk, space->instance->first_id + space->instance->mesh->order[i])
                           : walk_primitive(walk, plan_primitive(plan, plan->ids[node->kind[child]][i]), take);
        if (!goes_on)
            return false;
    }
    return true;
}

static bool walk_tree(struct walk *walk, const struct space *space, visit *take)
{
    uint32_t stack[BVH_STACK_MAX];
    size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const struct bvh_node *node = &space->nodes[stack[--depth]];
        for (int child = 0; child < BVH_WIDTH; child++) {
            if (!meets(walk, space, node, child))
                continue;
            if (node->count[child] == 0)
                stack[depth++] = node->child[child];
            else if (!walk_leaf(walk, space, node, child, take))
                return false;
        }
    }
    return true;
}

static void walk_scene(struct walk *walk, visit *take)
{
    const struct plan *plan = walk->plan;
    if (plan->bvh.node_count == 0) {
        for (size_t i = 0; i < plan->primitive_count; i++)
            if (!walk_primitive(walk, &plan->primitives[i], take))
                return;
        return;
    }
    for (size_t i = 0; i < plan->bvh.loose_count; i++)
        if (!walk_primitive(walk, &plan->primitives[plan->bvh.loose[i]], take))
            return;
    if (is_distant(walk->start, plan->bvh.extent))
        return;
    struct space space = space_make(&plan->bvh, walk->start, walk->ray.direction);
    walk_tree(walk, &space, take);
}

static struct walk start_walk(const struct plan *plan, const struct ray_batch *rays, size_t index)
{
    struct walk walk = {.plan = plan, .ray = ray_batch_get(rays, index)};
    walk.window = window_of(&walk.ray);
    walk.shear = shear_of(walk.ray.direction);
    walk.shift = ray_shift(walk.ray.origin, walk.ray.direction, plan->bvh.extent);
    walk.start = vec3_add_scaled(walk.ray.origin, walk.ray.direction, walk.shift);
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
    if (plan_primitive(walk->plan, id)->blocks_light) {
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
