/* Scenes in JSON, which may name the files of add_files. */
#include "tests/fuzz/scene_help.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct asset_set assets = {0};
    add_bytes(&assets, "scene.json", data, size);
    add_files(&assets);
    try_scene(&assets, "scene.json");
    return 0;
}
