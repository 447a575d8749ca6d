#include "scene/load.h"

#include <string.h>

#include "scene/json_scene.h"

enum status scene_load(struct scene *scene, const char *name, struct asset_set *assets, struct error *error)
{
    *scene = (struct scene){0};
    const char *dot = strrchr(name, '.');
    if (!dot || strcmp(dot, ".json") != 0)
        return error_set(error, STATUS_INPUT, "%s: expected a scene file whose name ends in .json", name);
    enum status status = json_scene_read(scene, name, assets, error);
    if (status != STATUS_OK)
        scene_finish(scene);
    return status;
}
