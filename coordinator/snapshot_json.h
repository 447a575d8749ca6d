/*
 * A snapshot as JSON, which snapshot.schema.json describes: the one form for programs, wherever they get it.
 */
#ifndef WEFT_COORDINATOR_SNAPSHOT_JSON_H
#define WEFT_COORDINATOR_SNAPSHOT_JSON_H

#include "base/bytes.h"
#include "base/error.h"
#include "coordinator/snapshot.h"

/* Appends one object with a newline. A NUL that `size` does not count follows. */
void snapshot_write_json(struct bytes *text, const struct snapshot *snapshot);

/* Appends the members that say who a worker is, "number" to "state", with a comma behind each: as every document of
 * weft begins a worker. */
void snapshot_write_worker(struct bytes *text, const struct worker_snapshot *worker);

/* Reads what snapshot_write_json writes, from text[size], which may come from anybody: all that is taken keeps to the
 * limits that snapshot.h and the schema name; keys that are not known are passed over. Writing it again gives the same
 * bytes where no number was beyond 2^53. In one piece of memory: the caller's, to free. NULL with a sentence otherwise.
 * Takes memory of some twenty times the size at most. */
struct snapshot *snapshot_read_json(const char *text, size_t size, struct error *error);

#endif
