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

/* Lanes where the far end of interest is −INFINITY are out: ended, blocked or never there. */
struct packet {
    const double *origin[3], *direction[3], *t_min, *key_min, *from, *inward;
    double *t, *key; /* the nearest hit so far; before, t_max and LANE_HIT_NONE. −INFINITY: of no more interest */
    _Alignas(64) double enter[PACKET_RAYS], leave[PACKET_RAYS]; /* for take_found: the roots ahead, or INFINITY */
    struct crossing_list *crossings;
    uint32_t first_ray; /* that of lane 0, in the batch */
    _Alignas(64) double reach[PACKET_RAYS];
    struct {
        _Alignas(64) double axis[PACKET_RAYS], x[PACKET_RAYS], y[PACKET_RAYS], winding[PACKET_RAYS];
    } shear;
    bool is_sheared; /* `shear` is there: from the packet's first triangle on */
    /* For boxes, in float: rays begin at `start` and what is of interest lies within near..far from there. */
    _Alignas(64) double start[PACKET_RAYS];
    _Alignas(64) float box_origin[3][PACKET_RAYS], inverse[3][PACKET_RAYS];
    _Alignas(64) float near[PACKET_RAYS], far[PACKET_RAYS];
    struct packet_bounds {
        float origin_low, origin_high, inverse_low, inverse_high;
        int sign; /* of all directions along this axis; 0 where they differ */
    } bounds[3];
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
    for (int axis = 0; axis < 3; axis++) {
        struct packet_bounds *b = &p->bounds[axis];
        lanes_range(p->box_origin[axis], PACKET_RAYS, &b->origin_low, &b->origin_high);
        lanes_range(p->inverse[axis], PACKET_RAYS, &b->inverse_low, &b->inverse_high);
        b->sign = b->inverse_low > 0 && b->inverse_high < INFINITY ? 1
                  : b->inverse_high < 0 && b->inverse_low > -INFINITY ? -1 : 0;
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
        double beyond = vec3_length(packet_origin(p, i)) - 2 * extent;
        p->start[i] = beyond > 0 ? beyond : 0;
    }
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
}

/* Rays first .. first + 63 of the batch, of which `count` are there; t and key take what they hit. */
static inline void packet_start(struct packet *p, const struct plan *plan, const struct ray_batch *rays, size_t first,
                                int count, double *t, double *key)
{
    for (int axis = 0; axis < 3; axis++) {
        p->origin[axis] = rays->origin[axis] + first;
        p->direction[axis] = rays->direction[axis] + first;
    }
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
    p->is_sheared = false;
    if (plan->bvh.node_count > 0) {
        packet_prepare_boxes(p, plan->bvh.extent);
        packet_silence(p, count);
        packet_find_bounds(p);
    } else {
        packet_silence(p, count);
    }
}

/* --- boxes ------------------------------------------------------------------------------------------------ */

/* Which of the lanes in `lanes` may meet child `c`. */
static inline uint64_t packet_meets(const struct packet *p, const struct bvh_node *node, int c, uint64_t lanes)
{
    float lx = node->low[0][c], ly = node->low[1][c], lz = node->low[2][c];
    float hx = node->high[0][c], hy = node->high[1][c], hz = node->high[2][c];
    uint64_t met = 0;
    for (int base = 0; base < PACKET_RAYS; base += 16) {
        if (!(lanes >> base & 0xffff))
            continue;
        _Alignas(64) float enter[16], leave[16];
        LANES_LOOP
        for (int i = 0; i < 16; i++) {
            int r = base + i;
            float ax = (lx - p->box_origin[0][r]) * p->inverse[0][r], bx = (hx - p->box_origin[0][r]) * p->inverse[0][r];
            float ay = (ly - p->box_origin[1][r]) * p->inverse[1][r], by = (hy - p->box_origin[1][r]) * p->inverse[1][r];
            float az = (lz - p->box_origin[2][r]) * p->inverse[2][r], bz = (hz - p->box_origin[2][r]) * p->inverse[2][r];
            float e = ax < bx ? ax : bx, l = ax < bx ? bx : ax;
            float ey = ay < by ? ay : by, ez = az < bz ? az : bz, ly1 = ay < by ? by : ay, lz1 = az < bz ? bz : az;
            e = ey > e ? ey : e;
            e = ez > e ? ez : e;
            l = ly1 < l ? ly1 : l;
            l = (lz1 < l ? lz1 : l) * (1 + BOX_SLACK);
            enter[i] = p->near[r] > e ? p->near[r] : e;
            leave[i] = p->far[r] < l ? p->far[r] : l;
        }
        met |= (uint64_t)lanes_at_most_16(enter, leave) << base;
    }
    return met & lanes;
}

/* Which children any ray of the packet may meet, by interval arithmetic over all of them; near[c] is a bound from below
 * on where. Axes along which the rays do not all run the same way tell nothing. */
static inline uint32_t packet_children(const struct packet *p, const struct bvh_node *node, float far, float *near)
{
    _Alignas(32) float leave[BVH_WIDTH];
    for (int c = 0; c < BVH_WIDTH; c++) {
        near[c] = node->low[0][c] > node->high[0][c] ? NAN : -INFINITY; /* NaN: no child, and never met */
        leave[c] = far;
    }
    for (int axis = 0; axis < 3; axis++) {
        const struct packet_bounds *b = &p->bounds[axis];
        if (b->sign == 0)
            continue;
        const float *first = b->sign > 0 ? node->low[axis] : node->high[axis];
        const float *last = b->sign > 0 ? node->high[axis] : node->low[axis];
        float first_origin = b->sign > 0 ? b->origin_high : b->origin_low;
        float last_origin = b->sign > 0 ? b->origin_low : b->origin_high;
        LANES_LOOP
        for (int c = 0; c < BVH_WIDTH; c++) {
            float e0 = (first[c] - first_origin) * b->inverse_low, e1 = (first[c] - first_origin) * b->inverse_high;
            float l0 = (last[c] - last_origin) * b->inverse_low, l1 = (last[c] - last_origin) * b->inverse_high;
            float e = e0 < e1 ? e0 : e1, l = (l0 > l1 ? l0 : l1) * (1 + BOX_SLACK);
            near[c] = e > near[c] ? e : near[c];
            leave[c] = l < leave[c] ? l : leave[c];
        }
    }
    return lanes_at_most(near, leave);
}

#endif
