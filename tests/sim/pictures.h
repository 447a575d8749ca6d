/*
 * Small pictures for whole farms, rendered once: what honest workers answer about each, and the files that come of it.
 */
#ifndef WEFT_TESTS_PICTURES_H
#define WEFT_TESTS_PICTURES_H

#include <dirent.h>

#include "coordinator/render_job.h"
#include "scene/load.h"
#include "tests/sim/history.h"
#include "worker/band.h"

enum { PICTURE_FILES = 3, FILE_BYTES_MAX = 8 << 20 };

struct picture {
    const char *scene, *ending; /* of files */
    struct render_choices choices;
    struct job_settings settings;
    struct sampling surveying, sampling;
    struct digest assets, manifest;
    struct bytes *surveys;      /* of each row of the survey */
    struct bytes records;       /* of all rows */
    size_t record_bytes;        /* of one */
    struct bytes files[PICTURE_FILES]; /* the picture, and maps if there are any */
};

/* One without a survey; one with, and maps; one of a single row; one whose assets and results come in chunks. */
static struct picture pictures[] = {
    {.scene = "small.json", .ending = ".png",
     .choices = {.width = 16, .height = 31, .samples = 2, .filter = -1, .bits = 8}},
    {.scene = "small.json", .ending = ".png",
     .choices = {.width = 40, .height = 90, .error = 0.02, .samples_max = 16, .filter = -1, .bits = 8,
                 .sample_map = "", .error_map = ""}},
    {.scene = "small.json", .ending = ".png",
     .choices = {.width = 19, .height = 1, .samples = 1, .filter = -1, .bits = 16}},
    {.scene = "large.json", .ending = ".pfm",
     .choices = {.width = 7000, .height = 7, .samples = 2, .filter = -1, .bits = 8}},
};

enum { PICTURES = sizeof pictures / sizeof *pictures };

static char *pictures_folder; /* where everything is */

/* --- files ------------------------------------------------------------------------------------------------ */

/* The caller frees. */
static inline char *picture_path(const char *name, const char *ending)
{
    return memory_format("%s/%s%s", pictures_folder, name, ending);
}

static inline void write_file(const char *name, const char *text, size_t padding)
{
    char *path = picture_path(name, "");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    for (size_t i = 0; i < padding; i++)
        fputc('\n', file);
    assert_int_equal(fclose(file), 0);
    free(path);
}

static inline void write_scenes(void)
{
    static const char scene[] =
        "{\"camera\": {\"from\": [0, 2, 6], \"at\": [0, 1, 0]}, \"background\": \"#9bd\","
        " \"lights\": [{\"type\": \"point\", \"position\": [4, 6, 5]}],"
        " \"objects\": [{\"type\": \"sphere\", \"center\": [1, 1, 0], \"radius\": 1},"
        "  {\"type\": \"plane\", \"point\": [0, 0, 0], \"normal\": [0, 1, 0]},"
        "  {\"type\": \"mesh\", \"file\": \"%s\"}]}\n";
    static const char mesh[] = "v -2 0 0\nv 0 0 0\nv -1 2 0\nv -1 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";
    char text[sizeof scene + 16];
    snprintf(text, sizeof text, scene, "small.obj");
    write_file("small.json", text, 0);
    snprintf(text, sizeof text, scene, "large.obj");
    write_file("large.json", text, 0);
    write_file("small.obj", mesh, 0);
    write_file("large.obj", mesh, 5 * MESSAGE_CHUNK_MAX + 1000); /* more than is fetched ahead */
}

/* The paths of a job's files, called `name`; the caller frees those that are not NULL. */
static inline void output_paths(const struct picture *picture, const char *name, char *paths[PICTURE_FILES])
{
    paths[0] = picture_path(name, picture->ending);
    paths[1] = picture->choices.sample_map ? picture_path(name, "-samples.png") : NULL;
    paths[2] = picture->choices.error_map ? picture_path(name, "-error.png") : NULL;
}

/* Fills a job that writes files called `name`. */
static inline void picture_job(const struct picture *picture, const char *name, struct render_job *job)
{
    char *paths[PICTURE_FILES], *scene = picture_path(picture->scene, "");
    struct render_choices choices = picture->choices;
    struct error error;
    output_paths(picture, name, paths);
    choices.sample_map = paths[1];
    choices.error_map = paths[2];
    if (render_job_init(job, scene, paths[0], &choices, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    for (int i = 0; i < PICTURE_FILES; i++)
        free(paths[i]);
    free(scene);
}

/* Reads the files called `name` and removes them; files that are not there are empty. */
static inline void take_files(const struct picture *picture, const char *name, struct bytes files[PICTURE_FILES])
{
    char *paths[PICTURE_FILES];
    struct error error;
    output_paths(picture, name, paths);
    for (int i = 0; i < PICTURE_FILES; i++) {
        files[i] = (struct bytes){0};
        if (paths[i] && bytes_read_file(&files[i], paths[i], FILE_BYTES_MAX, &error) == STATUS_OK)
            unlink(paths[i]);
        free(paths[i]);
    }
}

/* The journal of the files called `name`, if there is one. */
static inline void remove_journal(const struct picture *picture, const char *name)
{
    char *hidden = memory_format(".%s", name), *ending = memory_format("%s.journal", picture->ending);
    char *path = picture_path(hidden, ending);
    unlink(path);
    free(path);
    free(ending);
    free(hidden);
}

static inline void finish_files(struct bytes files[PICTURE_FILES])
{
    for (int i = 0; i < PICTURE_FILES; i++)
        bytes_finish(&files[i]);
}

/* --- making ----------------------------------------------------------------------------------------------- */

static inline struct bytes render_band(const struct job_settings *settings, struct tracer *tracer, struct order order)
{
    struct band band;
    struct tile_outcome outcome;
    band_init(&band, settings, &order);
    for (uint32_t tile = 0; tile < band.tiles; tile++) {
        band_work(&band, tracer, tile, &outcome);
        band_add(&band, tile, &outcome);
    }
    struct bytes result = band_complete(&band);
    band_finish(&band);
    return result;
}

/* Does what a farm does, without one: surveys row by row, then renders all at once. */
static inline void render_picture(struct picture *picture, struct render_job *job, struct tracer *tracer)
{
    uint32_t survey_rows = render_job_survey_rows(job);
    struct error error;
    picture->surveys = memory_array(survey_rows, sizeof *picture->surveys);
    for (uint32_t row = 0; row < survey_rows; row++) {
        picture->surveys[row] = render_band(&job->settings, tracer,
                                            (struct order){PASS_SURVEY, row, 1, job->surveying});
        const struct band_account account = {.first_row = row, .rows = 1};
        assert_int_equal(render_job_take(job, PASS_SURVEY, account, picture->surveys[row].data, &error), STATUS_OK);
    }
    render_job_end_survey(job);
    const uint32_t rows = job->settings.height;
    picture->records = render_band(&job->settings, tracer, (struct order){PASS_RENDER, 0, rows, job->sampling});
    picture->record_bytes = assembly_record_bytes(job->assembly);
    const struct band_account all = {.rows = rows};
    assert_int_equal(render_job_take(job, PASS_RENDER, all, picture->records.data, &error), STATUS_OK);
    render_job_finish_output(job, -1);
    assert_int_equal(render_job_complete(job, &error), STATUS_OK);
}

static inline void make_picture(struct picture *picture)
{
    struct render_job job;
    struct scene scene = {0};
    struct error error;
    picture_job(picture, "reference", &job);
    const char *name = job.assets.assets[0].name;
    assert_int_equal(scene_load(&scene, name, &job.assets, &error), STATUS_OK);
    const struct trace_settings settings = {job.settings.width, job.settings.height,
                                            (enum pixel_filter)job.settings.filter};
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct tracer *tracer = tracer_create(plan, kernel_default());
    render_picture(picture, &job, tracer);
    picture->settings = job.settings;
    picture->surveying = job.surveying;
    picture->sampling = job.sampling;
    picture->assets = asset_set_digest(&job.assets);
    picture->manifest = job.manifest_digest;
    take_files(picture, "reference", picture->files);
    tracer_destroy(&tracer);
    plan_destroy(&plan);
    scene_finish(&scene);
    render_job_finish(&job);
}

static inline void pictures_make(void)
{
    const char *base = getenv("TMPDIR");
    pictures_folder = memory_format("%s/weft-sim-XXXXXX", base ? base : P_tmpdir);
    assert_non_null(mkdtemp(pictures_folder));
    write_scenes();
    for (int i = 0; i < PICTURES; i++)
        make_picture(&pictures[i]);
}

static inline void picture_finish(struct picture *picture)
{
    for (uint32_t row = 0; picture->surveying.most > 0 && row < survey_grid(picture->settings.width,
                                                                            picture->settings.height).down; row++)
        bytes_finish(&picture->surveys[row]);
    free(picture->surveys);
    bytes_finish(&picture->records);
    finish_files(picture->files);
}

static inline void pictures_finish(void)
{
    DIR *folder = opendir(pictures_folder);
    for (struct dirent *entry; folder && (entry = readdir(folder));) /* "." and ".." stay */
        unlinkat(dirfd(folder), entry->d_name, 0);
    if (folder)
        closedir(folder);
    rmdir(pictures_folder);
    free(pictures_folder);
    for (int i = 0; i < PICTURES; i++)
        picture_finish(&pictures[i]);
}

/* --- answers ---------------------------------------------------------------------------------------------- */

static inline bool same_settings(const struct job_settings *a, const struct job_settings *b)
{
    return a->width == b->width && a->height == b->height && a->filter == b->filter &&
           a->pixel_format == b->pixel_format && a->maps == b->maps;
}

static inline bool same_sampling(const struct sampling *a, const struct sampling *b)
{
    return a->least == b->least && a->most == b->most && a->threshold == b->threshold;
}

/* Which one a worker was told to render; NULL: none. */
static inline const struct picture *picture_of(const struct asset_set *assets, const struct job_settings *settings)
{
    struct digest digest = asset_set_digest(assets);
    for (int i = 0; i < PICTURES; i++)
        if (digest_equal(&digest, &pictures[i].assets) && same_settings(settings, &pictures[i].settings))
            return &pictures[i];
    return NULL;
}

static inline struct bytes survey_answer(const struct picture *picture, const struct order *order)
{
    struct survey sum = {0}, row;
    struct bytes result = {0};
    for (uint32_t i = 0; i < order->rows; i++) {
        survey_read(&row, picture->surveys[order->first_row + i].data);
        survey_add(&sum, &row);
    }
    survey_write(&sum, bytes_extend(&result, SURVEY_BYTES));
    return result;
}

/* Of a result. */
static inline size_t answer_bytes(const struct job_settings *settings, enum render_pass pass, uint32_t rows)
{
    struct row_layout layout = row_layout_of(
        settings->width, pixel_format_bytes((enum pixel_format)settings->pixel_format), settings->maps);
    return pass == PASS_SURVEY ? (size_t)SURVEY_BYTES : rows * row_record_bytes(&layout);
}

/* Bytes that fit the order and say nothing. */
static inline struct bytes senseless_answer(const struct job_settings *settings, const struct order *order)
{
    size_t size = answer_bytes(settings, order->pass, order->rows);
    struct bytes result = {0};
    memset(bytes_extend(&result, size), 0x5a, size);
    return result;
}

/* What an honest worker's band_complete would give; the caller frees. *sound: whether it is of the picture. An order
 * for no picture (NULL) or with other samples than the picture's is answered as well, by bytes of the right size. */
static inline struct bytes picture_answer(const struct picture *picture, const struct job_settings *settings,
                                          const struct order *order, bool *sound)
{
    bool surveys = order->pass == PASS_SURVEY;
    struct bytes result = {0};
    *sound = picture && same_sampling(&order->sampling, surveys ? &picture->surveying : &picture->sampling);
    if (!*sound)
        return senseless_answer(settings, order);
    if (surveys)
        return survey_answer(picture, order);
    bytes_put(&result, picture->records.data + order->first_row * picture->record_bytes,
              order->rows * picture->record_bytes);
    return result;
}

/* Whether both hold the same files; of pictures that are not whole none is there. */
static inline bool same_files(const struct bytes a[PICTURE_FILES], const struct bytes b[PICTURE_FILES])
{
    for (int i = 0; i < PICTURE_FILES; i++)
        if (a[i].size != b[i].size || (a[i].size > 0 && memcmp(a[i].data, b[i].data, a[i].size) != 0))
            return false;
    return true;
}

#endif
