#include "scene/json_syntax.h"

#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct scanner {
    const char *file;
    const uint8_t *text;
    size_t size, at;
    int depth;
    struct error *error;
};

static int peek(const struct scanner *s)
{
    return s->at < s->size ? s->text[s->at] : -1;
}

static bool accept(struct scanner *s, char c)
{
    if (peek(s) != c)
        return false;
    s->at++;
    return true;
}

/* --- sentences -------------------------------------------------------------------------------------------- */

/* The length of the valid UTF-8 sequence at the scanner's place (Unicode 15, table 3-7); 0 if there is none. */
static size_t utf8_length(const struct scanner *s)
{
    const uint8_t *p = s->text + s->at;
    size_t left = s->size - s->at;
    size_t length = left == 0 ? 0 : p[0] < 0x80 ? 1 : p[0] < 0xc2 ? 0 : p[0] < 0xe0 ? 2 : p[0] < 0xf0 ? 3 : 4;
    if (length == 0 || length > left || p[0] > 0xf4)
        return 0;
    for (size_t i = 1; i < length; i++)
        if ((p[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (p[0] == 0xe0 && p[1] < 0xa0) || (p[0] == 0xf0 && p[1] < 0x90);
    bool surrogate = p[0] == 0xed && p[1] > 0x9f;
    bool beyond = p[0] == 0xf4 && p[1] > 0x8f;
    return overlong || surrogate || beyond ? 0 : length;
}

/* The code point of a valid UTF-8 sequence of that length. */
static unsigned code_point(const uint8_t *p, size_t length)
{
    unsigned code = length == 1 ? p[0] : p[0] & (0x7fu >> length);
    for (size_t i = 1; i < length; i++)
        code = code << 6 | (p[i] & 0x3fu);
    return code;
}

/* How many characters at the scanner's place look like one word or number. */
static size_t word_length(const struct scanner *s)
{
    size_t length = 0;
    while (s->at + length < s->size) {
        int c = s->text[s->at + length];
        if (!isalnum(c) && (c == '\0' || !strchr("+-._", c)))
            break;
        length++;
    }
    return length;
}

static void describe_found(const struct scanner *s, char *text, size_t capacity)
{
    enum { SHOWN = 40 };
    int c = peek(s);
    size_t word = word_length(s);
    size_t length = word ? word : utf8_length(s);
    if (c < 0)
        snprintf(text, capacity, "the end of the file");
    else if (length == 0)
        snprintf(text, capacity, "the byte 0x%02X", (unsigned)c);
    else if (c < 0x20 || c >= 0x7f) /* may be invisible */
        snprintf(text, capacity, "the character U+%04X", code_point(s->text + s->at, length));
    else if (c == '"')
        snprintf(text, capacity, "a quotation mark");
    else
        snprintf(text, capacity, "\"%.*s%s\"", (int)(length > SHOWN ? SHOWN : length),
                 (const char *)s->text + s->at, length > SHOWN ? "…" : "");
}

static enum status fail(const struct scanner *s, const char *expected)
{
    size_t line = 1, column = 1;
    for (size_t i = 0; i < s->at; i++) {
        if (s->text[i] == '\n') {
            line++;
            column = 1;
        } else if ((s->text[i] & 0xc0) != 0x80) {
            column++;
        }
    }
    char found[64];
    describe_found(s, found, sizeof found);
    return error_set(s->error, STATUS_INPUT, "%s:%zu:%zu: expected %s, found %s", s->file, line, column,
                     expected, found);
}

/* --- strings and numbers ---------------------------------------------------------------------------------- */

/* The four hexadecimal digits of \uXXXX, or -1. */
static int scan_hex(struct scanner *s)
{
    int value = 0;
    for (int i = 0; i < 4; i++) {
        int c = peek(s);
        if (c < 0 || !isxdigit(c))
            return -1;
        value = value * 16 + (isdigit(c) ? c - '0' : tolower(c) - 'a' + 10);
        s->at++;
    }
    return value;
}

/* After "\u". */
static enum status scan_unicode_escape(struct scanner *s)
{
    size_t start = s->at;
    int first = scan_hex(s);
    if (first < 0)
        return fail(s, "four hexadecimal digits after \\u");
    bool high = first >= 0xd800 && first <= 0xdbff, low = first >= 0xdc00 && first <= 0xdfff;
    bool paired = false;
    if (high && accept(s, '\\') && accept(s, 'u')) {
        int second = scan_hex(s);
        paired = second >= 0xdc00 && second <= 0xdfff;
    }
    if (first != 0 && !low && (!high || paired))
        return STATUS_OK;
    s->at = start;
    return fail(s, first == 0 ? "a character other than NUL" : "a pair of surrogates after \\u");
}

static enum status scan_escape(struct scanner *s)
{
    int c = peek(s);
    if (c <= 0 || !strchr("\"\\/bfnrtu", c))
        return fail(s, "one of \" \\ / b f n r t u after a backslash");
    s->at++;
    return c == 'u' ? scan_unicode_escape(s) : STATUS_OK;
}

static enum status scan_string(struct scanner *s)
{
    s->at++;
    enum status status = STATUS_OK;
    while (status == STATUS_OK && !accept(s, '"')) {
        size_t length = utf8_length(s);
        if (peek(s) < 0x20)
            status = fail(s, "a closing quotation mark or an escape");
        else if (length == 0)
            status = fail(s, "valid UTF-8");
        else if (accept(s, '\\'))
            status = scan_escape(s);
        else
            s->at += length;
    }
    return status;
}

static enum status scan_digits(struct scanner *s)
{
    if (peek(s) < 0 || !isdigit(peek(s)))
        return fail(s, "a digit");
    while (peek(s) >= 0 && isdigit(peek(s)))
        s->at++;
    return STATUS_OK;
}

/* What the grammar cannot say about the number from `start` to here. */
static enum status check_number(struct scanner *s, size_t start, bool exponent)
{
    char number[JSON_NUMBER_MAX + 1] = "";
    size_t length = s->at - start;
    s->at = start;
    if (length > JSON_NUMBER_MAX)
        return fail(s, "a number of at most 63 characters");
    memcpy(number, s->text + start, length);
    if (exponent && !isfinite(strtod(number, NULL)))
        return fail(s, "a number within the range of a double");
    s->at = start + length;
    return STATUS_OK;
}

static enum status scan_number(struct scanner *s)
{
    size_t start = s->at;
    accept(s, '-');
    size_t digits = s->at;
    enum status status = scan_digits(s);
    if (status == STATUS_OK && s->text[digits] == '0' && s->at > digits + 1) {
        s->at = start;
        status = fail(s, "a number without leading zeros");
    }
    if (status == STATUS_OK && accept(s, '.'))
        status = scan_digits(s);
    bool exponent = status == STATUS_OK && (accept(s, 'e') || accept(s, 'E'));
    if (exponent) {
        if (!accept(s, '+'))
            accept(s, '-');
        status = scan_digits(s);
    }
    return status == STATUS_OK ? check_number(s, start, exponent) : status;
}

/* --- values ----------------------------------------------------------------------------------------------- */

static enum status scan_value(struct scanner *s);

static void skip_space(struct scanner *s)
{
    while (peek(s) == ' ' || peek(s) == '\t' || peek(s) == '\n' || peek(s) == '\r')
        s->at++;
}

static enum status scan_member(struct scanner *s)
{
    skip_space(s);
    if (peek(s) != '"')
        return fail(s, "a key in quotation marks");
    enum status status = scan_string(s);
    if (status != STATUS_OK)
        return status;
    skip_space(s);
    return accept(s, ':') ? scan_value(s) : fail(s, "\":\"");
}

/* The rest of an array or object, after its opening bracket. */
static enum status scan_members(struct scanner *s, char close, enum status (*scan_one)(struct scanner *))
{
    skip_space(s);
    if (accept(s, close))
        return STATUS_OK;
    for (;;) {
        enum status status = scan_one(s);
        if (status != STATUS_OK)
            return status;
        skip_space(s);
        if (accept(s, close))
            return STATUS_OK;
        if (!accept(s, ','))
            return fail(s, close == ']' ? "\",\" or \"]\"" : "\",\" or \"}\"");
    }
}

static enum status scan_nested(struct scanner *s)
{
    if (s->depth == JSON_DEPTH_MAX)
        return fail(s, "at most 64 levels of nesting");
    s->depth++;
    bool array = accept(s, '[');
    if (!array)
        accept(s, '{');
    enum status status = array ? scan_members(s, ']', scan_value) : scan_members(s, '}', scan_member);
    s->depth--;
    return status;
}

static enum status scan_literal(struct scanner *s)
{
    static const char *const literals[] = {"true", "false", "null"};
    size_t length = word_length(s);
    for (int i = 0; i < 3; i++)
        if (length == strlen(literals[i]) && memcmp(s->text + s->at, literals[i], length) == 0) {
            s->at += length;
            return STATUS_OK;
        }
    return fail(s, "a value");
}

static enum status scan_value(struct scanner *s)
{
    skip_space(s);
    int c = peek(s);
    if (c == '{' || c == '[')
        return scan_nested(s);
    if (c == '"')
        return scan_string(s);
    if (c == '-' || (c >= '0' && c <= '9'))
        return scan_number(s);
    return scan_literal(s);
}

enum status json_syntax_check(const char *file, const char *text, size_t size, struct error *error)
{
    struct scanner s = {.file = file, .text = (const uint8_t *)text, .size = size, .error = error};
    enum status status = scan_value(&s);
    if (status != STATUS_OK)
        return status;
    skip_space(&s);
    return s.at == s.size ? STATUS_OK : fail(&s, "the end of the file");
}
