#include "trace/survey.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "base/bytes.h"
#include "base/hash.h"
#include "base/memory.h"

static_assert((int)SURVEY_RUN <= (int)HISTORY_AREAS_MAX, "a run is traced together");

/* Cells have sides of CELL_SIDE, but there are at least about CELLS_LEAST, as far as blocks have room in them, and at most
 * CELLS_MOST. Pixels that are followed get up to SURVEY_SAMPLES_MAX samples, in one cell of SURVEY_CELLS_DEEP up to
 * SURVEY_SAMPLES_DEEP; what more of them would give is extrapolated. Of forty scenes at 256×160 for 0.005, with blocks of 4×4
 * one in nine was off by more than that, the worst 1.6 times; with 6×6 one in sixteen, the worst 1.1 times. */
enum {
    BLOCK_SIDE = 6, /* pixels */
    CELL_SIDE = 16,
    CELLS_LEAST = 128,
    CELLS_MOST = 1024,
    SURVEY_SAMPLES_MAX = 16,
    SURVEY_SAMPLES_DEEP = 64,
    SURVEY_CELLS_DEEP = 8,
};

/* Renders aim a little below the error that they must meet: surveys are off by as much. */
#define AIM 0.8

/* Pixels may have to be so small a share off of what is asked for, where all are uneven. They are followed to so many
 * measures less, two doublings of that share: where few are uneven no finer threshold is chosen, and surveys would take
 * half as long again. */
#define FINEST_SHARE 0.1
enum { FOLLOWED_LESS = 16 };

/* With twice the samples a pixel's squared error is so much of what it was: 0.35 where one edge crosses it
 * (samples^-1.5), nearer 0.5 where much lies within it. */
#define FALL 0.4

/* Pixels whose first measures are at most so much below those that are followed hardly matter: few are followed. The
 * roots of such a pixel and its neighbours may lie apart by 23 times the error that is asked for. Following all of
 * them, surveys came to the same and took up to twice as long. */
enum { LOOKS_EVEN = 40 };

struct survey_grid survey_grid(uint32_t width, uint32_t height)
{
    uint64_t pixels = (uint64_t)width * height, cells = pixels / (CELL_SIDE * CELL_SIDE);
    uint32_t side = BLOCK_SIDE;
    cells = cells > CELLS_MOST ? CELLS_MOST : cells;
    cells = cells < CELLS_LEAST ? CELLS_LEAST : cells;
    while (cells * side * side < pixels)
        side++;
    return (struct survey_grid){width, height, side, (width + side - 1) / side, (height + side - 1) / side};
}

/* How long a block is in a stretch of `length` pixels. */
static uint32_t block_length(uint32_t length)
{
    return length < BLOCK_SIDE ? length : BLOCK_SIDE;
}

/* The block of a cell: where in it is hashed from the cell's place. */
static struct pixel_area block_of(const struct survey_grid *grid, uint32_t x, uint32_t y)
{
    uint32_t left = x * grid->side, top = y * grid->side, hash = hash_u32(x + hash_u32(y + 0x7f4a7c15u));
    uint32_t wide = grid->width - left < grid->side ? grid->width - left : grid->side;
    uint32_t high = grid->height - top < grid->side ? grid->height - top : grid->side;
    uint32_t columns = block_length(wide), rows = block_length(high);
    left += (hash & 0xffff) % (wide - columns + 1);
    top += (hash >> 16) % (high - rows + 1);
    return (struct pixel_area){left, left + columns, top, top + rows};
}

struct sampling survey_sampling(uint32_t most, double error)
{
    double root = 3 * FINEST_SHARE * error; /* with an unevenness of its square, 4 samples are off by a third of it */
    uint32_t threshold = sampling_first_measure(vec3_make(4 * root, 0, 0), vec3_make(0, 0, 0));
    threshold += 2 * SAMPLING_MEASURES_A_DOUBLING;
    threshold = threshold < SAMPLING_THRESHOLDS ? threshold : SAMPLING_THRESHOLDS - 1;
    return (struct sampling){1, most, threshold};
}

/* --- noting ----------------------------------------------------------------------------------------------- */

static int64_t in_units(double error)
{
    return (int64_t)(error / PIXEL_ERROR_UNIT);
}

/* The pixel's squared error after `stage` of the trial: the product of its differences to two independent means. So it
 * is right on average, for pixels that looked even by luck too, though negative for some. */
static double error_at(const struct pixel_history *history, uint32_t trial, uint32_t stage)
{
    return sampling_product(history->trial[trial].stage[stage].light, history->mean[(trial + 1) % HISTORY_TRIALS],
                            history->mean[(trial + 2) % HISTORY_TRIALS]);
}

static struct survey_outcome outcome_of(uint32_t samples, double error, double estimated)
{
    struct survey_outcome outcome = {.samples = samples};
    int class = samples > 1;
    outcome.error[class] = in_units(error);
    outcome.estimated[class] = in_units(estimated);
    return outcome;
}

/* Modulo 2^64: what comes from another process may be anything. */
static void add_times(int64_t *sum, int64_t number, int times)
{
    *sum = (int64_t)((uint64_t)*sum + (uint64_t)times * (uint64_t)number);
}

static void add_outcome(struct survey_outcome *to, const struct survey_outcome *more, int times)
{
    add_times(&to->samples, more->samples, times);
    for (int class = 0; class < 2; class++) {
        add_times(&to->error[class], more->error[class], times);
        add_times(&to->estimated[class], more->estimated[class], times);
    }
}

static uint32_t least_stage(uint32_t policy)
{
    return sampling_stage_within(1u << 2 * policy);
}

/* For each threshold, the stage of the trial with which the pixel would have been done, from `first_stage` on. Beyond the stages
 * that it went through it is as if its unevenness stayed what it was, and its error fell by FALL. */
static void note_policy(const struct pixel_history *history, uint32_t trial, const struct sampling *sampling,
                        uint32_t first_stage, struct survey_outcome *steps)
{
    const struct pixel_trial *tried = &history->trial[trial];
    struct survey_outcome before = {0};
    uint32_t threshold = 0; /* the first that is not noted yet */
    double fall = 1;
    for (uint32_t stage = 0; threshold < SAMPLING_THRESHOLDS; stage++) {
        uint32_t known = stage < tried->stages ? stage : tried->stages - 1;
        uint32_t measure = tried->stage[known].measure + (stage - known) * SAMPLING_MEASURES_A_DOUBLING;
        bool is_last = stage + 1 == SAMPLING_STAGES || sampling_stage(stage + 1) > sampling->most;
        fall *= stage > known ? FALL : 1;
        if ((stage < first_stage || measure < threshold) && !is_last)
            continue;
        struct survey_outcome outcome = outcome_of(sampling_stage(stage), error_at(history, trial, known) * fall,
                                                   tried->stage[known].error * fall);
        add_outcome(&steps[threshold], &outcome, (int)history->weight);
        add_outcome(&steps[threshold], &before, -(int)history->weight);
        before = outcome;
        threshold = is_last ? SAMPLING_THRESHOLDS : measure + 1;
    }
}

/* Surveys `count` blocks, at least one, with at most so many samples a pixel. */
static void survey_blocks(struct tracer *tracer, const struct sampling *sampling, uint32_t most,
                          const struct pixel_area *blocks, size_t count, struct survey *survey,
                          struct ray_counts *counts)
{
    struct pixel_history *histories = memory_array(count * BLOCK_SIDE * BLOCK_SIDE, sizeof *histories);
    struct sampling limited = *sampling;
    limited.threshold -= limited.threshold < FOLLOWED_LESS ? limited.threshold : FOLLOWED_LESS;
    uint32_t even = limited.threshold > LOOKS_EVEN ? limited.threshold - LOOKS_EVEN : 0;
    limited.most = limited.most > most ? most : limited.most;
    size_t pixels = tracer_histories(tracer, &limited, even, blocks, count, histories, counts);
    for (size_t i = 0; i < pixels; i++) {
        const struct pixel_history *history = &histories[i];
        survey->pixels += (uint64_t)history->trials * history->weight;
        for (uint32_t trial = 0; trial < history->trials; trial++)
            for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++)
                note_policy(history, trial, sampling, least_stage(policy), survey->steps[policy]);
    }
    free(histories);
}

static bool is_deep(uint32_t x, uint32_t y)
{
    return (x + 3 * y) % SURVEY_CELLS_DEEP == 0;
}

/* Cells x .. x + count − 1 of row y, count <= SURVEY_RUN. */
static void survey_run(struct tracer *tracer, const struct sampling *sampling, const struct survey_grid *grid,
                       uint32_t x, uint32_t count, uint32_t y, struct survey *survey, struct ray_counts *counts)
{
    for (int deep = 0; deep <= 1; deep++) {
        struct pixel_area blocks[SURVEY_RUN];
        size_t found = 0;
        for (uint32_t i = 0; i < count; i++)
            if (is_deep(x + i, y) == deep)
                blocks[found++] = block_of(grid, x + i, y);
        uint32_t most = deep ? SURVEY_SAMPLES_DEEP : SURVEY_SAMPLES_MAX;
        if (found > 0)
            survey_blocks(tracer, sampling, most, blocks, found, survey, counts);
    }
}

void survey_cells(struct tracer *tracer, const struct sampling *sampling, const struct survey_grid *grid,
                  uint32_t x, uint32_t count, uint32_t y, struct survey *survey, struct ray_counts *counts)
{
    struct ray_counts taken = {0};
    for (uint32_t first = 0; first < count; first += SURVEY_RUN) {
        uint32_t left = count - first;
        survey_run(tracer, sampling, grid, x + first, left < SURVEY_RUN ? left : SURVEY_RUN, y, survey, &taken);
    }
    survey->rays += taken.camera + taken.secondary + taken.shadow;
    counts->camera += taken.camera;
    counts->secondary += taken.secondary;
    counts->shadow += taken.shadow;
}

/* --- sums ------------------------------------------------------------------------------------------------- */

void survey_add(struct survey *to, const struct survey *from)
{
    to->pixels += from->pixels;
    to->rays += from->rays;
    for (size_t policy = 0; policy < SURVEY_POLICIES; policy++)
        for (size_t i = 0; i < SAMPLING_THRESHOLDS; i++)
            add_outcome(&to->steps[policy][i], &from->steps[policy][i], 1);
}

static void put(uint8_t **bytes, uint64_t number)
{
    for (int i = 0; i < 8; i++)
        *(*bytes)++ = (uint8_t)(number >> 8 * i);
}

void survey_write(const struct survey *survey, uint8_t *bytes)
{
    put(&bytes, survey->pixels);
    put(&bytes, survey->rays);
    for (size_t policy = 0; policy < SURVEY_POLICIES; policy++)
        for (size_t i = 0; i < SAMPLING_THRESHOLDS; i++) {
            const struct survey_outcome *from = &survey->steps[policy][i];
            put(&bytes, (uint64_t)from->samples);
            for (int class = 0; class < 2; class++)
                put(&bytes, (uint64_t)from->error[class]);
            for (int class = 0; class < 2; class++)
                put(&bytes, (uint64_t)from->estimated[class]);
        }
}

void survey_read(struct survey *survey, const uint8_t *bytes)
{
    struct byte_reader reader = byte_reader_of(bytes, SURVEY_BYTES);
    survey->pixels = byte_reader_u64(&reader);
    survey->rays = byte_reader_u64(&reader);
    for (size_t policy = 0; policy < SURVEY_POLICIES; policy++)
        for (size_t i = 0; i < SAMPLING_THRESHOLDS; i++) {
            struct survey_outcome *to = &survey->steps[policy][i];
            to->samples = (int64_t)byte_reader_u64(&reader);
            for (int class = 0; class < 2; class++)
                to->error[class] = (int64_t)byte_reader_u64(&reader);
            for (int class = 0; class < 2; class++)
                to->estimated[class] = (int64_t)byte_reader_u64(&reader);
        }
}

/* --- conclusions ------------------------------------------------------------------------------------------ */

struct sampling survey_choose(const struct survey *survey, const struct sampling *surveyed, double error)
{
    struct sampling chosen = {surveyed->most < 64 ? surveyed->most : 64, surveyed->most, surveyed->threshold};
    int64_t samples = INT64_MAX;
    double most = AIM * AIM * error * error / PIXEL_ERROR_UNIT * (double)survey->pixels;
    for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++) {
        struct survey_outcome outcome = {0};
        uint32_t least = sampling_stage(least_stage(policy));
        for (uint32_t threshold = 0; threshold <= surveyed->threshold && least <= surveyed->most; threshold++) {
            add_outcome(&outcome, &survey->steps[policy][threshold], 1);
            if ((double)outcome.error[0] + (double)outcome.error[1] > most || outcome.samples >= samples)
                continue;
            samples = outcome.samples;
            chosen.least = least;
            chosen.threshold = threshold;
        }
    }
    return chosen;
}

struct survey_outcome survey_outcome(const struct survey *survey, uint32_t policy, uint32_t threshold)
{
    struct survey_outcome outcome = {0};
    for (uint32_t i = 0; i <= threshold; i++)
        add_outcome(&outcome, &survey->steps[policy][i], 1);
    return outcome;
}

/* No pixel goes on at threshold 0. */
double survey_error_of_one(const struct survey *survey)
{
    double sum = (double)survey_outcome(survey, 0, 0).error[0];
    return sum > 0 ? sqrt(sum * PIXEL_ERROR_UNIT / (double)survey->pixels) : 0;
}

double survey_error(const struct survey *survey, const struct sampling *sampling, uint64_t pixels,
                    const uint64_t estimated[2])
{
    uint32_t policy = 0;
    while (policy + 1 < SURVEY_POLICIES && sampling_stage(least_stage(policy)) < sampling->least)
        policy++;
    struct survey_outcome outcome = survey_outcome(survey, policy, sampling->threshold);
    double sum = 0;
    for (int class = 0; class < 2; class++) {
        double error = (double)outcome.error[class];
        if (outcome.estimated[class] > 0)
            sum += (double)estimated[class] * (error / (double)outcome.estimated[class]);
        else
            sum += error * ((double)pixels / (double)survey->pixels);
    }
    return sum > 0 ? sqrt(sum * PIXEL_ERROR_UNIT / (double)pixels) : 0;
}
