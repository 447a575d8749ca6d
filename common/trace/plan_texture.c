#include <math.h>

#include "trace/plan_parts.h"

/* Takes object coordinates relative to `origin` along `weight` from positions relative to the eye:
 * weight · (local − origin), where local = inverse (position + eye − offset). */
static struct texture_row compile_row(const struct affine *transform, struct vec3 eye, struct vec3 weight,
                                      struct vec3 origin)
{
    struct mat3 inverse = mat3_inverse(&transform->linear);
    struct vec3 eye_local = mat3_apply(&inverse, vec3_sub(eye, transform->offset));
    return (struct texture_row){
        .gradient = mat3_apply_transposed(&inverse, weight),
        .offset = vec3_dot(weight, vec3_sub(eye_local, origin)),
    };
}

static struct texture_row scaled(struct texture_row row, double factor)
{
    return (struct texture_row){vec3_scale(row.gradient, factor), row.offset * factor};
}

/* In cells of that size, for a pattern of period 2. fmod is exact, so a scene far from its origin loses no digits of
 * the phase here. */
static struct texture_row in_cells(struct texture_row row, double size)
{
    row.offset = fmod(row.offset, 2 * size);
    return scaled(row, 1 / size);
}

static struct texture_row reversed(struct texture_row row)
{
    return (struct texture_row){vec3_neg(row.gradient), 1 - row.offset};
}

static const struct vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* The box around a shape, in its own coordinates; a unit cube around a plane's point. */
static void shape_bounds(const struct shape *shape, struct vec3 *low, struct vec3 *high)
{
    struct vec3 center, half = {0.5, 0.5, 0.5};
    switch (shape->kind) {
    case SHAPE_SPHERE:
        center = shape->sphere.center;
        half = vec3_scale(vec3_make(1, 1, 1), shape->sphere.radius);
        break;
    case SHAPE_DISC:
        center = shape->disc.center;
        half = vec3_scale(vec3_make(1, 1, 1), shape->disc.radius);
        break;
    case SHAPE_FRUSTUM: {
        double radius = shape->frustum.base_radius > shape->frustum.top_radius ? shape->frustum.base_radius
                                                                                : shape->frustum.top_radius;
        struct vec3 along = vec3_scale(vec3_sub(shape->frustum.top, shape->frustum.base), 0.5);
        center = vec3_add(shape->frustum.base, along);
        half = vec3_make(fabs(along.x) + radius, fabs(along.y) + radius, fabs(along.z) + radius);
        break;
    }
    case SHAPE_BOX:
        *low = shape->box.min;
        *high = shape->box.max;
        return;
    case SHAPE_MESH:
        *low = *high = shape->mesh.points[0];
        for (size_t i = 1; i < shape->mesh.vertex_count; i++) {
            struct vec3 p = shape->mesh.points[i];
            *low = vec3_make(p.x < low->x ? p.x : low->x, p.y < low->y ? p.y : low->y, p.z < low->z ? p.z : low->z);
            *high = vec3_make(p.x > high->x ? p.x : high->x, p.y > high->y ? p.y : high->y,
                              p.z > high->z ? p.z : high->z);
        }
        return;
    default:
        center = shape->plane.point;
        break;
    }
    *low = vec3_sub(center, half);
    *high = vec3_add(center, half);
}

/* Rows: the three coordinates relative to the shape's middle. */
static void compile_sphere_map(struct plan_texture *to, const struct object *object, struct vec3 eye)
{
    struct vec3 low, high;
    shape_bounds(&object->shape, &low, &high);
    struct vec3 middle = vec3_mix(low, high, 0.5);
    for (int i = 0; i < 3; i++)
        to->row[i] = compile_row(&object->transform, eye, axes[i], middle);
}

/* Rows: across the axis to the right, down along the axis as a share of the height, and across it to the front. For
 * an upright axis these are x, −y and z. */
static void compile_cylinder_map(struct plan_texture *to, const struct object *object, struct vec3 eye)
{
    struct vec3 low, high, right, back;
    shape_bounds(&object->shape, &low, &high);
    struct vec3 middle = vec3_mix(low, high, 0.5), base = vec3_make(middle.x, low.y, middle.z);
    struct vec3 top = vec3_make(middle.x, high.y, middle.z);
    if (object->shape.kind == SHAPE_FRUSTUM) {
        base = object->shape.frustum.base;
        top = object->shape.frustum.top;
    }
    struct vec3 along = vec3_sub(top, base);
    double height = vec3_length(along);
    struct vec3 axis = height > 0 ? vec3_normalize(along) : vec3_make(0, 1, 0);
    vec3_frame(axis, &right, &back);
    to->row[0] = compile_row(&object->transform, eye, right, base);
    to->row[1] = reversed(scaled(compile_row(&object->transform, eye, axis, base), 1 / (height > 0 ? height : 1)));
    to->row[2] = compile_row(&object->transform, eye, vec3_neg(back), base);
}

/* Rows: 0..1 across the shape's box in x, y and z. */
static void compile_box_map(struct plan_texture *to, const struct object *object, struct vec3 eye)
{
    struct vec3 low, high;
    shape_bounds(&object->shape, &low, &high);
    const double size[3] = {high.x - low.x, high.y - low.y, high.z - low.z};
    for (int i = 0; i < 3; i++)
        to->row[i] = scaled(compile_row(&object->transform, eye, axes[i], low), 1 / (size[i] > 0 ? size[i] : 1));
}

/* Rows: u and v. */
static void compile_planar_map(struct plan_texture *to, const struct texture *texture, const struct object *object,
                               struct vec3 eye)
{
    struct vec3 u = texture->axis_u, v = texture->axis_v;
    to->row[0] = scaled(compile_row(&object->transform, eye, u, texture->origin), 1 / vec3_dot(u, u));
    to->row[1] = reversed(scaled(compile_row(&object->transform, eye, v, texture->origin), 1 / vec3_dot(v, v)));
}

static void compile_image(struct plan_texture *to, const struct texture *texture, const struct object *object,
                          struct vec3 eye)
{
    to->map = (uint8_t)texture->map;
    to->repeat_u = texture->repeat_u;
    to->repeat_v = texture->repeat_v;
    for (int i = 0; i < BOX_FACES; i++)
        to->image[i] = (uint32_t)texture->image[i];
    switch (texture->map) {
    case MAP_SPHERE:
        compile_sphere_map(to, object, eye);
        break;
    case MAP_CYLINDER:
        compile_cylinder_map(to, object, eye);
        break;
    case MAP_PLANAR:
        compile_planar_map(to, texture, object, eye);
        break;
    case MAP_BOX:
        compile_box_map(to, object, eye);
        break;
    case MAP_MESH:
        break;
    }
}

struct plan_texture plan_texture_compile(const struct texture *texture, const struct object *object, struct vec3 eye)
{
    struct plan_texture to = {.kind = (uint8_t)texture->kind, .color = {texture->color[0], texture->color[1]}};
    const struct affine *transform = &object->transform;
    struct texture_row row;
    switch (texture->kind) {
    case TEXTURE_CONSTANT:
        break;
    case TEXTURE_CHECKER: /* rows: the coordinates in cells */
        for (int i = 0; i < 3; i++)
            to.row[i] = in_cells(compile_row(transform, eye, axes[i], texture->offset), texture->size);
        break;
    case TEXTURE_STRIPES: /* row: in stripes */
        to.row[0] = in_cells(compile_row(transform, eye, texture->direction, texture->offset), texture->size);
        break;
    case TEXTURE_GRADIENT: /* row: 0 at the start, 1 at the end */
        row = compile_row(transform, eye, texture->direction, vec3_scale(texture->direction, texture->start));
        to.row[0] = scaled(row, 1 / (texture->end - texture->start));
        break;
    case TEXTURE_IMAGE:
        compile_image(&to, texture, object, eye);
        break;
    }
    return to;
}
