/*
 * PNG textures. Checking one and decoding it must come to the same. While fuzzing, mutations keep the chunks' checksums
 * right: nearly all inputs would end at the first.
 */
#include "image/image.h"
#include "tests/fuzz/fuzz.h"

/* libFuzzer's, and not there in a replay. */
size_t __attribute__((weak)) LLVMFuzzerMutate(uint8_t *data, size_t size, size_t max_size);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size, unsigned seed);

enum { SIGNATURE_BYTES = 8, LENGTH_BYTES = 4, NAME_BYTES = 4, CHECKSUM_BYTES = 4 };

/* CRC-32 as PNG has it (ISO/IEC 15948, annex D), bit by bit. */
static uint32_t checksum(const uint8_t *data, size_t size)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < 8 * size; i++) {
        crc ^= i % 8 == 0 ? data[i / 8] : 0;
        crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    }
    return ~crc;
}

/* Big-endian, as all numbers of a PNG. */
static uint32_t number_at(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static void set_checksums(uint8_t *data, size_t size)
{
    size_t at = SIGNATURE_BYTES;
    while (at + LENGTH_BYTES + NAME_BYTES + CHECKSUM_BYTES <= size) {
        size_t length = number_at(data + at);
        uint8_t *name = data + at + LENGTH_BYTES;
        if (length > size - at - LENGTH_BYTES - NAME_BYTES - CHECKSUM_BYTES)
            return;
        uint32_t crc = checksum(name, NAME_BYTES + length);
        for (int i = 0; i < CHECKSUM_BYTES; i++)
            name[NAME_BYTES + length + i] = (uint8_t)(crc >> (24 - 8 * i));
        at += LENGTH_BYTES + NAME_BYTES + length + CHECKSUM_BYTES;
    }
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size, unsigned seed)
{
    size_t mutated = LLVMFuzzerMutate(data, size, max_size);
    if (seed % 16 > 0) /* wrong ones are tried too */
        set_checksums(data, mutated);
    return mutated;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct image image = {0};
    struct error decoding = {{0}}, checking = {{0}};
    enum status status = image_decode_png(&image, data, size, "a.png", &decoding);
    require(image_check_png(data, size, "a.png", &checking) == status);
    require(strcmp(decoding.text, checking.text) == 0);
    if (status != STATUS_OK)
        require_refusal(status, &decoding);
    for (size_t i = 0; status == STATUS_OK && i < (size_t)image.width * image.height * 3; i++)
        require(image.rgb[i] >= 0 && image.rgb[i] <= 1);
    require((status == STATUS_OK) == (image.rgb != NULL));
    image_finish(&image);
    return 0;
}
