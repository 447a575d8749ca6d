/*
 * Kernels: the code that finds what rays hit. Every kernel gives the same bits; they differ in speed and in
 * the machine they need.
 */
#ifndef WEFT_TRACE_KERNEL_H
#define WEFT_TRACE_KERNEL_H

#include "trace/children.h"
#include "trace/lighting.h"
#include "trace/plan.h"
#include "trace/ray.h"
#include "trace/sample.h"
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

/* Camera rays, `count` of them, as arrays of that length: in, the pixel and the sample's digits (see sample.h); out,
 * the place in the image, in pixels. */
struct camera_rays {
    size_t count;
    uint32_t samples; /* a pixel */
    uint32_t salt;              /* of these and the cells: see sample.h */
    struct sample_cells cells;
    uint32_t *pixel_x, *pixel_y, *digits_x, *digits_y;
    double *x, *y;
};

/* A kernel's calls, in the order in which a generation of paths needs them. What a call sets has room before. */
struct kernel {
    const char *name;

    /* Camera rays as paths 0 .. count − 1, but for sample and medium. */
    void (*camera)(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths);

    /* The hit of each ray into hits[0..rays->count). */
    void (*closest)(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits);

    /* Of surfaces that have been sorted: index, material, texture, and of the lanes t, side, id, leave_share, extent,
     * direction, throughput, and the first colour of the texture. */
    void (*collect)(const struct plan *plan, const struct path_batch *paths, const struct hit_batch *hits,
                    struct surfaces *surfaces);

    /* Points, normals and, where the plan needs them, footprints: part, position, error, normal, spread;
     * shading_normal as if no mesh were smooth, and turned nowhere yet. Instances' triangles have been placed. */
    void (*surface)(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces);

    /* From normal and shading_normal: facing, and shading_normal turned likewise. */
    void (*face)(struct surfaces *surfaces);

    /* The shares of the surfaces in `patterned`; the faces and points of those in `imaged`. */
    void (*pattern)(const struct plan *plan, struct surfaces *surfaces);

    /* From color: own, and local as the ambient light makes it. */
    void (*ambient)(const struct plan *plan, struct surfaces *surfaces);

    /* What plan light `light` would add to each surface. */
    void (*light)(const struct plan *plan, size_t light, const struct surfaces *surfaces, struct lighting *lighting);

    /* The rays of the surfaces that a shadow batch has collected. */
    void (*shadow_rays)(const struct surfaces *surfaces, const struct lighting *lighting,
                        struct shadow_batch *shadows);

    /* Sets blocked[i] to whether ray i meets anything that blocks light, and appends, in any order, all
     * crossings of the rays that are not blocked (and perhaps some of blocked ones, and some twice: see bvh.h). */
    void (*shadow)(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                   struct crossing_list *crossings);

    /* Adds the lighting's radiance to local. */
    void (*add_light)(const struct lighting *lighting, struct surfaces *surfaces);

    /* What each path finds: its surface's local light, or the background where that is no image, times throughput. */
    void (*find)(const struct plan *plan, const struct surfaces *surfaces, struct path_batch *paths);

    /* Reflectances of the boundaries in the list, and the shares of light that pass them. */
    void (*refract)(const struct plan *plan, const struct surfaces *surfaces, struct transmitted *transmitted);

    /* These add a path for each surface in the list to the children, in order. */
    void (*mirror)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                   const struct mirrored *mirrored, struct path_batch *children);
    void (*transmit)(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,
                     const struct transmitted *transmitted, struct path_batch *children);
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
