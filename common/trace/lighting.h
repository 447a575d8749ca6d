/*
 * The light of a generation's surfaces, one light at a time, and its shadows.
 */
#ifndef WEFT_TRACE_LIGHTING_H
#define WEFT_TRACE_LIGHTING_H

#include "trace/medium.h"
#include "trace/ray.h"
#include "trace/surfaces.h"

struct crossing_list;

/* What one light adds to each surface: shadow rays that start on the surface, and the radiance that leaves it towards
 * its path if nothing stands between. Arrays as in ray_batch; all zero is empty. */
struct lighting {
    size_t capacity;
    double *direction[3], *t_min, *t_max, *radiance[3];
    double *lit; /* 1 where any radiance is above 0, else 0 */
};

void lighting_finish(struct lighting *lighting);
void lighting_reserve(struct lighting *lighting, size_t capacity);

/* Shadow rays of one light, one of each surface that is lit. All zero is empty. */
struct shadow_batch {
    struct ray_batch rays;
    uint32_t *surface;
    uint8_t *blocked; /* 1 where something that lets no light through stands between */
    size_t capacity;

    /* Scratch: crossings ray by ray; those of ray i end where end[i + 1] says. */
    struct crossing *crossings;
    size_t crossing_capacity;
    size_t *end;
};

void shadow_batch_finish(struct shadow_batch *batch);

/* Lists the lit surfaces, and makes room for their rays. */
void shadow_batch_collect(struct shadow_batch *batch, const struct lighting *lighting, size_t surface_count);

/* Takes from the lighting's radiance what shadows take, as a kernel found it. A shadow ray goes straight on: each
 * surface that it passes takes its share (transparency × filter, or for a dielectric Fresnel's transmitted share ×
 * filter, at the angle the line has to the surface), and each absorbing solid exp(−absorption × length inside). Factors
 * are multiplied in the order of (t, id, side), so that neither the order of the scene file nor the kernel's way of
 * searching can change a bit. */
void shadow_batch_dim(struct shadow_batch *batch, const struct plan *plan, const struct medium_pool *media,
                      const struct path_batch *paths, const struct surfaces *surfaces,
                      const struct crossing_list *crossings, const struct lighting *lighting);

#endif
