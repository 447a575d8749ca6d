#include "coordinator/assembly.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

/*
 * A thread of its own, the encoder, writes the rows. When a late band frees all that waited below it there may be
 * seconds of work at once, in which the coordinator must go on answering its workers.
 */
struct assembly {
    struct image_writer *writer; /* the encoder's alone while that runs */
    uint32_t height;
    struct row_layout layout;
    uint32_t taken; /* rows, in any order */
    struct row_figures figures;
    pthread_t encoder;
    bool encoder_started;

    pthread_mutex_t mutex; /* guards what follows */
    pthread_cond_t changed;
    uint8_t **waiting;  /* pixels of rows that the encoder is yet to take, or NULL */
    uint32_t next;      /* the row that it takes next */
    bool abandoned;     /* it is to end at once */
    enum status status; /* other than STATUS_OK: writing failed, and it has ended */
    struct error error;
};

struct assembly *assembly_create(const char *path, const struct image_description *description, bool maps,
                                 enum status *status, struct error *error)
{
    struct image_writer *writer = image_writer_create(path, description, status, error);
    if (!writer)
        return NULL;
    struct assembly *a = memory_array(1, sizeof *a);
    a->writer = writer;
    a->height = description->height;
    a->layout = row_layout_of(description->width, pixel_format_bytes(description->format), maps);
    a->waiting = memory_array(a->height, sizeof *a->waiting);
    pthread_mutex_init(&a->mutex, NULL);
    pthread_cond_init(&a->changed, NULL);
    return a;
}

size_t assembly_record_bytes(const struct assembly *a)
{
    return row_record_bytes(&a->layout);
}

/* --- the encoder ------------------------------------------------------------------------------------------ */

static bool more_to_come(const struct assembly *a)
{
    return !a->abandoned && a->next < a->height;
}

/* Waits for the next row's pixels, which the caller frees; NULL if there is nothing more to do. */
static uint8_t *next_row(struct assembly *a)
{
    uint8_t *row = NULL;
    pthread_mutex_lock(&a->mutex);
    while (more_to_come(a) && !a->waiting[a->next])
        pthread_cond_wait(&a->changed, &a->mutex);
    if (more_to_come(a))
        row = a->waiting[a->next++];
    pthread_mutex_unlock(&a->mutex);
    return row;
}

static void note_failure(struct assembly *a, enum status status, const struct error *error)
{
    pthread_mutex_lock(&a->mutex);
    a->status = status;
    a->error = *error;
    pthread_mutex_unlock(&a->mutex);
}

static void *encode(void *argument)
{
    struct assembly *a = argument;
    struct error error;
    enum status status = STATUS_OK;
    uint8_t *row;
    while (status == STATUS_OK && (row = next_row(a))) {
        status = image_writer_row(a->writer, row, &error);
        free(row);
    }
    if (status != STATUS_OK)
        note_failure(a, status, &error);
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
static void end_encoder(struct assembly *a, bool abandon)
{
    if (!a->encoder_started)
        return;
    pthread_mutex_lock(&a->mutex);
    a->abandoned = abandon;
    pthread_cond_signal(&a->changed);
    pthread_mutex_unlock(&a->mutex);
    pthread_join(a->encoder, NULL);
    a->encoder_started = false;
}

/* --- rows ------------------------------------------------------------------------------------------------- */

static void take_row(struct assembly *a, uint32_t row, const uint8_t *record)
{
    struct row_figures figures;
    size_t pixels_bytes = a->layout.pixels_bytes;
    assert(row < a->height && row >= a->next && !a->waiting[row]);
    a->waiting[row] = memcpy(memory_resize(NULL, pixels_bytes, 1), record + ROW_FIGURES_BYTES, pixels_bytes);
    a->taken++;
    row_figures_read(record, &figures);
    row_figures_add(&a->figures, &figures);
}

/* How writing went so far; to be called with the mutex held or the encoder ended. */
static enum status writing_status(const struct assembly *a, struct error *error)
{
    if (a->status != STATUS_OK)
        *error = a->error;
    return a->status;
}

enum status assembly_add(struct assembly *a, uint32_t first_row, uint32_t rows, const uint8_t *records,
                         struct error *error)
{
    enum status status = need_encoder(a, error);
    if (status != STATUS_OK)
        return status;
    pthread_mutex_lock(&a->mutex);
    for (uint32_t i = 0; i < rows; i++)
        take_row(a, first_row + i, records + i * assembly_record_bytes(a));
    status = writing_status(a, error);
    pthread_cond_signal(&a->changed);
    pthread_mutex_unlock(&a->mutex);
    return status;
}

struct row_figures assembly_figures(const struct assembly *a)
{
    return a->figures;
}

/* --- ending ----------------------------------------------------------------------------------------------- */

static void assembly_free(struct assembly **pointer)
{
    struct assembly *a = *pointer;
    image_writer_abandon(&a->writer);
    for (uint32_t i = a->next; i < a->height; i++)
        free(a->waiting[i]);
    pthread_cond_destroy(&a->changed);
    pthread_mutex_destroy(&a->mutex);
    free(a->waiting);
    free(a);
    *pointer = NULL;
}

enum status assembly_complete(struct assembly **pointer, struct error *error)
{
    struct assembly *a = *pointer;
    assert(a->taken == a->height);
    end_encoder(a, false);
    enum status status = writing_status(a, error);
    if (status == STATUS_OK)
        status = image_writer_complete(&a->writer, error);
    assembly_free(pointer);
    return status;
}

void assembly_abandon(struct assembly **pointer)
{
    if (!*pointer)
        return;
    end_encoder(*pointer, true);
    assembly_free(pointer);
}
