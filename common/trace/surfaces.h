/*
 * The surfaces that a generation of paths has hit, as structures of arrays: what shading needs of each. Kind by kind of
 * primitive, and within a kind in the order of the paths.
 */
#ifndef WEFT_TRACE_SURFACES_H
#define WEFT_TRACE_SURFACES_H

#include "trace/plan.h"
#include "trace/ray.h"
#include "trace/surface.h"

#define SURFACE_NONE UINT32_MAX

/* Everything that is a double, one array each. */
struct surface_lanes {
    double *t, *side;          /* of the hit: side as enum side */
    double *id;                /* of the primitive */
    double *leave_share;       /* primitive_leave_share */
    double *extent;            /* plan_object.extent */
    double *part;              /* as intersect.h numbers them */
    double *direction[3];      /* of the path */
    double *throughput[3];     /* of the path here, after what its medium has absorbed */
    double *position[3];       /* on the surface to within `error` in every coordinate */
    double *error;
    double *normal[3];         /* unit; outward, or towards the front of a flat primitive */
    double *facing[3];         /* that, on the side the path comes from */
    double *shading_normal[3]; /* likewise, interpolated on smooth meshes; not facing away from the path */
    double *middle[3], *spread[4][3]; /* members of struct surface_footprint in turn, where the plan needs footprints */
    double *color[3];          /* of the material there */
    double *own[3];            /* that, times the share of light that is neither mirrored nor let through */
    double *local[3];          /* radiance that leaves it towards the path */
};

/* Surfaces, by number, that wear one kind of pattern, and what comes of it. Arrays as in ray_batch. */
struct patterned {
    size_t count, capacity;
    uint32_t *surface, *texture; /* texture: into plan.textures */
    double *flat_axis;           /* surface_flat_axis */
    double *share;               /* of the texture's second colour */
};

/* Surfaces, by number, that show an image, and where in it. Arrays as in ray_batch. */
struct imaged {
    size_t count, capacity;
    uint32_t *surface, *texture; /* texture: into plan.textures */
    double *face;                /* of a box, 0..5, or −1 where the map is to choose */
    double *point[6];            /* the members of struct image_point in turn */
};

/* All zero is empty. */
struct surfaces {
    size_t count, capacity;
    uint8_t traits;                    /* of any of them: a set of enum material_trait */
    size_t first[PRIMITIVE_KINDS + 1]; /* those of kind k: first[k] .. first[k + 1] − 1 */
    uint32_t *path;                    /* index of the path that hit it */
    uint32_t *primitive;               /* its number, into plan.primitives */
    uint32_t *index;                   /* of the primitive, in the plan's array of its kind; or into `placed` */
    uint32_t *material, *texture;      /* into the plan's arrays */
    uint32_t *of_path;                 /* of each path: its surface, or SURFACE_NONE */
    uint32_t *hit;                     /* of each path: the primitive's number, or PRIMITIVE_NONE */
    uint8_t *kind;                     /* of each path: that of the primitive, or PRIMITIVE_KINDS */
    struct triangle *placed;           /* the triangles of instances, in the order of the surfaces */
    size_t placed_capacity;
    struct surface_lanes lanes;
    struct patterned patterned[TEXTURE_IMAGE]; /* by kind of texture: checker, stripes and gradient */
    struct imaged imaged;
};

void surfaces_finish(struct surfaces *surfaces);

/* What `count` paths have hit: sets count, first, traits, and of each path hit and kind. */
void surfaces_count(struct surfaces *surfaces, const struct plan *plan, const struct hit_batch *hits, size_t count);

/* Once that is counted: gives each of the paths that hit something its surface. Sets path, primitive and of_path. */
void surfaces_sort(struct surfaces *surfaces, size_t count);

/* Once they are collected: places the triangles of instances, and sets their surfaces' index. */
void surfaces_place(struct surfaces *surfaces, const struct plan *plan);

/* Once points and normals are known: the shading normals of smooth meshes, and their change. */
void surfaces_smooth(struct surfaces *surfaces, const struct plan *plan, const struct path_batch *paths);

/* Notes in `patterned` and `imaged` which surfaces are of more than one colour. On a mesh's own map, sets color. */
void surfaces_find_textures(struct surfaces *surfaces, const struct plan *plan, const struct path_batch *paths);

/* Sets color where the patterns' shares and the images' points have been found. */
void surfaces_look_up(struct surfaces *surfaces, const struct plan *plan);

/* One of them. */
struct hit surfaces_hit(const struct surfaces *surfaces, size_t at);
struct surface surfaces_get(const struct surfaces *surfaces, size_t at);
struct surface_footprint surfaces_spread(const struct surfaces *surfaces, size_t at);

#endif
