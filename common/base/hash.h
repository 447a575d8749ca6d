/*
 * SHA-256 digests (libsodium), which name scenes and assets, and a small integer hash for sampling.
 */
#ifndef WEFT_BASE_HASH_H
#define WEFT_BASE_HASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { DIGEST_BYTES = 32, DIGEST_HEX_BYTES = 2 * DIGEST_BYTES + 1 };

struct digest {
    uint8_t bytes[DIGEST_BYTES];
};

struct digest digest_of(const void *data, size_t size);
bool digest_equal(const struct digest *a, const struct digest *b);

/* Lower-case hexadecimal with a NUL. */
void digest_hex(const struct digest *digest, char text[DIGEST_HEX_BYTES]);

/* The finaliser of MurmurHash3 (Appleby, public domain): a bijection of 32 bits in which every input bit
 * changes every output bit with probability near one half. */
static inline uint32_t hash_u32(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x85ebca6bu;
    x ^= x >> 13;
    x *= 0xc2b2ae35u;
    return x ^ x >> 16;
}

#endif
