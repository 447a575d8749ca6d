#include "math/colour.h"

#include <math.h>
#include <pthread.h>

#include "math/elementary.h"

/* Of equally wide buckets of linear light. The borders between codes are nearest to each other on the
 * straight part of the curve, 1 / (255 × 12.92) apart: no bucket holds two. */
enum { BUCKETS = 4096 };

static struct {
    double linear[256];     /* of each code */
    double border[257];     /* the least value that quantizes to this code; beyond the last, infinity */
    uint8_t first[BUCKETS]; /* the code of the bucket's lower end */
} tables;

/* NaN becomes 0. */
static double clamped(double value)
{
    return value > 0 ? (value < 1 ? value : 1) : 0;
}

double colour_encode_srgb(double linear)
{
    double value = clamped(linear);
    if (value == 1) /* 1.055 − 0.055 falls short of it */
        return 1;
    return value <= 0.0031308 ? 12.92 * value : 1.055 * math_pow(value, 1 / 2.4) - 0.055;
}

double colour_decode_srgb(double encoded)
{
    double value = clamped(encoded);
    return value <= 0.04045 ? value / 12.92 : math_pow((value + 0.055) / 1.055, 2.4);
}

/* The definition: the code nearest to highest × encoded, rounding half up. */
static double quantized(double linear, double highest)
{
    return floor(highest * colour_encode_srgb(linear) + 0.5);
}

/* The least double that quantizes to `code` of 8 bits, code >= 1, by bisection down to neighbours. */
static double border_below(int code)
{
    double below = colour_decode_srgb((code - 1) / 255.0), above = colour_decode_srgb(code / 255.0);
    for (;;) {
        double middle = below + (above - below) / 2;
        if (middle <= below || middle >= above)
            return above;
        if (quantized(middle, 255) < code)
            below = middle;
        else
            above = middle;
    }
}

static void fill_tables(void)
{
    for (int code = 0; code < 256; code++) {
        tables.linear[code] = colour_decode_srgb(code / 255.0);
        tables.border[code] = code == 0 ? 0 : border_below(code);
    }
    tables.border[256] = INFINITY;
    for (int i = 0; i < BUCKETS; i++)
        tables.first[i] = (uint8_t)quantized(i / (double)BUCKETS, 255);
}

static void need_tables(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, fill_tables);
}

uint8_t colour_quantize8(double linear)
{
    need_tables();
    if (!(linear > 0))
        return 0;
    if (linear >= 1)
        return 255;
    unsigned code = tables.first[(int)(linear * BUCKETS)];
    return (uint8_t)(code + (linear >= tables.border[code + 1]));
}

uint16_t colour_quantize16(double linear)
{
    return (uint16_t)quantized(linear, 65535);
}

double colour_from_srgb8(uint8_t code)
{
    need_tables();
    return tables.linear[code];
}
