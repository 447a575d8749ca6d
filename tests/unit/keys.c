/* Files and folders of keys: what is read of them, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "wire/keys.h"

/* Two keys, and what the first (the example of ZeroMQ's specification 32) is in bytes. */
#define KEY_A "JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6"
#define KEY_B "KTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6"
static const uint8_t key_a[KEY_BYTES] = {
    0x8E, 0x0B, 0xDD, 0x69, 0x76, 0x28, 0xB9, 0x1D, 0x8F, 0x24, 0x55, 0x87, 0xEE, 0x95, 0xC5, 0xB0,
    0x4D, 0x48, 0x96, 0x3F, 0x79, 0x25, 0x98, 0x77, 0xB4, 0x9C, 0xD9, 0x06, 0x3A, 0xEA, 0xD3, 0xB7};

static char folder[] = "/tmp/weft-keys-XXXXXX";
static char path[64];
static struct error error;

static void write_file(const void *text, size_t size, mode_t mode)
{
    unlink(path);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, size, file), size);
    fclose(file);
    assert_int_equal(chmod(path, mode), 0);
}

static void write_text(const char *text)
{
    write_file(text, strlen(text), 0600);
}

/* The sentence begins with the path. */
static void assert_says(const char *says)
{
    assert_memory_equal(error.text, path, strlen(path));
    assert_string_equal(error.text + strlen(path), says);
    assert_null(strstr(error.text, "JTKVSB"));
}

static void assert_key_refused(const char *says)
{
    static const struct key nothing;
    struct key key;
    memset(&key, 1, sizeof key);
    assert_int_equal(key_file_read(&key, path, KEY_SECRET, &error), STATUS_INPUT);
    assert_says(says);
    assert_memory_equal(&key, &nothing, sizeof key);
}

static void assert_list_refused(const char *says)
{
    struct key_list list = {0};
    assert_int_equal(key_list_read(&list, path, &error), STATUS_INPUT);
    assert_says(says);
    assert_null(list.keys);
    assert_int_equal(list.count, 0);
}

/* --- one key ---------------------------------------------------------------------------------------------- */

static void test_key(void **state)
{
    (void)state;
    static const char *const texts[] = {KEY_A, KEY_A "\n", "# what it is\n\n  " KEY_A " \t\r\n#\n",
                                        KEY_A " # whose\n#end"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct key key;
        char text[KEY_TEXT_BYTES];
        write_text(texts[i]);
        assert_int_equal(key_file_read(&key, path, KEY_SECRET, &error), STATUS_OK);
        assert_memory_equal(key.bytes, key_a, KEY_BYTES);
        key_text(&key, text);
        assert_string_equal(text, KEY_A);
    }
}

static void test_broken_key(void **state)
{
    (void)state;
    static const char nul[] = "JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh\0\n";
    write_text("");
    assert_key_refused(": expected a key, found none in 0 lines");
    write_text("# a comment\n\n# another");
    assert_key_refused(": expected a key, found none in 3 lines");
    write_text("# a comment\nJTKVSB%%)wK0E");
    assert_key_refused(":2: expected a key of 40 characters, found 13");
    write_text(KEY_A "x\n");
    assert_key_refused(":1: expected a key of 40 characters, found 41");
    write_text(KEY_A "\n" KEY_B "\n");
    assert_key_refused(":2: expected no second key");
    write_text(KEY_A "\nx\n");
    assert_key_refused(":2: expected a key of 40 characters, found 1");
    write_text("~TKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6\n");
    assert_key_refused(":1: expected a key in Z85, found 40 characters that are not");
    write_text("$$$$$B%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6\n"); /* five letters that are more than four bytes */
    assert_key_refused(":1: expected a key in Z85, found 40 characters that are not");
    write_text(KEY_A " coordinator\n");
    assert_key_refused(":1: expected one key, and behind it nothing or a # and a remark");
    write_file(nul, sizeof nul - 1, 0600);
    assert_key_refused(":1: expected a key in Z85, found 40 characters that are not");
    unlink(path);
    assert_key_refused(": cannot be opened: No such file or directory");
}

static void test_who_may_read(void **state)
{
    (void)state;
    static const mode_t secret[] = {0600, 0400};
    static const mode_t open[] = {0640, 0604, 0620, 0602, 0660, 0610, 0601, 0777};
    char says[160];
    struct key key;
    for (size_t i = 0; i < sizeof secret / sizeof *secret; i++) {
        write_file(KEY_A, 40, secret[i]);
        assert_int_equal(key_file_read(&key, path, KEY_SECRET, &error), STATUS_OK);
    }
    for (size_t i = 0; i < sizeof open / sizeof *open; i++) {
        write_file(KEY_A, 40, open[i]);
        snprintf(says, sizeof says,
                 ": expected a secret file that only its owner can read (mode 0600), found mode %04o",
                 (unsigned)open[i]);
        assert_key_refused(says);
    }
    write_file(KEY_A, 40, 0644);
    assert_int_equal(key_file_read(&key, path, KEY_PUBLIC, &error), STATUS_OK);
    write_file(KEY_A, 40, 0664);
    assert_int_equal(key_file_read(&key, path, KEY_PUBLIC, &error), STATUS_INPUT);
    assert_says(": expected a file that only its owner can write (mode 0644), found mode 0664");
}

static void test_no_file(void **state)
{
    (void)state;
    unlink(path);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_key_refused(": expected a regular file"); /* and does not wait for somebody to write */
    unlink(path);
    write_text("");
    assert_int_equal(truncate(path, 5 << 20), 0);
    assert_key_refused(": expected at most 4194304 bytes, found 5242880");
}

/* --- lists ------------------------------------------------------------------------------------------------ */

static void test_list(void **state)
{
    (void)state;
    struct key_list list = {0};
    struct key a, other = {{1}};
    memcpy(a.bytes, key_a, KEY_BYTES);
    write_text("# nobody\n");
    assert_int_equal(key_list_read(&list, path, &error), STATUS_OK);
    assert_int_equal(list.count, 0);
    assert_false(key_list_has(&list, &a));
    key_list_finish(&list);
    write_text("# two, and one again\n" KEY_A " # loom\n" KEY_B "\r\n\n" KEY_A);
    assert_int_equal(key_list_read(&list, path, &error), STATUS_OK);
    assert_int_equal(list.count, 3);
    assert_true(key_list_has(&list, &a));
    assert_true(key_list_has(&list, &list.keys[1]));
    assert_memory_not_equal(&list.keys[1], &a, sizeof a);
    assert_false(key_list_has(&list, &other));
    key_list_finish(&list);
}

static void test_broken_list(void **state)
{
    (void)state;
    write_text(KEY_A "\n" KEY_B "\n" KEY_A KEY_A "\n");
    assert_list_refused(":3: expected a key of 40 characters, found 80");
    write_text(KEY_A "\n# loom\nloom " KEY_B "\n");
    assert_list_refused(":3: expected one key, and behind it nothing or a # and a remark");
    write_file(KEY_A, 40, 0646);
    assert_list_refused(": expected a file that only its owner can write (mode 0644), found mode 0646");
}

/* --- folders ---------------------------------------------------------------------------------------------- */

/* FOLDER/NAME into path, which is returned. */
static const char *in_folder(const char *name)
{
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void test_folder(void **state)
{
    (void)state;
    static const struct worker_keys nothing;
    struct coordinator_keys coordinator;
    struct worker_keys worker, own;
    char farm[48], loom[48];
    snprintf(farm, sizeof farm, "%s/farm", folder);
    snprintf(loom, sizeof loom, "%s/farm/loom", folder);
    assert_int_equal(keys_make(farm, &error), STATUS_OK);
    assert_int_equal(keys_add_worker(farm, "loom", &error), STATUS_OK);
    assert_int_equal(coordinator_keys_read(&coordinator, farm, &error), STATUS_OK);
    assert_int_equal(coordinator.workers.count, 2);
    assert_int_equal(coordinator.watchers.count, 1);
    assert_int_equal(worker_keys_read(&worker, farm, &error), STATUS_OK);
    assert_int_equal(worker_keys_read(&own, loom, &error), STATUS_OK);
    assert_memory_equal(&worker.coordinator, &own.coordinator, sizeof own.coordinator);
    assert_memory_not_equal(&worker.secret, &own.secret, sizeof own.secret);
    worker_keys_finish(&own);
    assert_memory_equal(&own, &nothing, sizeof own);
    coordinator_keys_finish(&coordinator);
    assert_memory_equal(&coordinator.secret, &nothing.secret, sizeof nothing.secret);
    coordinator_keys_finish(&coordinator);
    worker_keys_finish(&worker);
    unlink(in_folder("farm/watchers"));
    assert_int_equal(coordinator_keys_read(&coordinator, farm, &error), STATUS_INPUT);
    assert_says(": cannot be opened: No such file or directory");
    assert_null(coordinator.workers.keys);
}

/* A worker's folder will do, where there is no other. */
static void test_watcher(void **state)
{
    (void)state;
    struct worker_keys watcher, worker;
    char farm[48], loom[48];
    snprintf(farm, sizeof farm, "%s/watched", folder);
    snprintf(loom, sizeof loom, "%s/watched/loom", folder);
    assert_int_equal(keys_make(farm, &error), STATUS_OK);
    assert_int_equal(keys_add_worker(farm, "loom", &error), STATUS_OK);
    assert_int_equal(watcher_keys_read(&watcher, farm, &error), STATUS_OK);
    assert_int_equal(worker_keys_read(&worker, farm, &error), STATUS_OK);
    assert_memory_equal(&watcher.coordinator, &worker.coordinator, sizeof worker.coordinator);
    assert_memory_not_equal(&watcher.secret, &worker.secret, sizeof worker.secret);
    assert_int_equal(worker_keys_read(&worker, loom, &error), STATUS_OK);
    assert_int_equal(watcher_keys_read(&watcher, loom, &error), STATUS_OK);
    assert_memory_equal(&watcher, &worker, sizeof worker);
    worker_keys_finish(&worker);
    worker_keys_finish(&watcher);
    unlink(in_folder("watched/loom/worker.key"));
    assert_int_equal(watcher_keys_read(&watcher, loom, &error), STATUS_INPUT);
    in_folder("watched/loom/watcher.key");
    assert_says(": cannot be opened: No such file or directory");
}

static int make_folder(void **state)
{
    (void)state;
    umask(022);
    return mkdtemp(folder) ? in_folder("key")[0] != '/' : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static int use_file(void **state)
{
    (void)state;
    in_folder("key");
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_key, use_file),
        cmocka_unit_test_setup(test_broken_key, use_file),
        cmocka_unit_test_setup(test_who_may_read, use_file),
        cmocka_unit_test_setup(test_no_file, use_file),
        cmocka_unit_test_setup(test_list, use_file),
        cmocka_unit_test_setup(test_broken_list, use_file),
        cmocka_unit_test_setup(test_folder, use_file),
        cmocka_unit_test_setup(test_watcher, use_file),
    };
    return cmocka_run_group_tests_name("keys", tests, make_folder, remove_folder);
}
