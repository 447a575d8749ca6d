/*
 * The parts of the .ply reader: the header, and the body as a row of values.
 */
#ifndef WEFT_SCENE_PLY_H
#define WEFT_SCENE_PLY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "scene/token.h"

enum ply_format { PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN };

enum ply_type {
    PLY_INT8,
    PLY_UINT8,
    PLY_INT16,
    PLY_UINT16,
    PLY_INT32,
    PLY_UINT32,
    PLY_FLOAT32,
    PLY_FLOAT64,
    PLY_TYPES
};

/* What a property is to a mesh; PLY_OTHER: nothing. */
enum ply_role { PLY_X, PLY_Y, PLY_Z, PLY_NX, PLY_NY, PLY_NZ, PLY_U, PLY_V, PLY_OTHER, PLY_CORNERS };

struct ply_property {
    enum ply_role role;
    enum ply_type type;
    bool list;
    enum ply_type count_type; /* of a list */
};

enum ply_element_kind { PLY_VERTICES, PLY_FACES, PLY_SKIPPED };

struct ply_element {
    enum ply_element_kind kind;
    uint64_t count;                  /* as the header claims; the file may hold fewer */
    struct ply_property *properties; /* owned */
    size_t property_count, property_capacity;
};

struct ply_header {
    enum ply_format format;
    struct ply_element *elements; /* owned */
    size_t element_count, element_capacity;
};

void ply_header_finish(struct ply_header *header);

/* Reads the header; the reader then stands at the body's first byte. Failures are the reader's. Afterwards
 * vertices come before faces, there is one element of each, with x, y and z, and one list of corners of a whole
 * type. */
void ply_header_read(struct ply_header *header, struct token_reader *text);

/* The body as a row of values, of either kind. */
struct ply_body {
    enum ply_format format;
    const uint8_t *start;      /* of the file: bytes are counted from there */
    struct token_reader *text; /* its position and status are the body's, binary or not */
};

/* "FILE:LINE: expected …" or "FILE: byte N: expected …" as the text's failure; `found` belongs to the binary
 * sentence. */
void ply_expected(struct ply_body *body, const char *expected, const char *found);

/* The next value; `what` is what it is, for failures. 0 after a failure. */
double ply_value(struct ply_body *body, enum ply_type type, const char *what);

/* Passes over `count` values. */
void ply_skip(struct ply_body *body, enum ply_type type, uint64_t count);

/* Call before each instance of an element, and ply_end_row after it: in text each has a line of its own. */
void ply_begin_row(struct ply_body *body, const char *what);
void ply_end_row(struct ply_body *body);

#endif
