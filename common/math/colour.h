/*
 * sRGB (IEC 61966-2-1) and linear light.
 */
#ifndef WEFT_MATH_COLOUR_H
#define WEFT_MATH_COLOUR_H

#include <stdint.h>

#include "math/vec3.h"

/* The sRGB transfer functions, for values within 0..1 (a value outside is clamped, NaN becomes 0). */
double colour_encode_srgb(double linear);
double colour_decode_srgb(double encoded);

/* Linear light 0..1 to the nearest 8 or 16 bit sRGB code, rounding half up. */
uint8_t colour_quantize8(double linear);
uint16_t colour_quantize16(double linear);

/* The linear light of an 8 bit sRGB code; equal to colour_decode_srgb(code / 255.0). */
double colour_from_srgb8(uint8_t code);

#endif
