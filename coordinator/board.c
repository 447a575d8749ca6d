#include "coordinator/board.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/json_text.h"
#include "coordinator/snapshot_copy.h"
#include "base/text.h"

enum {
    LINES = 256,    /* of the log that are kept */
    SAMPLES = 300,  /* of the history, */
    STEP_MS = 2000, /* so far apart */
    FRESH_MS = 250, /* a state so old will do */
    PATIENCE_MS = 500,
    RECENT_MS = 3000, /* who has looked so recently is there */
};

struct line {
    int64_t time; /* of day, in seconds since 1970 */
    enum log_level level;
    char *text; /* owned */
};

struct sample {
    double elapsed, rays_per_second, remaining; /* seconds; negative: unknown */
};

struct board {
    int bell;
    struct snapshot *shown; /* of the one who answers */
    pthread_mutex_t mutex;  /* guards what follows */
    pthread_cond_t published;
    bool wanted;            /* somebody waits for a state */
    bool over;              /* the last one is there */
    struct snapshot *fresh; /* copied, and not yet taken; NULL: none */
    int64_t published_ms, looked_ms, last_seen_ms; /* by the clock; 0: never */
    struct line lines[LINES]; /* line n is at n % LINES */
    uint64_t next_line;
    struct sample samples[SAMPLES];
    uint64_t sample_count;
    int64_t sampled_ms;
};

struct board *board_create(void)
{
    struct board *board = memory_array(1, sizeof *board);
    pthread_condattr_t attributes;
    board->bell = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    pthread_mutex_init(&board->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&board->published, &attributes);
    pthread_condattr_destroy(&attributes);
    return board;
}

void board_destroy(struct board **pointer)
{
    struct board *board = *pointer;
    if (!board)
        return;
    for (int i = 0; i < LINES; i++)
        free(board->lines[i].text);
    pthread_cond_destroy(&board->published);
    pthread_mutex_destroy(&board->mutex);
    if (board->bell >= 0)
        close(board->bell);
    free(board->fresh);
    free(board->shown);
    free(board);
    *pointer = NULL;
}

/* --- the loop's side -------------------------------------------------------------------------------------- */

int board_bell(const struct board *board)
{
    return board->bell;
}

int board_wait_ms(struct board *board, int64_t now_ms)
{
    pthread_mutex_lock(&board->mutex);
    int64_t due_ms = board->wanted ? now_ms : board->sampled_ms + STEP_MS;
    pthread_mutex_unlock(&board->mutex);
    return due_ms <= now_ms ? 0 : (int)(due_ms - now_ms);
}

/* Of the scene that is being rendered. */
static double remaining_of(const struct snapshot *snapshot)
{
    for (size_t i = 0; i < snapshot->job_count; i++)
        if (snapshot->jobs[i].state == JOB_SURVEYING || snapshot->jobs[i].state == JOB_RUNNING)
            return snapshot->jobs[i].remaining_seconds;
    return -1;
}

static void add_sample(struct board *board, const struct snapshot *snapshot, int64_t now_ms)
{
    board->samples[board->sample_count++ % SAMPLES] = (struct sample){
        .elapsed = snapshot->elapsed_seconds,
        .rays_per_second = snapshot->rays_per_second,
        .remaining = remaining_of(snapshot),
    };
    board->sampled_ms = now_ms;
}

/* With the mutex held, so that it rings exactly while a state is wanted: else the loop would not rest. */
static void silence_bell(struct board *board)
{
    uint64_t rung;
    ssize_t got = read(board->bell, &rung, sizeof rung);
    (void)got; /* whether it has rung or not */
}

void board_publish(struct board *board, const struct snapshot *snapshot, int64_t now_ms, bool last)
{
    pthread_mutex_lock(&board->mutex);
    silence_bell(board);
    if (last || board->sampled_ms + STEP_MS <= now_ms)
        add_sample(board, snapshot, now_ms);
    if (last || board->wanted) {
        free(board->fresh);
        board->fresh = snapshot_copy(snapshot);
        board->published_ms = now_ms;
        board->wanted = false;
        board->over = last;
        pthread_cond_broadcast(&board->published);
    }
    pthread_mutex_unlock(&board->mutex);
}

void board_add_line(struct board *board, enum log_level level, const char *text)
{
    char *copy = memory_string(text);
    pthread_mutex_lock(&board->mutex);
    struct line *line = &board->lines[board->next_line++ % LINES];
    free(line->text);
    *line = (struct line){(int64_t)time(NULL), level, copy};
    pthread_mutex_unlock(&board->mutex);
}

/* The last state was seen, and nothing has been asked for since. */
static bool has_seen_all(struct board *board, int64_t now_ms)
{
    enum { SILENCE_MS = 1000 };
    pthread_mutex_lock(&board->mutex);
    bool seen = board->last_seen_ms > 0 && now_ms - board->looked_ms > SILENCE_MS;
    pthread_mutex_unlock(&board->mutex);
    return seen;
}

void board_linger(struct board *board)
{
    enum { LONGEST_MS = 3000, STEP_NS = 20 * 1000 * 1000 };
    int64_t begun_ms = clock_now_ms(), now_ms = begun_ms;
    pthread_mutex_lock(&board->mutex);
    bool watched = board->over && board->looked_ms > 0 && begun_ms - board->looked_ms < RECENT_MS;
    pthread_mutex_unlock(&board->mutex);
    for (; watched && now_ms - begun_ms < LONGEST_MS && !has_seen_all(board, now_ms); now_ms = clock_now_ms())
        nanosleep(&(struct timespec){.tv_nsec = STEP_NS}, NULL);
}

/* --- the side of the one who answers ---------------------------------------------------------------------- */

static struct timespec in_future(int64_t ms)
{
    struct timespec when;
    clock_gettime(CLOCK_MONOTONIC, &when);
    int64_t ns = when.tv_nsec + ms * 1000000;
    return (struct timespec){when.tv_sec + ns / 1000000000, ns % 1000000000};
}

/* With the mutex held. */
static void ask_for_newer(struct board *board)
{
    const uint64_t one = 1;
    struct timespec latest = in_future(PATIENCE_MS);
    board->wanted = true;
    ssize_t rung = write(board->bell, &one, sizeof one);
    (void)rung; /* a bell that has rung too often to count is heard too */
    while (board->wanted && pthread_cond_timedwait(&board->published, &board->mutex, &latest) != ETIMEDOUT)
        ;
}

const struct snapshot *board_look(struct board *board)
{
    int64_t now_ms = clock_now_ms();
    pthread_mutex_lock(&board->mutex);
    board->looked_ms = now_ms;
    if (!board->over && now_ms - board->published_ms > FRESH_MS)
        ask_for_newer(board);
    if (board->over)
        board->last_seen_ms = now_ms;
    if (board->fresh) {
        free(board->shown);
        board->shown = board->fresh;
        board->fresh = NULL;
    }
    pthread_mutex_unlock(&board->mutex);
    return board->shown;
}

void board_note_look(struct board *board)
{
    pthread_mutex_lock(&board->mutex);
    board->looked_ms = clock_now_ms();
    pthread_mutex_unlock(&board->mutex);
}

bool board_is_over(struct board *board)
{
    pthread_mutex_lock(&board->mutex);
    bool over = board->over;
    pthread_mutex_unlock(&board->mutex);
    return over;
}

static void put_line(const struct line *line, struct bytes *json)
{
    text_put(json, "{\"time\":%" PRId64 ",\"level\":\"%s\",", line->time, log_level_name(line->level));
    json_text_string(json, "text", line->text);
    text_put(json, "}");
}

void board_put_lines(struct board *board, uint64_t from, struct bytes *json)
{
    pthread_mutex_lock(&board->mutex);
    uint64_t next = board->next_line, oldest = next > LINES ? next - LINES : 0;
    text_put(json, "{\"next\":%" PRIu64 ",\"lines\":[", next);
    for (uint64_t n = from < oldest ? oldest : from; n < next; n++) {
        put_line(&board->lines[n % LINES], json);
        text_put(json, n + 1 < next ? "," : "");
    }
    pthread_mutex_unlock(&board->mutex);
    text_put(json, "]}\n");
}

void board_put_history(struct board *board, struct bytes *json)
{
    pthread_mutex_lock(&board->mutex);
    uint64_t next = board->sample_count;
    text_put(json, "{\"step\":%g,\"samples\":[", STEP_MS / 1000.0);
    for (uint64_t n = next > SAMPLES ? next - SAMPLES : 0; n < next; n++) {
        const struct sample *sample = &board->samples[n % SAMPLES];
        text_put(json, "{");
        json_text_number(json, "elapsed", sample->elapsed, 3);
        text_put(json, ",");
        json_text_number(json, "rays_per_second", sample->rays_per_second, 3);
        text_put(json, ",");
        json_text_number(json, "remaining", sample->remaining < 0 ? NAN : sample->remaining, 3);
        text_put(json, n + 1 < next ? "}," : "}");
    }
    pthread_mutex_unlock(&board->mutex);
    text_put(json, "]}\n");
}
