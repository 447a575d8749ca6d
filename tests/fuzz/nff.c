/* Scenes in the Neutral File Format. */
#include "tests/fuzz/scene_help.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct asset_set assets = {0};
    add_bytes(&assets, "scene.nff", data, size);
    try_scene(&assets, "scene.nff");
    return 0;
}
