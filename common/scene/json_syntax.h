/*
 * A strict check of JSON text (RFC 8259) before cJSON builds a tree of it.
 *
 * cJSON lets pass, or reads wrongly, what a scene must not hold: leading zeros, numbers that overflow to
 * infinity, numbers longer than its buffer, raw control characters, bytes that are not UTF-8, \u0000 (which
 * ends its strings early) and text after the end. Its own errors have no line and no reason.
 */
#ifndef WEFT_SCENE_JSON_SYNTAX_H
#define WEFT_SCENE_JSON_SYNTAX_H

#include <stddef.h>

#include "base/error.h"

enum {
    JSON_DEPTH_MAX = 64,  /* arrays and objects within each other */
    JSON_NUMBER_MAX = 63, /* characters a number: cJSON's buffer */
};

/* STATUS_INPUT and "FILE:LINE:COLUMN: expected …, found …" unless the `size` bytes are one JSON value.
 * Lines and columns count from 1, columns in characters. Keys that occur twice are not looked for here. */
enum status json_syntax_check(const char *file, const char *text, size_t size, struct error *error);

#endif
