/*
 * A packet of rays on its way through the scene: what the tests of its rays need, and which boxes they may meet.
 */
#ifndef WEFT_TRACE_LANES_PACKET_H
#define WEFT_TRACE_LANES_PACKET_H

#include <stdbool.h>

#include "trace/ahead.h"
#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"
#include "trace/kernel.h"
#include "trace/lanes.h"
#include "trace/plan.h"
#include "trace/ray.h"

enum { GROUP = 8 }; /* lanes that a primitive's test takes at once; a packet has eight such groups */
enum { BLOCK = 16, BLOCK_LANES = 0xffff }; /* the same of tests in float */

/* Lanes where the far end of interest is −INFINITY are out: ended, blocked or never there. */
struct packet {
    const struct bvh_node *nodes;    /* of the tree that it walks through */
    const struct instance *instance; /* whose mesh's tree that is, or NULL: the plan's own */
    const double *origin[3], *direction[3], *t_min, *key_min, *from, *inward;
    double *t, *key; /* the nearest hit so far; before, t_max and LANE_HIT_NONE. −INFINITY: of no more interest */
    _Alignas(64) double enter[PACKET_RAYS], leave[PACKET_RAYS]; /* for take_found: the roots ahead, or INFINITY */
    struct crossing_list *crossings;
    uint32_t first_ray; /* that of lane 0, in the batch */
    _Alignas(64) double reach[PACKET_RAYS];
    struct {
        _Alignas(64) double axis[PACKET_RAYS], x[PACKET_RAYS], y[PACKET_RAYS], winding[PACKET_RAYS];
    } shear;
    struct {
        double middle[3], half[3];
    } ways;                   /* a box around all directions; there if `shear` is */
    bool is_sheared, is_flat; /* `shear` and `flat` are there: from the packet's first triangle on */
    bool is_floats;           /* `floats` is there: from the packet's first frustum on */
    bool in_tree;             /* what is met now is of the tree, so within its extent, as filter.h wants it */
    /* For boxes, in float: rays begin at `start` and what is of interest lies within near..far from there. */
    _Alignas(64) double start[PACKET_RAYS];
    uint64_t distant; /* lanes of distant rays, each of which walks alone (walk.h) */
    double shift;     /* ray_shift of one that does now, else 0; `origin` is then where it is shifted to */
    _Alignas(64) float box_origin[3][PACKET_RAYS], inverse[3][PACKET_RAYS];
    _Alignas(64) float near[PACKET_RAYS], far[PACKET_RAYS];
    struct packet_bounds {
        float first, last; /* the origin for which the first plane is nearest, and the last one farthest */
        float inverse_low, inverse_high;
        int sign; /* of all directions along this axis; 0 where they differ (the bounds tell nothing then) */
    } bounds[3];
    bool is_aligned; /* no sign is 0 */
    double extent;   /* the tree's */
    struct {
        _Alignas(64) float direction[3][PACKET_RAYS], from[PACKET_RAYS];
    } floats;
    /* For triangles, in float, rays as lines over the axis z, along which all run alike; z < 0: there is none. */
    struct {
        int x, y, z;   /* axes */
        float stretch; /* 1 + the largest slope */
        float error;   /* of what is seen along a ray, as filter.h has it */
        _Alignas(64) float slope_x[PACKET_RAYS], slope_y[PACKET_RAYS], at_x[PACKET_RAYS], at_y[PACKET_RAYS];
    } flat;
};

static inline struct vec3 packet_origin(const struct packet *p, int i)
{
    return vec3_make(p->origin[0][i], p->origin[1][i], p->origin[2][i]);
}

static inline struct vec3 packet_direction(const struct packet *p, int i)
{
    return vec3_make(p->direction[0][i], p->direction[1][i], p->direction[2][i]);
}

static inline struct window packet_window(const struct packet *p, int i)
{
    return (struct window){p->t_min[i], INFINITY, p->key_min[i], p->from[i], p->inward[i], p->reach[i]};
}

/* --- setting out ------------------------------------------------------------------------------------------ */

/* More than twice the error of float arithmetic in a slab test: three roundings of half a unit each, and those of the
 * rays' own conversion, two of them in `inverse`. */
#define BOX_SLACK 0x1p-20f

/* The far end in float, not below its value. */
static inline float packet_far(double t, double start)
{
    return (float)(t - start) * (1 + BOX_SLACK);
}

static inline void packet_update_far(struct packet *p, int base)
{
    LANES_LOOP
    for (int i = base; i < base + GROUP; i++)
        p->far[i] = packet_far(p->t[i], p->start[i]);
}

static inline float packet_largest_far(const struct packet *p)
{
    float least, largest;
    lanes_range(p->far, PACKET_RAYS, &least, &largest);
    return largest;
}

static inline void packet_find_bounds(struct packet *p)
{
    p->is_aligned = true;
    for (int axis = 0; axis < 3; axis++) {
        float low, high, inverse_low, inverse_high;
        lanes_range(p->box_origin[axis], PACKET_RAYS, &low, &high);
        lanes_range(p->inverse[axis], PACKET_RAYS, &inverse_low, &inverse_high);
        if (inverse_low > 0 && inverse_high < INFINITY)
            p->bounds[axis] = (struct packet_bounds){high, low, inverse_low, inverse_high, 1};
        else if (inverse_high < 0 && inverse_low > -INFINITY)
            p->bounds[axis] = (struct packet_bounds){low, high, inverse_low, inverse_high, -1};
        else
            p->bounds[axis] = (struct packet_bounds){0, 0, 1, 1, 0};
        p->is_aligned &= p->bounds[axis].sign != 0;
    }
}

/* For boxes such rays start where they are shifted to. */
static __attribute__((noinline)) void packet_find_distant(struct packet *p, double extent)
{
    for (int i = 0; i < PACKET_RAYS; i++) {
        double shift = ray_shift(packet_origin(p, i), packet_direction(p, i), extent);
        p->start[i] = shift > 0 ? shift : p->start[i];
        p->distant |= (uint64_t)is_distant(packet_origin(p, i), extent) << i;
    }
}

/* A ray that comes from far off starts, for the boxes, where it comes near the tree: floats are too coarse for its own
 * origin. Whatever is within `extent`, the tree's farthest coordinate, has at least this distance from it. */
static inline void packet_find_starts(struct packet *p, double extent)
{
    _Alignas(64) float reach[PACKET_RAYS], least, largest;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        p->start[i] = 0;
        reach[i] = (float)p->reach[i];
    }
    lanes_range(reach, PACKET_RAYS, &least, &largest);
    if (largest < 1.15 * extent) /* below 2 / √3: no origin is beyond 2 extent */
        return;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        double beyond = vec3_length(packet_origin(p, i)) - 2 * extent, ahead = beyond > 0 ? beyond : 0;
        p->start[i] = ahead < INFINITY ? ahead : 0; /* the squares may be too large */
    }
    if (largest > 0.99 * DISTANT * extent)
        packet_find_distant(p, extent);
}

static inline void packet_prepare_boxes(struct packet *p, double extent)
{
    packet_find_starts(p, extent);
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        double start = p->start[i];
        p->box_origin[0][i] = (float)(p->origin[0][i] + start * p->direction[0][i]);
        p->box_origin[1][i] = (float)(p->origin[1][i] + start * p->direction[1][i]);
        p->box_origin[2][i] = (float)(p->origin[2][i] + start * p->direction[2][i]);
    }
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        p->inverse[0][i] = 1 / (float)p->direction[0][i];
        p->inverse[1][i] = 1 / (float)p->direction[1][i];
        p->inverse[2][i] = 1 / (float)p->direction[2][i];
        p->near[i] = (float)(p->t_min[i] - p->start[i]) * (1 - BOX_SLACK);
        p->far[i] = packet_far(p->t[i], p->start[i]);
    }
}

/* Lanes from `count` on repeat lane 0 where bounds are taken over them, and are out. */
static inline void packet_silence(struct packet *p, int count)
{
    for (int i = count; i < PACKET_RAYS; i++) {
        p->far[i] = -INFINITY;
        p->t[i] = -INFINITY;
        for (int axis = 0; axis < 3; axis++) {
            p->box_origin[axis][i] = p->box_origin[axis][0];
            p->inverse[axis][i] = p->inverse[axis][0];
        }
    }
}

/* The axis along which all rays run the same way, and fastest where they are slowest: by at least 1/8, or it is −1. No
 * slope over it is steeper than *steepest. */
static inline int packet_common_axis(const struct packet *p, float *steepest)
{
    int best = -1;
    *steepest = 8;
    for (int axis = 0; axis < 3; axis++) {
        const struct packet_bounds *b = &p->bounds[axis];
        float steepness = b->sign > 0 ? b->inverse_high : -b->inverse_low;
        if (b->sign != 0 && steepness <= *steepest) {
            *steepest = steepness;
            best = axis;
        }
    }
    return best;
}

/* (Extents whose squares float may not hold are left out.) */
static inline void packet_prepare_flat(struct packet *p)
{
    if (p->is_flat)
        return;
    p->is_flat = true;
    float steepest;
    int z = p->extent > 0x1p-40 && p->extent < 0x1p40 ? packet_common_axis(p, &steepest) : -1;
    p->flat.z = z;
    if (z < 0)
        return;
    int x = p->flat.x = (z + 1) % 3, y = p->flat.y = (z + 2) % 3;
    p->flat.stretch = 1 + steepest;
    p->flat.error = 0x1p-18f * (float)p->extent * p->flat.stretch;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        float slope_x = (float)p->direction[x][i] * p->inverse[z][i];
        float slope_y = (float)p->direction[y][i] * p->inverse[z][i];
        p->flat.slope_x[i] = slope_x;
        p->flat.slope_y[i] = slope_y;
        p->flat.at_x[i] = p->box_origin[x][i] - slope_x * p->box_origin[z][i];
        p->flat.at_y[i] = p->box_origin[y][i] - slope_y * p->box_origin[z][i];
    }
}

/* The middle of what a coordinate of all directions is in, and how far they are from it. */
static inline void packet_find_ways(struct packet *p)
{
    for (int axis = 0; axis < 3; axis++) {
        bool known = p->nodes && p->bounds[axis].sign != 0;
        float low = known ? 1 / p->bounds[axis].inverse_high : -1, high = known ? 1 / p->bounds[axis].inverse_low : 1;
        p->ways.middle[axis] = (low + high) / 2;
        p->ways.half[axis] = (high - low) / 2;
    }
}

static inline void packet_prepare_shear(struct packet *p)
{
    if (p->is_sheared)
        return;
    p->is_sheared = true;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        struct shear shear = shear_of(packet_direction(p, i));
        p->shear.axis[i] = shear.axis;
        p->shear.x[i] = shear.x;
        p->shear.y[i] = shear.y;
        p->shear.winding[i] = shear.winding;
    }
    packet_find_ways(p);
}

static inline void packet_prepare_floats(struct packet *p)
{
    if (p->is_floats)
        return;
    p->is_floats = true;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        p->floats.direction[0][i] = (float)p->direction[0][i];
        p->floats.direction[1][i] = (float)p->direction[1][i];
        p->floats.direction[2][i] = (float)p->direction[2][i];
        p->floats.from[i] = (float)p->from[i];
    }
}

/* Rays first .. first + 63 of the batch, of which `count` are there; t and key take what they hit. */
static inline void packet_start(struct packet *p, const struct plan *plan, const struct ray_batch *rays, size_t first,
                                int count, double *t, double *key)
{
    for (int axis = 0; axis < 3; axis++) {
        p->origin[axis] = rays->origin[axis] + first;
        p->direction[axis] = rays->direction[axis] + first;
    }
    p->nodes = plan->bvh.nodes;
    p->instance = NULL;
    p->t_min = rays->t_min + first;
    p->key_min = rays->key_min + first;
    p->from = rays->from + first;
    p->inward = rays->inward + first;
    p->t = t;
    p->key = key;
    p->first_ray = (uint32_t)first;
    LANES_LOOP
    for (int i = 0; i < PACKET_RAYS; i++) {
        t[i] = rays->t_max[first + (size_t)i];
        key[i] = LANE_HIT_NONE;
        p->reach[i] = vec3_max_abs(packet_origin(p, i));
    }
    p->is_sheared = p->is_flat = p->is_floats = p->in_tree = false;
    p->distant = 0;
    p->shift = 0;
    p->extent = plan->bvh.extent;
    if (plan->bvh.node_count > 0) {
        packet_prepare_boxes(p, plan->bvh.extent);
        packet_silence(p, count);
        packet_find_bounds(p);
    } else {
        packet_silence(p, count);
    }
}

/* --- boxes ------------------------------------------------------------------------------------------------ */

/* The planes of a node's children that the packet's rays meet first and last, by axis; boundless where rays differ. */
struct packet_planes {
    const float *first[3], *last[3];
};

static inline struct packet_planes packet_planes(const struct packet *p, const struct bvh_node *node)
{
    static _Alignas(32) const float nowhere[2][BVH_WIDTH] = {
        {-INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY},
        {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY},
    };
    struct packet_planes planes;
    for (int axis = 0; axis < 3; axis++) {
        int sign = p->bounds[axis].sign;
        const float *low = node->low[axis], *high = node->high[axis];
        planes.first[axis] = sign > 0 ? low : sign < 0 ? high : nowhere[0];
        planes.last[axis] = sign > 0 ? high : sign < 0 ? low : nowhere[1];
    }
    return planes;
}

/* Of the block of lanes from `base`, which may meet child `c`, where all rays run the same way along every axis. */
static inline uint32_t block_meets_ahead(const struct packet *p, const struct packet_planes *planes, int c, int base)
{
    const float x0 = planes->first[0][c], y0 = planes->first[1][c], z0 = planes->first[2][c];
    const float x1 = planes->last[0][c], y1 = planes->last[1][c], z1 = planes->last[2][c];
    _Alignas(64) float enter[BLOCK], leave[BLOCK];
    LANES_LOOP
    for (int i = 0; i < BLOCK; i++) {
        int r = base + i;
        float ox = p->box_origin[0][r], oy = p->box_origin[1][r], oz = p->box_origin[2][r];
        float ix = p->inverse[0][r], iy = p->inverse[1][r], iz = p->inverse[2][r];
        float ex = (x0 - ox) * ix, ey = (y0 - oy) * iy, ez = (z0 - oz) * iz;
        float lx = (x1 - ox) * ix, ly = (y1 - oy) * iy, lz = (z1 - oz) * iz;
        float e = ex > p->near[r] ? ex : p->near[r], l = lx < ly ? lx : ly;
        e = ey > e ? ey : e;
        enter[i] = ez > e ? ez : e;
        l = (lz < l ? lz : l) * (1 + BOX_SLACK);
        leave[i] = p->far[r] < l ? p->far[r] : l;
    }
    return lanes_at_most_16(enter, leave);
}

/* The same for rays that run anywhere. */
static inline uint32_t block_meets(const struct packet *p, const struct bvh_node *node, int c, int base)
{
    const float lx = node->low[0][c], ly = node->low[1][c], lz = node->low[2][c];
    const float hx = node->high[0][c], hy = node->high[1][c], hz = node->high[2][c];
    _Alignas(64) float enter[BLOCK], leave[BLOCK];
    LANES_LOOP
    for (int i = 0; i < BLOCK; i++) {
        int r = base + i;
        float ox = p->box_origin[0][r], oy = p->box_origin[1][r], oz = p->box_origin[2][r];
        float ix = p->inverse[0][r], iy = p->inverse[1][r], iz = p->inverse[2][r];
        float ex = ((ix < 0 ? hx : lx) - ox) * ix, l0 = ((ix < 0 ? lx : hx) - ox) * ix;
        float ey = ((iy < 0 ? hy : ly) - oy) * iy, l1 = ((iy < 0 ? ly : hy) - oy) * iy;
        float ez = ((iz < 0 ? hz : lz) - oz) * iz, l2 = ((iz < 0 ? lz : hz) - oz) * iz;
        float e = ex > p->near[r] ? ex : p->near[r], l = l0 < l1 ? l0 : l1;
        e = ey > e ? ey : e;
        enter[i] = ez > e ? ez : e;
        l = (l2 < l ? l2 : l) * (1 + BOX_SLACK);
        leave[i] = p->far[r] < l ? p->far[r] : l;
    }
    return lanes_at_most_16(enter, leave);
}

/* Which of the lanes in `lanes` may meet child `c`. */
static inline uint64_t packet_meets(const struct packet *p, const struct bvh_node *node,
                                    const struct packet_planes *planes, int c, uint64_t lanes)
{
    uint64_t met = 0;
    for (int base = 0; base < PACKET_RAYS; base += BLOCK)
        if (lanes >> base & BLOCK_LANES)
            met |= (uint64_t)(p->is_aligned ? block_meets_ahead(p, planes, c, base) : block_meets(p, node, c, base))
                   << base;
    return met & lanes;
}

/* Which children any ray of the packet may meet, by interval arithmetic over all of them; near[c] is a bound from below
 * on where. Axes along which the rays do not all run the same way tell nothing. */
static inline uint32_t packet_children(const struct packet *p, const struct bvh_node *node,
                                       const struct packet_planes *planes, float far, float *near)
{
    const struct packet_bounds x = p->bounds[0], y = p->bounds[1], z = p->bounds[2];
    const float *x0 = planes->first[0], *y0 = planes->first[1], *z0 = planes->first[2];
    const float *x1 = planes->last[0], *y1 = planes->last[1], *z1 = planes->last[2];
    _Alignas(32) float leave[BVH_WIDTH];
    LANES_LOOP
    for (int c = 0; c < BVH_WIDTH; c++) {
        float xa = (x0[c] - x.first) * x.inverse_low, xb = (x0[c] - x.first) * x.inverse_high;
        float ya = (y0[c] - y.first) * y.inverse_low, yb = (y0[c] - y.first) * y.inverse_high;
        float za = (z0[c] - z.first) * z.inverse_low, zb = (z0[c] - z.first) * z.inverse_high;
        float xc = (x1[c] - x.last) * x.inverse_low, xd = (x1[c] - x.last) * x.inverse_high;
        float yc = (y1[c] - y.last) * y.inverse_low, yd = (y1[c] - y.last) * y.inverse_high;
        float zc = (z1[c] - z.last) * z.inverse_low, zd = (z1[c] - z.last) * z.inverse_high;
        float e = xa < xb ? xa : xb, l = xc > xd ? xc : xd;
        float ey = ya < yb ? ya : yb, ly = yc > yd ? yc : yd;
        float ez = za < zb ? za : zb, lz = zc > zd ? zc : zd;
        e = ey > e ? ey : e;
        l = ly < l ? ly : l;
        near[c] = ez > e ? ez : e;
        l = (lz < l ? lz : l) * (1 + BOX_SLACK);
        leave[c] = far < l ? far : l;
    }
    return lanes_at_most(near, leave) & lanes_at_most(node->low[0], node->high[0]);
}

#endif
