#ifndef WEFT_SCENE_LOAD_H
#define WEFT_SCENE_LOAD_H

#include "base/error.h"
#include "scene/assets.h"
#include "scene/model.h"

/* Reads and validates the scene file called `name` and everything that it reaches, through `assets`, which
 * afterwards holds exactly what was reached. The format follows the name's ending (.json or .nff). On failure
 * *scene stays empty; STATUS_INPUT and a sentence with file, JSON path (or line, or byte), what was
 * expected and what was found. */
enum status scene_load(struct scene *scene, const char *name, struct asset_set *assets, struct error *error);

/* The same, but with its images so. */
enum status scene_load_with(struct scene *scene, const char *name, struct asset_set *assets, enum image_use use,
                            struct error *error);

/* Refuses, likewise, a scene of more than SCENE_PRIMITIVES_MAX primitives; scene_load does. */
enum status scene_check_size(const struct scene *scene, const char *name, struct error *error);

#endif
