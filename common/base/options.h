/*
 * Command lines: GNU long options with short forms. One table serves the parser and --help, so they
 * cannot differ.
 */
#ifndef WEFT_BASE_OPTIONS_H
#define WEFT_BASE_OPTIONS_H

#include <stdint.h>
#include <stdio.h>

#include "base/error.h"

struct option_spec {
    int key;              /* a letter (the short form) or any value above 255 */
    const char *name;     /* long name without dashes */
    const char *argument; /* what --help calls the argument; NULL for a flag */
    const char *help;     /* one line */
};

/* A row that only heads the options below it in --help. */
#define OPTIONS_HEADING(text) {0, "", NULL, text}

enum { OPTIONS_MAX = 48 };

/* Walks argv with getopt_long. `specs` ends with a row whose name is NULL. For each option calls
 * handle(context, key, argument) and stops at the first failure. On success *first is the index in argv
 * of the first operand (operands are moved behind the options). STATUS_USAGE for an unknown option or a
 * missing argument. */
enum status options_parse(int argc, char **argv, const struct option_spec *specs,
                          enum status (*handle)(void *context, int key, const char *argument,
                                                struct error *error),
                          void *context, int *first, struct error *error);

/* Prints one aligned line per option. It fits 80 columns where `--name ARGUMENT` has at most 18 characters and the help
 * at most 54. */
void options_help(FILE *to, const struct option_spec *specs);

/* A whole decimal number in min..max; `name` is what the error calls it, e.g. "--workers". */
enum status options_integer(const char *name, const char *text, int64_t min, int64_t max, int64_t *value,
                            struct error *error);

/* A finite decimal number in min..max; not in hexadecimal, and no "inf" or "nan". */
enum status options_number(const char *name, const char *text, double min, double max, double *value,
                           struct error *error);

/* "WxH", each min..max. */
enum status options_size(const char *name, const char *text, int64_t min, int64_t max, int64_t *width,
                         int64_t *height, struct error *error);

#endif
