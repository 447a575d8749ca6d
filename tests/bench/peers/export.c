/* export LANGUAGE SCENE WIDTHxHEIGHT FILE: see export.h. LANGUAGE is pov or tachyon. */
#include "tests/bench/peers/export.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/options.h"
#include "image/image.h"
#include "scene/load.h"

struct export_view export_view_of(const struct camera *camera)
{
    const double radians = 3.14159265358979323846 / 180;
    struct export_view view = {.forward = vec3_normalize(vec3_sub(camera->at, camera->from))};
    view.right = vec3_normalize(vec3_cross(view.forward, camera->up));
    view.up = vec3_cross(view.right, view.forward);
    view.half_height = tan(0.5 * camera->fov_degrees * radians);
    return view;
}

enum status export_check_lights(const struct scene *scene, struct error *error)
{
    for (size_t i = 0; i < scene->light_count; i++) {
        const struct light *light = &scene->lights[i];
        if (light->kind != LIGHT_POINT || light->falloff[1] != 0 || light->falloff[2] != 0)
            return error_set(error, STATUS_INPUT, "lights[%zu]: only point lights without falloff are exported", i);
    }
    return STATUS_OK;
}

struct vec3 export_light_color(const struct light *light)
{
    return vec3_scale(light->color, 1 / light->falloff[0]);
}

double export_mean(struct vec3 color)
{
    return (color.x + color.y + color.z) / 3;
}

double export_surface_share(const struct material *material)
{
    if (material->ior > 0)
        return 0;
    return fmax(0, 1 - export_mean(material->reflection) - material->transparency);
}

struct export_face export_box_face(const struct shape *box, int face)
{
    struct vec3 low = box->box.min, size = vec3_sub(box->box.max, box->box.min);
    struct vec3 x = {size.x, 0, 0}, y = {0, size.y, 0}, z = {0, 0, size.z};
    const struct export_face faces[BOX_FACES] = {
        {vec3_add(vec3_add(low, x), z), vec3_neg(z), y}, /* +x */
        {low, z, y},                                     /* −x */
        {vec3_add(vec3_add(low, y), z), x, vec3_neg(z)}, /* +y */
        {low, x, z},                                     /* −y */
        {vec3_add(low, z), x, y},                        /* +z */
        {vec3_add(low, x), vec3_neg(x), y},              /* −z */
    };
    return faces[face];
}

struct export_face export_planar_face(const struct texture *texture)
{
    return (struct export_face){texture->origin, texture->axis_u, texture->axis_v};
}

/* --- the program ------------------------------------------------------------------------------------------ */

/* The path's folder with its '/', or "". The caller frees. */
static char *folder_of(const char *path)
{
    char *folder = memory_string(path), *slash = strrchr(folder, '/');
    folder[slash ? slash - folder + 1 : 0] = '\0';
    return folder;
}

static char *absolute_folder_of(const char *path)
{
    char *absolute = realpath(path, NULL);
    char *folder = folder_of(absolute ? absolute : path);
    free(absolute);
    return folder;
}

static enum status write_scene(const struct scene *scene, char **argv, struct error *error)
{
    enum status (*write)(const struct export *out, struct error *error) =
        strcmp(argv[1], "pov") == 0 ? export_pov : export_tachyon;
    int64_t width, height;
    enum status status = options_size("size", argv[3], 1, IMAGE_SIDE_MAX, &width, &height, error);
    if (status != STATUS_OK)
        return status;
    FILE *to = fopen(argv[4], "w");
    if (!to)
        return error_set(error, STATUS_OUTPUT, "%s: %s", argv[4], strerror(errno));
    char *scene_folder = absolute_folder_of(argv[2]), *output_folder = folder_of(argv[4]);
    struct export out = {to, scene, scene_folder, output_folder, (uint32_t)width, (uint32_t)height};
    status = write(&out, error);
    if (fclose(to) != 0 && status == STATUS_OK)
        status = error_set(error, STATUS_OUTPUT, "%s: %s", argv[4], strerror(errno));
    free(scene_folder);
    free(output_folder);
    return status;
}

static enum status run(char **argv, struct error *error)
{
    struct scene scene = {0};
    struct asset_set assets;
    const char *name;
    asset_set_init_disk(&assets, argv[2], &name);
    enum status status = scene_load(&scene, name, &assets, error);
    if (status == STATUS_OK)
        status = write_scene(&scene, argv, error);
    scene_finish(&scene);
    asset_set_finish(&assets);
    return status;
}

int main(int argc, char **argv)
{
    if (argc != 5 || (strcmp(argv[1], "pov") != 0 && strcmp(argv[1], "tachyon") != 0)) {
        fprintf(stderr, "usage: export pov|tachyon SCENE WIDTHxHEIGHT FILE\n");
        return STATUS_USAGE;
    }
    struct error error;
    enum status status = run(argv, &error);
    if (status != STATUS_OK)
        fprintf(stderr, "export: %s\n", error.text);
    return status;
}
