/*
 * One generation of paths: what they hit, the surfaces there, and the paths that go on from these.
 */
#ifndef WEFT_TRACE_GENERATION_H
#define WEFT_TRACE_GENERATION_H

#include "trace/boundary.h"
#include "trace/children.h"
#include "trace/kernel.h"

/* All zero but for plan and kernel, which are borrowed, is ready for use; generation_finish frees it. */
struct generation {
    const struct plan *plan;
    const struct kernel *kernel;
    struct medium_pool media;
    struct path_batch paths, children;
    struct hit_batch hits; /* of paths */
    struct boundary_batch boundaries;
    struct surfaces surfaces;
    struct mirrored mirrored;
    struct transmitted transmitted;
    bool used_footprints; /* it meets textures, which average over footprints */
};

void generation_finish(struct generation *generation);

/* What the paths hit: hits, boundaries, and how many surfaces there are. */
void generation_find_hits(struct generation *generation);

/* Points, normals, colours and throughputs of all that was hit. Returns false, with nothing found, if the paths lack
 * the footprints that this takes. */
bool generation_find_surfaces(struct generation *generation);

/* The children: first the mirrored paths, then the transmitted ones, each in the order of their parents. */
void generation_find_children(struct generation *generation);

/* The children take their parents' place. */
void generation_pass(struct generation *generation);

#endif
