#include "coordinator/progress.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/log.h"
#include "base/memory.h"
#include "base/text.h"
#include "coordinator/progress_views.h"
#include "coordinator/snapshot_json.h"

enum { BAR_PERIOD_MS = 100, LINES_PERIOD_MS = 5000, JSON_PERIOD_MS = 250 };

struct terminal_size {
    size_t columns, rows;
};

struct progress {
    enum progress_mode mode;
    FILE *to;
    bool begun; /* an update has been seen, so due_ms counts */
    int64_t due_ms;

    /* The block last laid out and the terminal's size then. If it is shown, the cursor is on the row below. */
    struct bytes block;
    struct terminal_size size;
    bool shown;

    enum job_state *states; /* as the last JSON line told them */
    size_t state_count;
};

/* --- writing ---------------------------------------------------------------------------------------------- */

/* One write if the system lets it be one. That a view cannot be written is no reason to end a render. */
static void write_bytes(FILE *to, const struct bytes *bytes)
{
    fflush(to);
    int fd = fileno(to);
    for (size_t at = 0; at < bytes->size;) {
        ssize_t written = write(fd, bytes->data + at, bytes->size - at);
        if (written > 0) {
            at += (size_t)written;
        } else if (written < 0 && errno == EAGAIN) {
            struct pollfd ready = {.fd = fd, .events = POLLOUT};
            poll(&ready, 1, -1);
        } else if (written == 0 || errno != EINTR) {
            return;
        }
    }
}

static void write_view(struct progress *progress, void (*view)(struct bytes *, const struct snapshot *),
                       const struct snapshot *snapshot)
{
    struct bytes text = {0};
    view(&text, snapshot);
    write_bytes(progress->to, &text);
    bytes_finish(&text);
}

/* --- the block on a terminal ------------------------------------------------------------------------------ */

static struct terminal_size terminal_size(FILE *to)
{
    struct winsize size;
    if (ioctl(fileno(to), TIOCGWINSZ, &size) || size.ws_col == 0 || size.ws_row == 0)
        return (struct terminal_size){80, 24};
    return (struct terminal_size){size.ws_col, size.ws_row};
}

/* False if a shell has put us into the background: then the terminal belongs to somebody else. */
static bool in_foreground(FILE *to)
{
    pid_t group = tcgetpgrp(fileno(to));
    return group < 0 || group == getpgrp();
}

/* How many rows above the cursor the block takes now, of those still on the screen. A terminal that has become
 * narrower has wrapped its lines. */
static size_t block_rows(const struct progress *progress, struct terminal_size size)
{
    size_t rows = 0, used = 0;
    const char *at = (const char *)progress->block.data;
    for (uint32_t code; (code = text_next(&at));) {
        if (code != '\n') {
            used += text_code_columns(code);
            continue;
        }
        rows += used ? (used + size.columns - 1) / size.columns : 1;
        used = 0;
    }
    return rows < size.rows ? rows : size.rows - 1;
}

#define ERASE_LINE_END "\033[K"
#define ERASE_BELOW "\033[J"

static void put_up(struct bytes *out, size_t rows)
{
    text_put(out, "\r");
    if (rows) /* zero would move by one */
        text_put(out, "\033[%zuA", rows);
}

/* Row by row: some terminals keep what one stroke erases from the top row down in their history. */
static void clear_block(struct progress *progress)
{
    if (progress->shown && in_foreground(progress->to)) {
        size_t rows = block_rows(progress, terminal_size(progress->to));
        struct bytes out = {0};
        put_up(&out, rows);
        for (size_t i = 0; i < rows; i++)
            text_put(&out, ERASE_LINE_END "\n");
        text_put(&out, ERASE_LINE_END);
        put_up(&out, rows);
        write_bytes(progress->to, &out);
        bytes_finish(&out);
    }
    progress->shown = false;
}

/* Writes the block, beginning `up` rows above the cursor. Each line goes over the old one and only then is the
 * rest of its row erased, so nothing flickers. */
static void write_block(struct progress *progress, size_t up)
{
    struct bytes out = {0};
    put_up(&out, up);
    for (size_t i = 0; i < progress->block.size; i++) {
        if (progress->block.data[i] == '\n')
            text_put(&out, ERASE_LINE_END);
        bytes_put_u8(&out, progress->block.data[i]);
    }
    text_put(&out, ERASE_BELOW);
    write_bytes(progress->to, &out);
    bytes_finish(&out);
    progress->shown = true;
}

static void draw_block(struct progress *progress, const struct snapshot *snapshot)
{
    if (!in_foreground(progress->to)) {
        progress->shown = false;
        return;
    }
    struct terminal_size size = terminal_size(progress->to);
    if (size.columns != progress->size.columns)
        clear_block(progress);
    size_t up = progress->shown ? block_rows(progress, size) : 0;
    progress->size = size;
    progress->block.size = 0;
    progress_block(&progress->block, snapshot, size.columns, size.rows);
    write_block(progress, up);
}

static void hide_for_log(void *context)
{
    clear_block(context);
}

/* The snapshot is gone by now, so the block comes back as it was. If it may not fit any more, the next update
 * brings it. */
static void show_after_log(void *context)
{
    struct progress *progress = context;
    struct terminal_size size = terminal_size(progress->to);
    if (!progress->block.size || size.columns != progress->size.columns || size.rows != progress->size.rows ||
        !in_foreground(progress->to))
        return;
    write_block(progress, 0);
}

/* --- JSON lines ------------------------------------------------------------------------------------------- */

/* Whether a job's state differs from what the last line told. */
static bool states_changed(const struct progress *progress, const struct snapshot *snapshot)
{
    if (progress->state_count != snapshot->job_count)
        return true;
    for (size_t i = 0; i < snapshot->job_count; i++) {
        if (progress->states[i] != snapshot->jobs[i].state)
            return true;
    }
    return false;
}

static void write_json(struct progress *progress, const struct snapshot *snapshot)
{
    progress->states = memory_resize(progress->states, snapshot->job_count, sizeof *progress->states);
    progress->state_count = snapshot->job_count;
    for (size_t i = 0; i < snapshot->job_count; i++)
        progress->states[i] = snapshot->jobs[i].state;
    write_view(progress, snapshot_write_json, snapshot);
}

/* --- all modes -------------------------------------------------------------------------------------------- */

struct progress *progress_create(enum progress_mode mode, FILE *to)
{
    struct progress *progress = memory_array(1, sizeof *progress);
    progress->mode = mode;
    progress->to = to;
    if (mode == PROGRESS_BAR)
        log_set_display(hide_for_log, show_after_log, progress);
    return progress;
}

/* Nothing is shown from here on. */
static void stop_showing(struct progress *progress)
{
    if (progress->mode == PROGRESS_BAR) {
        clear_block(progress);
        log_set_display(NULL, NULL, NULL);
    }
    progress->mode = PROGRESS_NONE;
}

void progress_destroy(struct progress **progress)
{
    if (!*progress)
        return;
    stop_showing(*progress);
    bytes_finish(&(*progress)->block);
    free((*progress)->states);
    free(*progress);
    *progress = NULL;
}

enum progress_mode progress_mode_auto(FILE *to)
{
    const char *terminal = getenv("TERM");
    bool movable = terminal && *terminal && strcmp(terminal, "dumb") != 0;
    return movable && isatty(fileno(to)) ? PROGRESS_BAR : PROGRESS_LINES;
}

void progress_disturb(struct progress *progress, bool displaced)
{
    if (progress->mode != PROGRESS_BAR)
        return;
    progress->due_ms = 0;
    progress->shown &= !displaced;
}

int progress_wait_ms(const struct progress *progress, int64_t now_ms)
{
    if (progress->mode == PROGRESS_NONE)
        return -1;
    if (!progress->begun || progress->due_ms <= now_ms)
        return 0;
    return progress->due_ms - now_ms < INT_MAX ? (int)(progress->due_ms - now_ms) : INT_MAX;
}

void progress_update(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms)
{
    static const int period_ms[] = {[PROGRESS_BAR] = BAR_PERIOD_MS,
                                    [PROGRESS_LINES] = LINES_PERIOD_MS,
                                    [PROGRESS_JSON] = JSON_PERIOD_MS};
    bool first = !progress->begun;
    bool news = progress->mode == PROGRESS_JSON && states_changed(progress, snapshot);
    if (progress->mode == PROGRESS_NONE || (!first && !news && now_ms < progress->due_ms))
        return;
    if (progress->mode == PROGRESS_BAR)
        draw_block(progress, snapshot);
    else if (progress->mode == PROGRESS_JSON)
        write_json(progress, snapshot);
    else if (!first) /* a render that ends within one period needs no line */
        write_view(progress, progress_line, snapshot);
    progress->begun = true;
    progress->due_ms = now_ms + period_ms[progress->mode];
}

void progress_finish(struct progress *progress, const struct snapshot *snapshot, int64_t now_ms)
{
    (void)now_ms;
    if (progress->mode == PROGRESS_JSON)
        write_json(progress, snapshot);
    stop_showing(progress);
}
