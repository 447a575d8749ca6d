#include "trace/plan.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "math/elementary.h"
#include "trace/instance.h"
#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"
#include "trace/plan_parts.h"

static void build_camera(struct plan *plan, const struct camera *camera)
{
    struct vec3 forward = vec3_normalize(vec3_sub(camera->at, camera->from));
    struct vec3 right = vec3_normalize(vec3_cross(forward, vec3_normalize(camera->up)));
    struct vec3 up = vec3_cross(right, forward);
    double half = camera->fov_degrees / 2;
    double height = 2 * math_sin_degrees(half) / math_cos_degrees(half);
    double step = height / plan->settings.height; /* per pixel, on the plane at distance 1 */
    plan->eye = camera->from;
    plan->camera.right = vec3_scale(right, step);
    plan->camera.down = vec3_scale(up, -step);
    struct vec3 corner = vec3_add_scaled(forward, plan->camera.right, -0.5 * plan->settings.width);
    plan->camera.corner = vec3_add_scaled(corner, plan->camera.down, -0.5 * plan->settings.height);
}

/* A pattern whose colours are equal is none. */
static bool is_constant(const struct texture *texture)
{
    return texture->kind == TEXTURE_CONSTANT ||
           (texture->kind != TEXTURE_IMAGE && vec3_is_zero(vec3_sub(texture->color[0], texture->color[1])));
}

static struct plan_material compile_material(const struct material *from)
{
    struct plan_material to = {
        .ambient = from->ambient,
        .diffuse = from->diffuse,
        .shininess = from->shininess,
        .transparency = from->transparency,
        .ior = from->ior,
        .specular = from->specular,
        .reflection = from->reflection,
        .filter = from->filter,
        .absorption = from->absorption,
        .dielectric = from->ior > 0,
        .absorbs = from->ior > 0 && !vec3_is_zero(from->absorption),
    };
    bool mirrors = !vec3_is_zero(from->reflection);
    bool transmits = to.dielectric || (from->transparency > 0 && !vec3_is_zero(from->filter));
    to.traits = (mirrors ? TRAIT_MIRRORS : 0) | (transmits ? TRAIT_TRANSMITS : 0) |
                (to.dielectric ? TRAIT_REFRACTS : 0) | (is_constant(&from->color) ? 0 : TRAIT_TEXTURED) |
                (vec3_is_zero(from->specular) ? 0 : TRAIT_HIGHLIGHTS);
    if (!to.dielectric)
        to.surface_share = vec3_sub(vec3_make(1 - from->transparency, 1 - from->transparency, 1 - from->transparency),
                                    from->reflection);
    return to;
}

static void build_materials(struct plan *plan, const struct scene *scene)
{
    plan->material_count = scene->material_count;
    plan->materials = memory_array(scene->material_count, sizeof *plan->materials);
    for (size_t i = 0; i < scene->material_count; i++) {
        plan->materials[i] = compile_material(&scene->materials[i]);
        plan->absorbs |= plan->materials[i].absorbs;
    }
}

/* Objects share the texture of a material as long as it does not depend on where they are. */
static void build_textures(struct plan *plan, const struct scene *scene)
{
    plan->textures = memory_array(scene->material_count + scene->object_count, sizeof *plan->textures);
    plan->texture_count = scene->material_count;
    for (size_t i = 0; i < scene->material_count; i++) {
        plan->textures[i].kind = TEXTURE_CONSTANT;
        plan->textures[i].color[0] = scene->materials[i].color.color[0];
    }
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct object *object = &scene->objects[i];
        const struct texture *texture = &scene->materials[object->material].color;
        plan->objects[i].texture = (uint32_t)object->material;
        if (is_constant(texture))
            continue;
        plan->objects[i].texture = (uint32_t)plan->texture_count;
        plan->textures[plan->texture_count++] = plan_texture_compile(texture, object, plan->eye);
    }
    plan->needs_footprints =
        plan->texture_count > scene->material_count || scene->background.kind == BACKGROUND_IMAGE;
}

/* For several threads: one of the plan's images. */
struct image_builds {
    struct plan *plan;
    const struct scene *scene;
    bool *worn; /* by anything that can be seen */
};

static void build_image(void *context, size_t index)
{
    const struct image_builds *builds = context;
    if (builds->worn[index])
        plan_image_build(&builds->plan->images[index], &builds->scene->images[index].image);
}

static void build_images(struct plan *plan, const struct scene *scene, int threads)
{
    struct image_builds builds = {plan, scene, memory_array(scene->image_count, sizeof *builds.worn)};
    for (size_t i = scene->material_count; i < plan->texture_count; i++)
        for (int face = 0; plan->textures[i].kind == TEXTURE_IMAGE && face < BOX_FACES; face++)
            builds.worn[plan->textures[i].image[face]] = true;
    if (scene->background.kind == BACKGROUND_IMAGE)
        builds.worn[scene->background.image] = true;
    plan->image_count = scene->image_count;
    plan->images = memory_array(scene->image_count, sizeof *plan->images);
    parallel_for(threads, scene->image_count, build_image, &builds);
    free(builds.worn);
}

struct camera_medium {
    double leave;
    uint32_t object;
};

/* Farther walls first; equal ones in the order of the scene. */
static int compare_camera_media(const void *left, const void *right)
{
    const struct camera_medium *a = left, *b = right;
    if (a->leave != b->leave)
        return a->leave > b->leave ? -1 : 1;
    return a->object < b->object ? -1 : a->object > b->object;
}

/* False for an instance, whose triangles may be many, that the camera is not even near. */
static bool may_hold_camera(const struct plan *plan, uint32_t object)
{
    const struct bounds eye = {{0, 0, 0}, {0, 0, 0}};
    const struct primitive *primitive = &plan->primitives[plan->objects[object].first_primitive];
    if (primitive->kind != PRIMITIVE_INSTANCE)
        return true;
    struct bounds box = bounds_grown(plan->instances[primitive->index].bounds, COINCIDENCE);
    return bounds_overlap(&box, &eye);
}

size_t plan_end_id(const struct plan *plan, size_t object)
{
    size_t next = object + 1 < plan->object_count ? plan->objects[object + 1].first_primitive : plan->primitive_count;
    return next < plan->primitive_count ? plan->primitives[next].id : plan->id_count;
}

/* Whether a ray from the camera along `direction` starts inside the object, and how far its wall is: it leaves the
 * object once more than it enters. */
static bool camera_is_inside(const struct plan *plan, uint32_t object, struct vec3 direction, double *wall)
{
    struct shear shear = shear_of(direction);
    size_t end = plan_end_id(plan, object);
    int leaves = 0;
    *wall = INFINITY;
    for (size_t id = plan->primitives[plan->objects[object].first_primitive].id; id < end; id++) {
        struct roots roots = plan_roots(plan, (uint32_t)id, vec3_make(0, 0, 0), direction, &shear);
        if (roots.enter > roots.leave)
            continue;
        if (roots.enter > 0 && roots.enter < INFINITY)
            leaves--;
        if (roots.leave > 0 && roots.leave < INFINITY) {
            leaves++;
            *wall = roots.leave < *wall ? roots.leave : *wall;
        }
    }
    return leaves > 0;
}

static void find_camera_media(struct plan *plan)
{
    struct vec3 forward = vec3_normalize(vec3_add(vec3_add(plan->camera.corner,
                                                           vec3_scale(plan->camera.right, 0.5 * plan->settings.width)),
                                                  vec3_scale(plan->camera.down, 0.5 * plan->settings.height)));
    struct camera_medium *found = memory_array(plan->object_count, sizeof *found);
    size_t count = 0;
    for (uint32_t i = 0; i < plan->object_count; i++) {
        double wall;
        if (plan->materials[plan->objects[i].material].dielectric && may_hold_camera(plan, i) &&
            camera_is_inside(plan, i, forward, &wall))
            found[count++] = (struct camera_medium){wall, i};
    }
    qsort(found, count, sizeof *found, compare_camera_media);
    plan->camera_media = memory_array(count, sizeof *plan->camera_media);
    plan->camera_media_count = count;
    for (size_t i = 0; i < count; i++)
        plan->camera_media[i] = found[i].object;
    free(found);
}

/* A mesh's wearers become instances if they have so many triangles together, of which copies take 80 MB. Fewer are
 * copied, as rays find their way among copies up to a third faster (measured). */
enum { SHARED_TRIANGLES_MIN = 1 << 19 };

/* For fewer, a scan costs about as much as a walk through a tree. (Measured with AVX-512 and each kind of shape: with 4
 * of them the tree takes 0.3 to 0.8 of the scan's time for coherent rays, 0.6 to 1.1 for shadow rays, 1 to 1.6 for
 * random ones; with 8, 0.2 to 0.6, 0.5 to 1 and 0.7 to 1.1. Whole scenes of 5 to 7 objects take 10 % less to 15 %
 * more.) */
enum { TREE_PRIMITIVES_MIN = 8 };

static void build_tree(struct plan *plan, int threads)
{
    if (plan->primitive_count < TREE_PRIMITIVES_MIN) {
        plan_order(plan, NULL, plan->primitive_count);
        return;
    }
    size_t count;
    uint32_t *order = bvh_build(&plan->bvh, plan, threads, &count);
    plan_order(plan, order, count);
    free(order);
}

struct plan *plan_create_sharing(const struct scene *scene, const struct trace_settings *settings, int threads,
                                 size_t least)
{
    struct plan *plan = memory_array(1, sizeof *plan);
    plan->settings = *settings;
    plan->depth = scene->depth;
    plan->background = scene->background;
    plan->ambient = scene->ambient;
    build_camera(plan, &scene->camera);
    build_materials(plan, scene);
    plan_primitives_build(plan, scene, plan_share_meshes(plan, scene, least, threads));
    build_tree(plan, threads);
    plan_lights_build(plan, scene);
    build_textures(plan, scene);
    build_images(plan, scene, threads);
    find_camera_media(plan);
    plan_contacts_find(plan);
    return plan;
}

struct plan *plan_create(const struct scene *scene, const struct trace_settings *settings, int threads)
{
    return plan_create_sharing(scene, settings, threads, SHARED_TRIANGLES_MIN);
}

void plan_destroy(struct plan **plan_pointer)
{
    struct plan *plan = *plan_pointer;
    if (!plan)
        return;
    for (size_t i = 0; i < plan->mesh_count; i++)
        free(plan->meshes[i].normals);
    for (size_t i = 0; i < plan->image_count; i++)
        plan_image_finish(&plan->images[i]);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        free(plan->ids[kind]);
    for (size_t i = 0; i < plan->shared_mesh_count; i++)
        shared_mesh_finish(&plan->shared_meshes[i]);
    bvh_finish(&plan->bvh);
    void *const arrays[] = {plan->primitives,   plan->spheres,       plan->globes,   plan->ellipsoids,
                            plan->planes,       plan->discs,         plan->frustums, plan->boxes,
                            plan->triangles,    plan->instances,     plan->instance_ids, plan->shared_meshes,
                            plan->welded,       plan->objects,       plan->meshes,   plan->materials,
                            plan->textures,     plan->images,        plan->lights,   plan->camera_media,
                            plan->contacts};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free(arrays[i]);
    free(plan);
    *plan_pointer = NULL;
}

enum wall plan_wall(const struct plan *plan, uint32_t id)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
    case PRIMITIVE_GLOBE:
    case PRIMITIVE_ELLIPSOID:
    case PRIMITIVE_BOX:
        return WALL_SOLID;
    case PRIMITIVE_FRUSTUM:
        return plan->frustums[primitive->index].open ? WALL_OPEN : WALL_SOLID;
    default:
        return WALL_NONE;
    }
}

struct triangle plan_triangle(const struct plan *plan, uint32_t id)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    if (primitive->kind == PRIMITIVE_TRIANGLE)
        return plan->triangles[primitive->index];
    const struct instance *instance = &plan->instances[primitive->index];
    struct triangle triangle = instance_corners(instance, id - primitive->id);
    instance_set_plane(instance, id - primitive->id, &triangle);
    return triangle;
}

static struct roots instance_roots(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction,
                                   const struct shear *shear)
{
    struct triangle triangle = plan_triangle(plan, id);
    return triangle_roots(&triangle, origin, direction, shear);
}

static struct roots primitive_roots(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction,
                                    const struct shear *shear)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
        return sphere_roots(&plan->spheres[primitive->index], origin, direction);
    case PRIMITIVE_GLOBE:
        return globe_roots(&plan->globes[primitive->index], origin, direction);
    case PRIMITIVE_ELLIPSOID:
        return ellipsoid_roots(&plan->ellipsoids[primitive->index], origin, direction);
    case PRIMITIVE_PLANE:
        return plane_roots(&plan->planes[primitive->index], origin, direction);
    case PRIMITIVE_DISC:
        return disc_roots(&plan->discs[primitive->index], origin, direction);
    case PRIMITIVE_FRUSTUM:
        return frustum_roots(&plan->frustums[primitive->index], origin, direction);
    case PRIMITIVE_BOX:
        return box_roots(&plan->boxes[primitive->index], origin, direction);
    case PRIMITIVE_TRIANGLE:
        return triangle_roots(&plan->triangles[primitive->index], origin, direction, shear);
    case PRIMITIVE_INSTANCE:
        return instance_roots(plan, id, origin, direction, shear);
    case PRIMITIVE_KINDS:
        break;
    }
    return (struct roots){NAN, NAN};
}

struct roots plan_roots(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction,
                        const struct shear *shear)
{
    double shift = ray_shift(origin, direction, plan->bvh.extent);
    struct vec3 start = shift > 0 ? vec3_add_scaled(origin, direction, shift) : origin;
    struct roots roots = roots_unshifted(primitive_roots(plan, id, start, direction, shear), shift);
    roots.leave += plan_leave_delay(plan, id, origin, roots.leave);
    return roots;
}

double plan_leave_delay(const struct plan *plan, uint32_t id, struct vec3 origin, double t)
{
    return leave_delay(primitive_leave_share(plan_primitive(plan, id)), t, vec3_max_abs(origin));
}

uint8_t plan_part(const struct plan *plan, uint32_t id, struct vec3 origin, struct vec3 direction, enum side side)
{
    const struct primitive *primitive = plan_primitive(plan, id);
    if (primitive->kind == PRIMITIVE_BOX)
        return (uint8_t)box_part(&plan->boxes[primitive->index], origin, direction, side);
    if (primitive->kind == PRIMITIVE_FRUSTUM)
        return (uint8_t)frustum_part(&plan->frustums[primitive->index], origin, direction, side);
    return 0;
}
