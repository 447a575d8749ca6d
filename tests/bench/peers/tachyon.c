/* The scene format of Tachyon 0.99. */
#include "tests/bench/peers/export.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static const char head[] =
    "# Written by weft's benchmark. What differs from weft's own picture:\n"
    "# - the world is mirrored in z, since Tachyon is left-handed;\n"
    "# - numbers are single precision;\n"
    "# - nothing is refracted: glass mirrors what it would head-on, everywhere, and light goes straight on;\n"
    "# - what passes a surface is not tinted; reflection and highlights are one number instead of three;\n"
    "# - a ray that is cut off at the depth limit brings the background instead of nothing;\n"
    "# - there are no cones: one that is cut off becomes a cylinder of the mean radius, one with a tip triangles;\n"
    "# - a box is twelve triangles; stripes and checkers are images; an image around a sphere turns about the\n"
    "#   vertical axis only; images are filtered by distance alone.\n";

enum { CONE_SECTORS = 64 };

static struct vec3 mirrored(struct vec3 v)
{
    return vec3_make(v.x, v.y, -v.z);
}

static void put(FILE *to, const char *name, struct vec3 v)
{
    fprintf(to, "%s %.9g %.9g %.9g ", name, v.x, v.y, v.z);
}

/* A point or direction of the world. */
static void put_place(FILE *to, const char *name, struct vec3 v)
{
    put(to, name, mirrored(v));
}

/* --- images ----------------------------------------------------------------------------------------------- */

/* Tachyon's images are files of bytes in linear light. */
static enum status write_image(const struct export *out, const char *name, const float *rgb, uint32_t width,
                               uint32_t height, struct error *error)
{
    char *path = memory_format("%s%s", out->output_folder, name);
    FILE *file = fopen(path, "wb");
    if (file) {
        fprintf(file, "P6\n%u %u\n255\n", width, height);
        for (size_t i = 0; i < (size_t)3 * width * height; i++)
            fputc((int)(255 * rgb[i] + 0.5f), file);
    }
    enum status status = STATUS_OK;
    if (!file || fclose(file) != 0)
        status = error_set(error, STATUS_OUTPUT, "%s: %s", path, strerror(errno));
    free(path);
    return status;
}

enum { PATTERN_SIDE = 256 }; /* texels, of a pattern's two by two cells */

/* Two by two cells of a checker, or two stripes side by side. */
static enum status write_pattern(const struct export *out, const char *name, const struct texture *texture,
                                 struct error *error)
{
    float *rgb = memory_array((size_t)3 * PATTERN_SIDE * PATTERN_SIDE, sizeof *rgb);
    for (uint32_t y = 0; y < PATTERN_SIDE; y++)
        for (uint32_t x = 0; x < PATTERN_SIDE; x++) {
            bool right = x >= PATTERN_SIDE / 2, lower = y >= PATTERN_SIDE / 2;
            bool odd = texture->kind == TEXTURE_CHECKER ? right == lower : right;
            float *texel = &rgb[3 * ((size_t)y * PATTERN_SIDE + x)];
            texel[0] = (float)texture->color[odd].x;
            texel[1] = (float)texture->color[odd].y;
            texel[2] = (float)texture->color[odd].z;
        }
    enum status status = write_image(out, name, rgb, PATTERN_SIDE, PATTERN_SIDE, error);
    free(rgb);
    return status;
}

/* --- textures --------------------------------------------------------------------------------------------- */

/* Everything up to the choice of the texture function. */
static void put_texture_head(const struct export *out, const char *name, const struct material *material)
{
    double share = export_surface_share(material), specular = export_mean(material->reflection);
    double opacity = 1 - material->transparency * export_mean(material->filter);
    struct vec3 color = material->color.kind == TEXTURE_CONSTANT ? material->color.color[0] : vec3_make(1, 1, 1);
    if (material->ior > 0) { /* Fresnel's reflectance at normal incidence */
        double root = (material->ior - 1) / (material->ior + 1);
        specular = root * root;
        opacity = 1 - (1 - specular) * export_mean(material->filter);
        color = vec3_make(0, 0, 0);
    }
    fprintf(out->to, "TEXDEF %s AMBIENT %.9g DIFFUSE %.9g SPECULAR %.9g OPACITY %.9g ", name,
            material->ambient * share * export_mean(out->scene->ambient), material->diffuse * share, specular, opacity);
    fprintf(out->to, "PHONG PLASTIC %.9g PHONG_SIZE %.9g ", export_mean(material->specular), material->shininess);
    put(out->to, "COLOR", color);
}

/* Tachyon chooses the level of an image by distance × SCALE, far too coarse a one at 1; so the axes hold the scale. */
#define IMAGE_SCALE 0.1

/* An image that spans `face` (of the object's own coordinates) and repeats. */
static void put_planar(FILE *to, const char *image, const struct export_face *face, const struct affine *transform)
{
    struct mat3 inverse = mat3_inverse(&transform->linear);
    struct vec3 u = vec3_scale(face->right, 1 / (IMAGE_SCALE * vec3_dot(face->right, face->right)));
    struct vec3 v = vec3_scale(face->up, -1 / (IMAGE_SCALE * vec3_dot(face->up, face->up)));
    fprintf(to, "TEXFUNC 9 %s ", image);
    put_place(to, "CENTER", affine_point(transform, face->corner));
    put(to, "ROTATE", vec3_make(0, 1, 0));
    put(to, "SCALE", vec3_make(IMAGE_SCALE, IMAGE_SCALE, 1));
    put_place(to, "UAXIS", mat3_apply_transposed(&inverse, u));
    put_place(to, "VAXIS", mat3_apply_transposed(&inverse, v));
    fprintf(to, "\n");
}

/* Longitude is counted from another place than ours; a turn about the vertical axis is an offset to it. */
static void put_spherical(FILE *to, const char *image, const struct object *object)
{
    const double turn = 6.283185307179586;
    const struct mat3 *linear = &object->transform.linear;
    fprintf(to, "TEXFUNC 8 %s ", image);
    put_place(to, "CENTER", affine_point(&object->transform, object->shape.sphere.center));
    put(to, "ROTATE", vec3_make(0.75 - atan2(linear->x.z, linear->z.z) / turn, 1, 0));
    put(to, "SCALE", vec3_make(1, -1, 1));
    fprintf(to, "\n");
}

/* Two by two cells, seen along an axis that the pattern is not to vary along. */
static struct export_face pattern_face(const struct texture *texture, const struct shape *shape)
{
    struct vec3 right = texture->direction, up;
    if (texture->kind == TEXTURE_CHECKER) {
        struct vec3 axis = shape->kind == SHAPE_PLANE ? shape->plane.normal : vec3_make(0, 1, 0);
        right = fabs(axis.x) > 0.5 ? vec3_make(0, 0, 1) : vec3_make(1, 0, 0);
        up = vec3_cross(axis, right);
    } else {
        struct vec3 other;
        vec3_frame(right, &up, &other);
    }
    return (struct export_face){texture->offset, vec3_scale(right, 2 * texture->size),
                                vec3_scale(up, 2 * texture->size)};
}

static enum status put_pattern(const struct export *out, size_t index, const char *texture_name, struct error *error)
{
    const struct object *object = &out->scene->objects[index];
    const struct material *material = &out->scene->materials[object->material];
    struct export_face face = pattern_face(&material->color, &object->shape);
    char name[32];
    snprintf(name, sizeof name, "pattern%zu.ppm", index);
    put_texture_head(out, texture_name, material);
    put_planar(out->to, name, &face, &object->transform);
    return write_pattern(out, name, &material->color, error);
}

static enum status put_image(const struct export *out, size_t index, const char *texture_name, int face_index,
                             struct error *error)
{
    const struct object *object = &out->scene->objects[index];
    const struct material *material = &out->scene->materials[object->material];
    size_t image = material->color.image[face_index];
    const struct image *texels = &out->scene->images[image].image;
    char name[32];
    snprintf(name, sizeof name, "image%zu.ppm", image);
    put_texture_head(out, texture_name, material);
    if (material->color.map == MAP_SPHERE && object->shape.kind == SHAPE_SPHERE) {
        put_spherical(out->to, name, object);
    } else if (material->color.map == MAP_BOX && object->shape.kind == SHAPE_BOX) {
        struct export_face face = export_box_face(&object->shape, face_index);
        put_planar(out->to, name, &face, &object->transform);
    } else if (material->color.map == MAP_PLANAR) {
        struct export_face face = export_planar_face(&material->color);
        put_planar(out->to, name, &face, &object->transform);
    } else {
        return error_set(error, STATUS_INPUT, "objects[%zu]: this map of an image is not exported to Tachyon", index);
    }
    return write_image(out, name, texels->rgb, texels->width, texels->height, error);
}

enum { TEXTURE_NAME = 64 };

/* Defines the object's texture (of that face of a box) unless it is its material's; sets its name. */
static enum status put_object_texture(const struct export *out, size_t index, int face, char name[TEXTURE_NAME],
                                      struct error *error)
{
    size_t material = out->scene->objects[index].material;
    enum texture_kind kind = out->scene->materials[material].color.kind;
    snprintf(name, TEXTURE_NAME, "o%zu_%d", index, face);
    if (kind == TEXTURE_IMAGE)
        return put_image(out, index, name, face, error);
    if (kind == TEXTURE_CHECKER || kind == TEXTURE_STRIPES)
        return put_pattern(out, index, name, error);
    snprintf(name, TEXTURE_NAME, "m%zu", material);
    if (kind == TEXTURE_CONSTANT)
        return STATUS_OK;
    return error_set(error, STATUS_INPUT, "objects[%zu]: gradients are not exported to Tachyon", index);
}

static void put_plain_textures(const struct export *out)
{
    char name[TEXTURE_NAME];
    for (size_t i = 0; i < out->scene->material_count; i++) {
        if (out->scene->materials[i].color.kind != TEXTURE_CONSTANT)
            continue;
        snprintf(name, sizeof name, "m%zu", i);
        put_texture_head(out, name, &out->scene->materials[i]);
        fprintf(out->to, "TEXFUNC 0\n");
    }
}

/* --- shapes ----------------------------------------------------------------------------------------------- */

/* Points and, unless NULL, normals of the world, counter-clockwise seen from where the normals point; mirroring turns
 * them over, hence the order. */
static void put_triangle(FILE *to, const struct vec3 *points, const struct vec3 *normals, const char *texture)
{
    put_place(to, normals ? "STRI V0" : "TRI V0", points[0]);
    put_place(to, "V1", points[2]);
    put_place(to, "V2", points[1]);
    if (normals) {
        put_place(to, "N0", normals[0]);
        put_place(to, "N1", normals[2]);
        put_place(to, "N2", normals[1]);
    }
    fprintf(to, "%s\n", texture);
}

static void put_ring(FILE *to, struct vec3 center, struct vec3 normal, double radius, const char *texture)
{
    put_place(to, "RING CENTER", center);
    put_place(to, "NORMAL", normal);
    fprintf(to, "INNER 0 OUTER %.9g %s\n", radius, texture);
}

static void put_mesh(FILE *to, const struct object *object, const char *texture)
{
    const struct mesh *mesh = &object->shape.mesh;
    struct mat3 inverse = mat3_inverse(&object->transform.linear);
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        struct vec3 points[3], normals[3];
        for (int j = 0; j < 3; j++) {
            uint32_t corner = mesh->index[3 * i + (size_t)j];
            points[j] = affine_point(&object->transform, mesh->points[corner]);
            if (mesh->normals)
                normals[j] = vec3_normalize(mat3_apply_transposed(&inverse, mesh->normals[corner]));
        }
        put_triangle(to, points, mesh->normals ? normals : NULL, texture);
    }
}

static enum status put_box(const struct export *out, size_t index, struct error *error)
{
    const struct object *object = &out->scene->objects[index];
    for (int i = 0; i < BOX_FACES; i++) {
        char texture[TEXTURE_NAME];
        enum status status = put_object_texture(out, index, i, texture, error);
        if (status != STATUS_OK)
            return status;
        struct export_face face = export_box_face(&object->shape, i);
        struct vec3 lower_right = vec3_add(face.corner, face.right), upper_left = vec3_add(face.corner, face.up);
        const struct affine *m = &object->transform;
        const struct vec3 corners[4] = {affine_point(m, face.corner), affine_point(m, lower_right),
                                        affine_point(m, vec3_add(lower_right, face.up)), affine_point(m, upper_left)};
        const struct vec3 second[3] = {corners[0], corners[2], corners[3]};
        put_triangle(out->to, corners, NULL, texture);
        put_triangle(out->to, second, NULL, texture);
    }
    return STATUS_OK;
}

/* The side of a cone from `base` to its tip at `apex`. */
static void put_cone(FILE *to, struct vec3 base, struct vec3 apex, double radius, const char *texture)
{
    const double turn = 6.283185307179586;
    struct vec3 along = vec3_sub(apex, base), axis = vec3_normalize(along), right, back;
    double slope = radius / vec3_length(along);
    vec3_frame(axis, &right, &back);
    struct vec3 rim[2], normal[2];
    for (int i = 0; i <= CONE_SECTORS; i++) {
        double angle = turn * i / CONE_SECTORS;
        struct vec3 out = vec3_add_scaled(vec3_scale(right, cos(angle)), back, sin(angle));
        rim[i % 2] = vec3_add_scaled(base, out, radius);
        normal[i % 2] = vec3_normalize(vec3_add_scaled(out, axis, slope));
        if (i == 0)
            continue;
        const struct vec3 points[3] = {rim[(i + 1) % 2], rim[i % 2], apex};
        const struct vec3 normals[3] = {normal[(i + 1) % 2], normal[i % 2],
                                        vec3_normalize(vec3_add(normal[0], normal[1]))};
        put_triangle(to, points, normals, texture);
    }
}

static void put_frustum(FILE *to, const struct shape *shape, const struct affine *transform, double scale,
                        const char *texture)
{
    struct vec3 base = affine_point(transform, shape->frustum.base), top = affine_point(transform, shape->frustum.top);
    double base_radius = scale * shape->frustum.base_radius, top_radius = scale * shape->frustum.top_radius;
    struct vec3 axis = vec3_normalize(vec3_sub(top, base));
    if (base_radius == 0) {
        put_cone(to, top, base, top_radius, texture);
    } else if (top_radius == 0) {
        put_cone(to, base, top, base_radius, texture);
    } else {
        put_place(to, "FCYLINDER BASE", base);
        put_place(to, "APEX", top);
        fprintf(to, "RAD %.9g %s\n", 0.5 * (base_radius + top_radius), texture);
    }
    if (!shape->frustum.open && base_radius > 0)
        put_ring(to, base, vec3_neg(axis), base_radius, texture);
    if (!shape->frustum.open && top_radius > 0)
        put_ring(to, top, axis, top_radius, texture);
}

/* A shape with round parts, which only a similarity keeps round. */
static void put_round(FILE *to, const struct object *object, double scale, const char *texture)
{
    const struct shape *shape = &object->shape;
    if (shape->kind == SHAPE_SPHERE) {
        put_place(to, "SPHERE CENTER", affine_point(&object->transform, shape->sphere.center));
        fprintf(to, "RAD %.9g %s\n", scale * shape->sphere.radius, texture);
    } else if (shape->kind == SHAPE_DISC) {
        put_ring(to, affine_point(&object->transform, shape->disc.center),
                 mat3_apply(&object->transform.linear, shape->disc.normal), scale * shape->disc.radius, texture);
    } else {
        put_frustum(to, shape, &object->transform, scale, texture);
    }
}

static enum status put_object(const struct export *out, size_t index, struct error *error)
{
    const struct object *object = &out->scene->objects[index];
    struct mat3 inverse = mat3_inverse(&object->transform.linear);
    double scale = affine_similarity(&object->transform);
    char texture[TEXTURE_NAME];
    if (object->shape.kind == SHAPE_BOX)
        return put_box(out, index, error);
    enum status status = put_object_texture(out, index, 0, texture, error);
    if (status != STATUS_OK)
        return status;
    if (object->shape.kind == SHAPE_PLANE) {
        put_place(out->to, "PLANE CENTER", affine_point(&object->transform, object->shape.plane.point));
        put_place(out->to, "NORMAL", mat3_apply_transposed(&inverse, object->shape.plane.normal));
        fprintf(out->to, "%s\n", texture);
    } else if (object->shape.kind == SHAPE_MESH) {
        put_mesh(out->to, object, texture);
    } else if (scale == 0) {
        return error_set(error, STATUS_INPUT,
                         "objects[%zu]: round shapes that are squeezed are not exported to Tachyon", index);
    } else {
        put_round(out->to, object, scale, texture);
    }
    return STATUS_OK;
}

/* --- the whole -------------------------------------------------------------------------------------------- */

/* Tachyon samples a pixel at its upper right corner, so the image plane is moved by half a pixel. */
static void put_camera(const struct export *out)
{
    const struct camera *camera = &out->scene->camera;
    struct export_view view = export_view_of(camera);
    double height = view.half_height, width = height * out->width / out->height, half_pixel = height / out->height;
    fprintf(out->to, "CAMERA ZOOM %.9g ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH %u ", 0.5 / view.half_height,
            out->scene->depth + 1);
    put_place(out->to, "CENTER", camera->from);
    put_place(out->to, "VIEWDIR", view.forward);
    put_place(out->to, "UPDIR", view.up);
    fprintf(out->to, "FRUSTUM %.9g %.9g %.9g %.9g END_CAMERA\n", -width - half_pixel, width - half_pixel,
            -height - half_pixel, height - half_pixel);
}

static enum status put_background(const struct export *out, struct error *error)
{
    const struct background *background = &out->scene->background;
    if (background->kind == BACKGROUND_IMAGE)
        return error_set(error, STATUS_INPUT, "background: images are not exported to Tachyon");
    if (background->kind == BACKGROUND_CONSTANT) {
        put(out->to, "BACKGROUND", background->color[0]);
    } else {
        fprintf(out->to, "BACKGROUND_GRADIENT SKY_SPHERE UPDIR 0 1 0 TOPVAL 1 BOTTOMVAL -1 ");
        put(out->to, "TOPCOLOR", background->color[1]);
        put(out->to, "BOTTOMCOLOR", background->color[0]);
    }
    fprintf(out->to, "\n");
    return STATUS_OK;
}

enum status export_tachyon(const struct export *out, struct error *error)
{
    const struct scene *scene = out->scene;
    fprintf(out->to, "BEGIN_SCENE RESOLUTION %u %u\n%s", out->width, out->height, head);
    put_camera(out);
    enum status status = put_background(out, error);
    if (status == STATUS_OK)
        status = export_check_lights(scene, error);
    for (size_t i = 0; i < scene->light_count && status == STATUS_OK; i++) {
        put_place(out->to, "LIGHT CENTER", scene->lights[i].position);
        put(out->to, "RAD 0.001 COLOR", export_light_color(&scene->lights[i]));
        fprintf(out->to, "\n");
    }
    put_plain_textures(out);
    for (size_t i = 0; i < scene->object_count && status == STATUS_OK; i++)
        status = put_object(out, i, error);
    fprintf(out->to, "END_SCENE\n");
    return status;
}
