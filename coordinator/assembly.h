/*
 * Weaving a picture from its bands: row records arrive in any order and are written from the top as soon as they
 * can be, by a thread that runs from the first of them to the last, so that whoever adds them does not wait.
 */
#ifndef WEFT_COORDINATOR_ASSEMBLY_H
#define WEFT_COORDINATOR_ASSEMBLY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "image/writer.h"
#include "wire/rows.h"

struct assembly;

/* Opens the output (image/writer.h says how). `maps`: whether the records have them. NULL with *status and *error set
 * if it cannot be written. */
struct assembly *assembly_create(const char *path, const struct image_description *description, bool maps,
                                 enum status *status, struct error *error);

/* Bytes of one row's record. */
size_t assembly_record_bytes(const struct assembly *assembly);

/* Takes the records of rows first_row..first_row + rows − 1, which must be within the picture and new. They are
 * copied. STATUS_OUTPUT if any row, of this call or an earlier one, is known to have failed to be written; only
 * assembly_abandon may follow. */
enum status assembly_add(struct assembly *assembly, uint32_t first_row, uint32_t rows, const uint8_t *records,
                         struct error *error);

/* The sums of all rows taken so far. */
struct row_figures assembly_figures(const struct assembly *assembly);

/* With all rows taken: waits until they are written and completes the file. Frees *assembly and sets it to NULL in
 * any case; STATUS_OUTPUT leaves no trace of the output. */
enum status assembly_complete(struct assembly **assembly, struct error *error);

/* Leaves no trace of the output; *assembly may be NULL. */
void assembly_abandon(struct assembly **assembly);

#endif
