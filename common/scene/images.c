#include "scene/images.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static enum status add_image(struct scene *scene, struct asset_set *assets, const char *name,
                             struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    struct image image = {0};
    char *path = asset_set_path(assets, name);
    enum status status = image_decode_png(&image, asset->bytes.data, asset->bytes.size, path, error);
    free(path);
    if (status != STATUS_OK)
        return status;
    scene->images =
        memory_grow(scene->images, &scene->image_capacity, scene->image_count + 1, sizeof *scene->images);
    scene->images[scene->image_count++] = (struct scene_image){.name = memory_string(name), .image = image};
    return STATUS_OK;
}

enum status scene_image_use(struct scene *scene, struct asset_set *assets, const char *from,
                            const char *reference, size_t *index, struct error *error)
{
    char name[ASSET_NAME_MAX + 1];
    enum status status = asset_name_join(name, from, reference, error);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < scene->image_count; i++)
        if (strcmp(scene->images[i].name, name) == 0) {
            *index = i;
            return STATUS_OK;
        }
    status = add_image(scene, assets, name, error);
    if (status == STATUS_OK)
        *index = scene->image_count - 1;
    return status;
}
