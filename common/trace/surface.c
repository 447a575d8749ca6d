#include "trace/surface.h"

#include <float.h>
#include <math.h>

#include "trace/intersect_flat.h"

/* A piece of quadric F(q) = 0, q = frame (p − origin), by its value, gradient and the diagonal of its matrix of
 * second derivatives: enough for normal, curvature and a Newton step. A face of a solid is the same with second
 * derivatives of zero. */
struct implicit {
    const struct mat3 *frame;
    struct vec3 origin;
    double value;
    struct vec3 gradient; /* in the frame */
    struct vec3 second;
};

static const struct mat3 unit_frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

static struct implicit sphere_implicit(const struct sphere *sphere, struct vec3 p)
{
    struct vec3 q = vec3_sub(p, sphere->center);
    double value = 0.5 * (vec3_dot(q, q) - sphere->radius * sphere->radius);
    return (struct implicit){&unit_frame, sphere->center, value, q, {1, 1, 1}};
}

static struct implicit ellipsoid_implicit(const struct ellipsoid *ellipsoid, struct vec3 p)
{
    struct vec3 q = mat3_apply(&ellipsoid->frame, vec3_sub(p, ellipsoid->center));
    return (struct implicit){&ellipsoid->frame, ellipsoid->center, 0.5 * (vec3_dot(q, q) - 1), q, {1, 1, 1}};
}

static struct implicit frustum_implicit(const struct frustum *frustum, struct vec3 p, uint8_t part)
{
    struct vec3 q = mat3_apply(&frustum->frame, vec3_sub(p, frustum->origin));
    struct implicit at = {.frame = &frustum->frame, .origin = frustum->origin};
    if (part == PART_NARROW_CAP) {
        at.value = -q.z;
        at.gradient = vec3_make(0, 0, -1);
    } else if (part == PART_WIDE_CAP) {
        at.value = q.z - frustum->height;
        at.gradient = vec3_make(0, 0, 1);
    } else {
        double rho = frustum->radius + frustum->slope * q.z;
        at.value = 0.5 * (q.x * q.x + q.y * q.y - rho * rho);
        at.gradient = vec3_make(q.x, q.y, -frustum->slope * rho);
        at.second = vec3_make(1, 1, -frustum->slope * frustum->slope);
        if (vec3_is_zero(at.gradient)) { /* the apex itself: along the axis */
            at.value = 0;
            at.gradient = vec3_make(0, 0, -1);
        }
    }
    return at;
}

static struct implicit box_implicit(const struct box *box, struct vec3 p, uint8_t face)
{
    struct vec3 q = mat3_apply(&box->frame, p);
    const double at[3] = {q.x, q.y, q.z}, low[3] = {box->low.x, box->low.y, box->low.z};
    const double high[3] = {box->high.x, box->high.y, box->high.z};
    uint8_t axis = face / 2;
    double sign = face % 2 ? -1 : 1, along[3] = {0, 0, 0};
    along[axis] = sign;
    return (struct implicit){.frame = &box->frame,
                             .value = face % 2 ? low[axis] - at[axis] : at[axis] - high[axis],
                             .gradient = vec3_make(along[0], along[1], along[2])};
}

static struct implicit flat_implicit(const struct plane *plane, struct vec3 p)
{
    return (struct implicit){&unit_frame, vec3_make(0, 0, 0), vec3_dot(plane->normal, p) - plane->offset,
                             plane->normal, {0, 0, 0}};
}

static struct implicit implicit_at(const struct plan *plan, const struct hit *hit, struct vec3 p)
{
    uint32_t index = plan->primitives[hit->id].index;
    switch ((enum primitive_kind)plan->primitives[hit->id].kind) {
    case PRIMITIVE_SPHERE:
        return sphere_implicit(&plan->spheres[index], p);
    case PRIMITIVE_ELLIPSOID:
        return ellipsoid_implicit(&plan->ellipsoids[index], p);
    case PRIMITIVE_FRUSTUM:
        return frustum_implicit(&plan->frustums[index], p, hit->part);
    case PRIMITIVE_BOX:
        return box_implicit(&plan->boxes[index], p, hit->part);
    case PRIMITIVE_DISC:
        return flat_implicit(&plan->discs[index].plane, p);
    default:
        return flat_implicit(&plan->planes[index], p);
    }
}

struct hit hit_at(const struct plan *plan, const struct ray_batch *rays, const struct hit_batch *hits, size_t index)
{
    struct hit hit = {.t = INFINITY, .id = hit_batch_id(hits, index)};
    if (hit.id == PRIMITIVE_NONE)
        return hit;
    hit.t = hits->t[index];
    hit.side = hit_batch_side(hits, index);
    struct ray ray = ray_batch_get(rays, index);
    hit.part = plan_part(plan, hit.id, ray.origin, ray.direction, hit.side);
    return hit;
}

static const struct plan_mesh *mesh_of(const struct plan *plan, const struct primitive *primitive)
{
    return &plan->meshes[plan->objects[primitive->object].mesh];
}

static const uint32_t *mesh_corners(const struct plan *plan, uint32_t id)
{
    const struct primitive *primitive = &plan->primitives[id];
    return &mesh_of(plan, primitive)->index[3 * (size_t)(id - plan->objects[primitive->object].first_primitive)];
}

/* The sum of the corners' normals with these weights. */
static struct vec3 blend_normals(const struct plan_mesh *mesh, const uint32_t *corner, const double weights[3])
{
    struct vec3 n = vec3_scale(mesh->normals[corner[0]], weights[0]);
    n = vec3_add_scaled(n, mesh->normals[corner[1]], weights[1]);
    return vec3_add_scaled(n, mesh->normals[corner[2]], weights[2]);
}

/* n / |n|, or `otherwise` if n is zero. */
static struct vec3 unit_or(struct vec3 n, struct vec3 otherwise)
{
    return vec3_is_zero(n) ? otherwise : vec3_normalize(n);
}

static struct surface triangle_surface(const struct plan *plan, const struct ray *ray, const struct hit *hit)
{
    const struct primitive *primitive = &plan->primitives[hit->id];
    const struct triangle *triangle = &plan->triangles[primitive->index];
    const struct plan_mesh *mesh = mesh_of(plan, primitive);
    struct shear shear = shear_of(ray->direction);
    struct vec3 w = triangle_weights(triangle, ray->origin, &shear);
    double t = hit->side == SIDE_LEAVE ? hit->t - plan_leave_delay(plan, hit->id, ray->origin, hit->t) : hit->t;
    struct vec3 p = vec3_add_scaled(ray->origin, ray->direction, t), normal = triangle->plane.normal;
    p = vec3_add_scaled(p, normal, triangle->plane.offset - vec3_dot(normal, p));
    struct surface surface = {.position = p, .normal = normal};
    surface.weights[0] = w.x;
    surface.weights[1] = mesh->mirrored ? w.z : w.y;
    surface.weights[2] = mesh->mirrored ? w.y : w.z;
    surface.shading_normal = surface.normal;
    double reach = vec3_max_abs(triangle->a);
    reach = vec3_max_abs(triangle->b) > reach ? vec3_max_abs(triangle->b) : reach;
    reach = vec3_max_abs(triangle->c) > reach ? vec3_max_abs(triangle->c) : reach;
    surface.error = 8 * DBL_EPSILON * reach;
    if (mesh->normals)
        surface.shading_normal = unit_or(blend_normals(mesh, mesh_corners(plan, hit->id), surface.weights),
                                         surface.normal);
    return surface;
}

struct surface surface_at(const struct plan *plan, const struct ray *ray, const struct hit *hit)
{
    const struct primitive *primitive = &plan->primitives[hit->id];
    if (primitive->kind == PRIMITIVE_TRIANGLE)
        return triangle_surface(plan, ray, hit);
    /* One Newton step takes the point from the ray's error (which grows with t) to that of its coordinates. */
    double t = hit->side == SIDE_LEAVE ? hit->t - plan_leave_delay(plan, hit->id, ray->origin, hit->t) : hit->t;
    struct vec3 p = vec3_add_scaled(ray->origin, ray->direction, t);
    struct implicit at = implicit_at(plan, hit, p);
    struct vec3 gradient = mat3_apply_transposed(at.frame, at.gradient);
    p = vec3_add_scaled(p, gradient, -at.value / vec3_dot(gradient, gradient));
    at = implicit_at(plan, hit, p);
    struct vec3 normal = vec3_normalize(mat3_apply_transposed(at.frame, at.gradient));
    double scale = vec3_max_abs(p) + vec3_max_abs(at.origin) + plan->objects[primitive->object].extent;
    return (struct surface){
        .position = p, .error = 8 * DBL_EPSILON * scale, .normal = normal, .shading_normal = normal};
}

/* --- footprints ------------------------------------------------------------------------------------------- */

/* The change of the unit normal for a step along the surface: the shape operator applied to it. */
static struct vec3 normal_change(const struct implicit *at, struct vec3 normal, struct vec3 step)
{
    if (vec3_is_zero(at->second))
        return vec3_make(0, 0, 0);
    struct vec3 gradient = mat3_apply_transposed(at->frame, at->gradient);
    struct vec3 change = vec3_mul(at->second, mat3_apply(at->frame, step));
    change = mat3_apply_transposed(at->frame, change);
    change = vec3_scale(change, 1 / vec3_length(gradient));
    return vec3_add_scaled(change, normal, -vec3_dot(change, normal));
}

/* The change of the barycentric weights of a triangle's plane along a step, for the plan's corners a, b, c. */
static struct vec3 weights_change(const struct triangle *triangle, struct vec3 step)
{
    struct vec3 ab = vec3_sub(triangle->b, triangle->a), ac = vec3_sub(triangle->c, triangle->a);
    struct vec3 n = vec3_cross(ab, ac);
    double square = vec3_dot(n, n);
    double b = vec3_dot(vec3_cross(step, ac), n) / square, c = vec3_dot(vec3_cross(ab, step), n) / square;
    return vec3_make(-(b + c), b, c);
}

static struct vec3 mesh_weights_change(const struct plan *plan, const struct primitive *primitive, struct vec3 step)
{
    struct vec3 w = weights_change(&plan->triangles[primitive->index], step);
    return mesh_of(plan, primitive)->mirrored ? vec3_make(w.x, w.z, w.y) : w;
}

/* That of the normalised sum n / |n| of the corners' normals. */
static struct vec3 mesh_normal_change(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                                      struct vec3 step)
{
    const struct primitive *primitive = &plan->primitives[hit->id];
    const struct plan_mesh *mesh = mesh_of(plan, primitive);
    if (!mesh->normals)
        return vec3_make(0, 0, 0);
    const uint32_t *corner = mesh_corners(plan, hit->id);
    double length = vec3_length(blend_normals(mesh, corner, surface->weights));
    if (length == 0)
        return vec3_make(0, 0, 0);
    struct vec3 w = mesh_weights_change(plan, primitive, step);
    struct vec3 change = vec3_scale(blend_normals(mesh, corner, (const double[3]){w.x, w.y, w.z}), 1 / length);
    return vec3_add_scaled(change, surface->shading_normal, -vec3_dot(change, surface->shading_normal));
}

/* Igehy's transfer: the neighbouring ray meets the tangent plane a little farther or nearer. */
static struct vec3 transfer(const struct ray *ray, double t, struct vec3 normal, struct vec3 origin_change,
                            struct vec3 direction_change)
{
    struct vec3 step = vec3_add_scaled(origin_change, direction_change, t);
    double cosine = vec3_dot(ray->direction, normal);
    return cosine == 0 ? step : vec3_add_scaled(step, ray->direction, -vec3_dot(step, normal) / cosine);
}

struct surface_footprint surface_footprint_at(const struct plan *plan, const struct ray *ray,
                                              const struct footprint *footprint, const struct hit *hit,
                                              const struct surface *surface)
{
    struct surface_footprint spread = {
        .position_x = transfer(ray, hit->t, surface->normal, footprint->origin_x, footprint->direction_x),
        .position_y = transfer(ray, hit->t, surface->normal, footprint->origin_y, footprint->direction_y),
    };
    if (plan->primitives[hit->id].kind == PRIMITIVE_TRIANGLE) {
        spread.normal_x = mesh_normal_change(plan, hit, surface, spread.position_x);
        spread.normal_y = mesh_normal_change(plan, hit, surface, spread.position_y);
    } else {
        struct implicit at = implicit_at(plan, hit, surface->position);
        spread.normal_x = normal_change(&at, surface->normal, spread.position_x);
        spread.normal_y = normal_change(&at, surface->normal, spread.position_y);
    }
    return spread;
}

/* --- colour ----------------------------------------------------------------------------------------------- */

static void mesh_texture_point(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                               struct texture_point *point)
{
    const struct primitive *primitive = &plan->primitives[hit->id];
    const struct plan_mesh *mesh = mesh_of(plan, primitive);
    if (!mesh->uv)
        return;
    const uint32_t *corner = mesh_corners(plan, hit->id);
    struct vec3 by_x = mesh_weights_change(plan, primitive, point->position_x);
    struct vec3 by_y = mesh_weights_change(plan, primitive, point->position_y);
    const double change_x[3] = {by_x.x, by_x.y, by_x.z}, change_y[3] = {by_y.x, by_y.y, by_y.z};
    for (int c = 0; c < 2; c++)
        for (int i = 0; i < 3; i++) {
            double value = mesh->uv[2 * (size_t)corner[i] + (size_t)c];
            point->uv[c] += surface->weights[i] * value;
            point->uv_x[c] += change_x[i] * value;
            point->uv_y[c] += change_y[i] * value;
        }
}

/* The object coordinate that is constant on this piece of the primitive, or −1. */
static int8_t flat_axis(const struct primitive *primitive, uint8_t part)
{
    if (primitive->kind == PRIMITIVE_BOX)
        return (int8_t)(part / 2);
    if (primitive->kind == PRIMITIVE_FRUSTUM && part == PART_SIDE)
        return -1;
    return primitive->flat_axis;
}

struct vec3 surface_color(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                          const struct surface_footprint *spread)
{
    const struct primitive *primitive = &plan->primitives[hit->id];
    const struct plan_texture *texture = &plan->textures[plan->objects[primitive->object].texture];
    if (texture->kind == TEXTURE_CONSTANT)
        return texture->color[0];
    struct texture_point point = {
        .position = surface->position,
        .flat_axis = flat_axis(primitive, hit->part),
        .box_face = primitive->kind == PRIMITIVE_BOX ? (int8_t)hit->part : -1,
    };
    if (spread) {
        point.position_x = spread->position_x;
        point.position_y = spread->position_y;
    }
    if (primitive->kind == PRIMITIVE_TRIANGLE)
        mesh_texture_point(plan, hit, surface, &point);
    return texture_color(plan, texture, &point);
}
