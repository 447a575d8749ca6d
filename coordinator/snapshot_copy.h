/*
 * A snapshot that outlives the call in which it was borrowed.
 */
#ifndef WEFT_COORDINATOR_SNAPSHOT_COPY_H
#define WEFT_COORDINATOR_SNAPSHOT_COPY_H

#include "coordinator/snapshot.h"

/* A copy of all that it holds, in one piece of memory: the caller's, to free. */
struct snapshot *snapshot_copy(const struct snapshot *snapshot);

#endif
