/*
 * Showing a render's progress while it runs: on a terminal one block that is redrawn in place, elsewhere a
 * plain line now and then, or JSON lines. No view uses colour. No block is drawn while the program is in its
 * terminal's background.
 *
 * A JSON line is written about four times a second, at once when a job's state changes, and at the end. It is
 * one object, whose members are those of struct snapshot (snapshot.h); times are in seconds:
 *
 *   elapsed, rays, rays_per_second
 *   jobs     array of {scene, output, state: "waiting", "surveying", "running", "done" or "failed", width, height,
 *            samples_max, samples: null while unknown, error: null where none was asked for, rmse: null until it is
 *            done and where nothing tells, rows_done, rows_in_work, rays, elapsed, remaining: null while unknown}
 *   workers  array of {number, host, pid, threads, kernel, state: "loading", "working", "idle", "draining" or
 *            "gone", bands_held, bands_done, rows_done, rays, rays_per_second}
 *
 * A number that is not finite is null. Strings are valid UTF-8: U+FFFD stands for each byte of a name that is
 * not.
 */
#ifndef WEFT_COORDINATOR_PROGRESS_H
#define WEFT_COORDINATOR_PROGRESS_H

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

/* How long until the next update is wanted, in milliseconds from now; −1: never. */
int progress_wait_ms(const struct progress *progress, int64_t now_ms);

/* Shows the snapshot if it is time to. */
void progress_update(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms);

/* Shows the snapshot once more, as the final state (JSON), and clears the block (bar). */
void progress_finish(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms);

#endif
