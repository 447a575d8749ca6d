/* Private to render_job. */
#ifndef WEFT_COORDINATOR_RENDER_JOB_PRIVATE_H
#define WEFT_COORDINATOR_RENDER_JOB_PRIVATE_H

#include "coordinator/render_job.h"

/* Adds a result that is in the journal, where the band says. STATUS_OUTPUT as of assembly_add. */
enum status render_job_add_result(struct render_job *job, enum render_pass pass, struct band_account band,
                                  const uint8_t *result, struct error *error);

/* With journal and outputs open: takes what an earlier run left of the bands, as far as it fits together. STATUS_OUTPUT
 * as of render_job_add_result and render_job_undo. */
enum status render_job_take_kept(struct render_job *job, struct error *error);

#endif
