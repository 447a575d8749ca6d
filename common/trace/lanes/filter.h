/*
 * Which rays may meet a primitive: tests that cost much less than its own, and let nothing pass that it would hit.
 *
 * Most of what comes to a leaf meets nothing in it. In the tree, all of a packet is filtered in float, 16 lanes at a
 * time. Let u = 2^-24, R the tree's extent and o a ray's box_origin. All vertices and centres are within R on each
 * axis, so what is hit is at most √3 R from the eye; and it is at most (2 + √3) R from o (packet_find_starts). So
 * |o| <= (2 + 2√3) R < 5.5 R for every ray that hits anything. The error bounds below follow from that; what the
 * primitive's own test rounds, in double, is less by far than what they leave over, as no ray here is distant
 * (ahead.h).
 */
#ifndef WEFT_TRACE_LANES_FILTER_H
#define WEFT_TRACE_LANES_FILTER_H

#include "trace/lanes/packet.h"

/* The first lane of the first group that holds any of the lanes. */
static inline int first_group(uint64_t lanes)
{
    return __builtin_ctzll(lanes) & ~(GROUP - 1);
}

/* --- triangles of the tree -------------------------------------------------------------------------------- */

static inline float least_of_three(float a, float b, float c)
{
    float least = a < b ? a : b;
    return c < least ? c : least;
}

static inline float most_of_three(float a, float b, float c)
{
    float most = a > b ? a : b;
    return c > most ? c : most;
}

/* A triangle with its axes in the packet's order, and how far below 0 its areas may be for a ray that hits it. */
struct flat_triangle {
    float ax, ay, az, bx, by, bz, cx, cy, cz, margin;
};

/* With s the slopes of a ray, |s| <= S, a vertex v is seen at (v - s v.z) - (o - s o.z). Rounding v, o, s (4 u S), the
 * products and the differences moves that by at most (20 + 52 S) u R < E = 2^-18 (1 + S) R.
 *
 * A ray comes here if it passes the triangle's box, which is grown by 2^-20 R, so no vertex is farther off than L + E
 * with L = (1 + S) × the longest side, by coordinates. The triangle's own test finds a hit only if its three areas have
 * one sign, where those that round to 0 may count as either. Moving vertices by E changes an area by at most
 * 4 E L + 2 E², and rounding it by 4 u (L + E)² < E (L + E) / 2: 8 E (L + E) is more than both, and 2^-111 at least, so
 * underflow does not matter. */
static inline struct flat_triangle flat_triangle_of(const struct packet *p, const struct triangle *triangle)
{
    const double *a = &triangle->a.x, *b = &triangle->b.x, *c = &triangle->c.x;
    const int x = p->flat.x, y = p->flat.y, z = p->flat.z;
    struct flat_triangle t = {(float)a[x], (float)a[y], (float)a[z], (float)b[x], (float)b[y],
                              (float)b[z], (float)c[x], (float)c[y], (float)c[z], 0};
    float side = most_of_three(most_of_three(t.ax, t.bx, t.cx) - least_of_three(t.ax, t.bx, t.cx),
                               most_of_three(t.ay, t.by, t.cy) - least_of_three(t.ay, t.by, t.cy),
                               most_of_three(t.az, t.bz, t.cz) - least_of_three(t.az, t.bz, t.cz));
    t.margin = 8 * p->flat.error * (p->flat.stretch * side + p->flat.error);
    return t;
}

/* Of `lanes`, those that may meet it. */
static __attribute__((noinline)) uint64_t flat_triangle_lanes(const struct packet *p, const struct triangle *triangle,
                                                              uint64_t lanes)
{
    const struct flat_triangle t = flat_triangle_of(p, triangle);
    uint64_t met = 0;
    for (int base = 0; base < PACKET_RAYS; base += BLOCK) {
        if (!(lanes >> base & BLOCK_LANES))
            continue;
        _Alignas(64) float slacks[BLOCK];
        LANES_LOOP
        for (int i = 0; i < BLOCK; i++) {
            float sx = p->flat.slope_x[base + i], sy = p->flat.slope_y[base + i];
            float ox = p->flat.at_x[base + i], oy = p->flat.at_y[base + i];
            float ax = t.ax - sx * t.az - ox, ay = t.ay - sy * t.az - oy;
            float bx = t.bx - sx * t.bz - ox, by = t.by - sy * t.bz - oy;
            float cx = t.cx - sx * t.cz - ox, cy = t.cy - sy * t.cz - oy;
            float bc = cx * by - cy * bx, ca = ax * cy - ay * cx, ab = bx * ay - by * ax;
            float least = least_of_three(bc, ca, ab), most = most_of_three(bc, ca, ab);
            slacks[i] = least > -most ? least : -most;
        }
        met |= (uint64_t)lanes_not_below_16(slacks, -t.margin) << base;
    }
    return met & lanes;
}

/* --- frustums of the tree --------------------------------------------------------------------------------- */

/* A frustum as an endless cylinder around it: a ray at (o, d), in coordinates of which x and y are across its axis, is
 * within it somewhere if m² <= ρ² a, where m = o.x d.y − o.y d.x, a = d.x² + d.y², ρ the frustum's largest radius.
 *
 * With f the longer of the frame's first two rows, rounding the frame, the centre, o and d, and then all sums and
 * products on the way, moves m by at most 202 f² u R, and ρ √a by 13 f² u R: together by less than E = 2^-16 f² R. As
 * (x + E)² <= (1 + 2^-6) x² + 65 E², what is within the cylinder has m² <= (1 + 2^-5) ρ² a + 66 E², where 2^-6 is left
 * for rounding.
 *
 * In float for packets; in double, with the same allowance, for one ray, whose frustums are not worth converting. The
 * slack is not below 0 (or NaN) where a ray may meet the frustum. */
#define DEFINE_ROD(name, real)                                                                                   \
    struct name {                                                                                                \
        real xx, xy, xz, yx, yy, yz; /* the frame's first rows */                                                \
        real cx, cy, cz;                                                                                         \
        real width, margin; /* (1 + 2^-5) ρ² and 66 E² */                                                        \
    };                                                                                                           \
    static inline struct name name##_of(const struct frustum *frustum, double extent)                            \
    {                                                                                                            \
        const struct vec3 x = frustum->frame.x, y = frustum->frame.y, c = frustum->origin;                       \
        double length_x = vec3_dot(x, x), length_y = vec3_dot(y, y);                                             \
        double widest = frustum->radius + frustum->slope * frustum->height;                                      \
        double error = 0x1p-16 * extent * (length_x > length_y ? length_x : length_y);                           \
        return (struct name){(real)x.x, (real)x.y, (real)x.z, (real)y.x, (real)y.y, (real)y.z, (real)c.x,        \
                             (real)c.y, (real)c.z, (real)((1 + 0x1p-5) * widest * widest),                       \
                             (real)(66 * error * error)};                                                        \
    }                                                                                                            \
    static inline real name##_slack(const struct name *rod, real ox, real oy, real oz, real dx, real dy,         \
                                    real dz)                                                                     \
    {                                                                                                            \
        real wx = ox - rod->cx, wy = oy - rod->cy, wz = oz - rod->cz;                                            \
        real px = rod->xx * wx + rod->xy * wy + rod->xz * wz, py = rod->yx * wx + rod->yy * wy + rod->yz * wz;   \
        real ux = rod->xx * dx + rod->xy * dy + rod->xz * dz, uy = rod->yx * dx + rod->yy * dy + rod->yz * dz;   \
        real moment = px * uy - py * ux;                                                                         \
        return rod->width * (ux * ux + uy * uy) + rod->margin - moment * moment;                                 \
    }

DEFINE_ROD(rod, float)
DEFINE_ROD(double_rod, double)

/* Of `lanes`, those that may meet the frustum, or start on it. (Ids that are one in float are taken for one.) */
static __attribute__((noinline)) uint64_t rod_lanes(const struct packet *p, const struct frustum *frustum, double id,
                                                    uint64_t lanes)
{
    const struct rod rod = rod_of(frustum, p->extent);
    const float own = (float)id;
    uint64_t met = 0;
    if (!(rod.margin > 0x1p-94f && rod.margin < 0x1p87f)) /* scales whose squares float may not hold */
        return lanes;
    for (int base = 0; base < PACKET_RAYS; base += BLOCK) {
        if (!(lanes >> base & BLOCK_LANES))
            continue;
        _Alignas(64) float slacks[BLOCK];
        LANES_LOOP
        for (int i = 0; i < BLOCK; i++) {
            int r = base + i;
            float slack = rod_slack(&rod, p->box_origin[0][r], p->box_origin[1][r], p->box_origin[2][r],
                                    p->floats.direction[0][r], p->floats.direction[1][r], p->floats.direction[2][r]);
            float here = -fabsf(p->floats.from[r] - own);
            slacks[i] = here > slack ? here : slack;
        }
        met |= (uint64_t)lanes_not_below_16(slacks, 0) << base;
    }
    return met & lanes;
}

/* --- groups of lanes, outside the tree -------------------------------------------------------------------- */

#define SHEAR &(struct shear){p->shear.axis[i], p->shear.x[i], p->shear.y[i], p->shear.winding[i]}

/* The lanes of a group that may meet the primitive, or start on it, at less than half the cost of the whole test. (Not
 * for spheres, whose test is as short. Calls, because gcc 12 gives up vectorising the test if this is inlined before
 * it.) Then the same for all groups that hold any of `lanes`, or by another filter where that is known to hold. */
#define DEFINE_MAY_MEET(name, type, slack, filtered, filter)                                                     \
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
    }                                                                                                            \
    static inline uint64_t name##_lanes(const struct packet *p, const struct type *primitive, double id,         \
                                        uint64_t lanes)                                                          \
    {                                                                                                            \
        uint64_t met = 0;                                                                                        \
        if (filtered)                                                                                            \
            return filter;                                                                                       \
        for (uint64_t left = lanes; left; left &= ~(UINT64_C(0xff) << first_group(left)))                        \
            met |= (uint64_t)may_meet_##name(p, first_group(left), primitive, id) << first_group(left);          \
        return met & lanes;                                                                                      \
    }

DEFINE_MAY_MEET(frustum, frustum, frustum_slack(primitive, packet_origin(p, i), packet_direction(p, i)), p->in_tree,
                rod_lanes(p, primitive, id, lanes))
DEFINE_MAY_MEET(triangle, triangle, triangle_slack(primitive, packet_origin(p, i), SHEAR),
                p->in_tree && p->flat.z >= 0, flat_triangle_lanes(p, primitive, lanes))
#undef SHEAR

/* --- one ray, four primitives ----------------------------------------------------------------------------- */

_Static_assert(BVH_LEAF_MAX == 4, "a leaf is tested at once");
_Static_assert(offsetof(struct sphere, radius) == 3 * sizeof(double) &&
                   offsetof(struct frustum, origin) == 9 * sizeof(double) &&
                   offsetof(struct frustum, radius) == 12 * sizeof(double) &&
                   offsetof(struct frustum, slope) == 13 * sizeof(double) &&
                   offsetof(struct frustum, height) == 14 * sizeof(double) &&
                   offsetof(struct triangle, c) == 6 * sizeof(double),
               "what follows reads these doubles as lanes_transpose gives them");

#define AT(f) to[f][k], to[f + 1][k], to[f + 2][k]

static inline struct sphere sphere_at(double (*to)[4], int k)
{
    return (struct sphere){{AT(0)}, to[3][k]};
}

static inline struct frustum frustum_at(double (*to)[4], int k)
{
    return (struct frustum){.frame = {.x = {AT(0)}, .y = {AT(3)}}, .origin = {AT(9)}, .radius = to[12][k],
                            .slope = to[13][k], .height = to[14][k]};
}

#undef AT

/* For one ray and the four primitives at `from`: which of them it may meet, apart from one that it starts on. */
static __attribute__((noinline)) uint32_t may_meet_spheres(const struct packet *p, int i, const struct sphere *from)
{
    _Alignas(32) double doubles[4][4];
    _Alignas(64) double slacks[8] = {0, 0, 0, 0, -1, -1, -1, -1};
    lanes_transpose((const double *)from, sizeof *from / sizeof(double), 1, doubles);
    const struct vec3 origin = packet_origin(p, i), direction = packet_direction(p, i);
    LANES_LOOP
    for (int k = 0; k < BVH_LEAF_MAX; k++) {
        const struct sphere sphere = sphere_at(doubles, k);
        slacks[k] = sphere_slack(&sphere, origin, direction);
    }
    return lanes_not_negative(slacks);
}

static __attribute__((noinline)) uint32_t may_meet_frustums(const struct packet *p, int i, const struct frustum *from)
{
    _Alignas(32) double doubles[16][4];
    _Alignas(64) double slacks[8] = {0, 0, 0, 0, -1, -1, -1, -1};
    lanes_transpose((const double *)from, sizeof *from / sizeof(double), 4, doubles);
    const double extent = p->extent;
    const struct vec3 o = packet_origin(p, i), d = packet_direction(p, i);
    LANES_LOOP
    for (int k = 0; k < BVH_LEAF_MAX; k++) {
        const struct frustum frustum = frustum_at(doubles, k);
        const struct double_rod rod = double_rod_of(&frustum, extent);
        slacks[k] = double_rod_slack(&rod, o.x, o.y, o.z, d.x, d.y, d.z);
    }
    return lanes_not_negative(slacks);
}

/* Triangles are seen with the ray's own axis in the place of z: so nothing is chosen in the loop. */
static __attribute__((noinline)) uint32_t may_meet_triangles(const struct packet *p, int i,
                                                             const struct triangle *from)
{
    _Alignas(32) double doubles[12][4];
    _Alignas(64) double slacks[8] = {0, 0, 0, 0, -1, -1, -1, -1};
    lanes_transpose((const double *)from, sizeof *from / sizeof(double), 3, doubles);
    const int z = (int)p->shear.axis[i], x = z == 0 ? 2 : 0, y = z == 1 ? 2 : 1;
    const struct vec3 origin = {p->origin[x][i], p->origin[y][i], p->origin[z][i]};
    const struct shear shear = {2, p->shear.x[i], p->shear.y[i], p->shear.winding[i]};
    double (*const xs)[4] = &doubles[x], (*const ys)[4] = &doubles[y], (*const zs)[4] = &doubles[z];
    LANES_LOOP
    for (int k = 0; k < BVH_LEAF_MAX; k++) {
        const struct triangle triangle = {.a = {xs[0][k], ys[0][k], zs[0][k]}, .b = {xs[3][k], ys[3][k], zs[3][k]},
                                          .c = {xs[6][k], ys[6][k], zs[6][k]}};
        slacks[k] = triangle_slack(&triangle, origin, &shear);
    }
    return lanes_not_negative(slacks);
}

#endif
