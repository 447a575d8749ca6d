/* Areas of an image: which of their pixels get how many samples. */
#include <assert.h>
#include <string.h>

#include "trace/tracer_private.h"

/* Puts the area in work, with `margin` pixels around it. Pixels beyond the image's edges can be looked at as well: what
 * crosses the outermost pixels of the image may be seen only there. Left of and above the image their places are
 * negative, modulo 2^32. */
static struct pixel_grid add_area(struct tracer *tracer, const struct pixel_area *area, uint32_t margin)
{
    struct pixel_grid grid = {area->x0 - margin, area->y0 - margin, area->x1 - area->x0 + 2 * margin,
                              area->y1 - area->y0 + 2 * margin, 0};
    tracer_add_grid(tracer, &grid);
    return grid;
}

static uint32_t pixel_at(const struct pixel_grid *grid, uint32_t x, uint32_t y)
{
    return grid->first + (x - grid->x) * grid->rows + y - grid->y;
}

enum { LIST_ROWS = 4 };

/* Lists the grid's pixels but for a margin, by LIST_ROWS rows at a time and down each column of these: so rays in a row
 * stay near one another in both directions. Returns how many. */
static size_t list_within(const struct pixel_grid *grid, uint32_t margin, uint32_t *list)
{
    size_t count = 0;
    uint32_t columns = grid->columns - margin, rows = grid->rows - margin;
    for (uint32_t top = margin; top < rows; top += LIST_ROWS)
        for (uint32_t column = margin; column < columns; column++)
            for (uint32_t row = top; row < rows && row < top + LIST_ROWS; row++)
                list[count++] = grid->first + column * grid->rows + row;
    return count;
}

/* --- how far first samples lie apart ---------------------------------------------------------------------- */

static float least(float a, float b)
{
    return a < b ? a : b;
}

/* Of each pixel of the grid, the least value of it and those above and below. */
static void spread_down(const struct pixel_grid *grid, const float *from, float *to)
{
    uint32_t last = grid->rows - 1;
    for (uint32_t column = 0; column < grid->columns; column++, from += grid->rows, to += grid->rows) {
        to[0] = least(from[0], from[last > 0 ? 1 : 0]);
        for (uint32_t row = 1; row < last; row++)
            to[row] = least(least(from[row - 1], from[row]), from[row + 1]);
        to[last] = least(from[last > 0 ? last - 1 : 0], from[last]);
    }
}

/* And of those left and right. */
static void spread_across(const struct pixel_grid *grid, const float *from, float *to)
{
    uint32_t rows = grid->rows;
    for (uint32_t column = 0; column < grid->columns; column++, from += rows, to += rows) {
        const float *left = column > 0 ? from - rows : from;
        const float *right = column + 1 < grid->columns ? from + rows : from;
        for (uint32_t row = 0; row < rows; row++)
            to[row] = least(least(left[row], from[row]), right[row]);
    }
}

/* Greatest less least: low + negative is least − greatest. */
static void find_range(const struct pixel_grid *grid, const float *low, const float *negative, float *range)
{
    for (uint32_t i = 0; i < grid->columns * grid->rows; i++)
        range[i] = -(low[i] + negative[i]);
}

static_assert(SAMPLING_REACH == 2, "what is near lies within 3×3 pixels, what is wide within 5×5");

/* bound[c] is the least root of channel c, bound[3 + c] the least of the negative roots: of the pixel's first sample,
 * after one spreading of the 3×3 around it, after two of the 5×5. */
static void find_ranges(struct tracer *tracer, const struct pixel_grid *grid)
{
    float *bound[6];
    for (int i = 0; i < 6; i++)
        bound[i] = tracer->bound[i] + grid->first;
    for (uint32_t i = 0; i < grid->columns * grid->rows; i++) {
        struct vec3 roots = tracer->work[grid->first + i].sums.roots;
        const float root[3] = {(float)roots.x, (float)roots.y, (float)roots.z};
        for (int c = 0; c < 3; c++) {
            bound[c][i] = root[c];
            bound[3 + c][i] = -root[c];
        }
    }
    for (int distance = 1; distance <= SAMPLING_REACH; distance++) {
        for (int i = 0; i < 6; i++) {
            spread_down(grid, bound[i], tracer->scratch);
            spread_across(grid, tracer->scratch, bound[i]);
        }
        for (int c = 0; c < 3; c++)
            find_range(grid, bound[c], bound[3 + c], (distance == 1 ? tracer->near : tracer->wide)[c] + grid->first);
    }
}

/* Takes one sample of each pixel of the grids and finds their ranges. */
static void look(struct tracer *tracer, const struct pixel_grid *grids, size_t count)
{
    size_t listed = 0;
    for (size_t i = 0; i < count; i++)
        listed += list_within(&grids[i], 0, tracer->list + listed);
    tracer_sample(tracer, tracer->list, listed, 0, 1, true);
    for (size_t i = 0; i < count; i++)
        find_ranges(tracer, &grids[i]);
}

static struct vec3 channels_of(float *const values[3], uint32_t pixel)
{
    return vec3_make(values[0][pixel], values[1][pixel], values[2][pixel]);
}

/* --- stages ----------------------------------------------------------------------------------------------- */

/* As if the pixels had no samples yet. */
static void drop_samples(struct tracer *tracer, const uint32_t *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct pixel_work *work = &tracer->work[list[i]];
        work->sums = (struct pixel_sums){0};
        work->samples = 0;
    }
}

/* Brings pixels from the stage before to this one. */
static void advance(struct tracer *tracer, const uint32_t *list, size_t count, uint32_t stage)
{
    if (stage == 1) /* the first look, at the pixel's middle, counts only for pixels that get no other sample */
        drop_samples(tracer, list, count);
    tracer_sample(tracer, list, count, stage == 1 ? 0 : sampling_stage(stage - 1), sampling_stage(stage), true);
}

static uint32_t measure(const struct tracer *tracer, uint32_t pixel)
{
    const struct pixel_work *work = &tracer->work[pixel];
    struct vec3 near = channels_of(tracer->near, pixel);
    if (work->samples == 1)
        return sampling_first_measure(near, channels_of(tracer->wide, pixel));
    return sampling_measure(&work->sums, work->samples, near);
}

/* Of the pixels listed, all at one stage, keeps those that are to go on. */
static size_t keep_open(const struct tracer *tracer, const struct sampling *sampling, uint32_t *list, size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (tracer->work[list[i]].samples < sampling->least || measure(tracer, list[i]) < sampling->threshold)
            list[kept++] = list[i];
    return kept;
}

static void sample_adaptively(struct tracer *tracer, const struct sampling *sampling, const struct pixel_grid *grid)
{
    look(tracer, grid, 1);
    uint32_t *list = tracer->list;
    size_t count = list_within(grid, SAMPLING_REACH, list);
    for (uint32_t stage = 1; stage < SAMPLING_STAGES && sampling_stage(stage) <= sampling->most; stage++) {
        count = keep_open(tracer, sampling, list, count);
        advance(tracer, list, count, stage);
    }
}

/* --- results ---------------------------------------------------------------------------------------------- */

static double error_of(const struct tracer *tracer, uint32_t pixel, bool has_near)
{
    const struct pixel_work *work = &tracer->work[pixel];
    if (work->samples > 1)
        return sampling_error(&work->sums, work->samples);
    return has_near ? sampling_first_error(channels_of(tracer->near, pixel)) : 0;
}

static void add_counts(struct ray_counts *counts, const struct pixel_work *work)
{
    counts->camera += work->camera;
    counts->secondary += work->secondary;
    counts->shadow += work->shadow;
}

static struct vec3 mean_of(const struct pixel_work *work)
{
    double samples = work->samples;
    struct vec3 sum = work->sums.light;
    return vec3_make(sum.x / samples, sum.y / samples, sum.z / samples);
}

static void take_results(const struct tracer *tracer, const struct pixel_grid *grid, const struct pixel_area *area,
                         bool has_near, struct pixel *pixels, struct ray_counts *counts)
{
    for (uint32_t y = area->y0; y < area->y1; y++)
        for (uint32_t x = area->x0; x < area->x1; x++) {
            uint32_t pixel = pixel_at(grid, x, y);
            const struct pixel_work *work = &tracer->work[pixel];
            *pixels++ = (struct pixel){mean_of(work), error_of(tracer, pixel, has_near), work->samples};
            add_counts(&counts[y - area->y0], work);
        }
}

void tracer_area(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *area,
                 struct pixel *pixels, struct ray_counts *counts)
{
    bool fixed = sampling_is_fixed(sampling);
    tracer->pixels = 0;
    struct pixel_grid grid = add_area(tracer, area, fixed ? 0 : SAMPLING_REACH);
    if (fixed)
        tracer_sample(tracer, tracer->list, list_within(&grid, 0, tracer->list), 0, sampling->most, false);
    else
        sample_adaptively(tracer, sampling, &grid);
    take_results(tracer, &grid, area, !fixed, pixels, counts);
}

/* --- histories -------------------------------------------------------------------------------------------- */

/* Of the samples, one for each trial: see sample.h. */
static const uint32_t salts[HISTORY_TRIALS] = {0, 0x632be5abu, 0x85157af5u};

/* The trial's next stage. */
static void note_stage(const struct tracer *tracer, uint32_t pixel, struct pixel_trial *trial)
{
    uint32_t stage = trial->stages++;
    trial->stage[stage].light = mean_of(&tracer->work[pixel]);
    trial->stage[stage].error = error_of(tracer, pixel, true);
    trial->stage[stage].measure = measure(tracer, pixel);
}

/* Of histories[count], lists the pixels that are done with that stage of the trial. */
static size_t list_done(const struct pixel_history *histories, size_t count, uint32_t trial, uint32_t stage,
                        uint32_t *list)
{
    size_t done = 0;
    for (size_t i = 0; i < count; i++)
        if (histories[i].trial[trial].stages == stage + 1)
            list[done++] = histories[i].pixel;
    return done;
}

/* Of an area's pixels at most so many that look uneven are followed, and about so many that look even; each stands for
 * those up to the next of its kind. */
enum { FOLLOWED_UNEVEN = 16, FOLLOWED_EVEN = 3 };

/* Begins the histories of pixels list[count], one area's. Returns how many there are. */
static size_t follow(const struct tracer *tracer, uint32_t even, const uint32_t *list, size_t count,
                     struct pixel_history *histories)
{
    size_t uneven = 0, followed = 0, met[2] = {0}, last[2] = {0};
    for (size_t i = 0; i < count; i++)
        uneven += measure(tracer, list[i]) < even;
    const size_t share[2] = {(uneven + FOLLOWED_UNEVEN - 1) / FOLLOWED_UNEVEN, (count - uneven) / FOLLOWED_EVEN + 1};
    for (size_t i = 0; i < count; i++) {
        bool is_even = measure(tracer, list[i]) >= even;
        if (met[is_even]++ % share[is_even] != 0) {
            histories[last[is_even]].weight++;
            continue;
        }
        last[is_even] = followed;
        histories[followed++] = (struct pixel_history){.pixel = list[i], .weight = 1};
    }
    return followed;
}

/* Begins the histories of areas[count]. Returns how many there are. */
static size_t begin_histories(struct tracer *tracer, uint32_t even, const struct pixel_area *areas, size_t count,
                              struct pixel_history *histories)
{
    struct pixel_grid grids[HISTORY_AREAS_MAX] = {{0}};
    size_t followed = 0;
    tracer->pixels = 0;
    for (size_t i = 0; i < count; i++)
        grids[i] = add_area(tracer, &areas[i], SAMPLING_REACH);
    look(tracer, grids, count);
    for (size_t i = 0; i < count; i++) {
        size_t pixels = list_within(&grids[i], SAMPLING_REACH, tracer->list);
        followed += follow(tracer, even, tracer->list, pixels, histories + followed);
    }
    for (size_t i = 0; i < followed; i++)
        for (uint32_t trial = 0; trial < HISTORY_TRIALS; trial++)
            note_stage(tracer, histories[i].pixel, &histories[i].trial[trial]);
    return followed;
}

/* Those of the histories that are at that stage of the trial and are to go on go on. Returns how many. */
static size_t go_on(struct tracer *tracer, const struct sampling *sampling, uint32_t trial, uint32_t stage,
                    struct pixel_history *histories, size_t count)
{
    size_t open = list_done(histories, count, trial, stage, tracer->list);
    if (stage > 0)
        open = keep_open(tracer, sampling, tracer->list, open);
    advance(tracer, tracer->list, open, stage + 1);
    for (size_t i = 0; i < count; i++)
        if (tracer->work[histories[i].pixel].samples == sampling_stage(stage + 1))
            note_stage(tracer, histories[i].pixel, &histories[i].trial[trial]);
    return open;
}

static void try(struct tracer *tracer, const struct sampling *sampling, uint32_t trial,
                struct pixel_history *histories, size_t count)
{
    size_t open = count;
    for (uint32_t stage = 0; open > 0 && stage + 1 < SAMPLING_STAGES; stage++) {
        if (sampling_stage(stage + 1) > sampling->most)
            break;
        open = go_on(tracer, sampling, trial, stage, histories, count);
    }
}

/* Samples the pixels anew: as many samples as trial 0's last stages have. Their footprints are narrower, or what is
 * filtered too much would be so in what it is compared with; much narrower ones would leave too much to chance. */
static void sample_at_once(struct tracer *tracer, struct pixel_history *histories, size_t count)
{
    tracer->refined = 4;
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        size_t done = list_done(histories, count, 0, stage, tracer->list);
        drop_samples(tracer, tracer->list, done);
        tracer_sample(tracer, tracer->list, done, 0, sampling_stage(stage), false);
    }
    tracer->refined = 1;
}

size_t tracer_histories(struct tracer *tracer, const struct sampling *sampling, uint32_t even,
                        const struct pixel_area *areas, size_t count, struct pixel_history *histories,
                        struct ray_counts *counts)
{
    size_t pixels = begin_histories(tracer, even, areas, count, histories);
    uint32_t trials = tracer->generation.plan->needs_footprints ? 1 : HISTORY_TRIALS;
    for (uint32_t trial = 0; trial < HISTORY_TRIALS; trial++) {
        tracer->salt = salts[trial];
        if (trial < trials)
            try(tracer, sampling, trial, histories, pixels);
        else
            sample_at_once(tracer, histories, pixels);
        for (size_t i = 0; i < pixels; i++)
            histories[i].mean[trial] = mean_of(&tracer->work[histories[i].pixel]);
    }
    tracer->salt = 0;
    for (size_t i = 0; i < pixels; i++)
        histories[i].trials = trials;
    for (size_t i = 0; i < tracer->pixels; i++)
        add_counts(counts, &tracer->work[i]);
    return pixels;
}
