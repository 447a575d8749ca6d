/*
 * Primitives of every kind, scaled, moved and turned, and nasty rays at them.
 */
#ifndef WEFT_TESTS_NASTY_H
#define WEFT_TESTS_NASTY_H

#include "tests/numeric/shoot.h"

/* --- the primitives --------------------------------------------------------------------------------------- */

#define UNIT_ROUNDOFF (DBL_EPSILON / 2)

/* Each within a few of its own units around the origin of its own coordinates.
 *
 * slack: how far a ray may be moved, in D u (u = UNIT_ROUNDOFF), where D is the greater of the ray's and the
 * camera's distance from the primitive's middle in units of its size, at least 1. All start with three
 * roundings of a length D: of the place relative to the camera, of the origin relative to the place, and of the
 * direction's length (t is one of a unit vector). What each formula adds, counting a rounding of a length or
 * product of size D as 1 and a dot product of three as 3:
 *   sphere: the nearest point 3 + 1 across and 3 along, its square and that of the radius (4, halved by the
 *     root), the root and the last sum 2;
 *   ellipsoid: the frame's entries 4 and its application 3, times its condition of 3; then moment 3, its square
 *     and the coefficients 7, roots 5;
 *   plane: normal 2, offset 3, dot product 3, cosine 3, quotient and difference 2;
 *   disc: the same with the centre's 1; u and v and their squares are within it;
 *   frustums: the frame's entries 6 (an orthonormal frame from its axis, normalised) and its application 3,
 *     local radius 2 and slope 3, then 2 × 2 for the moments, 5 for their squares, 5 for the coefficients,
 *     roots 5;
 *   box: frame 3, half 2, slab 3;
 *   triangle: corners 3, shear 3 and its product 2, edges' products 3, their quotient 5.
 * Each count is rounded up to the next multiple of 8. */
struct kind {
    const char *name;
    double slack;
    double size;         /* a bound on its points' distance from its middle */
    struct vec3 stretch; /* of the transform, besides turning and scaling */
};

enum {
    SPHERE,
    ELLIPSOID,
    PLANE,
    DISC,
    CYLINDER,
    CONE,
    FRUSTUM,
    CYLINDER_OPEN,
    CONE_OPEN,
    FRUSTUM_OPEN,
    BOX,
    TRIANGLE,
    KINDS
};

static const struct kind kinds[KINDS] = {
    [SPHERE] = {"sphere", 16, 1.25, {1, 1, 1}},
    [ELLIPSOID] = {"ellipsoid", 40, 1.5, {1, 0.5, 1.5}},
    [PLANE] = {"plane", 16, 1, {1, 1, 1}},
    [DISC] = {"disc", 24, 1.5, {1, 1, 1}},
    [CYLINDER] = {"cylinder", 40, 1.4, {1, 1, 1}},
    [CONE] = {"cone", 40, 1.4, {1, 1, 1}},
    [FRUSTUM] = {"frustum", 40, 1.4, {1, 1, 1}},
    [CYLINDER_OPEN] = {"cylinder, open", 40, 1.4, {1, 1, 1}},
    [CONE_OPEN] = {"cone, open", 40, 1.4, {1, 1, 1}},
    [FRUSTUM_OPEN] = {"frustum, open", 40, 1.4, {1, 1, 1}},
    [BOX] = {"box", 16, 1.5, {1, 1, 1}},
    [TRIANGLE] = {"triangle", 24, 1.5, {1, 1, 1}},
};

static const struct vec3 base = {0.2, -0.9, 0.1}, top = {-0.1, 0.8, 0.3};
static const struct vec3 corner[3] = {{-1, -0.8, 0.2}, {1.1, -0.7, -0.1}, {0.1, 1.2, 0.3}};
static const struct vec3 box_min = {-0.8, -0.6, -0.9}, box_max = {0.7, 0.9, 0.6};

static inline struct shape shape_of(int kind)
{
    static const uint32_t corners[] = {0, 1, 2};
    static const double radii[][2] = {{0.75, 0.75}, {0.9, 0}, {0.4, 0.8}};
    switch (kind) {
    case SPHERE:
        return shape_sphere(vec3_make(0.1, -0.05, 0.15), 1);
    case ELLIPSOID:
        return shape_sphere(vec3_make(0, 0, 0), 1);
    case PLANE:
        return shape_plane(vec3_make(0.1, 0.2, 0.3), vec3_make(0, 0, 1));
    case DISC:
        return shape_disc(vec3_make(0.1, -0.1, 0.2), vec3_normalize(vec3_make(-1, 2, 3)), 1.2);
    case BOX:
        return shape_box(box_min, box_max);
    case TRIANGLE:
        return shape_mesh(corner, 3, corners, 1, false);
    default: {
        const double *r = radii[(kind - CYLINDER) % 3];
        return kind >= CYLINDER_OPEN ? shape_tube(base, top, r[0], r[1]) : shape_frustum(base, top, r[0], r[1]);
    }
    }
}

/* --- places on them --------------------------------------------------------------------------------------- */

/* In the shape's own coordinates. */
struct place {
    struct vec3 point, normal;
};

static inline struct place frustum_place(const struct shape *shape, uint32_t i, double along, double angle)
{
    struct vec3 axis = vec3_sub(shape->frustum.top, shape->frustum.base), x, y, z = vec3_normalize(axis);
    vec3_frame(z, &x, &y);
    struct vec3 out = vec3_add(vec3_scale(x, cos(angle)), vec3_scale(y, sin(angle)));
    double taper = shape->frustum.top_radius - shape->frustum.base_radius;
    struct vec3 p = vec3_mix(shape->frustum.base, shape->frustum.top, along);
    if (i % 3 == 0 && !shape->frustum.open) { /* on a cap */
        double share = random_between(i, 60, 0, 1);
        struct vec3 end = i % 2 ? shape->frustum.base : shape->frustum.top;
        double radius = i % 2 ? shape->frustum.base_radius : shape->frustum.top_radius;
        return (struct place){vec3_add_scaled(end, out, share * radius), i % 2 ? vec3_neg(z) : z};
    }
    struct vec3 normal = vec3_normalize(vec3_add_scaled(out, z, -taper / vec3_length(axis)));
    return (struct place){vec3_add_scaled(p, out, shape->frustum.base_radius + along * taper), normal};
}

static inline struct place box_place(uint32_t i)
{
    double p[3], n[3] = {0, 0, 0};
    const double low[3] = {box_min.x, box_min.y, box_min.z}, high[3] = {box_max.x, box_max.y, box_max.z};
    for (uint32_t k = 0; k < 3; k++)
        p[k] = random_between(i, 40 + k, low[k], high[k]);
    p[i % 3] = i % 2 ? low[i % 3] : high[i % 3];
    n[i % 3] = i % 2 ? -1 : 1;
    return (struct place){vec3_make(p[0], p[1], p[2]), vec3_make(n[0], n[1], n[2])};
}

/* Some point of the surface. */
static inline struct place any_place(const struct shape *shape, uint32_t i)
{
    struct vec3 n = random_unit(i, 40), x, y;
    double share = sqrt(random_between(i, 43, 0, 1)), angle = random_between(i, 44, 0, 6.283185307179586);
    switch (shape->kind) {
    case SHAPE_SPHERE:
        return (struct place){vec3_add_scaled(shape->sphere.center, n, shape->sphere.radius), n};
    case SHAPE_PLANE:
    case SHAPE_DISC: { /* a plane's point and normal come first, as a disc's centre and normal do */
        double radius = shape->kind == SHAPE_DISC ? shape->disc.radius : 1;
        vec3_frame(shape->disc.normal, &x, &y);
        struct vec3 p = vec3_add_scaled(shape->disc.center, x, share * radius * cos(angle));
        return (struct place){vec3_add_scaled(p, y, share * radius * sin(angle)), shape->disc.normal};
    }
    case SHAPE_FRUSTUM:
        return frustum_place(shape, i, random_between(i, 45, 0, 1), angle);
    case SHAPE_BOX:
        return box_place(i);
    default: {
        double v = 1 - share, w = share * random_between(i, 45, 0, 1);
        struct vec3 along = vec3_sub(corner[1], corner[0]), across = vec3_sub(corner[2], corner[0]);
        struct vec3 p = vec3_add_scaled(vec3_add_scaled(corner[0], along, v), across, w);
        return (struct place){p, vec3_normalize(vec3_cross(along, across))};
    }
    }
}

/* A pole, a rim, an apex, an edge or a vertex. */
static inline struct vec3 special_point(const struct shape *shape, uint32_t i)
{
    double along = random_between(i, 50, 0, 1), angle = random_between(i, 51, 0, 6.283185307179586);
    struct vec3 x, y, pole = {i % 3 == 0 ? 1 : 0, i % 3 == 1 ? 1 : 0, i % 3 == 2 ? 1 : 0};
    switch (shape->kind) {
    case SHAPE_SPHERE:
        return vec3_add_scaled(shape->sphere.center, pole,
                               i % 2 ? shape->sphere.radius : -shape->sphere.radius);
    case SHAPE_DISC:
        vec3_frame(shape->disc.normal, &x, &y);
        return vec3_add_scaled(vec3_add_scaled(shape->disc.center, x, shape->disc.radius * cos(angle)), y,
                               shape->disc.radius * sin(angle));
    case SHAPE_FRUSTUM:
        return i % 8 == 0 ? (i % 16 ? base : top) : frustum_place(shape, 1, i % 2, angle).point;
    case SHAPE_BOX:
        return vec3_make(i & 1 ? box_min.x : box_max.x, i & 2 ? box_min.y : box_max.y,
                         i & 8   ? vec3_mix(box_min, box_max, along).z
                         : i & 4 ? box_min.z
                                 : box_max.z);
    case SHAPE_MESH:
        return vec3_mix(corner[i % 3], corner[(i + 1) % 3], i % 2 ? along : 0);
    default:
        return shape->plane.point;
    }
}

/* --- the rays --------------------------------------------------------------------------------------------- */

enum aim { EVENLY, GRAZING, SPECIAL, AXIAL, AIMS };

/* ±1e-1 … ±1e-15, or 0. */
static inline double tiny(uint32_t i, uint32_t draw)
{
    double exponent = random_between(i, draw, -18, -1);
    return exponent < -15 ? 0 : copysign(pow(10, exponent), random_signed(i, draw + 1));
}

/* One of ±x, ±y, ±z, with zeros of both signs; or near it. */
static inline struct vec3 axial_direction(uint32_t i)
{
    double d[3] = {i & 16 ? 0.0 : -0.0, i & 32 ? 0.0 : -0.0, i & 64 ? 0.0 : -0.0};
    d[i % 3] = i & 8 ? 1 : -1;
    if (i % 5 == 0)
        d[(i + 1) % 3] = tiny(i, 52);
    return vec3_make(d[0], d[1], d[2]);
}

/* A line in the shape's own coordinates: a point near the shape, and a direction. */
static inline struct place nasty_line(const struct shape *shape, double size, enum aim aim, uint32_t i)
{
    struct vec3 d = random_unit(i, 0);
    if (aim == EVENLY) { /* across a disc that covers it */
        struct vec3 x, y;
        double r = size * sqrt(random_between(i, 3, 0, 1)), angle = random_between(i, 4, 0, 6.283185307179586);
        vec3_frame(d, &x, &y);
        return (struct place){vec3_add(vec3_scale(x, r * cos(angle)), vec3_scale(y, r * sin(angle))), d};
    }
    if (aim == GRAZING) {
        struct place at = any_place(shape, i);
        struct vec3 tangent = vec3_normalize(vec3_cross(at.normal, d));
        return (struct place){vec3_add_scaled(at.point, at.normal, tiny(i, 5)),
                              vec3_add_scaled(tangent, at.normal, tiny(i, 7))};
    }
    if (aim == SPECIAL)
        return (struct place){vec3_add_scaled(special_point(shape, i), random_unit(i, 9), tiny(i, 5)), d};
    struct vec3 target = i % 2 ? special_point(shape, i) : any_place(shape, i).point;
    if (shape->kind == SHAPE_FRUSTUM && i % 4 < 2)
        return (struct place){target, vec3_scale(vec3_sub(top, base), i & 8 ? 1 : -1)};
    return (struct place){target, axial_direction(i)};
}

/* A primitive in the world, and the camera. */
struct stage {
    struct world world;
    struct limits_frame frame;
    struct vec3 middle; /* of the primitive, in the world */
    double size, scale; /* its size in the world, and that of its own unit */
    double distance;    /* in sizes */
};

/* Every other primitive is turned. The camera: where the rays are; as far, but elsewhere; in the middle of
 * the rays. */
static inline struct stage stage_of(int kind, double distance, struct material material, uint32_t i)
{
    struct stage stage = {.distance = distance, .scale = ldexp(random_between(i, 20, 1, 2), (int)(i % 9) - 4)};
    struct affine transform = affine_scaling(vec3_scale(kinds[kind].stretch, stage.scale));
    struct affine turn = affine_rotation(random_unit(i, 21), random_between(i, 24, -180, 180));
    if (i % 2)
        transform = affine_multiply(&turn, &transform);
    stage.middle = transform.offset = vec3_scale(random_vector(i, 25), 10 * stage.scale);
    stage.size = stage.scale * kinds[kind].size;
    double reach = i % 3 == 0 ? 0 : distance * stage.size;
    struct vec3 eye = vec3_add_scaled(stage.middle, random_unit(i, 28), reach);
    stage.world = world_begin(eye);
    scene_add(&stage.world.scene, shape_of(kind), material)->transform = transform;
    world_compile(&stage.world);
    stage.frame = limits_frame_of(&transform, eye);
    return stage;
}

static inline struct ray nasty_ray(const struct stage *stage, int kind, enum aim aim, uint32_t i)
{
    const struct object *object = &stage->world.scene.objects[0];
    struct place line = nasty_line(&object->shape, kinds[kind].size, aim, i);
    struct vec3 target = affine_point(&object->transform, line.point);
    struct vec3 d = vec3_normalize(mat3_apply(&object->transform.linear, line.normal));
    double back = stage->distance * stage->size * random_between(i, 11, 0.5, 1);
    return ray_from(&stage->world, vec3_add_scaled(target, d, -back), d);
}

/* --- the unit of errors ----------------------------------------------------------------------------------- */

/* How far from the middle things are, in sizes: the ray's origin, the camera, and on a plane the hit. */
static inline double reach_of(const struct stage *stage, const struct ray *ray)
{
    struct vec3 middle = vec3_sub(stage->middle, stage->world.scene.camera.from);
    double eye = vec3_length(middle), origin = vec3_length(vec3_sub(ray->origin, middle));
    return fmax(1, fmax(eye, origin) / stage->size);
}

static inline double t_scale(const struct stage *stage, int kind, const struct ray *ray, double t)
{
    double reach = reach_of(stage, ray);
    return kind == PLANE && isfinite(t) ? fmax(reach, t / stage->size) : reach; /* its normal tells far off */
}

/* The unit of backward errors, in the shape's own coordinates. */
static inline double unit_of(const struct stage *stage, int kind, const struct ray *ray, double t)
{
    double narrow = fmin(kinds[kind].stretch.x, fmin(kinds[kind].stretch.y, kinds[kind].stretch.z));
    return t_scale(stage, kind, ray, t) * UNIT_ROUNDOFF * kinds[kind].size / narrow;
}

#endif
