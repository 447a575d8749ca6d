/*
 * What kind of file some bytes begin, for choosing a reader and for saying what was found instead.
 */
#ifndef WEFT_IMAGE_KIND_H
#define WEFT_IMAGE_KIND_H

#include <stddef.h>

enum image_kind { IMAGE_KIND_OTHER, IMAGE_KIND_PNG, IMAGE_KIND_PFM };

enum { IMAGE_KIND_TEXT_BYTES = 80 };

/* Judges by the first bytes alone. */
enum image_kind image_kind_of(const void *data, size_t size);

/* The end of a sentence "expected ..., found": "an empty file", "a JPEG image", or the first bytes in
 * hexadecimal. */
void image_kind_describe(const void *data, size_t size, char text[IMAGE_KIND_TEXT_BYTES]);

#endif
