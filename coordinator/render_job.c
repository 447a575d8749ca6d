#include "coordinator/render_job.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/load.h"
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
    job->settings.filter = (uint8_t)(choices->filter >= 0 ? choices->filter : (int)scene->filter);
    job->settings.maps = choices->sample_map || choices->error_map;
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

static enum status open_outputs(struct render_job *job, const struct render_choices *choices, struct error *error)
{
    const struct image_description description = {
        .width = job->settings.width,
        .height = job->settings.height,
        .format = (enum pixel_format)job->settings.pixel_format,
        .software = "weft " WEFT_VERSION,
        .source = job->source,
    };
    const struct assembly_paths paths = {job->output_path, choices->sample_map, choices->error_map};
    enum status status = STATUS_OK;
    job->assembly = assembly_create(&paths, &description, &status, error);
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
    return open_outputs(job, choices, error);
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
    asset_set_finish(&job->assets);
    bytes_finish(&job->manifest);
    free(job->bands);
    free(job->scene_path);
    free(job->output_path);
    *job = (struct render_job){0};
}

bool render_job_is_open(const struct render_job *job)
{
    return job->state == JOB_WAITING || job->state == JOB_SURVEYING || job->state == JOB_RUNNING;
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

void render_job_take_survey(struct render_job *job, const uint8_t *bytes)
{
    struct survey part;
    survey_read(&part, bytes);
    survey_add(&job->survey, &part);
}

enum status render_job_take_band(struct render_job *job, struct band_account band, const uint8_t *records,
                                 struct error *error)
{
    band.figures = assembly_sum(job->assembly, band.rows, records);
    row_figures_add(&job->figures, &band.figures);
    job->rows_done += band.rows;
    job->bands = memory_grow(job->bands, &job->band_capacity, job->band_count + 1, sizeof *job->bands);
    job->bands[job->band_count++] = band;
    return assembly_add(job->assembly, band.first_row, band.rows, records, error);
}

void render_job_end_survey(struct render_job *job)
{
    if (job->error > 0)
        job->sampling = survey_choose(&job->survey, &job->surveying, job->error);
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
