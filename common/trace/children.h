/*
 * Where paths go on from the surfaces of a generation: lists of what mirrors and of what lets light through, from which
 * a kernel makes the next generation's paths.
 */
#ifndef WEFT_TRACE_CHILDREN_H
#define WEFT_TRACE_CHILDREN_H

#include "trace/medium.h"
#include "trace/surfaces.h"

/* Paths that carry less of their light than this in every channel end. */
#define THROUGHPUT_MIN 0x1p-12

struct boundary_batch;

/* Surfaces, by number, that mirror `share` of the light. Arrays as in ray_batch; all zero is empty. */
struct mirrored {
    size_t count, capacity;
    uint32_t *surface;
    double *share[3];
};

/* Surfaces, by number, that let light through. Arrays as in ray_batch; all zero is empty. */
struct transmitted {
    size_t count, capacity;
    uint32_t *surface;
    uint32_t *medium;   /* what the path is in behind it, as in medium.h */
    double *straight;   /* 1 if the path goes on along its ray, 0 if it is refracted */
    double *ior_here, *ior_beyond;
    double *t_last, *key_last; /* of the last of the walls that are crossed here, along the path's ray */
    double *share[3];          /* of the light; before the kernel's `refract`, of what is not mirrored */
    double *reflectance;       /* by `refract`: the share of the light that the boundary mirrors; 0 if straight */
};

void mirrored_finish(struct mirrored *list);
void transmitted_finish(struct transmitted *list);

/* Lists the surfaces that let light through, in the order of their paths: everything but reflectance. `boundaries` are
 * those of these paths; media that are not in the pool yet are added to it. */
void transmitted_collect(struct transmitted *list, const struct plan *plan, struct medium_pool *media,
                         const struct path_batch *paths, const struct surfaces *surfaces,
                         const struct boundary_batch *boundaries);

/* Once reflectances are known: lists what mirrors, in the order of the paths, and leaves in `transmitted` what is let
 * through; of both, what is worth following. */
void children_choose(struct mirrored *mirrored, struct transmitted *transmitted, const struct plan *plan,
                     const struct surfaces *surfaces, size_t path_count);

#endif
