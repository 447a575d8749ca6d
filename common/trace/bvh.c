#include "trace/bvh.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "trace/bounds.h"
#include "trace/bvh_parts.h"

enum {
    CHUNK = 1 << 13,   /* primitives that one thread works on */
    SIZES = 256,       /* classes of sizes: a float's exponents */
    GIANT_CLASSES = 8, /* a giant is so many classes, 2^8 times, above the median */
    GIANTS_MAX = 16,   /* every ray tests all of them */
};

/* Of the extent: 2^-20 is more than the roundings to float of a box and of the origin of a ray, which may lie 5.5
 * extents away (lanes/packet.h), and than all that doubles lose. */
static const double GROWTH = 0x1p-20;

/* Beyond, the sums and differences of the builder could overflow. */
static const float FARTHEST = 0x1p124f;

/* What the items of one chunk tell. */
struct chunk {
    uint32_t sizes[SIZES]; /* how many are of each class; of those within reach */
    uint32_t beyond;       /* how many are out of reach */
    float reach;           /* the farthest coordinate of the others */
};

struct collection {
    const struct plan *plan;
    struct bvh_item *items;
    float *empty; /* emptiness of each primitive; NULL if none is a triangle */
    struct chunk *chunks;
    size_t count;
    double grow, unit;
};

static size_t chunk_end(const struct collection *all, size_t chunk)
{
    size_t end = (chunk + 1) * CHUNK;
    return end < all->count ? end : all->count;
}

static size_t chunk_count(size_t count)
{
    return (count + CHUNK - 1) / CHUNK;
}

/* --- items ------------------------------------------------------------------------------------------------ */

static float reach_of(const struct bvh_item *item)
{
    float4 most = float4_max(item->high4, -item->low4);
    float xy = most[0] > most[1] ? most[0] : most[1];
    return xy > most[2] ? xy : most[2];
}

/* The exponent of its longest side. */
static unsigned class_of(const struct bvh_item *item)
{
    float4 size = item->high4 - item->low4;
    float xy = size[0] > size[1] ? size[0] : size[1], longest = xy > size[2] ? xy : size[2];
    uint32_t bits;
    memcpy(&bits, &longest, sizeof bits);
    return bits >> 23 & (SIZES - 1);
}

static bool is_within_reach(const struct bvh_item *item)
{
    return reach_of(item) <= FARTHEST;
}

static void to_floats(struct vec3 v, float out[3])
{
    out[0] = (float)v.x;
    out[1] = (float)v.y;
    out[2] = (float)v.z;
}

void bvh_item_bound(struct bvh_item *item, const struct bounds *bounds)
{
    to_floats(bounds->low, item->low);
    to_floats(bounds->high, item->high);
}

/* Its box; what has none gets one that is out of reach. */
static void collect_item(const struct collection *all, size_t id)
{
    const struct primitive *primitive = &all->plan->primitives[id];
    struct bvh_item *item = &all->items[id];
    struct bounds bounds = {.high = {INFINITY, INFINITY, INFINITY}};
    bounds_of_primitive(all->plan, (uint32_t)id, &bounds);
    bvh_item_bound(item, &bounds);
    item->id = (uint32_t)id;
    item->kind = primitive->kind;
    if (primitive->kind == PRIMITIVE_TRIANGLE)
        all->empty[id] = (float)bvh_emptiness(&all->plan->triangles[primitive->index], &bounds);
}

static void collect_chunk(void *context, size_t index)
{
    struct collection *all = context;
    struct chunk *chunk = &all->chunks[index];
    for (size_t id = index * CHUNK; id < chunk_end(all, index); id++) {
        collect_item(all, id);
        const struct bvh_item *item = &all->items[id];
        float reach = reach_of(item);
        if (is_within_reach(item)) {
            chunk->sizes[class_of(item)]++;
            chunk->reach = reach > chunk->reach ? reach : chunk->reach;
        } else {
            chunk->beyond++;
        }
    }
}

/* The least class of giants: far above the median, and such that there are but a few. */
static unsigned find_giants(const struct collection *all)
{
    size_t sizes[SIZES] = {0}, items = 0, giants = 0;
    for (size_t chunk = 0; chunk < chunk_count(all->count); chunk++)
        for (int i = 0; i < SIZES; i++)
            sizes[i] += all->chunks[chunk].sizes[i];
    for (int i = 0; i < SIZES; i++)
        items += sizes[i];
    unsigned median = 0, least = SIZES;
    for (size_t below = sizes[0]; below <= items / 2 && median < SIZES - 1; below += sizes[median])
        median++;
    while (least > median + GIANT_CLASSES && giants + sizes[least - 1] <= GIANTS_MAX)
        giants += sizes[--least];
    return least;
}

static bool is_loose(const struct bvh_item *item, unsigned giant)
{
    return !is_within_reach(item) || class_of(item) >= giant;
}

/* Takes the loose primitives out of the items; returns the farthest coordinate of the others, with the camera at 0. */
static float take_out(struct bvh *bvh, struct collection *all, unsigned giant)
{
    size_t count = 0, room = 0;
    float extent = 0;
    for (size_t i = 0; i < all->count; i++) {
        const struct bvh_item *item = &all->items[i];
        if (is_loose(item, giant)) {
            bvh->loose = memory_grow(bvh->loose, &room, bvh->loose_count + 1, sizeof *bvh->loose);
            bvh->loose[bvh->loose_count++] = item->id;
            continue;
        }
        float reach = reach_of(item);
        extent = reach > extent ? reach : extent;
        all->items[count++] = *item;
    }
    all->count = count;
    return extent;
}

/* Sorts out what stays outside the tree, which most often is nothing, as the chunks know; returns the extent. */
static float sort_out(struct bvh *bvh, struct collection *all)
{
    unsigned giant = find_giants(all);
    bool none = giant == SIZES;
    float extent = 0;
    for (size_t i = 0; i < chunk_count(all->count); i++) {
        const struct chunk *chunk = &all->chunks[i];
        none = none && chunk->beyond == 0;
        extent = chunk->reach > extent ? chunk->reach : extent;
    }
    return none ? extent : take_out(bvh, all, giant);
}

/* Grows the boxes and brings them to the builder's unit, which is exact. The growth exceeds the two roundings to float,
 * each at most half a unit in the last place of the extent. */
static void grow_chunk(void *context, size_t index)
{
    struct collection *all = context;
    double scale = 1 / all->unit;
    for (size_t i = index * CHUNK; i < chunk_end(all, index); i++)
        for (int axis = 0; axis < 3; axis++) {
            struct bvh_item *item = &all->items[i];
            item->low[axis] = (float)((item->low[axis] - all->grow) * scale);
            item->high[axis] = (float)((item->high[axis] + all->grow) * scale);
        }
}

/* The largest power of two that is no larger: its exponent without a mantissa. But none whose inverse would be beyond
 * floats. */
static double unit_of(double extent)
{
    uint64_t bits;
    double unit = extent > 0x1p-100 ? extent : 0x1p-100;
    memcpy(&bits, &unit, sizeof bits);
    bits &= 0x7ffull << 52;
    memcpy(&unit, &bits, sizeof unit);
    return unit;
}

/* --- the tree --------------------------------------------------------------------------------------------- */

/* From items to primitives of each kind, both in the tree's order. */
static uint32_t *number_leaves(struct bvh *bvh, struct bvh_leaf_item *items, size_t count)
{
    uint32_t *order = memory_array(count + bvh->loose_count, sizeof *order);
    uint32_t next[PRIMITIVE_KINDS] = {0};
    for (size_t i = 0; i < count; i++) {
        order[i] = items[i].id;
        items[i].index = next[items[i].kind]++;
    }
    for (size_t i = 0; i < bvh->loose_count; i++)
        order[count + i] = bvh->loose[i];
    for (size_t i = 0; i < bvh->node_count; i++)
        for (int slot = 0; slot < BVH_WIDTH; slot++)
            if (bvh->nodes[i].count[slot] > 0)
                bvh->nodes[i].child[slot] = items[bvh->nodes[i].child[slot]].index;
    return order;
}

/* Collects the items and what they tell. */
static void collect(struct bvh *bvh, struct collection *all, int threads)
{
    const struct plan *plan = all->plan;
    size_t count = plan->primitive_count;
    all->count = count;
    all->items = memory_aligned(count, sizeof *all->items, sizeof *all->items);
    all->chunks = memory_array(chunk_count(count), sizeof *all->chunks);
    if (plan->count[PRIMITIVE_TRIANGLE] > 0)
        all->empty = memory_array(count, sizeof *all->empty);
    parallel_for(threads, chunk_count(count), collect_chunk, all);
    bvh->extent = sort_out(bvh, all);
    if (all->empty)
        all->count = bvh_presplit(plan, &all->items, all->count, all->empty);
    bvh->repeats = all->count + bvh->loose_count > count;
    all->grow = GROWTH * bvh->extent;
    all->unit = unit_of(bvh->extent);
    parallel_for(threads, chunk_count(all->count), grow_chunk, all);
    free(all->chunks);
    free(all->empty);
}

uint32_t *bvh_build(struct bvh *bvh, const struct plan *plan, int threads, size_t *order_count)
{
    struct collection all = {.plan = plan};
    collect(bvh, &all, threads);
    struct bvh_builder builder = {.items = {all.items}, .unit = all.unit, .threads = threads};
    builder.leaf_items = memory_array(all.count, sizeof *builder.leaf_items);
    if (all.count > 0) {
        builder.items[1] = memory_aligned(all.count, sizeof *all.items, sizeof *all.items);
        bvh_make_nodes(bvh, &builder, all.count);
    }
    free(builder.items[0]);
    free(builder.items[1]);
    *order_count = all.count + bvh->loose_count;
    uint32_t *order = number_leaves(bvh, builder.leaf_items, all.count);
    free(builder.leaf_items);
    return order;
}

void bvh_finish(struct bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->loose);
    *bvh = (struct bvh){0};
}
