/*
 * The image files of a scene, each read and decoded (or only checked) once.
 */
#ifndef WEFT_SCENE_IMAGES_H
#define WEFT_SCENE_IMAGES_H

#include <stddef.h>

#include "base/error.h"
#include "scene/assets.h"
#include "scene/model.h"

/* *index becomes the place in scene->images of the PNG file that `from` (an asset's name) calls
 * `reference`; it is read through `assets` at its first use, and then dealt with as scene->image_use says.
 * STATUS_INPUT and a sentence that names the file if it is missing or broken. */
enum status scene_image_use(struct scene *scene, struct asset_set *assets, const char *from,
                            const char *reference, size_t *index, struct error *error);

/* Decodes, on up to `threads` threads, the images of a scene that was loaded with IMAGES_NAMED through these assets.
 * STATUS_INPUT and a sentence that names the first broken file. */
enum status scene_images_decode(struct scene *scene, const struct asset_set *assets, int threads,
                                struct error *error);

#endif
