#include "coordinator/forecast.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/sampling.h"

enum {
    KNOWN_SHARE = 32, /* nothing is said as long as the work of less than one row in so many is known; an earlier run's
                       * rows do not count */
    NEAR_SHARE = 64,  /* a share of the rows: so many at most beside a gap tell what it costs there, */
    NEAR_ROWS_MIN = 4,
    FAR_SHARE = 8,    /* and so many beyond the last known one nothing but the mean does */
};

/* First samples are taken of so many rows beyond a band's edges. */
enum { EDGE_ROWS = 2 * SAMPLING_REACH };

enum row_state { ROW_OPEN, ROW_KNOWN, ROW_UNKNOWN }; /* not done; done, with its work, and without */

struct forecast {
    uint32_t rows, cell_rows, cells;
    double *surveyed; /* work of each row of cells */
    uint32_t cells_missing;
    uint8_t *states;  /* of each row of the render: enum row_state */
    double *work;     /* if known: of that row alone, */
    double *looks;    /* and what of it are first samples */
    double *weights;  /* of each row: its cost next to other rows', as far as the survey knows */
    double known_work, known_weight; /* sums over the rows that are known, */
    double known_looks;
    uint32_t known_rows, unknown_rows; /* how many of these states */
    double *ahead, *ahead_looks; /* work and looks expected of each open row; valid unless stale */
    bool is_stale;
};

struct forecast *forecast_create(uint32_t rows, uint32_t cell_rows)
{
    struct forecast *f = memory_array(1, sizeof *f);
    f->rows = rows;
    f->cell_rows = cell_rows;
    f->cells = f->cells_missing = cell_rows > 0 ? (rows + cell_rows - 1) / cell_rows : 0;
    f->surveyed = memory_array(f->cells, sizeof *f->surveyed);
    f->states = memory_array(rows, sizeof *f->states);
    f->work = memory_array(rows, sizeof *f->work);
    f->weights = memory_array(rows, sizeof *f->weights);
    f->looks = memory_array(rows, sizeof *f->looks);
    f->ahead = memory_array(rows, sizeof *f->ahead);
    f->ahead_looks = memory_array(rows, sizeof *f->ahead_looks);
    for (uint32_t row = 0; row < rows; row++)
        f->weights[row] = 1;
    return f;
}

void forecast_destroy(struct forecast **pointer)
{
    struct forecast *f = *pointer;
    if (!f)
        return;
    free(f->surveyed);
    free(f->states);
    free(f->work);
    free(f->weights);
    free(f->looks);
    free(f->ahead);
    free(f->ahead_looks);
    free(f);
    *pointer = NULL;
}

/* --- what is done ----------------------------------------------------------------------------------------- */

/* What a row of the picture took to survey, between the middles of rows of cells in proportion. */
static double surveyed_at(const struct forecast *f, uint32_t row)
{
    double at = fmax((row + 0.5) / f->cell_rows - 0.5, 0);
    uint32_t above = (uint32_t)at, below = above + 1 < f->cells ? above + 1 : f->cells - 1;
    above = above < below ? above : below;
    return f->surveyed[above] + (at - above) * (f->surveyed[below] - f->surveyed[above]);
}

/* Surveys look closer where the picture is uneven, more so than renders do: therefore the share of the mean. Where the
 * survey is an earlier run's, its work is not known, and all rows count alike. */
static void weigh_rows(struct forecast *f)
{
    static const double evened = 0.5;
    double mean = 0;
    for (uint32_t cell = 0; cell < f->cells; cell++)
        mean += f->surveyed[cell] / f->cells;
    for (uint32_t row = 0; mean > 0 && row < f->rows; row++)
        f->weights[row] = surveyed_at(f, row) / mean + evened;
}

static void add_survey(struct forecast *f, uint32_t first_row, uint32_t rows, double work)
{
    for (uint32_t cell = first_row; cell < first_row + rows; cell++)
        f->surveyed[cell] = work / rows;
    f->cells_missing -= rows;
    if (f->cells_missing == 0)
        weigh_rows(f);
}

void forecast_add(struct forecast *f, enum render_pass pass, uint32_t first_row, uint32_t rows, double work,
                  double looks)
{
    if (pass == PASS_SURVEY) {
        add_survey(f, first_row, rows, work);
        return;
    }
    double inner = work / (1 + EDGE_ROWS * looks / rows);
    for (uint32_t row = first_row; row < first_row + rows; row++) {
        f->states[row] = isnan(work) ? ROW_UNKNOWN : ROW_KNOWN;
        f->work[row] = inner / rows;
        f->looks[row] = f->work[row] * looks;
        f->known_weight += isnan(work) ? 0 : f->weights[row];
    }
    *(isnan(work) ? &f->unknown_rows : &f->known_rows) += rows;
    f->known_work += isnan(work) ? 0 : inner;
    f->known_looks += isnan(work) ? 0 : inner * looks;
    f->is_stale = true;
}

/* --- what is to come -------------------------------------------------------------------------------------- */

static uint32_t share_of(const struct forecast *f, uint32_t share, uint32_t least)
{
    return f->rows / share > least ? f->rows / share : least;
}

/* What a row costs, by weight. */
struct rate {
    double work, looks;
};

static struct rate mix(struct rate a, struct rate b, double share_of_b)
{
    return (struct rate){a.work + share_of_b * (b.work - a.work), a.looks + share_of_b * (b.looks - a.looks)};
}

/* That of the known rows next to a gap, from `row` on in that direction (1 or −1; above row 0 it wraps and ends); false:
 * there are none. */
static bool find_nearby(const struct forecast *f, uint32_t row, int direction, struct rate *rate)
{
    double work = 0, looks = 0, weight = 0;
    uint32_t counted = 0, most = share_of(f, NEAR_SHARE, NEAR_ROWS_MIN);
    for (; row < f->rows && f->states[row] != ROW_OPEN && counted < most; row += (uint32_t)direction)
        if (f->states[row] == ROW_KNOWN) {
            work += f->work[row];
            looks += f->looks[row];
            weight += f->weights[row];
            counted++;
        }
    if (counted > 0)
        *rate = (struct rate){work / weight, looks / weight};
    return counted > 0;
}

/* Rows first .. end − 1 are open, those next to them are not. */
static void fill_gap(struct forecast *f, uint32_t first, uint32_t end)
{
    const struct rate mean = {f->known_work / f->known_weight, f->known_looks / f->known_weight};
    struct rate above = mean, below = mean;
    bool has_above = find_nearby(f, first - 1, -1, &above), has_below = find_nearby(f, end, 1, &below);
    double far = share_of(f, FAR_SHARE, 1);
    for (uint32_t row = first; row < end; row++) {
        struct rate rate = mean;
        if (has_above && has_below)
            rate = mix(above, below, (row - first + 0.5) / (end - first));
        else if (has_above)
            rate = mix(above, mean, fmin((row - first) / far, 1));
        else if (has_below)
            rate = mix(below, mean, fmin((end - 1 - row) / far, 1));
        f->ahead[row] = rate.work * f->weights[row];
        f->ahead_looks[row] = rate.looks * f->weights[row];
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

double forecast_time(struct forecast *f, const struct forecast_hand *hands, size_t count, uint32_t bands, double power)
{
    if (!look_ahead(f))
        return -1;
    double work = work_of(f, 0, f->rows, bands + (uint32_t)count);
    for (size_t i = 0; i < count; i++)
        work -= fmin(hands[i].spent, work_of(f, hands[i].first_row, hands[i].rows, 1));
    return fmax(work, 0) / power;
}
