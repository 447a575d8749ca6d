#include "scene/nff.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/mesh_builder.h"
#include "scene/polygon.h"
#include "scene/token.h"

enum { RESOLUTION_DEFAULT = 512 };

/* The channels of a light that says no colour, until all lights are counted. */
#define UNSAID (-1)

struct nff_reader {
    struct token_reader text;
    struct scene *scene;
    bool has_view;
    struct nff_fill fill;
    size_t surface, solid; /* the fill's materials in the scene, once something wore them; SIZE_MAX before */
    struct mesh_builder polygons; /* of this fill */
    uint32_t *corners;            /* of the polygon in work */
    size_t corner_capacity;
};

/* --- view, background, lights ----------------------------------------------------------------------------- */

static void read_vector(struct nff_reader *nff, const char *what, struct vec3 *vector)
{
    double xyz[3] = {vector->x, vector->y, vector->z};
    token_numbers(&nff->text, what, 3, xyz);
    *vector = vec3_make(xyz[0], xyz[1], xyz[2]);
}

static void read_resolution(struct nff_reader *nff)
{
    int64_t width = RESOLUTION_DEFAULT, height = RESOLUTION_DEFAULT;
    token_whole(&nff->text, "a width from 1 to 65535", 1, IMAGE_SIDE_MAX, &width);
    token_whole(&nff->text, "a height from 1 to 65535", 1, IMAGE_SIDE_MAX, &height);
    nff->scene->width = (uint32_t)width;
    nff->scene->height = (uint32_t)height;
}

static void read_angle(struct nff_reader *nff)
{
    double *fov = &nff->scene->camera.fov_degrees;
    token_number(&nff->text, "an angle", fov);
    if (nff->text.status == STATUS_OK && !(*fov > 0 && *fov < 180))
        token_refuse(&nff->text, "expected an angle above 0 and below 180, found %g", *fov);
}

enum view_part { VIEW_FROM, VIEW_AT, VIEW_UP, VIEW_ANGLE, VIEW_HITHER, VIEW_RESOLUTION, VIEW_PARTS };

static const char *const view_parts[VIEW_PARTS] = {"from", "at", "up", "angle", "hither", "resolution"};

/* The part that the next word names, which is taken; VIEW_PARTS if it names none. */
static enum view_part next_view_part(struct nff_reader *nff)
{
    char word[TOKEN_WORD_BYTES];
    if (!token_more(&nff->text))
        return VIEW_PARTS;
    struct token_reader before = nff->text;
    token_word(&nff->text, "a part of the view", word);
    for (int part = 0; part < VIEW_PARTS; part++)
        if (strcmp(word, view_parts[part]) == 0)
            return (enum view_part)part;
    if (nff->text.status == STATUS_OK)
        nff->text = before;
    return VIEW_PARTS;
}

static void read_view_part(struct nff_reader *nff, enum view_part part)
{
    struct camera *camera = &nff->scene->camera;
    double hither; /* nothing is cut off before it: surfaces are met from the eye on */
    switch (part) {
    case VIEW_FROM:
        read_vector(nff, "a coordinate of the eye", &camera->from);
        break;
    case VIEW_AT:
        read_vector(nff, "a coordinate to look at", &camera->at);
        break;
    case VIEW_UP:
        read_vector(nff, "a coordinate of what is up", &camera->up);
        break;
    case VIEW_ANGLE:
        read_angle(nff);
        break;
    case VIEW_HITHER:
        token_number(&nff->text, "a distance", &hither);
        break;
    case VIEW_RESOLUTION:
        read_resolution(nff);
        break;
    case VIEW_PARTS:
        break;
    }
}

static void check_view(struct nff_reader *nff, const bool *seen)
{
    struct camera *camera = &nff->scene->camera;
    for (int part = VIEW_FROM; part <= VIEW_ANGLE; part++)
        if (!seen[part])
            token_expected(&nff->text, "\"%s\" in the view", view_parts[part]);
    if (nff->text.status != STATUS_OK)
        return;
    if (vec3_is_zero(camera->up)) {
        token_refuse(&nff->text, "expected an up other than zero, found 0 0 0");
        return;
    }
    camera->up = vec3_normalize(camera->up);
    const char *fault = camera_fault(camera);
    if (fault)
        token_refuse(&nff->text, "%s", fault);
}

static void read_view(struct nff_reader *nff)
{
    bool seen[VIEW_PARTS + 1] = {false};
    size_t line = nff->text.line;
    for (;;) {
        enum view_part part = next_view_part(nff);
        if (part == VIEW_PARTS)
            break;
        read_view_part(nff, part);
        seen[part] = true;
    }
    size_t after = nff->text.line;
    nff->text.line = line; /* failures of the view as a whole are where it begins */
    check_view(nff, seen);
    nff->text.line = after;
    nff->has_view = true;
}

static void read_colour(struct nff_reader *nff, const char *what, double max, struct vec3 *colour)
{
    double rgb[3] = {0};
    for (int i = 0; i < 3; i++)
        token_number_in(&nff->text, what, 0, max, &rgb[i]);
    *colour = vec3_make(rgb[0], rgb[1], rgb[2]);
}

static void read_background(struct nff_reader *nff)
{
    read_colour(nff, "a channel of the background", SCENE_LARGEST, &nff->scene->background.color[0]);
}

static void read_light(struct nff_reader *nff)
{
    struct scene *scene = nff->scene;
    struct light light = {.kind = LIGHT_POINT, .falloff = {1, 0, 0}, .color = {UNSAID, UNSAID, UNSAID}};
    read_vector(nff, "a coordinate of the light", &light.position);
    if (token_is_number(&nff->text))
        read_colour(nff, "a channel of the light", SCENE_LARGEST, &light.color);
    scene->lights =
        memory_grow(scene->lights, &scene->light_capacity, scene->light_count + 1, sizeof *scene->lights);
    scene->lights[scene->light_count++] = light;
}

/* Lights without colour: together as bright as a few, however many there are. */
static void set_unsaid_lights(struct scene *scene)
{
    double each = scene->light_count ? 1 / sqrt((double)scene->light_count) : 0;
    for (size_t i = 0; i < scene->light_count; i++)
        if (scene->lights[i].color.x == UNSAID)
            scene->lights[i].color = vec3_make(each, each, each);
}

/* --- fills ------------------------------------------------------------------------------------------------ */

/* The place of the fill's material in the scene. */
static size_t use_material(struct nff_reader *nff, bool solid)
{
    size_t *place = solid && nff_fill_refracts(&nff->fill) ? &nff->solid : &nff->surface;
    if (*place == SIZE_MAX) {
        struct material material = nff_fill_material(&nff->fill, place == &nff->solid);
        *place = scene_add_material(nff->scene, &material);
    }
    return *place;
}

/* The polygons of the fill so far become an object. */
static void flush_polygons(struct nff_reader *nff)
{
    if (nff->polygons.mesh.triangle_count == 0)
        return;
    struct object *object = scene_add_object(nff->scene);
    object->shape.kind = SHAPE_MESH;
    mesh_builder_finish(&nff->polygons, &object->shape.mesh);
    object->material = use_material(nff, object->shape.mesh.closed);
}

static bool fills_equal(const struct nff_fill *a, const struct nff_fill *b)
{
    return vec3_is_zero(vec3_sub(a->color, b->color)) && a->diffuse == b->diffuse &&
           a->specular == b->specular && a->shininess == b->shininess && a->transmittance == b->transmittance &&
           a->ior == b->ior;
}

static void read_fill(struct nff_reader *nff)
{
    struct nff_fill fill = {0};
    read_colour(nff, "a channel of the colour", 1, &fill.color);
    token_number_in(&nff->text, "Kd, a number", 0, SCENE_LARGEST, &fill.diffuse);
    token_number_in(&nff->text, "Ks, a number", 0, SCENE_LARGEST, &fill.specular);
    token_number_in(&nff->text, "Shine, a number", 0, SCENE_LARGEST, &fill.shininess);
    token_number_in(&nff->text, "T, a number", 0, SCENE_LARGEST, &fill.transmittance);
    token_number_in(&nff->text, "an index of refraction, a number", 0, SCENE_LARGEST, &fill.ior);
    if (nff->text.status != STATUS_OK || fills_equal(&fill, &nff->fill))
        return;
    flush_polygons(nff);
    nff->fill = fill;
    nff->surface = nff->solid = SIZE_MAX;
}

/* --- shapes ----------------------------------------------------------------------------------------------- */

/* A negative radius means that only the inside is to be seen; here both sides always are. */
static void read_sphere(struct nff_reader *nff)
{
    struct vec3 center = {0};
    double radius = 1;
    read_vector(nff, "a coordinate of the sphere's centre", &center);
    token_number(&nff->text, "a radius", &radius);
    if (nff->text.status == STATUS_OK && fabs(radius) < SCENE_SMALLEST)
        token_refuse(&nff->text, "expected a radius other than 0, found %g", radius);
    if (nff->text.status != STATUS_OK)
        return;
    struct object *object = scene_add_object(nff->scene);
    object->shape.kind = SHAPE_SPHERE;
    object->shape.sphere.center = center;
    object->shape.sphere.radius = fabs(radius);
    object->material = use_material(nff, true);
}

static void check_cone(struct nff_reader *nff, const struct shape *cone, double base, double apex)
{
    if (vec3_max_abs(vec3_sub(cone->frustum.base, cone->frustum.top)) < SCENE_SMALLEST)
        token_refuse(&nff->text, "expected base and apex apart, found both in one place");
    else if (fmax(fabs(base), fabs(apex)) < SCENE_SMALLEST)
        token_refuse(&nff->text, "expected a base or apex radius other than 0, found both 0");
    else if ((base < 0 && apex > 0) || (base > 0 && apex < 0))
        token_refuse(&nff->text, "expected radii of one sign, found %g and %g", base, apex);
}

static void read_cone(struct nff_reader *nff)
{
    struct shape cone = {.kind = SHAPE_FRUSTUM, .frustum.open = true};
    double base_radius = 1, apex_radius = 1;
    read_vector(nff, "a coordinate of the base", &cone.frustum.base);
    token_number(&nff->text, "the radius of the base", &base_radius);
    read_vector(nff, "a coordinate of the apex", &cone.frustum.top);
    token_number(&nff->text, "the radius of the apex", &apex_radius);
    if (nff->text.status == STATUS_OK)
        check_cone(nff, &cone, base_radius, apex_radius);
    if (nff->text.status != STATUS_OK)
        return;
    cone.frustum.base_radius = fabs(base_radius);
    cone.frustum.top_radius = fabs(apex_radius);
    struct object *object = scene_add_object(nff->scene);
    object->shape = cone;
    object->material = use_material(nff, false);
}

static void read_corner(struct nff_reader *nff, bool has_normal, size_t number)
{
    struct mesh_vertex vertex = {0};
    read_vector(nff, "a coordinate of a corner", &vertex.point);
    if (has_normal) {
        read_vector(nff, "a coordinate of a normal", &vertex.normal);
        vertex.normal = mesh_normal(vertex.normal);
    }
    nff->corners = memory_grow(nff->corners, &nff->corner_capacity, number + 1, sizeof *nff->corners);
    if (nff->text.status == STATUS_OK)
        nff->corners[number] = mesh_builder_vertex(&nff->polygons, &vertex);
}

static void read_face(struct nff_reader *nff, bool has_normals)
{
    int64_t count = 0;
    token_whole(&nff->text, "a number of corners of at least 3", 3, INT64_MAX / 16, &count);
    for (int64_t i = 0; i < count && nff->text.status == STATUS_OK; i++)
        read_corner(nff, has_normals, (size_t)i);
    if (nff->text.status == STATUS_OK && !mesh_builder_face(&nff->polygons, nff->corners, (size_t)count))
        token_refuse(&nff->text, "expected a convex polygon or at most %d corners, found %lld",
                     POLYGON_CORNERS_MAX, (long long)count);
}

static void read_polygon(struct nff_reader *nff)
{
    read_face(nff, false);
}

static void read_patch(struct nff_reader *nff)
{
    read_face(nff, true);
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void read_entity(struct nff_reader *nff)
{
    static const struct {
        const char *name;
        void (*read)(struct nff_reader *nff);
    } entities[] = {
        {"p", read_polygon}, {"s", read_sphere}, {"c", read_cone}, {"pp", read_patch},
        {"f", read_fill},    {"l", read_light},  {"v", read_view}, {"b", read_background},
    };
    char word[TOKEN_WORD_BYTES];
    struct token_reader before = nff->text;
    token_word(&nff->text, "an entity", word);
    for (size_t i = 0; i < sizeof entities / sizeof *entities; i++)
        if (strcmp(word, entities[i].name) == 0) {
            entities[i].read(nff);
            return;
        }
    if (nff->text.status == STATUS_OK)
        nff->text = before;
    token_expected(&nff->text, "one of the entities v, b, l, f, c, s, p and pp");
}

static void read_entities(struct nff_reader *nff)
{
    while (token_more(&nff->text))
        read_entity(nff);
    if (!nff->has_view)
        token_refuse(&nff->text, "expected a view (v), found none");
    if (nff->text.status == STATUS_OK)
        flush_polygons(nff);
    set_unsaid_lights(nff->scene);
}

enum status nff_scene_read(struct scene *scene, const char *name, struct asset_set *assets, struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    char *path = asset_set_path(assets, name);
    struct nff_reader nff = {
        .text = token_reader_of(path, asset->bytes.data, asset->bytes.size, error),
        .scene = scene,
        .fill = {.color = {0.8, 0.8, 0.8}, .diffuse = 0.8, .shininess = 32},
        .surface = SIZE_MAX,
        .solid = SIZE_MAX,
    };
    nff.text.by_line = false;
    scene->width = scene->height = RESOLUTION_DEFAULT;
    scene->depth = SCENE_DEPTH_DEFAULT;
    read_entities(&nff);
    mesh_builder_discard(&nff.polygons);
    free(nff.corners);
    free(path);
    return nff.text.status;
}
