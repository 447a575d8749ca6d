#include "base/options.h"

#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* getopt_long's two tables, made from ours. */
struct getopt_tables {
    struct option longs[OPTIONS_MAX + 1];
    char shorts[2 + 2 * OPTIONS_MAX];
};

static bool is_heading(const struct option_spec *spec)
{
    return spec->name[0] == '\0';
}

static void fill_tables(struct getopt_tables *tables, const struct option_spec *specs)
{
    memset(tables, 0, sizeof *tables);
    size_t at = 0, count = 0;
    tables->shorts[at++] = ':'; /* so that a missing argument is told from an unknown option */
    for (size_t i = 0; specs[i].name; i++) {
        if (is_heading(&specs[i]))
            continue;
        assert(count < OPTIONS_MAX);
        tables->longs[count++] = (struct option){
            specs[i].name, specs[i].argument ? required_argument : no_argument, NULL, specs[i].key};
        if (specs[i].key > 255)
            continue;
        tables->shorts[at++] = (char)specs[i].key;
        if (specs[i].argument)
            tables->shorts[at++] = ':';
    }
}

/* Why it is none of ours: a flag was given an argument, or the name begins several of them, or none. */
static enum status complain_of_long(const char *word, const struct option *longs, struct error *error)
{
    const char *name = word + 2, *found[2] = {NULL, NULL};
    size_t length = strcspn(name, "="), count = 0;
    for (const struct option *option = longs; length > 0 && option->name; option++) {
        if (strncmp(option->name, name, length) != 0)
            continue;
        if (option->name[length] == '\0')
            return error_set(error, STATUS_USAGE, "%s: --%s takes no argument", word, option->name);
        if (count < 2)
            found[count] = option->name;
        count++;
    }
    if (count == 0)
        return error_set(error, STATUS_USAGE, "%s: unknown option; see --help", word);
    if (count == 1)
        return error_set(error, STATUS_USAGE, "%s: --%s takes no argument", word, found[0]);
    return error_set(error, STATUS_USAGE, "%s: may stand for --%s, --%s%s", word, found[0], found[1],
                     count > 2 ? " and others" : "");
}

/* Why getopt_long gave up. A letter may be a part of a longer word, or of a character of several bytes. */
static enum status complain(int key, const char *word, const struct getopt_tables *tables, struct error *error)
{
    unsigned char letter = optopt <= UCHAR_MAX ? (unsigned char)optopt : 0; /* glibc: negative from 0x80 on */
    bool unknown = letter && (letter == ':' || !strchr(tables->shorts, letter));
    if (key == ':')
        return error_set(error, STATUS_USAGE, "%s: expected an argument", word);
    if (unknown && isprint(letter))
        return error_set(error, STATUS_USAGE, "unknown option -%c", letter);
    if (unknown)
        return error_set(error, STATUS_USAGE, "unknown option -\\x%02x", letter);
    return complain_of_long(word, tables->longs, error);
}

enum status options_parse(int argc, char **argv, const struct option_spec *specs,
                          enum status (*handle)(void *context, int key, const char *argument,
                                                struct error *error),
                          void *context, int *first, struct error *error)
{
    struct getopt_tables tables;
    fill_tables(&tables, specs);
    opterr = 0;
    optind = 0; /* glibc: start anew, also after an earlier command line */
    for (;;) {
        int key = getopt_long(argc, argv, tables.shorts, tables.longs, NULL);
        if (key == -1)
            break;
        if (key == ':' || key == '?')
            return complain(key, argv[optind - 1], &tables, error);
        enum status status = handle(context, key, optarg, error);
        if (status != STATUS_OK)
            return status;
    }
    *first = optind;
    return STATUS_OK;
}

static void print_option(FILE *to, const struct option_spec *spec)
{
    char left[64];
    int at = spec->key <= 255 ? snprintf(left, sizeof left, "  -%c, --%s", spec->key, spec->name)
                              : snprintf(left, sizeof left, "      --%s", spec->name);
    if (spec->argument)
        snprintf(left + at, sizeof left - (size_t)at, " %s", spec->argument);
    fprintf(to, "%-24s %s\n", left, spec->help);
}

void options_help(FILE *to, const struct option_spec *specs)
{
    for (; specs->name; specs++)
        if (is_heading(specs))
            fprintf(to, "%s\n", specs->help);
        else
            print_option(to, specs);
}

enum status options_integer(const char *name, const char *text, int64_t min, int64_t max, int64_t *value,
                            struct error *error)
{
    char *end;
    errno = 0;
    long long parsed = strtoll(text, &end, 10);
    if (end == text || *end || isspace((unsigned char)*text) || errno || parsed < min || parsed > max)
        return error_set(error, STATUS_USAGE, "%s: expected a whole number from %lld to %lld, found \"%s\"",
                         name, (long long)min, (long long)max, text);
    *value = parsed;
    return STATUS_OK;
}

enum status options_number(const char *name, const char *text, double min, double max, double *value,
                           struct error *error)
{
    char *end;
    double parsed = strtod(text, &end);
    bool decimal = text[strspn(text, "0123456789.eE+-")] == '\0';
    if (end == text || *end || !decimal || !isfinite(parsed) || parsed < min || parsed > max)
        return error_set(error, STATUS_USAGE, "%s: expected a number from %g to %g, found \"%s\"", name, min,
                         max, text);
    *value = parsed;
    return STATUS_OK;
}

enum status options_size(const char *name, const char *text, int64_t min, int64_t max, int64_t *width,
                         int64_t *height, struct error *error)
{
    char left[32] = "";
    const char *cross = strchr(text, 'x');
    if (cross && (size_t)(cross - text) < sizeof left) {
        memcpy(left, text, (size_t)(cross - text));
        if (options_integer(name, left, min, max, width, error) == STATUS_OK &&
            options_integer(name, cross + 1, min, max, height, error) == STATUS_OK)
            return STATUS_OK;
    }
    return error_set(error, STATUS_USAGE, "%s: expected WIDTHxHEIGHT, each from %lld to %lld, found \"%s\"",
                     name, (long long)min, (long long)max, text);
}
