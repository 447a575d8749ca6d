#include "trace/bvh.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"

enum {
    BINS = 16,
    LEAF_MAX = 4,       /* primitives; more only where they cannot be told apart */
    GIANT_FACTOR = 256, /* a primitive so many times the median's size dwarfs the rest */
};

/* Of the extent: 2^-22 is four units in the last place of a float there. */
static const double GROWTH = 0x1p-22;

struct item {
    float low[3], high[3];
    uint32_t id;
};

struct builder {
    struct bvh *bvh;
    struct item *items;
    size_t node_capacity;
};

/* --- items ------------------------------------------------------------------------------------------------ */

static double size_of(const struct bounds *b)
{
    return vec3_max_abs(vec3_sub(b->high, b->low));
}

static int compare_doubles(const void *left, const void *right)
{
    const double *a = left, *b = right;
    return *a < *b ? -1 : *a > *b;
}

/* The median size of the bounded primitives; 0 if there is none. */
static double median_size(const struct plan *plan)
{
    double *sizes = memory_array(plan->primitive_count, sizeof *sizes);
    size_t count = 0;
    struct bounds bounds;
    for (uint32_t id = 0; id < plan->primitive_count; id++)
        if (bounds_of_primitive(plan, id, &bounds))
            sizes[count++] = size_of(&bounds);
    qsort(sizes, count, sizeof *sizes, compare_doubles);
    double median = count ? sizes[count / 2] : 0;
    free(sizes);
    return median;
}

/* `grow` exceeds the rounding to float, at most half a unit in the last place of the extent. */
static void to_floats(struct vec3 v, double grow, float out[3])
{
    const double from[3] = {v.x, v.y, v.z};
    for (int axis = 0; axis < 3; axis++)
        out[axis] = (float)(from[axis] + grow);
}

/* The farthest coordinate of the boxes, with the camera at 0. */
static double extent_of(const struct bounds *boxes, size_t count)
{
    double extent = 0;
    for (size_t i = 0; i < count; i++) {
        double low = vec3_max_abs(boxes[i].low), high = vec3_max_abs(boxes[i].high);
        extent = low > extent ? low : extent;
        extent = high > extent ? high : extent;
    }
    return extent;
}

/* Splits the primitives into items for the tree and loose ones. Returns how many items. */
static size_t collect(struct bvh *bvh, const struct plan *plan, struct item *items)
{
    struct bounds *boxes = memory_array(plan->primitive_count, sizeof *boxes);
    double giant = GIANT_FACTOR * median_size(plan);
    size_t count = 0;
    for (uint32_t id = 0; id < plan->primitive_count; id++) {
        if (!bounds_of_primitive(plan, id, &boxes[count]) || size_of(&boxes[count]) > giant)
            bvh->loose[bvh->loose_count++] = id;
        else
            items[count++].id = id;
    }
    double grow = GROWTH * extent_of(boxes, count);
    for (size_t i = 0; i < count; i++) {
        to_floats(boxes[i].low, -grow, items[i].low);
        to_floats(boxes[i].high, grow, items[i].high);
    }
    free(boxes);
    return count;
}

/* --- splitting -------------------------------------------------------------------------------------------- */

static void empty_box(float low[3], float high[3])
{
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
    }
}

static void grow_box(float low[3], float high[3], const float by_low[3], const float by_high[3])
{
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = by_low[axis] < low[axis] ? by_low[axis] : low[axis];
        high[axis] = by_high[axis] > high[axis] ? by_high[axis] : high[axis];
    }
}

static float half_area(const float low[3], const float high[3])
{
    float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x * y + y * z + z * x;
}

static float middle(const struct item *item, int axis)
{
    return 0.5f * (item->low[axis] + item->high[axis]);
}

struct bin {
    float low[3], high[3];
    size_t count;
};

struct split {
    int axis;    /* −1: none */
    int bin;     /* the first bin on the right */
    float start, scale;
    float cost;
};

static int bin_of(const struct split *split, const struct item *item)
{
    int bin = (int)((middle(item, split->axis) - split->start) * split->scale);
    return bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
}

/* The cheapest of the 15 planes between bins along one axis: least sum of area × primitives on both sides. */
static void try_axis(const struct item *items, size_t count, struct split split, struct split *best)
{
    struct bin bins[BINS];
    float right_cost[BINS], low[3], high[3];
    for (int i = 0; i < BINS; i++) {
        empty_box(bins[i].low, bins[i].high);
        bins[i].count = 0;
    }
    for (size_t i = 0; i < count; i++) {
        struct bin *bin = &bins[bin_of(&split, &items[i])];
        grow_box(bin->low, bin->high, items[i].low, items[i].high);
        bin->count++;
    }
    size_t right = 0;
    empty_box(low, high);
    for (int i = BINS - 1; i > 0; i--) {
        grow_box(low, high, bins[i].low, bins[i].high);
        right += bins[i].count;
        right_cost[i] = right ? half_area(low, high) * (float)right : INFINITY;
    }
    size_t left = 0;
    empty_box(low, high);
    for (int i = 1; i < BINS; i++) {
        grow_box(low, high, bins[i - 1].low, bins[i - 1].high);
        left += bins[i - 1].count;
        split.bin = i;
        split.cost = left ? half_area(low, high) * (float)left + right_cost[i] : INFINITY;
        if (split.cost < best->cost)
            *best = split;
    }
}

static struct split find_split(const struct item *items, size_t count)
{
    struct split best = {.axis = -1, .cost = INFINITY};
    for (int axis = 0; axis < 3; axis++) {
        float low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < count; i++) {
            float m = middle(&items[i], axis);
            low = m < low ? m : low;
            high = m > high ? m : high;
        }
        float scale = BINS / (high - low);
        if (high > low && isfinite(scale))
            try_axis(items, count, (struct split){.axis = axis, .start = low, .scale = scale}, &best);
    }
    return best;
}

/* Moves the items left of the split to the front; returns how many those are. */
static size_t partition(struct item *items, size_t count, const struct split *split)
{
    size_t left = 0;
    for (size_t i = 0; i < count; i++) {
        if (bin_of(split, &items[i]) >= split->bin)
            continue;
        struct item swap = items[left];
        items[left++] = items[i];
        items[i] = swap;
    }
    return left;
}

/* --- nodes ------------------------------------------------------------------------------------------------ */

static void make_leaf(struct builder *builder, struct bvh_node *node, size_t first, size_t count)
{
    struct bvh *bvh = builder->bvh;
    node->first = (uint32_t)bvh->id_count;
    node->count = (uint32_t)count;
    for (size_t i = 0; i < count; i++)
        bvh->ids[bvh->id_count++] = builder->items[first + i].id;
}

static void build_node(struct builder *builder, uint32_t index, size_t first, size_t count, int depth)
{
    struct bvh *bvh = builder->bvh;
    struct item *items = builder->items + first;
    struct bvh_node *node = &bvh->nodes[index];
    empty_box(node->low, node->high);
    for (size_t i = 0; i < count; i++)
        grow_box(node->low, node->high, items[i].low, items[i].high);
    if (count <= LEAF_MAX || depth == BVH_DEPTH_MAX) {
        make_leaf(builder, node, first, count);
        return;
    }
    struct split split = find_split(items, count);
    size_t left = split.axis < 0 ? count / 2 : partition(items, count, &split);
    uint32_t children = (uint32_t)bvh->node_count;
    node->first = children;
    node->count = 0;
    bvh->nodes = memory_grow(bvh->nodes, &builder->node_capacity, bvh->node_count + 2, sizeof *bvh->nodes);
    bvh->node_count += 2;
    build_node(builder, children, first, left, depth + 1);
    build_node(builder, children + 1, first + left, count - left, depth + 1);
}

void bvh_build(struct bvh *bvh, const struct plan *plan)
{
    struct builder builder = {.bvh = bvh, .items = memory_array(plan->primitive_count, sizeof *builder.items)};
    bvh->loose = memory_array(plan->primitive_count, sizeof *bvh->loose);
    size_t count = collect(bvh, plan, builder.items);
    bvh->ids = memory_array(count, sizeof *bvh->ids);
    if (count > 0) {
        bvh->nodes = memory_grow(NULL, &builder.node_capacity, 1, sizeof *bvh->nodes);
        bvh->node_count = 1;
        build_node(&builder, 0, 0, count, 0);
    }
    free(builder.items);
}

void bvh_finish(struct bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->ids);
    free(bvh->loose);
    *bvh = (struct bvh){0};
}
