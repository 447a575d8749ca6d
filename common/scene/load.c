#include "scene/load.h"

#include <string.h>

#include "scene/json_scene.h"
#include "scene/nff.h"

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
    if (status != STATUS_OK)
        scene_finish(scene);
    return status;
}
