/*
 * Showing a render's progress while it runs: on a terminal one block that is redrawn in place, elsewhere a
 * plain line now and then, or JSON lines. No view uses colour. No block is drawn while the program is in its
 * terminal's background.
 *
 * The block never hides the cursor, which stands on the row below it: so no exit, however sudden, has to bring it back.
 *
 * A JSON line is written about four times a second, at once when a job's state changes, and at the end. It is one
 * object: struct snapshot (snapshot.h) as snapshot.schema.json describes it.
 */
#ifndef WEFT_COORDINATOR_PROGRESS_H
#define WEFT_COORDINATOR_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "coordinator/snapshot.h"

enum progress_mode {
    PROGRESS_NONE,
    PROGRESS_BAR,   /* a redrawn block; needs a terminal */
    PROGRESS_LINES, /* a line every few seconds */
    PROGRESS_JSON,  /* one JSON object a line */
};

struct progress;

/* Shows on `to` (standard error for people, standard output for JSON; borrowed). Registers with the log
 * (base/log.h) so that log lines and the block do not overwrite one another. */
struct progress *progress_create(enum progress_mode mode, FILE *to);

/* Clears the block, restores the terminal, frees *progress and sets it to NULL; *progress may be NULL. */
void progress_destroy(struct progress **progress);

/* The mode that "auto" means for this stream: a bar on a terminal that can move its cursor, else lines. */
enum progress_mode progress_mode_auto(FILE *to);

/* The terminal has changed: the next update is wanted at once. displaced: the cursor is where others have left it, so a
 * block that is shown stays behind. */
void progress_disturb(struct progress *progress, bool displaced);

/* How long until the next update is wanted, in milliseconds from now; −1: never. */
int progress_wait_ms(const struct progress *progress, int64_t now_ms);

/* Shows the snapshot if it is time to. */
void progress_update(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms);

/* Shows the snapshot once more, as the final state (JSON), and clears the block (bar). */
void progress_finish(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms);

#endif
