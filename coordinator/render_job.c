#include "coordinator/render_job.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "scene/load.h"
#include "trace/proof.h"
#include "wire/manifest.h"

static bool ends_with(const char *text, const char *ending)
{
    size_t length = strlen(text), tail = strlen(ending);
    return length >= tail && strcmp(text + length - tail, ending) == 0;
}

static enum status choose_format(const char *output_path, int bits, uint8_t *format, struct error *error)
{
    if (ends_with(output_path, ".pfm"))
        *format = PIXEL_LINEAR;
    else if (ends_with(output_path, ".png"))
        *format = bits == 16 ? PIXEL_SRGB16 : PIXEL_SRGB8;
    else
        return error_set(error, STATUS_USAGE, "%s: expected an output that ends with .png or .pfm", output_path);
    return STATUS_OK;
}

/* The scene's samples count where the command line asks neither for samples nor for an error. */
static void choose_sampling(struct render_job *job, uint32_t scene_samples, const struct render_choices *choices)
{
    uint32_t samples = choices->samples, most = choices->samples_max;
    if (!samples && choices->error == 0 && !most)
        samples = scene_samples;
    if (samples) {
        job->sampling = (struct sampling){samples, samples, 0};
        if (samples == 1)
            job->surveying = survey_sampling(4, RENDER_ERROR_DEFAULT);
        return;
    }
    most = sampling_stage(sampling_stage_within(most ? most : RENDER_SAMPLES_MAX_DEFAULT));
    job->error = choices->error > 0 ? choices->error : RENDER_ERROR_DEFAULT;
    job->surveying = survey_sampling(most, job->error);
    job->sampling.most = most;
}

static void choose_settings(struct render_job *job, const struct scene *scene, const struct render_choices *choices)
{
    job->settings.width = choices->width ? choices->width : scene->width;
    job->settings.height = choices->height ? choices->height : scene->height;
    choose_sampling(job, scene->samples, choices);
    job->asked = job->sampling;
    job->settings.filter = (uint8_t)(choices->filter >= 0 ? choices->filter : (int)scene->filter);
    job->settings.maps = choices->sample_map || choices->error_map || choices->preview_bytes > 0;
}

static void make_manifest(struct render_job *job)
{
    struct manifest manifest = {.count = job->assets.count};
    manifest.entries = memory_array(manifest.count, sizeof *manifest.entries);
    for (size_t i = 0; i < manifest.count; i++) {
        const struct asset *asset = &job->assets.assets[i];
        strncpy(manifest.entries[i].name, asset->name, MANIFEST_NAME_BYTES - 1);
        manifest.entries[i].digest = asset->digest;
        manifest.entries[i].size = asset->bytes.size;
    }
    manifest_encode(&manifest, &job->manifest);
    job->manifest_digest = digest_of(job->manifest.data, job->manifest.size);
    manifest_finish(&manifest);
}

static void name_source(struct render_job *job)
{
    struct digest digest = asset_set_digest(&job->assets);
    strcpy(job->source, "sha256:");
    digest_hex(&digest, job->source + strlen(job->source));
}

static struct digest settings_digest(const struct render_job *job)
{
    const struct sampling *samplings[] = {&job->surveying, &job->sampling};
    const struct job_settings *settings = &job->settings;
    struct bytes text = {0};
    bytes_put_u32(&text, settings->width);
    bytes_put_u32(&text, settings->height);
    bytes_put_u8(&text, settings->filter);
    bytes_put_u8(&text, settings->pixel_format);
    bytes_put_u8(&text, settings->maps);
    bytes_put_f64(&text, job->error);
    for (int i = 0; i < 2; i++) {
        bytes_put_u32(&text, samplings[i]->least);
        bytes_put_u32(&text, samplings[i]->most);
        bytes_put_u32(&text, samplings[i]->threshold);
    }
    struct digest digest = digest_of(text.data, text.size);
    bytes_finish(&text);
    return digest;
}

static struct journal_key key_of(const struct render_job *job)
{
    const struct digest revision = proof_revision();
    struct bytes program = {0};
    bytes_put(&program, revision.bytes, DIGEST_BYTES);
    bytes_put_u16(&program, PROTOCOL_VERSION);
    bytes_put_string(&program, WEFT_VERSION);
    const struct journal_key key = {digest_of(program.data, program.size), job->manifest_digest, settings_digest(job)};
    bytes_finish(&program);
    return key;
}

/* Where no map is written it is the journal that decides whether rows carry maps, if there is one: being watched now,
 * or no more, is no reason to start anew. */
static void choose_maps(struct render_job *job, const struct render_choices *choices)
{
    if (choices->sample_map || choices->error_map || choices->no_resume)
        return;
    job->settings.maps = !job->settings.maps;
    const struct journal_key other = key_of(job);
    if (!journal_is_left(job->output_path, &other))
        job->settings.maps = !job->settings.maps;
}

static enum status open_journal(struct render_job *job, const struct render_choices *choices, struct error *error)
{
    choose_maps(job, choices);
    const struct journal_key key = key_of(job);
    enum status status = STATUS_OK;
    job->journal = journal_open(job->output_path, &key, !choices->no_resume, &status, error);
    return status;
}

static enum status open_outputs(struct render_job *job, const struct render_choices *choices, struct error *error)
{
    const struct image_description description = {
        .width = job->settings.width,
        .height = job->settings.height,
        .format = (enum pixel_format)job->settings.pixel_format,
        .software = "weft " WEFT_VERSION,
        .source = job->source,
    };
    const struct assembly_paths paths = {job->output_path, choices->sample_map, choices->error_map,
                                         job->settings.maps};
    enum status status = STATUS_OK;
    job->assembly = assembly_create(&paths, &description, job->journal, &status, error);
    if (choices->preview_bytes > 0)
        job->preview = preview_create(description.width, description.height, description.format, job->settings.maps,
                                      choices->preview_bytes);
    return status;
}

/* --- results ---------------------------------------------------------------------------------------------- */

static void add_figures(struct render_job *job, const struct band_account *band)
{
    row_figures_add(&job->figures, &band->figures);
    job->rows_done += band->rows;
}

/* Adds a result that is in the journal. */
static enum status add_result(struct render_job *job, enum render_pass pass, struct band_account band,
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

/* --- what an earlier run left ----------------------------------------------------------------------------- */

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
                        : add_result(job, band->pass, account, result, error);
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

static enum status take_kept(struct render_job *job, struct error *error)
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

static enum status prepare(struct render_job *job, const struct render_choices *choices, struct error *error)
{
    const char *name;
    struct scene scene = {0};
    enum status status = choose_format(job->output_path, choices->bits, &job->settings.pixel_format, error);
    if (status != STATUS_OK)
        return status;
    asset_set_init_disk(&job->assets, job->scene_path, &name);
    status = scene_load_with(&scene, name, &job->assets, IMAGES_CHECKED, error);
    if (status != STATUS_OK)
        return status;
    choose_settings(job, &scene, choices);
    scene_finish(&scene);
    make_manifest(job);
    name_source(job);
    status = open_journal(job, choices, error);
    if (status == STATUS_OK)
        status = open_outputs(job, choices, error);
    return status == STATUS_OK ? take_kept(job, error) : status;
}

enum status render_job_init(struct render_job *job, const char *scene_path, const char *output_path,
                            const struct render_choices *choices, struct error *error)
{
    *job = (struct render_job){.scene_path = memory_string(scene_path), .output_path = memory_string(output_path)};
    enum status status = prepare(job, choices, error);
    if (status != STATUS_OK)
        render_job_finish(job);
    return status;
}

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

/* --- sampling --------------------------------------------------------------------------------------------- */

uint32_t render_job_survey_rows(const struct render_job *job)
{
    return job->surveying.most > 0 ? survey_grid(job->settings.width, job->settings.height).down : 0;
}

uint64_t render_job_result_bytes(const struct render_job *job, enum render_pass pass, uint32_t rows)
{
    return pass == PASS_SURVEY ? SURVEY_BYTES : (uint64_t)rows * assembly_record_bytes(job->assembly);
}

enum status render_job_take(struct render_job *job, enum render_pass pass, struct band_account account,
                            const uint8_t *result, struct error *error)
{
    struct journal_band band = {.pass = pass, .first_row = account.first_row, .rows = account.rows,
                                .lease_ms = (uint64_t)account.lease_ms,
                                .size = render_job_result_bytes(job, pass, account.rows)};
    enum status status = journal_add(job->journal, &band, result, error);
    account.offset = band.offset;
    return status == STATUS_OK ? add_result(job, pass, account, result, error) : status;
}

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

void render_job_end_survey(struct render_job *job)
{
    if (job->error > 0)
        job->sampling = survey_choose(&job->survey, &job->surveying, job->error);
}

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

/* --- assets ----------------------------------------------------------------------------------------------- */

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
