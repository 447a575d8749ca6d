/* What an earlier run left of a job, in its journal. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "coordinator/render_job_private.h"

/* The rows that are there. */
struct rows_found {
    uint32_t rows[PASSES], missing[PASSES];
    uint8_t *marks[PASSES]; /* of each row: whether it is there */
};

static void mark(struct rows_found *found, const struct journal_band *band, bool there)
{
    memset(found->marks[band->pass] + band->first_row, there, band->rows);
    found->missing[band->pass] += there ? -band->rows : band->rows;
}

static bool is_free(const struct rows_found *found, const struct journal_band *band)
{
    return !memchr(found->marks[band->pass] + band->first_row, 1, band->rows);
}

/* Rows of a render were sampled as a whole survey said, so of a survey nothing is ever undone alone. */
static bool fits(const struct render_job *job, const struct journal_band *band, const struct rows_found *found)
{
    if ((uint32_t)band->pass >= PASSES || band->rows == 0 || band->first_row >= found->rows[band->pass] ||
        band->rows > found->rows[band->pass] - band->first_row)
        return false;
    if (band->undone)
        return band->pass == PASS_RENDER && job->bands[PASS_RENDER][band->first_row].rows == band->rows;
    return (band->pass == PASS_SURVEY || found->missing[PASS_SURVEY] == 0) && is_free(found, band) &&
           band->size == render_job_result_bytes(job, band->pass, band->rows);
}

static enum status replay(struct render_job *job, const struct journal_band *band, const uint8_t *result,
                          struct error *error)
{
    struct band_account account = {.first_row = band->first_row, .rows = band->rows,
                                   .lease_ms = (int64_t)band->lease_ms, .offset = band->offset};
    return band->undone ? render_job_undo(job, band->first_row, error)
                        : render_job_add_result(job, band->pass, account, result, error);
}

static enum status read_journal(struct render_job *job, struct rows_found *found, struct error *error)
{
    struct journal_band band;
    struct bytes data = {0};
    enum status status = STATUS_OK;
    while (status == STATUS_OK && journal_next(job->journal, &band, &data)) {
        if (!fits(job, &band, found)) {
            journal_reject(job->journal);
            break;
        }
        mark(found, &band, !band.undone);
        status = replay(job, &band, data.data, error);
    }
    render_job_end_undoing(job);
    bytes_finish(&data);
    return status;
}

static void list_kept(struct render_job *job, const struct rows_found *found)
{
    size_t capacity = 0;
    for (int pass = 0; pass < PASSES; pass++)
        for (uint32_t row = 0; row < found->rows[pass]; row++) {
            uint32_t rows = job->bands[pass][row].rows;
            if (rows == 0)
                continue;
            job->kept = memory_grow(job->kept, &capacity, job->kept_count + 1, sizeof *job->kept);
            job->kept[job->kept_count++] = (struct kept_rows){(enum render_pass)pass, row, rows};
        }
}

enum status render_job_take_kept(struct render_job *job, struct error *error)
{
    const uint32_t rows[PASSES] = {render_job_survey_rows(job), job->settings.height};
    struct rows_found found = {.rows = {rows[0], rows[1]}, .missing = {rows[0], rows[1]}};
    for (int pass = 0; pass < PASSES; pass++) {
        found.marks[pass] = memory_array(rows[pass], 1);
        job->bands[pass] = memory_array(rows[pass], sizeof *job->bands[pass]);
    }
    enum status status = read_journal(job, &found, error);
    list_kept(job, &found);
    job->rows_kept = job->rows_done;
    job->rays_kept = row_figures_rays(&job->figures) + job->survey.rays;
    if (job->rows_kept > 0)
        log_info("%s: going on from its journal: %" PRIu32 " of %" PRIu32 " rows are there", job->output_path,
                 job->rows_kept, job->settings.height);
    for (int pass = 0; pass < PASSES; pass++)
        free(found.marks[pass]);
    return status;
}
