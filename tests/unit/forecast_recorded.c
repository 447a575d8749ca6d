/* Remaining time on recorded renders, whose rows differ in cost up to a hundredfold: small farms replay what their
 * bands took (tests/unit/recordings), and what is forecast on the way is compared with what comes to pass. No clock is
 * read.
 *
 * `forecast_recorded.t FILE WORKERS` prints the figures of one file; with a third argument, of bands from the top. */
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/forecast.h"

enum { BANDS_MAX = 1000, WORKERS_MAX = 64, NAME_BYTES = 256 };

struct recorded_band {
    uint32_t first_row, rows;
    double microseconds;
    uint64_t samples; /* of a render; 0: a survey */
    bool sounding;
};

struct recorded {
    char name[NAME_BYTES];
    uint32_t width, rows, cell_rows;
    struct recorded_band bands[BANDS_MAX]; /* survey, if there was one, then render, each from the top */
    size_t survey_count, count;
};

/* --- reading a recording ---------------------------------------------------------------------------------- */

static void read_survey(struct recorded *recorded, char *line)
{
    uint32_t row = 0;
    for (char *word = strtok(line, " \n"); word; word = strtok(NULL, " \n"), row++)
        recorded->bands[row] = (struct recorded_band){row, 1, strtod(word, NULL), 0, false};
    recorded->survey_count = recorded->count = row;
}

static void read_render(struct recorded *recorded, char *line)
{
    uint32_t row = 0;
    for (char *word = strtok(line, " \n"); word; word = strtok(NULL, " \n")) {
        struct recorded_band *band = &recorded->bands[recorded->count++];
        band->first_row = row;
        band->sounding = *word == '*';
        assert_int_equal(sscanf(word + band->sounding, "%" SCNu32 ":%lf:%" SCNu64, &band->rows, &band->microseconds,
                                &band->samples), 3);
        row += band->rows;
    }
    assert_int_equal(row, recorded->rows);
}

/* The next of the file; false: there is none. */
static bool read_recorded(FILE *file, struct recorded *recorded)
{
    static char line[1 << 16];
    *recorded = (struct recorded){0};
    if (!fgets(line, sizeof line, file))
        return false;
    assert_int_equal(sscanf(line, "%255s %" SCNu32 " %" SCNu32 " %" SCNu32, recorded->name, &recorded->width,
                            &recorded->rows, &recorded->cell_rows), 4);
    assert_non_null(fgets(line, sizeof line, file));
    read_survey(recorded, line);
    assert_non_null(fgets(line, sizeof line, file));
    read_render(recorded, line);
    return true;
}

/* --- replaying it ----------------------------------------------------------------------------------------- */

enum order { FROM_THE_TOP, SOUNDINGS_FIRST };

/* When a band is worked on. */
struct turn {
    const struct recorded_band *band;
    double start, end; /* microseconds */
};

struct replay {
    const struct recorded *recorded;
    int workers;
    struct turn turns[BANDS_MAX]; /* in the order of their starts */
    size_t count;
    double end;
};

/* Gives bands, in this order, to the worker that is free first; `sounding`: only those that are one (1) or are not (0),
 * or all (−1). */
static void run_bands(struct replay *replay, double *free_at, size_t first, size_t end, int sounding)
{
    for (size_t i = first; i < end; i++) {
        const struct recorded_band *band = &replay->recorded->bands[i];
        if (sounding >= 0 && band->sounding != sounding)
            continue;
        int next = 0;
        for (int k = 1; k < replay->workers; k++)
            next = free_at[k] < free_at[next] ? k : next;
        double start = free_at[next];
        free_at[next] = start + band->microseconds;
        replay->turns[replay->count++] = (struct turn){band, start, free_at[next]};
        replay->end = fmax(replay->end, free_at[next]);
    }
}

/* Every second one, those in the middle between them, and so on: so they are spread from the start. */
static void run_soundings(struct replay *replay, double *free_at)
{
    size_t soundings[BANDS_MAX], count = 0;
    for (size_t i = replay->recorded->survey_count; i < replay->recorded->count; i++)
        if (replay->recorded->bands[i].sounding)
            soundings[count++] = i;
    size_t step = 1;
    while (step < count)
        step *= 2;
    for (; step > 1; step /= 2)
        for (size_t i = step / 2 - 1; i < count; i += step)
            run_bands(replay, free_at, soundings[i], soundings[i] + 1, 1);
    run_bands(replay, free_at, soundings[count - 1], soundings[count - 1] + 1, 1);
}

static void replay_init(struct replay *replay, const struct recorded *recorded, int workers, enum order order)
{
    double free_at[WORKERS_MAX] = {0};
    *replay = (struct replay){.recorded = recorded, .workers = workers};
    run_bands(replay, free_at, 0, recorded->survey_count, -1);
    for (int k = 0; k < workers; k++)
        free_at[k] = replay->end;
    if (order == SOUNDINGS_FIRST)
        run_soundings(replay, free_at);
    run_bands(replay, free_at, recorded->survey_count, recorded->count, order == SOUNDINGS_FIRST ? 0 : -1);
}

/* The share of a band's work that first samples are. */
static double looks_of(const struct recorded *recorded, const struct recorded_band *band)
{
    return recorded->cell_rows > 0 ? (double)recorded->width * band->rows / (double)band->samples : 0;
}

/* Tells the forecast of all that is done by then and was not before. */
static void tell(const struct replay *replay, struct forecast *forecast, double before, double now)
{
    for (size_t i = 0; i < replay->count; i++) {
        const struct recorded_band *band = replay->turns[i].band;
        bool surveys = band->samples == 0;
        if (replay->turns[i].end > before && replay->turns[i].end <= now)
            forecast_add(forecast, surveys ? PASS_SURVEY : PASS_RENDER, band->first_row, band->rows,
                         band->microseconds, surveys ? 0 : looks_of(replay->recorded, band));
    }
}

/* What would be shown at that time as remaining, in microseconds; negative: unknown. */
static double remaining_at(const struct replay *replay, struct forecast *forecast, double now)
{
    struct forecast_hand hands[WORKERS_MAX];
    size_t count = 0;
    uint32_t waiting = 0;
    for (size_t i = 0; i < replay->count; i++) {
        const struct turn *turn = &replay->turns[i];
        waiting += turn->start >= now;
        if (turn->start < now && turn->end > now && turn->band->samples > 0)
            hands[count++] = (struct forecast_hand){turn->band->first_row, turn->band->rows, now - turn->start};
    }
    return forecast_time(forecast, hands, count, waiting, replay->workers);
}

/* Near the end, a fifth of what is left is less than a band, and nothing tells what that one will take: the highest is
 * 32 rows of 720. So errors of less than that share of the whole time are none. */
#define GRAIN 0.03

/* How far off, as a share of the truth, remaining time is at worst, from the second tenth on and as soon as anything is
 * said. */
struct verdict {
    double worst, worst_at; /* when: a share of the whole time, */
    double said_at;         /* and so is this: when something was first said */
};

static struct verdict judge(const struct recorded *recorded, int workers, enum order order)
{
    enum { LOOKS = 200 };
    static struct replay replay;
    struct verdict verdict = {.said_at = 1};
    replay_init(&replay, recorded, workers, order);
    struct forecast *forecast = forecast_create(recorded->rows, recorded->cell_rows);
    for (int i = 0; i < LOOKS; i++) {
        double share = (i + 0.5) / LOOKS, now = share * replay.end, left = replay.end - now;
        tell(&replay, forecast, (share - 1.0 / LOOKS) * replay.end, now);
        double said = remaining_at(&replay, forecast, now), off = fabs(said - left);
        verdict.said_at = said >= 0 ? fmin(verdict.said_at, share) : verdict.said_at;
        if (share < 0.1 || said < 0 || off < GRAIN * replay.end || off / left <= verdict.worst)
            continue;
        verdict.worst = off / left;
        verdict.worst_at = share;
    }
    forecast_destroy(&forecast);
    return verdict;
}

/* --- the tests -------------------------------------------------------------------------------------------- */

static const int farms[] = {1, 2, 4}; /* workers */
enum { FARMS = sizeof farms / sizeof *farms };

/* What cannot be within 20 %, and how far off it is: an edge, such as a horizon or a glass's rim, lies between two
 * soundings, 45 rows apart, and on one side of it rows cost many times what they do on the other. */
struct exception {
    const char *scene;
    double worst;
};

static double allowed(const struct exception *exceptions, const char *scene)
{
    for (; exceptions->scene; exceptions++)
        if (strstr(scene, exceptions->scene))
            return exceptions->worst;
    return 0.2;
}

static void check_all(const char *path, const struct exception *exceptions)
{
    static struct recorded recorded;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t scenes = 0;
    for (; read_recorded(file, &recorded); scenes++)
        for (size_t i = 0; i < FARMS; i++) {
            struct verdict verdict = judge(&recorded, farms[i], SOUNDINGS_FIRST);
            if (verdict.worst > allowed(exceptions, recorded.name))
                fail_msg("%s, %d workers: off by %.0f %% at %.0f %%", recorded.name, farms[i], 100 * verdict.worst,
                         100 * verdict.worst_at);
            /* With a survey, which itself takes up to an eighth of these small renders, it has to end before. */
            if (verdict.said_at > (recorded.survey_count > 0 ? 0.2 : 0.1))
                fail_msg("%s, %d workers: nothing said until %.0f %%", recorded.name, farms[i], 100 * verdict.said_at);
        }
    assert_int_equal(scenes, 48);
    fclose(file);
}

static void test_fixed_samples(void **state)
{
    (void)state;
    static const struct exception exceptions[] = {
        {"/background.json", 0.31}, {"/ground.json", 0.39}, {"/mount.nff", 0.35}, {NULL, 0}};
    check_all("tests/unit/recordings/fixed.txt", exceptions);
}

static void test_adaptive_samples(void **state)
{
    (void)state;
    static const struct exception exceptions[] = {
        {"/background.json", 0.29}, {"/glass.json", 0.43},  {"/mesh-file.json", 0.3}, {"/nested-glass.json", 0.55},
        {"/plane.json", 0.22},      {"/gears.nff", 0.25},   {"/showcase.json", 0.4},  {NULL, 0}};
    check_all("tests/unit/recordings/adaptive.txt", exceptions);
}

/* Bands that come from the top tell nothing of what is below; a survey tells something. Stated is what it comes to: the
 * mean over the scenes of how far off it is at worst. */
static double mean_from_the_top(const char *path)
{
    static struct recorded recorded;
    double sum = 0;
    size_t scenes = 0;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    for (; read_recorded(file, &recorded); scenes++)
        sum += judge(&recorded, 1, FROM_THE_TOP).worst;
    fclose(file);
    return sum / (double)scenes;
}

static void test_from_the_top(void **state)
{
    (void)state;
    double adaptive = mean_from_the_top("tests/unit/recordings/adaptive.txt");
    double fixed = mean_from_the_top("tests/unit/recordings/fixed.txt");
    print_message("# from the top, remaining time is off by %.2f with a survey, by %.2f without\n", adaptive, fixed);
    assert_true(adaptive < 0.9);
    assert_true(fixed < 1.8);
}

/* Of a file: the figures of every scene. */
static int print_figures(const char *path, int workers, enum order order)
{
    static struct recorded recorded;
    FILE *file = fopen(path, "r");
    if (!file)
        return 1;
    while (read_recorded(file, &recorded)) {
        struct verdict verdict = judge(&recorded, workers, order);
        printf("%-36s off by %3.0f %% at %3.0f %%, said from %3.0f %% on\n", recorded.name, 100 * verdict.worst,
               100 * verdict.worst_at, 100 * verdict.said_at);
    }
    fclose(file);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fixed_samples),
        cmocka_unit_test(test_adaptive_samples),
        cmocka_unit_test(test_from_the_top),
    };
    if (argc > 2)
        return print_figures(argv[1], atoi(argv[2]), argc > 3 ? FROM_THE_TOP : SOUNDINGS_FIRST);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
