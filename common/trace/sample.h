/*
 * Where in a pixel its samples lie: the first two dimensions of Sobol's sequence (a (0,2)-sequence), Owen-scrambled with
 * seeds hashed from the pixel. A function of pixel, index and count alone. The only sample of a pixel with one is its
 * centre.
 *
 * For one sample and for lanes of samples: inline functions without branches.
 */
#ifndef WEFT_TRACE_SAMPLE_H
#define WEFT_TRACE_SAMPLE_H

#include <stdint.h>

#include "base/hash.h"

struct sample_position {
    double x, y; /* within the pixel, 0 <= x < 1 */
};

/* Coordinates of a sample before scrambling, the first binary digit in the lowest bit. */
struct sample_digits {
    uint32_t x, y;
};

/* Those of the index-th sample. */
struct sample_digits sample_digits(uint32_t index);

static inline uint32_t sample_reversed(uint32_t x)
{
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
}

/* Owen's nested uniform scrambling by hashing (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020): each
 * digit is flipped by a function of those before it. */
static inline uint32_t sample_scrambled(uint32_t digits, uint32_t seed)
{
    digits += seed;
    digits ^= digits * 0x6c50b47cu;
    digits ^= digits * 0xb82f1e52u;
    digits ^= digits * 0xc7afe638u;
    digits ^= digits * 0x8d22f6e6u;
    return digits;
}

/* The number whose binary digits those are: 0 <= x < 1, exactly. (Machines convert signed integers faster.) */
static inline double sample_coordinate(uint32_t digits)
{
    int32_t centered = (int32_t)(sample_reversed(digits) ^ 0x80000000u);
    return (centered + 0x1p31) * 0x1p-32;
}

/* The sample of `count` whose digits these are, in pixel (x, y). */
static inline struct sample_position sample_in_pixel(uint32_t x, uint32_t y, struct sample_digits digits)
{
    uint32_t seed = hash_u32(x + hash_u32(y + 0x9e3779b9u));
    return (struct sample_position){sample_coordinate(sample_scrambled(digits.x, seed)),
                                    sample_coordinate(sample_scrambled(digits.y, hash_u32(seed)))};
}

/* The index-th of `count` samples of pixel (x, y). */
struct sample_position sample_position(uint32_t x, uint32_t y, uint32_t index, uint32_t count);

#endif
