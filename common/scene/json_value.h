/*
 * Reading values out of a cJSON tree, with errors that say where.
 *
 * A struct json_at is a value together with the way to it, as a chain of parents on the stack. The first
 * failure is kept in the reader, and from then on every function here does nothing: read everything, then
 * look at the reader's status once. What is missing or failed leaves the caller's variable as it is, so a
 * default is the value that the variable has before.
 */
#ifndef WEFT_SCENE_JSON_VALUE_H
#define WEFT_SCENE_JSON_VALUE_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "math/vec3.h"
#include "scene/model.h"

struct json_reader {
    const char *file;    /* what sentences call it */
    struct error *error; /* filled with the first failure */
    enum status status;  /* of the first failure */
};

struct json_at {
    struct json_reader *reader;
    const struct json_at *parent; /* NULL for the root; must outlive this */
    const cJSON *value;           /* NULL: missing */
    size_t index;                 /* within an array */
};

/* --- sentences -------------------------------------------------------------------------------------------- */

enum { JSON_QUOTE_BYTES = 80, JSON_PATH_BYTES = 512 };

/* "FILE: PATH: …" as the reader's failure. */
void json_refuse(const struct json_at *at, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* "FILE: PATH: expected …, found …"; what was found is described from the value. */
void json_expected(const struct json_at *at, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Takes over a failure of another room that has already filled *reader->error, and puts "FILE: PATH: "
 * before its sentence. */
void json_forward(const struct json_at *at, enum status status);

/* The text in quotation marks, control characters escaped and cut if it is long, into
 * quoted[JSON_QUOTE_BYTES]; returns quoted. */
const char *json_quote(char *quoted, const char *text);

enum { JSON_LIST_BYTES = 400 };

/* The names in quotation marks, with commas, as many as fit, into list[JSON_LIST_BYTES]; returns list. */
const char *json_list(char *list, const char *const *names, size_t count);

/* --- keys ------------------------------------------------------------------------------------------------- */

/* Fails unless the value is an object, each of whose keys is in one of the two lists (which end with NULL;
 * the second may be NULL). */
void json_keys(struct json_at at, const char *const *keys, const char *const *more_keys);

/* Fails if the value or anything within it is an object that has a key twice. */
void json_check_duplicates(struct json_at at);

/* The candidate (of `count`) that differs least from text, if it is near enough to be a slip of the
 * keyboard; otherwise NULL. */
const char *json_suggest(const char *text, const char *const *candidates, size_t count);

/* The member `key`; its value is NULL if there is none or `object` is no object. */
struct json_at json_get(const struct json_at *object, const char *key);

/* The same, but it is a failure if there is none. */
struct json_at json_need(const struct json_at *object, const char *key);

/* --- arrays ----------------------------------------------------------------------------------------------- */

/* The length of an array of min..max values, which sentences call `what` ("points"); 0 after a failure. */
size_t json_array(struct json_at at, size_t min, size_t max, const char *what);

/* for (struct json_at item = json_first(&array); item.value; json_next(&item)): the elements of an array
 * or the members of an object; none after a failure. */
struct json_at json_first(const struct json_at *array);
void json_next(struct json_at *item);

/* --- typed values ----------------------------------------------------------------------------------------- */

/* All numbers are at most SCENE_LARGEST in magnitude; those that must be above `min` are so by at least
 * SCENE_SMALLEST. */
struct json_range {
    double min, max;
    bool above, below; /* min, max themselves are outside */
    bool whole;
};

extern const struct json_range json_any, json_positive, json_not_negative, json_share; /* share: 0..1 */

void json_number(struct json_at at, const struct json_range *range, double *number);
void json_whole(struct json_at at, uint32_t min, uint32_t max, uint32_t *number);
void json_flag(struct json_at at, bool *flag);

/* Borrowed from the tree. */
void json_text(struct json_at at, const char **text);

/* Exactly `count` numbers. */
void json_numbers(struct json_at at, const struct json_range *range, size_t count, double *numbers);
void json_point(struct json_at at, struct vec3 *point);

/* Not zero; made a unit vector. */
void json_direction(struct json_at at, struct vec3 *direction);

/* [r, g, b], one number for a grey, or "#rgb" or "#rrggbb" in sRGB; the channels within `range`. */
void json_colour(struct json_at at, const struct json_range *range, struct vec3 *colour);

/* The place of a string in a list of `count` names. */
void json_choice(struct json_at at, const char *const *names, size_t count, size_t *choice);

#endif
