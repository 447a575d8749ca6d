/*
 * Random numbers for tests: functions of a seed, an index and a draw, so that any one case can be made again.
 */
#ifndef WEFT_TESTS_RANDOM_H
#define WEFT_TESTS_RANDOM_H

#include <stdint.h>

#include "base/hash.h"
#include "math/vec3.h"

enum { TEST_SEED = 20240613 };

/* −1 <= x < 1: value number `draw` of case `index`. */
static inline double random_signed(uint32_t index, uint32_t draw)
{
    return (double)(int32_t)hash_u32(hash_u32(TEST_SEED + draw) ^ index) * 0x1p-31;
}

/* low <= x < high */
static inline double random_between(uint32_t index, uint32_t draw, double low, double high)
{
    return low + (high - low) * (0.5 + 0.5 * random_signed(index, draw));
}

/* Takes draws draw..draw + 2. */
static inline struct vec3 random_vector(uint32_t index, uint32_t draw)
{
    return vec3_make(random_signed(index, draw), random_signed(index, draw + 1),
                     random_signed(index, draw + 2));
}

static inline struct vec3 random_unit(uint32_t index, uint32_t draw)
{
    return vec3_normalize(random_vector(index, draw));
}

#endif
