#include "image/kind.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* The signatures of the two kinds we read and of those that people have at hand. */
static const struct {
    enum image_kind kind;
    size_t size;
    const char *start;
    const char *name;
} signatures[] = {
    {IMAGE_KIND_PNG, 8, "\x89PNG\r\n\x1a\n", "a PNG image"},
    {IMAGE_KIND_PFM, 2, "PF", "a PFM image"},
    {IMAGE_KIND_PFM, 2, "Pf", "a PFM image"},
    {IMAGE_KIND_OTHER, 3, "\xff\xd8\xff", "a JPEG image"},
    {IMAGE_KIND_OTHER, 4, "GIF8", "a GIF image"},
    {IMAGE_KIND_OTHER, 4, "RIFF", "a RIFF file (WebP?)"},
    {IMAGE_KIND_OTHER, 4, "II*\0", "a TIFF image"},
    {IMAGE_KIND_OTHER, 4, "MM\0*", "a TIFF image"},
    {IMAGE_KIND_OTHER, 4, "\x76\x2f\x31\x01", "an OpenEXR image"},
    {IMAGE_KIND_OTHER, 2, "#?", "a Radiance HDR image"},
    {IMAGE_KIND_OTHER, 2, "BM", "a BMP image"},
};

enum { SIGNATURES = sizeof signatures / sizeof *signatures };

/* The index of the signature that the data starts with; SIGNATURES if none. */
static size_t find_signature(const void *data, size_t size)
{
    for (size_t i = 0; i < SIGNATURES; i++)
        if (size >= signatures[i].size && memcmp(data, signatures[i].start, signatures[i].size) == 0)
            return i;
    return SIGNATURES;
}

enum image_kind image_kind_of(const void *data, size_t size)
{
    size_t i = find_signature(data, size);
    return i < SIGNATURES ? signatures[i].kind : IMAGE_KIND_OTHER;
}

void image_kind_describe(const void *data, size_t size, char text[IMAGE_KIND_TEXT_BYTES])
{
    size_t i = find_signature(data, size);
    if (size == 0 || i < SIGNATURES) {
        snprintf(text, IMAGE_KIND_TEXT_BYTES, "%s", size == 0 ? "an empty file" : signatures[i].name);
        return;
    }
    const uint8_t *bytes = data;
    int length = snprintf(text, IMAGE_KIND_TEXT_BYTES, "a file that begins with the bytes");
    for (size_t b = 0; b < size && b < 8; b++)
        length += snprintf(text + length, IMAGE_KIND_TEXT_BYTES - (size_t)length, " %02x", bytes[b]);
}
