/* Cuts a range of items in two. Long ranges are worked on in chunks by several threads; as boxes combine exactly and
 * items keep their order, chunks and threads leave no trace in the result. */
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "trace/bvh_parts.h"
#include "trace/plan.h"

enum {
    CHUNK = 1 << 14,          /* items that one thread works on */
    PARALLEL_MIN = 4 * CHUNK, /* items; for fewer, starting threads costs more than it gains */
};

/* --- one thread ------------------------------------------------------------------------------------------- */

/* Where the items of a run go, and then the boxes around the centres of the left and the right ones. */
struct parts {
    struct bvh_item *to;
    size_t left, right; /* where in `to` either begin */
    struct box4 left_centers, right_centers;
};

static bool goes_left(const struct bvh_item *item, const struct bvh_cut *cut)
{
    float center = item->low[cut->axis] + item->high[cut->axis];
    return (int)((center - cut->start) * cut->scale) < cut->bin;
}

/* Copies items to where they go, in their order. Without branches: they would be guessed wrong every other time. */
static void part(const struct bvh_item *items, size_t count, const struct bvh_cut *by, struct parts *parts)
{
    const struct bvh_cut cut = *by;
    const int4 all = {-1, -1, -1, -1};
    struct box4 left = box4_empty(), right = left;
    struct bvh_item *to = parts->to;
    size_t left_at = parts->left, both_at = parts->left + parts->right;
    for (size_t i = 0; i < count; i++) {
        float4 center = bvh_center(&items[i]);
        size_t if_left = -(size_t)goes_left(&items[i], &cut), right_at = both_at + i - left_at;
        int32_t bits = (int32_t)if_left;
        int4 mask = {bits, bits, bits, bits};
        float4 right_center = (float4)((int4)center | mask), left_center = (float4)((int4)center | (mask ^ all));
        box4_grow(&left, left_center, left_center); /* the other one is no number, which boxes ignore */
        box4_grow(&right, right_center, right_center);
        to[right_at + ((left_at - right_at) & if_left)] = items[i];
        left_at -= if_left;
    }
    parts->left_centers = left;
    parts->right_centers = right;
}

static void measure(struct bvh_range *range, const struct bvh_item *items, size_t count)
{
    struct box4 box = box4_empty(), centers = box;
    for (size_t i = 0; i < count; i++) {
        float4 center = bvh_center(&items[i]);
        box4_grow(&box, items[i].low4, items[i].high4);
        box4_grow(&centers, center, center);
    }
    range->box = box;
    range->centers = centers;
}

/* --- several threads -------------------------------------------------------------------------------------- */

/* A long run in chunks. */
struct chunks {
    const struct bvh_item *items; /* of the run */
    size_t count;
    struct bvh_binning binning;
    struct bvh_cut cut;
    struct chunk {
        struct bvh_bins bins;
        struct parts parts;
    } *at;
};

static size_t chunk_items(const struct chunks *chunks, size_t index)
{
    size_t left = chunks->count - index * CHUNK;
    return left < CHUNK ? left : CHUNK;
}

static size_t chunk_count(size_t count)
{
    return (count + CHUNK - 1) / CHUNK;
}

static void chunk_fill_bins(void *context, size_t index)
{
    struct chunks *chunks = context;
    bvh_bins_fill(&chunks->at[index].bins, &chunks->binning, chunks->items + index * CHUNK, chunk_items(chunks, index));
}

static void chunk_part(void *context, size_t index)
{
    struct chunks *chunks = context;
    part(chunks->items + index * CHUNK, chunk_items(chunks, index), &chunks->cut, &chunks->at[index].parts);
}

static size_t count_lefts(const struct bvh_bins *bins, const struct bvh_cut *cut)
{
    size_t lefts = 0;
    for (int bin = 0; bin < cut->bin; bin++)
        lefts += (size_t)bins->count[cut->axis][bin];
    return lefts;
}

static struct bvh_bins fill_bins(struct chunks *chunks, int threads)
{
    size_t count = chunk_count(chunks->count);
    parallel_for(threads, count, chunk_fill_bins, chunks);
    struct bvh_bins bins = chunks->at[0].bins;
    for (size_t i = 1; i < count; i++)
        bvh_bins_add(&bins, &chunks->at[i].bins, &chunks->binning);
    return bins;
}

/* Each chunk's left items go behind those of the chunk before, and so do the right ones. */
static void part_chunks(struct chunks *chunks, struct parts *parts, int threads)
{
    size_t count = chunk_count(chunks->count);
    size_t left = parts->left, right = parts->right;
    for (size_t i = 0; i < count; i++) {
        struct chunk *chunk = &chunks->at[i];
        size_t lefts = count_lefts(&chunk->bins, &chunks->cut);
        chunk->parts = (struct parts){.to = parts->to, .left = left, .right = right};
        left += lefts;
        right += chunk_items(chunks, i) - lefts;
    }
    parallel_for(threads, count, chunk_part, chunks);
    parts->left_centers = parts->right_centers = box4_empty();
    for (size_t i = 0; i < count; i++) {
        const struct parts *from = &chunks->at[i].parts;
        box4_grow(&parts->left_centers, from->left_centers.low, from->left_centers.high);
        box4_grow(&parts->right_centers, from->right_centers.low, from->right_centers.high);
    }
}

/* --- ranges ----------------------------------------------------------------------------------------------- */

static struct bvh_item *items_of(const struct bvh_builder *builder, const struct bvh_range *range)
{
    return builder->items[range->side] + range->first;
}

static bool is_of_one_kind(const struct bvh_item *items, size_t count)
{
    for (size_t i = 1; i < count; i++)
        if (items[i].kind != items[0].kind)
            return false;
    return true;
}

/* Where a primitive's own test is long, more boxes pay; and what is in an instance costs far more than a box. */
static size_t leaf_most(uint32_t kind)
{
    return kind == PRIMITIVE_INSTANCE ? 1 : kind == PRIMITIVE_FRUSTUM ? 2 : BVH_LEAF_MAX;
}

/* Fills what follows from the rest. */
static void complete(const struct bvh_builder *builder, struct bvh_range *range)
{
    range->area = box4_half_area(&range->box);
    const struct bvh_item *items = items_of(builder, range);
    range->is_leaf = range->count <= leaf_most(items->kind) && is_of_one_kind(items, range->count);
}

struct bvh_range bvh_range_make(const struct bvh_builder *builder, int side, size_t first, size_t count)
{
    struct bvh_range range = {.first = first, .count = count, .side = (uint8_t)side};
    measure(&range, items_of(builder, &range), count);
    complete(builder, &range);
    return range;
}

/* The first `lefts` items remain the range, the others become *right. */
static void divide(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right, size_t lefts)
{
    *right = bvh_range_make(builder, range->side, range->first + lefts, range->count - lefts);
    *range = bvh_range_make(builder, range->side, range->first, lefts);
}

static struct box4 join_bins(const struct bvh_bins *bins, int axis, int from, int to)
{
    struct box4 box = box4_empty();
    for (int i = from; i < to; i++)
        box4_grow(&box, bins->box[axis][i].low, bins->box[axis][i].high);
    return box;
}

/* Moves the run's items into the other array; *bins are all that the run's fill. Returns false, and moves nothing, if
 * centres do not tell the items apart. */
static bool cut_long(struct chunks *chunks, struct bvh_bins *bins, struct parts *parts, int threads)
{
    chunks->at = memory_aligned(chunk_count(chunks->count), sizeof *chunks->at, _Alignof(struct chunk));
    *bins = fill_bins(chunks, threads);
    chunks->cut = bvh_bins_cut(bins, &chunks->binning);
    bool is_cut = chunks->cut.axis >= 0;
    if (is_cut) {
        parts->right = count_lefts(bins, &chunks->cut);
        part_chunks(chunks, parts, threads);
    }
    free(chunks->at);
    return is_cut;
}

static bool cut_short(struct chunks *chunks, struct bvh_bins *bins, struct parts *parts)
{
    bvh_bins_fill(bins, &chunks->binning, chunks->items, chunks->count);
    chunks->cut = bvh_bins_cut(bins, &chunks->binning);
    if (chunks->cut.axis < 0)
        return false;
    parts->right = count_lefts(bins, &chunks->cut);
    part(chunks->items, chunks->count, &chunks->cut, parts);
    return true;
}

/* By the surface area heuristic, from one array into the other; into halves if centres do not tell the items apart. */
static void divide_by_bins(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right)
{
    struct chunks run = {.items = items_of(builder, range), .count = range->count, .binning = bvh_binning_of(range)};
    struct parts parts = {.to = builder->items[!range->side] + range->first};
    struct bvh_bins bins;
    bool is_long = builder->threads > 1 && range->count >= PARALLEL_MIN;
    if (!(is_long ? cut_long(&run, &bins, &parts, builder->threads) : cut_short(&run, &bins, &parts))) {
        divide(builder, range, right, range->count / 2);
        return;
    }
    *right = (struct bvh_range){.first = range->first + parts.right, .count = range->count - parts.right,
                                .box = join_bins(&bins, run.cut.axis, run.cut.bin, run.binning.bins),
                                .centers = parts.right_centers, .side = !range->side};
    *range = (struct bvh_range){.first = range->first, .count = parts.right,
                                .box = join_bins(&bins, run.cut.axis, 0, run.cut.bin),
                                .centers = parts.left_centers, .side = !range->side};
    complete(builder, range);
    complete(builder, right);
}

/* Brings those of the few items to the front, in their order, whose bit in `rights` is 0. Returns how many. */
static size_t part_few(struct bvh_item *items, size_t count, unsigned rights)
{
    struct bvh_item copy[BVH_LEAF_MAX];
    size_t lefts = count - (size_t)__builtin_popcount(rights), next[2] = {0, lefts};
    for (size_t i = 0; i < count; i++)
        copy[next[rights >> i & 1]++] = items[i];
    for (size_t i = 0; i < count; i++)
        items[i] = copy[i];
    return lefts;
}

/* Area × items on both sides, where bits of `rights` are 1 for items on the right. */
static float cost_of(const struct bvh_item *items, size_t count, unsigned rights)
{
    struct box4 box[2] = {box4_empty(), box4_empty()};
    for (size_t i = 0; i < count; i++)
        box4_grow(&box[rights >> i & 1], items[i].low4, items[i].high4);
    float right_count = (float)__builtin_popcount(rights);
    return box4_half_area(&box[0]) * ((float)count - right_count) + box4_half_area(&box[1]) * right_count;
}

/* Splits a leaf: there are few enough ways to try them all. The first item stays left; equals stay in their order. */
static size_t split_few(struct bvh_item *items, size_t count)
{
    unsigned end = 1u << count, best = end - (1u << count / 2);
    float least = cost_of(items, count, best);
    for (unsigned rights = 2; rights < end; rights += 2) {
        float cost = cost_of(items, count, rights);
        best = cost < least ? rights : best;
        least = cost < least ? cost : least;
    }
    return part_few(items, count, best);
}

/* The kind of the first item goes left. */
static size_t split_by_kind(struct bvh_item *items, size_t count)
{
    unsigned rights = 0;
    for (size_t i = 1; i < count; i++)
        rights |= (unsigned)(items[i].kind != items[0].kind) << i;
    return part_few(items, count, rights);
}

void bvh_split(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right, bool even)
{
    struct bvh_item *items = items_of(builder, range);
    if (range->count <= BVH_LEAF_MAX && !is_of_one_kind(items, range->count))
        divide(builder, range, right, split_by_kind(items, range->count));
    else if (even || range->count == 2)
        divide(builder, range, right, range->count / 2);
    else if (range->count <= BVH_LEAF_MAX)
        divide(builder, range, right, split_few(items, range->count));
    else
        divide_by_bins(builder, range, right);
}
