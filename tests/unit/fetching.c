/* Fetching what jobs need (worker/fetching.h), step by step. As a part of a session: tests/unit/session_jobs.c. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "wire/manifest.h"
#include "worker/fetching.h"

static struct fetching fetching;

/* --- files ------------------------------------------------------------------------------------------------ */

/* A manifest of files that hold these texts, and are named so too. */
static struct bytes manifest_of(const char *const *texts, size_t count)
{
    struct manifest manifest = {.entries = memory_array(count, sizeof(struct manifest_entry)), .count = count};
    struct bytes bytes = {0};
    for (size_t i = 0; i < count; i++) {
        snprintf(manifest.entries[i].name, MANIFEST_NAME_BYTES, "%s", texts[i]);
        manifest.entries[i].digest = digest_of(texts[i], strlen(texts[i]));
        manifest.entries[i].size = strlen(texts[i]);
    }
    manifest_encode(&manifest, &bytes);
    manifest_finish(&manifest);
    return bytes;
}

/* An ASSET message of a whole file. */
static struct message asset(const void *data, size_t size)
{
    return (struct message){.kind = MESSAGE_ASSET,
                            .asset = {.digest = digest_of(data, size), .total = size, .data = data,
                                      .size = (uint32_t)size}};
}

static void add(uint32_t job, const void *manifest, size_t size)
{
    const struct digest digest = digest_of(manifest, size);
    fetching_add(&fetching, job, &digest, size);
}

/* --- steps ------------------------------------------------------------------------------------------------ */

static void expect_need(const void *data, size_t size)
{
    struct fetching_step step;
    const struct digest digest = digest_of(data, size);
    assert_true(fetching_next(&fetching, &step));
    assert_int_equal(step.kind, FETCHING_NEED);
    assert_true(digest_equal(&step.digest, &digest));
    assert_int_equal(step.offset, 0);
}

static void expect_settled(enum fetching_step_kind kind, uint32_t job)
{
    struct fetching_step step;
    assert_true(fetching_next(&fetching, &step));
    assert_int_equal(step.kind, kind);
    assert_int_equal(step.job, job);
    if (kind == FETCHING_UNUSABLE)
        assert_true(step.error.text[0]);
}

static void expect_nothing(void)
{
    struct fetching_step step;
    assert_false(fetching_next(&fetching, &step));
}

/* The whole file comes, and fits. */
static void receive(const void *data, size_t size)
{
    const struct message message = asset(data, size);
    assert_null(fetching_take(&fetching, &message));
}

/* Job 0, which has one file, is complete. */
static void complete_one(const char *text)
{
    struct bytes manifest = manifest_of(&text, 1);
    add(0, manifest.data, manifest.size);
    expect_need(manifest.data, manifest.size);
    receive(manifest.data, manifest.size);
    expect_need(text, strlen(text));
    receive(text, strlen(text));
    expect_settled(FETCHING_COMPLETE, 0);
    expect_nothing();
    bytes_finish(&manifest);
}

static int finish(void **state)
{
    (void)state;
    fetching_finish(&fetching);
    assert_null(fetching.jobs);
    assert_int_equal(fetching.cache.count, 0);
    return 0;
}

/* --- tests ------------------------------------------------------------------------------------------------ */

static void test_copy(void **state)
{
    (void)state;
    struct asset_set assets = {0};
    complete_one("sphere");
    assert_string_equal(fetching_copy(&fetching, 0, &assets), "sphere");
    assert_int_equal(assets.count, 1);
    assert_int_equal(assets.assets[0].bytes.size, 6);
    assert_string_equal((const char *)assets.assets[0].bytes.data, "sphere"); /* a NUL follows */
    asset_set_finish(&assets);
}

/* One thing at a time, so what comes for nobody is passed over whatever it is. */
static void test_strays(void **state)
{
    (void)state;
    const char *const texts[] = {"box", "cone"};
    struct bytes manifest = manifest_of(texts, 2);
    const struct message nothing = {.kind = MESSAGE_ASSET}; /* of a digest that is all zero */
    struct message wrong = asset("box", 3);
    wrong.asset.total = 5;
    receive("box", 3);
    assert_null(fetching_take(&fetching, &nothing));
    add(7, manifest.data, manifest.size);
    receive(manifest.data, manifest.size); /* nobody asked yet */
    assert_null(fetching_take(&fetching, &wrong));
    expect_need(manifest.data, manifest.size);
    receive("cone", 4);
    receive(manifest.data, manifest.size);
    expect_need("box", 3);
    receive("cone", 4);
    assert_string_equal(fetching_take(&fetching, &wrong), "an asset's chunks do not fit together");
    bytes_finish(&manifest);
}

/* What is no manifest settles its job, not those behind it; each job is settled once. */
static void test_no_manifest(void **state)
{
    (void)state;
    complete_one("disc");
    const char *const texts[] = {"disc"};
    struct bytes manifest = manifest_of(texts, 1);
    add(1, "disc", 4); /* is there, as a file */
    add(2, "junk", 4);
    add(3, manifest.data, manifest.size);
    expect_settled(FETCHING_UNUSABLE, 1);
    expect_need("junk", 4);
    expect_nothing();
    receive("junk", 4);
    expect_settled(FETCHING_UNUSABLE, 2);
    expect_settled(FETCHING_COMPLETE, 3);
    expect_nothing();
    bytes_finish(&manifest);
}

/* Jobs may go in any order; of a file that was on its way for one of them, nothing is lost to the others. */
static void test_removal(void **state)
{
    (void)state;
    const char *const texts[] = {"plane"};
    struct bytes manifest = manifest_of(texts, 1);
    for (uint32_t job = 0; job < 3; job++)
        add(job, manifest.data, manifest.size);
    expect_need(manifest.data, manifest.size);
    fetching_remove(&fetching, 0);
    expect_nothing(); /* it has been asked for */
    receive(manifest.data, manifest.size);
    expect_need("plane", 5);
    fetching_remove(&fetching, 2);
    expect_nothing();
    receive("plane", 5);
    expect_settled(FETCHING_COMPLETE, 1);
    fetching_remove(&fetching, 1);
    expect_nothing();
    add(0, manifest.data, manifest.size); /* all is still there */
    expect_settled(FETCHING_COMPLETE, 0);
    bytes_finish(&manifest);
}

/* What nobody lacks any more is asked for anew when somebody does again: its chunks may have come meanwhile. */
static void test_asked_for_anew(void **state)
{
    (void)state;
    complete_one("torus");
    add(1, "junk", 4);
    expect_need("junk", 4);
    fetching_remove(&fetching, 1);
    expect_nothing();
    receive("junk", 4);
    add(1, "junk", 4);
    expect_need("junk", 4);
}

/* A file that is on its way goes on only for those who say that it is as long. */
static void test_other_size(void **state)
{
    (void)state;
    const struct digest digest = digest_of("junk", 4);
    add(0, "junk", 4);
    expect_need("junk", 4);
    fetching_add(&fetching, 1, &digest, 5);
    fetching_remove(&fetching, 0);
    expect_need("junk", 4);
    expect_nothing();
    struct message message = asset("junk", 4);
    assert_string_equal(fetching_take(&fetching, &message), "an asset's chunks do not fit together");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_copy, finish),
        cmocka_unit_test_teardown(test_strays, finish),
        cmocka_unit_test_teardown(test_no_manifest, finish),
        cmocka_unit_test_teardown(test_removal, finish),
        cmocka_unit_test_teardown(test_asked_for_anew, finish),
        cmocka_unit_test_teardown(test_other_size, finish),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
