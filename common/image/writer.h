/*
 * Writing an image file row by row, so that the whole image is never in memory. The rows go to a
 * temporary file beside the output; the output appears by rename when it is complete, or not at all.
 */
#ifndef WEFT_IMAGE_WRITER_H
#define WEFT_IMAGE_WRITER_H

#include <stdint.h>

#include "base/error.h"
#include "image/encode.h"

struct image_writer;

struct image_description {
    uint32_t width, height; /* 1..IMAGE_SIDE_MAX */
    enum pixel_format format; /* PIXEL_LINEAR writes PFM, the others PNG */
    const char *software; /* PNG text chunk "Software" */
    const char *source;   /* PNG text chunk "Source"; both in UTF-8 and not NULL */
};

/* Creates the temporary file in the folder of `path` and writes the header. NULL, with the sentence and
 * STATUS_OUTPUT in *status, if that fails; the file at `path` is not touched. `path` must
 * be new or a regular file; a symbolic link to one will be replaced, not followed. The strings are copied. */
struct image_writer *image_writer_create(const char *path, const struct image_description *description,
                                         enum status *status, struct error *error);

/* Writes the next row, counted from the top: width * pixel_format_bytes(format) bytes. On failure
 * (STATUS_OUTPUT) the temporary file is gone, and only image_writer_abandon may follow. */
enum status image_writer_row(struct image_writer *writer, const uint8_t *row, struct error *error);

/* After the last row: completes the file, fsyncs it, renames it to `path`, and fsyncs the folder. Frees the
 * writer and sets *writer to NULL whether it succeeds or not; on failure the temporary file is gone. */
enum status image_writer_complete(struct image_writer **writer, struct error *error);

/* Removes the temporary file, frees the writer and sets *writer to NULL; *writer may be NULL. */
void image_writer_abandon(struct image_writer **writer);

#endif
