/* Byte strings: growing, little-endian writing and reading, truncation, whole files. */
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

#include "base/bytes.h"
#include "base/memory.h"

static void put_everything(struct bytes *bytes)
{
    bytes_put_u8(bytes, 0x01);
    bytes_put_u16(bytes, 0x0302);
    bytes_put_u32(bytes, 0x07060504);
    bytes_put_u64(bytes, 0x0f0e0d0c0b0a0908);
    bytes_put_f64(bytes, -2.5);
    bytes_put_string(bytes, "weft");
}

/* The layout goes over the wire and into journals, so it is pinned byte by byte. */
static void test_layout(void **state)
{
    (void)state;
    static const uint8_t expected[] = {1,  2,  3,  4,  5, 6, 7, 8, 9, 10, 11,   12,   13, 14, 15,
                                       0,  0,  0,  0,  0, 0, 4, 0xc0, /* −2.5 */
                                       4,  0,  'w', 'e', 'f', 't'};
    struct bytes bytes = {0};
    put_everything(&bytes);
    assert_int_equal(bytes.size, sizeof expected);
    assert_memory_equal(bytes.data, expected, sizeof expected);
    bytes_finish(&bytes);
    assert_null(bytes.data);
    assert_int_equal(bytes.size, 0);
}

static void test_reading(void **state)
{
    (void)state;
    struct bytes bytes = {0};
    char text[8];
    put_everything(&bytes);
    struct byte_reader reader = byte_reader_of(bytes.data, bytes.size);
    assert_int_equal(byte_reader_u8(&reader), 0x01);
    assert_int_equal(byte_reader_u16(&reader), 0x0302);
    assert_int_equal(byte_reader_u32(&reader), 0x07060504);
    assert_true(byte_reader_u64(&reader) == 0x0f0e0d0c0b0a0908);
    assert_true(byte_reader_f64(&reader) == -2.5);
    assert_false(byte_reader_done(&reader));
    byte_reader_string(&reader, text, sizeof text);
    assert_string_equal(text, "weft");
    assert_true(byte_reader_done(&reader));
    bytes_finish(&bytes);
}

/* However short the bytes are cut (in a block of their own, so that the sanitizer sees any reading beyond it), the
 * reader fails for good and yields zeros. */
static void test_truncation(void **state)
{
    (void)state;
    struct bytes bytes = {0};
    put_everything(&bytes);
    for (size_t size = 0; size < bytes.size; size++) {
        uint8_t *cut = memory_array(size, 1);
        char text[8] = "before";
        memcpy(cut, bytes.data, size);
        struct byte_reader reader = byte_reader_of(cut, size);
        byte_reader_u8(&reader);
        byte_reader_u16(&reader);
        byte_reader_u32(&reader);
        byte_reader_u64(&reader);
        byte_reader_f64(&reader);
        byte_reader_string(&reader, text, sizeof text);
        assert_true(reader.failed);
        assert_false(byte_reader_done(&reader));
        assert_string_equal(text, "");
        assert_int_equal(byte_reader_u8(&reader), 0);
        assert_true(byte_reader_f64(&reader) == 0);
        assert_null(byte_reader_take(&reader, 0));
        free(cut);
    }
    bytes_finish(&bytes);
}

/* A length near the top of size_t must not wrap around. */
static void test_take(void **state)
{
    (void)state;
    static const uint8_t data[4] = {1, 2, 3, 4};
    struct byte_reader reader = byte_reader_of(data, sizeof data);
    assert_ptr_equal(byte_reader_take(&reader, 1), data);
    assert_ptr_equal(byte_reader_take(&reader, 3), data + 1);
    assert_ptr_equal(byte_reader_take(&reader, 0), data + 4);
    assert_true(byte_reader_done(&reader));
    reader.at = 2;
    assert_null(byte_reader_take(&reader, SIZE_MAX));
    assert_true(reader.failed);
    assert_int_equal(reader.at, 2);
}

static void assert_string_read(const void *data, size_t size, size_t capacity, const char *expected)
{
    char text[16];
    memset(text, '#', sizeof text);
    struct byte_reader reader = byte_reader_of(data, size);
    byte_reader_string(&reader, text, capacity);
    assert_int_equal(reader.failed, expected == NULL);
    assert_string_equal(text, expected ? expected : "");
    for (size_t i = capacity; i < sizeof text; i++)
        assert_int_equal(text[i], '#');
}

static void test_strings(void **state)
{
    (void)state;
    assert_string_read("\3\0abc", 5, 4, "abc");
    assert_string_read("\0\0", 2, 1, "");
    assert_string_read("\3\0abc", 5, 3, NULL);  /* no room for the NUL */
    assert_string_read("\3\0a\0c", 5, 16, NULL); /* a NUL inside */
    assert_string_read("\4\0abc", 5, 16, NULL); /* cut short */
    assert_string_read("\3", 1, 16, NULL);
}

static void test_long_string(void **state)
{
    (void)state;
    char *text = memory_array(70001, 1);
    struct bytes bytes = {0};
    memset(text, 'x', 70000);
    bytes_put_string(&bytes, text);
    assert_int_equal(bytes.size, 2 + 65535);
    assert_int_equal(bytes.data[0], 0xff);
    assert_int_equal(bytes.data[1], 0xff);
    bytes_finish(&bytes);
    free(text);
}

static void test_growing(void **state)
{
    (void)state;
    struct bytes bytes = {0};
    bytes_put(&bytes, NULL, 0);
    assert_null(bytes.data);
    for (uint32_t i = 0; i < 100000; i++)
        bytes_put_u32(&bytes, i);
    memset(bytes_extend(&bytes, 5), 0xaa, 5);
    assert_int_equal(bytes.size, 400005);
    assert_true(bytes.capacity >= bytes.size);
    struct byte_reader reader = byte_reader_of(bytes.data, bytes.size);
    for (uint32_t i = 0; i < 100000; i++)
        assert_int_equal(byte_reader_u32(&reader), i);
    bytes_finish(&bytes);
}

/* --- files ------------------------------------------------------------------------------------------------ */

static char folder[] = "/tmp/weft-bytes-XXXXXX";

static char *path_of(const char *name)
{
    return memory_format("%s/%s", folder, name);
}

static char *write_file(const char *name, size_t size)
{
    char *path = path_of(name);
    FILE *file = fopen(path, "we");
    assert_non_null(file);
    for (size_t i = 0; i < size; i++)
        fputc((int)(i * 7 % 251), file);
    assert_int_equal(fclose(file), 0);
    return path;
}

static void assert_reads(size_t size, size_t limit)
{
    char *path = write_file("file", size);
    struct bytes bytes = {0};
    struct error error;
    assert_int_equal(bytes_read_file(&bytes, path, limit, &error), STATUS_OK);
    assert_int_equal(bytes.size, size);
    for (size_t i = 0; i < size; i++)
        assert_int_equal(bytes.data[i], i * 7 % 251);
    assert_true(bytes.capacity > size);
    assert_int_equal(bytes.data[size], 0);
    bytes_finish(&bytes);
    free(path);
}

static void test_read_file(void **state)
{
    (void)state;
    assert_reads(0, 0);
    assert_reads(0, 100);
    assert_reads(1, 1);
    assert_reads(65536, 65536); /* as long as a step of reading */
    assert_reads(65537, 70000);
    assert_reads(300000, 300000);
}

/* `path` is freed. */
static void assert_unreadable(char *path, size_t limit, const char *says)
{
    struct bytes bytes = {0};
    struct error error = {""};
    assert_int_equal(bytes_read_file(&bytes, path, limit, &error), STATUS_INPUT);
    if (!strstr(error.text, says) || strncmp(error.text, path, strlen(path)) != 0)
        fail_msg("expected %s and \"%s\" in the sentence: %s", path, says, error.text);
    assert_null(bytes.data);
    assert_int_equal(bytes.size, 0);
    free(path);
}

static void test_unreadable_files(void **state)
{
    (void)state;
    char *fifo = path_of("fifo");
    assert_int_equal(mkfifo(fifo, 0600), 0);
    assert_unreadable(fifo, 100, "regular file"); /* and does not wait for a writer */
    assert_unreadable(memory_string(folder), 100, "regular file");
    assert_unreadable(memory_string("/dev/zero"), 100, "regular file");
    assert_unreadable(path_of("missing"), 100, "No such file");
    assert_unreadable(path_of("missing/below"), 100, "No such file");
    assert_unreadable(write_file("large", 101), 100, "at most 100 bytes");
    assert_unreadable(write_file("large", 1), 0, "at most 0 bytes");
    assert_unreadable(write_file("large", 200000), 100000, "at most 100000 bytes");
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const names[] = {"file", "fifo", "large"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char *path = path_of(names[i]);
        unlink(path);
        free(path);
    }
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_reading),
        cmocka_unit_test(test_truncation),
        cmocka_unit_test(test_take),
        cmocka_unit_test(test_strings),
        cmocka_unit_test(test_long_string),
        cmocka_unit_test(test_growing),
        cmocka_unit_test(test_read_file),
        cmocka_unit_test(test_unreadable_files),
    };
    return cmocka_run_group_tests_name("bytes", tests, make_folder, remove_folder);
}
