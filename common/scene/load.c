#include "scene/load.h"

#include <string.h>

#include "scene/json_scene.h"
#include "scene/nff.h"

enum status scene_check_size(const struct scene *scene, const char *name, struct error *error)
{
    size_t primitives = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        primitives += scene->objects[i].shape.kind == SHAPE_MESH ? scene->objects[i].shape.mesh.triangle_count : 1;
    if (primitives <= SCENE_PRIMITIVES_MAX)
        return STATUS_OK;
    return error_set(error, STATUS_INPUT,
                     "%s: expected at most %u primitives (each triangle counts, of a mesh anew for each object), "
                     "found %zu",
                     name, SCENE_PRIMITIVES_MAX, primitives);
}

enum status scene_load(struct scene *scene, const char *name, struct asset_set *assets, struct error *error)
{
    return scene_load_with(scene, name, assets, IMAGES_DECODED, error);
}

enum status scene_load_with(struct scene *scene, const char *name, struct asset_set *assets, enum image_use use,
                            struct error *error)
{
    *scene = (struct scene){.image_use = use};
    enum status status;
    const char *dot = strrchr(name, '.');
    if (dot && strcmp(dot, ".json") == 0)
        status = json_scene_read(scene, name, assets, error);
    else if (dot && strcmp(dot, ".nff") == 0)
        status = nff_scene_read(scene, name, assets, error);
    else
        status = error_set(error, STATUS_INPUT, "%s: expected a scene file whose name ends in .json or .nff", name);
    if (status == STATUS_OK)
        status = scene_check_size(scene, name, error);
    if (status != STATUS_OK)
        scene_finish(scene);
    return status;
}
