#include "worker/pool.h"

#include <errno.h>
#include <fenv.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/memory.h"
#include "scene/images.h"
#include "scene/load.h"
#include "trace/tracer.h"
#include "wire/rows.h"

enum { TILE_WIDTH = 64, TILE_ROWS = 4 }; /* pixels */

enum loading { LOADING_WAITS, LOADING_RUNS, LOADING_DONE };

/* Lives while it is in the pool's list or a band or thread uses it. */
struct pool_job {
    struct pool_job *next;
    uint32_t number;
    unsigned uses;
    enum loading loading;
    bool loaded;
    char *name;
    struct asset_set assets;
    struct trace_settings settings;
    enum pixel_format format;
    struct scene scene;
    struct plan *plan;
};

/* A band in work. Tiles are numbered row of tiles by row of tiles. */
struct band {
    struct band *next;
    struct pool_job *job;
    uint64_t lease;
    uint32_t first_row, rows;
    uint32_t tiles_across, tiles, next_tile, finished_tiles;
    bool cancelled;
    struct row_figures *figures; /* of each row */
    struct bytes records;
};

struct outcome_node {
    struct outcome_node *next;
    struct pool_outcome outcome;
};

struct pool {
    pthread_mutex_t mutex;
    pthread_cond_t work;
    bool stopping;
    const struct kernel *kernel;
    pthread_t *threads;
    int thread_count;
    struct pool_job *jobs;
    struct band *bands; /* oldest first; a finished or cancelled band leaves with its last tile */
    struct outcome_node *outcomes, **outcomes_end;
    int descriptor;
    uint64_t tiles, rays;
};

/* What a render thread keeps between tiles. */
struct thread_state {
    struct pool_job *job; /* used; that the tracer is for */
    struct tracer *tracer;
};

/* --- jobs, with the mutex held ---------------------------------------------------------------------------- */

static void release_job(struct pool_job *job)
{
    if (!job || --job->uses > 0)
        return;
    plan_destroy(&job->plan);
    scene_finish(&job->scene);
    asset_set_finish(&job->assets);
    free(job->name);
    free(job);
}

static struct pool_job *use_job(struct pool_job *job)
{
    job->uses++;
    return job;
}

static struct pool_job *find_job(struct pool *pool, uint32_t number)
{
    struct pool_job *job = pool->jobs;
    while (job && job->number != number)
        job = job->next;
    return job;
}

static void push_outcome(struct pool *pool, const struct pool_outcome *outcome)
{
    struct outcome_node *node = memory_array(1, sizeof *node);
    node->outcome = *outcome;
    *pool->outcomes_end = node;
    pool->outcomes_end = &node->next;
    eventfd_write(pool->descriptor, 1);
}

/* --- bands, with the mutex held --------------------------------------------------------------------------- */

static void free_band(struct band *band)
{
    release_job(band->job);
    free(band->figures);
    bytes_finish(&band->records);
    free(band);
}

static bool all_tiles_are_back(const struct band *band)
{
    return band->finished_tiles == (band->cancelled ? band->next_tile : band->tiles);
}

/* Takes bands out of the list whose last tile is back. */
static void sweep_bands(struct pool *pool)
{
    for (struct band **link = &pool->bands; *link;) {
        struct band *band = *link;
        if (!all_tiles_are_back(band)) {
            link = &band->next;
            continue;
        }
        *link = band->next;
        free_band(band);
    }
}

static size_t record_bytes(const struct pool_job *job)
{
    return row_record_bytes(job->settings.width * pixel_format_bytes(job->format));
}

/* The pixels of a finished band are in place; its rows' figures go before them. */
static void complete_band(struct pool *pool, struct band *band)
{
    for (uint32_t row = 0; row < band->rows; row++)
        row_figures_write(band->records.data + row * record_bytes(band->job), &band->figures[row]);
    push_outcome(pool, &(struct pool_outcome){.kind = POOL_BAND, .lease = band->lease, .bytes = band->records});
    band->records = (struct bytes){0};
}

/* --- render threads --------------------------------------------------------------------------------------- */

static void load_job(struct pool_job *job, int threads, struct error *error)
{
    job->loaded = scene_load_with(&job->scene, job->name, &job->assets, IMAGES_NAMED, error) == STATUS_OK &&
                  scene_images_decode(&job->scene, &job->assets, threads, error) == STATUS_OK;
    if (job->loaded)
        job->plan = plan_create(&job->scene, &job->settings, threads);
    asset_set_finish(&job->assets);
}

static bool run_loading(struct pool *pool)
{
    struct pool_job *job = pool->jobs;
    while (job && job->loading != LOADING_WAITS)
        job = job->next;
    if (!job)
        return false;
    job->loading = LOADING_RUNS;
    use_job(job);
    struct pool_outcome outcome = {.job = job->number};
    pthread_mutex_unlock(&pool->mutex);
    load_job(job, pool->thread_count, &outcome.error);
    pthread_mutex_lock(&pool->mutex);
    job->loading = LOADING_DONE;
    outcome.kind = job->loaded ? POOL_LOADED : POOL_LOAD_FAILED;
    if (find_job(pool, job->number) == job) /* not forgotten meanwhile */
        push_outcome(pool, &outcome);
    release_job(job);
    return true;
}

struct tile {
    uint32_t x0, x1;
    uint32_t row0, row1; /* within the band */
};

static struct tile tile_at(const struct band *band, uint32_t index)
{
    uint32_t width = band->job->settings.width;
    struct tile tile = {.x0 = index % band->tiles_across * TILE_WIDTH, .row0 = index / band->tiles_across * TILE_ROWS};
    tile.x1 = width - tile.x0 < TILE_WIDTH ? width : tile.x0 + TILE_WIDTH;
    tile.row1 = band->rows - tile.row0 < TILE_ROWS ? band->rows : tile.row0 + TILE_ROWS;
    return tile;
}

static void render_tile(struct tracer *tracer, const struct band *band, const struct tile *tile,
                        struct ray_counts counts[TILE_ROWS])
{
    struct vec3 pixels[TILE_ROWS * TILE_WIDTH];
    struct pixel_area area = {tile->x0, tile->x1, band->first_row + tile->row0, band->first_row + tile->row1};
    uint32_t width = tile->x1 - tile->x0;
    size_t pixel_bytes = pixel_format_bytes(band->job->format);
    tracer_area(tracer, &area, pixels, counts);
    for (uint32_t row = tile->row0; row < tile->row1; row++) {
        uint8_t *record = band->records.data + row * record_bytes(band->job);
        pixel_format_encode(band->job->format, pixels + (row - tile->row0) * width, width,
                            record + ROW_FIGURES_BYTES + tile->x0 * pixel_bytes);
    }
}

static void add_figures(struct pool *pool, struct band *band, const struct tile *tile,
                        const struct ray_counts counts[TILE_ROWS])
{
    for (uint32_t row = tile->row0; row < tile->row1; row++) {
        const struct ray_counts *from = &counts[row - tile->row0];
        struct row_figures *to = &band->figures[row];
        to->samples += from->camera;
        to->secondary_rays += from->secondary;
        to->shadow_rays += from->shadow;
        pool->rays += from->camera + from->secondary + from->shadow;
    }
    pool->tiles++;
}

static void set_tracer(struct pool *pool, struct thread_state *state, struct pool_job *job)
{
    if (state->job == job)
        return;
    tracer_destroy(&state->tracer);
    release_job(state->job);
    state->job = job ? use_job(job) : NULL;
    state->tracer = job ? tracer_create(job->plan, pool->kernel) : NULL;
}

static bool run_tile(struct pool *pool, struct thread_state *state)
{
    struct band *band = pool->bands;
    while (band && (band->cancelled || band->next_tile == band->tiles))
        band = band->next;
    if (!band)
        return false;
    struct tile tile = tile_at(band, band->next_tile++);
    struct ray_counts counts[TILE_ROWS] = {{0}};
    set_tracer(pool, state, band->job);
    pthread_mutex_unlock(&pool->mutex);
    render_tile(state->tracer, band, &tile, counts);
    pthread_mutex_lock(&pool->mutex);
    add_figures(pool, band, &tile, counts);
    band->finished_tiles++;
    if (all_tiles_are_back(band)) {
        if (!band->cancelled)
            complete_band(pool, band);
        sweep_bands(pool);
    }
    return true;
}

static void *thread_main(void *argument)
{
    struct pool *pool = argument;
    struct thread_state state = {0};
    fesetenv(FE_DFL_ENV); /* rounding and subnormals as IEEE 754 has them, whatever a library may have set */
    pthread_mutex_lock(&pool->mutex);
    while (!pool->stopping) {
        if (run_loading(pool) || run_tile(pool, &state))
            continue;
        set_tracer(pool, &state, NULL); /* idle: let go of a job that may be forgotten */
        pthread_cond_wait(&pool->work, &pool->mutex);
    }
    set_tracer(pool, &state, NULL);
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

/* --- the other thread's side ------------------------------------------------------------------------------ */

struct pool *pool_create(int threads, const struct kernel *kernel, struct error *error)
{
    struct pool *pool = memory_array(1, sizeof *pool);
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->work, NULL);
    pool->kernel = kernel;
    pool->outcomes_end = &pool->outcomes;
    pool->descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    pool->threads = memory_array((size_t)threads, sizeof *pool->threads);
    int failure = pool->descriptor < 0 ? errno : 0;
    for (; failure == 0 && pool->thread_count < threads; pool->thread_count += failure == 0)
        failure = pthread_create(&pool->threads[pool->thread_count], NULL, thread_main, pool);
    if (failure == 0)
        return pool;
    error_set(error, STATUS_INTERNAL, "cannot start %d render threads: %s", threads, strerror(failure));
    pool_destroy(&pool);
    return NULL;
}

void pool_destroy(struct pool **pointer)
{
    struct pool *pool = *pointer;
    if (!pool)
        return;
    pthread_mutex_lock(&pool->mutex);
    pool->stopping = true;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
    for (int i = 0; i < pool->thread_count; i++)
        pthread_join(pool->threads[i], NULL);
    while (pool->jobs)
        pool_forget(pool, pool->jobs->number);
    struct pool_outcome outcome;
    while (pool_take(pool, &outcome))
        bytes_finish(&outcome.bytes);
    if (pool->descriptor >= 0)
        close(pool->descriptor);
    pthread_cond_destroy(&pool->work);
    pthread_mutex_destroy(&pool->mutex);
    free(pool->threads);
    free(pool);
    *pointer = NULL;
}

int pool_descriptor(const struct pool *pool)
{
    return pool->descriptor;
}

bool pool_take(struct pool *pool, struct pool_outcome *outcome)
{
    pthread_mutex_lock(&pool->mutex);
    struct outcome_node *node = pool->outcomes;
    if (node) {
        pool->outcomes = node->next;
        if (!node->next)
            pool->outcomes_end = &pool->outcomes;
        *outcome = node->outcome;
        free(node);
    } else {
        eventfd_t ignored;
        eventfd_read(pool->descriptor, &ignored);
    }
    pthread_mutex_unlock(&pool->mutex);
    return node != NULL;
}

void pool_load(struct pool *pool, uint32_t number, const char *name, struct asset_set *assets,
               const struct trace_settings *settings, enum pixel_format format)
{
    struct pool_job *job = memory_array(1, sizeof *job);
    job->number = number;
    job->name = memory_string(name);
    job->assets = *assets;
    *assets = (struct asset_set){0};
    job->settings = *settings;
    job->format = format;
    pthread_mutex_lock(&pool->mutex);
    use_job(job);
    struct pool_job **link = &pool->jobs;
    while (*link)
        link = &(*link)->next;
    *link = job;
    pthread_cond_signal(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
}

static void cancel_bands(struct pool *pool, const struct pool_job *job, uint64_t lease)
{
    for (struct band *band = pool->bands; band; band = band->next)
        if (band->job == job || (!job && band->lease == lease))
            band->cancelled = true;
    sweep_bands(pool);
}

void pool_forget(struct pool *pool, uint32_t number)
{
    pthread_mutex_lock(&pool->mutex);
    for (struct pool_job **link = &pool->jobs; *link; link = &(*link)->next) {
        struct pool_job *job = *link;
        if (job->number != number)
            continue;
        cancel_bands(pool, job, 0);
        *link = job->next;
        release_job(job);
        break;
    }
    pthread_mutex_unlock(&pool->mutex);
}

static struct band *make_band(struct pool_job *job, uint64_t lease, uint32_t first_row, uint32_t rows)
{
    struct band *band = memory_array(1, sizeof *band);
    band->job = use_job(job);
    band->lease = lease;
    band->first_row = first_row;
    band->rows = rows;
    band->tiles_across = (job->settings.width + TILE_WIDTH - 1) / TILE_WIDTH;
    band->tiles = band->tiles_across * ((rows + TILE_ROWS - 1) / TILE_ROWS);
    band->figures = memory_array(rows, sizeof *band->figures);
    bytes_extend(&band->records, rows * record_bytes(job));
    return band;
}

bool pool_start(struct pool *pool, uint64_t lease, uint32_t number, uint32_t first_row, uint32_t rows)
{
    pthread_mutex_lock(&pool->mutex);
    struct pool_job *job = find_job(pool, number);
    bool possible = job && job->loading == LOADING_DONE && job->loaded && rows > 0 &&
                    first_row < job->settings.height && rows <= job->settings.height - first_row;
    if (possible) {
        struct band **link = &pool->bands;
        while (*link)
            link = &(*link)->next;
        *link = make_band(job, lease, first_row, rows);
        pthread_cond_broadcast(&pool->work);
    }
    pthread_mutex_unlock(&pool->mutex);
    return possible;
}

void pool_cancel(struct pool *pool, uint64_t lease)
{
    pthread_mutex_lock(&pool->mutex);
    cancel_bands(pool, NULL, lease);
    pthread_mutex_unlock(&pool->mutex);
}

void pool_progress(struct pool *pool, uint64_t *tiles, uint64_t *rays)
{
    pthread_mutex_lock(&pool->mutex);
    *tiles = pool->tiles;
    *rays = pool->rays;
    pthread_mutex_unlock(&pool->mutex);
}
