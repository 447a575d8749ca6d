/*
 * A bounding-volume hierarchy over a plan's primitives.
 *
 * Boxes are floats, relative to the camera, rounded outward and then grown by GROWTH of the tree's extent: so much
 * that no rounding in a primitive's own test can put a hit outside its box, for rays that start within the extent.
 * What a ray hits therefore does not depend on the tree. Planes, and primitives that dwarf the rest, stay outside
 * it.
 */
#ifndef WEFT_TRACE_BVH_H
#define WEFT_TRACE_BVH_H

#include <stddef.h>
#include <stdint.h>

struct plan;

/* A leaf holds ids[first..first + count − 1]; an inner node (count 0) has its children at first and first + 1. */
struct bvh_node {
    float low[3], high[3];
    uint32_t first, count;
};

struct bvh {
    struct bvh_node *nodes; /* nodes[0] is the root, if there is any */
    size_t node_count;
    uint32_t *ids; /* primitives, leaf by leaf */
    size_t id_count;
    uint32_t *loose; /* primitives outside the tree, rising */
    size_t loose_count;
};

enum { BVH_DEPTH_MAX = 64 };

/* Builds the tree of the plan's primitives: binned surface area heuristic (Wald, "On fast Construction of SAH-based
 * Bounding Volume Hierarchies", 2007). bvh is empty before; bvh_finish frees it. */
void bvh_build(struct bvh *bvh, const struct plan *plan);
void bvh_finish(struct bvh *bvh);

#endif
