/* Private to the tree's builder: its parts, from the boxes of primitives up to nodes. */
#ifndef WEFT_TRACE_BVH_PARTS_H
#define WEFT_TRACE_BVH_PARTS_H

#include <math.h>
#include <stdbool.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "trace/bvh.h"

/* Lanes x, y, z and one that nobody reads. */
typedef float float4 __attribute__((vector_size(16)));
typedef int32_t int4 __attribute__((vector_size(16)));

struct box4 {
    float4 low, high;
};

/* A primitive's box; arrays of them are aligned to their size, so that each is whole in a cache line. */
struct bvh_item {
    union {
        float4 low4;
        struct {
            float low[3];
            uint32_t id;
        };
    };
    union {
        float4 high4;
        struct {
            float high[3];
            uint32_t kind;
        };
    };
};

/* A run of items. */
struct bvh_range {
    size_t first, count;
    struct box4 box;     /* around them */
    struct box4 centers; /* around bvh_center of each */
    float area;          /* half of the surface of box */
    uint8_t side;        /* they are in builder->items[side] */
    bool is_leaf;        /* few enough, and of one kind; it may be cut further all the same */
};

/* Items are split from one array into the other and back: the items of a range are in one of them, and the same places
 * of the other are free. Boxes are in a unit in which no coordinate exceeds 2 or so, so that areas are good floats. */
struct bvh_builder {
    struct bvh_item *items[2];
    double unit;          /* length of the boxes' unit: a power of two */
    struct bvh_leaf_item {
        uint32_t id;
        union {
            uint32_t kind, index; /* in the end, its place among those of its kind */
        };
    } *leaf_items; /* of each item in the order of the leaves: filled by bvh_make_nodes */
    int threads;
};

struct bounds;
struct plan;
struct triangle;

/* Sets the item's box, to the nearest floats. */
void bvh_item_bound(struct bvh_item *item, const struct bounds *bounds);

/* How much of its box's surface a triangle cannot fill, as the side of a square. */
double bvh_emptiness(const struct triangle *triangle, const struct bounds *bounds);

/* Puts several items, each around a piece, in the place of some triangles, where that makes a better tree. *items may
 * be replaced by a larger array. `empty` has the emptiness of each of the plan's primitives, 0 for what is no triangle.
 * Returns how many items there are then. */
size_t bvh_presplit(const struct plan *plan, struct bvh_item **items, size_t count, const float *empty);

/* The range of items from `first` on in builder->items[side]. */
struct bvh_range bvh_range_make(const struct bvh_builder *builder, int side, size_t first, size_t count);

/* Splits a range of at least two items into *range and *right, both with items: by kinds where nothing else keeps it
 * from being a leaf, else by the surface area heuristic or, if `even`, into halves. Moves its items about. */
void bvh_split(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right, bool even);

/* Fills bvh->nodes and builder->leaf_items from builder->items[0]. Leaves count items where they shall count primitives
 * of a kind. */
void bvh_make_nodes(struct bvh *bvh, const struct bvh_builder *builder, size_t item_count);

/* --- bins ------------------------------------------------------------------------------------------------- */

enum { BVH_BINS_MAX = 32 };

/* Which bins an item's centre falls into: (int)((centre − start) scale) along each axis. */
struct bvh_binning {
    float4 start, scale; /* scale 0: all in bin 0 */
    int bins;
};

struct bvh_bins {
    struct box4 box[3][BVH_BINS_MAX];
    int32_t count[3][BVH_BINS_MAX];
};

/* Items whose centre along `axis` falls into a bin below `bin` go to the left. */
struct bvh_cut {
    int axis; /* −1: none */
    int bin;
    float start, scale;
};

/* How the items of a range are told apart. */
struct bvh_binning bvh_binning_of(const struct bvh_range *range);

/* Sets the bins to what items fall into them. */
void bvh_bins_fill(struct bvh_bins *bins, const struct bvh_binning *binning, const struct bvh_item *items,
                   size_t count);

/* Adds what is in others, of the same binning. */
void bvh_bins_add(struct bvh_bins *to, const struct bvh_bins *from, const struct bvh_binning *binning);

/* The cheapest plane between bins. */
struct bvh_cut bvh_bins_cut(const struct bvh_bins *bins, const struct bvh_binning *binning);

/* --- lanes ------------------------------------------------------------------------------------------------ */

/* Lane by lane; b where they are equal or a is not a number. On x86 gcc does not see by itself that this is one
 * instruction. */
static inline float4 float4_min(float4 a, float4 b)
{
#ifdef __SSE__
    return _mm_min_ps(a, b);
#else
    int4 less = a < b;
    return (float4)(((int4)a & less) | ((int4)b & ~less));
#endif
}

static inline float4 float4_max(float4 a, float4 b)
{
#ifdef __SSE__
    return _mm_max_ps(a, b);
#else
    int4 more = a > b;
    return (float4)(((int4)a & more) | ((int4)b & ~more));
#endif
}

static inline struct box4 box4_empty(void)
{
    float4 most = {INFINITY, INFINITY, INFINITY, INFINITY};
    return (struct box4){most, -most};
}

static inline void box4_grow(struct box4 *box, float4 low, float4 high)
{
    box->low = float4_min(low, box->low);
    box->high = float4_max(high, box->high);
}

/* Half of its surface. */
static inline float box4_half_area(const struct box4 *box)
{
    float4 size = box->high - box->low;
    return size[0] * (size[1] + size[2]) + size[1] * size[2];
}

/* Twice the middle of its box. */
static inline float4 bvh_center(const struct bvh_item *item)
{
    const int4 xyz = {-1, -1, -1, 0}; /* what else is there would be slow to multiply where it is subnormal */
    return (float4)((int4)(item->low4 + item->high4) & xyz);
}

#endif
