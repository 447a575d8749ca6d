/* Cuts a run of items in two: binned surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume
 * Hierarchies", 2007), all three axes in one pass. Long runs are worked on in chunks by several threads; as boxes
 * combine exactly and items keep their order, chunks and threads leave no trace in the result. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "trace/bvh_parts.h"

enum {
    BINS_MAX = 32,
    BINS_MIN = 4,
    ITEMS_PER_BIN = 16,         /* one more bin for so many */
    CHUNK = 1 << 14,            /* items that one thread works on */
    PARALLEL_MIN = 4 * CHUNK,   /* items; for fewer, starting threads costs more than it gains */
};

/* Which bins an item's centre falls into: (int)((center − start) scale) along each axis. */
struct binning {
    float4 start, scale; /* scale 0: all in bin 0 */
    int bins;
};

struct bins {
    struct box4 box[3][BINS_MAX];
    uint32_t count[3][BINS_MAX];
};

/* Items in bins below `bin` along `axis` go to the left. */
struct plane_split {
    int axis; /* −1: none */
    int bin;
    float start, scale;
    double cost;
};

static float4 center_of(const struct bvh_item *item)
{
    const int4 xyz = {-1, -1, -1, 0}; /* what else is there would be slow to multiply where it is subnormal */
    return (float4)((int4)(item->low4 + item->high4) & xyz);
}

/* --- bins ------------------------------------------------------------------------------------------------- */

static struct binning choose_binning(const struct bvh_range *range)
{
    struct binning binning = {.start = range->centers.low, .bins = BINS_MAX};
    if (range->count < (BINS_MAX - BINS_MIN) * ITEMS_PER_BIN)
        binning.bins = BINS_MIN + (int)(range->count / ITEMS_PER_BIN);
    float4 extent = range->centers.high - range->centers.low;
    for (int axis = 0; axis < 3; axis++) {
        float scale = (float)binning.bins * (1 - 0x1p-20f) / extent[axis]; /* the last centre within the last bin */
        binning.scale[axis] = isfinite(scale) ? scale : 0;
    }
    return binning;
}

static void fill_bins(struct bins *bins, const struct binning *binning, const struct bvh_item *items, size_t count)
{
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < binning->bins; i++) {
            bins->box[axis][i] = box4_empty();
            bins->count[axis][i] = 0;
        }
    for (size_t i = 0; i < count; i++) {
        float4 low = items[i].low4, high = items[i].high4;
        int4 at = __builtin_convertvector((center_of(&items[i]) - binning->start) * binning->scale, int4);
        for (int axis = 0; axis < 3; axis++) {
            box4_grow(&bins->box[axis][at[axis]], low, high);
            bins->count[axis][at[axis]]++;
        }
    }
}

static void add_bins(struct bins *to, const struct bins *from, int count)
{
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < count; i++) {
            box4_grow(&to->box[axis][i], from->box[axis][i].low, from->box[axis][i].high);
            to->count[axis][i] += from->count[axis][i];
        }
}

/* The cheapest of the planes between bins along one axis: least sum of area × items on both sides. */
static void try_axis(const struct bins *bins, const struct binning *binning, int axis, struct plane_split *best)
{
    double right_cost[BINS_MAX];
    struct box4 box = box4_empty();
    size_t items = 0;
    for (int i = binning->bins - 1; i > 0; i--) {
        box4_grow(&box, bins->box[axis][i].low, bins->box[axis][i].high);
        items += bins->count[axis][i];
        right_cost[i] = items ? box4_half_area(&box) * (double)items : INFINITY;
    }
    box = box4_empty();
    items = 0;
    for (int i = 1; i < binning->bins; i++) {
        box4_grow(&box, bins->box[axis][i - 1].low, bins->box[axis][i - 1].high);
        items += bins->count[axis][i - 1];
        double cost = items ? box4_half_area(&box) * (double)items + right_cost[i] : INFINITY;
        if (cost < best->cost)
            *best = (struct plane_split){axis, i, binning->start[axis], binning->scale[axis], cost};
    }
}

static struct plane_split cheapest(const struct bins *bins, const struct binning *binning)
{
    struct plane_split best = {.axis = -1, .cost = INFINITY};
    for (int axis = 0; axis < 3; axis++)
        if (binning->scale[axis] > 0)
            try_axis(bins, binning, axis, &best);
    return best;
}

/* --- one thread ------------------------------------------------------------------------------------------- */

static bool goes_left(const struct bvh_item *item, const struct plane_split *split)
{
    float center = item->low[split->axis] + item->high[split->axis];
    return (int)((center - split->start) * split->scale) < split->bin;
}

/* Copies items to where the left ones and the right ones go, in their order. `left` may be `items`. Returns how many
 * went left. */
static size_t part(const struct bvh_item *items, size_t count, const struct plane_split *split, struct bvh_item *left,
                   struct bvh_item *right)
{
    struct bvh_item *next[2] = {right, left}; /* chosen by index: a branch would be guessed wrong every other time */
    for (size_t i = 0; i < count; i++)
        *next[goes_left(&items[i], split)]++ = items[i];
    return (size_t)(next[1] - left);
}

static void measure(struct bvh_range *range, const struct bvh_item *items, size_t count)
{
    struct box4 box = box4_empty(), centers = box;
    for (size_t i = 0; i < count; i++) {
        float4 center = center_of(&items[i]);
        box4_grow(&box, items[i].low4, items[i].high4);
        box4_grow(&centers, center, center);
    }
    range->box = box;
    range->centers = centers;
}

/* --- several threads -------------------------------------------------------------------------------------- */

/* A long run in chunks. */
struct chunks {
    struct bvh_item *items, *scratch; /* of the run */
    size_t count;
    struct binning binning;
    struct plane_split split;
    struct chunk {
        struct bins bins;
        struct bvh_range range;
        size_t left, right; /* where its items go in the scratch space */
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
    fill_bins(&chunks->at[index].bins, &chunks->binning, chunks->items + index * CHUNK, chunk_items(chunks, index));
}

static void chunk_part(void *context, size_t index)
{
    struct chunks *chunks = context;
    const struct chunk *chunk = &chunks->at[index];
    part(chunks->items + index * CHUNK, chunk_items(chunks, index), &chunks->split, chunks->scratch + chunk->left,
         chunks->scratch + chunk->right);
}

static void chunk_copy_back(void *context, size_t index)
{
    struct chunks *chunks = context;
    memcpy(chunks->items + index * CHUNK, chunks->scratch + index * CHUNK,
           chunk_items(chunks, index) * sizeof *chunks->items);
}

static void chunk_measure(void *context, size_t index)
{
    struct chunks *chunks = context;
    struct bvh_range *range = &chunks->at[index].range;
    measure(range, chunks->items + index * CHUNK, chunk_items(chunks, index));
}

/* Where the chunks' items go: the left ones of all, then the right ones. Returns how many go left. */
static size_t place_chunks(struct chunks *chunks)
{
    size_t lefts = 0, rights = 0, count = chunk_count(chunks->count);
    for (size_t i = 0; i < count; i++) {
        struct chunk *chunk = &chunks->at[i];
        chunk->left = lefts;
        for (int bin = 0; bin < chunks->split.bin; bin++)
            lefts += chunk->bins.count[chunks->split.axis][bin];
    }
    for (size_t i = 0; i < count; i++) {
        struct chunk *chunk = &chunks->at[i];
        size_t next = i + 1 < count ? chunks->at[i + 1].left : lefts;
        chunk->right = lefts + rights;
        rights += chunk_items(chunks, i) - (next - chunk->left);
    }
    return lefts;
}

static size_t split_long(const struct bvh_builder *builder, const struct bvh_range *range)
{
    size_t count = chunk_count(range->count);
    struct chunks chunks = {.items = builder->items + range->first,
                            .scratch = builder->scratch + range->first,
                            .count = range->count,
                            .binning = choose_binning(range),
                            .at = memory_aligned(count, sizeof *chunks.at, _Alignof(struct chunk))};
    parallel_for(builder->threads, count, chunk_fill_bins, &chunks);
    struct bins bins = chunks.at[0].bins;
    for (size_t i = 1; i < count; i++)
        add_bins(&bins, &chunks.at[i].bins, chunks.binning.bins);
    chunks.split = cheapest(&bins, &chunks.binning);
    size_t lefts = range->count / 2;
    if (chunks.split.axis >= 0) {
        lefts = place_chunks(&chunks);
        parallel_for(builder->threads, count, chunk_part, &chunks);
        parallel_for(builder->threads, count, chunk_copy_back, &chunks);
    }
    free(chunks.at);
    return lefts;
}

static void measure_long(const struct bvh_builder *builder, struct bvh_range *range)
{
    size_t count = chunk_count(range->count);
    struct chunks chunks = {.items = builder->items + range->first,
                            .count = range->count,
                            .at = memory_aligned(count, sizeof *chunks.at, _Alignof(struct chunk))};
    parallel_for(builder->threads, count, chunk_measure, &chunks);
    range->box = range->centers = box4_empty();
    for (size_t i = 0; i < count; i++) {
        const struct bvh_range *from = &chunks.at[i].range;
        box4_grow(&range->box, from->box.low, from->box.high);
        box4_grow(&range->centers, from->centers.low, from->centers.high);
    }
    free(chunks.at);
}

/* --- ranges ----------------------------------------------------------------------------------------------- */

static bool is_long(const struct bvh_builder *builder, size_t count)
{
    return builder->threads > 1 && count >= PARALLEL_MIN;
}

static bool is_of_one_kind(const struct bvh_item *items, size_t count)
{
    for (size_t i = 1; i < count; i++)
        if (items[i].kind != items[0].kind)
            return false;
    return true;
}

struct bvh_range bvh_range_make(const struct bvh_builder *builder, size_t first, size_t count)
{
    struct bvh_range range = {.first = first, .count = count};
    if (is_long(builder, count))
        measure_long(builder, &range);
    else
        measure(&range, builder->items + first, count);
    range.is_leaf = count <= BVH_LEAF_MAX && is_of_one_kind(builder->items + first, count);
    return range;
}

static size_t split_short(struct bvh_item *items, struct bvh_item *scratch, const struct bvh_range *range)
{
    struct binning binning = choose_binning(range);
    struct bins bins;
    fill_bins(&bins, &binning, items, range->count);
    struct plane_split split = cheapest(&bins, &binning);
    if (split.axis < 0)
        return range->count / 2;
    size_t lefts = part(items, range->count, &split, items, scratch);
    memcpy(items + lefts, scratch, (range->count - lefts) * sizeof *items);
    return lefts;
}

static size_t split_by_kind(struct bvh_item *items, size_t count)
{
    size_t lefts = 1;
    for (size_t i = 1; i < count; i++)
        if (items[i].kind == items[0].kind) {
            struct bvh_item swap = items[lefts];
            items[lefts++] = items[i];
            items[i] = swap;
        }
    return lefts;
}

void bvh_split(const struct bvh_builder *builder, struct bvh_range *range, struct bvh_range *right, bool even)
{
    struct bvh_item *items = builder->items + range->first;
    size_t lefts;
    if (range->count <= BVH_LEAF_MAX && !range->is_leaf)
        lefts = split_by_kind(items, range->count);
    else if (even || range->count == 2)
        lefts = range->count / 2;
    else if (is_long(builder, range->count))
        lefts = split_long(builder, range);
    else
        lefts = split_short(items, builder->scratch + range->first, range);
    *right = bvh_range_make(builder, range->first + lefts, range->count - lefts);
    *range = bvh_range_make(builder, range->first, lefts);
}
