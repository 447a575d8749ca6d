#include "base/bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"

void bytes_finish(struct bytes *bytes)
{
    free(bytes->data);
    *bytes = (struct bytes){0};
}

uint8_t *bytes_extend(struct bytes *bytes, size_t size)
{
    bytes->data = memory_grow(bytes->data, &bytes->capacity, bytes->size + size, 1);
    uint8_t *start = bytes->data + bytes->size;
    bytes->size += size;
    return start;
}

void bytes_put(struct bytes *bytes, const void *data, size_t size)
{
    if (size)
        memcpy(bytes_extend(bytes, size), data, size);
}

static void put_little_endian(struct bytes *bytes, uint64_t value, size_t size)
{
    uint8_t *to = bytes_extend(bytes, size);
    for (size_t i = 0; i < size; i++)
        to[i] = (uint8_t)(value >> (8 * i));
}

void bytes_put_u8(struct bytes *bytes, uint8_t value)
{
    put_little_endian(bytes, value, 1);
}

void bytes_put_u16(struct bytes *bytes, uint16_t value)
{
    put_little_endian(bytes, value, 2);
}

void bytes_put_u32(struct bytes *bytes, uint32_t value)
{
    put_little_endian(bytes, value, 4);
}

void bytes_put_u64(struct bytes *bytes, uint64_t value)
{
    put_little_endian(bytes, value, 8);
}

void bytes_put_f64(struct bytes *bytes, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    bytes_put_u64(bytes, bits);
}

void bytes_put_string(struct bytes *bytes, const char *text)
{
    size_t length = strlen(text);
    if (length > UINT16_MAX)
        length = UINT16_MAX;
    bytes_put_u16(bytes, (uint16_t)length);
    bytes_put(bytes, text, length);
}

struct byte_reader byte_reader_of(const void *data, size_t size)
{
    return (struct byte_reader){.data = data, .size = size};
}

const uint8_t *byte_reader_take(struct byte_reader *reader, size_t size)
{
    if (reader->failed || size > reader->size - reader->at) {
        reader->failed = true;
        return NULL;
    }
    const uint8_t *start = reader->data + reader->at;
    reader->at += size;
    return start;
}

static uint64_t read_little_endian(struct byte_reader *reader, size_t size)
{
    const uint8_t *from = byte_reader_take(reader, size);
    uint64_t value = 0;
    for (size_t i = 0; from && i < size; i++)
        value |= (uint64_t)from[i] << (8 * i);
    return value;
}

uint8_t byte_reader_u8(struct byte_reader *reader)
{
    return (uint8_t)read_little_endian(reader, 1);
}

uint16_t byte_reader_u16(struct byte_reader *reader)
{
    return (uint16_t)read_little_endian(reader, 2);
}

uint32_t byte_reader_u32(struct byte_reader *reader)
{
    return (uint32_t)read_little_endian(reader, 4);
}

uint64_t byte_reader_u64(struct byte_reader *reader)
{
    return read_little_endian(reader, 8);
}

double byte_reader_f64(struct byte_reader *reader)
{
    uint64_t bits = byte_reader_u64(reader);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

void byte_reader_string(struct byte_reader *reader, char *text, size_t capacity)
{
    size_t length = byte_reader_u16(reader);
    const uint8_t *from = byte_reader_take(reader, length);
    text[0] = '\0';
    if (!from)
        return;
    if (length >= capacity || memchr(from, '\0', length)) {
        reader->failed = true;
        return;
    }
    memcpy(text, from, length);
    text[length] = '\0';
}

bool byte_reader_done(const struct byte_reader *reader)
{
    return !reader->failed && reader->at == reader->size;
}

static enum status read_descriptor(struct bytes *bytes, int file, const char *path, size_t limit,
                                   struct error *error)
{
    struct stat info;
    if (fstat(file, &info) != 0)
        return error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    if (!S_ISREG(info.st_mode))
        return error_set(error, STATUS_INPUT, "%s: expected a regular file", path);
    for (;;) {
        size_t step = 1 << 16;
        uint8_t *to = bytes_extend(bytes, step);
        ssize_t got = read(file, to, step);
        bytes->size -= step - (got > 0 ? (size_t)got : 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
        if (got == 0)
            break;
        if (bytes->size > limit)
            return error_set(error, STATUS_INPUT, "%s: expected at most %zu bytes, found more", path, limit);
    }
    bytes_put_u8(bytes, 0);
    bytes->size--;
    return STATUS_OK;
}

enum status bytes_read_file(struct bytes *bytes, const char *path, size_t limit, struct error *error)
{
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return error_set(error, STATUS_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    enum status status = read_descriptor(bytes, file, path, limit, error);
    close(file);
    if (status != STATUS_OK)
        bytes_finish(bytes);
    return status;
}
