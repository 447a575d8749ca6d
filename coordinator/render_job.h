/*
 * One scene of a command: loaded and checked, with all that workers need to render it, and its output.
 */
#ifndef WEFT_COORDINATOR_RENDER_JOB_H
#define WEFT_COORDINATOR_RENDER_JOB_H

#include "base/error.h"
#include "coordinator/assembly.h"
#include "coordinator/snapshot.h"
#include "scene/assets.h"
#include "wire/message.h"

/* What the command line says about every scene; 0 (of the filter: −1) where it says nothing. */
struct render_choices {
    uint32_t width, height; /* pixels */
    uint32_t samples;       /* a pixel */
    int filter;             /* enum pixel_filter */
    int bits;               /* 8 or 16, of a PNG */
};

enum { RENDER_SAMPLES_DEFAULT = 4 };

struct render_job {
    char *scene_path, *output_path; /* owned */
    struct asset_set assets;        /* all files the scene reaches */
    struct bytes manifest;          /* encoded */
    struct digest manifest_digest;
    struct job_settings settings;
    struct assembly *assembly;      /* NULL once the output is complete or abandoned */
    enum job_state state;
    int64_t started_ms, ended_ms; /* by the clock; started: its first band was handed out */
    uint32_t rows_done;
    struct row_figures figures; /* of the rows done */
};

/* Loads and validates the scene, and opens its output. On failure *job holds nothing; STATUS_INPUT or STATUS_OUTPUT. */
enum status render_job_init(struct render_job *job, const char *scene_path, const char *output_path,
                            const struct render_choices *choices, struct error *error);

/* Abandons an output that is not complete. */
void render_job_finish(struct render_job *job);

/* The asset (or manifest) of that digest, borrowed; NULL if the job has none. */
const struct bytes *render_job_find(const struct render_job *job, const struct digest *digest);

#endif
