/*
 * The scheduler's bands: how the rows of a pass are cut into them, and in which order these come.
 *
 * A render begins with soundings: low bands spread over the picture, those first that lie farthest from others. They
 * tell early what its parts take, and show it. Then come the rows between them, from the top, in bands that are expected
 * to take alike.
 */
#include <stdlib.h>

#include "base/memory.h"
#include "coordinator/scheduler_private.h"

enum {
    BAND_ROWS_MAX = 48, /* of a band cut automatically, */
    BAND_ROWS_MIN = 4,  /* and of a render's, unless rows are scarce; */
    ADAPTIVE_ROWS_MIN = 8, /* adaptive sampling looks beyond a band's edges */
    BANDS_A_THREAD = 2, /* into how many bands a thread's share of what remains is cut */
    SURVEY_BANDS_MIN = 32, /* so many of a survey, if it has the rows, tell what its parts take */
    SOUNDINGS_MIN = 16, /* where there are rows enough: not more than every second is to be part of one; */
    SOUNDINGS_MAX = 32,
    SOUNDING_EVERY = 48, /* rows, if that gives a number between these */
};

static uint32_t rows_of(const struct job *job)
{
    return job->pass_rows[job->pass];
}

/* There are not enough rows in the picture for bands of the usual size. */
static bool is_small(const struct scheduler *s, const struct job *job)
{
    return rows_of(job) < BANDS_A_THREAD * BAND_ROWS_MIN * s->threads;
}

/* What of these rows may be one band. */
static uint32_t limit_rows(const struct job *job, uint32_t rows)
{
    uint32_t most = job->pass == PASS_RENDER ? job->rows_most : 0;
    return most > 0 && most < rows ? most : rows;
}

/* --- what lies ahead -------------------------------------------------------------------------------------- */

/* Where the next rows that are not to be cut begin, or the pass's rows end. */
static uint32_t cut_end(const struct job *job)
{
    return job->ahead_at < job->ahead_count ? job->ahead[job->ahead_at].first_row : rows_of(job);
}

static void skip_ahead(struct job *job)
{
    while (job->next_row < rows_of(job) && job->next_row == cut_end(job))
        job->next_row += job->ahead[job->ahead_at++].rows;
}

static void put_ahead(struct job *job, uint32_t first_row, uint32_t rows)
{
    job->ahead = memory_grow(job->ahead, &job->ahead_capacity, job->ahead_count + 1, sizeof *job->ahead);
    job->ahead[job->ahead_count++] = (struct span){first_row, rows};
}

static int compare(const void *left, const void *right)
{
    const struct span *a = left, *b = right;
    return a->first_row < b->first_row ? -1 : a->first_row > b->first_row;
}

static void take_kept(struct scheduler *s, struct job *job)
{
    for (size_t i = 0; i < job->kept_count; i++) {
        const struct kept_rows *kept = &job->kept[i];
        if (kept->pass != job->pass)
            continue;
        job->accepted_rows += kept->rows;
        scheduler_choose_audit(s, job, kept->first_row, kept->rows, NULL);
        put_ahead(job, kept->first_row, kept->rows);
    }
}

static bool is_any_kept(const struct job *job, uint32_t first_row, uint32_t rows)
{
    for (size_t i = 0; i < job->kept_count; i++) {
        const struct kept_rows *kept = &job->kept[i];
        if (kept->pass == job->pass && kept->first_row < first_row + rows && first_row < kept->first_row + kept->rows)
            return true;
    }
    return false;
}

/* With a survey, which tells much already and whose bands look beyond their edges, half as many. */
static uint32_t count_soundings(const struct job *job, uint32_t rows_of_one)
{
    uint32_t count = rows_of(job) / SOUNDING_EVERY, most = rows_of(job) / 2 / rows_of_one;
    count = count < SOUNDINGS_MIN ? SOUNDINGS_MIN : count > SOUNDINGS_MAX ? SOUNDINGS_MAX : count;
    count = count < most ? count : most;
    count = count < SOUNDINGS_MIN ? 0 : count;
    return job->pass_rows[PASS_SURVEY] > 0 ? count / 2 : count;
}

static void put_sounding(struct job *job, uint32_t first_row, uint32_t rows)
{
    if (is_any_kept(job, first_row, rows))
        return;
    struct band *band = scheduler_add_band(job, first_row, rows);
    band->state = BAND_WAITING;
    list_append(&job->waiting, &band->in_job);
    put_ahead(job, first_row, rows);
}

/* The picture has so many parts, with one in the middle of each: first that of a part in the middle, then those in the
 * middle of what is above and below it, and so on; that of the lowest part comes last. */
static void put_soundings(struct job *job, uint32_t count, uint32_t rows)
{
    uint64_t all = rows_of(job);
    for (uint32_t step = SOUNDINGS_MAX; step > 0; step /= 2)
        for (uint32_t part = step - 1; part + 1 < count; part += 2 * step)
            put_sounding(job, (uint32_t)((2 * part + 1) * all / (2 * count)), rows);
    if (count > 0)
        put_sounding(job, (uint32_t)((2 * count - 1) * all / (2 * count)), rows);
}

void scheduler_lay_soundings(const struct scheduler *s, struct job *job)
{
    if (job->sounded)
        return;
    job->sounded = true;
    if (job->pass != PASS_RENDER || is_small(s, job))
        return;
    uint32_t rows = limit_rows(job, s->policy.band_rows > 0 ? s->policy.band_rows : BAND_ROWS_MIN);
    put_soundings(job, count_soundings(job, rows), rows);
    job->next_row = 0;
    job->ahead_at = 0;
    if (job->ahead_count > 0)
        qsort(job->ahead, job->ahead_count, sizeof *job->ahead, compare);
    skip_ahead(job);
}

void scheduler_begin_pass(struct scheduler *s, struct job *job, enum render_pass pass)
{
    scheduler_clear_bands(job);
    job->pass = pass;
    job->sounded = false;
    job->next_row = job->accepted_rows = 0;
    job->answered_ms = job->answered_rows = job->answered = 0;
    job->ahead_at = job->ahead_count = 0;
    take_kept(s, job);
    skip_ahead(job);
}

void scheduler_clear_bands(struct job *job)
{
    list_empty(&job->waiting);
    list_empty(&job->reserved);
    list_empty(&job->unsettled);
    for (size_t i = 0; i < job->band_count; i++) {
        free(job->bands[i]->auditors);
        free(job->bands[i]);
    }
    job->band_count = job->open_audits = 0;
    job->has_dreaded = false;
}

/* --- cutting ---------------------------------------------------------------------------------------------- */

/* A share of `rows` for a worker that is slower than the mean, so that its bands take as long as those of others; few
 * rows as long as nobody knows. */
static uint64_t rows_for(const struct job *job, const struct worker *w, uint64_t rows)
{
    enum { PARTS = 64 }; /* of a millisecond */
    int64_t own = pace_leased_ms(&w->pace, job->number, job->pass, PARTS * rows);
    if (own < 0 || job->answered_rows == 0) /* the latter: it began again */
        return BAND_ROWS_MIN;
    int64_t mean = job->answered_ms * PARTS * (int64_t)rows / job->answered_rows;
    return own > mean && own > 0 ? rows * (uint64_t)mean / (uint64_t)own : rows;
}

bool scheduler_is_scarce(const struct scheduler *s, const struct job *job)
{
    return scheduler_rows_waiting(job) < s->threads && is_small(s, job);
}

/* Of the rows up to those ahead a part, at most so many, and as many as the other parts. */
static uint64_t part_of(uint64_t together, uint64_t rows)
{
    uint64_t parts = (together + rows - 1) / rows;
    return (together + parts - 1) / parts;
}

static uint64_t least_rows(const struct scheduler *s, const struct job *job)
{
    if (job->pass == PASS_SURVEY || scheduler_is_scarce(s, job))
        return 1;
    return job->pass_rows[PASS_SURVEY] > 0 ? ADAPTIVE_ROWS_MIN : BAND_ROWS_MIN;
}

static uint64_t most_rows(const struct job *job)
{
    uint64_t most = job->pass == PASS_SURVEY ? rows_of(job) / SURVEY_BANDS_MIN : BAND_ROWS_MAX;
    return most < 1 ? 1 : most < BAND_ROWS_MAX ? most : BAND_ROWS_MAX;
}

/* How many rows from the next one on, at most so many, are one of so many parts of what remains: of its work, if it is
 * known what that will be, else of its rows. */
static uint64_t share_rows(const struct scheduler *s, const struct job *job, uint64_t parts, uint64_t most)
{
    bool is_asked = job->pass == PASS_RENDER && s->policy.expects;
    const double *sums = is_asked ? s->policy.expects(s->policy.expects_context, job->number) : NULL;
    if (!sums) {
        uint64_t share = scheduler_rows_waiting(job) / parts;
        return share < most ? share : most;
    }
    const double *next = sums + job->next_row;
    uint64_t rows = 0, together = cut_end(job) - job->next_row;
    most = together < most ? together : most;
    double share = (sums[rows_of(job)] - *next) / (double)parts;
    while (rows < most && next[rows + 1] - *next <= share)
        rows++;
    return rows;
}

/* Guided self-scheduling: a share of what remains, so that bands are large while there is much to do and small when
 * the end is near. */
static uint64_t guided_rows(const struct scheduler *s, const struct job *job, const struct worker *w)
{
    bool renders = job->pass == PASS_RENDER, ends_ahead = renders && cut_end(job) < rows_of(job);
    uint64_t least = least_rows(s, job);
    uint64_t share = share_rows(s, job, BANDS_A_THREAD * s->threads, most_rows(job));
    share = renders && w && share > least ? rows_for(job, w, share) : share;
    share = share < least ? least : share;
    return ends_ahead ? part_of(cut_end(job) - job->next_row, share) : share;
}

/* `w`: NULL: nobody in particular. */
static uint32_t rows_to_cut(const struct scheduler *s, const struct job *job, const struct worker *w)
{
    bool is_given = job->pass == PASS_RENDER && s->policy.band_rows > 0;
    uint64_t rows = is_given ? s->policy.band_rows : guided_rows(s, job, w), together = cut_end(job) - job->next_row;
    return limit_rows(job, (uint32_t)(rows < together ? rows : together));
}

struct band *scheduler_add_band(struct job *job, uint32_t first_row, uint32_t rows)
{
    struct band *band = memory_array(1, sizeof *band);
    *band = (struct band){.first_row = first_row, .rows = rows};
    list_empty(&band->leases);
    job->bands = memory_grow(job->bands, &job->band_capacity, job->band_count + 1, sizeof(struct band *));
    job->bands[job->band_count++] = band;
    return band;
}

/* The first of the rows that are not yet cut belong to a band. */
static void pass_over(struct job *job, uint32_t rows)
{
    job->next_row += rows;
    skip_ahead(job);
}

struct band *scheduler_cut_band(const struct scheduler *s, struct job *job, const struct worker *w)
{
    struct band *band = scheduler_add_band(job, job->next_row, rows_to_cut(s, job, w));
    pass_over(job, band->rows);
    return band;
}

uint32_t scheduler_bands_to_come(const struct scheduler *s, uint32_t number)
{
    if (number >= s->job_count || s->jobs[number]->over || s->threads == 0)
        return 0;
    struct job rest = *s->jobs[number]; /* what is there is only read */
    uint32_t bands = 0;
    list_each(link, &s->jobs[number]->waiting) {
        rest.leased_rows += list_owner(link, struct band, in_job)->rows;
        bands++;
    }
    for (; rest.next_row < rows_of(&rest); bands++) {
        uint32_t rows = rows_to_cut(s, &rest, NULL);
        rest.leased_rows += rows;
        pass_over(&rest, rows);
    }
    return bands;
}
