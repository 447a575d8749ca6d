#include "coordinator/pace.h"

enum { STUCK_GAPS = 8, STUCK_LEAST_MS = 10000 };

/* The time since it last advanced is over. */
static void close_gap(struct pace *pace, int64_t now_ms)
{
    int64_t gap_ms = now_ms - pace->advanced_ms;
    if (pace->busy && gap_ms > pace->longest_gap_ms)
        pace->longest_gap_ms = gap_ms;
    pace->advanced_ms = now_ms;
}

void pace_begin(struct pace *pace, int64_t now_ms)
{
    pace->busy = true;
    pace->busy_since_ms = pace->advanced_ms = pace->answered_ms = now_ms;
}

void pace_end(struct pace *pace, int64_t now_ms)
{
    pace->busy_ms += now_ms - pace->busy_since_ms;
    pace->busy = false;
}

void pace_answer(struct pace *pace, uint32_t job, enum render_pass pass, uint32_t rows, int64_t lease_ms,
                 int64_t now_ms)
{
    if (pace->job != job || pace->pass != pass) {
        pace->job = job;
        pace->pass = pass;
        pace->rows = 0;
        pace->lease_ms = pace->busy_ms = 0;
        pace->busy_since_ms = now_ms - lease_ms; /* it may have held others before: those were of another pass */
    }
    pace->rows += rows;
    pace->answered_ms = now_ms;
    pace->lease_ms += lease_ms;
    close_gap(pace, now_ms);
}

void pace_beat(struct pace *pace, uint64_t progress, int64_t now_ms)
{
    if (progress != pace->progress)
        close_gap(pace, now_ms);
    pace->progress = progress;
}

void pace_excuse(struct pace *pace, int64_t now_ms)
{
    pace->advanced_ms = now_ms;
}

static bool is_known(const struct pace *pace, uint32_t job, enum render_pass pass)
{
    return pace->rows > 0 && pace->job == job && pace->pass == pass;
}

int64_t pace_alone_ms(const struct pace *pace, uint32_t job, enum render_pass pass, uint64_t rows, int64_t now_ms)
{
    if (!is_known(pace, job, pass))
        return -1;
    int64_t busy_ms = pace->busy_ms + (pace->busy ? now_ms - pace->busy_since_ms : 0);
    return busy_ms * (int64_t)rows / (int64_t)pace->rows;
}

int64_t pace_leased_ms(const struct pace *pace, uint32_t job, enum render_pass pass, uint64_t rows)
{
    return is_known(pace, job, pass) ? pace->lease_ms * (int64_t)rows / (int64_t)pace->rows : -1;
}

int64_t pace_stuck_at(const struct pace *pace)
{
    if (!pace->busy || pace->longest_gap_ms == 0)
        return INT64_MAX;
    int64_t patience_ms = STUCK_GAPS * pace->longest_gap_ms;
    return pace->advanced_ms + (patience_ms > STUCK_LEAST_MS ? patience_ms : STUCK_LEAST_MS);
}
