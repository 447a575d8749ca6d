#include "math/colour.h"

#include <pthread.h>
#include <stdbool.h>
#include <string.h>

#include "math/elementary.h"

/* The curve is straight up to here, and a power above. */
static const double STRAIGHT = 0.0031308;

/* Linear light from 2^-9, which is below STRAIGHT, to 1 in octaves, each cut into equal parts: `fine` ones so
 * narrow that none holds two borders between 8 bit codes, and `coarse` ones in which a cubic is near the curve. */
enum {
    OCTAVES = 9,
    FINE_BITS = 7,
    COARSE_BITS = 5,
};

struct fine_part {
    uint64_t code;   /* of its start */
    uint64_t border; /* the bits of the least double with the next code; of 1 if there is none */
};

/* The encoded value is nearly c0 + c1 d + c2 d² + c3 d³, d from the middle: the Taylor series of the power. Its
 * next term is below 0.046 (d / middle)^4, and d at most 1/65 of the middle: all within MARGIN. */
struct coarse_part {
    double middle, c[4];
};

static const double MARGIN = 0x1p-28;

static struct {
    struct fine_part fine[OCTAVES << FINE_BITS];
    struct coarse_part coarse[OCTAVES << COARSE_BITS];
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
    return value <= STRAIGHT ? 12.92 * value : 1.055 * math_pow(value, 1 / 2.4) - 0.055;
}

double colour_decode_srgb(double encoded)
{
    double value = clamped(encoded);
    return value <= 0.04045 ? value / 12.92 : math_pow((value + 0.055) / 1.055, 2.4);
}

void colour_encode_srgb_many(const float *linear, size_t count, double *encoded)
{
    for (size_t i = 0; i < count; i++) {
        double value = clamped(linear[i]), power = 1.055 * math_pow_unit(value, 1 / 2.4) - 0.055;
        power = value < 1 ? power : 1;
        encoded[i] = value <= STRAIGHT ? 12.92 * value : power;
    }
}

/* The definition: the code nearest to highest × encoded, rounding half up. */
static int quantized(double linear, double highest)
{
    return (int)(highest * colour_encode_srgb(linear) + 0.5);
}

static uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static double double_of(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Where a part starts if an octave has 2^bits of them; for the number of parts, 1. */
static double part_start(int part, int bits)
{
    int octave = part >> bits, rest = part & ((1 << bits) - 1);
    return (1 + rest / (double)(1 << bits)) / (1 << (OCTAVES - octave));
}

/* The number of the part that a double is in. The bits of positive doubles grow with their values. */
static inline size_t part_of(uint64_t linear_bits, int bits)
{
    return (size_t)((linear_bits - bits_of(0x1p-9)) >> (52 - bits));
}

/* The bits of the least double that quantizes to `code` of 8 bits, code >= 1, found near the curve's inverse. */
static uint64_t border_below(int code)
{
    uint64_t border = bits_of(colour_decode_srgb((code - 0.5) / 255));
    while (quantized(double_of(border), 255) >= code)
        border--;
    while (quantized(double_of(border), 255) < code)
        border++;
    return border;
}

static void fill_fine(void)
{
    uint64_t border = 0;
    for (int i = 0; i < OCTAVES << FINE_BITS; i++) {
        double start = part_start(i, FINE_BITS);
        int code = quantized(start, 255);
        if (bits_of(start) >= border)
            border = code < 255 ? border_below(code + 1) : bits_of(1);
        tables.fine[i] = (struct fine_part){(uint64_t)code, border};
    }
}

static void fill_coarse(void)
{
    const double power = 1 / 2.4;
    for (int i = 0; i < OCTAVES << COARSE_BITS; i++) {
        struct coarse_part *part = &tables.coarse[i];
        double m = part->middle = (part_start(i, COARSE_BITS) + part_start(i + 1, COARSE_BITS)) / 2;
        double value = 1.055 * math_pow(m, power);
        part->c[0] = value - 0.055;
        part->c[1] = value * power / m;
        part->c[2] = part->c[1] * (power - 1) / (2 * m);
        part->c[3] = part->c[2] * (power - 2) / (3 * m);
    }
}

static void fill_tables(void)
{
    fill_fine();
    fill_coarse();
}

static void need_tables(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, fill_tables);
}

/* Never so for a negative value or NaN. Outside the parts quantized() is fast, for it takes no power there. */
static inline bool in_parts(uint64_t linear_bits)
{
    return linear_bits - bits_of(0x1p-9) < bits_of(1) - bits_of(0x1p-9);
}

static inline uint8_t quantize8(double linear)
{
    uint64_t bits = bits_of(linear);
    if (!in_parts(bits))
        return (uint8_t)quantized(linear, 255);
    const struct fine_part *part = &tables.fine[part_of(bits, FINE_BITS)];
    return (uint8_t)(part->code + (bits >= part->border));
}

/* Whether the value is where the curve is a power that the coarse parts know. */
static inline bool is_curved(double linear)
{
    return in_parts(bits_of(linear)) && linear > STRAIGHT;
}

/* Within MARGIN, of such a value. */
static inline double encode_curved(double linear)
{
    const struct coarse_part *part = &tables.coarse[part_of(bits_of(linear), COARSE_BITS)];
    double d = linear - part->middle;
    return part->c[0] + d * (part->c[1] + d * (part->c[2] + d * part->c[3]));
}

/* Where the cubic is too near to a border between two codes to tell them apart, the definition does. */
static inline uint16_t quantize16(double linear)
{
    if (!is_curved(linear))
        return (uint16_t)quantized(linear, 65535);
    double value = 65535 * encode_curved(linear) + 0.5;
    int code = (int)value;
    double above = value - code;
    if (above <= 65535 * MARGIN || above >= 1 - 65535 * MARGIN)
        return (uint16_t)quantized(linear, 65535);
    return (uint16_t)code;
}

static inline double encode_near(double linear)
{
    return is_curved(linear) ? encode_curved(linear) : colour_encode_srgb(linear);
}

void colour_encode_srgb_near(const struct vec3 *linear, size_t count, struct vec3 *encoded)
{
    need_tables();
    for (size_t i = 0; i < count; i++)
        encoded[i] = vec3_make(encode_near(linear[i].x), encode_near(linear[i].y), encode_near(linear[i].z));
}

void colour_quantize8(const struct vec3 *linear, size_t count, uint8_t *codes)
{
    need_tables();
    for (size_t i = 0; i < count; i++, codes += 3) {
        codes[0] = quantize8(linear[i].x);
        codes[1] = quantize8(linear[i].y);
        codes[2] = quantize8(linear[i].z);
    }
}

void colour_quantize16(const struct vec3 *linear, size_t count, uint16_t *codes)
{
    need_tables();
    for (size_t i = 0; i < count; i++, codes += 3) {
        codes[0] = quantize16(linear[i].x);
        codes[1] = quantize16(linear[i].y);
        codes[2] = quantize16(linear[i].z);
    }
}

double colour_from_srgb8(uint8_t code)
{
    return colour_decode_srgb(code / 255.0);
}
