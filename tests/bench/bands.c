/* What bands cost: bands WIDTH ERROR SCENE... works on each scene in this process, on one thread, as workers would: its
 * survey, a row of cells at a time, and its render by bands. ERROR is the RMSE to be met, or 0: 4 samples a pixel,
 * without a survey. For tests/unit/forecast_recorded.c, whose recordings it prints.
 *
 * A scene is three lines. The first: its name, width, height, rows of a cell of the survey (0: there is none). The
 * second: of each row of cells microseconds:samples, what the survey took, and how many a pixel it expects of the
 * render. The third: of each band of the render, from the top, rows:microseconds:samples. Times are the least of
 * several runs. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "coordinator/forecast.h"
#include "tests/bench/bench.h"
#include "worker/band.h"

enum { BAND_ROWS = 8, RUNS_MIN = 2, RUNS_MAX = 6, FIXED_SAMPLES = 4, SAMPLES_MOST = 1024 };
#define SAME 1.05 /* when the best two runs of a band differ by no more, they are believed */

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
    double least = INFINITY, second = INFINITY;
    for (int run = 0; run < RUNS_MIN || (run < RUNS_MAX && second > SAME * least); run++) {
        work_on(recording, order, cost);
        second = fmin(second, fmax(least, cost->seconds));
        least = fmin(least, cost->seconds);
    }
    cost->seconds = least;
}

/* --- surveys -------------------------------------------------------------------------------------------------- */

/* The sampling of the render that it finds. */
static struct sampling record_survey(const struct recording *recording, const struct survey_grid *grid)
{
    struct survey *all = memory_array(1, sizeof *all);
    struct cost *costs = memory_array(grid->down, sizeof *costs);
    struct order order = {PASS_SURVEY, 0, 1, survey_sampling(SAMPLES_MOST, recording->error)};
    for (; order.first_row < grid->down; order.first_row++) {
        measure(recording, &order, &costs[order.first_row]);
        survey_add(all, &costs[order.first_row].survey);
    }
    struct sampling chosen = survey_choose(all, &order.sampling, recording->error);
    for (uint32_t row = 0; row < grid->down; row++)
        printf("%s%.0f:%.4f", row ? " " : "", 1e6 * costs[row].seconds,
               forecast_samples(&costs[row].survey, &chosen));
    free(costs);
    free(all);
    return chosen;
}

/* --- renders -------------------------------------------------------------------------------------------------- */

static void record_render(const struct recording *recording, const struct sampling *sampling)
{
    uint32_t height = recording->settings.height;
    struct cost *cost = memory_array(1, sizeof *cost);
    struct order order = {.pass = PASS_RENDER, .sampling = *sampling};
    for (; order.first_row < height; order.first_row += order.rows) {
        order.rows = BAND_ROWS < height - order.first_row ? BAND_ROWS : height - order.first_row;
        measure(recording, &order, cost);
        printf("%s%" PRIu32 ":%.0f:%" PRIu64, order.first_row ? " " : "", order.rows, 1e6 * cost->seconds,
               cost->samples);
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
