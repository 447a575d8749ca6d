#include "wire/manifest.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

void manifest_finish(struct manifest *manifest)
{
    free(manifest->entries);
    *manifest = (struct manifest){0};
}

/* A u32 count, then name, digest and u64 size of each entry. */
void manifest_encode(const struct manifest *manifest, struct bytes *out)
{
    assert(manifest->count >= 1 && manifest->count <= MANIFEST_COUNT_MAX);
    bytes_put_u32(out, (uint32_t)manifest->count);
    for (size_t i = 0; i < manifest->count; i++) {
        const struct manifest_entry *entry = &manifest->entries[i];
        bytes_put_string(out, entry->name);
        bytes_put(out, entry->digest.bytes, DIGEST_BYTES);
        bytes_put_u64(out, entry->size);
    }
}

static enum status decode_entry(struct byte_reader *reader, size_t index, struct manifest_entry *entry,
                                struct error *error)
{
    byte_reader_string(reader, entry->name, sizeof entry->name);
    const uint8_t *digest = byte_reader_take(reader, DIGEST_BYTES);
    entry->size = byte_reader_u64(reader);
    if (reader->failed)
        return error_set(error, STATUS_INPUT, "manifest: entry %zu: cut short, or a name of more than %d bytes",
                         index, MANIFEST_NAME_BYTES - 1);
    if (entry->name[0] == '\0')
        return error_set(error, STATUS_INPUT, "manifest: entry %zu: expected a name, found none", index);
    if (entry->size > MANIFEST_ASSET_BYTES_MAX)
        return error_set(error, STATUS_INPUT, "manifest: entry %zu: expected at most %d bytes, found %llu",
                         index, MANIFEST_ASSET_BYTES_MAX, (unsigned long long)entry->size);
    memcpy(entry->digest.bytes, digest, DIGEST_BYTES);
    return STATUS_OK;
}

/* Room is made as entries arrive, since a few bytes may claim many. */
static enum status decode_entries(struct byte_reader *reader, size_t count, struct manifest *manifest,
                                  struct error *error)
{
    size_t capacity = 0;
    for (size_t i = 0; i < count; i++) {
        manifest->entries = memory_grow(manifest->entries, &capacity, i + 1, sizeof *manifest->entries);
        enum status status = decode_entry(reader, i, &manifest->entries[i], error);
        if (status != STATUS_OK)
            return status;
        manifest->count = i + 1;
    }
    if (!byte_reader_done(reader))
        return error_set(error, STATUS_INPUT, "manifest: expected %zu bytes, found %zu", reader->at,
                         reader->size);
    return STATUS_OK;
}

enum status manifest_decode(struct manifest *manifest, const void *data, size_t size, struct error *error)
{
    struct byte_reader reader = byte_reader_of(data, size);
    uint32_t count = byte_reader_u32(&reader);
    if (count < 1 || count > MANIFEST_COUNT_MAX)
        return error_set(error, STATUS_INPUT, "manifest: expected 1 to %d entries, found %u",
                         MANIFEST_COUNT_MAX, count);
    enum status status = decode_entries(&reader, count, manifest, error);
    if (status != STATUS_OK)
        manifest_finish(manifest);
    return status;
}
