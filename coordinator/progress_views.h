/*
 * The views of a snapshot for people (snapshot_json.h has the one for programs). Pure: the same snapshot and size give
 * the same text.
 */
#ifndef WEFT_COORDINATOR_PROGRESS_VIEWS_H
#define WEFT_COORDINATOR_PROGRESS_VIEWS_H

#include <stddef.h>

#include "base/bytes.h"
#include "coordinator/snapshot.h"

/* These append to *text, where a NUL that `size` does not count follows. */

/* The block for a terminal of that size: the job that is under way, its picture as a strip (the top is on the left),
 * its figures and a line a worker, as much of these as fits, figures and strip before the rest. At most rows - 2 lines,
 * each narrower than `columns` and ended by a newline: the cursor stands below the block, and above it the latest line
 * of the log stays in sight.
 *
 * A cell of the strip stands for some rows: █ all are done, ▒ some are, ░ none is; a digit or letter: some are in work,
 * by the worker whose mark that is: 1 to 9 their numbers, a to z, written behind the number, those of 10 to 35, and +
 * those of all others. */
void progress_block(struct bytes *text, const struct snapshot *snapshot, size_t columns, size_t rows);

/* One plain line with its newline, or nothing if there is no job. */
void progress_line(struct bytes *text, const struct snapshot *snapshot);

#endif
