#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/json_value.h"

enum { SUGGEST_LENGTH_MAX = 32 }; /* longer words get no suggestion */

static size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* The least number of inserted, deleted, replaced or swapped neighbouring characters that turns a into b
 * (restricted Damerau-Levenshtein distance); both at most SUGGEST_LENGTH_MAX long. */
static size_t edit_distance(const char *a, const char *b)
{
    size_t rows[3][SUGGEST_LENGTH_MAX + 1];
    size_t *before = rows[0], *last = rows[1], *row = rows[2];
    size_t length = strlen(b);
    for (size_t j = 0; j <= length; j++)
        last[j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        row[0] = i;
        for (size_t j = 1; j <= length; j++) {
            size_t replace = last[j - 1] + (a[i - 1] != b[j - 1]);
            row[j] = smaller(replace, smaller(last[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = smaller(row[j], before[j - 2] + 1);
        }
        size_t *oldest = before;
        before = last;
        last = row;
        row = oldest;
    }
    return last[length];
}

const char *json_suggest(const char *text, const char *const *candidates, size_t count)
{
    size_t length = strlen(text);
    size_t best = length < 3 ? 2 : length / 3 + 1; /* one slip, in longer words more */
    const char *suggestion = NULL;
    for (size_t i = 0; length <= SUGGEST_LENGTH_MAX && i < count; i++) {
        if (strlen(candidates[i]) > SUGGEST_LENGTH_MAX)
            continue;
        size_t distance = edit_distance(text, candidates[i]);
        if (distance < best && distance < length) {
            best = distance;
            suggestion = candidates[i];
        }
    }
    return suggestion;
}

static bool is_listed(const char *key, const char *const *keys)
{
    for (; keys && *keys; keys++)
        if (strcmp(key, *keys) == 0)
            return true;
    return false;
}

static void refuse_key(const struct json_at *at, const char *key, const char *const *keys,
                       const char *const *more_keys)
{
    const char *all[64];
    size_t count = 0;
    for (; *keys && count < 64; keys++)
        all[count++] = *keys;
    for (; more_keys && *more_keys && count < 64; more_keys++)
        all[count++] = *more_keys;
    char quoted[JSON_QUOTE_BYTES];
    json_quote(quoted, key);
    const char *suggestion = json_suggest(key, all, count);
    char list[JSON_LIST_BYTES];
    if (suggestion)
        json_refuse(at, "unknown key %s; did you mean \"%s\"?", quoted, suggestion);
    else
        json_refuse(at, "unknown key %s; expected one of %s", quoted, json_list(list, all, count));
}

void json_keys(struct json_at at, const char *const *keys, const char *const *more_keys)
{
    if (!at.value || at.reader->status != STATUS_OK)
        return;
    if (!cJSON_IsObject(at.value)) {
        json_expected(&at, "an object");
        return;
    }
    for (const cJSON *member = at.value->child; member; member = member->next)
        if (!is_listed(member->string, keys) && !is_listed(member->string, more_keys)) {
            refuse_key(&at, member->string, keys, more_keys);
            return;
        }
}

static int compare_strings(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* Sorted, so that a hostile object with a million keys costs no quadratic time. */
static void check_one_object(const struct json_at *at)
{
    size_t count = (size_t)cJSON_GetArraySize(at->value), filled = 0;
    const char **keys = memory_array(count, sizeof *keys);
    for (const cJSON *member = at->value->child; member; member = member->next)
        keys[filled++] = member->string;
    qsort(keys, count, sizeof *keys, compare_strings);
    char quoted[JSON_QUOTE_BYTES];
    for (size_t i = 1; i < count; i++)
        if (strcmp(keys[i - 1], keys[i]) == 0)
            json_refuse(at, "expected every key once, found %s twice", json_quote(quoted, keys[i]));
    free(keys);
}

void json_check_duplicates(struct json_at at)
{
    if (cJSON_IsObject(at.value))
        check_one_object(&at);
    for (struct json_at item = json_first(&at); item.value; json_next(&item))
        if (item.value->child)
            json_check_duplicates(item);
}

struct json_at json_get(const struct json_at *object, const char *key)
{
    struct json_at at = {.reader = object->reader, .parent = object};
    if (cJSON_IsObject(object->value))
        at.value = cJSON_GetObjectItemCaseSensitive(object->value, key);
    return at;
}

struct json_at json_need(const struct json_at *object, const char *key)
{
    struct json_at at = json_get(object, key);
    if (!at.value && cJSON_IsObject(object->value))
        json_refuse(object, "missing key \"%s\"", key);
    return at;
}

size_t json_array(struct json_at at, size_t min, size_t max, const char *what)
{
    if (!at.value || at.reader->status != STATUS_OK)
        return 0;
    size_t count = cJSON_IsArray(at.value) ? (size_t)cJSON_GetArraySize(at.value) : 0;
    if (cJSON_IsArray(at.value) && count >= min && count <= max)
        return count;
    if (min == max)
        json_expected(&at, "an array of %zu %s", min, what);
    else if (count > max)
        json_expected(&at, "an array of at most %zu %s", max, what);
    else if (min > 0)
        json_expected(&at, "an array of at least %zu %s", min, what);
    else
        json_expected(&at, "an array of %s", what);
    return 0;
}

struct json_at json_first(const struct json_at *array)
{
    struct json_at item = {.reader = array->reader, .parent = array};
    if (array->value && array->reader->status == STATUS_OK)
        item.value = array->value->child;
    return item;
}

void json_next(struct json_at *item)
{
    item->value = item->reader->status == STATUS_OK ? item->value->next : NULL;
    item->index++;
}
