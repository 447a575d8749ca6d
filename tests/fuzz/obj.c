/* Meshes in .obj with their materials: what follows the line "=== mesh.mtl" is that file. */
#include "tests/fuzz/scene_help.h"

static const char separator[] = "\n=== mesh.mtl\n";

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct asset_set assets = {0};
    size_t length = sizeof separator - 1;
    const uint8_t *found = size > 0 ? memmem(data, size, separator, length) : NULL;
    size_t obj_size = found ? (size_t)(found - data) + 1 : size; /* with its last end of line */
    add_text(&assets, "scene.json", "{\"camera\": {\"from\": [0, 0, 5], \"at\": [0, 0, 0]},"
                                    " \"objects\": [{\"type\": \"mesh\", \"file\": \"mesh.obj\"}]}");
    add_bytes(&assets, "mesh.obj", data, obj_size);
    if (found)
        add_bytes(&assets, "mesh.mtl", found + length, size - (size_t)(found - data) - length);
    add_files(&assets);
    try_scene(&assets, "scene.json");
    return 0;
}
