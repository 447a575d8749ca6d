#include "image/writer.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "image/part_file.h"
#include "image/png_write.h"

/* A PFM's rows stand bottom-up and uncompressed, so each has its place in the file from the start; the
 * rows of a PNG go through an encoder. */
struct image_writer {
    struct part_file file;
    uint32_t width, height;
    uint32_t rows;           /* written so far */
    struct png_encoder *png; /* NULL for a PFM */
    uint64_t pfm_header_bytes;
};

static enum status write_pfm_header(struct image_writer *writer, struct error *error)
{
    char header[64];
    int length = snprintf(header, sizeof header, "PF\n%u %u\n-1.0\n", writer->width, writer->height);
    writer->pfm_header_bytes = (uint64_t)length;
    return part_file_write(&writer->file, header, (size_t)length, 0, error);
}

static enum status write_pfm_row(struct image_writer *writer, const uint8_t *row, struct error *error)
{
    size_t size = writer->width * pixel_format_bytes(PIXEL_LINEAR);
    uint64_t from_bottom = writer->height - 1 - writer->rows;
    return part_file_write(&writer->file, row, size, writer->pfm_header_bytes + from_bottom * size, error);
}

static enum status start(struct image_writer *writer, const char *path,
                         const struct image_description *description, struct error *error)
{
    enum status status = part_file_open(&writer->file, path, error);
    if (status != STATUS_OK)
        return status;
    if (description->format == PIXEL_LINEAR)
        return write_pfm_header(writer, error);
    writer->png = png_encoder_create(&writer->file, description, &status, error);
    return status;
}

struct image_writer *image_writer_create(const char *path, const struct image_description *description,
                                         enum status *status, struct error *error)
{
    assert(description->width >= 1 && description->height >= 1);
    struct image_writer *writer = memory_array(1, sizeof *writer);
    writer->width = description->width;
    writer->height = description->height;
    *status = start(writer, path, description, error);
    if (*status != STATUS_OK)
        image_writer_abandon(&writer);
    return writer;
}

enum status image_writer_row(struct image_writer *writer, const uint8_t *row, struct error *error)
{
    assert(writer->file.fd >= 0 && writer->rows < writer->height);
    enum status status = writer->png ? png_encoder_row(writer->png, row, error)
                                     : write_pfm_row(writer, row, error);
    if (status == STATUS_OK)
        writer->rows++;
    return status;
}

enum status image_writer_complete(struct image_writer **writer, struct error *error)
{
    struct image_writer *w = *writer;
    assert(w->file.fd >= 0 && w->rows == w->height);
    enum status status = w->png ? png_encoder_end(w->png, error) : STATUS_OK;
    if (status == STATUS_OK)
        status = part_file_publish(&w->file, error);
    image_writer_abandon(writer);
    return status;
}

void image_writer_abandon(struct image_writer **writer)
{
    if (!*writer)
        return;
    part_file_discard(&(*writer)->file);
    png_encoder_destroy((*writer)->png);
    free(*writer);
    *writer = NULL;
}
