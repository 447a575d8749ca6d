/* The scene description language of POV-Ray 3.7. */
#include "tests/bench/peers/export.h"

#include <string.h>

#include "trace/children.h"

static const char head[] =
    "#version 3.7;\n"
    "// Written by weft's benchmark. What differs from weft's own picture:\n"
    "// - reflection in three channels is kept, but it takes its mean off the coloured surface;\n"
    "// - highlights and what they are scaled by are one number instead of three;\n"
    "// - light that goes straight through a coloured surface is tinted by a mix of white and that colour;\n"
    "// - shadows behind glass leave out Fresnel's losses;\n"
    "// - textures are interpolated but not filtered over a pixel's footprint.\n";

static void put_vector(FILE *to, struct vec3 v)
{
    fprintf(to, "<%.9g,%.9g,%.9g>", v.x, v.y, v.z);
}

static void put_named(FILE *to, const char *name, struct vec3 v)
{
    fprintf(to, "%s ", name);
    put_vector(to, v);
}

/* --- surfaces --------------------------------------------------------------------------------------------- */

/* Of light that goes straight on, `filter` is multiplied by the pigment's colour and `transmit` is not. */
struct passage {
    double filter, transmit;
};

static void put_color(FILE *to, struct vec3 color, struct passage passage)
{
    fprintf(to, "rgbft <%.9g,%.9g,%.9g,%.9g,%.9g>", color.x, color.y, color.z, passage.filter, passage.transmit);
}

static void put_matrix(FILE *to, struct vec3 x, struct vec3 y, struct vec3 z, struct vec3 offset)
{
    fprintf(to, " matrix <%.9g,%.9g,%.9g, %.9g,%.9g,%.9g, %.9g,%.9g,%.9g, %.9g,%.9g,%.9g>", x.x, x.y, x.z, y.x, y.y,
            y.z, z.x, z.y, z.z, offset.x, offset.y, offset.z);
}

static void put_image(const struct export *out, size_t image, int map_type)
{
    fprintf(out->to, "image_map { png \"%s%s\" map_type %d interpolate 2 }", out->scene_folder,
            out->scene->images[image].name, map_type);
}

/* The image's unit square, laid on the face. */
static void put_face(const struct export *out, size_t image, const struct export_face *face)
{
    fprintf(out->to, "pigment { ");
    put_image(out, image, 0);
    put_matrix(out->to, face->right, face->up, vec3_normalize(vec3_cross(face->right, face->up)), face->corner);
    fprintf(out->to, " }\n");
}

/* "cubic" chooses by the side that a point is on, seen from the origin, in the order +x +y +z −x −y −z; so this is
 * for the cube of edge 2 around it. */
static void put_box_images(const struct export *out, const struct texture *texture)
{
    static const int order[BOX_FACES] = {0, 2, 4, 1, 3, 5};
    const struct shape cube = {.kind = SHAPE_BOX, .box = {{-1, -1, -1}, {1, 1, 1}}};
    fprintf(out->to, "cubic\n");
    for (int i = 0; i < BOX_FACES; i++) {
        struct export_face face = export_box_face(&cube, order[i]);
        put_face(out, texture->image[order[i]], &face);
    }
}

static enum status put_image_pigment(const struct export *out, const struct texture *texture,
                                     const struct shape *shape, struct error *error)
{
    struct export_face face = export_planar_face(texture);
    struct vec3 size;
    switch (texture->map) {
    case MAP_SPHERE: /* POV-Ray's longitude starts at +x and grows to +z; ours starts at −z and grows to −x */
        if (shape->kind != SHAPE_SPHERE)
            break;
        fprintf(out->to, "pigment { ");
        put_image(out, texture->image[0], 1);
        put_matrix(out->to, vec3_make(0, 0, -1), vec3_make(0, 1, 0), vec3_make(-1, 0, 0), shape->sphere.center);
        fprintf(out->to, " }");
        return STATUS_OK;
    case MAP_PLANAR:
        put_face(out, texture->image[0], &face);
        return STATUS_OK;
    case MAP_BOX:
        if (shape->kind != SHAPE_BOX)
            break;
        size = vec3_scale(vec3_sub(shape->box.max, shape->box.min), 0.5);
        fprintf(out->to, "pigment { ");
        put_box_images(out, texture);
        put_matrix(out->to, vec3_make(size.x, 0, 0), vec3_make(0, size.y, 0), vec3_make(0, 0, size.z),
                   vec3_mix(shape->box.min, shape->box.max, 0.5));
        fprintf(out->to, " }");
        return STATUS_OK;
    default:
        break;
    }
    return error_set(error, STATUS_INPUT, "this map of an image is not exported to POV-Ray");
}

static enum status put_pigment(const struct export *out, const struct texture *texture, const struct shape *shape,
                               struct passage passage, struct error *error)
{
    FILE *to = out->to;
    switch (texture->kind) {
    case TEXTURE_CONSTANT:
        fprintf(to, "pigment { ");
        put_color(to, texture->color[0], passage);
        break;
    case TEXTURE_CHECKER:
        fprintf(to, "pigment { checker ");
        put_color(to, texture->color[0], passage);
        fprintf(to, " ");
        put_color(to, texture->color[1], passage);
        fprintf(to, " scale %.9g translate ", texture->size);
        put_vector(to, texture->offset);
        break;
    case TEXTURE_STRIPES:
        put_named(to, "pigment { gradient", texture->direction);
        fprintf(to, " color_map { ");
        for (int i = 0; i < 4; i++) { /* 0 .5 .5 1 */
            fprintf(to, "[%g ", 0.5 * ((i + 1) / 2));
            put_color(to, texture->color[i / 2], passage);
            fprintf(to, "] ");
        }
        fprintf(to, "} scale %.9g translate ", 2 * texture->size);
        put_vector(to, texture->offset);
        break;
    case TEXTURE_GRADIENT:
        return error_set(error, STATUS_INPUT, "gradients are not exported to POV-Ray");
    case TEXTURE_IMAGE:
        return put_image_pigment(out, texture, shape, error);
    }
    fprintf(to, " }");
    return STATUS_OK;
}

/* How to tint by the pigment's colour so that on average as much passes as weft's filter lets through. */
static struct passage passage_of(const struct material *material)
{
    double lost = 1 - export_mean(material->filter), colored = 1 - export_mean(material->color.color[0]);
    double share = colored > 0 ? fmin(1, lost / colored) : 0;
    return (struct passage){material->transparency * share, material->transparency * (1 - share)};
}

/* POV-Ray takes what goes straight on off the coloured surface by itself, what is mirrored it does not. */
static void put_finish(FILE *to, const struct material *material)
{
    double left = 1 - material->transparency;
    double share = left > 0 ? export_surface_share(material) / left : 0;
    fprintf(to, " finish { ambient %.9g diffuse %.9g phong %.9g phong_size %.9g", material->ambient * share,
            material->diffuse * share, export_mean(material->specular), material->shininess);
    if (material->ior > 0) {
        fprintf(to, " reflection { 0, 1 fresnel on } conserve_energy");
    } else if (vec3_max(material->reflection) > 0) {
        put_named(to, " reflection { rgb", material->reflection);
        fprintf(to, " }");
    }
    fprintf(to, " }");
}

/* A texture, and an interior where it is glass. `shape` is what it is for, or NULL: then there may be no image. */
static enum status put_material(const struct export *out, const struct material *material, const struct shape *shape,
                                struct error *error)
{
    const struct texture glass = {.kind = TEXTURE_CONSTANT, .color = {material->filter}};
    if (!vec3_is_zero(material->absorption))
        return error_set(error, STATUS_INPUT, "absorption is not exported to POV-Ray");
    fprintf(out->to, " texture { ");
    enum status status = material->ior > 0
        ? put_pigment(out, &glass, shape, (struct passage){1, 0}, error)
        : put_pigment(out, &material->color, shape, passage_of(material), error);
    put_finish(out->to, material);
    fprintf(out->to, " }");
    if (material->ior > 0)
        fprintf(out->to, " interior { ior %.9g }", material->ior);
    return status;
}

/* Images lie as the object's shape wants them; all other materials are shared, as a writer by hand would do. */
static bool is_shared(const struct material *material)
{
    return material->ior > 0 || material->color.kind != TEXTURE_IMAGE;
}

static enum status put_shared_materials(const struct export *out, struct error *error)
{
    for (size_t i = 0; i < out->scene->material_count; i++) {
        if (!is_shared(&out->scene->materials[i]))
            continue;
        fprintf(out->to, "#declare M%zu = material {", i);
        enum status status = put_material(out, &out->scene->materials[i], NULL, error);
        fprintf(out->to, " }\n");
        if (status != STATUS_OK)
            return error_prefix(error, status, "materials[%zu]: ", i);
    }
    return STATUS_OK;
}

/* --- shapes ----------------------------------------------------------------------------------------------- */

static void put_vectors(FILE *to, const char *name, const struct vec3 *vectors, size_t count)
{
    fprintf(to, "%s { %zu", name, count);
    for (size_t i = 0; i < count; i++) {
        fprintf(to, ",\n");
        put_vector(to, vectors[i]);
    }
    fprintf(to, " }\n");
}

static void put_mesh(FILE *to, const struct mesh *mesh)
{
    fprintf(to, "mesh2 {\n");
    put_vectors(to, "vertex_vectors", mesh->points, mesh->vertex_count);
    if (mesh->normals)
        put_vectors(to, "normal_vectors", mesh->normals, mesh->vertex_count);
    fprintf(to, "face_indices { %zu", mesh->triangle_count);
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corner = &mesh->index[3 * i];
        fprintf(to, ",\n<%u,%u,%u>", corner[0], corner[1], corner[2]);
    }
    fprintf(to, " }\n");
}

static void put_frustum(FILE *to, const struct shape *shape)
{
    bool cylinder = shape->frustum.base_radius == shape->frustum.top_radius;
    put_named(to, cylinder ? "cylinder {" : "cone {", shape->frustum.base);
    if (!cylinder)
        fprintf(to, ", %.9g", shape->frustum.base_radius);
    put_named(to, ",", shape->frustum.top);
    fprintf(to, ", %.9g%s", shape->frustum.top_radius, shape->frustum.open ? " open" : "");
}

/* Without the closing brace. */
static void put_shape(FILE *to, const struct shape *shape)
{
    switch (shape->kind) {
    case SHAPE_SPHERE:
        put_named(to, "sphere {", shape->sphere.center);
        fprintf(to, ", %.9g", shape->sphere.radius);
        break;
    case SHAPE_PLANE:
        put_named(to, "plane {", shape->plane.normal);
        fprintf(to, ", %.9g", vec3_dot(shape->plane.normal, shape->plane.point));
        break;
    case SHAPE_DISC:
        put_named(to, "disc {", shape->disc.center);
        put_named(to, ",", shape->disc.normal);
        fprintf(to, ", %.9g", shape->disc.radius);
        break;
    case SHAPE_FRUSTUM:
        put_frustum(to, shape);
        break;
    case SHAPE_BOX:
        put_named(to, "box {", shape->box.min);
        put_named(to, ",", shape->box.max);
        break;
    case SHAPE_MESH:
        put_mesh(to, &shape->mesh);
        break;
    case SHAPE_KINDS:
        break;
    }
}

static enum status put_object(const struct export *out, const struct object *object, struct error *error)
{
    const struct material *material = &out->scene->materials[object->material];
    const struct affine identity = affine_identity();
    enum status status = STATUS_OK;
    put_shape(out->to, &object->shape);
    if (is_shared(material))
        fprintf(out->to, " material { M%zu }", object->material);
    else
        status = put_material(out, material, &object->shape, error);
    if (memcmp(&object->transform, &identity, sizeof identity) != 0) { /* POV-Ray is slower with any at all */
        struct mat3 columns = mat3_transpose(&object->transform.linear);
        put_matrix(out->to, columns.x, columns.y, columns.z, object->transform.offset);
    }
    fprintf(out->to, " }\n");
    return status;
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void put_camera(const struct export *out)
{
    struct export_view view = export_view_of(&out->scene->camera);
    put_named(out->to, "camera { perspective location", out->scene->camera.from);
    put_named(out->to, " direction", view.forward);
    put_named(out->to, " right", vec3_scale(view.right, 2 * view.half_height * out->width / out->height));
    put_named(out->to, " up", vec3_scale(view.up, 2 * view.half_height));
    fprintf(out->to, " }\n");
}

static enum status put_background(const struct export *out, struct error *error)
{
    const struct background *background = &out->scene->background;
    switch (background->kind) {
    case BACKGROUND_CONSTANT:
        put_named(out->to, "background { rgb", background->color[0]);
        fprintf(out->to, " }\n");
        return STATUS_OK;
    case BACKGROUND_GRADIENT:
        put_named(out->to, "sky_sphere { pigment { gradient y color_map { [0 rgb", background->color[0]);
        put_named(out->to, "] [1 rgb", background->color[1]);
        fprintf(out->to, "] } scale 2 translate -1 } }\n");
        return STATUS_OK;
    case BACKGROUND_IMAGE:
        break;
    }
    return error_set(error, STATUS_INPUT, "background: images are not exported to POV-Ray");
}

enum status export_pov(const struct export *out, struct error *error)
{
    const struct scene *scene = out->scene;
    fprintf(out->to, "%sglobal_settings { assumed_gamma 1 max_trace_level %u adc_bailout %.9g", head, scene->depth + 1,
            THROUGHPUT_MIN);
    put_named(out->to, " ambient_light rgb", scene->ambient);
    fprintf(out->to, " }\n");
    put_camera(out);
    enum status status = put_background(out, error);
    if (status == STATUS_OK)
        status = export_check_lights(scene, error);
    for (size_t i = 0; i < scene->light_count && status == STATUS_OK; i++) {
        put_named(out->to, "light_source {", scene->lights[i].position);
        put_named(out->to, " rgb", export_light_color(&scene->lights[i]));
        fprintf(out->to, " }\n");
    }
    if (status == STATUS_OK)
        status = put_shared_materials(out, error);
    for (size_t i = 0; i < scene->object_count && status == STATUS_OK; i++) {
        status = put_object(out, &scene->objects[i], error);
        if (status != STATUS_OK)
            error_prefix(error, status, "objects[%zu]: ", i);
    }
    return status;
}
