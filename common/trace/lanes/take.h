/*
 * From a leaf of the tree to the test of each primitive in it, for groups of lanes and for one ray.
 *
 * A file that includes this defines first, as inline functions,
 *     void take_roots(struct packet *p, int i, struct roots roots, enum wall wall, const struct taken *taken)
 * which deals with the roots of lane i with a primitive, in lanes, and
 *     void take_found(struct packet *p, int base, int end, const struct taken *taken)
 * which does what then remains to be done for lanes base .. end − 1. It ends with lanes/instance.h, where leaves of
 * instances are dealt with.
 */
#ifndef WEFT_TRACE_LANES_TAKE_H
#define WEFT_TRACE_LANES_TAKE_H

#include "trace/lanes/filter.h"

/* A primitive, as far as its kind does not matter. */
struct taken {
    double id, delay; /* delay: see leave_delay */
    bool blocks_light;
};

static inline void take_roots(struct packet *p, int i, struct roots roots, enum wall wall,
                              const struct taken *taken);
static inline void take_found(struct packet *p, int base, int end, const struct taken *taken);

/* Instances first .. first + count − 1, or such triangles of the one that the packet is in. */
static void take_instances(struct packet *p, const struct plan *plan, size_t first, size_t count, uint64_t lanes);
static void take_instances_one(struct packet *p, const struct plan *plan, size_t first, size_t count, int ray);

/* For each kind, one lane against one primitive. */
#define DEFINE_TAKE_ONE(name, type, wall, roots)                                                                 \
    static void take_##name##_one(struct packet *p, int i, const struct type *primitive,                         \
                                  const struct taken *taken)                                                     \
    {                                                                                                            \
        take_roots(p, i, roots_unshifted(roots, p->shift), wall, taken);                                         \
        take_found(p, i, i + 1, taken);                                                                          \
    }

/* And a group of lanes from `base`. */
#define DEFINE_TAKE_GROUP(name, type, wall, roots)                                                               \
    static inline __attribute__((always_inline)) void take_##name(                                               \
        struct packet *p, int base, const struct type *from, const struct taken *taken)                          \
    {                                                                                                            \
        const struct type copy = *from, *primitive = &copy; /* so that it is seen not to change in the loop */   \
        LANES_LOOP                                                                                               \
        for (int i = base; i < base + GROUP; i++)                                                                \
            take_roots(p, i, roots, wall, taken);                                                                \
        take_found(p, base, base + GROUP, taken);                                                                \
    }

#define DEFINE_TAKE(name, type, wall, roots)                                                                     \
    DEFINE_TAKE_ONE(name, type, wall, roots)                                                                     \
    DEFINE_TAKE_GROUP(name, type, wall, roots)

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
DEFINE_TAKE_GROUP(steep, triangle, WALL_NONE, triangle_steep_roots(primitive, RAY, SHEAR))
DEFINE_TAKE_ONE(triangle, triangle, WALL_NONE, triangle_roots(primitive, RAY, SHEAR))

#undef SHEAR
#undef RAY

/* Whether any ray of the packet may graze it. (Twice GRAZED, as the directions are known to floats.) */
static inline bool may_graze(const struct packet *p, const struct triangle *triangle)
{
    const double *middle = p->ways.middle, *half = p->ways.half;
    const struct vec3 n = triangle->plane.normal;
    double reach = fabs(n.x) * half[0] + fabs(n.y) * half[1] + fabs(n.z) * half[2];
    return !(fabs(n.x * middle[0] + n.y * middle[1] + n.z * middle[2]) > reach + 2 * GRAZED);
}

/* Which lanes of a group do. */
static __attribute__((noinline)) uint32_t grazing_lanes(const struct packet *p, int base,
                                                        const struct triangle *from)
{
    const struct triangle copy = *from, *triangle = &copy; /* so that it is seen not to change in the loop */
    _Alignas(64) double slacks[GROUP];
    LANES_LOOP
    for (int i = base; i < base + GROUP; i++)
        slacks[i - base] = triangle_is_grazed(triangle, packet_direction(p, i)) ? 0 : -1;
    return lanes_not_negative(slacks);
}

/* The groups that hold any of the lanes, of which some may graze the triangle: then each lane alone. */
static __attribute__((noinline)) void take_grazed(struct packet *p, const struct triangle *triangle, uint64_t lanes,
                                                  const struct taken *taken)
{
    for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left))) {
        int base = first_group(left);
        if (!grazing_lanes(p, base, triangle)) {
            take_steep(p, base, triangle, taken);
            continue;
        }
        for (int i = base; i < base + GROUP; i++)
            take_triangle_one(p, i, triangle, taken);
    }
}

/* Where a primitive's own test says soon enough. */
#define ALL_LANES(p, primitive, id, lanes) (lanes)

/* All groups with lanes that may meet the primitive, or one ray if `ray` is one. */
#define TAKE(name, array, may_meet)                                                                              \
    do {                                                                                                         \
        if (ray >= 0) {                                                                                          \
            take_##name##_one(p, ray, &plan->array[index], &taken);                                              \
            break;                                                                                               \
        }                                                                                                        \
        lanes = may_meet(p, &plan->array[index], taken.id, lanes);                                               \
        for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left)))                        \
            take_##name(p, first_group(left), &plan->array[index], &taken);                                      \
    } while (0)

/* The same for a triangle. */
static inline __attribute__((always_inline)) uint64_t take_triangle(struct packet *p, const struct triangle *triangle,
                                                                    const struct taken *taken, uint64_t lanes, int ray)
{
    if (ray >= 0) {
        take_triangle_one(p, ray, triangle, taken);
        return lanes;
    }
    lanes = triangle_lanes(p, triangle, taken->id, lanes);
    if (lanes && may_graze(p, triangle)) {
        take_grazed(p, triangle, lanes, taken);
        return lanes;
    }
    for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left)))
        take_steep(p, first_group(left), triangle, taken);
    return lanes;
}

static inline struct taken taken_of(const struct plan *plan, int kind, size_t index)
{
    uint32_t id = plan->ids[kind][index];
    const struct primitive *primitive = plan_primitive(plan, id);
    return (struct taken){id, primitive_leave_share(primitive), primitive->blocks_light};
}

/* One primitive, to the lanes' groups or, if ray >= 0, to that ray. Returns the lanes that may have met it. */
static inline __attribute__((always_inline)) uint64_t take_primitive(struct packet *p, const struct plan *plan,
                                                                     int kind, size_t index, uint64_t lanes, int ray)
{
    const struct taken taken = taken_of(plan, kind, index);
    switch ((enum primitive_kind)kind) {
    case PRIMITIVE_SPHERE:
        TAKE(sphere, spheres, ALL_LANES);
        break;
    case PRIMITIVE_GLOBE:
        TAKE(globe, globes, ALL_LANES);
        break;
    case PRIMITIVE_ELLIPSOID:
        TAKE(ellipsoid, ellipsoids, ALL_LANES);
        break;
    case PRIMITIVE_PLANE:
        TAKE(plane, planes, ALL_LANES);
        break;
    case PRIMITIVE_DISC:
        TAKE(disc, discs, ALL_LANES);
        break;
    case PRIMITIVE_FRUSTUM:
        if (plan->frustums[index].open)
            TAKE(open, frustums, frustum_lanes);
        else
            TAKE(capped, frustums, frustum_lanes);
        break;
    case PRIMITIVE_BOX:
        TAKE(box, boxes, ALL_LANES);
        break;
    case PRIMITIVE_TRIANGLE:
        lanes = take_triangle(p, &plan->triangles[index], &taken, lanes, ray);
        break;
    case PRIMITIVE_INSTANCE: /* take_leaf and take_leaf_one see to that */
    case PRIMITIVE_KINDS:
        break;
    }
    return lanes;
}

/* What the primitives of a leaf are filtered by. */
static inline void prepare_kind(struct packet *p, int kind)
{
    if (kind == PRIMITIVE_TRIANGLE)
        packet_prepare_shear(p);
    if (kind == PRIMITIVE_TRIANGLE && p->in_tree)
        packet_prepare_flat(p);
    if (kind == PRIMITIVE_FRUSTUM && p->in_tree)
        packet_prepare_floats(p);
}

static void take_leaf(struct packet *p, const struct plan *plan, int kind, size_t first, size_t count, uint64_t lanes)
{
    uint64_t taken = 0;
    if (kind == PRIMITIVE_INSTANCE) {
        take_instances(p, plan, first, count, lanes);
        return;
    }
    prepare_kind(p, kind);
    for (size_t index = first; index < first + count; index++)
        taken |= take_primitive(p, plan, kind, index, lanes, -1);
    for (; taken; taken &= ~(UINT64_C(0xff) << first_group(taken)))
        packet_update_far(p, first_group(taken));
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

/* (A call of its own: so ray_walk's numbers stay in registers.) */
static __attribute__((noinline)) void take_leaf_one(struct packet *p, const struct plan *plan, int kind, size_t first,
                                                    size_t count, int ray)
{
    if (kind == PRIMITIVE_INSTANCE) {
        take_instances_one(p, plan, first, count, ray);
        return;
    }
    if (kind == PRIMITIVE_TRIANGLE)
        packet_prepare_shear(p);
    for (uint32_t met = may_meet_any(p, plan, kind, first, count, ray); met; met &= met - 1)
        take_primitive(p, plan, kind, first + (size_t)__builtin_ctz(met), 0, ray);
    p->far[ray] = packet_far(p->t[ray], p->start[ray]);
}

#endif
