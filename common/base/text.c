#include "base/text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

struct code_range {
    uint32_t first, last;
};

static bool in_ranges(uint32_t code, const struct code_range *ranges, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (code >= ranges[i].first && code <= ranges[i].last)
            return true;
    }
    return false;
}

/* The length of the sequence that a lead byte announces; 0 for a byte that cannot lead. */
static size_t sequence_length(uint8_t lead)
{
    if (lead < 0x80)
        return 1;
    if (lead < 0xC2 || lead > 0xF4)
        return 0;
    return lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
}

uint32_t text_next(const char **at)
{
    static const uint32_t smallest[] = {0, 0, 0x80, 0x800, 0x10000};
    const uint8_t *from = (const uint8_t *)*at;
    if (!*from)
        return 0;
    ++*at;
    size_t length = sequence_length(*from);
    if (length <= 1)
        return length ? *from : TEXT_REPLACEMENT;
    uint32_t code = *from & (0x7Fu >> length);
    for (size_t i = 1; i < length; i++) {
        if ((from[i] & 0xC0) != 0x80) /* the closing NUL ends up here too */
            return TEXT_REPLACEMENT;
        code = code << 6 | (from[i] & 0x3Fu);
    }
    if (code < smallest[length] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF))
        return TEXT_REPLACEMENT;
    *at += length - 1;
    return code;
}

static void terminate(struct bytes *to)
{
    bytes_put_u8(to, 0);
    to->size--;
}

void text_put_code(struct bytes *to, uint32_t code)
{
    if (code < 0x80) {
        bytes_put_u8(to, (uint8_t)code);
    } else if (code < 0x800) {
        bytes_put_u8(to, (uint8_t)(0xC0 | code >> 6));
    } else if (code < 0x10000) {
        bytes_put_u8(to, (uint8_t)(0xE0 | code >> 12));
    } else {
        bytes_put_u8(to, (uint8_t)(0xF0 | code >> 18));
        bytes_put_u8(to, (uint8_t)(0x80 | (code >> 12 & 0x3F)));
    }
    if (code >= 0x800)
        bytes_put_u8(to, (uint8_t)(0x80 | (code >> 6 & 0x3F)));
    if (code >= 0x80)
        bytes_put_u8(to, (uint8_t)(0x80 | (code & 0x3F)));
    terminate(to);
}

void text_put(struct bytes *to, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length > 0)
        bytes_put(to, text, (size_t)length < sizeof text ? (size_t)length : sizeof text - 1);
    terminate(to);
}

size_t text_code_columns(uint32_t code)
{
    static const struct code_range combining[] = {
        {0x0300, 0x036F}, {0x1AB0, 0x1AFF}, {0x1DC0, 0x1DFF}, {0x20D0, 0x20FF}, {0xFE20, 0xFE2F},
    };
    /* Unicode's East Asian Width classes W and F (annex 11), the gaps between neighbouring blocks included. */
    static const struct code_range wide[] = {
        {0x1100, 0x115F}, {0x231A, 0x231B}, {0x2329, 0x232A}, {0x23E9, 0x23F3}, {0x25FD, 0x25FE},
        {0x2600, 0x27BF}, {0x2B1B, 0x2B55}, {0x2E80, 0xA4CF}, {0xA960, 0xA97F}, {0xAC00, 0xD7A3},
        {0xF900, 0xFAFF}, {0xFE10, 0xFE19}, {0xFE30, 0xFE6F}, {0xFF00, 0xFF60}, {0xFFE0, 0xFFE6},
        {0x16FE0, 0x1B2FF}, {0x1D300, 0x1D37F}, {0x1F000, 0x3FFFF},
    };
    if (in_ranges(code, combining, sizeof combining / sizeof *combining))
        return 0;
    return in_ranges(code, wide, sizeof wide / sizeof *wide) ? 2 : 1;
}

/* What is shown for a code point. Control characters could drive the terminal; line and paragraph separators
 * and the marks of writing direction could make a line say something else. */
static uint32_t printable(uint32_t code)
{
    static const struct code_range hidden[] = {
        {0x0001, 0x001F}, {0x007F, 0x009F}, {0x200E, 0x200F}, {0x2028, 0x202E}, {0x2066, 0x2069},
    };
    return in_ranges(code, hidden, sizeof hidden / sizeof *hidden) ? TEXT_REPLACEMENT : code;
}

size_t text_columns(const char *text)
{
    size_t columns = 0;
    for (uint32_t code; (code = text_next(&text));)
        columns += text_code_columns(printable(code));
    return columns;
}

size_t text_put_cut(struct bytes *to, const char *text, size_t columns)
{
    static const uint32_t ellipsis = 0x2026;
    bool whole = text_columns(text) <= columns;
    size_t room = whole || columns == 0 ? columns : columns - 1;
    size_t used = 0;
    for (uint32_t code; (code = printable(text_next(&text)));) {
        size_t more = text_code_columns(code);
        if (used + more > room)
            break;
        text_put_code(to, code);
        used += more;
    }
    if (whole || columns == 0)
        return used;
    text_put_code(to, ellipsis);
    return used + 1;
}
