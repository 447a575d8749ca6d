/*
 * The report of a command: one JSON document of all that is known of its renders and of who rendered what.
 * report.schema.json says what stands in it.
 */
#ifndef WEFT_COORDINATOR_REPORT_H
#define WEFT_COORDINATOR_REPORT_H

#include "base/bytes.h"
#include "coordinator/render_job.h"
#include "coordinator/snapshot.h"
#include "image/part_file.h"

/* Appends the document. The snapshot is of these jobs, jobs[snapshot->job_count], in their order. */
void report_json(struct bytes *text, const struct snapshot *snapshot, const struct render_job *jobs);

/* Writes it to the open file, which becomes complete and closed. STATUS_OUTPUT; the file is then discarded. */
enum status report_publish(struct part_file *file, const struct snapshot *snapshot, const struct render_job *jobs,
                           struct error *error);

#endif
