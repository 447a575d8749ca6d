/*
 * The scene model: what a scene file says, validated, in the file's own coordinates and units.
 *
 * Right-handed, y up. Lengths are in scene units, angles in degrees, colours linear light. The model is
 * what readers produce and the plan (trace/plan.h) compiles; it knows nothing about rays.
 */
#ifndef WEFT_SCENE_MODEL_H
#define WEFT_SCENE_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/image.h"
#include "math/transform.h"
#include "math/vec3.h"

/* Every number of a scene is at most SCENE_LARGEST in magnitude, so that no product of a few overflows, and
 * one that must be above 0 is at least SCENE_SMALLEST. */
#define SCENE_LARGEST 1e30
#define SCENE_SMALLEST 1e-30

/* --- textures --------------------------------------------------------------------------------------------- */

enum texture_kind { TEXTURE_CONSTANT, TEXTURE_CHECKER, TEXTURE_STRIPES, TEXTURE_GRADIENT, TEXTURE_IMAGE };

/* How an image is laid on a surface; u grows to the right and v downwards in the image, both 0..1.
 * All in the object's own coordinates, before its transform. */
enum texture_map {
    MAP_SPHERE,   /* longitude and latitude about the shape's centre, y up; u = 1/2 faces +z */
    MAP_CYLINDER, /* angle about the shape's axis, and height along it */
    MAP_PLANAR,   /* (p − origin) · u / |u|², and so for v, with v pointing up in the image */
    MAP_BOX,      /* each face of a box shows the whole image, upright seen from outside */
    MAP_MESH,     /* the mesh's own texture coordinates */
};

enum { BOX_FACES = 6 }; /* in the order +x −x +y −y +z −z */

struct texture {
    enum texture_kind kind;
    /* constant: color[0]. checker, stripes: the two colours, color[0] where the parity is even.
     * gradient: from color[0] to color[1]. */
    struct vec3 color[2];
    struct vec3 direction; /* stripes, gradient: unit vector across them */
    double size;           /* checker: edge of a cube; stripes: width of one stripe; > 0 */
    double start, end;     /* gradient: where along `direction` it starts and ends; start != end */
    struct vec3 offset;    /* checker, stripes: a point where a cell begins */

    enum texture_map map;               /* image */
    size_t image[BOX_FACES];            /* image: index into scene.images; all six equal unless a box says more */
    double repeat_u, repeat_v;          /* image: how often it repeats along the map; > 0 */
    struct vec3 origin, axis_u, axis_v; /* MAP_PLANAR; axes not zero and not parallel */
};

/* --- materials -------------------------------------------------------------------------------------------- */

/* Light that meets a surface is shared out: `reflection` of it is mirrored, `transparency` goes straight on
 * (tinted by `filter`), the rest 1 − reflection − transparency meets the Phong surface of colour `color`.
 * With ior > 0 the surface is a dielectric instead: Fresnel's equations share all light between the
 * mirrored and the refracted ray, and the surface keeps only its highlight. */
struct material {
    struct texture color;
    double ambient;          /* 0..1, share of the scene's ambient light given back */
    double diffuse;          /* 0..1 */
    struct vec3 specular;    /* 0..1 each, of the highlight (the image of the lamp) */
    double shininess;        /* Phong exponent, > 0 */
    struct vec3 reflection;  /* 0..1 each */
    double transparency;     /* 0..1; reflection + transparency <= 1 */
    struct vec3 filter;      /* 0..1 each: what passes the surface is multiplied by this, at each crossing */
    double ior;              /* index of refraction, > 0; 0: not a dielectric */
    struct vec3 absorption;  /* >= 0, per scene unit inside a dielectric: exp(−absorption × length) */
};

/* --- shapes ----------------------------------------------------------------------------------------------- */

enum shape_kind {
    SHAPE_SPHERE,
    SHAPE_PLANE,
    SHAPE_DISC,
    SHAPE_FRUSTUM, /* also the cylinder (equal radii) and the cone (top_radius 0) */
    SHAPE_BOX,
    SHAPE_MESH, /* also the triangle, the polygon and the tetrahedron */
    SHAPE_KINDS,
};

/* Triangles over shared vertices. index holds 3 per triangle, each below vertex_count. normals and uv are
 * NULL or hold one per vertex (uv: u then v). closed: every edge is shared by exactly two triangles that
 * run along it in opposite directions, with the outside seen counter-clockwise. shared: the arrays are those of an
 * earlier object, which owns them; two meshes with the same `index` are the same in all else. */
struct mesh {
    struct vec3 *points;
    struct vec3 *normals;
    double *uv;
    uint32_t *index;
    size_t vertex_count, triangle_count;
    bool closed, shared;
};

struct shape {
    enum shape_kind kind;
    union {
        struct {
            struct vec3 center;
            double radius; /* > 0 */
        } sphere;
        struct {
            struct vec3 point;
            struct vec3 normal; /* unit */
        } plane;
        struct {
            struct vec3 center;
            struct vec3 normal; /* unit */
            double radius;      /* > 0 */
        } disc;
        struct {
            struct vec3 base, top;          /* centres of the two ends, base != top */
            double base_radius, top_radius; /* >= 0, not both 0 */
            bool open;                      /* without caps; otherwise a solid */
        } frustum;
        struct {
            struct vec3 min, max; /* min < max in every coordinate */
        } box;
        struct mesh mesh; /* owned, unless it is shared */
    };
};

/* True for solids: what may be a dielectric. */
bool shape_is_closed(const struct shape *shape);

struct object {
    struct shape shape;
    size_t material;         /* index into scene.materials */
    struct affine transform; /* shape coordinates to world; invertible */
};

/* --- lights, camera, surroundings ------------------------------------------------------------------------- */

enum light_kind { LIGHT_POINT, LIGHT_DIRECTIONAL, LIGHT_SPOT };

struct light {
    enum light_kind kind;
    struct vec3 color;     /* radiant strength, colour × intensity, >= 0 */
    struct vec3 position;  /* point, spot */
    struct vec3 direction; /* directional, spot: unit vector along which the light travels */
    double falloff[3];     /* point, spot: strength is divided by f0 + f1 d + f2 d² at distance d; >= 0, not all 0 */
    double outer_degrees;  /* spot: half-angle; lit if and only if the cosine is at least its cosine; 0..90 */
    double inner_degrees;  /* spot: full strength within; 0..outer */
};

struct camera {
    struct vec3 from, at, up; /* from != at, up not parallel to the view */
    double fov_degrees;       /* vertical, of the whole image; above 0, below 180 */
};

/* Why from, at and up are no camera: "expected …, found …", a constant. NULL if they are one. */
const char *camera_fault(const struct camera *camera);

enum background_kind { BACKGROUND_CONSTANT, BACKGROUND_GRADIENT, BACKGROUND_IMAGE };

/* gradient: color[0] straight down to color[1] straight up, linear in the direction's y.
 * image: all around, as MAP_SPHERE seen from the inside along the ray's direction. */
struct background {
    enum background_kind kind;
    struct vec3 color[2];
    size_t image;
};

/* An image file, once a scene however often it is named. */
struct scene_image {
    char *name; /* the asset's name; owned */
    struct image image; /* empty until it is decoded */
};

/* What a reader makes of the image files that it meets. */
enum image_use {
    IMAGES_DECODED,
    IMAGES_CHECKED, /* refused where decoding would, but not kept: for those who do not render */
    IMAGES_NAMED,   /* read, and neither decoded nor checked before scene_images_decode */
};

/* How what is seen around a pixel counts in it. */
enum pixel_filter {
    FILTER_BOX,  /* evenly, over the pixel */
    FILTER_TENT, /* less with the distance, down to nothing one pixel from the centre to each side */
    PIXEL_FILTERS,
};

/* What scenes and commands call them. */
extern const char *const pixel_filter_names[PIXEL_FILTERS];

/* All zero is an empty scene. Owns everything it points to; scene_finish frees it. */
struct scene {
    uint32_t width, height; /* default image size, pixels, 1..IMAGE_SIDE_MAX */
    uint32_t samples;       /* a pixel; 0 if the scene does not say */
    enum pixel_filter filter;
    uint32_t depth;         /* how often a ray may be mirrored or pass a surface: 0 = camera rays only */
    struct camera camera;
    struct background background;
    struct vec3 ambient; /* ambient light, >= 0 */
    struct light *lights;
    size_t light_count, light_capacity;
    struct material *materials;
    size_t material_count, material_capacity;
    struct object *objects;
    size_t object_count, object_capacity;
    enum image_use image_use;
    struct scene_image *images;
    size_t image_count, image_capacity;
};

/* Primitives, with each triangle of each object, are told apart by numbers of 32 bits, of which the last is none. */
#define SCENE_PRIMITIVES_MAX UINT32_MAX

enum {
    SCENE_DEPTH_MAX = 64,
    SCENE_DEPTH_DEFAULT = 8,
    SCENE_SAMPLES_MAX = 65536,
    SCENE_WIDTH_DEFAULT = 640,
    SCENE_HEIGHT_DEFAULT = 360,
};

void scene_finish(struct scene *scene);

/* Adds a copy; returns its place in scene->materials. */
size_t scene_add_material(struct scene *scene, const struct material *material);

/* Adds an object that is all zero but for its transform, the identity. Valid until the next one is added. */
struct object *scene_add_object(struct scene *scene);

#endif
