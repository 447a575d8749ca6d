/*
 * What happens at a hit: the light that the surface gives back, and the paths that go on from it.
 */
#ifndef WEFT_TRACE_SHADE_H
#define WEFT_TRACE_SHADE_H

#include "trace/boundary.h"
#include "trace/medium.h"
#include "trace/plan.h"
#include "trace/ray.h"
#include "trace/shadow.h"
#include "trace/surface.h"

/* A path that hit something, with all that shading needs. */
struct shading {
    struct path path; /* its throughput already holds the absorption on the way here */
    struct hit hit;
    const struct plan_material *material;
    struct surface surface;
    struct surface_footprint spread; /* zero if the plan needs no footprints */
    struct vec3 normal;              /* geometric, on the side the path comes from */
    struct vec3 shading_normal;      /* likewise; not facing away from the path */
    struct vec3 color;               /* of the surface */
    bool needs_footprints;

    /* The boundary that the hit stands for: its walls in the order of crossing, borrowed; none if the hit is the only
     * one. The surface's error then spans them all. */
    const struct crossing *walls;
    size_t wall_count;
};

void shading_init(struct shading *shading, const struct plan *plan, const struct medium_pool *media,
                  const struct path *path, const struct hit *hit);

/* Pushes a shadow ray for each light that would add something, in the lights' order. */
void shading_push_shadows(const struct plan *plan, const struct shading *shading, uint32_t owner,
                          struct shadow_batch *shadows);

/* The path's throughput at t, after what its medium has absorbed on the way. */
struct vec3 shading_throughput(const struct plan *plan, const struct medium_pool *media, const struct path *path,
                               double t);

/* Pushes the path that goes on behind the surface, if there is one that carries THROUGHPUT_MIN in some channel. Returns
 * the share of the light that is mirrored. */
struct vec3 shading_push_transmitted(const struct plan *plan, const struct shading *shading, struct medium_pool *media,
                                     struct path_batch *transmitted);

/* Pushes the paths that go on: the mirrored one, then the transmitted one, as far as there are any and they
 * carry at least THROUGHPUT_MIN in some channel. */
#define THROUGHPUT_MIN 0x1p-12
void shading_push_children(const struct plan *plan, const struct shading *shading, struct medium_pool *media,
                           struct path_batch *children);

#endif
