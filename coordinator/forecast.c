#include "coordinator/forecast.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "base/memory.h"

enum {
    SUMMED_SHARE = 64, /* sums are brought up to date when one row in so many is done since */
    KNOWN_SHARE = 24, /* nothing is said as long as the work of less than one row in so many is known; an earlier run's
                       * rows do not count */
    NEAR_SHARE = 64,  /* a share of the rows: so many at most beside a gap tell what it costs there, */
    NEAR_ROWS_MIN = 4,
    FAR_SHARE = 8,    /* and so many beyond the last known one nothing but the mean does */
    BELIEVED_SHARE = 4, /* what is done counts as much as what the survey expects once it is one row in so many */
};

/* First samples are taken of so many rows beyond a band's edges. */
enum { EDGE_ROWS = 2 * SAMPLING_REACH };

enum row_state { ROW_OPEN, ROW_KNOWN, ROW_UNKNOWN }; /* not done; done, with its work, and without */

struct forecast {
    uint32_t rows, cell_rows, cells;
    double *surveyed; /* of each row of cells: the work of its survey, NAN: unknown; */
    double *expected; /* and how many samples a pixel that expects; */
    uint32_t cells_missing; /* of so many it is not yet known */
    double *shape;    /* of each row: what a sample costs there next to others, as far as the survey knows */
    uint8_t *states;  /* of each row of the render: enum row_state */
    double *work;     /* if known: of that row alone, */
    double *samples;  /* its samples, a pixel, */
    double *looks;    /* and which of them are first ones, by work */
    double known_work, known_samples, known_expected; /* sums over the rows that are known, */
    double known_shape; /* and of shape times samples */
    uint32_t known_rows, unknown_rows; /* how many of these states */
    double *soonest;  /* of bands in work, by their first row: when they are done */
    double *ahead, *ahead_looks; /* work and looks expected of each open row; valid unless stale */
    bool is_stale;
    double *sums;     /* rows + 1, as they were when so many rows were done; 0: never */
    uint32_t summed_rows;
    bool adapts;      /* there are looks */
};

struct forecast *forecast_create(uint32_t rows, uint32_t cell_rows)
{
    struct forecast *f = memory_array(1, sizeof *f);
    f->rows = rows;
    f->cell_rows = cell_rows;
    f->cells = f->cells_missing = cell_rows > 0 ? (rows + cell_rows - 1) / cell_rows : 0;
    f->surveyed = memory_array(f->cells, sizeof *f->surveyed);
    f->expected = memory_array(f->cells, sizeof *f->expected);
    f->shape = memory_array(rows, sizeof *f->shape);
    f->states = memory_array(rows, sizeof *f->states);
    f->work = memory_array(rows, sizeof *f->work);
    f->samples = memory_array(rows, sizeof *f->samples);
    f->looks = memory_array(rows, sizeof *f->looks);
    f->soonest = memory_array(rows, sizeof *f->soonest);
    f->ahead = memory_array(rows, sizeof *f->ahead);
    f->ahead_looks = memory_array(rows, sizeof *f->ahead_looks);
    f->sums = memory_array((size_t)rows + 1, sizeof *f->sums);
    for (uint32_t row = 0; row < rows; row++)
        f->shape[row] = 1;
    return f;
}

void forecast_destroy(struct forecast **pointer)
{
    struct forecast *f = *pointer;
    if (!f)
        return;
    free(f->surveyed);
    free(f->expected);
    free(f->shape);
    free(f->states);
    free(f->work);
    free(f->samples);
    free(f->looks);
    free(f->soonest);
    free(f->ahead);
    free(f->ahead_looks);
    free(f->sums);
    free(f);
    *pointer = NULL;
}

/* --- what the survey expects ------------------------------------------------------------------------------ */

double forecast_samples(const struct survey *part, const struct sampling *sampling)
{
    uint32_t policy = 0; /* that which takes as many samples at least */
    while (policy + 1 < SURVEY_POLICIES && 1u << 2 * policy < sampling->least)
        policy++;
    double samples = (double)survey_outcome(part, policy, sampling->threshold).samples;
    double expected = part->pixels > 0 && samples > (double)part->pixels ? samples / (double)part->pixels : 1;
    return fmin(expected, sampling->most); /* a worker that lies may have counted any number */
}

/* Of what rows of cells have, at a row of the picture: between the middles of two in proportion. */
static double at_row(const struct forecast *f, const double *cells, uint32_t row)
{
    double at = fmax((row + 0.5) / f->cell_rows - 0.5, 0);
    uint32_t above = (uint32_t)at, below = above + 1 < f->cells ? above + 1 : f->cells - 1;
    above = above < below ? above : below;
    return cells[above] + (at - above) * (cells[below] - cells[above]);
}

/* Of a row's pixels. Without a survey, 1 stands for all samples. */
static double expected_at(const struct forecast *f, uint32_t row)
{
    return f->cells > 0 ? at_row(f, f->expected, row) : 1;
}

/* Where a render needs more samples, the survey took more too; so its work by sample expected is what a sample costs,
 * if only roughly: therefore the share of the mean. Where a part of the survey is an earlier run's, its work is not
 * known, and all rows count alike. */
static void shape_rows(struct forecast *f)
{
    static const double evened = 0.2;
    double mean = 0;
    for (uint32_t cell = 0; cell < f->cells; cell++) {
        f->surveyed[cell] /= f->expected[cell];
        mean += f->surveyed[cell] / f->cells;
    }
    for (uint32_t row = 0; mean > 0 && row < f->rows; row++)
        f->shape[row] = at_row(f, f->surveyed, row) / mean + evened;
}

void forecast_survey(struct forecast *f, uint32_t first_cell, uint32_t cells, double work)
{
    for (uint32_t cell = first_cell; cell < first_cell + cells; cell++)
        f->surveyed[cell] = work / cells;
}

void forecast_expect(struct forecast *f, uint32_t cell, double samples)
{
    f->expected[cell] = samples;
    f->cells_missing--;
    if (f->cells_missing == 0)
        shape_rows(f);
}

/* --- what is done ----------------------------------------------------------------------------------------- */

void forecast_add(struct forecast *f, uint32_t first_row, uint32_t rows, double work, double looks)
{
    bool known = !isnan(work);
    double inner = work / (1 + EDGE_ROWS * looks / rows);
    for (uint32_t row = first_row; row < first_row + rows; row++) {
        f->states[row] = known ? ROW_KNOWN : ROW_UNKNOWN;
        f->work[row] = inner / rows;
        f->samples[row] = looks > 0 ? 1 / looks : 1;
        f->looks[row] = f->work[row] * looks;
        f->known_samples += known ? f->samples[row] : 0;
        f->known_expected += known ? expected_at(f, row) : 0;
        f->known_shape += known ? f->samples[row] * f->shape[row] : 0;
    }
    *(known ? &f->known_rows : &f->unknown_rows) += rows;
    f->known_work += known ? inner : 0;
    f->adapts |= looks > 0;
    f->is_stale = true;
}

/* --- what is to come -------------------------------------------------------------------------------------- */

static uint32_t share_of(const struct forecast *f, uint32_t share, uint32_t least)
{
    return f->rows / share > least ? f->rows / share : least;
}

/* What a sample costs where the shape is 1, in the known rows next to a gap, from `row` on in that direction (1 or −1;
 * above row 0 it wraps and ends); false: there are none. */
static bool find_nearby(const struct forecast *f, uint32_t row, int direction, double *cost)
{
    double work = 0, samples = 0;
    uint32_t counted = 0, most = share_of(f, NEAR_SHARE, NEAR_ROWS_MIN);
    for (; row < f->rows && f->states[row] != ROW_OPEN && counted < most; row += (uint32_t)direction)
        if (f->states[row] == ROW_KNOWN) {
            work += f->work[row];
            samples += f->samples[row] * f->shape[row];
            counted++;
        }
    if (counted > 0)
        *cost = work / samples;
    return counted > 0;
}

/* What is done got so many times the samples that were expected of it. As long as little is done, that is by chance in
 * part. */
static double correction(const struct forecast *f)
{
    double as_expected = (double)f->rows / BELIEVED_SHARE;
    return (f->known_samples + as_expected) / (f->known_expected + as_expected);
}

/* Rows first .. end − 1 are open, those next to them are not. */
static void fill_gap(struct forecast *f, uint32_t first, uint32_t end)
{
    double mean = f->known_work / f->known_shape, above = mean, below = mean, more = correction(f);
    bool has_above = find_nearby(f, first - 1, -1, &above), has_below = find_nearby(f, end, 1, &below);
    double far = share_of(f, FAR_SHARE, 1);
    for (uint32_t row = first; row < end; row++) {
        double cost = mean, samples = fmax(expected_at(f, row) * more, 1);
        if (has_above && has_below)
            cost = above + (row - first + 0.5) / (end - first) * (below - above);
        else if (has_above)
            cost = above + fmin((row - first) / far, 1) * (mean - above);
        else if (has_below)
            cost = below + fmin((end - 1 - row) / far, 1) * (mean - below);
        f->ahead[row] = cost * f->shape[row] * samples;
        f->ahead_looks[row] = f->adapts ? cost * f->shape[row] : 0;
    }
}

/* Whether enough is known; then `ahead` is up to date. */
static bool look_ahead(struct forecast *f)
{
    if (f->cells_missing > 0 || f->known_rows == 0 || f->known_rows < (f->rows - f->unknown_rows) / KNOWN_SHARE)
        return false;
    for (uint32_t row = 0, first = 0; f->is_stale && row < f->rows; row++) {
        bool open = f->states[row] == ROW_OPEN;
        first = open ? first : row + 1;
        if (open && (row + 1 == f->rows || f->states[row + 1] != ROW_OPEN))
            fill_gap(f, first, row + 1);
    }
    f->is_stale = false;
    return true;
}

/* The work that is left of these rows if they come as so many bands. */
static double work_of(const struct forecast *f, uint32_t first_row, uint32_t rows, uint32_t bands)
{
    double work = 0, looks = 0;
    uint32_t open = 0;
    for (uint32_t row = first_row; row < first_row + rows; row++) {
        bool is_open = f->states[row] == ROW_OPEN;
        work += is_open ? f->ahead[row] : 0;
        looks += is_open ? f->ahead_looks[row] : 0;
        open += is_open;
    }
    return open > 0 ? work + looks * EDGE_ROWS * bands / open : 0;
}

/* Of a band that several have, the first to be done counts. */
static double longest_hand(struct forecast *f, const struct forecast_hand *hands, size_t count)
{
    double longest = 0;
    for (size_t i = 0; i < count; i++)
        f->soonest[hands[i].first_row] = INFINITY;
    for (size_t i = 0; i < count; i++) {
        double left = fmax(work_of(f, hands[i].first_row, hands[i].rows, 1) - hands[i].spent, 0);
        f->soonest[hands[i].first_row] = fmin(f->soonest[hands[i].first_row], left / hands[i].power);
    }
    for (size_t i = 0; i < count; i++)
        longest = fmax(longest, f->soonest[hands[i].first_row]);
    return longest;
}

double forecast_time(struct forecast *f, const struct forecast_hand *hands, size_t count, uint32_t bands, double power)
{
    if (!look_ahead(f))
        return -1;
    double work = work_of(f, 0, f->rows, bands + (uint32_t)count);
    for (size_t i = 0; i < count; i++)
        work -= fmin(hands[i].spent, work_of(f, hands[i].first_row, hands[i].rows, 1));
    return fmax(fmax(work, 0) / power, longest_hand(f, hands, count));
}

const double *forecast_sums(struct forecast *f)
{
    uint32_t done = f->known_rows + f->unknown_rows;
    if (f->summed_rows > 0 && done - f->summed_rows < share_of(f, SUMMED_SHARE, 1))
        return f->sums;
    if (!look_ahead(f))
        return NULL;
    for (uint32_t row = 0; row < f->rows; row++)
        f->sums[row + 1] = f->sums[row] + (f->states[row] == ROW_OPEN ? f->ahead[row] : 0);
    f->summed_rows = done;
    return f->sums;
}
