#include "scene/images.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

static enum status read_pixels(struct image *image, const struct asset_set *assets, const struct asset *asset,
                               enum image_use use, struct error *error)
{
    if (use == IMAGES_NAMED)
        return STATUS_OK;
    char *path = asset_set_path(assets, asset->name);
    const struct bytes *bytes = &asset->bytes;
    enum status status = use == IMAGES_CHECKED ? image_check_png(bytes->data, bytes->size, path, error)
                                               : image_decode_png(image, bytes->data, bytes->size, path, error);
    free(path);
    return status;
}

static enum status add_image(struct scene *scene, struct asset_set *assets, const char *name,
                             struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    struct image image = {0};
    enum status status = read_pixels(&image, assets, asset, scene->image_use, error);
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

/* An image on its way from its bytes, and what came of it. */
struct decoding {
    const struct asset_set *assets;
    const struct asset *asset;
    struct image *image;
    enum status status;
    struct error error;
};

static void run_decoding(void *context, size_t index)
{
    struct decoding *one = (struct decoding *)context + index;
    one->status = read_pixels(one->image, one->assets, one->asset, IMAGES_DECODED, &one->error);
}

enum status scene_images_decode(struct scene *scene, const struct asset_set *assets, int threads,
                                struct error *error)
{
    struct decoding *all = memory_array(scene->image_count, sizeof *all);
    for (size_t i = 0; i < scene->image_count; i++)
        all[i] = (struct decoding){.assets = assets, .asset = asset_set_find(assets, scene->images[i].name),
                                   .image = &scene->images[i].image};
    parallel_for(threads, scene->image_count, run_decoding, all);
    enum status status = STATUS_OK;
    for (size_t i = 0; i < scene->image_count && status == STATUS_OK; i++) {
        status = all[i].status;
        *error = all[i].error;
    }
    free(all);
    return status;
}
