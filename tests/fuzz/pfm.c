/* PFM images. */
#include <math.h>

#include "image/image.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct image image = {0};
    struct error error = {{0}};
    enum status status = image_decode_pfm(&image, data, size, "a.pfm", &error);
    if (status != STATUS_OK)
        require_refusal(status, &error);
    for (size_t i = 0; status == STATUS_OK && i < (size_t)image.width * image.height * 3; i++)
        require(isfinite(image.rgb[i]));
    require((status == STATUS_OK) == (image.rgb != NULL));
    image_finish(&image);
    return 0;
}
