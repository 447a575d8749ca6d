/*
 * The plan: a scene compiled for one render. It holds only what this scene needs, relative to the camera,
 * and is frozen once built: all threads read it without locks.
 */
#ifndef WEFT_TRACE_PLAN_H
#define WEFT_TRACE_PLAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "scene/model.h"
#include "trace/ahead.h"
#include "trace/bvh.h"
#include "trace/intersect.h"

struct bounds;

/* What the caller chooses; the rest is in the scene. */
struct trace_settings {
    uint32_t width, height; /* pixels, 1..IMAGE_SIDE_MAX */
    enum pixel_filter filter;
};

enum primitive_kind {
    PRIMITIVE_SPHERE,
    PRIMITIVE_GLOBE,
    PRIMITIVE_ELLIPSOID,
    PRIMITIVE_PLANE,
    PRIMITIVE_DISC,
    PRIMITIVE_FRUSTUM,
    PRIMITIVE_BOX,
    PRIMITIVE_TRIANGLE,
    PRIMITIVE_INSTANCE, /* all triangles of an object whose mesh is shared: see instance.h */
    PRIMITIVE_KINDS,
};

/* What a surface may do that costs work where it is met. */
enum material_trait {
    TRAIT_MIRRORS = 1,
    TRAIT_TRANSMITS = 2, /* lets light through, straight or refracted */
    TRAIT_REFRACTS = 4,  /* is a dielectric */
    TRAIT_TEXTURED = 8,  /* is of more than one colour */
    TRAIT_HIGHLIGHTS = 16,
};

/* Primitives are in the order of the scene's objects; a mesh's triangles follow one another. So do the ids by which
 * ties between hits are settled; an instance has one for each of its triangles. Without instances, a primitive's id is
 * its number, its place in plan.primitives. */
struct primitive {
    uint8_t kind;        /* enum primitive_kind */
    bool blocks_light;   /* its material lets nothing through */
    int8_t flat_axis;    /* the coordinate of the object that is constant on it, 0..2, or −1; of no instance */
    uint8_t traits;      /* of its material */
    uint32_t index;      /* into the plan's array of that kind */
    uint32_t object;     /* into plan.objects */
    uint32_t id;         /* of an instance: that of its first triangle */
};

struct plan_object {
    uint32_t material;
    uint32_t texture;         /* of the material's colour */
    uint32_t mesh;            /* index into plan.meshes, or UINT32_MAX */
    bool shares_mesh;         /* with other objects, be it as an instance or as a copy */
    uint32_t first_primitive; /* its number */
    double extent;            /* a bound on its coordinates relative to its own centre; 0 for planes and meshes */
    double leave_share;       /* of the distance at which rays leave it, by which that is moved along: leave_delay */
};

/* A mesh's per-vertex data. Arrays are NULL where the mesh has none. */
struct plan_mesh {
    bool smooth;          /* has normals */
    struct vec3 *normals; /* in world orientation; none where an instance places them when they are asked for */
    const double *uv; /* borrowed from the scene */
    const uint32_t *index; /* borrowed from the scene: corners a, b, c of each triangle */
    bool mirrored;         /* the transform turned the winding over: the plan's triangles are a, c, b */
};

struct plan_material {
    double ambient, diffuse, shininess, transparency, ior;
    struct vec3 specular, reflection, filter, absorption;
    struct vec3 surface_share; /* 1 − reflection − transparency; 0 for a dielectric */
    bool dielectric, absorbs;
    uint8_t traits; /* a set of enum material_trait */
};

/* A coordinate of a texture as a linear function of position: gradient · p + offset. */
struct texture_row {
    struct vec3 gradient;
    double offset;
};

struct plan_texture {
    uint8_t kind; /* enum texture_kind */
    uint8_t map;  /* enum texture_map */
    struct vec3 color[2];
    struct texture_row row[3];  /* see plan_texture.c for what each kind keeps here */
    uint32_t image[BOX_FACES];  /* into plan.images */
    double repeat_u, repeat_v;
};

/* An image and its halvings, each of half the size (rounded up) of the one before; none of an image that nothing
 * wears. */
enum { MIP_LEVELS_MAX = 17 };
struct plan_image {
    uint32_t levels;
    struct {
        uint32_t width, height;
        const float *rgb; /* level 0 is borrowed from the scene */
    } level[MIP_LEVELS_MAX];
};

struct plan_light {
    uint8_t kind; /* enum light_kind */
    struct vec3 color, position, direction;
    double falloff[3];
    double outer_cosine, inner_cosine;
};

/* The direction through image position (x, y), in pixels from the top left corner, is
 * corner + x right + y down, normalised. */
struct plan_camera {
    struct vec3 corner, right, down;
};

/* Where the ids of an instance are. */
struct instance_ids {
    uint32_t first, end; /* end: one behind the last */
    uint32_t number;     /* into plan.primitives */
};

struct instance;
struct shared_mesh;

struct plan {
    struct trace_settings settings;
    uint32_t depth;
    struct plan_camera camera;
    struct background background;
    struct vec3 ambient;
    struct vec3 eye; /* world position of the origin of all coordinates here */

    struct primitive *primitives;
    size_t primitive_count;
    struct sphere *spheres;
    struct globe *globes;
    struct ellipsoid *ellipsoids;
    struct plane *planes;
    struct disc *discs;
    struct frustum *frustums;
    struct box *boxes;
    struct triangle *triangles;
    struct instance *instances;
    size_t count[PRIMITIVE_KINDS];  /* of each kind */
    uint32_t *ids[PRIMITIVE_KINDS]; /* of each kind's elements, which are in the order of the tree's leaves, with copies
                                     * of what is in several */

    size_t id_count;                    /* ids are below */
    uint32_t first_instance_id;         /* ids below are numbers; UINT32_MAX without instances */
    struct instance_ids *instance_ids;  /* of each instance, rising */
    struct shared_mesh *shared_meshes;
    size_t shared_mesh_count;
    struct welded *welded;              /* of instances' triangles, whose ids rise: see plan_weld */
    size_t welded_count;

    struct bvh bvh; /* empty where there are too few primitives for one */

    struct plan_object *objects;
    struct plan_mesh *meshes;
    struct plan_material *materials;
    struct plan_texture *textures;
    struct plan_image *images;
    struct plan_light *lights;
    size_t object_count, mesh_count, material_count, texture_count, image_count, light_count;

    uint32_t *camera_media; /* objects that the camera is inside of, outermost first: dielectrics only */
    size_t camera_media_count;

    /* Where walls of two dielectrics may touch, so that boundary.h is needed: boxes, a few at most. */
    struct bounds *contacts;
    size_t contact_count;

    /* What the scene needs at all. */
    bool needs_footprints; /* some texture or background is filtered */
    bool is_smooth;        /* some mesh has normals of its own */
    bool absorbs;          /* some material does */
};

/* Compiles a valid scene, which must outlive the plan and stay unchanged, on up to `threads` threads; the plan does not
 * depend on how many. Never fails on a valid scene. */
struct plan *plan_create(const struct scene *scene, const struct trace_settings *settings, int threads);

/* Frees *plan and sets it to NULL; *plan may be NULL. */
void plan_destroy(struct plan **plan);

/* Surfaces nearer to one another than this share of their coordinates' size are taken to coincide: far above what
 * rounding makes of them, far below what can be seen. */
#define COINCIDENCE 0x1p-40

/* The number of the primitive that has this id, which is not below first_instance_id; or of the instance that has such
 * a triangle. */
uint32_t plan_number_among_instances(const struct plan *plan, uint32_t id);

static inline uint32_t plan_number(const struct plan *plan, uint32_t id)
{
    return id < plan->first_instance_id ? id : plan_number_among_instances(plan, id);
}

static inline const struct primitive *plan_primitive(const struct plan *plan, uint32_t id)
{
    return &plan->primitives[plan_number(plan, id)];
}

static inline bool primitive_is_of_mesh(const struct primitive *primitive)
{
    return primitive->kind == PRIMITIVE_TRIANGLE || primitive->kind == PRIMITIVE_INSTANCE;
}

/* The share of its distance by which a root is moved along that leaves the primitive. */
static inline double primitive_leave_share(const struct primitive *primitive)
{
    return primitive->blocks_light ? 0 : COINCIDENCE;
}

/* Triangle `id`; of an instance, placed in the world, to the bit as a copy would be. */
struct triangle plan_triangle(const struct plan *plan, uint32_t id);

/* What a ray that goes into primitive `id` meets behind its surface. */
enum wall plan_wall(const struct plan *plan, uint32_t id);

/* The roots of a ray with primitive `id`; `shear` is shear_of(direction).
 *
 * Where a ray leaves what lets light through is taken to be farther along by plan_leave_delay. So where glass stands
 * on a floor or on other glass, the ray meets the other surface before it leaves, whichever way rounding would have
 * it: without a rule, every pixel would decide anew. */
struct roots plan_roots(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction,
                        const struct shear *shear);

/* What plan_roots adds to a leaving root at t, to within COINCIDENCE of itself. */
double plan_leave_delay(const struct plan *plan, uint32_t id, struct vec3 origin, double t);

/* The piece of the primitive's surface at that root of the ray, as intersect.h numbers them. */
uint8_t plan_part(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction, enum side side);

#endif
