#include "coordinator/progress_views.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"

/* --- figures ---------------------------------------------------------------------------------------------- */

enum { FIGURE_BYTES = 32 };

/* Whole seconds, rounded down or up; nonsense becomes 0, and no time is longer than 30 years. */
static uint64_t whole_seconds(double seconds, bool up)
{
    if (!(seconds > 0))
        return 0;
    return (uint64_t)(up ? ceil(fmin(seconds, 1e9)) : floor(fmin(seconds, 1e9)));
}

/* 0:05, 12:34, 1:02:03. */
static void format_clock(char text[FIGURE_BYTES], uint64_t seconds)
{
    unsigned second = (unsigned)(seconds % 60), minute = (unsigned)(seconds / 60 % 60);
    if (seconds < 3600)
        snprintf(text, FIGURE_BYTES, "%u:%02u", minute, second);
    else
        snprintf(text, FIGURE_BYTES, "%" PRIu64 ":%02u:%02u", seconds / 3600, minute, second);
}

/* For prose: "12 s" below a minute, else as on a clock. */
static void format_duration(char text[FIGURE_BYTES], uint64_t seconds)
{
    if (seconds < 60)
        snprintf(text, FIGURE_BYTES, "%" PRIu64 " s", seconds);
    else
        format_clock(text, seconds);
}

/* A count with at most three digits before its unit prefix, such as 950, 3.1 M, 12.3 M or 123 M. The limits are
 * where printing with that many digits would round up to one digit more. */
static void format_count(char text[FIGURE_BYTES], double count)
{
    static const char prefixes[] = "kMGTPE";
    int prefix = -1;
    count = isfinite(count) && count > 0 ? count : 0;
    while (count >= 999.5 && prefixes[prefix + 1]) {
        count /= 1000;
        prefix++;
    }
    if (prefix < 0)
        snprintf(text, FIGURE_BYTES, "%.0f", count);
    else
        snprintf(text, FIGURE_BYTES, "%.*f %c", count < 99.95 ? 1 : 0, fmin(count, 999), prefixes[prefix]);
}

/* Rounded down, and 100 only for a job that is done: its last row may be there while its file is not. */
static unsigned percent_of(const struct job_snapshot *job)
{
    if (job->state == JOB_DONE)
        return 100;
    uint64_t percent = job->height ? UINT64_C(100) * job->rows_done / job->height : 0;
    return percent < 99 ? (unsigned)percent : 99;
}

/* --- the job that is under way ---------------------------------------------------------------------------- */

/* The first that has not ended, else the last. */
static size_t current_job(const struct snapshot *snapshot)
{
    for (size_t i = 0; i < snapshot->job_count; i++) {
        if (snapshot->jobs[i].state != JOB_DONE && snapshot->jobs[i].state != JOB_FAILED)
            return i;
    }
    return snapshot->job_count - 1;
}

static const char *file_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}

/* Appends `line` to the block, cut to fewer columns than the terminal has: a full line would wrap. */
static void put_line(struct bytes *text, struct bytes *line, size_t columns)
{
    text_put_cut(text, (const char *)line->data, columns - 1);
    text_put(text, "\n");
    bytes_finish(line);
}

/* Two names in `room` columns. One that needs less than half leaves the rest to the other. */
static void put_names(struct bytes *line, const char *scene, const char *output, size_t room)
{
    static const char arrow[] = " → ";
    size_t both = room > text_columns(arrow) ? room - text_columns(arrow) : 0;
    size_t output_columns = text_columns(output);
    size_t scene_room = output_columns < both / 2 ? both - output_columns : both - both / 2;
    size_t used = text_put_cut(line, scene, scene_room);
    text_put(line, "%s", arrow);
    text_put_cut(line, output, both - used);
}

static void put_title(struct bytes *text, const struct snapshot *snapshot, size_t columns)
{
    size_t index = current_job(snapshot);
    const struct job_snapshot *job = &snapshot->jobs[index];
    struct bytes line = {0};
    if (snapshot->job_count > 1)
        text_put(&line, "%zu of %zu  ", index + 1, snapshot->job_count);
    size_t used = line.size;
    put_names(&line, file_name(job->scene), job->output, columns - 1 > used ? columns - 1 - used : 0);
    if (job->width)
        text_put(&line, "  %" PRIu32 " × %" PRIu32, job->width, job->height);
    if (job->error > 0)
        text_put(&line, ", error %g", job->error);
    if (job->samples > 0)
        text_put(&line, ", %.*f sample%s", job->error > 0, job->samples, job->samples == 1 ? "" : "s");
    put_line(text, &line, columns);
}

/* The first `count` of the figures, the most telling first. */
static void put_first_figures(struct bytes *to, const struct snapshot *snapshot, size_t count)
{
    const struct job_snapshot *job = &snapshot->jobs[current_job(snapshot)];
    char figure[FIGURE_BYTES];
    bool waiting = job->state == JOB_WAITING;
    text_put(to, "%3u %%", percent_of(job));
    if (count > 1) {
        format_clock(figure, whole_seconds(waiting ? snapshot->elapsed_seconds : job->elapsed_seconds, false));
        text_put(to, "  %5s", figure);
    }
    if (count > 2 && job->state == JOB_RUNNING && job->remaining_seconds >= 0) {
        format_clock(figure, whole_seconds(job->remaining_seconds, true));
        text_put(to, "  %5s left", figure);
    } else if (count > 2) {
        static const char *const instead[] = {"waiting", "surveying", "", "done", "failed"};
        text_put(to, "  %10s", instead[job->state]);
    }
    if (count > 3) {
        format_count(figure, snapshot->rays_per_second);
        text_put(to, "  %6s rays/s", figure);
    }
    if (count > 4 && isfinite(job->rmse))
        text_put(to, "  RMSE %.5f", job->rmse);
}

/* As many as fit. */
static void put_figures(struct bytes *text, const struct snapshot *snapshot, size_t columns)
{
    enum { FIGURES = 5 };
    struct bytes line = {0};
    for (size_t count = FIGURES; count; count--) {
        line.size = 0;
        put_first_figures(&line, snapshot, count);
        if (text_columns((const char *)line.data) < columns)
            break;
    }
    put_line(text, &line, columns);
}

/* --- the strip -------------------------------------------------------------------------------------------- */

/* Stands for a worker in the strip. */
static char mark_of(uint32_t worker)
{
    return "+123456789abcdefghijklmnopqrstuvwxyz"[worker < 36 ? worker : 0];
}

/* The cell of rows first .. end − 1. *at is the number of a stretch that begins no later, and moves on to the last that
 * begins within the cell. */
static void put_cell(struct bytes *to, const struct job_snapshot *job, uint32_t first, uint32_t end, size_t *at)
{
    uint32_t done = 0, worker = 0;
    for (size_t i = *at; i < job->stretch_count && job->stretches[i].first_row < end; i++) {
        const struct stretch_snapshot *stretch = &job->stretches[i];
        uint32_t from = stretch->first_row > first ? stretch->first_row : first;
        uint32_t to_row = stretch->first_row + stretch->rows < end ? stretch->first_row + stretch->rows : end;
        if (to_row <= from)
            continue;
        done += stretch->state == STRETCH_DONE ? to_row - from : 0;
        worker = stretch->state == STRETCH_IN_WORK ? stretch->worker : worker;
        *at = i;
    }
    if (worker > 0)
        text_put(to, "%c", mark_of(worker));
    else
        text_put(to, "%s", done == end - first ? "█" : done > 0 ? "▒" : "░");
}

/* A picture lower than the strip is wide has rows of several cells. */
static void put_strip(struct bytes *text, const struct snapshot *snapshot, size_t columns)
{
    const struct job_snapshot *job = &snapshot->jobs[current_job(snapshot)];
    struct bytes line = {0};
    size_t cells = columns - 1, at = 0;
    text_put(&line, "%s", "");
    for (size_t i = 0; i < cells && job->height > 0; i++) {
        uint32_t first = (uint32_t)(i * (uint64_t)job->height / cells);
        uint32_t end = (uint32_t)((i + 1) * (uint64_t)job->height / cells);
        put_cell(&line, job, first, end > first ? end : first + 1, &at);
    }
    put_line(text, &line, columns);
}

/* --- the workers ------------------------------------------------------------------------------------------ */

static size_t present_workers(const struct snapshot *snapshot)
{
    size_t count = 0;
    for (size_t i = 0; i < snapshot->worker_count; i++)
        count += snapshot->workers[i].state != WORKER_GONE;
    return count;
}

/* The table's optional columns; each stands in the table only if all before it do. */
enum worker_column { WORKER_RATE = 1, WORKER_BANDS, WORKER_THREADS, WORKER_KERNEL };

struct worker_table {
    size_t host_columns, kernel_columns, state_columns;
    enum worker_column last; /* 0: none */
};

enum { STATE_BYTES = 64 };

/* "working", "gone: stuck", "working, was lost". */
static void format_state(char text[STATE_BYTES], const struct worker_snapshot *worker)
{
    const char *state = worker_state_name(worker->state);
    if (worker->trouble == TROUBLE_NONE)
        snprintf(text, STATE_BYTES, "%s", state);
    else
        snprintf(text, STATE_BYTES, "%s%s%s", state, worker->state == WORKER_GONE ? ": " : ", was ",
                 worker_trouble_name(worker->trouble));
}

static size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Columns of a worker's line without its host, as put_worker prints it. */
static size_t fixed_columns(const struct worker_table *table, enum worker_column last)
{
    size_t number = 5, rate = 15, bands = 12, threads = 13;
    return number + 2 + table->state_columns + (last >= WORKER_RATE ? rate : 0) + (last >= WORKER_BANDS ? bands : 0) +
           (last >= WORKER_THREADS ? threads : 0) + (last >= WORKER_KERNEL ? 2 + table->kernel_columns : 0);
}

/* Columns as wide as their contents within limits; of the optional ones as many as leave the host readable. */
static struct worker_table table_layout(const struct snapshot *snapshot, size_t columns)
{
    enum { HOST_MAX = 32, HOST_READABLE = 12, KERNEL_MAX = 8 };
    struct worker_table table = {.last = WORKER_KERNEL, .state_columns = strlen("draining")};
    for (size_t i = 0; i < snapshot->worker_count; i++) {
        char state[STATE_BYTES];
        format_state(state, &snapshot->workers[i]);
        table.state_columns = strlen(state) > table.state_columns ? strlen(state) : table.state_columns;
        size_t host = smaller(text_columns(snapshot->workers[i].host), HOST_MAX);
        size_t kernel = smaller(text_columns(snapshot->workers[i].kernel), KERNEL_MAX);
        table.host_columns = host > table.host_columns ? host : table.host_columns;
        table.kernel_columns = kernel > table.kernel_columns ? kernel : table.kernel_columns;
    }
    size_t readable = smaller(table.host_columns, HOST_READABLE);
    while (table.last && fixed_columns(&table, table.last) + readable >= columns)
        table.last--;
    size_t fixed = fixed_columns(&table, table.last);
    table.host_columns = smaller(table.host_columns, columns > fixed + 1 ? columns - 1 - fixed : 1);
    return table;
}

static void put_padded(struct bytes *to, const char *text, size_t columns)
{
    size_t used = text_put_cut(to, text, columns);
    text_put(to, "%*s", (int)(columns - used), "");
}

static void put_worker(struct bytes *text, const struct worker_snapshot *worker,
                       const struct worker_table *table, size_t columns)
{
    struct bytes line = {0};
    text_put(&line, "%3" PRIu32 "%c ", worker->number, worker->number < 10 ? ' ' : mark_of(worker->number));
    put_padded(&line, worker->host, table->host_columns);
    if (table->last >= WORKER_THREADS)
        text_put(&line, "  %3" PRIu32 " %-7s", worker->threads, worker->threads == 1 ? "thread" : "threads");
    if (table->last >= WORKER_KERNEL) {
        text_put(&line, "  ");
        put_padded(&line, worker->kernel, table->kernel_columns);
    }
    if (table->last >= WORKER_BANDS)
        text_put(&line, "  %4" PRIu32 " %-5s", worker->bands_done, worker->bands_done == 1 ? "band" : "bands");
    if (table->last >= WORKER_RATE) {
        char rate[FIGURE_BYTES];
        format_count(rate, worker->rays_per_second);
        text_put(&line, "  %6s rays/s", rate);
    }
    char state[STATE_BYTES];
    format_state(state, worker);
    text_put(&line, "  %s", state);
    put_line(text, &line, columns);
}

/* Of workers: those that are present but not listed, those that are gone and not listed, those that were not let in. */
static void put_rest(struct bytes *text, size_t present, size_t gone, uint32_t refused, size_t columns)
{
    struct bytes line = {0};
    const char *comma = "";
    text_put(&line, "…");
    if (present > 0)
        text_put(&line, " and %zu more", present);
    comma = present > 0 ? "," : comma;
    if (gone > 0)
        text_put(&line, "%s %zu gone", comma, gone);
    comma = gone > 0 ? "," : comma;
    if (refused > 0)
        text_put(&line, "%s %" PRIu32 " refused", comma, refused);
    put_line(text, &line, columns);
}

/* In at most `lines`. Where they cannot all be listed, those that are gone are not. */
static void put_workers(struct bytes *text, const struct snapshot *snapshot, size_t columns, size_t lines)
{
    size_t count = snapshot->worker_count, present = present_workers(snapshot);
    struct worker_table table = table_layout(snapshot, columns);
    bool all = count + (snapshot->refused > 0) <= lines;
    size_t listed = 0, most = all ? count : lines - 1;
    for (size_t i = 0; i < count && listed < most; i++) {
        if (!all && snapshot->workers[i].state == WORKER_GONE)
            continue;
        put_worker(text, &snapshot->workers[i], &table, columns);
        listed++;
    }
    if (!all || snapshot->refused > 0)
        put_rest(text, all ? 0 : present - listed, all ? 0 : count - present, snapshot->refused, columns);
}

static void put_no_worker(struct bytes *text, const struct snapshot *snapshot, size_t columns)
{
    struct bytes line = {0};
    text_put(&line, "no worker yet");
    if (snapshot->refused > 0)
        text_put(&line, ", %" PRIu32 " refused", snapshot->refused);
    put_line(text, &line, columns);
}

void progress_block(struct bytes *text, const struct snapshot *snapshot, size_t columns, size_t rows)
{
    enum { KEPT_FREE = 2 }; /* rows above and below the block */
    size_t lines = rows > KEPT_FREE ? rows - KEPT_FREE : 0;
    text_put(text, "%s", "");
    if (snapshot->job_count == 0 || columns < 2 || lines == 0)
        return;
    if (lines > 2)
        put_title(text, snapshot, columns);
    if (lines > 1)
        put_strip(text, snapshot, columns);
    put_figures(text, snapshot, columns);
    if (lines > 3 && snapshot->worker_count > 0)
        put_workers(text, snapshot, columns, lines - 3);
    else if (lines > 3)
        put_no_worker(text, snapshot, columns);
}

/* --- the plain line --------------------------------------------------------------------------------------- */

void progress_line(struct bytes *text, const struct snapshot *snapshot)
{
    text_put(text, "%s", "");
    if (snapshot->job_count == 0)
        return;
    enum { NAME_COLUMNS = 120 };
    size_t index = current_job(snapshot), workers = present_workers(snapshot);
    const struct job_snapshot *job = &snapshot->jobs[index];
    double elapsed = job->state == JOB_WAITING ? snapshot->elapsed_seconds : job->elapsed_seconds;
    char figure[FIGURE_BYTES];
    text_put(text, "weft: ");
    text_put_cut(text, file_name(job->scene), NAME_COLUMNS);
    if (snapshot->job_count > 1)
        text_put(text, " (%zu of %zu)", index + 1, snapshot->job_count);
    format_duration(figure, whole_seconds(elapsed, false));
    if (job->state == JOB_SURVEYING)
        text_put(text, ": surveying, %s elapsed", figure);
    else
        text_put(text, ": %u %%, %s elapsed", percent_of(job), figure);
    if (job->state == JOB_RUNNING && job->remaining_seconds >= 0) {
        format_duration(figure, whole_seconds(job->remaining_seconds, true));
        text_put(text, ", %s left", figure);
    }
    format_count(figure, snapshot->rays_per_second);
    text_put(text, ", %s rays/s, %zu worker%s\n", figure, workers, workers == 1 ? "" : "s");
}
