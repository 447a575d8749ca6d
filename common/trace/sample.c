#include "trace/sample.h"

#include "base/hash.h"

static uint32_t reverse_bits(uint32_t x)
{
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
}

/* Owen's nested uniform scrambling by hashing (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020): in
 * reversed order each bit is flipped by a function of the bits below it. */
static uint32_t owen_scramble(uint32_t x, uint32_t seed)
{
    x = reverse_bits(x);
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reverse_bits(x);
}

/* Sobol's second dimension: direction numbers v1 = 1/2, v(k+1) = vk xor vk/2. */
static uint32_t sobol_second(uint32_t index)
{
    uint32_t x = 0;
    for (uint32_t v = 1u << 31; index; index >>= 1, v ^= v >> 1)
        if (index & 1)
            x ^= v;
    return x;
}

struct sample_position sample_position(uint32_t x, uint32_t y, uint32_t index, uint32_t count)
{
    if (count == 1)
        return (struct sample_position){0.5, 0.5};
    uint32_t seed = hash_u32(x + hash_u32(y + 0x9e3779b9u));
    uint32_t first = owen_scramble(reverse_bits(index), seed);
    uint32_t second = owen_scramble(sobol_second(index), hash_u32(seed));
    return (struct sample_position){first * 0x1p-32, second * 0x1p-32};
}
