/* What is forecast of a job's work from the bands that are done: cases with known answers. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "coordinator/forecast.h"

enum { ROWS = 640 };

static struct forecast *forecast;

static int finish(void **state)
{
    (void)state;
    forecast_destroy(&forecast);
    assert_null(forecast);
    forecast_destroy(&forecast);
    return 0;
}

static void render(uint32_t first_row, uint32_t rows, double work)
{
    forecast_add(forecast, first_row, rows, work, 0);
}

/* With nothing in work. */
static void assert_left(double want)
{
    double left = forecast_time(forecast, NULL, 0, 1, 1);
    if (fabs(left - want) > 1e-6 * want)
        fail_msg("expected %g left, found %g", want, left);
}

static void test_even_rows(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    assert_true(forecast_time(forecast, NULL, 0, 1, 1) < 0);
    render(0, 10, 30);
    assert_true(forecast_time(forecast, NULL, 0, 1, 1) < 0); /* one row in 64: too little */
    render(10, 30, 90);
    assert_left(600 * 3);
    assert_true(forecast_time(forecast, NULL, 0, 1, 4) == 450);
    render(40, 600, 1800);
    assert_left(0);
}

/* Between a cheap and a dear end it costs what lies between. */
static void test_between(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    render(0, 20, 20);
    render(620, 20, 180);
    assert_left(600 * 5);
    render(300, 40, 40);
    assert_left(280 * 1 + 280 * 5);
}

/* Beside its last known row a picture costs what that does, far away what the known do in the mean. */
static void test_open_end(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    render(0, 300, 300);
    render(300, 20, 20 * 33); /* a mean of 3 */
    double left = forecast_time(forecast, NULL, 0, 1, 1);
    assert_true(left > 320 * 3 && left < 320 * 3 + 80 * 15.5);
}

static void test_work_in_hand(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    render(0, 40, 40);
    const struct forecast_hand hands[] = {{40, 20, 15, 1}, {60, 10, 1000, 1}}; /* the second takes longer than expected */
    assert_true(fabs(forecast_time(forecast, hands, 2, 10, 1) - (600 - 15 - 10)) < 1e-6);
}

/* Time is not less than what the one with the longest band in hand needs, of copies the first that is done. */
static void test_longest_hand(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    render(0, 600, 600);
    const struct forecast_hand hands[] = {{600, 30, 5, 1}, {600, 30, 0, 2}, {630, 10, 0, 1}};
    assert_true(fabs(forecast_time(forecast, hands, 3, 0, 100) - 15) < 1e-6);
    assert_true(fabs(forecast_time(forecast, hands, 1, 0, 100) - 25) < 1e-6);
    assert_true(fabs(forecast_time(forecast, hands, 1, 0, 1) - 35) < 1e-6);
}

/* Ten rows of cells in each half: nothing is said before all is known of the survey. */
static void survey(double work_above, double work_below, double samples_above, double samples_below)
{
    forecast = forecast_create(ROWS, 32);
    forecast_survey(forecast, 0, 10, work_above);
    forecast_survey(forecast, 10, 10, work_below);
    render(0, 40, 40);
    assert_true(forecast_time(forecast, NULL, 0, 1, 1) < 0);
    forecast_destroy(&forecast);
    forecast = forecast_create(ROWS, 32);
    forecast_survey(forecast, 0, 10, work_above);
    forecast_survey(forecast, 10, 10, work_below);
    for (uint32_t cell = 0; cell < 20; cell++)
        forecast_expect(forecast, cell, cell < 10 ? samples_above : samples_below);
}

/* The survey expects that the lower half takes three times the samples of the upper one, which cost the same. */
static void test_survey_of_samples(void **state)
{
    (void)state;
    survey(10, 30, 1, 3);
    render(0, 40, 40);
    double left = forecast_time(forecast, NULL, 0, 1, 1);
    assert_true(left > 280 + 320 * 2.9 && left < 280 + 320 * 3.1);
}

/* One sample everywhere, but those of the lower half took the survey three times as long. */
static void test_survey_of_costs(void **state)
{
    (void)state;
    survey(10, 30, 1, 1);
    render(0, 40, 40);
    double left = forecast_time(forecast, NULL, 0, 1, 1);
    assert_true(left > 280 + 320 * 1.8 && left < 280 + 320 * 3);
}

/* Twice the samples were expected that came: that holds for the rest too, the more so the more is done. */
static void test_wrong_expectations(void **state)
{
    (void)state;
    survey(10, 10, 4, 4);
    forecast_add(forecast, 0, 160, 320, 0.5);
    double left = forecast_time(forecast, NULL, 0, 0, 1), inner = 320 / (1 + 4 * 0.5 / 160);
    assert_true(left > 3 * inner && left < 3 * inner * 2);
    forecast_add(forecast, 160, 320, 640, 0.5);
    double later = forecast_time(forecast, NULL, 0, 0, 1);
    assert_true(later > inner && later / inner < left / (3 * inner));
}

/* What an earlier run did is known to be done, but not what it took. */
static void test_kept_rows(void **state)
{
    (void)state;
    survey(NAN, 10, 1, 1);
    render(0, 400, NAN);
    assert_true(forecast_time(forecast, NULL, 0, 1, 1) < 0);
    render(400, 10, 20); /* one in 24 of those that this run has to do */
    assert_left(230 * 2);
}

/* A band of 4 rows whose pixels took 1 sample each was work for 8, with the 4 beside it that it had to look at. */
static void test_low_bands(void **state)
{
    (void)state;
    forecast = forecast_create(ROWS, 0);
    for (uint32_t row = 0; row < 40; row += 4)
        forecast_add(forecast, row, 4, 8, 1);
    assert_true(fabs(forecast_time(forecast, NULL, 0, 150, 1) - 1200) < 1e-6); /* as many as 4 rows each */
    assert_true(fabs(forecast_time(forecast, NULL, 0, 10, 1) - 640) < 1e-6);
}

static void test_no_time_at_all(void **state)
{
    (void)state;
    forecast = forecast_create(4, 1);
    forecast_survey(forecast, 0, 4, 0);
    for (uint32_t cell = 0; cell < 4; cell++)
        forecast_expect(forecast, cell, 1);
    render(1, 1, 0);
    assert_left(0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_even_rows, finish),
        cmocka_unit_test_teardown(test_between, finish),
        cmocka_unit_test_teardown(test_open_end, finish),
        cmocka_unit_test_teardown(test_work_in_hand, finish),
        cmocka_unit_test_teardown(test_longest_hand, finish),
        cmocka_unit_test_teardown(test_survey_of_samples, finish),
        cmocka_unit_test_teardown(test_survey_of_costs, finish),
        cmocka_unit_test_teardown(test_wrong_expectations, finish),
        cmocka_unit_test_teardown(test_kept_rows, finish),
        cmocka_unit_test_teardown(test_low_bands, finish),
        cmocka_unit_test_teardown(test_no_time_at_all, finish),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
