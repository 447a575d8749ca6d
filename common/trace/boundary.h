/*
 * Boundaries: walls of dielectrics in one place.
 *
 * Where solids touch, a ray crosses several walls at once, and rounding decides in which order it meets them. So they
 * are one boundary, between the medium before them all and the medium behind them all. The walls that it enters by are
 * crossed first, by id, so that of the solids entered the last of the scene is the innermost; then those it leaves by.
 * (Only of one solid's own walls, where a ray grazes an edge of it, does it matter that leaving comes last.)
 */
#ifndef WEFT_TRACE_BOUNDARY_H
#define WEFT_TRACE_BOUNDARY_H

#include "trace/kernel.h"
#include "trace/medium.h"

/* How far along a ray, from the first wall met, at t, the others of its boundary lie: up to COINCIDENCE of the ray's
 * coordinates because they are taken to coincide, and as much because walls that it leaves by are delayed
 * (plan_leave_delay). Their true places, without the delay, are within 3/2 of this from one another. */
double boundary_window(struct vec3 origin, double t);

/* All zero is ready for use; boundary_batch_finish frees it. */
struct boundary_batch {
    struct crossing_list walls; /* of all boundaries of more than one wall: by ray, then in the order of crossing */

    /* Scratch: rays that go on behind a wall. */
    struct ray_batch probes;
    struct hit_batch found;
    struct crossing *start; /* of each probe: the wall */
    size_t capacity;
};

void boundary_batch_finish(struct boundary_batch *batch);

/* A refracted path may meet other surfaces that coincide with its start (t_min below 0), but not again the walls that
 * it has crossed there: such hits, up to −t_min, give way to what the path meets behind. */
void boundary_batch_pass_start(struct boundary_batch *batch, const struct plan *plan, const struct kernel *kernel,
                               const struct medium_pool *media, const struct path_batch *paths,
                               struct hit_batch *hits);

/* Finds the boundaries among the hits of a batch of rays. A hit that is in one becomes the wall that stands for it:
 * the last that it enters by, or if there is none the last that it leaves by. */
void boundary_batch_find(struct boundary_batch *batch, const struct plan *plan, const struct kernel *kernel,
                         const struct ray_batch *rays, struct hit_batch *hits);

/* Where the walls of that ray's boundary begin; none are there if its hit is the only one. */
size_t boundary_batch_first(const struct boundary_batch *batch, uint32_t ray);

#endif
