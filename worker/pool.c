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
#include "worker/band.h"

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
    struct job_settings settings;
    struct scene scene;
    struct plan *plan;
};

/* A band in work. */
struct held_band {
    struct held_band *next;
    struct pool_job *job;
    uint64_t lease;
    struct band band;
    uint32_t next_tile, finished_tiles;
    bool cancelled;
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
    struct held_band *bands; /* oldest first; a finished or cancelled band leaves with its last tile */
    struct outcome_node *outcomes, **outcomes_end;
    int descriptor;
    uint64_t rays;
    _Atomic uint64_t batches; /* the tracers', while they trace */
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

static void free_band(struct held_band *held)
{
    band_finish(&held->band);
    release_job(held->job);
    free(held);
}

static bool all_tiles_are_back(const struct held_band *held)
{
    return held->finished_tiles == (held->cancelled ? held->next_tile : held->band.tiles);
}

/* Takes bands out of the list whose last tile is back. */
static void sweep_bands(struct pool *pool)
{
    for (struct held_band **link = &pool->bands; *link;) {
        struct held_band *held = *link;
        if (!all_tiles_are_back(held)) {
            link = &held->next;
            continue;
        }
        *link = held->next;
        free_band(held);
    }
}

/* --- loading ---------------------------------------------------------------------------------------------- */

static void load_job(struct pool_job *job, int threads, struct error *error)
{
    job->loaded = scene_load_with(&job->scene, job->name, &job->assets, IMAGES_NAMED, error) == STATUS_OK &&
                  scene_images_decode(&job->scene, &job->assets, threads, error) == STATUS_OK;
    const struct trace_settings settings = {job->settings.width, job->settings.height,
                                            (enum pixel_filter)job->settings.filter};
    if (job->loaded)
        job->plan = plan_create(&job->scene, &settings, threads);
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

/* --- render threads --------------------------------------------------------------------------------------- */

static void set_tracer(struct pool *pool, struct thread_state *state, struct pool_job *job)
{
    if (state->job == job)
        return;
    tracer_destroy(&state->tracer);
    release_job(state->job);
    state->job = job ? use_job(job) : NULL;
    state->tracer = job ? tracer_create(job->plan, pool->kernel) : NULL;
    if (job)
        tracer_count_batches(state->tracer, &pool->batches);
}

static void take_back(struct pool *pool, struct held_band *held, uint32_t tile, const struct tile_outcome *outcome)
{
    pool->rays += outcome->rays;
    band_add(&held->band, tile, outcome);
    held->finished_tiles++;
    if (!all_tiles_are_back(held))
        return;
    if (!held->cancelled)
        push_outcome(pool, &(struct pool_outcome){
                               .kind = POOL_BAND, .lease = held->lease, .bytes = band_complete(&held->band)});
    sweep_bands(pool);
}

static bool run_tile(struct pool *pool, struct thread_state *state)
{
    struct held_band *held = pool->bands;
    while (held && (held->cancelled || held->next_tile == held->band.tiles))
        held = held->next;
    if (!held)
        return false;
    uint32_t tile = held->next_tile++;
    struct tile_outcome outcome;
    set_tracer(pool, state, held->job);
    pthread_mutex_unlock(&pool->mutex);
    band_work(&held->band, state->tracer, tile, &outcome);
    pthread_mutex_lock(&pool->mutex);
    take_back(pool, held, tile, &outcome);
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
               const struct job_settings *settings)
{
    struct pool_job *job = memory_array(1, sizeof *job);
    job->number = number;
    job->name = memory_string(name);
    job->assets = *assets;
    *assets = (struct asset_set){0};
    job->settings = *settings;
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
    for (struct held_band *held = pool->bands; held; held = held->next)
        if (held->job == job || (!job && held->lease == lease))
            held->cancelled = true;
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

static struct held_band *make_band(struct pool_job *job, uint64_t lease, const struct order *order)
{
    struct held_band *held = memory_array(1, sizeof *held);
    held->job = use_job(job);
    held->lease = lease;
    band_init(&held->band, &job->settings, order);
    return held;
}

bool pool_start(struct pool *pool, uint64_t lease, uint32_t number, const struct order *order)
{
    pthread_mutex_lock(&pool->mutex);
    struct pool_job *job = find_job(pool, number);
    bool possible = job && job->loading == LOADING_DONE && job->loaded &&
                    order_fits(order, &job->settings);
    if (possible) {
        struct held_band **link = &pool->bands;
        while (*link)
            link = &(*link)->next;
        *link = make_band(job, lease, order);
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

void pool_progress(struct pool *pool, uint64_t *batches, uint64_t *rays)
{
    *batches = pool->batches;
    pthread_mutex_lock(&pool->mutex);
    *rays = pool->rays;
    pthread_mutex_unlock(&pool->mutex);
}
