#include "coordinator/assembly.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

struct assembly {
    struct image_writer *writer;
    uint32_t height, written; /* rows */
    size_t row_bytes;
    uint8_t **waiting; /* pixels of rows that came before their turn, or NULL */
    struct row_figures figures;
};

struct assembly *assembly_create(const char *path, const struct image_description *description, enum status *status,
                                 struct error *error)
{
    struct image_writer *writer = image_writer_create(path, description, status, error);
    if (!writer)
        return NULL;
    struct assembly *a = memory_array(1, sizeof *a);
    a->writer = writer;
    a->height = description->height;
    a->row_bytes = description->width * pixel_format_bytes(description->format);
    a->waiting = memory_array(a->height, sizeof *a->waiting);
    return a;
}

size_t assembly_record_bytes(const struct assembly *a)
{
    return row_record_bytes(a->row_bytes);
}

static void take_row(struct assembly *a, uint32_t row, const uint8_t *record)
{
    struct row_figures figures;
    const uint8_t *pixels = row_record_decode(record, &figures);
    assert(row < a->height && row >= a->written && !a->waiting[row]);
    a->waiting[row] = memory_array(a->row_bytes, 1);
    memcpy(a->waiting[row], pixels, a->row_bytes);
    a->figures.samples += figures.samples;
    a->figures.secondary_rays += figures.secondary_rays;
    a->figures.shadow_rays += figures.shadow_rays;
}

enum status assembly_add(struct assembly *a, uint32_t first_row, uint32_t rows, const uint8_t *records,
                         struct error *error)
{
    for (uint32_t i = 0; i < rows; i++)
        take_row(a, first_row + i, records + i * assembly_record_bytes(a));
    while (a->written < a->height && a->waiting[a->written]) {
        enum status status = image_writer_row(a->writer, a->waiting[a->written], error);
        if (status != STATUS_OK)
            return status;
        free(a->waiting[a->written]);
        a->waiting[a->written++] = NULL;
    }
    return STATUS_OK;
}

struct row_figures assembly_figures(const struct assembly *a)
{
    return a->figures;
}

static void assembly_free(struct assembly **pointer)
{
    struct assembly *a = *pointer;
    for (uint32_t i = a->written; i < a->height; i++)
        free(a->waiting[i]);
    free(a->waiting);
    free(a);
    *pointer = NULL;
}

enum status assembly_complete(struct assembly **pointer, struct error *error)
{
    assert((*pointer)->written == (*pointer)->height);
    enum status status = image_writer_complete(&(*pointer)->writer, error);
    assembly_free(pointer);
    return status;
}

void assembly_abandon(struct assembly **pointer)
{
    if (!*pointer)
        return;
    image_writer_abandon(&(*pointer)->writer);
    assembly_free(pointer);
}
