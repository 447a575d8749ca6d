/* Areas of an image: which of their pixels get how many samples. */
#include <string.h>

#include "trace/tracer_private.h"

/* The whole area as a grid, and `margin` pixels around it as far as the image has them. */
static struct pixel_grid grid_of(const struct plan *plan, const struct pixel_area *area, uint32_t margin)
{
    uint32_t x0 = area->x0 > margin ? area->x0 - margin : 0, y0 = area->y0 > margin ? area->y0 - margin : 0;
    uint32_t right = plan->settings.width - area->x1, below = plan->settings.height - area->y1;
    uint32_t x1 = area->x1 + (right < margin ? right : margin), y1 = area->y1 + (below < margin ? below : margin);
    return (struct pixel_grid){x0, y0, x1 - x0, y1 - y0};
}

enum { LIST_ROWS = 4 };

/* Lists the grid's pixels within the area, by LIST_ROWS rows at a time and down each column of these: so rays in a row
 * stay near one another in both directions. Returns how many. */
static size_t list_area(struct tracer *tracer, const struct pixel_area *area)
{
    const struct pixel_grid *grid = &tracer->grid;
    uint32_t x0 = area->x0 - grid->x, x1 = area->x1 - grid->x, y0 = area->y0 - grid->y, y1 = area->y1 - grid->y;
    size_t count = 0;
    for (uint32_t top = y0; top < y1; top += LIST_ROWS)
        for (uint32_t x = x0; x < x1; x++)
            for (uint32_t y = top; y < y1 && y < top + LIST_ROWS; y++)
                tracer->list[count++] = x * grid->rows + y;
    return count;
}

/* --- how far first samples lie apart ---------------------------------------------------------------------- */

static struct vec3 vec3_lower(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z);
}

static struct vec3 vec3_higher(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z);
}

/* The least and greatest roots of each pixel and those above and below it. */
static void span_columns(struct tracer *tracer)
{
    uint32_t rows = tracer->grid.rows;
    for (uint32_t pixel = 0; pixel < tracer->grid.columns * rows; pixel++) {
        uint32_t row = pixel % rows;
        struct vec3 low = tracer->work[pixel].sums.roots, high = low;
        if (row > 0) {
            low = vec3_lower(low, tracer->work[pixel - 1].sums.roots);
            high = vec3_higher(high, tracer->work[pixel - 1].sums.roots);
        }
        if (row + 1 < rows) {
            low = vec3_lower(low, tracer->work[pixel + 1].sums.roots);
            high = vec3_higher(high, tracer->work[pixel + 1].sums.roots);
        }
        tracer->low[pixel] = low;
        tracer->high[pixel] = high;
    }
}

/* From those, how far they lie apart over three columns. */
static void span_rows(struct tracer *tracer)
{
    uint32_t rows = tracer->grid.rows, pixels = tracer->grid.columns * rows;
    for (uint32_t pixel = 0; pixel < pixels; pixel++) {
        struct vec3 low = tracer->low[pixel], high = tracer->high[pixel];
        if (pixel >= rows) {
            low = vec3_lower(low, tracer->low[pixel - rows]);
            high = vec3_higher(high, tracer->high[pixel - rows]);
        }
        if (pixel + rows < pixels) {
            low = vec3_lower(low, tracer->low[pixel + rows]);
            high = vec3_higher(high, tracer->high[pixel + rows]);
        }
        tracer->range[pixel] = vec3_sub(high, low);
    }
}

/* Takes one sample of each pixel of the grid and finds their ranges. */
static void look(struct tracer *tracer)
{
    const struct pixel_grid *grid = &tracer->grid;
    struct pixel_area all = {grid->x, grid->x + grid->columns, grid->y, grid->y + grid->rows};
    tracer_sample(tracer, tracer->list, list_area(tracer, &all), 0, 1, true);
    span_columns(tracer);
    span_rows(tracer);
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
    if (stage == 1) /* the first one, at the middle and standing for the whole pixel, serves those alone without others */
        drop_samples(tracer, list, count);
    tracer_sample(tracer, list, count, stage == 1 ? 0 : sampling_stage(stage - 1), sampling_stage(stage), true);
}

static uint32_t measure(const struct tracer *tracer, uint32_t pixel)
{
    const struct pixel_work *work = &tracer->work[pixel];
    struct vec3 range = tracer->range[pixel];
    return work->samples == 1 ? sampling_first_measure(range) : sampling_measure(&work->sums, work->samples, range);
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

static void sample_adaptively(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *area)
{
    look(tracer);
    uint32_t *list = tracer->list;
    size_t count = list_area(tracer, area);
    for (uint32_t stage = 1; stage < SAMPLING_STAGES && sampling_stage(stage) <= sampling->most; stage++) {
        count = keep_open(tracer, sampling, list, count);
        advance(tracer, list, count, stage);
    }
}

/* --- results ---------------------------------------------------------------------------------------------- */

static double error_of(const struct tracer *tracer, uint32_t pixel, bool has_range)
{
    const struct pixel_work *work = &tracer->work[pixel];
    if (work->samples > 1)
        return sampling_error(&work->sums, work->samples);
    return has_range ? sampling_first_error(tracer->range[pixel]) : 0;
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

static uint32_t pixel_at(const struct pixel_grid *grid, uint32_t x, uint32_t y)
{
    return (x - grid->x) * grid->rows + y - grid->y;
}

static void take_results(const struct tracer *tracer, const struct pixel_area *area, bool has_range,
                         struct pixel *pixels, struct ray_counts *counts)
{
    for (uint32_t y = area->y0; y < area->y1; y++)
        for (uint32_t x = area->x0; x < area->x1; x++) {
            uint32_t pixel = pixel_at(&tracer->grid, x, y);
            const struct pixel_work *work = &tracer->work[pixel];
            *pixels++ = (struct pixel){mean_of(work), error_of(tracer, pixel, has_range), work->samples};
            add_counts(&counts[y - area->y0], work);
        }
}

void tracer_area(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *area,
                 struct pixel *pixels, struct ray_counts *counts)
{
    bool fixed = sampling_is_fixed(sampling);
    struct pixel_grid grid = grid_of(tracer->generation.plan, area, fixed ? 0 : 1);
    tracer_set_grid(tracer, &grid);
    if (fixed)
        tracer_sample(tracer, tracer->list, list_area(tracer, area), 0, sampling->most, false);
    else
        sample_adaptively(tracer, sampling, area);
    take_results(tracer, area, !fixed, pixels, counts);
}

/* --- histories -------------------------------------------------------------------------------------------- */

/* The pixel's next stage. */
static void note_stage(const struct tracer *tracer, uint32_t pixel, struct pixel_history *history)
{
    uint32_t stage = history->stages++;
    history->stage[stage].light = mean_of(&tracer->work[pixel]);
    history->stage[stage].error = error_of(tracer, pixel, true);
    history->stage[stage].measure = measure(tracer, pixel);
}

static struct pixel_history *history_of(const struct pixel_grid *grid, const struct pixel_area *area, uint32_t pixel,
                                        struct pixel_history *histories)
{
    uint32_t x = grid->x + pixel / grid->rows, y = grid->y + pixel % grid->rows;
    return &histories[(size_t)(y - area->y0) * (area->x1 - area->x0) + x - area->x0];
}

/* Of the area's pixels, lists those that are done with that stage. */
static size_t list_done(struct tracer *tracer, const struct pixel_area *area, uint32_t samples)
{
    size_t all = list_area(tracer, area), count = 0;
    for (size_t i = 0; i < all; i++)
        if (tracer->work[tracer->list[i]].samples == samples)
            tracer->list[count++] = tracer->list[i];
    return count;
}

/* Samples the pixels anew, independently of all other times: as many samples as their last stages have. */
static void take_reference(struct tracer *tracer, const struct pixel_area *area, int which,
                           struct pixel_history *histories)
{
    tracer->salt = which == 0 ? 0x632be5abu : 0x85157af5u;
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        size_t count = list_done(tracer, area, sampling_stage(stage));
        drop_samples(tracer, tracer->list, count);
        tracer_sample(tracer, tracer->list, count, 0, sampling_stage(stage), false);
        for (size_t i = 0; i < count; i++) {
            uint32_t pixel = tracer->list[i];
            history_of(&tracer->grid, area, pixel, histories)->reference[which] = mean_of(&tracer->work[pixel]);
        }
    }
    tracer->salt = 0;
}

void tracer_histories(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *area,
                      struct pixel_history *histories, struct ray_counts *counts)
{
    struct pixel_grid grid = grid_of(tracer->generation.plan, area, 1);
    tracer_set_grid(tracer, &grid);
    look(tracer);
    size_t count = list_area(tracer, area);
    memset(histories, 0, count * sizeof *histories);
    for (uint32_t stage = 0;; stage++) {
        for (size_t i = 0; i < count; i++)
            note_stage(tracer, tracer->list[i], history_of(&grid, area, tracer->list[i], histories));
        if (stage > 0)
            count = keep_open(tracer, sampling, tracer->list, count);
        if (count == 0 || stage + 1 == SAMPLING_STAGES || sampling_stage(stage + 1) > sampling->most)
            break;
        advance(tracer, tracer->list, count, stage + 1);
    }
    take_reference(tracer, area, 0, histories);
    take_reference(tracer, area, 1, histories);
    count = list_area(tracer, area);
    for (size_t i = 0; i < count; i++)
        add_counts(counts, &tracer->work[tracer->list[i]]);
}
