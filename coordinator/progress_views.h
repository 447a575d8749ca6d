/*
 * The views of a snapshot as text. Pure: the same snapshot and size give the same text.
 */
#ifndef WEFT_COORDINATOR_PROGRESS_VIEWS_H
#define WEFT_COORDINATOR_PROGRESS_VIEWS_H

#include <stddef.h>

#include "base/bytes.h"
#include "coordinator/snapshot.h"

/* These three append to *text, where a NUL that `size` does not count follows. */

/* The block for a terminal of that size: the job that is under way, its bar and a line a worker. At most
 * rows - 2 lines, each narrower than `columns` and ended by a newline: the cursor stands below the block, and
 * above it the latest line of the log stays in sight. */
void progress_block(struct bytes *text, const struct snapshot *snapshot, size_t columns, size_t rows);

/* One plain line with its newline, or nothing if there is no job. */
void progress_line(struct bytes *text, const struct snapshot *snapshot);

/* One JSON object with a newline; progress.h lists its keys. */
void progress_json(struct bytes *text, const struct snapshot *snapshot);

/* One word in lower case, the same in every view. */
const char *progress_job_state(enum job_state state);
const char *progress_worker_state(enum worker_state state);

#endif
