/*
 * Reading PFM (Paul Debevec's "Portable FloatMap"): the words PF or Pf, width, height and scale, one blank,
 * then floats from the bottom row upwards. A negative scale means little-endian.
 */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "image/image.h"
#include "image/kind.h"

enum { WORD_BYTES = 48 };

struct pfm {
    uint32_t width, height;
    uint32_t channels; /* 3, or 1 for grey */
    bool little_endian;
    const uint8_t *pixels;
};

static bool is_blank(uint8_t c)
{
    return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

/* Reads the next word of printable ASCII and the one blank behind it. What cannot be such a word gives
 * false and as much of it as was read, which may be nothing. */
static bool read_word(struct byte_reader *reader, char word[WORD_BYTES])
{
    uint8_t c = byte_reader_u8(reader);
    while (is_blank(c))
        c = byte_reader_u8(reader);
    size_t length = 0;
    for (; c > ' ' && c <= '~' && length + 1 < WORD_BYTES; c = byte_reader_u8(reader))
        word[length++] = (char)c;
    word[length] = 0;
    return length > 0 && is_blank(c);
}

static enum status read_side(struct byte_reader *reader, const char *what, uint32_t *side, const char *name,
                             struct error *error)
{
    char word[WORD_BYTES];
    bool whole = read_word(reader, word) && strspn(word, "0123456789") == strlen(word);
    unsigned long value = whole ? strtoul(word, NULL, 10) : 0;
    if (value < 1 || value > IMAGE_SIDE_MAX)
        return error_set(error, STATUS_INPUT, "%s: expected a PFM %s of 1..%d pixels, found \"%s\"", name, what,
                         IMAGE_SIDE_MAX, word);
    *side = (uint32_t)value;
    return STATUS_OK;
}

static enum status read_scale(struct byte_reader *reader, struct pfm *pfm, const char *name,
                              struct error *error)
{
    char word[WORD_BYTES], *end = word;
    double scale = read_word(reader, word) ? strtod(word, &end) : 0;
    if (*end || scale == 0 || !isfinite(scale))
        return error_set(error, STATUS_INPUT, "%s: expected a PFM scale, a number other than 0, found \"%s\"",
                         name, word);
    pfm->little_endian = scale < 0;
    return STATUS_OK;
}

static enum status read_header(struct byte_reader *reader, struct pfm *pfm, const char *name,
                               struct error *error)
{
    char word[WORD_BYTES];
    if (!read_word(reader, word) || (strcmp(word, "PF") != 0 && strcmp(word, "Pf") != 0))
        return error_set(error, STATUS_INPUT, "%s: expected a PFM image, PF or Pf, found \"%s\"", name, word);
    pfm->channels = word[1] == 'F' ? 3 : 1;
    enum status status = read_side(reader, "width", &pfm->width, name, error);
    if (status == STATUS_OK)
        status = read_side(reader, "height", &pfm->height, name, error);
    if (status == STATUS_OK)
        status = read_scale(reader, pfm, name, error);
    return status;
}

/* Nothing but its length shows whether a PFM is whole, so the length must be exact. Since the file holds
 * all the bytes that the header claims, allocating by the header is safe afterwards. */
static enum status find_pixels(struct byte_reader *reader, struct pfm *pfm, const char *name,
                               struct error *error)
{
    uint64_t count = (uint64_t)pfm->width * pfm->height;
    if (count > IMAGE_PIXELS_MAX)
        return error_set(error, STATUS_INPUT, "%s: expected at most %d pixels, found %u × %u", name,
                         IMAGE_PIXELS_MAX, pfm->width, pfm->height);
    size_t expected = count * pfm->channels * 4;
    size_t found = reader->size - reader->at;
    if (found != expected)
        return error_set(error, STATUS_INPUT, "%s: expected %zu bytes of PFM pixels, found %zu", name, expected,
                         found);
    pfm->pixels = byte_reader_take(reader, expected);
    return STATUS_OK;
}

static float load_float(const uint8_t bytes[4], bool little_endian)
{
    uint32_t bits = 0;
    for (int i = 0; i < 4; i++)
        bits = bits << 8 | bytes[little_endian ? 3 - i : i];
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Decodes row y, counted from the top, into out[3 * width]; returns the first pixel that is not finite,
 * or width. */
static uint32_t decode_row(const struct pfm *pfm, uint32_t y, float *out)
{
    const uint8_t *in = pfm->pixels + (size_t)(pfm->height - 1 - y) * pfm->width * pfm->channels * 4;
    for (uint32_t x = 0; x < pfm->width; x++) {
        for (uint32_t c = 0; c < 3; c++) {
            size_t index = pfm->channels == 3 ? 3 * (size_t)x + c : x;
            float value = load_float(in + 4 * index, pfm->little_endian);
            if (!isfinite(value))
                return x;
            out[3 * (size_t)x + c] = value;
        }
    }
    return pfm->width;
}

/* A NaN's bits are not the same on all CPUs once it has been calculated with, so none is let in. */
static enum status decode_pixels(const struct pfm *pfm, struct image *image, const char *name,
                                 struct error *error)
{
    struct image decoded = {pfm->width, pfm->height, NULL};
    decoded.rgb = memory_array((size_t)pfm->width * pfm->height, 3 * sizeof *decoded.rgb);
    for (uint32_t y = 0; y < pfm->height; y++) {
        uint32_t x = decode_row(pfm, y, decoded.rgb + (size_t)y * pfm->width * 3);
        if (x < pfm->width) {
            image_finish(&decoded);
            return error_set(error, STATUS_INPUT,
                             "%s: pixel (%u, %u): expected finite numbers, found infinity or NaN", name, x, y);
        }
    }
    *image = decoded;
    return STATUS_OK;
}

enum status image_decode_pfm(struct image *image, const void *data, size_t size, const char *name,
                             struct error *error)
{
    if (image_kind_of(data, size) != IMAGE_KIND_PFM) {
        char found[IMAGE_KIND_TEXT_BYTES];
        image_kind_describe(data, size, found);
        return error_set(error, STATUS_INPUT, "%s: expected a PFM image, found %s", name, found);
    }
    struct byte_reader reader = byte_reader_of(data, size);
    struct pfm pfm = {0};
    enum status status = read_header(&reader, &pfm, name, error);
    if (status == STATUS_OK)
        status = find_pixels(&reader, &pfm, name, error);
    if (status == STATUS_OK)
        status = decode_pixels(&pfm, image, name, error);
    return status;
}
