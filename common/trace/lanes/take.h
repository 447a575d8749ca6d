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
#define DEFINE_TAKE(name, type, wall, roots)                                                                     \
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
#define SHEAR &(struct shear){p->shear.axis[i], p->shear.x[i], p->shear.y[i], p->shear.winding[i]}
DEFINE_TAKE(sphere, sphere, WALL_SOLID, sphere_roots(primitive, RAY))
DEFINE_TAKE(globe, globe, WALL_SOLID, globe_roots(primitive, RAY))
DEFINE_TAKE(ellipsoid, ellipsoid, WALL_SOLID, ellipsoid_roots(primitive, RAY))
DEFINE_TAKE(plane, plane, WALL_NONE, plane_roots(primitive, RAY))
DEFINE_TAKE(disc, disc, WALL_NONE, disc_roots(primitive, RAY))
DEFINE_TAKE(capped, frustum, WALL_SOLID, frustum_capped_roots(primitive, RAY))
DEFINE_TAKE(open, frustum, WALL_OPEN, frustum_open_roots(primitive, RAY))
DEFINE_TAKE(box, box, WALL_SOLID, box_roots(primitive, RAY))
DEFINE_TAKE(triangle, triangle, WALL_NONE, triangle_roots(primitive, RAY, SHEAR))

/* The lanes of a group that may meet the primitive, or start on it. Most groups that come to a leaf meet nothing in it,
 * and this costs less than half of the whole test. (Not for spheres, whose test is as short. Calls, because gcc 12 gives
 * up vectorising the test if this is inlined before it.) */
#define DEFINE_SLACK(name, type, slack)                                                                          \
    static __attribute__((noinline)) uint32_t may_meet_##name(const struct packet *p, int base,                  \
                                                              const struct type *from, double id)                \
    {                                                                                                            \
        const struct type copy = *from, *primitive = &copy; /* so that it is seen not to change in the loop */   \
        _Alignas(64) double slacks[GROUP];                                                                       \
        LANES_LOOP                                                                                               \
        for (int i = base; i < base + GROUP; i++) {                                                              \
            double own = -fabs(p->from[i] - id), any = slack;                                                    \
            slacks[i - base] = own > any ? own : any;                                                            \
        }                                                                                                        \
        return lanes_not_negative(slacks);                                                                       \
    }

DEFINE_SLACK(frustum, frustum, frustum_slack(primitive, RAY))
DEFINE_SLACK(triangle, triangle, triangle_slack(primitive, packet_origin(p, i), SHEAR))

/* --- one ray, four primitives ----------------------------------------------------------------------------- */

_Static_assert(BVH_LEAF_MAX == 4, "a leaf is tested at once");
_Static_assert(offsetof(struct sphere, radius) == 3 * sizeof(double) &&
                   offsetof(struct frustum, origin) == 9 * sizeof(double) &&
                   offsetof(struct frustum, radius) == 12 * sizeof(double) &&
                   offsetof(struct frustum, slope) == 13 * sizeof(double) &&
                   offsetof(struct frustum, balance) == 15 * sizeof(double) &&
                   offsetof(struct triangle, c) == 6 * sizeof(double),
               "sphere_at, frustum_at and triangle_at read these doubles");

/* Primitive k of four, as far as its slack needs it, from its doubles as lanes_transpose gives them. */
#define AT(f) to[f][k], to[f + 1][k], to[f + 2][k]

static inline struct sphere sphere_at(double (*to)[4], int k)
{
    return (struct sphere){{AT(0)}, to[3][k]};
}

static inline struct frustum frustum_at(double (*to)[4], int k)
{
    return (struct frustum){.frame = {{AT(0)}, {AT(3)}, {AT(6)}}, .origin = {AT(9)}, .radius = to[12][k],
                            .slope = to[13][k], .balance = to[15][k]};
}

static inline struct triangle triangle_at(double (*to)[4], int k)
{
    return (struct triangle){.a = {AT(0)}, .b = {AT(3)}, .c = {AT(6)}};
}

#undef AT

/* For one ray and the four primitives at `from`: which of them it may meet, apart from one that it starts on. */
#define DEFINE_SLACKS(name, type, blocks, slack)                                                                 \
    static __attribute__((noinline)) uint32_t may_meet_##name##s(const struct packet *p, int i,                  \
                                                                 const struct type *from)                        \
    {                                                                                                            \
        _Alignas(32) double doubles[4 * blocks][4];                                                              \
        _Alignas(64) double slacks[8] = {0, 0, 0, 0, -1, -1, -1, -1};                                            \
        lanes_transpose((const double *)from, sizeof *from / sizeof(double), blocks, doubles);                   \
        const struct vec3 origin = packet_origin(p, i), direction = packet_direction(p, i);                      \
        const struct shear shear = *SHEAR;                                                                       \
        const double axes[4] = {shear.axis, shear.axis, shear.axis, shear.axis}; /* a choice by one for all is   \
                                                                                  * not vectorised */            \
        (void)direction, (void)axes;                                                                             \
        LANES_LOOP                                                                                               \
        for (int k = 0; k < BVH_LEAF_MAX; k++) {                                                                 \
            const struct type primitive = name##_at(doubles, k);                                                 \
            slacks[k] = slack;                                                                                   \
        }                                                                                                        \
        return lanes_not_negative(slacks);                                                                       \
    }

DEFINE_SLACKS(sphere, sphere, 1, sphere_slack(&primitive, origin, direction))
DEFINE_SLACKS(frustum, frustum, 4, frustum_slack(&primitive, origin, direction))
DEFINE_SLACKS(triangle, triangle, 3,
              triangle_slack(&primitive, origin, &(struct shear){axes[k], shear.x, shear.y, shear.winding}))
#undef SHEAR
#undef RAY

/* The first lane of the first group that holds any of the lanes. */
static inline int first_group(uint64_t lanes)
{
    return __builtin_ctzll(lanes) & ~(GROUP - 1);
}

/* Where a primitive's own test says soon enough. */
#define MAY_MEET(p, base, primitive, id) UINT64_MAX

/* All groups that hold any of `lanes` and may meet the primitive, or one ray if `ray` is one. */
#define TAKE(name, array, may_meet)                                                                              \
    do {                                                                                                         \
        if (ray >= 0)                                                                                            \
            take_##name##_one(p, ray, &plan->array[index], &taken);                                              \
        for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left)))                        \
            if (left >> first_group(left) & may_meet(p, first_group(left), &plan->array[index], id))             \
                take_##name(p, first_group(left), &plan->array[index], &taken);                                  \
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
        TAKE(sphere, spheres, MAY_MEET);
        break;
    case PRIMITIVE_GLOBE:
        TAKE(globe, globes, MAY_MEET);
        break;
    case PRIMITIVE_ELLIPSOID:
        TAKE(ellipsoid, ellipsoids, MAY_MEET);
        break;
    case PRIMITIVE_PLANE:
        TAKE(plane, planes, MAY_MEET);
        break;
    case PRIMITIVE_DISC:
        TAKE(disc, discs, MAY_MEET);
        break;
    case PRIMITIVE_FRUSTUM:
        if (plan->frustums[index].open)
            TAKE(open, frustums, may_meet_frustum);
        else
            TAKE(capped, frustums, may_meet_frustum);
        break;
    case PRIMITIVE_BOX:
        TAKE(box, boxes, MAY_MEET);
        break;
    case PRIMITIVE_TRIANGLE:
        TAKE(triangle, triangles, may_meet_triangle);
        break;
    case PRIMITIVE_KINDS:
        break;
    }
}

static void take_leaf(struct packet *p, const struct plan *plan, int kind, size_t first, size_t count, uint64_t lanes)
{
    if (kind == PRIMITIVE_TRIANGLE)
        packet_prepare_shear(p);
    for (size_t index = first; index < first + count; index++)
        take_primitive(p, plan, kind, index, lanes, -1);
    for (; lanes; lanes &= ~(UINT64_C(0xff) << first_group(lanes)))
        packet_update_far(p, first_group(lanes));
}

/* Which of the primitives first .. first + count − 1 the ray may meet, or start on. */
static uint32_t may_meet_any(const struct packet *p, const struct plan *plan, int kind, size_t first, size_t count,
                             int ray)
{
    uint32_t own = 0, all = (UINT32_C(1) << count) - 1;
    for (size_t i = 0; i < count; i++)
        own |= (uint32_t)(plan->ids[kind][first + i] == p->from[ray]) << i;
    switch (kind) {
    case PRIMITIVE_SPHERE:
        return (may_meet_spheres(p, ray, &plan->spheres[first]) & all) | own;
    case PRIMITIVE_FRUSTUM:
        return (may_meet_frustums(p, ray, &plan->frustums[first]) & all) | own;
    case PRIMITIVE_TRIANGLE:
        return may_meet_triangles(p, ray, &plan->triangles[first]) & all;
    default:
        return all;
    }
}

static void take_leaf_one(struct packet *p, const struct plan *plan, int kind, size_t first, size_t count, int ray)
{
    if (kind == PRIMITIVE_TRIANGLE)
        packet_prepare_shear(p);
    for (uint32_t met = may_meet_any(p, plan, kind, first, count, ray); met; met &= met - 1)
        take_primitive(p, plan, kind, first + (size_t)__builtin_ctz(met), 0, ray);
    p->far[ray] = packet_far(p->t[ray], p->start[ray]);
}

#endif
