#include "trace/surface.h"

#include "trace/instance.h"
#include "trace/texture_maps.h"

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

/* A triangle as it is in the plan, or, of an instance, placed in *room: copying all would be felt. */
static const struct triangle *triangle_at(const struct plan *plan, uint32_t id, struct triangle *room)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    if (primitive->kind == PRIMITIVE_TRIANGLE)
        return &plan->triangles[primitive->index];
    *room = plan_triangle(plan, id);
    return room;
}

static const uint32_t *mesh_corners(const struct plan *plan, uint32_t id)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    uint32_t first = plan->primitives[plan->objects[primitive->object].first_primitive].id;
    return &mesh_of(plan, primitive)->index[3 * (size_t)(id - first)];
}

/* Of the plan's corners a, b, c as weights of the mesh's, and the other way round. */
static struct vec3 mesh_weights(const struct plan_mesh *mesh, struct vec3 w)
{
    return mesh->mirrored ? vec3_make(w.x, w.z, w.y) : w;
}

static struct corner_normals mesh_normals(const struct plan *plan, const struct plan_mesh *mesh, uint32_t id)
{
    const uint32_t *corner = mesh_corners(plan, id);
    const struct primitive *primitive = plan_primitive(plan, id);
    if (primitive->kind == PRIMITIVE_INSTANCE) {
        const struct instance *instance = &plan->instances[primitive->index];
        return (struct corner_normals){instance_normal(instance, corner[0]), instance_normal(instance, corner[1]),
                                       instance_normal(instance, corner[2])};
    }
    return (struct corner_normals){mesh->normals[corner[0]], mesh->normals[corner[1]], mesh->normals[corner[2]]};
}

/* --- points and normals ----------------------------------------------------------------------------------- */

static struct surface_point point_on_instance(const struct plan *plan, uint32_t id, struct vec3 near)
{
    struct triangle triangle = plan_triangle(plan, id);
    return triangle_surface(&triangle, near);
}

static struct surface_point point_on(const struct plan *plan, const struct hit *hit, struct vec3 near)
{
    const struct primitive *primitive = plan_primitive(plan, hit->id);
    double extent = plan->objects[primitive->object].extent;
    uint32_t index = primitive->index;
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
        return sphere_surface(&plan->spheres[index], near, extent);
    case PRIMITIVE_GLOBE:
        return globe_surface(&plan->globes[index], near, extent);
    case PRIMITIVE_ELLIPSOID:
        return ellipsoid_surface(&plan->ellipsoids[index], near, extent);
    case PRIMITIVE_FRUSTUM:
        return frustum_surface(&plan->frustums[index], near, hit->part, extent);
    case PRIMITIVE_BOX:
        return box_surface(&plan->boxes[index], near, hit->part, extent);
    case PRIMITIVE_TRIANGLE:
        return triangle_surface(&plan->triangles[index], near);
    case PRIMITIVE_INSTANCE:
        return point_on_instance(plan, hit->id, near);
    case PRIMITIVE_DISC:
        return plane_surface(&plan->discs[index].plane, near, extent);
    default:
        return plane_surface(&plan->planes[index], near, extent);
    }
}

void surface_add_mesh(const struct plan *plan, uint32_t id, const struct ray *ray, struct surface *surface)
{
    const struct plan_mesh *mesh = mesh_of(plan, plan_primitive(plan, id));
    struct shear shear = shear_of(ray->direction);
    struct triangle room;
    surface->weights = mesh_weights(mesh, triangle_weights(triangle_at(plan, id, &room), ray->origin, &shear));
    if (!mesh->smooth)
        return;
    struct corner_normals normals = mesh_normals(plan, mesh, id);
    surface->shading_normal = normals_blend(&normals, surface->weights, surface->normal);
}

struct surface_point surface_point_at(const struct plan *plan, const struct ray *ray, const struct hit *hit)
{
    double leave_share = primitive_leave_share(plan_primitive(plan, hit->id));
    return point_on(plan, hit, surface_near(ray->origin, ray->direction, hit->t, hit->side, leave_share));
}

struct surface surface_at(const struct plan *plan, const struct ray *ray, const struct hit *hit)
{
    struct surface_point on = surface_point_at(plan, ray, hit);
    struct surface surface = {
        .position = on.position, .error = on.error, .normal = on.normal, .shading_normal = on.normal};
    if (primitive_is_of_mesh(plan_primitive(plan, hit->id)))
        surface_add_mesh(plan, hit->id, ray, &surface);
    return surface;
}

/* --- footprints ------------------------------------------------------------------------------------------- */

static struct vec3 mesh_weights_change(const struct plan *plan, uint32_t id, struct vec3 step)
{
    struct triangle room;
    struct vec3 change = triangle_weights_change(triangle_at(plan, id, &room), step);
    return mesh_weights(mesh_of(plan, plan_primitive(plan, id)), change);
}

static struct vec3 mesh_normal_change(const struct plan *plan, uint32_t id, const struct surface *surface,
                                      struct vec3 step)
{
    const struct plan_mesh *mesh = mesh_of(plan, plan_primitive(plan, id));
    if (!mesh->smooth)
        return vec3_make(0, 0, 0);
    struct corner_normals normals = mesh_normals(plan, mesh, id);
    return normals_blend_change(&normals, surface->weights, surface->shading_normal,
                                mesh_weights_change(plan, id, step));
}

/* The change of the shading normal for a step along the surface. */
static struct vec3 normal_change(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                                 struct vec3 step)
{
    const struct primitive *primitive = plan_primitive(plan, hit->id);
    uint32_t index = primitive->index;
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
        return sphere_normal_change(&plan->spheres[index], surface->position, surface->normal, step);
    case PRIMITIVE_GLOBE:
        return sphere_normal_change(&plan->globes[index].sphere, surface->position, surface->normal, step);
    case PRIMITIVE_ELLIPSOID:
        return ellipsoid_normal_change(&plan->ellipsoids[index], surface->position, surface->normal, step);
    case PRIMITIVE_FRUSTUM:
        return frustum_normal_change(&plan->frustums[index], surface->position, hit->part, surface->normal, step);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_INSTANCE:
        return mesh_normal_change(plan, hit->id, surface, step);
    default:
        return vec3_make(0, 0, 0);
    }
}

struct surface_footprint surface_footprint_at(const struct plan *plan, const struct ray *ray,
                                              const struct footprint *footprint, const struct hit *hit,
                                              const struct surface *surface)
{
    struct vec3 d = ray->direction, n = surface->normal;
    struct vec3 x = surface_transfer(d, hit->t, n, footprint->origin_x, footprint->direction_x);
    struct vec3 y = surface_transfer(d, hit->t, n, footprint->origin_y, footprint->direction_y);
    return (struct surface_footprint){
        .middle = vec3_add_scaled(vec3_add_scaled(surface->position, x, footprint->shift_x), y, footprint->shift_y),
        .position_x = x,
        .position_y = y,
        .normal_x = normal_change(plan, hit, surface, x),
        .normal_y = normal_change(plan, hit, surface, y),
    };
}

/* --- colour ----------------------------------------------------------------------------------------------- */

static void mesh_texture_point(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                               struct texture_point *point)
{
    const struct plan_mesh *mesh = mesh_of(plan, plan_primitive(plan, hit->id));
    if (!mesh->uv)
        return;
    const uint32_t *corner = mesh_corners(plan, hit->id);
    const double *a = &mesh->uv[2 * (size_t)corner[0]], *b = &mesh->uv[2 * (size_t)corner[1]];
    const double *c = &mesh->uv[2 * (size_t)corner[2]];
    struct corner_uv corners = {{a[0], b[0], c[0]}, {a[1], b[1], c[1]}};
    struct vec3 shift = mesh_weights_change(plan, hit->id, vec3_sub(point->position, surface->position));
    struct texture_area weights = {vec3_add(surface->weights, shift),
                                   mesh_weights_change(plan, hit->id, point->position_x),
                                   mesh_weights_change(plan, hit->id, point->position_y)};
    point->mesh = map_mesh(&corners, &weights);
}

int8_t surface_flat_axis(const struct plan *plan, uint32_t id, uint8_t part)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    if (primitive->kind == PRIMITIVE_INSTANCE)
        return mesh_flat_axis(plan->instances[primitive->index].mesh->mesh, id - primitive->id);
    if (primitive->kind == PRIMITIVE_BOX)
        return (int8_t)(part / 2);
    if (primitive->kind == PRIMITIVE_FRUSTUM && part == PART_SIDE)
        return -1;
    return primitive->flat_axis;
}

struct vec3 surface_color(const struct plan *plan, const struct hit *hit, const struct surface *surface,
                          const struct surface_footprint *spread)
{
    const struct primitive *primitive = plan_primitive(plan, hit->id);
    const struct plan_texture *texture = &plan->textures[plan->objects[primitive->object].texture];
    if (texture->kind == TEXTURE_CONSTANT)
        return texture->color[0];
    struct texture_point point = {
        .position = surface->position,
        .flat_axis = surface_flat_axis(plan, hit->id, hit->part),
        .box_face = primitive->kind == PRIMITIVE_BOX ? (int8_t)hit->part : -1,
    };
    if (spread) {
        point.position = spread->middle;
        point.position_x = spread->position_x;
        point.position_y = spread->position_y;
    }
    if (primitive_is_of_mesh(primitive))
        mesh_texture_point(plan, hit, surface, &point);
    return texture_color(plan, texture, &point);
}
