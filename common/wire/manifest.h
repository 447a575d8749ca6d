/*
 * The manifest of a job: names, sizes and digests of all files that its scene reaches, the scene itself
 * first. It travels as an asset of its own.
 */
#ifndef WEFT_WIRE_MANIFEST_H
#define WEFT_WIRE_MANIFEST_H

#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "base/hash.h"

enum {
    MANIFEST_NAME_BYTES = 1024,             /* with the NUL */
    MANIFEST_COUNT_MAX = 4096,
    MANIFEST_ASSET_BYTES_MAX = 1 << 30,
    MANIFEST_BYTES_MAX = 8 * 1024 * 1024,
};

struct manifest_entry {
    char name[MANIFEST_NAME_BYTES];
    struct digest digest;
    uint64_t size; /* bytes, at most MANIFEST_ASSET_BYTES_MAX */
};

/* All zero is empty; manifest_finish frees the entries. */
struct manifest {
    struct manifest_entry *entries;
    size_t count; /* 1..MANIFEST_COUNT_MAX once decoded */
};

void manifest_finish(struct manifest *manifest);
void manifest_encode(const struct manifest *manifest, struct bytes *out);

/* Fills an empty manifest. On failure it stays empty; STATUS_INPUT. */
enum status manifest_decode(struct manifest *manifest, const void *data, size_t size, struct error *error);

#endif
