/*
 * Whole images in memory, in linear light, and reading them from PNG and PFM files.
 */
#ifndef WEFT_IMAGE_IMAGE_H
#define WEFT_IMAGE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum {
    IMAGE_SIDE_MAX = 65535,             /* pixels */
    IMAGE_PIXELS_MAX = 1 << 28,         /* an image that is decoded whole: 3 GiB of floats */
};

/* rgb holds width * height * 3 floats: linear light, rows from the top, red green blue. Width and height
 * are 1..IMAGE_SIDE_MAX. All zero is no image; image_finish frees what it holds. */
struct image {
    uint32_t width, height;
    float *rgb;
};

void image_finish(struct image *image);

/* Decodes a PNG of any colour type and depth (8 and 16 bit codes are taken as sRGB, greys become equal
 * channels, transparency is dropped, gamma and colour-profile chunks are ignored). `name` is what the
 * error sentence calls it. On failure *image stays empty and the status is STATUS_INPUT. */
enum status image_decode_png(struct image *image, const void *data, size_t size, const char *name,
                             struct error *error);

/* Whether image_decode_png would decode that; if not, its status and sentence. Far cheaper, and holds only one row. */
enum status image_check_png(const void *data, size_t size, const char *name, struct error *error);

/* Decodes a PFM ("PF" colour or "Pf" grey, either byte order, rows from the bottom). The scale's
 * magnitude is ignored. A file that is shorter or longer than its header says, and infinities and NaNs,
 * are refused. */
enum status image_decode_pfm(struct image *image, const void *data, size_t size, const char *name,
                             struct error *error);

/* Reads a .png or .pfm file, told apart by its first bytes. */
enum status image_read_file(struct image *image, const char *path, struct error *error);

#endif
