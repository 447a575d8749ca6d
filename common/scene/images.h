/*
 * The image files of a scene, each read and decoded once.
 */
#ifndef WEFT_SCENE_IMAGES_H
#define WEFT_SCENE_IMAGES_H

#include <stddef.h>

#include "base/error.h"
#include "scene/assets.h"
#include "scene/model.h"

/* *index becomes the place in scene->images of the PNG file that `from` (an asset's name) calls
 * `reference`; it is read through `assets` and decoded at its first use. STATUS_INPUT and a sentence that
 * names the file if it is missing or broken. */
enum status scene_image_use(struct scene *scene, struct asset_set *assets, const char *from,
                            const char *reference, size_t *index, struct error *error);

#endif
