#include "trace/survey.h"

#include <math.h>
#include <stdlib.h>

#include "base/bytes.h"
#include "base/hash.h"

enum {
    BLOCK_SIDE = 4,            /* pixels */
    SURVEYED_PIXELS = 1 << 14, /* about, of a large image, */
    SURVEYED_LEAST = 1 << 11,  /* of a small one: at least so many, as far as it has them, */
    SURVEYED_SHARE = 16,       /* or one in so many */
    SURVEY_SAMPLES_MAX = 16,   /* of a pixel; what more of them would give is extrapolated, */
    SURVEY_SAMPLES_DEEP = 64,  /* but in one cell of */
    SURVEY_CELLS_DEEP = 8,
};

/* Renders aim a little below the error that they must meet: surveys are off by as much. */
#define AIM 0.8

/* A pixel whose error may be so small a share of what is asked for is known well enough. */
#define FINEST_SHARE 0.1

struct survey_grid survey_grid(uint32_t width, uint32_t height)
{
    uint64_t pixels = (uint64_t)width * height, surveyed = pixels / SURVEYED_SHARE;
    uint32_t side = BLOCK_SIDE;
    surveyed = surveyed > SURVEYED_PIXELS ? SURVEYED_PIXELS : surveyed;
    surveyed = surveyed < SURVEYED_LEAST ? SURVEYED_LEAST : surveyed;
    while (surveyed * side * side < pixels * BLOCK_SIDE * BLOCK_SIDE)
        side++;
    return (struct survey_grid){width, height, side, (width + side - 1) / side, (height + side - 1) / side};
}

/* Where in a stretch of `length` pixels a block lies, and how long it is. */
static uint32_t block_length(uint32_t length)
{
    return length < BLOCK_SIDE ? length : BLOCK_SIDE;
}

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
    uint32_t threshold = sampling_first_measure(vec3_make(4 * root, 0, 0)) + 2 * SAMPLING_MEASURES_A_DOUBLING;
    threshold = threshold < SAMPLING_THRESHOLDS ? threshold : SAMPLING_THRESHOLDS - 1;
    return (struct sampling){1, most, threshold};
}

/* --- noting ----------------------------------------------------------------------------------------------- */

static int64_t in_units(double error)
{
    return (int64_t)(error / PIXEL_ERROR_UNIT);
}

/* The pixel's squared error after `stage`: the product of its differences to two independent means. So it is right on
 * average, for pixels that looked even by luck too, though negative for some. */
static double error_at(const struct pixel_history *history, uint32_t stage)
{
    return sampling_product(history->stage[stage].light, history->reference[0], history->reference[1]);
}

static void add_outcome(struct survey_outcome *to, uint64_t samples, double error, double estimated)
{
    int class = samples > 1;
    to->samples += samples;
    to->error[class] += in_units(error);
    to->estimated[class] += (uint64_t)in_units(estimated);
}

/* Thresholds beyond those that the pixel's stages reach: as if its unevenness stayed what it is, and its error fell as
 * samples^-1.5. */
static void extrapolate(const struct pixel_history *history, const struct sampling *sampling, uint32_t first_stage,
                        uint32_t threshold, struct survey_outcome *outcomes)
{
    uint32_t last = history->stages - 1, measure = history->stage[last].measure, stage = last;
    double error = error_at(history, last), estimated = history->stage[last].error;
    for (; threshold < SAMPLING_THRESHOLDS; threshold++) {
        while ((measure < threshold || stage < first_stage) && stage + 1 < SAMPLING_STAGES &&
               sampling_stage(stage + 1) <= sampling->most) {
            stage++;
            measure += SAMPLING_MEASURES_A_DOUBLING;
            error /= 2 * sqrt(2);
            estimated /= 2 * sqrt(2);
        }
        add_outcome(&outcomes[threshold], sampling_stage(stage), error, estimated);
    }
}

static uint32_t least_stage(uint32_t policy)
{
    return sampling_stage_within(1u << 2 * policy);
}

/* For each threshold, the stage with which the pixel would have been done. */
static void note_policy(const struct pixel_history *history, const struct sampling *sampling, uint32_t first_stage,
                        struct survey_outcome *outcomes)
{
    uint32_t threshold = 0;
    for (uint32_t stage = first_stage; stage < history->stages; stage++) {
        double error = error_at(history, stage);
        for (; threshold <= history->stage[stage].measure && threshold < SAMPLING_THRESHOLDS; threshold++)
            add_outcome(&outcomes[threshold], sampling_stage(stage), error, history->stage[stage].error);
    }
    extrapolate(history, sampling, first_stage, threshold, outcomes);
}

void survey_cell(struct tracer *tracer, const struct sampling *sampling, const struct survey_grid *grid, uint32_t x,
                 uint32_t y, struct survey *survey, struct ray_counts *counts)
{
    struct pixel_history histories[BLOCK_SIDE * BLOCK_SIDE];
    struct pixel_area block = block_of(grid, x, y);
    size_t pixels = (size_t)(block.x1 - block.x0) * (block.y1 - block.y0);
    uint32_t most = (x + 3 * y) % SURVEY_CELLS_DEEP == 0 ? SURVEY_SAMPLES_DEEP : SURVEY_SAMPLES_MAX;
    struct sampling limited = *sampling;
    limited.most = limited.most > most ? most : limited.most;
    struct ray_counts taken = {0};
    tracer_histories(tracer, &limited, &block, histories, &taken);
    survey->pixels += pixels;
    survey->rays += taken.camera + taken.secondary + taken.shadow;
    counts->camera += taken.camera;
    counts->secondary += taken.secondary;
    counts->shadow += taken.shadow;
    for (size_t i = 0; i < pixels; i++)
        for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++)
            note_policy(&histories[i], sampling, least_stage(policy), survey->policy[policy]);
}

/* --- sums ------------------------------------------------------------------------------------------------- */

void survey_add(struct survey *to, const struct survey *from)
{
    to->pixels += from->pixels;
    to->rays += from->rays;
    for (size_t policy = 0; policy < SURVEY_POLICIES; policy++)
        for (size_t i = 0; i < SAMPLING_THRESHOLDS; i++) {
            struct survey_outcome *sum = &to->policy[policy][i];
            const struct survey_outcome *more = &from->policy[policy][i];
            sum->samples += more->samples;
            for (int class = 0; class < 2; class++) {
                sum->error[class] += more->error[class];
                sum->estimated[class] += more->estimated[class];
            }
        }
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
            const struct survey_outcome *from = &survey->policy[policy][i];
            put(&bytes, from->samples);
            put(&bytes, (uint64_t)from->error[0]);
            put(&bytes, (uint64_t)from->error[1]);
            put(&bytes, from->estimated[0]);
            put(&bytes, from->estimated[1]);
        }
}

void survey_read(struct survey *survey, const uint8_t *bytes)
{
    struct byte_reader reader = byte_reader_of(bytes, SURVEY_BYTES);
    survey->pixels = byte_reader_u64(&reader);
    survey->rays = byte_reader_u64(&reader);
    for (size_t policy = 0; policy < SURVEY_POLICIES; policy++)
        for (size_t i = 0; i < SAMPLING_THRESHOLDS; i++) {
            struct survey_outcome *to = &survey->policy[policy][i];
            to->samples = byte_reader_u64(&reader);
            to->error[0] = (int64_t)byte_reader_u64(&reader);
            to->error[1] = (int64_t)byte_reader_u64(&reader);
            to->estimated[0] = byte_reader_u64(&reader);
            to->estimated[1] = byte_reader_u64(&reader);
        }
}

/* --- conclusions ------------------------------------------------------------------------------------------ */

struct sampling survey_choose(const struct survey *survey, const struct sampling *surveyed, double error)
{
    struct sampling chosen = {surveyed->most < 64 ? surveyed->most : 64, surveyed->most, surveyed->threshold};
    uint64_t samples = UINT64_MAX;
    double most = AIM * AIM * error * error / PIXEL_ERROR_UNIT * (double)survey->pixels;
    for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++) {
        uint32_t least = sampling_stage(least_stage(policy));
        for (uint32_t threshold = 0; threshold <= surveyed->threshold && least <= surveyed->most; threshold++) {
            const struct survey_outcome *outcome = &survey->policy[policy][threshold];
            if ((double)outcome->error[0] + (double)outcome->error[1] > most || outcome->samples >= samples)
                continue;
            samples = outcome->samples;
            chosen.least = least;
            chosen.threshold = threshold;
        }
    }
    return chosen;
}

/* No pixel goes on at threshold 0. */
double survey_error_of_one(const struct survey *survey)
{
    double sum = (double)survey->policy[0][0].error[0];
    return sum > 0 ? sqrt(sum * PIXEL_ERROR_UNIT / (double)survey->pixels) : 0;
}

double survey_error(const struct survey *survey, const struct sampling *sampling, uint64_t pixels,
                    const uint64_t estimated[2])
{
    uint32_t policy = 0;
    while (policy + 1 < SURVEY_POLICIES && sampling_stage(least_stage(policy)) < sampling->least)
        policy++;
    const struct survey_outcome *outcome = &survey->policy[policy][sampling->threshold];
    double sum = 0;
    for (int class = 0; class < 2; class++) {
        double error = (double)outcome->error[class];
        if (outcome->estimated[class] > 0)
            sum += (double)estimated[class] * (error / (double)outcome->estimated[class]);
        else
            sum += error * ((double)pixels / (double)survey->pixels);
    }
    return sum > 0 ? sqrt(sum * PIXEL_ERROR_UNIT / (double)pixels) : 0;
}
