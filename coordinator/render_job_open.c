/* How a job begins: its scene is loaded, its settings are chosen, its journal and its outputs are opened. */
#include <string.h>

#include "base/memory.h"
#include "coordinator/render_job_private.h"
#include "scene/load.h"
#include "trace/proof.h"
#include "wire/manifest.h"

/* --- settings --------------------------------------------------------------------------------------------- */

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

/* --- what workers get, and the picture says --------------------------------------------------------------- */

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

/* --- journal ---------------------------------------------------------------------------------------------- */

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

/* --- all of it -------------------------------------------------------------------------------------------- */

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
    return status == STATUS_OK ? render_job_take_kept(job, error) : status;
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
