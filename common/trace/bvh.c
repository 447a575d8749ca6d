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

struct collection {
    const struct plan *plan;
    struct bvh_item *items;
    uint32_t (*sizes)[SIZES]; /* of each chunk: how many items of each class */
    size_t count;
    double grow;
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

/* Boxes; what has none gets one that is out of reach. */
static void collect_chunk(void *context, size_t chunk)
{
    struct collection *all = context;
    for (size_t id = chunk * CHUNK; id < chunk_end(all, chunk); id++) {
        struct bvh_item *item = &all->items[id];
        struct bounds bounds = {.high = {INFINITY, INFINITY, INFINITY}};
        bounds_of_primitive(all->plan, (uint32_t)id, &bounds);
        bvh_item_bound(item, &bounds);
        item->id = (uint32_t)id;
        item->kind = all->plan->primitives[id].kind;
        if (is_within_reach(item))
            all->sizes[chunk][class_of(item)]++;
    }
}

/* The least class of giants: far above the median, and such that there are but a few. */
static unsigned find_giants(const struct collection *all)
{
    size_t sizes[SIZES] = {0}, items = 0, giants = 0;
    for (size_t chunk = 0; chunk < chunk_count(all->count); chunk++)
        for (int i = 0; i < SIZES; i++)
            sizes[i] += all->sizes[chunk][i];
    for (int i = 0; i < SIZES; i++)
        items += sizes[i];
    unsigned median = 0, least = SIZES;
    for (size_t below = sizes[0]; below <= items / 2 && median < SIZES - 1; below += sizes[median])
        median++;
    while (least > median + GIANT_CLASSES && giants + sizes[least - 1] <= GIANTS_MAX)
        giants += sizes[--least];
    return least;
}

/* Takes the loose primitives out of the items; returns the farthest coordinate of the others, with the camera at 0. */
static float sort_out(struct bvh *bvh, struct collection *all)
{
    unsigned giant = find_giants(all);
    size_t count = 0;
    float extent = 0;
    for (size_t i = 0; i < all->count; i++) {
        const struct bvh_item *item = &all->items[i];
        if (!is_within_reach(item) || class_of(item) >= giant) {
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

/* The growth exceeds the two roundings to float, each at most half a unit in the last place of the extent. */
static void grow_chunk(void *context, size_t chunk)
{
    struct collection *all = context;
    for (size_t i = chunk * CHUNK; i < chunk_end(all, chunk); i++)
        for (int axis = 0; axis < 3; axis++) {
            struct bvh_item *item = &all->items[i];
            item->low[axis] = (float)(item->low[axis] - all->grow);
            item->high[axis] = (float)(item->high[axis] + all->grow);
        }
}

/* --- the tree --------------------------------------------------------------------------------------------- */

/* From items to primitives of each kind, both in the tree's order. */
static uint32_t *number_leaves(struct bvh *bvh, const struct collection *all)
{
    uint32_t *order = memory_array(all->count + bvh->loose_count, sizeof *order);
    uint32_t next[PRIMITIVE_KINDS] = {0}, *index = memory_array(all->count, sizeof *index);
    for (size_t i = 0; i < all->count; i++) {
        order[i] = all->items[i].id;
        index[i] = next[all->items[i].kind]++;
    }
    for (size_t i = 0; i < bvh->loose_count; i++)
        order[all->count + i] = bvh->loose[i];
    for (size_t i = 0; i < bvh->node_count; i++)
        for (int slot = 0; slot < BVH_WIDTH; slot++)
            if (bvh->nodes[i].count[slot] > 0)
                bvh->nodes[i].child[slot] = index[bvh->nodes[i].child[slot]];
    free(index);
    return order;
}

uint32_t *bvh_build(struct bvh *bvh, const struct plan *plan, int threads, size_t *order_count)
{
    size_t count = plan->primitive_count, chunks = chunk_count(count);
    struct collection all = {.plan = plan, .count = count};
    all.items = memory_aligned(count, sizeof *all.items, sizeof(float4));
    all.sizes = memory_array(chunks, sizeof *all.sizes);
    bvh->loose = memory_array(count, sizeof *bvh->loose);
    parallel_for(threads, chunks, collect_chunk, &all);
    bvh->extent = sort_out(bvh, &all);
    all.count = bvh_presplit(plan, &all.items, all.count);
    bvh->repeats = all.count + bvh->loose_count > count;
    all.grow = GROWTH * bvh->extent;
    parallel_for(threads, chunk_count(all.count), grow_chunk, &all);
    bvh->loose = memory_resize(bvh->loose, bvh->loose_count, sizeof *bvh->loose);
    if (all.count > 0) {
        struct bvh_builder builder = {.items = all.items, .threads = threads};
        builder.scratch = memory_aligned(all.count, sizeof *builder.scratch, sizeof(float4));
        bvh_make_nodes(bvh, &builder, all.count);
        free(builder.scratch);
    }
    *order_count = all.count + bvh->loose_count;
    uint32_t *order = number_leaves(bvh, &all);
    free(all.items);
    free(all.sizes);
    return order;
}

void bvh_finish(struct bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->loose);
    *bvh = (struct bvh){0};
}
