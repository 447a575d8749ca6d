/* The journal: what was added is found again, what is broken or of another render is not, and nobody else gets in. */
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/hash.h"
#include "base/log.h"
#include "coordinator/journal.h"

enum { BANDS = 5, BAND_BYTES_MAX = 3000 };

static const struct journal_key key = {{{1, 2}}, {{3}}, {{4}}};

static char folder[] = "/tmp/weft-journal-XXXXXX", output[64], path[80];
static struct error error;

static struct journal *open_with(const struct journal_key *with, bool resume)
{
    enum status status = STATUS_OK;
    struct journal *journal = journal_open(output, with, resume, &status, &error);
    if (!journal)
        fail_msg("%s", error.text);
    return journal;
}

static struct journal *open_again(void)
{
    return open_with(&key, true);
}

/* Band number i of the tests; its bytes go to data[BAND_BYTES_MAX]. */
static struct journal_band make_band(uint32_t i, uint8_t *data)
{
    const struct journal_band band = {.pass = i == 0 ? PASS_SURVEY : PASS_RENDER, .first_row = 10 * i, .rows = i + 1,
                                      .lease_ms = UINT64_C(1) << (10 * i), .size = i == 3 ? 0 : 700 * i + 5};
    for (size_t k = 0; k < band.size; k++)
        data[k] = (uint8_t)hash_u32((uint32_t)(1000 * i + k));
    return band;
}

static void add_bands(struct journal *journal, uint32_t first, uint32_t end)
{
    uint8_t data[BAND_BYTES_MAX], found[BAND_BYTES_MAX];
    for (uint32_t i = first; i < end; i++) {
        struct journal_band band = make_band(i, data);
        assert_int_equal(journal_add(journal, &band, data, &error), STATUS_OK);
        assert_int_equal(journal_read(journal, band.offset, found, band.size, &error), STATUS_OK);
        assert_memory_equal(found, data, band.size);
    }
}

/* The journal holds bands 0 .. count − 1, whole, and no more. */
static void expect_bands(struct journal *journal, uint32_t count)
{
    struct bytes data = {0};
    struct journal_band found;
    uint8_t expected[BAND_BYTES_MAX];
    for (uint32_t i = 0; i < count; i++) {
        struct journal_band band = make_band(i, expected);
        assert_true(journal_next(journal, &found, &data));
        assert_int_equal(found.pass, band.pass);
        assert_int_equal(found.first_row, band.first_row);
        assert_int_equal(found.rows, band.rows);
        assert_true(found.lease_ms == band.lease_ms);
        assert_int_equal(data.size, band.size);
        assert_memory_equal(data.data, expected, band.size);
        assert_int_equal(journal_read(journal, found.offset, expected, band.size, &error), STATUS_OK);
        assert_memory_equal(data.data, expected, band.size);
    }
    assert_false(journal_next(journal, &found, &data));
    bytes_finish(&data);
}

/* A journal of all bands, closed. */
static void leave_bands(void)
{
    unlink(path);
    struct journal *journal = open_again();
    add_bands(journal, 0, BANDS);
    journal_close(&journal, false);
    assert_null(journal);
}

static off_t size_of_file(void)
{
    struct stat info;
    return stat(path, &info) == 0 ? info.st_size : -1;
}

static void test_found_again(void **state)
{
    (void)state;
    leave_bands();
    struct journal *journal = open_again();
    expect_bands(journal, BANDS);
    journal_close(&journal, false);
    journal = open_again();
    expect_bands(journal, BANDS);
    journal_close(&journal, true);
    assert_int_equal(size_of_file(), -1);
    journal_close(&journal, true);
}

/* It goes on behind what it had. */
static void test_goes_on(void **state)
{
    (void)state;
    struct journal *journal = open_again();
    add_bands(journal, 0, 2);
    journal_close(&journal, false);
    journal = open_again();
    expect_bands(journal, 2);
    add_bands(journal, 2, BANDS);
    journal_close(&journal, false);
    journal = open_again();
    expect_bands(journal, BANDS);
    journal_close(&journal, true);
}

/* That a band counts no more is found after it, and what comes later is found too. */
static void test_undone(void **state)
{
    (void)state;
    struct bytes data = {0};
    struct journal_band found, band = make_band(2, (uint8_t[BAND_BYTES_MAX]){0});
    struct journal *journal = open_again();
    add_bands(journal, 0, 3);
    assert_int_equal(journal_undo(journal, &band, 1, &error), STATUS_OK);
    add_bands(journal, 2, 3);
    journal_close(&journal, false);
    journal = open_again();
    for (uint32_t i = 0; i < 5; i++) {
        assert_true(journal_next(journal, &found, &data));
        assert_int_equal(found.undone, i == 3);
        assert_int_equal(found.first_row, i < 3 ? 10 * i : 20);
        assert_int_equal(data.size, i == 3 ? 0 : make_band(i < 3 ? i : 2, (uint8_t[BAND_BYTES_MAX]){0}).size);
    }
    assert_false(journal_next(journal, &found, &data));
    bytes_finish(&data);
    journal_close(&journal, true);
}

static void test_cleared(void **state)
{
    (void)state;
    for (int resume = 0; resume < 2; resume++) {
        struct journal *journal = open_with(&key, resume);
        add_bands(journal, 0, BANDS);
        assert_int_equal(journal_clear(journal, &error), STATUS_OK);
        add_bands(journal, 0, 2);
        journal_close(&journal, false);
        journal = open_again();
        expect_bands(journal, resume ? 2 : 0);
        journal_close(&journal, true);
    }
}

static void test_empty(void **state)
{
    (void)state;
    struct journal *journal = open_again();
    expect_bands(journal, 0);
    assert_true(size_of_file() > 0);
    journal_close(&journal, false);
    assert_int_equal(size_of_file(), -1);
}

/* Bands that an earlier run left are not lost by one that ends before it has looked at them. */
static void test_closed_at_once(void **state)
{
    (void)state;
    leave_bands();
    struct journal *journal = open_again();
    journal_close(&journal, false);
    journal = open_again();
    expect_bands(journal, BANDS);
    journal_close(&journal, true);
}

/* However much of the end is missing, the bands before it are found, and the journal goes on behind them. */
static void test_cut_short(void **state)
{
    (void)state;
    leave_bands();
    off_t whole = size_of_file(), head = -1, end[BANDS + 1];
    struct journal *journal = open_again();
    struct journal_band band;
    struct bytes data = {0};
    for (int i = 0; i < BANDS && journal_next(journal, &band, &data); i++) {
        head = i == 0 ? (off_t)band.offset - 28 : head;
        end[i] = (off_t)(band.offset + band.size) + 16;
    }
    bytes_finish(&data);
    journal_close(&journal, false);
    assert_int_equal(end[BANDS - 1], whole);
    for (off_t length = whole; length >= head; length -= length > whole - 100 ? 1 : 37) {
        uint32_t left = 0;
        leave_bands();
        assert_int_equal(truncate(path, length), 0);
        while (left < BANDS && end[left] <= length)
            left++;
        journal = open_again();
        expect_bands(journal, left);
        add_bands(journal, left, BANDS);
        journal_close(&journal, false);
        assert_int_equal(size_of_file(), whole);
        journal = open_again();
        expect_bands(journal, BANDS);
        journal_close(&journal, true);
    }
}

/* Any byte that is changed: the bands before it are found, the one that it is in and those behind are not. */
static void test_changed(void **state)
{
    (void)state;
    leave_bands();
    off_t whole = size_of_file();
    for (off_t at = 0; at < whole; at += 13) {
        uint8_t byte, data[BAND_BYTES_MAX];
        uint32_t left = 0;
        off_t end = 108; /* of the head */
        leave_bands();
        int fd = open(path, O_RDWR);
        assert_int_equal(pread(fd, &byte, 1, at), 1);
        byte ^= (uint8_t)(1 << at % 8);
        assert_int_equal(pwrite(fd, &byte, 1, at), 1);
        close(fd);
        for (end += 28 + (off_t)make_band(0, data).size + 16; end <= at; left++)
            end += 28 + (off_t)make_band(left + 1, data).size + 16;
        struct journal *journal = open_again();
        expect_bands(journal, left);
        journal_close(&journal, true);
    }
}

static void test_other_renders(void **state)
{
    (void)state;
    static const struct journal_key others[] = {{{{9}}, {{3}}, {{4}}}, {{{1, 2}}, {{9}}, {{4}}}, {{{1, 2}}, {{3}}, {{9}}}};
    for (int i = 0; i < 3; i++) {
        leave_bands();
        struct journal *journal = open_with(&others[i], true);
        expect_bands(journal, 0);
        journal_close(&journal, false);
        assert_int_equal(size_of_file(), -1);
    }
}

/* It can be told of a journal without opening it, and without a trace. */
static void test_what_is_left(void **state)
{
    (void)state;
    struct journal_key other = key;
    other.settings.bytes[7] ^= 1;
    unlink(path);
    assert_false(journal_is_left(output, &key));
    assert_int_equal(size_of_file(), -1);
    leave_bands();
    off_t size = size_of_file();
    assert_true(journal_is_left(output, &key));
    assert_false(journal_is_left(output, &other));
    assert_int_equal(size_of_file(), size);
    assert_int_equal(truncate(path, 20), 0);
    assert_false(journal_is_left(output, &key));
    unlink(path);
}

static void test_rejected(void **state)
{
    (void)state;
    struct journal_band band;
    struct bytes data = {0};
    leave_bands();
    struct journal *journal = open_again();
    for (int i = 0; i < 3; i++)
        assert_true(journal_next(journal, &band, &data));
    journal_reject(journal);
    assert_false(journal_next(journal, &band, &data));
    add_bands(journal, 2, BANDS);
    journal_close(&journal, false);
    bytes_finish(&data);
    journal = open_again();
    expect_bands(journal, BANDS);
    journal_close(&journal, true);
}

/* One that is not to be resumed leaves the journal as it is. */
static void test_not_resumed(void **state)
{
    (void)state;
    leave_bands();
    off_t whole = size_of_file();
    struct journal *journal = open_with(&key, false);
    expect_bands(journal, 0);
    add_bands(journal, 1, 3);
    journal_close(&journal, true);
    assert_int_equal(size_of_file(), whole);
    assert_int_equal(unlink(path), 0);
    journal = open_with(&key, false);
    add_bands(journal, 1, 3);
    assert_int_equal(size_of_file(), 0); /* the lock */
    journal_close(&journal, false);
    assert_int_equal(size_of_file(), -1);
}

static void test_locked(void **state)
{
    (void)state;
    for (int resume = 0; resume < 2; resume++) {
        struct journal *journal = open_with(&key, resume);
        add_bands(journal, 0, 1);
        for (int other = 0; other < 2; other++) {
            enum status status = STATUS_OK;
            assert_null(journal_open(output, &key, other, &status, &error));
            assert_int_equal(status, STATUS_OUTPUT);
            assert_non_null(strstr(error.text, "another weft is rendering it"));
        }
        add_bands(journal, 1, 2);
        journal_close(&journal, true);
        assert_int_equal(size_of_file(), -1);
    }
}

static void test_no_folder(void **state)
{
    (void)state;
    enum status status = STATUS_OK;
    assert_null(journal_open("/nowhere/at/all.png", &key, true, &status, &error));
    assert_int_equal(status, STATUS_OUTPUT);
    assert_non_null(strstr(error.text, "/nowhere/at/all.png: cannot open the journal /nowhere/at/.all.png.journal"));
}

/* A file that may not grow stands for a full disk: what was written before is there when there is room again. */
static void test_full_disk(void **state)
{
    (void)state;
    struct rlimit before;
    uint8_t data[BAND_BYTES_MAX];
    struct journal *journal = open_again();
    add_bands(journal, 0, 2);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &(struct rlimit){(rlim_t)size_of_file() + 100, before.rlim_max}), 0);
    struct journal_band band = make_band(2, data);
    enum status status = journal_add(journal, &band, data, &error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(status, STATUS_OUTPUT);
    assert_non_null(strstr(error.text, ".out.png.journal cannot be written: File too large"));
    journal_close(&journal, false);
    journal = open_again();
    expect_bands(journal, 2);
    journal_close(&journal, true);
}

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(output, sizeof output, "%s/out.png", folder);
    snprintf(path, sizeof path, "%s/.out.png.journal", folder);
    log_start("journal", LOG_ERROR);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_found_again), cmocka_unit_test(test_goes_on),       cmocka_unit_test(test_empty),
        cmocka_unit_test(test_undone),        cmocka_unit_test(test_cleared),
        cmocka_unit_test(test_closed_at_once), cmocka_unit_test(test_cut_short),  cmocka_unit_test(test_changed),
        cmocka_unit_test(test_other_renders), cmocka_unit_test(test_what_is_left), cmocka_unit_test(test_rejected),
        cmocka_unit_test(test_not_resumed),
        cmocka_unit_test(test_locked),        cmocka_unit_test(test_no_folder),   cmocka_unit_test(test_full_disk),
    };
    return cmocka_run_group_tests_name("journal", tests, make_folder, remove_folder);
}
