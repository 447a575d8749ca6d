#include "scene/json_value.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *json_quote(char *quoted, const char *text)
{
    enum { CUT = JSON_QUOTE_BYTES - 12, CUT_ANYHOW = CUT + 3 }; /* the longest character has 4 bytes */
    size_t at = 0;
    quoted[at++] = '"';
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (at > CUT_ANYHOW || (at > CUT && (c & 0xc0) != 0x80)) { /* between two characters if it is UTF-8 */
            at += (size_t)sprintf(quoted + at, "…");
            break;
        }
        if (c < 0x20 || c == 0x7f)
            at += (size_t)sprintf(quoted + at, "\\u%04x", c);
        else
            quoted[at++] = (char)c;
    }
    strcpy(quoted + at, "\"");
    return quoted;
}

const char *json_list(char *list, const char *const *names, size_t count)
{
    size_t length = 0;
    list[0] = '\0';
    for (size_t i = 0; i < count && length < JSON_LIST_BYTES; i++)
        length += (size_t)snprintf(list + length, JSON_LIST_BYTES - length, "%s\"%s\"", i ? ", " : "",
                                   names[i]);
    return list;
}

static bool is_identifier(const char *key)
{
    if (!isalpha((unsigned char)*key) && *key != '_')
        return false;
    for (; *key; key++)
        if (!isalnum((unsigned char)*key) && *key != '_')
            return false;
    return true;
}

/* Appends the way to `at` to path, which holds `length` characters; returns the new length. */
static size_t append_path(const struct json_at *at, char *path, size_t length)
{
    if (!at->parent)
        return length;
    length = append_path(at->parent, path, length);
    if (length >= JSON_PATH_BYTES)
        return length;
    char *end = path + length, quoted[JSON_QUOTE_BYTES];
    size_t space = JSON_PATH_BYTES - length;
    const char *key = at->value->string;
    int added = !key                 ? snprintf(end, space, "[%zu]", at->index)
                : is_identifier(key) ? snprintf(end, space, "%s%s", length ? "." : "", key)
                                     : snprintf(end, space, "[%s]", json_quote(quoted, key));
    return length + (size_t)added;
}

/* "FILE: PATH: ", or "FILE: " at the root. */
static void describe_place(const struct json_at *at, char *place, size_t capacity)
{
    char path[JSON_PATH_BYTES] = "";
    append_path(at, path, 0);
    snprintf(place, capacity, "%s: %s%s", at->reader->file, path, *path ? ": " : "");
}

enum { PLACE_BYTES = 1024 };

void json_refuse(const struct json_at *at, const char *format, ...)
{
    if (at->reader->status != STATUS_OK)
        return;
    char place[PLACE_BYTES], reason[1024];
    describe_place(at, place, sizeof place);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(reason, sizeof reason, format, arguments);
    va_end(arguments);
    at->reader->status = error_set(at->reader->error, STATUS_INPUT, "%s%s", place, reason);
}

void json_forward(const struct json_at *at, enum status status)
{
    char place[PLACE_BYTES];
    describe_place(at, place, sizeof place);
    at->reader->status = error_prefix(at->reader->error, status, "%s", place);
}

/* The shortest decimal that reads back as the same double. */
static void describe_number(double number, char *text, size_t capacity)
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, capacity, "%.*g", digits, number);
        if (strtod(text, NULL) == number)
            return;
    }
}

static void describe_value(const cJSON *value, char *text, size_t capacity)
{
    if (cJSON_IsString(value))
        json_quote(text, value->valuestring);
    else if (cJSON_IsNumber(value))
        describe_number(value->valuedouble, text, capacity);
    else if (cJSON_IsArray(value))
        snprintf(text, capacity, "an array of %d", cJSON_GetArraySize(value));
    else if (cJSON_IsObject(value))
        snprintf(text, capacity, "an object");
    else
        snprintf(text, capacity, "%s", cJSON_IsTrue(value) ? "true" : cJSON_IsFalse(value) ? "false" : "null");
}

void json_expected(const struct json_at *at, const char *format, ...)
{
    if (at->reader->status != STATUS_OK)
        return;
    char expected[512], found[JSON_QUOTE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(expected, sizeof expected, format, arguments);
    va_end(arguments);
    describe_value(at->value, found, sizeof found);
    json_refuse(at, "expected %s, found %s", expected, found);
}
