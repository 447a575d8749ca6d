#include "coordinator/render_job.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "coordinator/render_job_private.h"

void render_job_finish(struct render_job *job)
{
    assembly_abandon(&job->assembly);
    preview_destroy(&job->preview);
    journal_close(&job->journal, false);
    free(job->kept);
    asset_set_finish(&job->assets);
    bytes_finish(&job->manifest);
    for (int pass = 0; pass < PASSES; pass++)
        free(job->bands[pass]);
    free(job->scene_path);
    free(job->output_path);
    *job = (struct render_job){0};
}

bool render_job_is_open(const struct render_job *job)
{
    return job->state == JOB_WAITING || job->state == JOB_SURVEYING || job->state == JOB_RUNNING;
}

bool render_job_has_begun(const struct render_job *job)
{
    return job->rows_done > 0 || job->survey.pixels > 0;
}

void render_job_fail(struct render_job *job, int64_t now_ms)
{
    job->ended_ms = now_ms;
    if (job->state == JOB_WAITING)
        job->started_ms = job->render_ms = job->ended_ms;
    job->state = JOB_FAILED;
}

const struct bytes *render_job_find(const struct render_job *job, const struct digest *digest)
{
    if (digest_equal(&job->manifest_digest, digest))
        return &job->manifest;
    for (size_t i = 0; i < job->assets.count; i++)
        if (digest_equal(&job->assets.assets[i].digest, digest))
            return &job->assets.assets[i].bytes;
    return NULL;
}

const char *render_job_rows_name(enum render_pass pass, uint32_t first_row, uint32_t rows, char text[ROWS_NAME_BYTES])
{
    snprintf(text, ROWS_NAME_BYTES, "rows %" PRIu32 " to %" PRIu32 "%s", first_row, first_row + rows - 1,
             pass == PASS_SURVEY ? " of the survey" : "");
    return text;
}

/* --- results ---------------------------------------------------------------------------------------------- */

uint32_t render_job_survey_rows(const struct render_job *job)
{
    return job->surveying.most > 0 ? survey_grid(job->settings.width, job->settings.height).down : 0;
}

uint64_t render_job_result_bytes(const struct render_job *job, enum render_pass pass, uint32_t rows)
{
    return pass == PASS_SURVEY ? SURVEY_BYTES : (uint64_t)rows * assembly_record_bytes(job->assembly);
}

static void add_figures(struct render_job *job, const struct band_account *band)
{
    row_figures_add(&job->figures, &band->figures);
    job->rows_done += band->rows;
}

enum status render_job_add_result(struct render_job *job, enum render_pass pass, struct band_account band,
                                  const uint8_t *result, struct error *error)
{
    struct band_account *place = &job->bands[pass][band.first_row];
    *place = band;
    if (pass == PASS_SURVEY) {
        struct survey part;
        survey_read(&part, result);
        survey_add(&job->survey, &part);
        return STATUS_OK;
    }
    place->figures = assembly_sum(job->assembly, band.rows, result);
    add_figures(job, place);
    if (job->preview)
        preview_add(job->preview, band.first_row, band.rows, band.worker, result);
    return assembly_add(job->assembly, band.first_row, band.rows, band.offset, error);
}

enum status render_job_take(struct render_job *job, enum render_pass pass, struct band_account account,
                            const uint8_t *result, struct error *error)
{
    struct journal_band band = {.pass = pass, .first_row = account.first_row, .rows = account.rows,
                                .lease_ms = (uint64_t)account.lease_ms,
                                .size = render_job_result_bytes(job, pass, account.rows)};
    enum status status = journal_add(job->journal, &band, result, error);
    account.offset = band.offset;
    return status == STATUS_OK ? render_job_add_result(job, pass, account, result, error) : status;
}

void render_job_end_survey(struct render_job *job)
{
    if (job->error > 0)
        job->sampling = survey_choose(&job->survey, &job->surveying, job->error);
}

/* --- results that are doubted ----------------------------------------------------------------------------- */

enum status render_job_compare(const struct render_job *job, enum render_pass pass, uint32_t first_row,
                               const uint8_t *result, bool *same, struct error *error)
{
    enum { PIECE_BYTES = 1 << 16 };
    const struct band_account *band = &job->bands[pass][first_row];
    uint64_t size = render_job_result_bytes(job, pass, band->rows);
    uint8_t piece[PIECE_BYTES];
    enum status status = STATUS_OK;
    *same = true;
    for (uint64_t at = 0; at < size && *same && status == STATUS_OK; at += sizeof piece) {
        size_t bytes = size - at < sizeof piece ? (size_t)(size - at) : sizeof piece;
        status = journal_read(job->journal, band->offset + at, piece, bytes, error);
        *same = status == STATUS_OK && memcmp(piece, result + at, bytes) == 0;
    }
    return status;
}

void render_job_confirm(struct render_job *job, enum render_pass pass, uint32_t first_row, uint32_t worker)
{
    job->bands[pass][first_row].confirmed_by = worker;
}

bool render_job_relies_on(const struct render_job *job, const bool *lied, uint32_t *liar)
{
    const uint32_t rows[PASSES] = {render_job_survey_rows(job), job->settings.height};
    for (int pass = 0; pass < PASSES; pass++)
        for (uint32_t row = 0; row < rows[pass]; row++) {
            const struct band_account *band = &job->bands[pass][row];
            bool confirmed = band->confirmed_by > 0 && !lied[band->confirmed_by];
            *liar = band->worker;
            if (band->rows > 0 && lied[band->worker] && !confirmed)
                return true;
        }
    return false;
}

enum status render_job_disown(struct render_job *job, uint32_t worker, struct error *error)
{
    struct journal_band *bands = memory_array(job->settings.height, sizeof *bands);
    struct error ignored;
    size_t count = 0;
    for (uint32_t row = 0; row < job->settings.height; row++) {
        const struct band_account *band = &job->bands[PASS_RENDER][row];
        if (band->rows > 0 && band->worker == worker)
            bands[count++] = (struct journal_band){.pass = PASS_RENDER, .first_row = row, .rows = band->rows};
    }
    enum status status = count > 0 ? journal_undo(job->journal, bands, count, error) : STATUS_OK;
    if (status != STATUS_OK)
        journal_clear(job->journal, &ignored);
    free(bands);
    return status;
}

enum status render_job_undo(struct render_job *job, uint32_t first_row, struct error *error)
{
    struct band_account *gone = &job->bands[PASS_RENDER][first_row];
    enum status status = assembly_drop(job->assembly, first_row, gone->rows, error);
    if (job->preview)
        preview_drop(job->preview, first_row, gone->rows);
    gone->rows = 0;
    job->undone = true;
    return status;
}

/* Figures may have been too large to count, so they are summed anew. */
void render_job_end_undoing(struct render_job *job)
{
    const struct band_account *bands = job->bands[PASS_RENDER];
    if (!job->undone)
        return;
    job->undone = false;
    job->rows_done = 0;
    job->figures = (struct row_figures){0};
    for (uint32_t row = 0; row < job->settings.height; row++)
        if (bands[row].rows > 0)
            add_figures(job, &bands[row]);
}

enum status render_job_restart(struct render_job *job, struct error *error)
{
    enum status status = STATUS_OK;
    for (uint32_t row = 0; row < job->settings.height && status == STATUS_OK; row++)
        if (job->bands[PASS_RENDER][row].rows > 0)
            status = assembly_drop(job->assembly, row, job->bands[PASS_RENDER][row].rows, error);
    if (job->preview)
        preview_drop(job->preview, 0, job->settings.height);
    memset(job->bands[PASS_RENDER], 0, job->settings.height * sizeof *job->bands[PASS_RENDER]);
    memset(job->bands[PASS_SURVEY], 0, render_job_survey_rows(job) * sizeof *job->bands[PASS_SURVEY]);
    job->figures = (struct row_figures){0};
    job->survey = (struct survey){0};
    job->sampling = job->asked;
    job->rows_done = job->rows_kept = 0;
    job->undone = false;
    job->kept_count = 0;
    job->rays_kept = 0;
    struct error ignored; /* whatever the outputs said, a later run must not go on from there */
    enum status cleared = journal_clear(job->journal, status == STATUS_OK ? error : &ignored);
    return status == STATUS_OK ? cleared : status;
}

/* --- output ----------------------------------------------------------------------------------------------- */

void render_job_finish_output(struct render_job *job, int bell)
{
    assembly_finish(job->assembly, bell);
}

bool render_job_output_is_finished(const struct render_job *job)
{
    return assembly_is_finished(job->assembly);
}

bool render_job_output_is_written(const struct render_job *job)
{
    return assembly_is_written(job->assembly);
}

enum status render_job_complete(struct render_job *job, struct error *error)
{
    enum status status = assembly_complete(&job->assembly, error);
    if (status == STATUS_OK)
        journal_close(&job->journal, true);
    return status;
}

/* --- figures ---------------------------------------------------------------------------------------------- */

uint64_t render_job_rays(const struct render_job *job)
{
    return row_figures_rays(&job->figures) + job->survey.rays - job->rays_kept;
}

double render_job_samples(const struct render_job *job)
{
    if (job->error == 0)
        return job->sampling.most;
    return job->rows_done > 0 ? (double)job->figures.samples / ((double)job->settings.width * job->rows_done) : 0;
}

double render_job_rows_rmse(const struct render_job *job, uint32_t rows, const struct row_figures *figures)
{
    const uint64_t *error = figures->error;
    uint64_t pixels = (uint64_t)job->settings.width * rows;
    if (error[0] == UINT64_MAX || error[1] == UINT64_MAX)
        return NAN;
    if (job->sampling.most == 1) /* a survey tells of the whole alone */
        return rows == job->settings.height ? survey_error_of_one(&job->survey) : NAN;
    if (job->error > 0)
        return survey_error(&job->survey, &job->sampling, pixels, error);
    return sqrt(((double)error[0] + (double)error[1]) * PIXEL_ERROR_UNIT / (double)pixels);
}

double render_job_rmse(const struct render_job *job)
{
    return render_job_rows_rmse(job, job->settings.height, &job->figures);
}
