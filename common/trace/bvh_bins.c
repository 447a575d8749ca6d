/* Where to cut a run of items in two: binned surface area heuristic (Wald, "On fast Construction of SAH-based Bounding
 * Volume Hierarchies", 2007), all three axes in one pass, and in three lanes where planes are compared. */
#include "trace/bvh_parts.h"

enum {
    BINS_MIN = 4,
    ITEMS_PER_BIN = 16, /* one more bin for so many */
};

struct bvh_binning bvh_binning_of(const struct bvh_range *range)
{
    struct bvh_binning binning = {.start = range->centers.low, .bins = BVH_BINS_MAX};
    if (range->count < (BVH_BINS_MAX - BINS_MIN) * ITEMS_PER_BIN)
        binning.bins = BINS_MIN + (int)(range->count / ITEMS_PER_BIN);
    const float4 infinite = {INFINITY, INFINITY, INFINITY, INFINITY};
    float all = (float)binning.bins * (1 - 0x1p-20f); /* the last centre within the last bin */
    float4 scale = (float4){all, all, all, all} / (range->centers.high - range->centers.low);
    binning.scale = (float4)((int4)scale & (scale < infinite));
    return binning;
}

void bvh_bins_fill(struct bvh_bins *bins, const struct bvh_binning *binning, const struct bvh_item *items,
                   size_t count)
{
    const struct bvh_binning by = *binning;
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < by.bins; i++) {
            bins->box[axis][i] = box4_empty();
            bins->count[axis][i] = 0;
        }
    for (size_t i = 0; i < count; i++) {
        float4 low = items[i].low4, high = items[i].high4;
        int4 at = __builtin_convertvector((bvh_center(&items[i]) - by.start) * by.scale, int4);
        for (int axis = 0; axis < 3; axis++) {
            uint32_t bin = (uint32_t)at[axis];
            box4_grow(&bins->box[axis][bin], low, high);
            bins->count[axis][bin]++;
        }
    }
}

void bvh_bins_add(struct bvh_bins *to, const struct bvh_bins *from, const struct bvh_binning *binning)
{
    for (int i = 0; i < binning->bins; i++)
        for (int axis = 0; axis < 3; axis++) {
            box4_grow(&to->box[axis][i], from->box[axis][i].low, from->box[axis][i].high);
            to->count[axis][i] += from->count[axis][i];
        }
}

/* --- planes ----------------------------------------------------------------------------------------------- */

/* All bins on one side of a plane, one for each axis. */
struct side {
    struct box4 x, y, z;
    int4 count;
};

static inline struct side side_empty(void)
{
    return (struct side){box4_empty(), box4_empty(), box4_empty(), {0}};
}

static inline void side_grow(struct side *side, const struct bvh_bins *bins, int i)
{
    box4_grow(&side->x, bins->box[0][i].low, bins->box[0][i].high);
    box4_grow(&side->y, bins->box[1][i].low, bins->box[1][i].high);
    box4_grow(&side->z, bins->box[2][i].low, bins->box[2][i].high);
    side->count += (int4){bins->count[0][i], bins->count[1][i], bins->count[2][i], 0};
}

/* Area × items along each axis; not a number, infinite × 0, where there are none. */
static inline float4 side_cost(const struct side *side)
{
    float4 of_x = side->x.high - side->x.low, of_y = side->y.high - side->y.low, of_z = side->z.high - side->z.low;
    float4 low = __builtin_shufflevector(of_x, of_y, 0, 4, 1, 5);
    float4 high = __builtin_shufflevector(of_x, of_y, 2, 6, 2, 6);
    float4 along_x = __builtin_shufflevector(low, of_z, 0, 1, 4, 4);
    float4 along_y = __builtin_shufflevector(low, of_z, 2, 3, 5, 5);
    float4 along_z = __builtin_shufflevector(high, of_z, 0, 1, 6, 6);
    float4 area = along_x * (along_y + along_z) + along_y * along_z;
    return area * __builtin_convertvector(side->count, float4);
}

struct bvh_cut bvh_bins_cut(const struct bvh_bins *bins, const struct bvh_binning *binning)
{
    float4 rights[BVH_BINS_MAX], least = {INFINITY, INFINITY, INFINITY, INFINITY};
    int4 best = {0}, plane = {0};
    struct side side = side_empty();
    for (int i = binning->bins - 1; i > 0; i--) {
        side_grow(&side, bins, i);
        rights[i] = side_cost(&side);
    }
    side = side_empty();
    for (int i = 1; i < binning->bins; i++) {
        side_grow(&side, bins, i - 1);
        float4 cost = side_cost(&side) + rights[i];
        int4 less = cost < least;
        plane += 1; /* i in all lanes */
        best = (plane & less) | (best & ~less);
        least = float4_min(cost, least);
    }
    struct bvh_cut cut = {.axis = -1};
    float cost = INFINITY;
    for (int axis = 0; axis < 3; axis++)
        if (least[axis] < cost) {
            cut = (struct bvh_cut){axis, best[axis], binning->start[axis], binning->scale[axis]};
            cost = least[axis];
        }
    return cut;
}
