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

static void put_srgb8(double linear, uint8_t out[1])
{
    out[0] = colour_quantize8(linear);
}

static void put_srgb16(double linear, uint8_t out[2])
{
    uint16_t code = colour_quantize16(linear);
    out[0] = (uint8_t)(code >> 8);
    out[1] = (uint8_t)code;
}

/* The bits of a NaN depend on the CPU that made it, so every NaN is written as the same one. */
static void put_linear(double linear, uint8_t out[4])
{
    float value = (float)linear;
    uint32_t bits = 0x7fc00000;
    if (!isnan(value))
        memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 4; i++)
        out[i] = (uint8_t)(bits >> 8 * i);
}

void pixel_format_encode(enum pixel_format format, const struct vec3 *pixels, size_t count, uint8_t *out)
{
    static void (*const put[PIXEL_FORMATS])(double, uint8_t *) = {
        [PIXEL_SRGB8] = put_srgb8,
        [PIXEL_SRGB16] = put_srgb16,
        [PIXEL_LINEAR] = put_linear,
    };
    size_t channel_bytes = pixel_format_bytes(format) / 3;
    for (size_t i = 0; i < count; i++, out += 3 * channel_bytes) {
        put[format](pixels[i].x, out);
        put[format](pixels[i].y, out + channel_bytes);
        put[format](pixels[i].z, out + 2 * channel_bytes);
    }
}
