/*
 * One scene of a command: loaded and checked, with all that workers need to render it, and its output.
 */
#ifndef WEFT_COORDINATOR_RENDER_JOB_H
#define WEFT_COORDINATOR_RENDER_JOB_H

#include "base/error.h"
#include "coordinator/assembly.h"
#include "coordinator/journal.h"
#include "coordinator/preview.h"
#include "coordinator/scheduler.h"
#include "coordinator/snapshot.h"
#include "scene/assets.h"
#include "trace/survey.h"
#include "wire/message.h"

/* What the command line says about every scene; 0 (of the filter: −1) where it says nothing. */
struct render_choices {
    uint32_t width, height; /* pixels */
    uint32_t samples;       /* of every pixel */
    double error;           /* RMSE to be met; not with samples */
    uint32_t samples_max;   /* of any pixel, to meet it; not with samples */
    int filter;             /* enum pixel_filter */
    int bits;               /* 8 or 16, of a PNG */
    const char *sample_map, *error_map; /* files to write; NULL: none */
    bool no_resume;         /* neither read nor write a journal */
    size_t preview_bytes;   /* that a preview may take; 0: there is none */
};

/* What is asked for where neither command line nor scene says anything. */
#define RENDER_ERROR_DEFAULT 0.005
enum { RENDER_SAMPLES_MAX_DEFAULT = 1024 };

/* A band, as it was accepted. */
struct band_account {
    uint32_t first_row, rows;
    uint32_t worker;  /* its number; 0: an earlier run's */
    int64_t lease_ms; /* how long it held the band */
    uint64_t offset;  /* of its bytes in the journal */
    uint32_t confirmed_by; /* the worker that returned the same bytes, or was believed when in doubt; 0: none */
    struct row_figures figures; /* of a render's */
};

struct render_job {
    char *scene_path, *output_path; /* owned */
    struct asset_set assets;        /* all files the scene reaches */
    struct bytes manifest;          /* encoded */
    struct digest manifest_digest;
    char source[DIGEST_HEX_BYTES + 8]; /* "sha256:" and the digest of all that the scene reaches, as the PNG says it */
    struct job_settings settings;
    double error;                   /* RMSE to be met; 0: the sampling is fixed */
    struct survey survey;           /* where an error is to be met, or one sample judged: the sum of what has come */
    struct sampling surveying;      /* the sampling of the survey; most == 0: there is none */
    struct sampling asked;          /* the render's, as far as it is known before the survey */
    struct sampling sampling;       /* the same, once all is surveyed */
    struct journal *journal;        /* holds all bands that were accepted; NULL once the output is complete */
    struct kept_rows *kept;         /* bands that an earlier run left, by pass and row */
    size_t kept_count;
    uint32_t rows_kept;             /* rows of the render among them, */
    uint64_t rays_kept;             /* and the rays that all of them took */
    uint32_t audited;               /* bands that a second worker rendered too */
    struct assembly *assembly;      /* NULL once the output is complete or abandoned */
    struct preview *preview;        /* NULL: nobody is to see it */
    enum job_state state;
    int64_t started_ms, render_ms; /* by the clock: when its first band was handed out, of all and of the render */
    int64_t ended_ms;
    uint32_t rows_done;
    struct row_figures figures; /* of the rows done */
    bool undone;                /* bands were taken back, and rows_done and figures are not yet without them */
    struct band_account *bands[PASSES]; /* those accepted, at their first row; rows == 0: none begins there */
};

/* Loads and validates the scene, opens its journal and its output, and takes what an earlier run left. On failure *job
 * holds nothing; STATUS_INPUT or STATUS_OUTPUT. */
enum status render_job_init(struct render_job *job, const char *scene_path, const char *output_path,
                            const struct render_choices *choices, struct error *error);

/* Abandons an output that is not complete; the journal stays for a later run. */
void render_job_finish(struct render_job *job);

/* Whether it is yet to be done, and not failed. */
bool render_job_is_open(const struct render_job *job);

/* Whether anything of it is there, by this run or an earlier one. */
bool render_job_has_begun(const struct render_job *job);

/* It will not be completed, as is known since now_ms. */
void render_job_fail(struct render_job *job, int64_t now_ms);

/* Rows of the survey; 0: there is none. */
uint32_t render_job_survey_rows(const struct render_job *job);

/* Bytes of the result of a band of so many rows. */
uint64_t render_job_result_bytes(const struct render_job *job, enum render_pass pass, uint32_t rows);

/* Takes the result of a band: a survey, or records of rows. Figures and offset are filled in here. STATUS_OUTPUT as of
 * journal_add and assembly_add. */
enum status render_job_take(struct render_job *job, enum render_pass pass, struct band_account band,
                            const uint8_t *result, struct error *error);

/* Whether another result of a band that was accepted has the same bytes. STATUS_OUTPUT as of journal_read. */
enum status render_job_compare(const struct render_job *job, enum render_pass pass, uint32_t first_row,
                               const uint8_t *result, bool *same, struct error *error);

/* A band that was accepted is right, as far as that worker is. */
void render_job_confirm(struct render_job *job, enum render_pass pass, uint32_t first_row, uint32_t worker);

/* Whether any row, of the survey or the render, has only liars to vouch for it: lied[i] says whether worker i is one
 * (0: who rendered what was kept). *liar is then whose it is. */
bool render_job_relies_on(const struct render_job *job, const bool *lied, uint32_t *liar);

/* Notes in the journal, all at once, that bands of the render which are that worker's count no more; render_job_undo is
 * to follow for each, or render_job_restart. STATUS_OUTPUT if that cannot be noted: then the journal is empty. */
enum status render_job_disown(struct render_job *job, uint32_t worker, struct error *error);

/* Takes back the band of the render that begins there, as if it had not come. STATUS_OUTPUT as of assembly_drop. After
 * the last of several, render_job_end_undoing. */
enum status render_job_undo(struct render_job *job, uint32_t first_row, struct error *error);
void render_job_end_undoing(struct render_job *job);

/* Takes back all, as if the job had not begun. STATUS_OUTPUT as of journal_clear and assembly_drop. */
enum status render_job_restart(struct render_job *job, struct error *error);

/* All is surveyed: chooses the render's sampling. */
void render_job_end_survey(struct render_job *job);

/* With all rows taken: completes the output when it is written, and rings the bell then (coordinator/assembly.h). */
void render_job_finish_output(struct render_job *job, int bell);
bool render_job_output_is_finished(const struct render_job *job);
bool render_job_output_is_written(const struct render_job *job);

/* Waits until then, and removes the journal. STATUS_OUTPUT. */
enum status render_job_complete(struct render_job *job, struct error *error);

/* Rays that this run took so far. */
uint64_t render_job_rays(const struct render_job *job);

/* Samples a pixel: the fixed number, or the mean of the rows done (0: none is). */
double render_job_samples(const struct render_job *job);

/* The estimated RMSE of a complete picture, as it is shown, 0..1 (trace/sampling.h, survey.h). NAN with
 * errors beyond what rows.h can count. */
double render_job_rmse(const struct render_job *job);

/* The same of rows alone, whose figures are given; NAN too of one sample a pixel by choice, unless they are all. */
double render_job_rows_rmse(const struct render_job *job, uint32_t rows, const struct row_figures *figures);

/* The asset (or manifest) of that digest, borrowed; NULL if the job has none. */
const struct bytes *render_job_find(const struct render_job *job, const struct digest *digest);

/* How every line of the log names rows: "rows 40 to 79", "rows 2 to 3 of the survey", into text, which is returned. */
enum { ROWS_NAME_BYTES = 64 };
const char *render_job_rows_name(enum render_pass pass, uint32_t first_row, uint32_t rows, char text[ROWS_NAME_BYTES]);

#endif
