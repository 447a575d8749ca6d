/*
 * Kernels: the code that finds what rays hit. Every kernel gives the same bits; they differ in speed and in
 * the machine they need.
 */
#ifndef WEFT_TRACE_KERNEL_H
#define WEFT_TRACE_KERNEL_H

#include "trace/plan.h"
#include "trace/ray.h"
#include "trace/surfaces.h"

/* Where a shadow ray passes a surface that lets light through. */
struct crossing {
    double t;
    uint32_t ray; /* index in the batch */
    uint32_t id;
    uint8_t side;
};

/* All zero is empty; crossing_list_finish frees it. */
struct crossing_list {
    struct crossing *items;
    size_t count, capacity;
};

void crossing_list_finish(struct crossing_list *list);
void crossing_list_push(struct crossing_list *list, const struct crossing *crossing);

/* How many crossings from items[start] on are of that ray. */
size_t crossing_list_run(const struct crossing_list *list, size_t start, uint32_t ray);

/* What one light would add to each of a generation's surfaces if nothing stood between: shadow rays that start on the
 * surface, and radiance, which is 0 where none is needed. Arrays as in ray_batch. */
struct lighting {
    size_t capacity;
    double *direction[3], *t_min, *t_max, *radiance[3];
};

void lighting_finish(struct lighting *lighting);
void lighting_reserve(struct lighting *lighting, size_t capacity);

/* Surfaces, by number, that mirror `share` of the light. Arrays as in ray_batch. */
struct mirrored {
    size_t count, capacity;
    uint32_t *surface;
    double *share[3];
};

void mirrored_finish(struct mirrored *mirrored);
void mirrored_push(struct mirrored *mirrored, uint32_t surface, struct vec3 share);

/* A kernel's calls, in the order in which a generation of paths needs them. */
struct kernel {
    const char *name;

    /* Camera rays through the image positions (x[i], y[i]), in pixels, as paths 0 .. count − 1, but for sample and
     * medium. */
    void (*camera)(const struct plan *plan, const double *x, const double *y, size_t count, struct path_batch *paths);

    /* The hit of each ray into hits[0..rays->count). */
    void (*closest)(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits);

    /* Points, normals and, where the plan needs them, footprints of surfaces that have been collected: part, position,
     * error, normal, spread; shading_normal as if no mesh were smooth, and turned nowhere yet. */
    void (*surface)(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces);

    /* From normal and shading_normal: facing, and shading_normal turned likewise. */
    void (*face)(struct surfaces *surfaces);

    /* The shares of the surfaces in `patterned`. */
    void (*pattern)(const struct plan *plan, struct surfaces *surfaces);

    /* What plan light `light` would add to each surface. */
    void (*light)(const struct plan *plan, size_t light, const struct surfaces *surfaces, struct lighting *lighting);

    /* Sets blocked[i] to whether ray i meets anything that blocks light, and appends, in any order, all
     * crossings of the rays that are not blocked (and perhaps some of blocked ones). */
    void (*shadow)(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                   struct crossing_list *crossings);

    /* Adds a path for each mirrored surface to the children, in order. */
    void (*mirror)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                   const struct mirrored *mirrored, struct path_batch *children);
};

/* The kernel of that name (ref, sse2, avx2, avx512, neon), or NULL if there is none or this machine cannot run it. */
const struct kernel *kernel_find(const char *name);

/* The fastest that this machine can run. */
const struct kernel *kernel_default(void);

/* Kernel i of those that this machine can run, slowest first, or NULL beyond the last: for tests and lists. */
const struct kernel *kernel_at(size_t index);

/* Scalar, one ray at a time: the oracle. */
extern const struct kernel kernel_ref;

#endif
