/* Meshes in .ply. */
#include "tests/fuzz/scene_help.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct asset_set assets = {0};
    add_text(&assets, "scene.json", "{\"camera\": {\"from\": [0, 0, 5], \"at\": [0, 0, 0]},"
                                    " \"objects\": [{\"type\": \"mesh\", \"file\": \"mesh.ply\"}]}");
    add_bytes(&assets, "mesh.ply", data, size);
    try_scene(&assets, "scene.json");
    return 0;
}
