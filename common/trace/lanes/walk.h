/*
 * The walk through the tree that brings a packet to the primitives that its rays may meet.
 *
 * It is a hybrid: while many rays of a packet go the same way they are tested together, 64 rays against one box; once
 * only a few are left in a branch, each of them walks it alone, one ray against eight boxes. Either way the tree only
 * leaves out what no ray can hit, so it cannot change a bit.
 */
#ifndef WEFT_TRACE_LANES_WALK_H
#define WEFT_TRACE_LANES_WALK_H

#include "trace/lanes/take.h"

enum { FEW_RAYS = 6 }; /* so few rays of a packet walk alone (measured) */

struct branch {
    uint64_t lanes;
    uint32_t node;
    float near;
};

/* Puts a branch on the stack, above `bottom` nearer ones last, and calls for its node; returns the new depth. */
static inline int stack_insert(struct branch *stack, int bottom, int depth, struct branch branch,
                               const struct bvh_node *nodes)
{
    const char *node = (const char *)&nodes[branch.node];
    int at = depth;
    for (size_t line = 0; line < sizeof *nodes; line += 64)
        __builtin_prefetch(node + line);
    for (; at > bottom && stack[at - 1].near < branch.near; at--)
        stack[at] = stack[at - 1];
    stack[at] = branch;
    return depth + 1;
}

/* --- one ray ---------------------------------------------------------------------------------------------- */

/* A ray as boxes see it. */
struct box_ray {
    float origin[3], inverse[3], near;
};

static inline struct box_ray box_ray_of(const struct packet *p, int ray)
{
    return (struct box_ray){
        {p->box_origin[0][ray], p->box_origin[1][ray], p->box_origin[2][ray]},
        {p->inverse[0][ray], p->inverse[1][ray], p->inverse[2][ray]},
        p->near[ray],
    };
}

/* Which children the ray may meet up to `far`, and where it enters them. */
static inline uint32_t ray_children(const struct box_ray *ray, float far, const struct bvh_node *node, float *near)
{
    _Alignas(32) float leave[BVH_WIDTH];
    const float start = ray->near, ox = ray->origin[0], oy = ray->origin[1], oz = ray->origin[2];
    const float ix = ray->inverse[0], iy = ray->inverse[1], iz = ray->inverse[2];
    const float *x0 = ix < 0 ? node->high[0] : node->low[0], *x1 = ix < 0 ? node->low[0] : node->high[0];
    const float *y0 = iy < 0 ? node->high[1] : node->low[1], *y1 = iy < 0 ? node->low[1] : node->high[1];
    const float *z0 = iz < 0 ? node->high[2] : node->low[2], *z1 = iz < 0 ? node->low[2] : node->high[2];
    LANES_LOOP
    for (int c = 0; c < BVH_WIDTH; c++) {
        float ex = (x0[c] - ox) * ix, ey = (y0[c] - oy) * iy, ez = (z0[c] - oz) * iz;
        float lx = (x1[c] - ox) * ix, ly = (y1[c] - oy) * iy, lz = (z1[c] - oz) * iz;
        float e = ex > start ? ex : start, l = lx < ly ? lx : ly;
        e = ey > e ? ey : e;
        near[c] = ez > e ? ez : e;
        l = (lz < l ? lz : l) * (1 + BOX_SLACK);
        leave[c] = far < l ? far : l;
    }
    return lanes_at_most(near, leave);
}

/* (A call of its own: so its numbers stay in registers.) */
static __attribute__((noinline)) void ray_walk(struct packet *p, const struct plan *plan, int ray, uint32_t root)
{
    struct branch stack[BVH_STACK_MAX];
    const struct box_ray box_ray = box_ray_of(p, ray);
    int depth = 0;
    if (!(fabsf(box_ray.origin[0]) + fabsf(box_ray.origin[1]) + fabsf(box_ray.origin[2]) < INFINITY))
        return; /* so far off that floats cannot tell it: it is not aimed at anything */
    stack[depth++] = (struct branch){0, root, -INFINITY};
    while (depth > 0) {
        struct branch at = stack[--depth];
        if (at.near > p->far[ray])
            continue;
        const struct bvh_node *node = &p->nodes[at.node];
        _Alignas(32) float near[BVH_WIDTH];
        uint32_t children = ray_children(&box_ray, p->far[ray], node, near);
        for (int bottom = depth; children; children &= children - 1) {
            int c = __builtin_ctz(children);
            if (node->count[c] > 0)
                take_leaf_one(p, plan, node->kind[c], node->child[c], node->count[c], ray);
            else
                depth = stack_insert(stack, bottom, depth, (struct branch){0, node->child[c], near[c]}, p->nodes);
        }
    }
}

/* --- a packet --------------------------------------------------------------------------------------------- */

static void packet_walk(struct packet *p, const struct plan *plan, uint64_t lanes)
{
    struct branch stack[BVH_STACK_MAX];
    int depth = 0;
    stack[depth++] = (struct branch){lanes, 0, -INFINITY};
    while (depth > 0) {
        struct branch at = stack[--depth];
        if (__builtin_popcountll(at.lanes) <= FEW_RAYS) {
            for (; at.lanes; at.lanes &= at.lanes - 1)
                ray_walk(p, plan, __builtin_ctzll(at.lanes), at.node);
            continue;
        }
        float far = packet_largest_far(p);
        if (at.near > far)
            continue;
        const struct bvh_node *node = &p->nodes[at.node];
        _Alignas(32) float near[BVH_WIDTH];
        const struct packet_planes planes = packet_planes(p, node);
        uint32_t children = packet_children(p, node, &planes, far, near);
        for (int bottom = depth; children; children &= children - 1) {
            int c = __builtin_ctz(children);
            uint64_t met = packet_meets(p, node, &planes, c, at.lanes);
            if (!met)
                continue;
            if (node->count[c] > 0)
                take_leaf(p, plan, node->kind[c], node->child[c], node->count[c], met);
            else
                depth = stack_insert(stack, bottom, depth, (struct branch){met, node->child[c], near[c]}, p->nodes);
        }
    }
}

/* Brings those lanes to all primitives of the scene that they may meet. */
static void packet_walk_lanes(struct packet *p, const struct plan *plan, uint64_t lanes)
{
    if (plan->bvh.node_count == 0) {
        for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
            if (plan->count[kind] > 0)
                take_leaf(p, plan, kind, 0, plan->count[kind], lanes);
        return;
    }
    for (size_t i = 0; i < plan->bvh.loose_count; i++) {
        const struct primitive *primitive = &plan->primitives[plan->bvh.loose[i]];
        take_leaf(p, plan, primitive->kind, primitive->index, 1, lanes);
    }
    p->in_tree = true;
    packet_walk(p, plan, lanes);
}

/* --- distant rays ----------------------------------------------------------------------------------------- */

/* Brings a distant ray, alone, to what it may meet. */
static void distant_walk(const struct packet *from, const struct plan *plan, int ray)
{
    struct packet alone = *from, *p = &alone;
    double origin[3][PACKET_RAYS];
    p->shift = ray_shift(packet_origin(from, ray), packet_direction(from, ray), plan->bvh.extent);
    for (int axis = 0; axis < 3; axis++) {
        origin[axis][ray] = from->origin[axis][ray] + p->shift * from->direction[axis][ray];
        p->origin[axis] = origin[axis];
    }
    p->near[ray] = (float)(p->t_min[ray] - p->shift - shift_slop(p->shift)) * (1 - BOX_SLACK);
    p->start[ray] = p->shift - shift_slop(p->shift);
    packet_prepare_shear(p);
    for (size_t i = 0; i < plan->bvh.loose_count; i++) {
        const struct primitive *primitive = &plan->primitives[plan->bvh.loose[i]];
        if (primitive->kind == PRIMITIVE_INSTANCE)
            take_instances_one(p, plan, primitive->index, 1, ray);
        else
            take_primitive(p, plan, primitive->kind, primitive->index, 0, ray);
    }
    p->far[ray] = packet_far(p->t[ray], p->start[ray]);
    p->in_tree = true;
    if (!is_distant(packet_origin(p, ray), plan->bvh.extent))
        ray_walk(p, plan, ray, 0);
}

/* The lanes that are distant, each alone, and then the others together, without those in their groups. */
static __attribute__((noinline)) void packet_walk_apart(struct packet *p, const struct plan *plan, uint64_t lanes)
{
    double t[PACKET_RAYS];
    for (uint64_t left = lanes & p->distant; left; left &= left - 1) {
        int i = __builtin_ctzll(left);
        distant_walk(p, plan, i);
        t[i] = p->t[i];
        p->t[i] = p->far[i] = -INFINITY;
    }
    packet_walk_lanes(p, plan, lanes & ~p->distant);
    for (uint64_t left = lanes & p->distant; left; left &= left - 1)
        p->t[__builtin_ctzll(left)] = t[__builtin_ctzll(left)];
}

/* Brings the packet's first `count` lanes to all primitives of the scene that they may meet. */
static void packet_walk_scene(struct packet *p, const struct plan *plan, int count)
{
    uint64_t lanes = count == PACKET_RAYS ? UINT64_MAX : (UINT64_C(1) << count) - 1;
    if (p->distant)
        packet_walk_apart(p, plan, lanes);
    else
        packet_walk_lanes(p, plan, lanes);
}

#endif
