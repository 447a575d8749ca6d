#include "image/encode.h"

#include <math.h>
#include <string.h>

#include "math/colour.h"

size_t pixel_format_bytes(enum pixel_format format)
{
    static const size_t bytes[PIXEL_FORMATS] = {
        [PIXEL_SRGB8] = 3,
        [PIXEL_SRGB16] = 6,
        [PIXEL_LINEAR] = 12,
    };
    return bytes[format];
}

static void put_srgb16(const struct vec3 *pixels, size_t count, uint8_t *out)
{
    enum { PIXELS_AT_ONCE = 64 };
    uint16_t codes[3 * PIXELS_AT_ONCE];
    for (size_t start = 0; start < count; start += PIXELS_AT_ONCE) {
        size_t pixels_now = count - start < PIXELS_AT_ONCE ? count - start : PIXELS_AT_ONCE;
        colour_quantize16(pixels + start, pixels_now, codes);
        for (size_t i = 0; i < 3 * pixels_now; i++, out += 2) {
            out[0] = (uint8_t)(codes[i] >> 8);
            out[1] = (uint8_t)codes[i];
        }
    }
}

/* The bits of a NaN depend on the CPU that made it, so every NaN is written as the same one. */
static void put_float(double linear, uint8_t out[4])
{
    float value = (float)linear;
    uint32_t bits = 0x7fc00000;
    if (!isnan(value))
        memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 4; i++)
        out[i] = (uint8_t)(bits >> 8 * i);
}

static void put_linear(const struct vec3 *pixels, size_t count, uint8_t *out)
{
    for (size_t i = 0; i < count; i++, out += 12) {
        put_float(pixels[i].x, out);
        put_float(pixels[i].y, out + 4);
        put_float(pixels[i].z, out + 8);
    }
}

void pixel_format_encode(enum pixel_format format, const struct vec3 *pixels, size_t count, uint8_t *out)
{
    static void (*const put[PIXEL_FORMATS])(const struct vec3 *, size_t, uint8_t *) = {
        [PIXEL_SRGB8] = colour_quantize8,
        [PIXEL_SRGB16] = put_srgb16,
        [PIXEL_LINEAR] = put_linear,
    };
    put[format](pixels, count, out);
}
