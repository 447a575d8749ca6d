/* Snapshots that come as JSON: what was written is read as it was, and nothing else is taken. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "coordinator/progress_views.h"
#include "coordinator/snapshot_json.h"
#include "tests/unit/progress_help.h"

static struct error error;

/* A block of its own size, so that the sanitizer sees any reading beyond it. */
static struct snapshot *read_exact(const char *text, size_t size)
{
    char *exact = malloc(size);
    if (size)
        memcpy(exact, text, size);
    struct snapshot *snapshot = snapshot_read_json(exact, size, &error);
    free(exact);
    return snapshot;
}

static struct snapshot *read_good(const struct bytes *text)
{
    struct snapshot *snapshot = read_exact((const char *)text->data, text->size);
    if (!snapshot)
        fail_msg("%s", error.text);
    return snapshot;
}

static struct bytes text_of(const struct snapshot *snapshot)
{
    struct bytes text = {0};
    snapshot_write_json(&text, snapshot);
    return text;
}

/* With every state and trouble, and jobs whose pictures begin and end otherwise. */
static void various(struct farm *farm)
{
    farm_init(farm, 5, 100);
    farm->snapshot.refused = 3;
    for (int i = 0; i < 5; i++) {
        farm->jobs[i].state = (enum job_state)i;
        farm->jobs[i].stretch_count = STRETCHES;
        farm->jobs[i].stretches = farm->stretches;
    }
    farm->jobs[1].samples = 0;
    farm->jobs[1].error = 0.0005;
    farm->jobs[2].remaining_seconds = -1;
    farm->jobs[2].width = 65535;
    farm->jobs[3].scene = "a\"b\\c\n\x01/計";
    for (int i = 0; i < 100; i++) {
        farm->workers[i].state = (enum worker_state)(i % WORKER_STATES);
        farm->workers[i].trouble = (enum worker_trouble)(i % WORKER_TROUBLES);
        farm->workers[i].rays = (uint64_t)1 << 53;
    }
    farm->workers[7].rays_per_second = NAN;
}

static void test_round_trip(void **state)
{
    (void)state;
    struct farm farm;
    various(&farm);
    struct bytes text = text_of(&farm.snapshot);
    struct snapshot *copy = read_good(&text);
    struct bytes again = text_of(copy);
    assert_int_equal(again.size, text.size);
    assert_memory_equal(again.data, text.data, text.size);
    assert_int_equal(copy->jobs[3].stretches[3].worker, 11);
    assert_string_equal(copy->workers[1].host, "münchen");
    bytes_finish(&text);
    bytes_finish(&again);
    free(copy);
}

static void test_same_views(void **state)
{
    (void)state;
    struct farm farm;
    struct bytes here = {0}, there = {0};
    farm_init(&farm, 1, 20);
    struct bytes text = text_of(&farm.snapshot);
    struct snapshot *copy = read_good(&text);
    progress_block(&here, &farm.snapshot, 100, 24);
    progress_block(&there, copy, 100, 24);
    assert_string_equal((const char *)there.data, (const char *)here.data);
    bytes_finish(&here);
    bytes_finish(&there);
    bytes_finish(&text);
    free(copy);
}

/* What becomes of a good snapshot when the first `from` is `to` is refused with that sentence. */
static void assert_refused(const char *from, const char *to, const char *says)
{
    struct farm farm;
    farm_init(&farm, 1, 2);
    struct bytes text = text_of(&farm.snapshot);
    const char *good = (const char *)text.data, *at = strstr(good, from);
    assert_non_null(at);
    char *bad = memory_format("%.*s%s%s", (int)(at - good), good, to, at + strlen(from));
    assert_null(read_exact(bad, strlen(bad)));
    if (!strstr(error.text, says))
        fail_msg("expected a sentence with \"%s\", found \"%s\"", says, error.text);
    free(bad);
    bytes_finish(&text);
}

static void test_refused(void **state)
{
    (void)state;
    assert_refused("\"elapsed\":13.000", "\"elapsed\":-1", "the status: elapsed: expected a number of its range");
    assert_refused("\"elapsed\":13.000", "\"elapsed\":1e300", "the status: elapsed");
    assert_refused("\"elapsed\":13.000", "\"elapsed\":\"13\"", "the status: elapsed");
    assert_refused("\"elapsed\":13.000", "\"other\":1", "the status: elapsed");
    assert_refused("\"refused\":0", "\"refused\":0.5", "the status: refused: expected a whole number");
    assert_refused("\"refused\":0", "\"refused\":4294967296", "the status: refused");
    assert_refused("\"rays\":36000000", "\"rays\":18446744073709551616", "the status: rays");
    assert_refused("\"jobs\":[", "\"jobs\":7,\"x\":[", "the status: jobs: expected a list");
    assert_refused("\"state\":\"running\"", "\"state\":\"flying\"", "jobs[0].state: expected a word that is known");
    assert_refused("\"width\":1920", "\"width\":65536", "jobs[0].width");
    assert_refused("\"rows_done\":486", "\"rows_done\":1081", "jobs[0].rows_done");
    assert_refused("\"scene\":\"", "\"scene\":null,\"x\":\"", "jobs[0].scene: expected a text");
    assert_refused("\"height\":1080", "\"height\":1079", "jobs[0].bands: expected all rows from the top");
    assert_refused("\"height\":1080", "\"height\":1081", "jobs[0].bands: expected all rows from the top");
    assert_refused("\"first_row\":432", "\"first_row\":431", "jobs[0].bands");
    assert_refused("\"rows\":54", "\"rows\":0", "jobs[0].bands");
    assert_refused("\"rows\":54", "\"rows\":65535", "jobs[0].bands");
    assert_refused("\"state\":\"done\"", "\"state\":\"lost\"", "jobs[0].state");
    assert_refused("\"threads\":2", "\"threads\":-2", "workers[1].threads");
    assert_refused("\"trouble\":null", "\"trouble\":\"none\"", "workers[0].trouble");
    assert_refused("\"host\":\"localhost\"", "\"host\":\"a\\u0000b\"", "the status:1:");
    assert_refused("\"host\":\"localhost\"", "\"host\":\"\xff\"", "the status:1:");
    assert_refused("]}\n", "]} ]", "the status:1:");
}

/* Each would take a hundred times its size. */
static void test_dense(void **state)
{
    (void)state;
    struct bytes text = {0};
    bytes_put(&text, "[0", 2);
    for (int i = 0; i < 100000; i++)
        bytes_put(&text, ",0", 2);
    bytes_put(&text, "]", 1);
    assert_null(read_exact((const char *)text.data, text.size));
    assert_string_equal(error.text, "the status: expected a snapshot, found too many values");
    bytes_finish(&text);
}

/* A comma in a name is no value. */
static void test_many_commas(void **state)
{
    (void)state;
    struct farm farm;
    char host[256];
    memset(host, ',', 255);
    memcpy(host, "\"[\\", 3);
    host[255] = '\0';
    farm_init(&farm, 1, 100);
    for (int i = 0; i < 100; i++)
        farm.workers[i].host = host;
    struct bytes text = text_of(&farm.snapshot);
    struct snapshot *copy = read_good(&text);
    assert_string_equal(copy->workers[99].host, host);
    free(copy);
    bytes_finish(&text);
}

/* The shortest that each part can be is not taken for dense. */
static void test_many_stretches(void **state)
{
    (void)state;
    enum { ROWS = 2000 };
    static struct stretch_snapshot stretches[ROWS];
    struct farm farm;
    farm_init(&farm, 1, 0);
    for (uint32_t i = 0; i < ROWS; i++)
        stretches[i] = (struct stretch_snapshot){i, 1, i % 2 ? STRETCH_DONE : STRETCH_IN_WORK, i % 2 ? 0 : 1};
    farm.jobs[0].height = ROWS;
    farm.jobs[0].stretches = stretches;
    farm.jobs[0].stretch_count = ROWS;
    struct bytes text = text_of(&farm.snapshot);
    struct snapshot *copy = read_good(&text);
    assert_int_equal(copy->jobs[0].stretch_count, ROWS);
    free(copy);
    bytes_finish(&text);
}

static void test_not_objects(void **state)
{
    (void)state;
    static const char *const texts[] = {"", "7", "[]", "{}", "null", "{\"jobs\":[7],\"workers\":[[]]}"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_null(read_exact(texts[i], strlen(texts[i])));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),  cmocka_unit_test(test_same_views),
        cmocka_unit_test(test_refused),     cmocka_unit_test(test_dense),
        cmocka_unit_test(test_many_commas), cmocka_unit_test(test_many_stretches),
        cmocka_unit_test(test_not_objects),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
