/* Scenes from files, for tests. */
#ifndef WEFT_TESTS_SCENE_FILE_H
#define WEFT_TESTS_SCENE_FILE_H

#include "scene/load.h"

/* The scene of that file, at that size (pixels); the caller finishes it. A file that cannot be read fails the test. */
static inline struct scene scene_of_file(const char *path, uint32_t width, uint32_t height)
{
    struct asset_set assets;
    struct scene scene = {0};
    struct error error;
    const char *name;
    asset_set_init_disk(&assets, path, &name);
    if (scene_load(&scene, name, &assets, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    asset_set_finish(&assets);
    scene.width = width;
    scene.height = height;
    return scene;
}

#endif
