#include <string.h>

#include "scene/model.h"
#include "scene/ply.h"

static const size_t type_bytes[PLY_TYPES] = {1, 1, 2, 2, 4, 4, 4, 8};

void ply_expected(struct ply_body *body, const char *expected, const char *found)
{
    struct token_reader *text = body->text;
    if (text->status != STATUS_OK)
        return;
    if (body->format == PLY_ASCII)
        token_expected(text, "%s", expected);
    else
        text->status = error_set(text->error, STATUS_INPUT, "%s: byte %zu: expected %s, found %s", text->file,
                                 (size_t)((const uint8_t *)text->at - body->start), expected, found);
}

/* `size` bytes as a whole number, the first byte lowest or highest. */
static uint64_t read_bits(const uint8_t *bytes, size_t size, bool big_endian)
{
    uint64_t bits = 0;
    for (size_t i = 0; i < size; i++)
        bits = bits << 8 | bytes[big_endian ? i : size - 1 - i];
    return bits;
}

static double value_of_bits(uint64_t bits, enum ply_type type)
{
    float single;
    double value;
    uint32_t low = (uint32_t)bits;
    switch (type) {
    case PLY_INT8:
        return (int8_t)bits;
    case PLY_INT16:
        return (int16_t)bits;
    case PLY_INT32:
        return (int32_t)bits;
    case PLY_FLOAT32:
        memcpy(&single, &low, sizeof single);
        return single;
    case PLY_FLOAT64:
        memcpy(&value, &bits, sizeof value);
        return value;
    default:
        return (double)bits;
    }
}

static double read_binary(struct ply_body *body, enum ply_type type, const char *what)
{
    struct token_reader *text = body->text;
    size_t size = type_bytes[type];
    if ((size_t)(text->end - text->at) < size) {
        ply_expected(body, what, "the end of the file");
        return 0;
    }
    uint64_t bits = read_bits((const uint8_t *)text->at, size, body->format == PLY_BIG_ENDIAN);
    double value = value_of_bits(bits, type);
    if (!(fabs(value) <= SCENE_LARGEST)) {
        ply_expected(body, "a number of magnitude at most 1e30", isnan(value) ? "a NaN" : "a larger one");
        return 0;
    }
    text->at += size;
    return value;
}

double ply_value(struct ply_body *body, enum ply_type type, const char *what)
{
    double value = 0;
    if (body->text->status != STATUS_OK)
        return 0;
    if (body->format != PLY_ASCII)
        return read_binary(body, type, what);
    token_number(body->text, what, &value);
    return value;
}

void ply_skip(struct ply_body *body, enum ply_type type, uint64_t count)
{
    struct token_reader *text = body->text;
    char word[TOKEN_WORD_BYTES];
    if (body->format == PLY_ASCII) {
        for (uint64_t i = 0; i < count && text->status == STATUS_OK; i++)
            token_word(text, "a value", word);
    } else if ((size_t)(text->end - text->at) / type_bytes[type] < count) {
        ply_expected(body, "more values", "the end of the file");
    } else if (text->status == STATUS_OK) {
        text->at += count * type_bytes[type];
    }
}

void ply_begin_row(struct ply_body *body, const char *what)
{
    if (body->format == PLY_ASCII && body->text->status == STATUS_OK && !token_more(body->text))
        token_expected(body->text, "%s", what);
}

void ply_end_row(struct ply_body *body)
{
    if (body->format == PLY_ASCII)
        token_end_line(body->text);
}
