#include "coordinator/assembly.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "coordinator/map_colours.h"

/* What is written: the picture first. */
enum { PICTURE, SAMPLE_MAP, ERROR_MAP, FILES };

/*
 * A thread of its own, the encoder, writes the rows. When a late band frees all that waited below it there may be
 * seconds of work at once, in which the coordinator must go on answering its workers.
 */
struct assembly {
    struct image_writer *writers[FILES]; /* the encoder's alone while that runs; NULL: not asked for */
    char *names[FILES]; /* owned; NULL: not asked for */
    struct image_description description; /* its strings are owned */
    const struct journal *journal;
    uint8_t *row;                        /* the encoder's: a record behind its figures, */
    uint8_t *colours;                    /* and those of a row of a map */
    uint32_t width, height;
    struct row_layout layout;
    uint32_t taken; /* rows, in any order */
    int bell;       /* of assembly_finish */
    pthread_t encoder;
    bool encoder_started;

    pthread_mutex_t mutex; /* guards what follows */
    pthread_cond_t changed;
    uint64_t *places;   /* of rows that were taken: where in the journal their pixels are; else 0 */
    uint32_t next;      /* the row that the encoder writes next */
    bool abandoned;     /* it is to end at once */
    bool finishing;     /* all rows are taken for good: it is to complete the files */
    bool finished;      /* that is done, or writing has failed: it has ended */
    enum status status; /* other than STATUS_OK: writing failed */
    struct error error;
};

static enum status open_files(struct assembly *a, struct error *error)
{
    struct image_description map = a->description;
    enum status status = STATUS_OK;
    map.format = PIXEL_SRGB8;
    for (int i = 0; i < FILES && status == STATUS_OK; i++)
        if (a->names[i])
            a->writers[i] = image_writer_create(a->names[i], i == PICTURE ? &a->description : &map, &status, error);
    return status;
}

struct assembly *assembly_create(const struct assembly_paths *paths, const struct image_description *description,
                                 const struct journal *journal, enum status *status, struct error *error)
{
    struct assembly *a = memory_array(1, sizeof *a);
    a->width = description->width;
    a->height = description->height;
    a->layout = row_layout_of(a->width, pixel_format_bytes(description->format), assembly_has_maps(paths));
    const char *const names[FILES] = {paths->picture, paths->sample_map, paths->error_map};
    for (int i = 0; i < FILES; i++)
        a->names[i] = names[i] ? memory_string(names[i]) : NULL;
    a->description = *description;
    a->description.software = memory_string(description->software);
    a->description.source = memory_string(description->source);
    a->journal = journal;
    a->bell = -1;
    a->row = memory_array(assembly_record_bytes(a) - ROW_FIGURES_BYTES, 1);
    a->colours = memory_array(a->width, 3);
    a->places = memory_array(a->height, sizeof *a->places);
    pthread_mutex_init(&a->mutex, NULL);
    pthread_cond_init(&a->changed, NULL);
    *status = open_files(a, error);
    if (*status != STATUS_OK)
        assembly_abandon(&a);
    return a;
}

size_t assembly_record_bytes(const struct assembly *a)
{
    return row_record_bytes(&a->layout);
}

/* --- the encoder ------------------------------------------------------------------------------------------ */

/* Waits for the next row and says where it is; 0: it is to end, or all rows are written and the files to be
 * completed. */
static uint64_t next_row(struct assembly *a)
{
    uint64_t row = 0;
    pthread_mutex_lock(&a->mutex);
    while (!a->abandoned && (a->next < a->height ? !a->places[a->next] : !a->finishing))
        pthread_cond_wait(&a->changed, &a->mutex);
    if (!a->abandoned && a->next < a->height)
        row = a->places[a->next++];
    pthread_mutex_unlock(&a->mutex);
    return row;
}

static bool is_abandoned(struct assembly *a)
{
    pthread_mutex_lock(&a->mutex);
    bool abandoned = a->abandoned;
    pthread_mutex_unlock(&a->mutex);
    return abandoned;
}

static enum status write_map_row(struct assembly *a, int map, const uint8_t *codes, struct error *error)
{
    for (uint32_t x = 0; x < a->width; x++) {
        if (map == SAMPLE_MAP)
            map_colour_of_stage(codes[x], a->colours + 3 * (size_t)x);
        else
            map_colour_of_error(codes[x], a->colours + 3 * (size_t)x);
    }
    return image_writer_row(a->writers[map], a->colours, error);
}

static enum status write_row(struct assembly *a, uint64_t offset, struct error *error)
{
    const size_t at[FILES] = {0, row_stages_at(&a->layout), row_errors_at(&a->layout)};
    enum status status = journal_read(a->journal, offset, a->row, assembly_record_bytes(a) - ROW_FIGURES_BYTES, error);
    if (status == STATUS_OK)
        status = image_writer_row(a->writers[PICTURE], a->row, error);
    for (int i = SAMPLE_MAP; i < FILES && status == STATUS_OK; i++)
        if (a->writers[i])
            status = write_map_row(a, i, a->row + at[i] - ROW_FIGURES_BYTES, error);
    return status;
}

static enum status complete_files(struct assembly *a, struct error *error)
{
    enum status status = STATUS_OK;
    for (int i = 0; i < FILES && status == STATUS_OK; i++)
        if (a->writers[i])
            status = image_writer_complete(&a->writers[i], error);
    return status;
}

static void note_end(struct assembly *a, enum status status, const struct error *error)
{
    const uint64_t one = 1;
    pthread_mutex_lock(&a->mutex);
    a->finished = true;
    a->status = status;
    if (status != STATUS_OK)
        a->error = *error;
    ssize_t rung = a->bell >= 0 ? write(a->bell, &one, sizeof one) : 0;
    (void)rung; /* a bell that has rung too often to count is heard too */
    pthread_mutex_unlock(&a->mutex);
}

static void *encode(void *argument)
{
    struct assembly *a = argument;
    struct error error;
    enum status status = STATUS_OK;
    uint64_t row;
    while (status == STATUS_OK && (row = next_row(a)) != 0)
        status = write_row(a, row, &error);
    if (is_abandoned(a))
        return NULL;
    if (status == STATUS_OK)
        status = complete_files(a, &error);
    note_end(a, status, &error);
    return NULL;
}

/* With the first rows, so that pictures whose turn is far off have no thread. */
static enum status need_encoder(struct assembly *a, struct error *error)
{
    if (a->encoder_started)
        return STATUS_OK;
    int failure = pthread_create(&a->encoder, NULL, encode, a);
    if (failure != 0)
        return error_set(error, STATUS_INTERNAL, "cannot start a thread to write the picture: %s", strerror(failure));
    a->encoder_started = true;
    return STATUS_OK;
}

/* Afterwards nothing is shared any more. */
static void end_encoder(struct assembly *a)
{
    if (a->encoder_started)
        pthread_join(a->encoder, NULL);
    a->encoder_started = false;
}

/* Without completing anything, and without a trace of what was written. */
static void abandon_encoder(struct assembly *a)
{
    pthread_mutex_lock(&a->mutex);
    a->abandoned = true;
    pthread_cond_signal(&a->changed);
    pthread_mutex_unlock(&a->mutex);
    end_encoder(a);
    for (int i = 0; i < FILES; i++)
        image_writer_abandon(&a->writers[i]);
}

/* --- rows ------------------------------------------------------------------------------------------------- */

/* `offset`: of its record. */
static void take_row(struct assembly *a, uint32_t row, uint64_t offset)
{
    assert(row < a->height && row >= a->next && !a->places[row]);
    a->places[row] = offset + ROW_FIGURES_BYTES;
    a->taken++;
}

/* How writing went so far; to be called with the mutex held or the encoder ended. */
static enum status writing_status(const struct assembly *a, struct error *error)
{
    if (a->status != STATUS_OK)
        *error = a->error;
    return a->status;
}

enum status assembly_add(struct assembly *a, uint32_t first_row, uint32_t rows, uint64_t offset,
                         struct error *error)
{
    enum status status = need_encoder(a, error);
    if (status != STATUS_OK)
        return status;
    pthread_mutex_lock(&a->mutex);
    for (uint32_t i = 0; i < rows; i++)
        take_row(a, first_row + i, offset + i * (uint64_t)assembly_record_bytes(a));
    status = writing_status(a, error);
    pthread_cond_signal(&a->changed);
    pthread_mutex_unlock(&a->mutex);
    return status;
}

static enum status begin_anew(struct assembly *a, struct error *error)
{
    abandon_encoder(a);
    a->abandoned = false;
    a->next = 0;
    return open_files(a, error);
}

enum status assembly_drop(struct assembly *a, uint32_t first_row, uint32_t rows, struct error *error)
{
    pthread_mutex_lock(&a->mutex);
    bool written = a->next > first_row;
    for (uint32_t row = first_row; row < first_row + rows; row++) {
        assert(row < a->height && a->places[row]);
        a->places[row] = 0;
    }
    a->taken -= rows;
    enum status status = writing_status(a, error);
    pthread_mutex_unlock(&a->mutex);
    return status == STATUS_OK && written ? begin_anew(a, error) : status;
}

struct row_figures assembly_sum(const struct assembly *a, uint32_t rows, const uint8_t *records)
{
    struct row_figures sum = {0};
    for (uint32_t i = 0; i < rows; i++) {
        struct row_figures figures;
        row_figures_read(records + i * assembly_record_bytes(a), &figures);
        row_figures_add(&sum, &figures);
    }
    return sum;
}

/* --- ending ----------------------------------------------------------------------------------------------- */

static void assembly_free(struct assembly **pointer)
{
    struct assembly *a = *pointer;
    abandon_encoder(a);
    pthread_cond_destroy(&a->changed);
    pthread_mutex_destroy(&a->mutex);
    for (int i = 0; i < FILES; i++)
        free(a->names[i]);
    free((char *)a->description.software);
    free((char *)a->description.source);
    free(a->places);
    free(a->colours);
    free(a->row);
    free(a);
    *pointer = NULL;
}

void assembly_finish(struct assembly *a, int bell)
{
    assert(a->taken == a->height);
    pthread_mutex_lock(&a->mutex);
    a->bell = bell;
    a->finishing = true;
    pthread_cond_signal(&a->changed);
    pthread_mutex_unlock(&a->mutex);
}

bool assembly_is_finished(struct assembly *a)
{
    pthread_mutex_lock(&a->mutex);
    bool finished = a->finished;
    pthread_mutex_unlock(&a->mutex);
    return finished;
}

bool assembly_is_written(struct assembly *a)
{
    pthread_mutex_lock(&a->mutex);
    bool written = a->finished || a->next == a->height;
    pthread_mutex_unlock(&a->mutex);
    return written;
}

enum status assembly_complete(struct assembly **pointer, struct error *error)
{
    struct assembly *a = *pointer;
    assert(a->finishing);
    end_encoder(a);
    enum status status = writing_status(a, error);
    assembly_free(pointer);
    return status;
}

void assembly_abandon(struct assembly **pointer)
{
    if (*pointer)
        assembly_free(pointer);
}
