/*
 * Where the loop of the farm leaves what others may see, for a thread that answers them: the state of the render, the
 * last lines of the log, and how the render went over the last minutes. The loop copies its state only while somebody
 * looks, and is never waited for: a reader asks for a newer one, and takes what there is if none comes.
 */
#ifndef WEFT_COORDINATOR_BOARD_H
#define WEFT_COORDINATOR_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/log.h"
#include "coordinator/snapshot.h"

struct board;

struct board *board_create(void);

/* Frees *board and sets it to NULL; *board may be NULL. */
void board_destroy(struct board **board);

/* --- the loop's side --- */

/* An eventfd that is readable when board_wait_ms is to be asked again; −1: there was none to be had. */
int board_bell(const struct board *board);

/* How long until board_publish is wanted, in milliseconds from now; 0: somebody waits. */
int board_wait_ms(struct board *board, int64_t now_ms);

/* The present state, borrowed for the call. `last`: there will be none after it. */
void board_publish(struct board *board, const struct snapshot *snapshot, int64_t now_ms, bool last);

/* Adds a line of the log; from any thread. */
void board_add_line(struct board *board, enum log_level level, const char *text);

/* Returns once whoever has looked within the last seconds has seen the last state, and all that belongs to it, or will
 * hardly any more: after 3 s at the latest, at once if nobody has looked. */
void board_linger(struct board *board);

/* --- the side of the one who answers: one thread --- */

/* The state: at most a quarter of a second old, unless the loop is busy for longer than half a second. The board's,
 * until the next call. NULL: there is none yet. */
const struct snapshot *board_look(struct board *board);

/* Somebody looks at what belongs to the state. */
void board_note_look(struct board *board);

/* Whether the state that board_look gave last is the last one. */
bool board_is_over(struct board *board);

/* {"next":N,"lines":[{"time":…,"level":"…","text":"…"},…]}: the lines from number `from` on that are still there, times
 * in seconds since 1970. */
void board_put_lines(struct board *board, uint64_t from, struct bytes *json);

/* {"step":…,"samples":[{"elapsed":…,"rays_per_second":…,"remaining":…},…]}, the oldest first. */
void board_put_history(struct board *board, struct bytes *json);

#endif
