#include "scene/json_value.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "math/colour.h"

const struct json_range json_any = {-INFINITY, INFINITY, false, false, false};
const struct json_range json_positive = {0, INFINITY, true, false, false};
const struct json_range json_not_negative = {0, INFINITY, false, false, false};
const struct json_range json_share = {0, 1, false, false, false};

/* Whether there is a value to look at. */
static bool is_wanted(const struct json_at *at)
{
    return at->value && at->reader->status == STATUS_OK;
}

/* --- numbers ---------------------------------------------------------------------------------------------- */

static const char *describe_range(const struct json_range *range, char *text, size_t capacity)
{
    const char *kind = range->whole ? "a whole number" : "a number";
    if (isinf(range->min))
        snprintf(text, capacity, "%s", kind);
    else if (isinf(range->max))
        snprintf(text, capacity, "%s %s %g", kind, range->above ? "above" : "of at least", range->min);
    else if (!range->above && !range->below)
        snprintf(text, capacity, "%s from %.10g to %.10g", kind, range->min, range->max);
    else
        snprintf(text, capacity, "%s %s %g and %s %g", kind, range->above ? "above" : "of at least", range->min,
                 range->below ? "below" : "at most", range->max);
    return text;
}

static bool is_within(const struct json_range *range, double number)
{
    bool low = range->above ? number > range->min : number >= range->min;
    bool high = range->below ? number < range->max : number <= range->max;
    return low && high && (!range->whole || floor(number) == number);
}

void json_number(struct json_at at, const struct json_range *range, double *number)
{
    if (!is_wanted(&at))
        return;
    double value = cJSON_IsNumber(at.value) ? at.value->valuedouble : NAN;
    char expected[96];
    if (!is_within(range, value))
        json_expected(&at, "%s", describe_range(range, expected, sizeof expected));
    else if (fabs(value) > SCENE_LARGEST)
        json_expected(&at, "a number of magnitude at most 1e30");
    else if (range->above && value - range->min < SCENE_SMALLEST)
        json_expected(&at, "a number of at least 1e-30");
    else
        *number = value;
}

void json_whole(struct json_at at, uint32_t min, uint32_t max, uint32_t *number)
{
    const struct json_range range = {.min = min, .max = max, .whole = true};
    double value = *number;
    json_number(at, &range, &value);
    *number = (uint32_t)value;
}

void json_numbers(struct json_at at, const struct json_range *range, size_t count, double *numbers)
{
    if (json_array(at, count, count, "numbers") != count)
        return;
    for (struct json_at item = json_first(&at); item.value; json_next(&item))
        json_number(item, range, &numbers[item.index]);
}

/* --- vectors and colours ---------------------------------------------------------------------------------- */

static void read_vector(struct json_at at, const struct json_range *range, struct vec3 *vector)
{
    double numbers[3] = {vector->x, vector->y, vector->z};
    json_numbers(at, range, 3, numbers);
    *vector = vec3_make(numbers[0], numbers[1], numbers[2]);
}

void json_point(struct json_at at, struct vec3 *point)
{
    read_vector(at, &json_any, point);
}

void json_direction(struct json_at at, struct vec3 *direction)
{
    struct vec3 vector = *direction;
    json_point(at, &vector);
    if (!is_wanted(&at))
        return;
    if (vec3_is_zero(vector))
        json_refuse(&at, "expected a vector other than zero, found [0, 0, 0]");
    else
        *direction = vec3_normalize(vector);
}

static uint8_t hex_code(const char *digits, size_t digits_per_channel)
{
    unsigned code = 0;
    for (size_t i = 0; i < 2; i++) {
        int c = tolower((unsigned char)digits[i % digits_per_channel]);
        code = code * 16 + (unsigned)(isdigit(c) ? c - '0' : c - 'a' + 10);
    }
    return (uint8_t)code;
}

/* "#rgb" or "#rrggbb". */
static void read_hex_colour(const struct json_at *at, struct vec3 *colour)
{
    const char *text = at->value->valuestring;
    size_t digits = *text == '#' ? strspn(text + 1, "0123456789abcdefABCDEF") : 0;
    if ((digits != 3 && digits != 6) || text[1 + digits]) {
        json_expected(at, "a colour such as \"#4080ff\" or \"#48f\"");
        return;
    }
    size_t each = digits / 3;
    colour->x = colour_from_srgb8(hex_code(text + 1, each));
    colour->y = colour_from_srgb8(hex_code(text + 1 + each, each));
    colour->z = colour_from_srgb8(hex_code(text + 1 + 2 * each, each));
}

void json_colour(struct json_at at, const struct json_range *range, struct vec3 *colour)
{
    if (!is_wanted(&at))
        return;
    if (cJSON_IsString(at.value)) {
        read_hex_colour(&at, colour);
    } else if (cJSON_IsNumber(at.value)) {
        double grey = colour->x;
        json_number(at, range, &grey);
        *colour = vec3_make(grey, grey, grey);
    } else if (cJSON_IsArray(at.value)) {
        read_vector(at, range, colour);
    } else {
        json_expected(&at, "a colour ([r, g, b], \"#rrggbb\" or one number)");
    }
}

/* --- others ----------------------------------------------------------------------------------------------- */

void json_flag(struct json_at at, bool *flag)
{
    if (!is_wanted(&at))
        return;
    if (cJSON_IsBool(at.value))
        *flag = cJSON_IsTrue(at.value);
    else
        json_expected(&at, "true or false");
}

void json_text(struct json_at at, const char **text)
{
    if (!is_wanted(&at))
        return;
    if (cJSON_IsString(at.value))
        *text = at.value->valuestring;
    else
        json_expected(&at, "a string");
}

static void refuse_choice(const struct json_at *at, const char *const *names, size_t count)
{
    char list[JSON_LIST_BYTES], quoted[JSON_QUOTE_BYTES];
    json_list(list, names, count);
    const char *suggestion = NULL;
    if (cJSON_IsString(at->value))
        suggestion = json_suggest(at->value->valuestring, names, count);
    if (suggestion)
        json_refuse(at, "expected one of %s, found %s; did you mean \"%s\"?", list,
                    json_quote(quoted, at->value->valuestring), suggestion);
    else
        json_expected(at, "one of %s", list);
}

void json_choice(struct json_at at, const char *const *names, size_t count, size_t *choice)
{
    if (!is_wanted(&at))
        return;
    for (size_t i = 0; cJSON_IsString(at.value) && i < count; i++)
        if (strcmp(at.value->valuestring, names[i]) == 0) {
            *choice = i;
            return;
        }
    refuse_choice(&at, names, count);
}
