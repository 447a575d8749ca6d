/*
 * A bounding-volume hierarchy over a plan's primitives, eight children a node.
 *
 * Boxes are floats, relative to the camera, and grown by GROWTH of the tree's extent: more than their rounding to
 * float, and so much that no rounding in a primitive's own test can put a hit outside its box; rays from far off are
 * brought near before (ray_shift), and those that graze triangles are kept to them (triangle_grazed_roots), whose
 * pieces may be in several boxes. What a ray hits therefore does not depend on the tree. Planes, and a few primitives
 * that dwarf the rest, stay outside it: a giant would stretch the extent, and so every box.
 */
#ifndef WEFT_TRACE_BVH_H
#define WEFT_TRACE_BVH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct plan;

enum {
    BVH_WIDTH = 8,
    BVH_LEAF_MAX = 4, /* primitives; with 2, rays test fewer but nodes take twice the memory; with 8, twice as many */
    BVH_DEPTH_MAX = 32,                                 /* nodes on the way from the root to a leaf */
    BVH_STACK_MAX = BVH_DEPTH_MAX * (BVH_WIDTH - 1) + 1, /* nodes that a walk may have to come back to */
};

/* Eight children as a structure of arrays. count[i] == 0: child[i] is a node, or, with low > high, there is none.
 * Otherwise a leaf: primitives child[i] .. child[i] + count[i] − 1 of the plan's array of kind kind[i]. */
struct bvh_node {
    _Alignas(64) float low[3][BVH_WIDTH];
    float high[3][BVH_WIDTH];
    uint32_t child[BVH_WIDTH];
    uint8_t count[BVH_WIDTH], kind[BVH_WIDTH];
};

/* All zero is empty. */
struct bvh {
    struct bvh_node *nodes; /* nodes[0] is the root, if there is any */
    size_t node_count;
    uint32_t *loose; /* primitives outside the tree, rising */
    size_t loose_count;
    bool repeats;  /* some triangles are in several leaves, each of which bounds a piece: may be met more than once */
    double extent; /* the farthest coordinate of all boxes */
};

/* Builds the tree of the plan's primitives by the surface area heuristic, on up to `threads` threads; the result does
 * not depend on how many. bvh is empty before; bvh_finish frees it. Returns, for the caller to free, *order_count
 * numbers of primitives in the order of the tree's leaves, then those outside it: all of them, some more than once. The
 * leaves' indices hold once each of the plan's typed arrays is in that order (plan_order). */
uint32_t *bvh_build(struct bvh *bvh, const struct plan *plan, int threads, size_t *order_count);
void bvh_finish(struct bvh *bvh);

#endif
