/*
 * Encoding a PNG row by row into a part_file. The same rows give the same bytes for one libpng and zlib:
 * there is no time stamp, and every setting of the compressor is fixed.
 */
#ifndef WEFT_IMAGE_PNG_WRITE_H
#define WEFT_IMAGE_PNG_WRITE_H

#include <stdint.h>

#include "base/error.h"
#include "image/part_file.h"
#include "image/writer.h"

struct png_encoder;

/* Writes everything up to the first row into `file`, which must outlive the encoder. The format is
 * PIXEL_SRGB8 or PIXEL_SRGB16. NULL on failure, with the reason in *status and *error; the file is then
 * discarded, as by the functions below. */
struct png_encoder *png_encoder_create(struct part_file *file, const struct image_description *description,
                                       enum status *status, struct error *error);

enum status png_encoder_row(struct png_encoder *encoder, const uint8_t *row, struct error *error);

/* Writes everything after the last row. */
enum status png_encoder_end(struct png_encoder *encoder, struct error *error);

/* Frees the encoder and leaves the file alone; encoder may be NULL. */
void png_encoder_destroy(struct png_encoder *encoder);

#endif
