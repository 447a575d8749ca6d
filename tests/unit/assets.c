/* Asset names, sets with and without a disk, digests. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "scene/assets.h"

static void add_text(struct asset_set *set, const char *name, const char *text)
{
    struct bytes bytes = {0};
    bytes_put(&bytes, text, strlen(text));
    bytes_put_u8(&bytes, 0);
    bytes.size--;
    asset_set_add(set, name, &bytes);
    assert_null(bytes.data);
}

static void write_file(const char *folder, const char *name, const char *text)
{
    char *path = memory_format("%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    free(path);
}

static void a_name_is_relative_to_the_file_that_gives_it(void **state)
{
    (void)state;
    static const struct {
        const char *from, *reference, *joined;
    } cases[] = {
        {"scene.json", "sky.png", "sky.png"},
        {"scene.json", "textures/sky.png", "textures/sky.png"},
        {"meshes/bunny.obj", "bunny.mtl", "meshes/bunny.mtl"},
        {"meshes/bunny.obj", "../sky.png", "meshes/../sky.png"},
        {"meshes/bunny.obj", "/data/sky.png", "/data/sky.png"},
        {"scene.json", "./sky.png", "sky.png"},
        {"scene.json", "a//b/./c.png", "a/b/c.png"},
        {"scene.json", ".hidden/..png", ".hidden/..png"},
        {"/data/scene.json", "sky.png", "/data/sky.png"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char name[ASSET_NAME_MAX + 1];
        struct error error;
        assert_int_equal(asset_name_join(name, cases[i].from, cases[i].reference, &error), STATUS_OK);
        assert_string_equal(name, cases[i].joined);
    }
}

static void names_that_are_empty_or_too_long_are_refused(void **state)
{
    (void)state;
    char name[ASSET_NAME_MAX + 1], longest[ASSET_NAME_MAX + 2];
    struct error error;
    memset(longest, 'a', sizeof longest);
    longest[ASSET_NAME_MAX] = '\0';
    assert_int_equal(asset_name_join(name, "scene.json", longest, &error), STATUS_OK);
    assert_string_equal(name, longest);
    assert_int_equal(asset_name_join(name, "d/scene.json", longest, &error), STATUS_INPUT);
    assert_string_equal(error.text, "expected a file name of at most 1023 bytes, found 1025");
    assert_int_equal(asset_name_join(name, "scene.json", "", &error), STATUS_INPUT);
    assert_int_equal(asset_name_join(name, "scene.json", "./.", &error), STATUS_INPUT);
}

static void a_set_without_a_disk_knows_only_what_it_was_given(void **state)
{
    (void)state;
    struct asset_set set = {0};
    struct error error;
    add_text(&set, "scene.json", "{}");
    const struct asset *asset = asset_set_get(&set, "scene.json", &error);
    assert_non_null(asset);
    assert_int_equal(asset->bytes.size, 2);
    assert_int_equal(asset->bytes.data[2], 0);
    assert_null(asset_set_get(&set, "/etc/hostname", &error));
    assert_string_equal(error.text, "/etc/hostname: expected among the files received, found none");
    assert_int_equal(set.count, 1);
    asset_set_finish(&set);
}

static void a_set_with_a_disk_reads_each_file_once(void **state)
{
    (void)state;
    char folder[] = "/tmp/weft-assets-XXXXXX";
    assert_non_null(mkdtemp(folder));
    write_file(folder, "scene.json", "{ }");
    char *path = memory_format("%s/scene.json", folder);
    struct asset_set set;
    struct error error;
    const char *name;
    asset_set_init_disk(&set, path, &name);
    assert_string_equal(name, "scene.json");
    assert_string_equal(set.folder, folder);
    const struct asset *asset = asset_set_get(&set, name, &error);
    assert_non_null(asset);
    assert_memory_equal(asset->bytes.data, "{ }", 4);
    char hex[DIGEST_HEX_BYTES];
    digest_hex(&asset->digest, hex); /* printf '{ }' | sha256sum */
    assert_string_equal(hex, "257c1be96ae69f4b01c2c69bdb6d78605f59175819fb007d0bf245bf48444c4a");
    assert_int_equal(unlink(path), 0);
    assert_ptr_equal(asset_set_get(&set, name, &error), asset);
    assert_null(asset_set_get(&set, "none.png", &error));
    assert_non_null(strstr(error.text, "/none.png: cannot be opened"));
    assert_int_equal(set.count, 1);
    asset_set_finish(&set);
    assert_null(set.folder);
    free(path);
    assert_int_equal(rmdir(folder), 0);
}

static void sentences_show_the_path_as_the_user_wrote_it(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *asset, *path;
    } cases[] = {
        {"scene.json", "sky.png", "sky.png"},
        {"scenes/bad/nan.json", "nan.json", "scenes/bad/nan.json"},
        {"/scene.json", "sky.png", "/sky.png"},
        {"../scene.json", "/data/sky.png", "/data/sky.png"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct asset_set set;
        const char *name;
        asset_set_init_disk(&set, cases[i].scene, &name);
        char *path = asset_set_path(&set, cases[i].asset);
        assert_string_equal(path, cases[i].path);
        free(path);
        asset_set_finish(&set);
    }
}

static void the_digest_depends_on_contents_and_order(void **state)
{
    (void)state;
    struct asset_set one = {0}, same = {0}, swapped = {0};
    add_text(&one, "a", "first");
    add_text(&one, "b", "second");
    add_text(&same, "c", "first");
    add_text(&same, "d", "second");
    add_text(&swapped, "a", "second");
    add_text(&swapped, "b", "first");
    struct digest a = asset_set_digest(&one), b = asset_set_digest(&same), c = asset_set_digest(&swapped);
    assert_true(digest_equal(&a, &b));
    assert_false(digest_equal(&a, &c));
    asset_set_finish(&one);
    asset_set_finish(&same);
    asset_set_finish(&swapped);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_name_is_relative_to_the_file_that_gives_it),
        cmocka_unit_test(names_that_are_empty_or_too_long_are_refused),
        cmocka_unit_test(a_set_without_a_disk_knows_only_what_it_was_given),
        cmocka_unit_test(a_set_with_a_disk_reads_each_file_once),
        cmocka_unit_test(sentences_show_the_path_as_the_user_wrote_it),
        cmocka_unit_test(the_digest_depends_on_contents_and_order),
    };
    return cmocka_run_group_tests_name("assets", tests, NULL, NULL);
}
