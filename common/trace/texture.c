#include "trace/texture.h"

#include <math.h>

#include "math/elementary.h"
#include "trace/image_filter.h"
#include "trace/plan_parts.h"

static const double PI = 3.14159265358979323846;

/* --- compiling -------------------------------------------------------------------------------------------- */

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

/* --- patterns --------------------------------------------------------------------------------------------- */

static double row_value(const struct texture_row *row, struct vec3 position)
{
    return vec3_dot(row->gradient, position) + row->offset;
}

/* How far the coordinate ranges over the footprint. */
static double row_width(const struct texture_row *row, const struct texture_point *at)
{
    return fabs(vec3_dot(row->gradient, at->position_x)) + fabs(vec3_dot(row->gradient, at->position_y));
}

/* The integral from 0 of the square wave that is +1 where floor(s) is even and −1 where it is odd: a triangle
 * wave between 0 and 1. */
static double square_wave_integral(double s)
{
    return 1 - fabs(1 - (s - 2 * floor(s / 2)));
}

/* The mean of that square wave over s ± width/2. */
static double square_wave_mean(double s, double width)
{
    double low = s - width / 2, high = s + width / 2, cell = floor(low);
    if (cell == floor(high))
        return cell - 2 * floor(cell / 2) == 0 ? 1 : -1;
    if (!(width < 1e6)) /* so many cells that the mean is 0 to six digits */
        return 0;
    double mean = (square_wave_integral(high) - square_wave_integral(low)) / width;
    return mean > 1 ? 1 : mean < -1 ? -1 : mean;
}

static double stripes_mean(const struct texture_row *row, const struct texture_point *at)
{
    return square_wave_mean(row_value(row, at->position), row_width(row, at));
}

/* The parity of a cell is the product of its coordinates' square waves. A coordinate that is constant over a flat
 * surface is left out: there, rounding alone would decide its parity. */
static double checker_mean(const struct plan_texture *texture, const struct texture_point *at)
{
    double mean = 1;
    for (int axis = 0; axis < 3; axis++)
        if (axis != at->flat_axis)
            mean *= stripes_mean(&texture->row[axis], at);
    return mean;
}

static double clamp01(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* --- images ----------------------------------------------------------------------------------------------- */

/* u = 1/2 + atan2(x, z) / 2π, and its change along the footprint, for the direction (x, ·, z) from the axis. */
static double turn(double x, double z, double *u_x, double *u_y, const struct vec3 *c_x, const struct vec3 *c_y)
{
    double square = x * x + z * z;
    if (square > 0) {
        *u_x = (z * c_x->x - x * c_x->z) / (2 * PI * square);
        *u_y = (z * c_y->x - x * c_y->z) / (2 * PI * square);
    }
    return 0.5 + math_atan2(x, z) / (2 * PI);
}

/* v = angle from +y / π, and its change, for the point c off the middle. */
static double polar(struct vec3 c, double *v_x, double *v_y, const struct vec3 *c_x, const struct vec3 *c_y)
{
    double radius = sqrt(c.x * c.x + c.z * c.z), square = vec3_dot(c, c);
    if (radius > 0) {
        *v_x = (c.y * (c.x * c_x->x + c.z * c_x->z) / radius - radius * c_x->y) / (PI * square);
        *v_y = (c.y * (c.x * c_y->x + c.z * c_y->z) / radius - radius * c_y->y) / (PI * square);
    }
    return math_atan2(radius, c.y) / PI;
}

static struct image_point sphere_point(struct vec3 c, struct vec3 c_x, struct vec3 c_y)
{
    struct image_point at = {.repeat_u = true};
    at.u = turn(c.x, c.z, &at.u_x, &at.u_y, &c_x, &c_y);
    at.v = polar(c, &at.v_x, &at.v_y, &c_x, &c_y);
    return at;
}

/* The face that a point of the unit box (its middle at 0) looks out of. */
static int box_face_of(struct vec3 q)
{
    double x = fabs(q.x), y = fabs(q.y), z = fabs(q.z);
    if (x >= y && x >= z)
        return q.x > 0 ? 0 : 1;
    if (y >= z)
        return q.y > 0 ? 2 : 3;
    return q.z > 0 ? 4 : 5;
}

/* Upright seen from outside: which coordinate is u and which v, and which way they run. */
static const struct {
    uint8_t u, v;
    bool u_reversed, v_reversed;
} box_faces[BOX_FACES] = {
    {2, 1, true, true},   {2, 1, false, true}, /* +x −x: z across, y up */
    {0, 2, false, false}, {0, 2, false, true}, /* +y −y: x across, seen with −z and +z up */
    {0, 1, false, true},  {0, 1, true, true},  /* +z −z: x across, y up */
};

static struct image_point box_point(int face, struct vec3 c, struct vec3 c_x, struct vec3 c_y)
{
    const double at[3] = {c.x, c.y, c.z}, at_x[3] = {c_x.x, c_x.y, c_x.z}, at_y[3] = {c_y.x, c_y.y, c_y.z};
    int u = box_faces[face].u, v = box_faces[face].v;
    struct image_point point = {.u = at[u], .v = at[v], .u_x = at_x[u], .u_y = at_y[u], .v_x = at_x[v], .v_y = at_y[v]};
    if (box_faces[face].u_reversed) {
        point.u = 1 - point.u;
        point.u_x = -point.u_x;
        point.u_y = -point.u_y;
    }
    if (box_faces[face].v_reversed) {
        point.v = 1 - point.v;
        point.v_x = -point.v_x;
        point.v_y = -point.v_y;
    }
    return point;
}

static struct vec3 apply_gradients(const struct texture_row *row, struct vec3 v)
{
    return vec3_make(vec3_dot(row[0].gradient, v), vec3_dot(row[1].gradient, v), vec3_dot(row[2].gradient, v));
}

static struct image_point image_point_of(const struct plan_texture *texture, const struct texture_point *at, int *face)
{
    struct vec3 c = {row_value(&texture->row[0], at->position), row_value(&texture->row[1], at->position),
                     row_value(&texture->row[2], at->position)};
    struct vec3 c_x = apply_gradients(texture->row, at->position_x);
    struct vec3 c_y = apply_gradients(texture->row, at->position_y);
    struct image_point point = {0};
    switch ((enum texture_map)texture->map) {
    case MAP_SPHERE:
        return sphere_point(c, c_x, c_y);
    case MAP_CYLINDER:
        point = (struct image_point){.v = c.y, .v_x = c_x.y, .v_y = c_y.y, .repeat_u = true};
        point.u = turn(c.x, c.z, &point.u_x, &point.u_y, &c_x, &c_y);
        return point;
    case MAP_PLANAR:
        return (struct image_point){c.x, c.y, c_x.x, c_x.y, c_y.x, c_y.y, true, true};
    case MAP_BOX:
        *face = at->box_face >= 0 ? at->box_face : box_face_of(vec3_sub(c, vec3_make(0.5, 0.5, 0.5)));
        return box_point(*face, c, c_x, c_y);
    case MAP_MESH: /* the mesh's v points up, as in OBJ files */
        return (struct image_point){at->uv[0],    1 - at->uv[1], at->uv_x[0], -at->uv_x[1],
                                    at->uv_y[0], -at->uv_y[1],  true,        true};
    }
    return point;
}

static struct vec3 image_color(const struct plan *plan, const struct plan_texture *texture,
                               const struct texture_point *at)
{
    int face = 0;
    struct image_point point = image_point_of(texture, at, &face);
    point.u *= texture->repeat_u;
    point.u_x *= texture->repeat_u;
    point.u_y *= texture->repeat_u;
    point.v *= texture->repeat_v;
    point.v_x *= texture->repeat_v;
    point.v_y *= texture->repeat_v;
    point.repeat_u = point.repeat_u || texture->repeat_u != 1;
    point.repeat_v = point.repeat_v || texture->repeat_v != 1;
    return image_filter(&plan->images[texture->image[face]], &point);
}

struct vec3 texture_color(const struct plan *plan, const struct plan_texture *texture, const struct texture_point *at)
{
    switch ((enum texture_kind)texture->kind) {
    case TEXTURE_CONSTANT:
        return texture->color[0];
    case TEXTURE_CHECKER:
        return vec3_mix(texture->color[0], texture->color[1], (1 - checker_mean(texture, at)) / 2);
    case TEXTURE_STRIPES:
        return vec3_mix(texture->color[0], texture->color[1], (1 - stripes_mean(&texture->row[0], at)) / 2);
    case TEXTURE_GRADIENT:
        return vec3_mix(texture->color[0], texture->color[1], clamp01(row_value(&texture->row[0], at->position)));
    case TEXTURE_IMAGE:
        return image_color(plan, texture, at);
    }
    return texture->color[0];
}

struct vec3 texture_surroundings(const struct plan_image *image, struct vec3 direction, struct vec3 direction_x,
                                 struct vec3 direction_y)
{
    struct image_point point = sphere_point(direction, direction_x, direction_y);
    return image_filter(image, &point);
}
