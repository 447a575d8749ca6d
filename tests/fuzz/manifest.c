/* Manifests. One that is taken has just one encoding. */
#include "tests/fuzz/fuzz.h"
#include "wire/manifest.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct manifest manifest = {0};
    struct error error = {{0}};
    enum status status = manifest_decode(&manifest, data, size, &error);
    if (status != STATUS_OK) {
        require_refusal(status, &error);
        require(!manifest.entries && manifest.count == 0);
        return 0;
    }
    struct bytes again = {0};
    manifest_encode(&manifest, &again);
    require(again.size == size && memcmp(again.data, data, size) == 0);
    bytes_finish(&again);
    manifest_finish(&manifest);
    return 0;
}
