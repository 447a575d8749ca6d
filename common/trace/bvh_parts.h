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

/* A primitive's box. */
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
    struct box4 centers; /* around low + high of each */
    bool is_leaf;        /* few enough, and of one kind; it may be cut further all the same */
};

struct bvh_builder {
    struct bvh_item *items, *scratch; /* equally many */
    int threads;
};

struct bounds;

/* Sets the item's box, to the nearest floats. */
void bvh_item_bound(struct bvh_item *item, const struct bounds *bounds);

/* Puts several items, each around a piece, in the place of some triangles, where that makes a better tree. *items may
 * be replaced by a larger array. Returns how many there are then. */
size_t bvh_presplit(const struct plan *plan, struct bvh_item **items, size_t count);

/* Boxes and leafness of the items from `first` on. */
struct bvh_range bvh_range_make(const struct bvh_builder *builder, size_t first, size_t count);

/* Splits a range of at least two items into *range and *right, both with items: by kinds where nothing else keeps it
 * from being a leaf, else by the surface area heuristic or, if `even`, into halves. Moves its items about. */
void bvh_split(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right, bool even);

/* Fills bvh->nodes from items. Leaves count items where they shall count primitives of a kind. */
void bvh_make_nodes(struct bvh *bvh, const struct bvh_builder *builder, size_t item_count);

/* Lane by lane; b where they are equal. On x86 gcc does not see by itself that the last two lines are one instruction,
 * which makes the whole build a quarter faster. */
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
    return -float4_min(-a, -b);
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

/* Half of its surface; in double, where no finite box overflows. */
static inline double box4_half_area(const struct box4 *box)
{
    float4 size = box->high - box->low;
    double x = size[0], y = size[1], z = size[2];
    return x * y + y * z + z * x;
}

#endif
