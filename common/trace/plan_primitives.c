#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "math/twofold.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

/* A transform prepared for placing shapes. scale is that of a similarity, or 0. */
struct placement {
    struct affine world;
    struct vec3 eye;
    double scale;
};

static struct vec3 place(const struct placement *at, struct vec3 point)
{
    return affine_point_relative(&at->world, point, at->eye);
}

/* A normal's image: the inverse transposed times n, as the cofactors' product, normalised and on the same side. */
static struct vec3 place_normal(const struct placement *at, struct vec3 normal)
{
    struct mat3 inverse = mat3_inverse(&at->world.linear);
    return vec3_normalize(mat3_apply_transposed(&inverse, normal));
}

/* From offsets in the world to coordinates along the orthonormal axes x, y, z of the shape; *unit is how long a
 * unit of those is in the frame. Under a similarity the frame keeps world lengths, so its rows are exact unit
 * vectors where the axes are the coordinate axes. */
static struct mat3 place_frame(const struct placement *at, struct vec3 x, struct vec3 y, struct vec3 z, double *unit)
{
    struct mat3 axes = {x, y, z};
    if (at->scale > 0) {
        struct mat3 turned = mat3_transpose(&at->world.linear);
        struct mat3 frame = mat3_multiply(&axes, &turned);
        *unit = at->scale;
        return (struct mat3){vec3_scale(frame.x, 1 / at->scale), vec3_scale(frame.y, 1 / at->scale),
                             vec3_scale(frame.z, 1 / at->scale)};
    }
    struct mat3 inverse = mat3_inverse(&at->world.linear);
    *unit = 1;
    return mat3_multiply(&axes, &inverse);
}

/* 0..2 if the vector is along that coordinate axis, else −1. */
static int8_t axis_of(struct vec3 v)
{
    if (v.y == 0 && v.z == 0)
        return 0;
    if (v.x == 0 && v.z == 0)
        return 1;
    return v.x == 0 && v.y == 0 ? 2 : -1;
}

/* The longest that the transform makes a vector of length 1, bounded from above (Frobenius norm). */
static double stretch(const struct placement *at)
{
    const struct mat3 *m = &at->world.linear;
    return sqrt(vec3_dot(m->x, m->x) + vec3_dot(m->y, m->y) + vec3_dot(m->z, m->z));
}

static void add_primitive(struct plan *plan, uint32_t object, enum primitive_kind kind, int8_t flat_axis)
{
    const struct plan_material *material = &plan->materials[plan->objects[object].material];
    plan->primitives[plan->primitive_count++] = (struct primitive){
        .kind = (uint8_t)kind,
        .blocks_light = !(material->traits & TRAIT_TRANSMITS),
        .flat_axis = flat_axis,
        .traits = material->traits,
        .index = (uint32_t)plan->count[kind]++,
        .object = object,
        .id = (uint32_t)plan->id_count++,
    };
}

/* The power of the eye with respect to a sphere, from the scene's numbers as they are: much of it cancels. */
static double power_of_eye(const struct placement *at, struct vec3 center, double radius)
{
    const struct mat3 *m = &at->world.linear;
    const struct vec3 rows[3] = {m->x, m->y, m->z};
    const double offset[3] = {at->world.offset.x, at->world.offset.y, at->world.offset.z};
    const double eye[3] = {at->eye.x, at->eye.y, at->eye.z};
    struct twofold sum = twofold_product(-radius, radius);
    for (int axis = 0; axis < 3; axis++) {
        struct twofold c = twofold_add(twofold_sum(offset[axis], -eye[axis]), twofold_product(rows[axis].x, center.x));
        c = twofold_add(c, twofold_product(rows[axis].y, center.y));
        c = twofold_add(c, twofold_product(rows[axis].z, center.z));
        sum = twofold_add(sum, twofold_product(c.high, c.high));
        sum = twofold_add(sum, twofold_product(2 * c.high, c.low));
    }
    return sum.high + sum.low;
}

/* A sphere's roots are good to 2^-53 of its radius, points on a surface to about 8 DBL_EPSILON = 2^-49 of their
 * distance. So where the surface is nearer to the eye than this share of the radius, it is the radius that would spoil
 * them. */
static const double globe_share = 0x1p-4;

static void add_round_sphere(struct plan *plan, uint32_t object, struct vec3 local, double radius,
                             const struct placement *at)
{
    struct sphere sphere = {place(at, local), radius};
    if (!(fabs(vec3_length(sphere.center) - radius) < globe_share * radius)) {
        plan->spheres[plan->count[PRIMITIVE_SPHERE]] = sphere;
        add_primitive(plan, object, PRIMITIVE_SPHERE, -1);
        return;
    }
    plan->globes[plan->count[PRIMITIVE_GLOBE]] = (struct globe){sphere, power_of_eye(at, local, radius)};
    add_primitive(plan, object, PRIMITIVE_GLOBE, -1);
}

static void add_sphere(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    double radius = shape->sphere.radius;
    plan->objects[object].extent = stretch(at) * radius;
    if (at->scale > 0) {
        add_round_sphere(plan, object, shape->sphere.center, at->scale * radius, at);
        return;
    }
    struct mat3 inverse = mat3_inverse(&at->world.linear);
    struct mat3 frame = {vec3_scale(inverse.x, 1 / radius), vec3_scale(inverse.y, 1 / radius),
                         vec3_scale(inverse.z, 1 / radius)};
    plan->ellipsoids[plan->count[PRIMITIVE_ELLIPSOID]] = (struct ellipsoid){frame, place(at, shape->sphere.center)};
    add_primitive(plan, object, PRIMITIVE_ELLIPSOID, -1);
}

static void add_plane(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    struct vec3 normal = place_normal(at, shape->plane.normal);
    double offset = vec3_dot(normal, place(at, shape->plane.point));
    plan->planes[plan->count[PRIMITIVE_PLANE]] = (struct plane){normal, offset};
    add_primitive(plan, object, PRIMITIVE_PLANE, axis_of(shape->plane.normal));
}

static void add_disc(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    struct vec3 x, y, center = place(at, shape->disc.center);
    double unit;
    vec3_frame(shape->disc.normal, &x, &y);
    struct mat3 frame = place_frame(at, x, y, shape->disc.normal, &unit);
    double radius = shape->disc.radius * unit;
    struct vec3 normal = place_normal(at, shape->disc.normal);
    plan->objects[object].extent = stretch(at) * shape->disc.radius;
    plan->discs[plan->count[PRIMITIVE_DISC]] = (struct disc){
        .plane = {normal, vec3_dot(normal, center)},
        .center = center,
        .u = vec3_scale(frame.x, 1 / radius),
        .v = vec3_scale(frame.y, 1 / radius),
    };
    add_primitive(plan, object, PRIMITIVE_DISC, axis_of(shape->disc.normal));
}

static void add_frustum(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    bool top_is_narrow = shape->frustum.top_radius < shape->frustum.base_radius;
    struct vec3 narrow = top_is_narrow ? shape->frustum.top : shape->frustum.base;
    struct vec3 wide = top_is_narrow ? shape->frustum.base : shape->frustum.top;
    double narrow_radius = top_is_narrow ? shape->frustum.top_radius : shape->frustum.base_radius;
    double wide_radius = top_is_narrow ? shape->frustum.base_radius : shape->frustum.top_radius;
    double length = vec3_length(vec3_sub(wide, narrow)), unit;
    struct vec3 z = vec3_normalize(vec3_sub(wide, narrow)), x, y;
    vec3_frame(z, &x, &y);
    struct mat3 frame = place_frame(at, x, y, z, &unit);
    plan->objects[object].extent = stretch(at) * (length + wide_radius);
    plan->frustums[plan->count[PRIMITIVE_FRUSTUM]] =
        frustum_make(frame, place(at, narrow), place(at, wide), narrow_radius * unit,
                     (wide_radius - narrow_radius) / length, length * unit, shape->frustum.open);
    add_primitive(plan, object, PRIMITIVE_FRUSTUM, axis_of(z));
}

/* What makes a row of a frame a unit vector: a similarity's is one as it is. */
static double unit_row(const struct placement *at, struct vec3 row)
{
    return at->scale > 0 ? 1 : 1 / vec3_length(row);
}

static void add_box(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    double unit;
    struct mat3 frame = place_frame(at, vec3_make(1, 0, 0), vec3_make(0, 1, 0), vec3_make(0, 0, 1), &unit);
    struct vec3 rows = {unit_row(at, frame.x), unit_row(at, frame.y), unit_row(at, frame.z)};
    struct vec3 eye = mat3_apply(&frame, vec3_sub(at->eye, at->world.offset));
    plan->objects[object].extent = stretch(at) * vec3_length(vec3_sub(shape->box.max, shape->box.min));
    plan->boxes[plan->count[PRIMITIVE_BOX]] = (struct box){
        .frame = {vec3_scale(frame.x, rows.x), vec3_scale(frame.y, rows.y), vec3_scale(frame.z, rows.z)},
        .low = vec3_mul(vec3_sub(vec3_scale(shape->box.min, unit), eye), rows),
        .high = vec3_mul(vec3_sub(vec3_scale(shape->box.max, unit), eye), rows),
    };
    add_primitive(plan, object, PRIMITIVE_BOX, -1);
}

static void add_mesh_normals(struct plan_mesh *to, const struct mesh *from, const struct placement *at)
{
    if (!from->normals)
        return;
    to->normals = memory_array(from->vertex_count, sizeof *to->normals);
    for (size_t i = 0; i < from->vertex_count; i++)
        to->normals[i] = place_normal(at, from->normals[i]);
}

static struct plan_mesh *add_plan_mesh(struct plan *plan, uint32_t object, const struct mesh *mesh,
                                       const struct placement *at)
{
    struct plan_mesh *to = &plan->meshes[plan->mesh_count];
    plan->objects[object].mesh = (uint32_t)plan->mesh_count++;
    *to = (struct plan_mesh){.smooth = mesh->normals != NULL, .uv = mesh->uv, .index = mesh->index,
                             .mirrored = mat3_determinant(&at->world.linear) < 0};
    plan->is_smooth |= to->smooth;
    return to;
}

static void add_mesh(struct plan *plan, uint32_t object, const struct shape *shape, const struct placement *at)
{
    const struct mesh *mesh = &shape->mesh;
    struct plan_mesh *to = add_plan_mesh(plan, object, mesh, at);
    add_mesh_normals(to, mesh, at);
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *v = &mesh->index[3 * i];
        struct vec3 a = mesh->points[v[0]], b = mesh->points[v[1]], c = mesh->points[v[2]];
        plan->triangles[plan->count[PRIMITIVE_TRIANGLE]] =
            triangle_make(place(at, a), place(at, to->mirrored ? c : b), place(at, to->mirrored ? b : c));
        add_primitive(plan, object, PRIMITIVE_TRIANGLE, mesh_flat_axis(mesh, i));
    }
}

static void add_instance(struct plan *plan, uint32_t object, const struct shared_mesh *mesh,
                         const struct placement *at)
{
    struct instance *instance = &plan->instances[plan->count[PRIMITIVE_INSTANCE]];
    add_plan_mesh(plan, object, mesh->mesh, at);
    *instance = instance_make(mesh, &at->world, at->eye);
    instance->first_id = (uint32_t)plan->id_count;
    if (plan->count[PRIMITIVE_INSTANCE] == 0)
        plan->first_instance_id = instance->first_id;
    instance->object = object;
    instance->blocks_light = !(plan->materials[plan->objects[object].material].traits & TRAIT_TRANSMITS);
    plan->instance_ids[plan->count[PRIMITIVE_INSTANCE]] = (struct instance_ids){
        instance->first_id, instance->first_id + (uint32_t)mesh->mesh->triangle_count, (uint32_t)plan->primitive_count};
    add_primitive(plan, object, PRIMITIVE_INSTANCE, -1);
    plan->id_count += mesh->mesh->triangle_count - 1;
}

static bool is_instance(uint32_t shared)
{
    return shared < MESH_COPIED;
}

static void allocate(struct plan *plan, const struct scene *scene, const uint32_t *shared)
{
    size_t shapes[SHAPE_KINDS] = {0}, triangles = 0, instances = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        shapes[scene->objects[i].shape.kind]++;
        if (is_instance(shared[i]))
            instances++;
        else if (scene->objects[i].shape.kind == SHAPE_MESH)
            triangles += scene->objects[i].shape.mesh.triangle_count;
    }
    plan->instances = memory_array(instances, sizeof *plan->instances);
    plan->instance_ids = memory_array(instances, sizeof *plan->instance_ids);
    plan->primitives = memory_array(scene->object_count + triangles, sizeof *plan->primitives);
    plan->spheres = memory_array(shapes[SHAPE_SPHERE], sizeof *plan->spheres);
    plan->globes = memory_array(shapes[SHAPE_SPHERE], sizeof *plan->globes);
    plan->ellipsoids = memory_array(shapes[SHAPE_SPHERE], sizeof *plan->ellipsoids);
    plan->planes = memory_array(shapes[SHAPE_PLANE], sizeof *plan->planes);
    plan->discs = memory_array(shapes[SHAPE_DISC], sizeof *plan->discs);
    plan->frustums = memory_array(shapes[SHAPE_FRUSTUM], sizeof *plan->frustums);
    plan->boxes = memory_array(shapes[SHAPE_BOX], sizeof *plan->boxes);
    plan->triangles = memory_array(triangles, sizeof *plan->triangles);
    plan->meshes = memory_array(shapes[SHAPE_MESH], sizeof *plan->meshes);
    plan->objects = memory_array(scene->object_count, sizeof *plan->objects);
    plan->object_count = scene->object_count;
}

void plan_primitives_build(struct plan *plan, const struct scene *scene, uint32_t *shared)
{
    static void (*const add[SHAPE_KINDS])(struct plan *, uint32_t, const struct shape *, const struct placement *) = {
        [SHAPE_SPHERE] = add_sphere, [SHAPE_PLANE] = add_plane, [SHAPE_DISC] = add_disc,
        [SHAPE_FRUSTUM] = add_frustum, [SHAPE_BOX] = add_box, [SHAPE_MESH] = add_mesh,
    };
    allocate(plan, scene, shared);
    plan->first_instance_id = UINT32_MAX;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct object *from = &scene->objects[i];
        struct placement at = {from->transform, plan->eye, affine_similarity(&from->transform)};
        bool lets_light_through = plan->materials[from->material].traits & TRAIT_TRANSMITS;
        plan->objects[i] = (struct plan_object){.material = (uint32_t)from->material, .mesh = UINT32_MAX,
                                                .shares_mesh = shared[i] != MESH_NONE,
                                                .first_primitive = (uint32_t)plan->primitive_count,
                                                .leave_share = lets_light_through ? COINCIDENCE : 0};
        if (is_instance(shared[i]))
            add_instance(plan, (uint32_t)i, &plan->shared_meshes[shared[i]], &at);
        else
            add[from->shape.kind](plan, (uint32_t)i, &from->shape, &at);
    }
    free(shared);
    plan_weld(plan, scene);
}
