/*
 * Pictures to look at, from tests that compare them.
 */
#ifndef WEFT_TESTS_PICTURE_FILE_H
#define WEFT_TESTS_PICTURE_FILE_H

#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "image/writer.h"
#include "math/colour.h"
#include "scene/model.h"

static inline void picture_put(uint8_t *at, struct vec3 color)
{
    colour_quantize8(&color, 1, at);
}

/* If HARD_PICTURES names a folder, LABEL.png there: the picture as found, as expected, and white where they are
 * equal to within the tolerance and red elsewhere. */
static inline void picture_file_write(const struct scene *scene, const char *label, const struct vec3 *found,
                                      const struct vec3 *expected, double tolerance)
{
    const char *folder = getenv("HARD_PICTURES");
    if (!folder)
        return;
    char path[512];
    snprintf(path, sizeof path, "%s/%s.png", folder, label);
    struct image_description description = {3 * scene->width, scene->height, PIXEL_SRGB8, "weft", label};
    enum status status;
    struct error error;
    struct image_writer *writer = image_writer_create(path, &description, &status, &error);
    uint8_t *row = memory_array((size_t)scene->width, 9);
    for (uint32_t y = 0; writer && y < scene->height; y++) {
        for (uint32_t x = 0; x < scene->width; x++) {
            size_t i = (size_t)y * scene->width + x;
            bool equal = vec3_max_abs(vec3_sub(found[i], expected[i])) <= tolerance;
            picture_put(row + 3 * (size_t)x, found[i]);
            picture_put(row + 3 * ((size_t)x + scene->width), expected[i]);
            picture_put(row + 3 * ((size_t)x + 2 * (size_t)scene->width), vec3_make(1, equal, equal));
        }
        if (image_writer_row(writer, row, &error) != STATUS_OK)
            break;
    }
    if (writer)
        image_writer_complete(&writer, &error);
    free(row);
}

#endif
