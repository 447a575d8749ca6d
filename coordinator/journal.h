/*
 * The journal of a render: every band that was accepted, and what was taken back, in a file beside the output,
 * `.NAME.journal`, so that a coordinator that was killed goes on where it was. It is also where rows wait that cannot
 * be written yet, so that no picture is ever whole in memory.
 *
 * The file begins with a head: a magic word and what the render is of (struct journal_key). Then entries: a head (kind
 * and pass, first row, rows, milliseconds of the band's lease, bytes), the bytes, and a tag: a keyed hash (BLAKE2b) of
 * them, whose key is the tag before. So an entry that was cut short, or changed, or belongs to another journal is told,
 * and nothing behind it is believed. Numbers are little-endian. Bands are brought to disk in groups, once a second, by
 * a thread of its own: a machine that fails loses what came after, and a process that is killed loses nothing. What is
 * taken back is on disk before anything is built on that.
 *
 * As long as it is open the file is locked: nobody else renders to the same output. One that is not to be resumed is
 * locked too, but not written; rows then wait in a file without a name.
 */
#ifndef WEFT_COORDINATOR_JOURNAL_H
#define WEFT_COORDINATOR_JOURNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "base/hash.h"
#include "wire/message.h"

/* What a render's bytes depend on. */
struct journal_key {
    struct digest program;  /* versions */
    struct digest scene;    /* and all that it reaches */
    struct digest settings; /* what was asked for */
};

struct journal_band {
    bool undone; /* it counts no more, as was found after it had been added: size 0 */
    enum render_pass pass;
    uint32_t first_row, rows;
    uint64_t lease_ms; /* how long a worker held it */
    uint64_t size;     /* bytes of its result */
    uint64_t offset;   /* where they are in the file: set by journal_next and journal_add */
};

struct journal;

/* Opens and locks the journal of that output. With `resume` what an earlier run left under the same key is kept, to be
 * taken by journal_next, and what was left under another is said and discarded; without, the journal is left as it is.
 * NULL with *status STATUS_OUTPUT and *error set where that cannot be done, or another process renders to `output`. */
struct journal *journal_open(const char *output, const struct journal_key *key, bool resume, enum status *status,
                             struct error *error);

/* Whether a journal that an earlier run left beside that output has that key, so that it could be resumed. */
bool journal_is_left(const char *output, const struct journal_key *key);

/* Before anything is added: the next entry that an earlier run left, a band and its bytes into *data, replacing what
 * that held, or that a band before it is undone. False after the last that is whole; a journal that goes on behind it
 * is cut there, and that is said. */
bool journal_next(struct journal *journal, struct journal_band *band, struct bytes *data);

/* The entry that journal_next gave does not fit the render: it is dropped, with all behind it. */
void journal_reject(struct journal *journal);

/* Appends a band, whose bytes are data[band->size], and sets its offset. STATUS_OUTPUT if it cannot be written, or an
 * earlier one could not be brought to disk. */
enum status journal_add(struct journal *journal, struct journal_band *band, const uint8_t *data, struct error *error);

/* Notes that bands[count], which were added, count no more, in one piece, and brings that to disk. STATUS_OUTPUT if it
 * cannot. */
enum status journal_undo(struct journal *journal, const struct journal_band *bands, size_t count,
                         struct error *error);

/* Forgets all bands, on disk too. STATUS_OUTPUT if it cannot. */
enum status journal_clear(struct journal *journal, struct error *error);

/* Reads data[size] back from `offset`; by any thread. STATUS_OUTPUT if that fails. */
enum status journal_read(const struct journal *journal, uint64_t offset, void *data, size_t size, struct error *error);

/* Closes it, sets *journal to NULL, and removes the file if the render is done or it holds nothing; else all of it is
 * on disk. *journal may be NULL. */
void journal_close(struct journal **journal, bool done);

#endif
