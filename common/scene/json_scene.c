#include "scene/json_scene.h"

#include <stdlib.h>

#include "base/memory.h"
#include "scene/json_syntax.h"
#include "scene/json_tree.h"

/* --- image and camera ------------------------------------------------------------------------------------- */

static void read_image_settings(struct json_at at, struct scene *scene)
{
    static const char *const keys[] = {"width", "height", "samples", "filter", NULL};
    size_t filter = FILTER_BOX;
    json_keys(at, keys, NULL);
    json_whole(json_get(&at, "width"), 1, IMAGE_SIDE_MAX, &scene->width);
    json_whole(json_get(&at, "height"), 1, IMAGE_SIDE_MAX, &scene->height);
    json_whole(json_get(&at, "samples"), 1, SCENE_SAMPLES_MAX, &scene->samples);
    json_choice(json_get(&at, "filter"), pixel_filter_names, PIXEL_FILTERS, &filter);
    scene->filter = (enum pixel_filter)filter;
}

static void read_camera(struct json_at at, struct camera *camera)
{
    static const char *const keys[] = {"from", "at", "up", "fov", NULL};
    static const struct json_range fov = {0, 180, true, true, false};
    camera->up = vec3_make(0, 1, 0);
    camera->fov_degrees = 40;
    json_keys(at, keys, NULL);
    json_point(json_need(&at, "from"), &camera->from);
    json_point(json_need(&at, "at"), &camera->at);
    json_direction(json_get(&at, "up"), &camera->up);
    json_number(json_get(&at, "fov"), &fov, &camera->fov_degrees);
    const char *fault = at.reader->status == STATUS_OK ? camera_fault(camera) : NULL;
    if (fault)
        json_refuse(&at, "%s", fault);
}

/* --- background ------------------------------------------------------------------------------------------- */

static void read_background_gradient(struct json_at at, struct background *background)
{
    static const char *const keys[] = {"type", "bottom", "top", NULL};
    background->kind = BACKGROUND_GRADIENT;
    json_keys(at, keys, NULL);
    json_colour(json_need(&at, "bottom"), &json_not_negative, &background->color[0]);
    json_colour(json_need(&at, "top"), &json_not_negative, &background->color[1]);
}

static void read_background_image(struct scene_reader *reader, struct json_at at)
{
    static const char *const keys[] = {"type", "file", NULL};
    reader->scene->background.kind = BACKGROUND_IMAGE;
    json_keys(at, keys, NULL);
    json_image(reader, json_need(&at, "file"), &reader->scene->background.image);
}

static void read_background(struct scene_reader *reader, struct json_at at)
{
    static const char *const types[] = {"gradient", "image"};
    if (!cJSON_IsObject(at.value)) {
        json_colour(at, &json_not_negative, &reader->scene->background.color[0]);
        return;
    }
    size_t type = 0;
    json_choice(json_need(&at, "type"), types, sizeof types / sizeof *types, &type);
    if (type == 0)
        read_background_gradient(at, &reader->scene->background);
    else
        read_background_image(reader, at);
}

/* --- lights and objects ----------------------------------------------------------------------------------- */

static void read_lights(struct json_at at, struct scene *scene)
{
    json_array(at, 0, SIZE_MAX, "lights");
    for (struct json_at item = json_first(&at); item.value; json_next(&item)) {
        scene->lights = memory_grow(scene->lights, &scene->light_capacity, scene->light_count + 1,
                                    sizeof *scene->lights);
        json_light(item, &scene->lights[scene->light_count++]);
    }
}

static void read_object(struct scene_reader *reader, struct json_at at)
{
    const char *label = NULL; /* for people; only checked */
    struct object *object = scene_add_object(reader->scene);
    json_shape(at, &object->shape);
    json_text(json_get(&at, "name"), &label);
    json_transform(json_get(&at, "transform"), &object->transform);
    json_object_material(reader, json_get(&at, "material"), &object->shape, &object->material);
}

static void read_objects(struct scene_reader *reader, struct json_at at)
{
    json_array(at, 0, SIZE_MAX, "objects");
    for (struct json_at item = json_first(&at); item.value; json_next(&item)) {
        if (json_is_mesh_file(&item))
            json_mesh_file(reader, item);
        else
            read_object(reader, item);
    }
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void read_scene(struct scene_reader *reader, struct json_at at)
{
    static const char *const keys[] = {"$schema", "image",     "camera",  "background", "ambient", "depth",
                                       "lights",  "materials", "objects", NULL};
    struct scene *scene = reader->scene;
    const char *schema = NULL; /* for editors; only checked */
    scene->width = SCENE_WIDTH_DEFAULT;
    scene->height = SCENE_HEIGHT_DEFAULT;
    scene->depth = SCENE_DEPTH_DEFAULT;
    scene->ambient = vec3_make(1, 1, 1);
    json_check_duplicates(at);
    json_keys(at, keys, NULL);
    json_text(json_get(&at, "$schema"), &schema);
    read_image_settings(json_get(&at, "image"), scene);
    read_camera(json_need(&at, "camera"), &scene->camera);
    read_background(reader, json_get(&at, "background"));
    json_colour(json_get(&at, "ambient"), &json_not_negative, &scene->ambient);
    json_whole(json_get(&at, "depth"), 0, SCENE_DEPTH_MAX, &scene->depth);
    read_lights(json_get(&at, "lights"), scene);
    json_materials(reader, json_get(&at, "materials"));
    read_objects(reader, json_get(&at, "objects"));
    json_materials_finish(reader);
    json_mesh_files_finish(reader);
}

/* Text to tree. *tree is the caller's to delete. */
static enum status parse(const struct asset *asset, const char *file, cJSON **tree, struct error *error)
{
    const char *text = (const char *)asset->bytes.data;
    enum status status = json_syntax_check(file, text, asset->bytes.size, error);
    return status == STATUS_OK ? json_tree_build(file, text, asset->bytes.size, tree, error) : status;
}

enum status json_scene_read(struct scene *scene, const char *name, struct asset_set *assets,
                            struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    char *file = asset_set_path(assets, name);
    cJSON *tree = NULL;
    enum status status = parse(asset, file, &tree, error);
    if (status == STATUS_OK) {
        struct scene_reader reader = {
            .json = {.file = file, .error = error},
            .scene = scene,
            .assets = assets,
            .name = name,
            .default_material = SIZE_MAX,
        };
        read_scene(&reader, (struct json_at){.reader = &reader.json, .value = tree});
        status = reader.json.status;
    }
    cJSON_Delete(tree);
    free(file);
    return status;
}
