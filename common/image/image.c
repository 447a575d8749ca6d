#include "image/image.h"

#include <stdlib.h>

#include "base/bytes.h"
#include "image/kind.h"

/* The largest file worth reading: a PFM, whose pixels take most bytes, with room for its header. */
static const size_t FILE_BYTES_MAX = (size_t)IMAGE_PIXELS_MAX * 12 + 4096;

void image_finish(struct image *image)
{
    free(image->rgb);
    *image = (struct image){0};
}

static enum status decode_any(struct image *image, const struct bytes *file, const char *name,
                              struct error *error)
{
    switch (image_kind_of(file->data, file->size)) {
    case IMAGE_KIND_PNG:
        return image_decode_png(image, file->data, file->size, name, error);
    case IMAGE_KIND_PFM:
        return image_decode_pfm(image, file->data, file->size, name, error);
    case IMAGE_KIND_OTHER:
        break;
    }
    char found[IMAGE_KIND_TEXT_BYTES];
    image_kind_describe(file->data, file->size, found);
    return error_set(error, STATUS_INPUT, "%s: expected a PNG or PFM image, found %s", name, found);
}

enum status image_read_file(struct image *image, const char *path, struct error *error)
{
    struct bytes file = {0};
    enum status status = bytes_read_file(&file, path, FILE_BYTES_MAX, error);
    if (status == STATUS_OK)
        status = decode_any(image, &file, path, error);
    bytes_finish(&file);
    return status;
}
