#include "base/hash.h"

#include <assert.h>
#include <sodium.h>
#include <string.h>

struct digest digest_of(const void *data, size_t size)
{
    struct digest digest;
    static_assert(sizeof digest.bytes == crypto_hash_sha256_BYTES, "SHA-256 is 32 bytes");
    crypto_hash_sha256(digest.bytes, data, size);
    return digest;
}

bool digest_equal(const struct digest *a, const struct digest *b)
{
    return memcmp(a->bytes, b->bytes, sizeof a->bytes) == 0;
}

void digest_hex(const struct digest *digest, char text[DIGEST_HEX_BYTES])
{
    sodium_bin2hex(text, DIGEST_HEX_BYTES, digest->bytes, sizeof digest->bytes);
}
