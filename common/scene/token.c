#include "scene/token.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "scene/json_value.h"
#include "scene/model.h"
#include "scene/number.h"

struct token_reader token_reader_of(const char *file, const void *text, size_t size, struct error *error)
{
    static const char mark[] = "\xef\xbb\xbf";
    const char *start = text;
    bool marked = size >= 3 && memcmp(start, mark, 3) == 0;
    return (struct token_reader){
        .file = file,
        .at = start + (marked ? 3 : 0),
        .end = start + size,
        .line = 1,
        .by_line = true,
        .comments = true,
        .error = error,
    };
}

/* --- blanks ----------------------------------------------------------------------------------------------- */

static bool is_blank(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static const char *line_end(const struct token_reader *reader)
{
    const char *end = memchr(reader->at, '\n', (size_t)(reader->end - reader->at));
    return end ? end : reader->end;
}

/* How long the backslash and the end of line at `at` are; 0 if there is no such pair. */
static size_t continuation_length(const struct token_reader *reader, const char *at)
{
    if (!reader->continued || at[0] != '\\')
        return 0;
    if (at[1] == '\n')
        return 2;
    return at[1] == '\r' && at[2] == '\n' ? 3 : 0;
}

static void skip_blanks(struct token_reader *reader)
{
    for (;;) {
        char c = *reader->at;
        size_t joined = c == '\\' ? continuation_length(reader, reader->at) : 0;
        if (c == '\n' && reader->by_line)
            return;
        if (is_blank(c) || joined) {
            reader->line += c == '\n' || joined;
            reader->at += joined ? joined : 1;
        } else if (c == '#' && reader->comments) {
            reader->at = line_end(reader);
        } else {
            return;
        }
    }
}

/* Whether a token that reaches up to `at` is whole. */
static bool is_token_end(const struct token_reader *reader, const char *at)
{
    return is_blank(*at) || at == reader->end || continuation_length(reader, at) > 0;
}

static const char *token_end(const struct token_reader *reader)
{
    const char *at = reader->at;
    while (!is_token_end(reader, at))
        at++;
    return at;
}

bool token_more(struct token_reader *reader)
{
    for (skip_blanks(reader); *reader->at == '\n'; skip_blanks(reader)) {
        reader->at++;
        reader->line++;
    }
    return reader->status == STATUS_OK && reader->at < reader->end;
}

bool token_at_end(struct token_reader *reader)
{
    skip_blanks(reader);
    return *reader->at == '\n' || reader->at == reader->end;
}

void token_skip_line(struct token_reader *reader)
{
    while (reader->status == STATUS_OK && !token_at_end(reader))
        reader->at = token_end(reader);
}

/* --- sentences -------------------------------------------------------------------------------------------- */

static void refuse(struct token_reader *reader, const char *format, va_list arguments)
{
    char reason[512];
    vsnprintf(reason, sizeof reason, format, arguments);
    reader->status = error_set(reader->error, STATUS_INPUT, "%s:%zu: %s", reader->file, reader->line, reason);
}

void token_refuse(struct token_reader *reader, const char *format, ...)
{
    if (reader->status != STATUS_OK)
        return;
    va_list arguments;
    va_start(arguments, format);
    refuse(reader, format, arguments);
    va_end(arguments);
}

/* What the next token is, for people, into text[JSON_QUOTE_BYTES]. */
static const char *describe_token(struct token_reader *reader, char *text)
{
    skip_blanks(reader);
    if (reader->at == reader->end)
        return "the end of the file";
    if (*reader->at == '\n')
        return "the end of the line";
    char start[JSON_QUOTE_BYTES];
    size_t length = (size_t)(token_end(reader) - reader->at);
    snprintf(start, sizeof start, "%.*s", length < sizeof start ? (int)length : (int)sizeof start, reader->at);
    return json_quote(text, start);
}

void token_expected(struct token_reader *reader, const char *format, ...)
{
    if (reader->status != STATUS_OK)
        return;
    char expected[384], found[JSON_QUOTE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(expected, sizeof expected, format, arguments);
    va_end(arguments);
    token_refuse(reader, "expected %s, found %s", expected, describe_token(reader, found));
}

/* --- tokens ----------------------------------------------------------------------------------------------- */

void token_word(struct token_reader *reader, const char *what, char *word)
{
    word[0] = '\0';
    if (reader->status != STATUS_OK)
        return;
    skip_blanks(reader);
    const char *end = token_end(reader);
    size_t length = (size_t)(end - reader->at);
    if (length == 0 || length >= TOKEN_WORD_BYTES || memchr(reader->at, '\0', length)) {
        token_expected(reader, "%s", what);
        return;
    }
    memcpy(word, reader->at, length);
    word[length] = '\0';
    reader->at = end;
}

/* Where the line ends, without its comment and blanks. */
static const char *rest_end(const struct token_reader *reader)
{
    const char *end = line_end(reader);
    for (const char *at = reader->at; at + 1 < end && reader->comments; at++)
        if (is_blank(at[0]) && at[1] == '#')
            end = at;
    while (end > reader->at && is_blank(end[-1]))
        end--;
    return end;
}

void token_rest(struct token_reader *reader, const char *what, char *rest)
{
    rest[0] = '\0';
    if (reader->status != STATUS_OK)
        return;
    skip_blanks(reader);
    const char *end = rest_end(reader);
    size_t length = (size_t)(end - reader->at);
    if (length == 0 || length >= TOKEN_WORD_BYTES || memchr(reader->at, '\0', length)) {
        token_expected(reader, "%s", what);
        return;
    }
    memcpy(rest, reader->at, length);
    rest[length] = '\0';
    reader->at = end;
}

bool token_is_number(struct token_reader *reader)
{
    double number;
    skip_blanks(reader);
    return number_read(reader->at, &number) != NULL;
}

void token_number(struct token_reader *reader, const char *what, double *number)
{
    double value = 0;
    if (reader->status != STATUS_OK)
        return;
    skip_blanks(reader);
    const char *end = number_read(reader->at, &value);
    if (!end || !is_token_end(reader, end)) {
        token_expected(reader, "%s", what);
    } else if (!(fabs(value) <= SCENE_LARGEST)) {
        token_expected(reader, "%s of magnitude at most 1e30", what);
    } else {
        *number = value;
        reader->at = end;
    }
}

void token_numbers(struct token_reader *reader, const char *what, size_t count, double *numbers)
{
    for (size_t i = 0; i < count; i++)
        token_number(reader, what, &numbers[i]);
}

void token_number_in(struct token_reader *reader, const char *what, double min, double max, double *number)
{
    struct token_reader before = *reader;
    double value = *number;
    token_number(reader, what, &value);
    if (reader->status != STATUS_OK)
        return;
    if (value >= min && value <= max) {
        *number = value;
        return;
    }
    *reader = before;
    token_expected(reader, "%s from %g to %g", what, min, max);
}

void token_whole(struct token_reader *reader, const char *what, int64_t min, int64_t max, int64_t *number)
{
    const int64_t enough = INT64_MAX / 10 - 1;
    if (reader->status != STATUS_OK)
        return;
    skip_blanks(reader);
    bool negative = *reader->at == '-';
    const char *first = reader->at + (negative || *reader->at == '+'), *at = first;
    int64_t value = 0;
    for (; *at >= '0' && *at <= '9' && value < enough; at++)
        value = 10 * value + (*at - '0');
    value = negative ? -value : value;
    if (at == first || !is_token_end(reader, at) || value < min || value > max) {
        token_expected(reader, "%s", what);
        return;
    }
    *number = value;
    reader->at = at;
}

void token_pass(struct token_reader *reader, const char *at, const char *what)
{
    if (reader->status != STATUS_OK)
        return;
    if (is_token_end(reader, at))
        reader->at = at;
    else
        token_expected(reader, "%s", what);
}

void token_end_line(struct token_reader *reader)
{
    if (!token_at_end(reader))
        token_expected(reader, "the end of the line");
}
