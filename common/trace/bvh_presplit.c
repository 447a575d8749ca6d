/* Cuts triangles whose boxes are mostly empty into pieces with a box each: where long thin ones lie across the axes,
 * boxes around whole triangles overlap so much that a tree tells little (Ernst and Greiner, "Early Split Clipping for
 * Bounding Volume Hierarchies", RT 2007). What a box is wasted on is measured as Karras and Aila do ("Fast Parallel
 * Construction of High-Quality Bounding Volume Hierarchies", HPG 2013, section 4.2).
 *
 * A hit is found if it is in the box of the piece that it is on: see triangle_grazed_roots. */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"
#include "trace/bvh_parts.h"

enum {
    CUTS_MAX = 63,    /* of one triangle */
    CORNERS_MAX = 9, /* a triangle cut by both sides of a box along each axis */
};

/* In mean lengths of emptiness (measured): a triangle with more than WASTED of them is cut, once for each CUT of them.
 * Meshes of triangles that are much alike are only made slower by pieces: so where less than SHARE of all emptiness is
 * in those triangles, none is cut. */
static const double WASTED = 2, CUT = 0.9, SHARE = 0.25;

struct piece {
    struct vec3 corners[CORNERS_MAX];
    int count;
};

static double coordinate(struct vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static struct vec3 with_coordinate(struct vec3 v, int axis, double to)
{
    return vec3_make(axis == 0 ? to : v.x, axis == 1 ? to : v.y, axis == 2 ? to : v.z);
}

static struct bounds piece_bounds(const struct piece *piece)
{
    struct bounds bounds = {piece->corners[0], piece->corners[0]};
    for (int i = 1; i < piece->count; i++) {
        struct bounds corner = {piece->corners[i], piece->corners[i]};
        bounds = bounds_join(&bounds, &corner);
    }
    return bounds;
}

static struct piece whole(const struct triangle *triangle)
{
    return (struct piece){{triangle->a, triangle->b, triangle->c}, 3};
}

double bvh_emptiness(const struct triangle *t, const struct bounds *bounds)
{
    struct vec3 size = vec3_sub(bounds->high, bounds->low);
    struct vec3 across = vec3_cross(vec3_sub(t->b, t->a), vec3_sub(t->c, t->a));
    double full = size.x * size.y + size.y * size.z + size.z * size.x;
    double filled = (fabs(across.x) + fabs(across.y) + fabs(across.z)) / 2;
    return full > filled ? sqrt(full - filled) : 0;
}

/* The part of a piece on one side of a plane across an axis: above it for sign 1, below for −1. */
static struct piece piece_beyond(const struct piece *from, int axis, double at, double sign)
{
    struct piece to = {.count = 0};
    for (int i = 0; i < from->count; i++) {
        struct vec3 p = from->corners[i], q = from->corners[(i + 1) % from->count];
        double dp = sign * (coordinate(p, axis) - at), dq = sign * (coordinate(q, axis) - at);
        if (dp >= 0)
            to.corners[to.count++] = p;
        if ((dp > 0 && dq < 0) || (dp < 0 && dq > 0))
            to.corners[to.count++] = with_coordinate(vec3_mix(p, q, dp / (dp - dq)), axis, at);
    }
    return to;
}

/* --- cutting ---------------------------------------------------------------------------------------------- */

struct cutting {
    struct bvh_item item;   /* what is cut; each piece is one with a box of its own */
    struct bvh_item *items; /* the pieces */
    size_t count;
};

static int longest_axis(struct vec3 size)
{
    int other = size.y > size.z ? 1 : 2;
    return size.x > coordinate(size, other) ? 0 : other;
}

/* Halves the piece along the longest side of its box, and the halves again, more often the larger one: `cuts` times in
 * all, unless a piece is too short for that. */
static void cut(struct cutting *cutting, const struct piece *piece, int cuts)
{
    struct bounds bounds = piece_bounds(piece);
    int axis = longest_axis(vec3_sub(bounds.high, bounds.low));
    double low = coordinate(bounds.low, axis), high = coordinate(bounds.high, axis), middle = (low + high) / 2;
    if (cuts == 0 || middle <= low || middle >= high) {
        bvh_item_bound(&cutting->item, &bounds);
        cutting->items[cutting->count++] = cutting->item;
        return;
    }
    struct piece parts[2] = {piece_beyond(piece, axis, middle, -1), piece_beyond(piece, axis, middle, 1)};
    struct bounds below = piece_bounds(&parts[0]), above = piece_bounds(&parts[1]);
    double length_below = vec3_max_abs(vec3_sub(below.high, below.low));
    double length_above = vec3_max_abs(vec3_sub(above.high, above.low));
    int cuts_below = (int)((cuts - 1) * (length_below / (length_below + length_above)) + 0.5);
    cut(cutting, &parts[0], cuts_below);
    cut(cutting, &parts[1], cuts - 1 - cuts_below);
}

/* --- what is cut ------------------------------------------------------------------------------------------ */

/* The mean emptiness of the triangles; INFINITY where cutting does not pay. */
static double mean_emptiness(const struct bvh_item *items, size_t count, const float *empty)
{
    double sum = 0, wasted = 0, triangles = 0;
    for (size_t i = 0; i < count; i++) {
        sum += empty[items[i].id];
        triangles += items[i].kind == PRIMITIVE_TRIANGLE;
    }
    for (size_t i = 0; i < count; i++)
        wasted += empty[items[i].id] * triangles > WASTED * sum ? empty[items[i].id] : 0;
    return wasted > 0 && wasted >= SHARE * sum ? sum / triangles : INFINITY;
}

static int cuts_of(double empty, double mean)
{
    double share = empty / mean;
    return share <= WASTED ? 0 : share < CUT * CUTS_MAX ? (int)(share / CUT) : CUTS_MAX;
}

size_t bvh_presplit(const struct plan *plan, struct bvh_item **items, size_t count, const float *empty)
{
    double mean = mean_emptiness(*items, count, empty);
    size_t total = count;
    if (mean == INFINITY)
        return count;
    for (size_t i = 0; i < count; i++)
        total += (size_t)cuts_of(empty[(*items)[i].id], mean);
    struct cutting cutting = {.items = memory_aligned(total, sizeof **items, sizeof **items)};
    for (size_t i = 0; i < count; i++) {
        cutting.item = (*items)[i];
        int cuts = cuts_of(empty[cutting.item.id], mean);
        if (cuts > 0) {
            struct piece piece = whole(&plan->triangles[plan->primitives[cutting.item.id].index]);
            cut(&cutting, &piece, cuts);
        } else {
            cutting.items[cutting.count++] = cutting.item;
        }
    }
    free(*items);
    *items = cutting.items;
    return cutting.count;
}
