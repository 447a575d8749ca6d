/*
 * Weaving a picture from its bands, and maps of where its samples went and how far off its pixels are: row records
 * arrive in any order in the journal and are written from the top as soon as they can be, by a thread that runs from
 * the first of them until the files are complete, so that whoever adds them does not wait.
 */
#ifndef WEFT_COORDINATOR_ASSEMBLY_H
#define WEFT_COORDINATOR_ASSEMBLY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "coordinator/journal.h"
#include "image/writer.h"
#include "wire/rows.h"

struct assembly;

/* Files to write; NULL: not that map. */
struct assembly_paths {
    const char *picture, *sample_map, *error_map;
    bool maps; /* the records have maps though none is written */
};

/* Whether the records have maps. */
static inline bool assembly_has_maps(const struct assembly_paths *paths)
{
    return paths->sample_map || paths->error_map || paths->maps;
}

/* Opens the outputs (image/writer.h says how): the picture as described, maps as PNGs of 8 bits and its size with its
 * texts (coordinator/map_colours.h). The rows will be in the journal, which is borrowed; strings are copied. NULL with
 * *status and *error set if one cannot be written. */
struct assembly *assembly_create(const struct assembly_paths *paths, const struct image_description *description,
                                 const struct journal *journal, enum status *status, struct error *error);

/* Bytes of one row's record. */
size_t assembly_record_bytes(const struct assembly *assembly);

/* Takes the records of rows first_row..first_row + rows − 1, which must be within the picture and new; they begin at
 * that offset in the journal. STATUS_OUTPUT if any row, of this call or an earlier one, is known to have failed to be
 * written; only assembly_abandon may follow. */
enum status assembly_add(struct assembly *assembly, uint32_t first_row, uint32_t rows, uint64_t offset,
                         struct error *error);

/* The sums of the figures of so many records. */
struct row_figures assembly_sum(const struct assembly *assembly, uint32_t rows, const uint8_t *records);

/* Takes rows back that were added, to be added again; where they were written already, writing begins anew. Not after
 * assembly_finish. STATUS_OUTPUT as of assembly_create and assembly_add. */
enum status assembly_drop(struct assembly *assembly, uint32_t first_row, uint32_t rows, struct error *error);

/* With all rows taken: has the files completed as soon as all is written, the picture before the maps. Then, or when
 * that has failed, 1 is added to the eventfd `bell`, unless that is −1. */
void assembly_finish(struct assembly *assembly, int bell);

/* After assembly_finish: whether the files are complete, or that has failed. */
bool assembly_is_finished(struct assembly *assembly);

/* After assembly_finish: whether all is written, so that the files have their names or get them at any moment. */
bool assembly_is_written(struct assembly *assembly);

/* After assembly_finish: waits until then. Frees *assembly and sets it to NULL in any case; STATUS_OUTPUT leaves no
 * trace of the files that are not complete. */
enum status assembly_complete(struct assembly **assembly, struct error *error);

/* Leaves no trace of the outputs; *assembly may be NULL. */
void assembly_abandon(struct assembly **assembly);

#endif
