/*
 * The pixel formats of output: how rows of pixels are laid out in bytes, on the wire as in the writer.
 */
#ifndef WEFT_IMAGE_ENCODE_H
#define WEFT_IMAGE_ENCODE_H

#include <stddef.h>
#include <stdint.h>

#include "math/vec3.h"

enum pixel_format {
    PIXEL_SRGB8,   /* 3 bytes: sRGB codes */
    PIXEL_SRGB16,  /* 6 bytes: sRGB codes, big-endian as in PNG */
    PIXEL_LINEAR,  /* 12 bytes: linear light, little-endian IEEE floats as in PFM, not clamped;
                    * all NaNs become one */
    PIXEL_FORMATS, /* how many there are */
};

/* Bytes a pixel. */
size_t pixel_format_bytes(enum pixel_format format);

/* Encodes `count` pixels of linear light into out[count * pixel_format_bytes(format)]. */
void pixel_format_encode(enum pixel_format format, const struct vec3 *pixels, size_t count, uint8_t *out);

#endif
