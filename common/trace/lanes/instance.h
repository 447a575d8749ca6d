/*
 * From an instance to the triangles in its mesh's tree: a second packet of the same rays, whose boxes are in the mesh's
 * space, while all else of it is in the world as ever (trace/instance.h).
 */
#ifndef WEFT_TRACE_LANES_INSTANCE_H
#define WEFT_TRACE_LANES_INSTANCE_H

#include "trace/instance.h"
#include "trace/lanes/walk.h"

/* --- the way in ------------------------------------------------------------------------------------------- */

/* The far end of a ray in the instance's mesh, not below its value. */
static inline float instance_far(const struct packet *in, int i)
{
    return packet_far(in->t[i] + in->instance->slop, in->start[i]);
}

/* A ray for the boxes of the instance's mesh. What is of its tree is nearer to the centre than 2 extent. */
static inline void instance_prepare_ray(struct packet *in, const struct instance *instance, double extent, int i)
{
    struct vec3 o = instance_origin(instance, packet_origin(in, i));
    struct vec3 d = instance_direction(instance, packet_direction(in, i));
    double beyond = (vec3_length(o) - 2 * extent) / vec3_length(d), start = beyond > 0 ? beyond : 0;
    in->start[i] = start + (in->shift - shift_slop(in->shift));
    in->box_origin[0][i] = (float)(o.x + start * d.x);
    in->box_origin[1][i] = (float)(o.y + start * d.y);
    in->box_origin[2][i] = (float)(o.z + start * d.z);
    in->inverse[0][i] = 1 / (float)d.x;
    in->inverse[1][i] = 1 / (float)d.y;
    in->inverse[2][i] = 1 / (float)d.z;
    in->near[i] = (float)(in->t_min[i] - instance->slop - in->start[i] - 2 * shift_slop(in->shift)) * (1 - BOX_SLACK);
    in->far[i] = instance_far(in, i);
}

/* A packet of p's rays for what follows. */
static inline void instance_enter(struct packet *in, struct packet *p, const struct instance *instance)
{
    packet_prepare_shear(p);
    for (int axis = 0; axis < 3; axis++) {
        in->origin[axis] = p->origin[axis];
        in->direction[axis] = p->direction[axis];
    }
    in->t_min = p->t_min;
    in->key_min = p->key_min;
    in->from = p->from;
    in->inward = p->inward;
    in->t = p->t;
    in->key = p->key;
    in->crossings = p->crossings;
    in->first_ray = p->first_ray;
    in->shift = p->shift;
    in->is_sheared = true;
    in->ways = p->ways;
    in->is_flat = in->is_floats = in->in_tree = false;
    in->instance = instance;
    in->nodes = instance->mesh->bvh.nodes;
}

static inline void instance_enter_one(struct packet *in, struct packet *p, const struct instance *instance, int ray)
{
    instance_enter(in, p, instance);
    in->reach[ray] = p->reach[ray];
    in->shear.axis[ray] = p->shear.axis[ray];
    in->shear.x[ray] = p->shear.x[ray];
    in->shear.y[ray] = p->shear.y[ray];
    in->shear.winding[ray] = p->shear.winding[ray];
    instance_prepare_ray(in, instance, instance->mesh->bvh.extent, ray);
}

/* Other lanes than these repeat one of them where bounds are taken over all. */
static inline void instance_silence_others(struct packet *in, uint64_t lanes)
{
    int one = __builtin_ctzll(lanes);
    for (uint64_t others = ~lanes; others; others &= others - 1) {
        int i = __builtin_ctzll(others);
        in->far[i] = -INFINITY;
        for (int axis = 0; axis < 3; axis++) {
            in->box_origin[axis][i] = in->box_origin[axis][one];
            in->inverse[axis][i] = in->inverse[axis][one];
        }
    }
}

static inline void instance_enter_all(struct packet *in, struct packet *p, const struct instance *from, uint64_t lanes)
{
    const struct instance copy = *from, *instance = &copy; /* so that it is seen not to change in the loop */
    const double extent = instance->mesh->bvh.extent;
    instance_enter(in, p, from);
    memcpy(in->reach, p->reach, sizeof in->reach);
    memcpy(&in->shear, &p->shear, sizeof in->shear);
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++)
        instance_prepare_ray(in, instance, extent, i);
    instance_silence_others(in, lanes);
    packet_find_bounds(in);
}

/* --- leaves ----------------------------------------------------------------------------------------------- */

static inline struct taken instance_taken(const struct plan *plan, const struct instance *instance, uint32_t number)
{
    return (struct taken){instance->first_id + number, plan->objects[instance->object].leave_share,
                          instance->blocks_light};
}

/* One triangle, to the groups that hold any of the lanes. */
static inline void take_placed(struct packet *p, const struct plan *plan, uint32_t number, uint64_t lanes)
{
    struct triangle triangle = instance_corners(p->instance, number);
    struct taken taken = instance_taken(plan, p->instance, number);
    bool has_plane = false, grazed = false;
    for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left))) {
        int base = first_group(left);
        if (!(left >> base & may_meet_triangle(p, base, &triangle, taken.id)))
            continue;
        if (!has_plane) {
            instance_set_plane(p->instance, number, &triangle);
            grazed = may_graze(p, &triangle);
        }
        has_plane = true;
        if (grazed)
            take_grazed(p, &triangle, UINT64_C(0xff) << base, &taken);
        else
            take_steep(p, base, &triangle, &taken);
    }
}

static void take_placed_leaf(struct packet *p, const struct plan *plan, const uint32_t *numbers, size_t count,
                             uint64_t lanes)
{
    for (size_t i = 0; i < count; i++)
        take_placed(p, plan, numbers[i], lanes);
    for (; lanes; lanes &= lanes - 1)
        p->far[__builtin_ctzll(lanes)] = instance_far(p, __builtin_ctzll(lanes));
}

static void take_placed_leaf_one(struct packet *p, const struct plan *plan, const uint32_t *numbers, size_t count,
                                 int ray)
{
    struct triangle triangles[BVH_LEAF_MAX];
    for (size_t i = 0; i < BVH_LEAF_MAX; i++)
        triangles[i] = instance_corners(p->instance, numbers[i < count ? i : 0]);
    uint32_t all = (UINT32_C(1) << count) - 1;
    for (uint32_t met = may_meet_triangles(p, ray, triangles) & all; met; met &= met - 1) {
        int i = __builtin_ctz(met);
        struct taken taken = instance_taken(plan, p->instance, numbers[i]);
        instance_set_plane(p->instance, numbers[i], &triangles[i]);
        take_triangle_one(p, ray, &triangles[i], &taken);
    }
    p->far[ray] = instance_far(p, ray);
}

/* --- instances -------------------------------------------------------------------------------------------- */

static __attribute__((noinline)) void take_instance(struct packet *p, const struct plan *plan,
                                                    const struct instance *instance, uint64_t lanes)
{
    const struct shared_mesh *mesh = instance->mesh;
    struct packet in;
    instance_enter_all(&in, p, instance, lanes);
    for (size_t i = 0; i < mesh->bvh.loose_count; i++)
        take_placed_leaf(&in, plan, &mesh->bvh.loose[i], 1, lanes);
    packet_walk(&in, plan, lanes);
}

static __attribute__((noinline)) void take_instance_one(struct packet *p, const struct plan *plan,
                                                        const struct instance *instance, int ray)
{
    const struct shared_mesh *mesh = instance->mesh;
    struct packet in;
    instance_enter_one(&in, p, instance, ray);
    for (size_t i = 0; i < mesh->bvh.loose_count; i++)
        take_placed_leaf_one(&in, plan, &mesh->bvh.loose[i], 1, ray);
    ray_walk(&in, plan, ray, 0);
}

static void take_instances(struct packet *p, const struct plan *plan, size_t first, size_t count, uint64_t lanes)
{
    if (p->instance) {
        take_placed_leaf(p, plan, &p->instance->mesh->order[first], count, lanes);
        return;
    }
    for (size_t i = first; i < first + count; i++)
        take_instance(p, plan, &plan->instances[i], lanes);
    for (; lanes; lanes &= ~(UINT64_C(0xff) << first_group(lanes)))
        packet_update_far(p, first_group(lanes));
}

static void take_instances_one(struct packet *p, const struct plan *plan, size_t first, size_t count, int ray)
{
    if (p->instance) {
        take_placed_leaf_one(p, plan, &p->instance->mesh->order[first], count, ray);
        return;
    }
    for (size_t i = first; i < first + count; i++)
        take_instance_one(p, plan, &plan->instances[i], ray);
    p->far[ray] = packet_far(p->t[ray], p->start[ray]);
}

#endif
