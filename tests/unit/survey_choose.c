/*
 * What is concluded from a survey: which sampling, and how far off its render is. The surveys here are made up.
 */
#include "trace/survey.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* --- choosing --------------------------------------------------------------------------------------------- */

static const double asked = 0.01; /* RMSE */

/* Sets what was noted of one sampling, and of no other. */
static void set_outcome(struct survey *survey, uint32_t policy, uint32_t threshold, struct survey_outcome outcome)
{
    struct survey_outcome before = survey_outcome(survey, policy, threshold), *step = &survey->steps[policy][threshold];
    for (int next = 0; next <= 1 && threshold + (uint32_t)next < SAMPLING_THRESHOLDS; next++) {
        int64_t sign = next ? -1 : 1;
        step[next].samples += sign * (outcome.samples - before.samples);
        for (int class = 0; class < 2; class++) {
            step[next].error[class] += sign * (outcome.error[class] - before.error[class]);
            step[next].estimated[class] += sign * (outcome.estimated[class] - before.estimated[class]);
        }
    }
}

/* Of 1,000 pixels. */
static int64_t error_sum(double error)
{
    return (int64_t)(1000 * error * error / PIXEL_ERROR_UNIT);
}

/* 1,000 pixels that were `error` off with two samples each, whatever the sampling. */
static struct survey even_survey(double error)
{
    struct survey survey = {.pixels = 1000};
    for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++)
        survey.steps[policy][0] = (struct survey_outcome){
            .samples = 2000, .error = {error_sum(error) / 2, error_sum(error) / 2}};
    return survey;
}

static void note(struct survey *survey, uint32_t policy, uint32_t threshold, int64_t samples, double error)
{
    set_outcome(survey, policy, threshold, (struct survey_outcome){.samples = samples, .error = {0, error_sum(error)}});
}

static void assert_sampling(struct sampling found, uint32_t least, uint32_t most, uint32_t threshold)
{
    assert_int_equal(found.least, least);
    assert_int_equal(found.most, most);
    assert_int_equal(found.threshold, threshold);
}

/* Errors are far from the border: a choice aims a little below what is asked for. */
static void the_cheapest_that_meets_the_error_is_chosen(void **state)
{
    (void)state;
    struct sampling surveyed = {1, 256, 100};
    struct survey survey = even_survey(2 * asked);
    note(&survey, 1, 30, 500, 0.5 * asked);
    assert_sampling(survey_choose(&survey, &surveyed, asked), 4, 256, 30);
    note(&survey, 0, 50, 400, 0.5 * asked);
    assert_sampling(survey_choose(&survey, &surveyed, asked), 1, 256, 50);
    note(&survey, 3, 10, 300, 1.1 * asked); /* too far off */
    note(&survey, 2, 101, 200, 0.1 * asked); /* finer than was surveyed */
    note(&survey, 0, 100, 450, 0.1 * asked); /* better than need be */
    assert_sampling(survey_choose(&survey, &surveyed, asked), 1, 256, 50);
    note(&survey, 3, 100, 399, 0.7 * asked);
    assert_sampling(survey_choose(&survey, &surveyed, asked), 64, 256, 100);
}

/* Pixels with one sample count as those with more do. */
static void errors_of_all_pixels_count(void **state)
{
    (void)state;
    struct sampling surveyed = {1, 64, 100};
    struct survey survey = even_survey(2 * asked);
    set_outcome(&survey, 0, 20, (struct survey_outcome){.samples = 100, .error = {error_sum(2 * asked), 0}});
    note(&survey, 0, 40, 200, 0.5 * asked);
    assert_sampling(survey_choose(&survey, &surveyed, asked), 1, 64, 40);
}

static void the_finest_is_chosen_if_none_will_do(void **state)
{
    (void)state;
    struct survey survey = even_survey(2 * asked);
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        uint32_t most = sampling_stage(stage);
        struct sampling surveyed = {1, most, 77};
        assert_sampling(survey_choose(&survey, &surveyed, asked), most < 64 ? most : 64, most, 77);
    }
}

static void no_choice_has_more_at_least_than_at_most(void **state)
{
    (void)state;
    for (uint32_t stage = 1; stage < SAMPLING_STAGES; stage++) {
        uint32_t most = sampling_stage(stage);
        struct sampling surveyed = survey_sampling(most, asked);
        struct survey survey = even_survey(2 * asked);
        for (uint32_t policy = 0; policy < SURVEY_POLICIES; policy++) /* the greatest least is cheapest */
            note(&survey, policy, 5, 1000 - policy, 0.5 * asked);
        struct sampling chosen = survey_choose(&survey, &surveyed, asked);
        assert_true(chosen.least <= chosen.most && chosen.most == most && chosen.threshold <= surveyed.threshold);
        assert_true(chosen.least == 64 || 4 * chosen.least > most);
    }
}

/* The finer the error, the finer the finest threshold. */
static void what_is_surveyed_follows_the_error(void **state)
{
    (void)state;
    uint32_t last = 0;
    for (double error = 1; error > 1e-10; error /= 2) {
        struct sampling sampling = survey_sampling(64, error);
        assert_true(sampling.least == 1 && sampling.most == 64 && sampling.threshold < SAMPLING_THRESHOLDS);
        assert_true(sampling.threshold >= last);
        last = sampling.threshold;
    }
    assert_int_equal(last, SAMPLING_THRESHOLDS - 1);
}

/* --- the error of a render -------------------------------------------------------------------------------- */

/* Sums of whole numbers, a quotient and a root: a few roundings. */
static void assert_close(double found, double expected)
{
    if (!(fabs(found - expected) <= 1e-15 * expected))
        fail_msg("expected %.17g, found %.17g", expected, found);
}

static void estimates_are_corrected_as_in_the_survey(void **state)
{
    (void)state;
    struct survey survey = {.pixels = 1000};
    const struct sampling sampling = {16, 64, 40}, other = {4, 64, 40};
    const uint64_t estimated[2] = {7000000, 5000000};
    set_outcome(&survey, 2, 40, (struct survey_outcome){.error = {3000, 400}, .estimated = {6000, 100}});
    set_outcome(&survey, 1, 40, (struct survey_outcome){.error = {6000, 100}, .estimated = {6000, 100}});
    /* 7,000,000 × 3000 / 6000 + 5,000,000 × 400 / 100 */
    assert_close(survey_error(&survey, &sampling, 20000, estimated), sqrt(23500000 * PIXEL_ERROR_UNIT / 20000));
    assert_close(survey_error(&survey, &other, 20000, estimated), sqrt(12000000 * PIXEL_ERROR_UNIT / 20000));
}

/* Where the survey estimated none of a class, what it found itself is taken for the whole. */
static void what_was_not_estimated_is_taken_from_the_survey(void **state)
{
    (void)state;
    struct survey survey = {.pixels = 1000};
    const struct sampling sampling = {1, 64, 9};
    const uint64_t estimated[2] = {0, 5000000};
    set_outcome(&survey, 0, 9, (struct survey_outcome){.error = {300, 400}, .estimated = {0, 100}});
    assert_close(survey_error(&survey, &sampling, 20000, estimated), sqrt(20006000 * PIXEL_ERROR_UNIT / 20000));
    set_outcome(&survey, 0, 9, (struct survey_outcome){.error = {-300, -5}, .estimated = {10, 0}});
    assert_true(survey_error(&survey, &sampling, 20000, estimated) == 0);
}

/* No pixel goes on at threshold 0; what chance makes negative is no error. */
static void one_sample_is_judged_by_the_survey_alone(void **state)
{
    (void)state;
    struct survey survey = {.pixels = 1000};
    set_outcome(&survey, 0, 0, (struct survey_outcome){.samples = 1000, .error = {error_sum(0.25), 0}});
    assert_close(survey_error_of_one(&survey), 0.25);
    set_outcome(&survey, 0, 0, (struct survey_outcome){.samples = 1000, .error = {-5, 0}});
    assert_true(survey_error_of_one(&survey) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_cheapest_that_meets_the_error_is_chosen),
        cmocka_unit_test(errors_of_all_pixels_count),
        cmocka_unit_test(the_finest_is_chosen_if_none_will_do),
        cmocka_unit_test(no_choice_has_more_at_least_than_at_most),
        cmocka_unit_test(what_is_surveyed_follows_the_error),
        cmocka_unit_test(estimates_are_corrected_as_in_the_survey),
        cmocka_unit_test(what_was_not_estimated_is_taken_from_the_survey),
        cmocka_unit_test(one_sample_is_judged_by_the_survey_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
