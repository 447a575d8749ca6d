/*
 * Byte strings: a growing buffer, little-endian writing, bounds-checked reading, whole files.
 */
#ifndef WEFT_BASE_BYTES_H
#define WEFT_BASE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* A growing buffer. All zero is an empty one; bytes_finish frees what it holds. */
struct bytes {
    uint8_t *data;
    size_t size;
    size_t capacity;
};

void bytes_finish(struct bytes *bytes);

/* Appends `size` bytes of unspecified value and returns where they start (valid until the next append). */
uint8_t *bytes_extend(struct bytes *bytes, size_t size);

void bytes_put(struct bytes *bytes, const void *data, size_t size);
void bytes_put_u8(struct bytes *bytes, uint8_t value);
void bytes_put_u16(struct bytes *bytes, uint16_t value);
void bytes_put_u32(struct bytes *bytes, uint32_t value);
void bytes_put_u64(struct bytes *bytes, uint64_t value);
void bytes_put_f64(struct bytes *bytes, double value);

/* A string as a u16 length and its bytes; cut at 65,535. */
void bytes_put_string(struct bytes *bytes, const char *text);

/* Reads from borrowed memory. Reading beyond the end yields zeros and sets `failed`, for good: read
 * everything, then look at `failed` once. */
struct byte_reader {
    const uint8_t *data;
    size_t size;
    size_t at;
    bool failed;
};

struct byte_reader byte_reader_of(const void *data, size_t size);
uint8_t byte_reader_u8(struct byte_reader *reader);
uint16_t byte_reader_u16(struct byte_reader *reader);
uint32_t byte_reader_u32(struct byte_reader *reader);
uint64_t byte_reader_u64(struct byte_reader *reader);
double byte_reader_f64(struct byte_reader *reader);

/* The next `size` bytes, borrowed from the reader's memory; NULL (and failed) if there are fewer. */
const uint8_t *byte_reader_take(struct byte_reader *reader, size_t size);

/* A string of at most capacity - 1 bytes without NUL into text[capacity]; otherwise failed and "". */
void byte_reader_string(struct byte_reader *reader, char *text, size_t capacity);

/* True if nothing failed and every byte was read. */
bool byte_reader_done(const struct byte_reader *reader);

/* Reads a regular file of at most `limit` bytes into *bytes, which is empty before and stays so on
 * failure. A NUL that `size` does not count follows the data. STATUS_INPUT with a sentence naming the path. */
enum status bytes_read_file(struct bytes *bytes, const char *path, size_t limit, struct error *error);

#endif
