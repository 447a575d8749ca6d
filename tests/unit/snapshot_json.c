/* The JSON view of a snapshot, read back by a parser. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "coordinator/snapshot_json.h"
#include "tests/unit/progress_help.h"

static cJSON *json_of(const struct farm *farm)
{
    struct bytes text = {0};
    snapshot_write_json(&text, &farm->snapshot);
    assert_int_equal(count_lines((const char *)text.data), 1);
    assert_int_equal(text.data[text.size - 1], '\n');
    cJSON *json = cJSON_ParseWithOpts((const char *)text.data, NULL, true);
    assert_non_null(json);
    bytes_finish(&text);
    return json;
}

/* Exactly these keys, in this order, joined by blanks. */
static void assert_keys(const cJSON *object, const char *want)
{
    char keys[512] = "";
    const cJSON *item;
    cJSON_ArrayForEach(item, object)
    {
        strcat(keys, *keys ? " " : "");
        strcat(keys, item->string);
    }
    assert_string_equal(keys, want);
}

static const cJSON *member(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    assert_non_null(item);
    return item;
}

static void test_json_members(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 2, 3);
    farm.jobs[1].remaining_seconds = -1;
    farm.workers[1].trouble = TROUBLE_MISFIT;
    farm.snapshot.refused = 7;
    cJSON *json = json_of(&farm);
    assert_keys(json, "elapsed rays rays_per_second refused jobs workers");
    assert_int_equal(member(json, "refused")->valuedouble, 7);
    assert_int_equal(cJSON_GetArraySize(member(json, "jobs")), 2);
    assert_int_equal(cJSON_GetArraySize(member(json, "workers")), 3);
    const cJSON *job = cJSON_GetArrayItem(member(json, "jobs"), 0);
    assert_keys(job, "scene output state width height samples_max samples error rmse rows_done rows_in_work rays"
                     " elapsed remaining bands");
    assert_string_equal(member(job, "scene")->valuestring, "scenes/showcase.json");
    assert_string_equal(member(job, "state")->valuestring, "running");
    assert_int_equal(member(job, "rays")->valuedouble, 36000000);
    assert_true(member(job, "remaining")->valuedouble == 14.2);
    assert_int_equal(member(job, "samples_max")->valuedouble, 16);
    assert_int_equal(member(job, "samples")->valuedouble, 16);
    assert_true(cJSON_IsNull(member(job, "error")));
    assert_true(member(job, "rmse")->valuedouble == 0.00471);
    assert_true(cJSON_IsNull(member(cJSON_GetArrayItem(member(json, "jobs"), 1), "rmse")));
    assert_true(cJSON_IsNull(member(cJSON_GetArrayItem(member(json, "jobs"), 1), "remaining")));
    const cJSON *worker = cJSON_GetArrayItem(member(json, "workers"), 1);
    assert_keys(worker,
                "number host pid threads kernel state bands_held bands_done rows_done rays rays_per_second"
                " trouble");
    assert_string_equal(member(worker, "trouble")->valuestring, "wrong result");
    assert_true(cJSON_IsNull(member(cJSON_GetArrayItem(member(json, "workers"), 0), "trouble")));
    assert_string_equal(member(worker, "host")->valuestring, "münchen");
    assert_string_equal(member(worker, "state")->valuestring, "idle");
    assert_int_equal(member(worker, "pid")->valuedouble, 4000);
    cJSON_Delete(json);
}

static void test_json_bands(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    cJSON *json = json_of(&farm);
    const cJSON *bands = member(cJSON_GetArrayItem(member(json, "jobs"), 0), "bands");
    assert_int_equal(cJSON_GetArraySize(bands), STRETCHES);
    assert_keys(cJSON_GetArrayItem(bands, 3), "first_row rows state worker");
    assert_int_equal(member(cJSON_GetArrayItem(bands, 3), "first_row")->valuedouble, 540);
    assert_int_equal(member(cJSON_GetArrayItem(bands, 3), "rows")->valuedouble, 54);
    assert_string_equal(member(cJSON_GetArrayItem(bands, 3), "state")->valuestring, "in work");
    assert_int_equal(member(cJSON_GetArrayItem(bands, 3), "worker")->valuedouble, 11);
    assert_string_equal(member(cJSON_GetArrayItem(bands, 0), "state")->valuestring, "done");
    assert_string_equal(member(cJSON_GetArrayItem(bands, 4), "state")->valuestring, "waiting");
    assert_true(cJSON_IsNull(member(cJSON_GetArrayItem(bands, 4), "worker")));
    cJSON_Delete(json);
}

static void test_json_of_an_error(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 2, 1);
    farm.jobs[0] = job_of("a.json", "a.png", JOB_SURVEYING, 0);
    farm.jobs[0].samples = 0;
    farm.jobs[0].error = 0.0005;
    farm.jobs[1] = job_of("b.json", "b.png", JOB_DONE, 1080);
    farm.jobs[1].samples = 4.125;
    farm.jobs[1].rmse = 0.000471;
    cJSON *json = json_of(&farm);
    const cJSON *first = cJSON_GetArrayItem(member(json, "jobs"), 0);
    assert_string_equal(member(first, "state")->valuestring, "surveying");
    assert_true(cJSON_IsNull(member(first, "samples")));
    assert_true(member(first, "error")->valuedouble == 0.0005);
    const cJSON *second = cJSON_GetArrayItem(member(json, "jobs"), 1);
    assert_true(member(second, "samples")->valuedouble == 4.125);
    assert_true(member(second, "rmse")->valuedouble == 0.000471);
    cJSON_Delete(json);
}

static void test_json_strings(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    farm.jobs[0].scene = "a\"b\\c\n\t\x01\x7F/計";
    farm.workers[0].host = "\xFFx\xC3";
    farm.snapshot.rays_per_second = 0.0 / 0.0;
    cJSON *json = json_of(&farm);
    assert_string_equal(member(cJSON_GetArrayItem(member(json, "jobs"), 0), "scene")->valuestring,
                        "a\"b\\c\n\t\x01\x7F/計");
    assert_string_equal(member(cJSON_GetArrayItem(member(json, "workers"), 0), "host")->valuestring, "�x�");
    assert_true(cJSON_IsNull(member(json, "rays_per_second")));
    cJSON_Delete(json);
}

static void test_json_empty(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 0, 0);
    cJSON *json = json_of(&farm);
    assert_int_equal(cJSON_GetArraySize(member(json, "jobs")), 0);
    cJSON_Delete(json);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_json_members),
        cmocka_unit_test(test_json_bands),
        cmocka_unit_test(test_json_of_an_error),
        cmocka_unit_test(test_json_strings),
        cmocka_unit_test(test_json_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
