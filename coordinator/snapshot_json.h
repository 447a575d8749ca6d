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

/* A snapshot that was read, with all that it points to. All zero is an empty one. */
struct snapshot_reading {
    struct snapshot snapshot;
    struct cJSON *json; /* whose strings it has */
    struct job_snapshot *jobs;
    struct worker_snapshot *workers;
    struct stretch_snapshot *stretches;
};

/* Reads what snapshot_write_json writes, from text[size], which may come from anybody: all that is taken keeps to the
 * limits that snapshot.h and the schema name; keys that are not known are passed over. Writing it again gives the same
 * bytes where no number was beyond 2^53. STATUS_INPUT with a sentence otherwise, and *copy is empty. Takes memory of
 * some twenty times the size at most. */
enum status snapshot_read_json(struct snapshot_reading *copy, const char *text, size_t size, struct error *error);
void snapshot_reading_finish(struct snapshot_reading *copy);

#endif
