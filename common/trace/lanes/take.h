/*
 * From a leaf of the tree to the test of each primitive in it, for groups of lanes and for one ray.
 *
 * A file that includes this defines first, as inline functions,
 *     void take_roots(struct packet *p, int i, struct roots roots, enum wall wall, const struct taken *taken)
 * which deals with the roots of lane i with a primitive, in lanes, and
 *     void take_found(struct packet *p, int base, int end, const struct taken *taken)
 * which does what then remains to be done for lanes base .. end − 1.
 */
#ifndef WEFT_TRACE_LANES_TAKE_H
#define WEFT_TRACE_LANES_TAKE_H

#include "trace/lanes/packet.h"

/* A primitive, as far as its kind does not matter. */
struct taken {
    double id, delay; /* delay: see leave_delay */
    bool blocks_light;
};

static inline void take_roots(struct packet *p, int i, struct roots roots, enum wall wall,
                              const struct taken *taken);
static inline void take_found(struct packet *p, int base, int end, const struct taken *taken);

/* For each kind, a group of lanes from `base`, and one lane, against one primitive. */
#define DEFINE_TAKE(name, type, wall, roots)                                                                    \
    static void take_##name(struct packet *p, int base, const struct type *from, const struct taken *taken)      \
    {                                                                                                            \
        const struct type copy = *from, *primitive = &copy; /* so that it is seen not to change in the loop */   \
        LANES_LOOP                                                                                               \
        for (int i = base; i < base + GROUP; i++)                                                                \
            take_roots(p, i, roots, wall, taken);                                                                \
        take_found(p, base, base + GROUP, taken);                                                                \
    }                                                                                                            \
    static void take_##name##_one(struct packet *p, int i, const struct type *primitive,                         \
                                  const struct taken *taken)                                                     \
    {                                                                                                            \
        take_roots(p, i, roots, wall, taken);                                                                    \
        take_found(p, i, i + 1, taken);                                                                          \
    }

#define RAY packet_origin(p, i), packet_direction(p, i)
DEFINE_TAKE(sphere, sphere, WALL_SOLID, sphere_roots(primitive, RAY))
DEFINE_TAKE(globe, globe, WALL_SOLID, globe_roots(primitive, RAY))
DEFINE_TAKE(ellipsoid, ellipsoid, WALL_SOLID, ellipsoid_roots(primitive, RAY))
DEFINE_TAKE(plane, plane, WALL_NONE, plane_roots(primitive, RAY))
DEFINE_TAKE(disc, disc, WALL_NONE, disc_roots(primitive, RAY))
DEFINE_TAKE(capped, frustum, WALL_SOLID, frustum_capped_roots(primitive, RAY))
DEFINE_TAKE(open, frustum, WALL_OPEN, frustum_open_roots(primitive, RAY))
DEFINE_TAKE(box, box, WALL_SOLID, box_roots(primitive, RAY))
DEFINE_TAKE(triangle, triangle, WALL_NONE, triangle_roots(primitive, RAY, &(struct shear){p->shear.axis[i], p->shear.x[i],
                                                                               p->shear.y[i], p->shear.winding[i]}))
#undef RAY

/* The first lane of the first group that holds any of the lanes. */
static inline int first_group(uint64_t lanes)
{
    return __builtin_ctzll(lanes) & ~(GROUP - 1);
}

/* All groups that hold any of `lanes`, or one ray if `ray` is one. */
#define TAKE(name, array)                                                                                        \
    do {                                                                                                         \
        if (ray >= 0)                                                                                            \
            take_##name##_one(p, ray, &plan->array[index], &taken);                                              \
        for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left)))                        \
            take_##name(p, first_group(left), &plan->array[index], &taken);                                      \
    } while (0)

/* One primitive, to the lanes' groups or, if ray >= 0, to that ray. */
static inline __attribute__((always_inline)) void take_primitive(struct packet *p, const struct plan *plan, int kind,
                                                                 size_t index, uint64_t lanes, int ray)
{
    uint32_t id = plan->ids[kind][index];
    const struct primitive *primitive = &plan->primitives[id];
    struct taken taken = {id, primitive_leave_share(primitive), primitive->blocks_light};
    switch ((enum primitive_kind)kind) {
    case PRIMITIVE_SPHERE:
        TAKE(sphere, spheres);
        break;
    case PRIMITIVE_GLOBE:
        TAKE(globe, globes);
        break;
    case PRIMITIVE_ELLIPSOID:
        TAKE(ellipsoid, ellipsoids);
        break;
    case PRIMITIVE_PLANE:
        TAKE(plane, planes);
        break;
    case PRIMITIVE_DISC:
        TAKE(disc, discs);
        break;
    case PRIMITIVE_FRUSTUM:
        if (plan->frustums[index].open)
            TAKE(open, frustums);
        else
            TAKE(capped, frustums);
        break;
    case PRIMITIVE_BOX:
        TAKE(box, boxes);
        break;
    case PRIMITIVE_TRIANGLE:
        TAKE(triangle, triangles);
        break;
    case PRIMITIVE_KINDS:
        break;
    }
}

static void take_leaf(struct packet *p, const struct plan *plan, int kind, size_t first, size_t count, uint64_t lanes)
{
    for (size_t index = first; index < first + count; index++)
        take_primitive(p, plan, kind, index, lanes, -1);
    for (; lanes; lanes &= ~(UINT64_C(0xff) << first_group(lanes)))
        packet_update_far(p, first_group(lanes));
}

static void take_leaf_one(struct packet *p, const struct plan *plan, int kind, size_t first, size_t count, int ray)
{
    for (size_t index = first; index < first + count; index++)
        take_primitive(p, plan, kind, index, 0, ray);
    p->far[ray] = packet_far(p->t[ray], p->start[ray]);
}

#endif
