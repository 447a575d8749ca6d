/*
 * A snapshot in Prometheus' text format, version 0.0.4. Pure: the same snapshot gives the same text.
 */
#ifndef WEFT_COORDINATOR_METRICS_H
#define WEFT_COORDINATOR_METRICS_H

#include "base/bytes.h"
#include "coordinator/snapshot.h"

/* So many workers and scenes have figures of their own: workers that are there, the first to join, and scenes that have
 * begun, the last of them. The others are counted. */
enum { METRICS_WORKERS_MAX = 1000, METRICS_JOBS_MAX = 100 };

#define METRICS_CONTENT_TYPE "text/plain; version=0.0.4; charset=utf-8"

/* Appends all of it. A NUL that `size` does not count follows. */
void metrics_write(struct bytes *text, const struct snapshot *snapshot);

#endif
