/* What bands cost: bands WIDTH ERROR SCENE... works on each scene in this process, on one thread, as workers would: its
 * survey, a row of cells at a time, and its render by bands. ERROR is the RMSE to be met, or 0: 4 samples a pixel,
 * without a survey. For tests/unit/forecast_recorded.c, whose recordings it prints.
 *
 * A scene is three lines. The first: its name, width, height, rows of a cell of the survey (0: there is none). The
 * second: microseconds of each row of cells. The third: each band of the render from the top, rows:microseconds:samples,
 * with a * in front if it is a sounding: SOUNDINGS bands of 4 rows are spread over the picture, and between them bands
 * are as high as the scheduler cuts them for THREADS threads. Times are the least of several runs if they are short. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "tests/bench/bench.h"
#include "worker/band.h"

enum { SOUNDINGS = 16, SOUNDING_ROWS = 4, BAND_ROWS_MAX = 32, BAND_ROWS_MIN = 4, THREADS = 8 };
enum { RUNS_MAX = 5, FIXED_SAMPLES = 4, SAMPLES_MOST = 1024 };
#define SECONDS_ENOUGH 0.03 /* of all runs of a band */

struct recording {
    struct job_settings settings;
    struct tracer *tracer;
    double error;
};

struct cost {
    double seconds;
    uint64_t samples; /* camera rays; of a survey 0 */
    struct survey survey;
};

/* One band, from its order to its result. */
static void work_on(const struct recording *recording, const struct order *order, struct cost *cost)
{
    static struct tile_outcome outcome;
    struct band band;
    double start = bench_thread_seconds();
    band_init(&band, &recording->settings, order);
    for (uint32_t tile = 0; tile < band.tiles; tile++) {
        outcome = (struct tile_outcome){0};
        band_work(&band, recording->tracer, tile, &outcome);
        band_add(&band, tile, &outcome);
    }
    struct bytes result = band_complete(&band);
    cost->seconds = bench_thread_seconds() - start;
    cost->samples = 0;
    if (order->pass == PASS_SURVEY)
        survey_read(&cost->survey, result.data);
    for (uint32_t row = 0; order->pass == PASS_RENDER && row < order->rows; row++)
        cost->samples += band.figures[row].samples;
    bytes_finish(&result);
    band_finish(&band);
}

static void measure(const struct recording *recording, const struct order *order, struct cost *cost)
{
    double least = INFINITY, all = 0;
    for (int run = 0; run < RUNS_MAX && all < SECONDS_ENOUGH; run++) {
        work_on(recording, order, cost);
        least = fmin(least, cost->seconds);
        all += cost->seconds;
    }
    cost->seconds = least;
}

/* The sampling of the render that it finds. */
static struct sampling record_survey(const struct recording *recording, const struct survey_grid *grid)
{
    struct survey *all = memory_array(1, sizeof *all);
    struct cost *cost = memory_array(1, sizeof *cost);
    struct order order = {PASS_SURVEY, 0, 1, survey_sampling(SAMPLES_MOST, recording->error)};
    for (; order.first_row < grid->down; order.first_row++) {
        measure(recording, &order, cost);
        survey_add(all, &cost->survey);
        printf("%s%.0f", order.first_row ? " " : "", 1e6 * cost->seconds);
    }
    struct sampling chosen = survey_choose(all, &order.sampling, recording->error);
    free(cost);
    free(all);
    return chosen;
}

/* The band from row `first` on: its rows, and whether it is a sounding. */
static uint32_t cut(uint32_t first, uint32_t height, bool *sounding)
{
    uint32_t next = height, rows = (height - first) / (2 * THREADS);
    *sounding = false;
    for (uint32_t i = SOUNDINGS; i-- > 0;) {
        uint32_t top = (2 * i + 1) * height / (2 * SOUNDINGS);
        next = top >= first ? top : next;
        *sounding |= top == first;
    }
    if (*sounding)
        return SOUNDING_ROWS < height - first ? SOUNDING_ROWS : height - first;
    rows = rows > BAND_ROWS_MAX ? BAND_ROWS_MAX : rows < BAND_ROWS_MIN ? BAND_ROWS_MIN : rows;
    return rows < next - first ? rows : next - first;
}

static void record_render(const struct recording *recording, const struct sampling *sampling)
{
    uint32_t height = recording->settings.height;
    struct cost *cost = memory_array(1, sizeof *cost);
    struct order order = {.pass = PASS_RENDER, .sampling = *sampling};
    for (; order.first_row < height; order.first_row += order.rows) {
        bool sounding;
        order.rows = cut(order.first_row, height, &sounding);
        measure(recording, &order, cost);
        printf("%s%s%" PRIu32 ":%.0f:%" PRIu64, order.first_row ? " " : "", sounding ? "*" : "", order.rows,
               1e6 * cost->seconds, cost->samples);
    }
    free(cost);
}

static void record(const char *path, const struct scene *scene, double error)
{
    struct plan *plan = bench_plan(scene);
    struct recording recording = {{.width = scene->width, .height = scene->height, .filter = (uint8_t)scene->filter},
                                  tracer_create(plan, kernel_default()), error};
    struct survey_grid grid = survey_grid(scene->width, scene->height);
    struct sampling sampling = {FIXED_SAMPLES, FIXED_SAMPLES, 0};
    printf("%s %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", path, scene->width, scene->height, error > 0 ? grid.side : 0);
    if (error > 0)
        sampling = record_survey(&recording, &grid);
    printf("\n");
    record_render(&recording, &sampling);
    printf("\n");
    fflush(stdout);
    tracer_destroy(&recording.tracer);
    plan_destroy(&plan);
}

int main(int argc, char **argv)
{
    struct error error;
    uint32_t width = 0;
    enum status status = bench_width(argc, argv, "bands", &width, &error);
    for (int i = 3; i < argc && status == STATUS_OK; i++) {
        struct scene scene;
        status = bench_load(argv[i], width, 1, &scene, &error);
        if (status != STATUS_OK)
            break;
        record(argv[i], &scene, atof(argv[2]));
        scene_finish(&scene);
    }
    if (status != STATUS_OK)
        fprintf(stderr, "%s\n", error.text);
    return status;
}
