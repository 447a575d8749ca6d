/* Metrics: the text of a snapshot, and a copy of a snapshot gives the same. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "coordinator/metrics.h"
#include "coordinator/snapshot_copy.h"
#include "coordinator/snapshot_json.h"
#include "tests/unit/progress_help.h"

static char *text_of(const struct snapshot *snapshot)
{
    struct bytes text = {0};
    metrics_write(&text, snapshot);
    assert_int_equal(strlen((const char *)text.data), text.size);
    return (char *)text.data;
}

static void assert_line(const char *text, const char *line)
{
    char *framed = memory_format("\n%s\n", line);
    if (!strstr(text, framed))
        fail_msg("no line \"%s\" in:\n%s", line, text);
    free(framed);
}

static size_t count_of(const char *text, const char *what)
{
    size_t count = 0;
    for (text = strstr(text, what); text; text = strstr(text + 1, what))
        count++;
    return count;
}

static void test_figures(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 2, 3);
    farm.snapshot.refused = 7;
    farm.workers[2].trouble = TROUBLE_MISFIT;
    farm.jobs[0].error = 0.005;
    char *text = text_of(&farm.snapshot);
    assert_line(text, "weft_build_info{version=\"" WEFT_VERSION "\"} 1");
    assert_line(text, "weft_joins_refused_total 7");
    assert_line(text, "weft_rays_total 36");
    assert_line(text, "# TYPE weft_rays_total counter");
    assert_line(text, "weft_jobs{state=\"running\"} 1");
    assert_line(text, "weft_jobs{state=\"waiting\"} 1");
    assert_line(text, "weft_job_rows_done{job_number=\"1\",output=\"showcase.png\"} 486");
    assert_line(text, "weft_job_remaining_seconds{job_number=\"1\",output=\"showcase.png\"} 14.2");
    assert_line(text, "weft_job_rmse_ratio{job_number=\"1\",output=\"showcase.png\"} 0.00471");
    assert_line(text, "weft_job_rmse_target_ratio{job_number=\"1\",output=\"showcase.png\"} 0.005");
    assert_line(text, "weft_workers{state=\"working\"} 2");
    assert_line(text, "weft_workers_in_trouble{trouble=\"wrong result\"} 1");
    assert_line(text, "weft_worker_rays_total{worker=\"3\",host=\"計算機-01\"} 12");
    assert_line(text, "weft_worker_threads{worker=\"2\",host=\"münchen\"} 2");
    assert_int_equal(count_of(text, "job_number=\"2\""), 0); /* it has not begun */
    free(text);
}

static void test_what_is_unknown_is_left_out(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 0);
    farm.jobs[0].remaining_seconds = -1;
    farm.jobs[0].rmse = NAN;
    char *text = text_of(&farm.snapshot);
    assert_int_equal(count_of(text, "\nweft_job_remaining_seconds"), 0);
    assert_int_equal(count_of(text, "\nweft_job_rmse"), 0);
    assert_int_equal(count_of(text, "nan"), 0);
    free(text);
}

static void test_labels_hold_anything(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    farm.workers[0].host = "a\"b\\c\nd\xff";
    char *text = text_of(&farm.snapshot);
    assert_line(text, "weft_worker_threads{worker=\"1\",host=\"a\\\"b\\\\c\\nd\xEF\xBF\xBD\"} 1");
    free(text);
}

/* Those that are gone go first, then whoever came last. */
static void test_series_are_bounded(void **state)
{
    (void)state;
    enum { MANY = METRICS_WORKERS_MAX + 50, MANY_JOBS = METRICS_JOBS_MAX + 30 };
    struct worker_snapshot *workers = memory_array(MANY, sizeof *workers);
    struct job_snapshot *jobs = memory_array(MANY_JOBS, sizeof *jobs);
    for (uint32_t i = 0; i < MANY; i++)
        workers[i] = (struct worker_snapshot){.number = i + 1, .host = "h", .kernel = "ref", .rays = 2,
                                              .state = i < 20 ? WORKER_GONE : WORKER_IDLE};
    for (uint32_t i = 0; i < MANY_JOBS; i++)
        jobs[i] = job_of("s.json", "o.png", i < MANY_JOBS - 10 ? JOB_DONE : JOB_WAITING, 1);
    const struct snapshot snapshot = {.workers = workers, .worker_count = MANY, .jobs = jobs, .job_count = MANY_JOBS};
    char *text = text_of(&snapshot);
    assert_int_equal(count_of(text, "\nweft_worker_rays_total{"), METRICS_WORKERS_MAX);
    assert_null(strstr(text, "worker=\"20\""));
    assert_non_null(strstr(text, "worker=\"21\""));
    assert_line(text, "weft_workers{state=\"gone\"} 20");
    assert_line(text, "weft_rays_total 2100");
    assert_int_equal(count_of(text, "\nweft_job_rows{"), METRICS_JOBS_MAX);
    assert_null(strstr(text, "job_number=\"20\""));
    assert_non_null(strstr(text, "job_number=\"120\""));
    assert_null(strstr(text, "job_number=\"121\"")); /* it waits */
    free(text);
    free(workers);
    free(jobs);
}

static char *json_of(const struct snapshot *snapshot)
{
    struct bytes text = {0};
    snapshot_write_json(&text, snapshot);
    return (char *)text.data;
}

static void test_a_copy_lives_alone(void **state)
{
    (void)state;
    struct farm *farm = memory_array(1, sizeof *farm);
    farm_init(farm, 3, 5);
    farm->jobs[2].stretches = farm->stretches + 1;
    farm->jobs[2].stretch_count = 2;
    char *metrics = text_of(&farm->snapshot), *json = json_of(&farm->snapshot);
    struct snapshot *copy = snapshot_copy(&farm->snapshot);
    memset(farm, 0xa5, sizeof *farm);
    free(farm);
    char *metrics_again = text_of(copy), *json_again = json_of(copy);
    assert_string_equal(metrics_again, metrics);
    assert_string_equal(json_again, json);
    free(metrics);
    free(json);
    free(metrics_again);
    free(json_again);
    free(copy);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_figures),
        cmocka_unit_test(test_what_is_unknown_is_left_out),
        cmocka_unit_test(test_labels_hold_anything),
        cmocka_unit_test(test_series_are_bounded),
        cmocka_unit_test(test_a_copy_lives_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
