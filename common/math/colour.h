/*
 * sRGB (IEC 61966-2-1) and linear light.
 */
#ifndef WEFT_MATH_COLOUR_H
#define WEFT_MATH_COLOUR_H

#include <stddef.h>
#include <stdint.h>

#include "math/vec3.h"

/* The sRGB transfer functions, for values within 0..1 (a value outside is clamped, NaN becomes 0). */
double colour_encode_srgb(double linear);
double colour_decode_srgb(double encoded);

/* The same for many values at once, several times faster, and within 1e-14. */
void colour_encode_srgb_many(const float *linear, size_t count, double *encoded);

/* The same of colours, faster still, and within 2^-28. */
void colour_encode_srgb_near(const struct vec3 *linear, size_t count, struct vec3 *encoded);

/* Linear light to the nearest 8 or 16 bit sRGB codes, red, green and blue of `count` colours into
 * codes[3 * count]: the integer part of 255 or 65535 times colour_encode_srgb, plus a half. */
void colour_quantize8(const struct vec3 *linear, size_t count, uint8_t *codes);
void colour_quantize16(const struct vec3 *linear, size_t count, uint16_t *codes);

/* The linear light of an 8 bit sRGB code; equal to colour_decode_srgb(code / 255.0). */
double colour_from_srgb8(uint8_t code);

#endif
