/*
 * Encoding pixels and writing image files: what is in them, and what is left when something fails. This
 * program takes the place of the C library's functions that write, so that the Nth call can be made to fail.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/hash.h"
#include "base/memory.h"
#include "image/image.h"
#include "image/writer.h"
#include "math/colour.h"

enum { WIDTH = 37, HEIGHT = 23 };

/* --- faults ----------------------------------------------------------------------------------------------- */

static int fault_at;         /* the call that fails, counted from 1; 0 for none */
static int fault_calls;      /* calls so far */
static const char *fault_in; /* the function that failed, or NULL */
static bool knows_nameless = true; /* the file system */

static int fault_due(const char *function)
{
    fault_calls++;
    if (fault_calls != fault_at)
        return 0;
    fault_in = function;
    errno = EIO;
    return 1;
}

static void fault_set(int at)
{
    fault_at = at;
    fault_calls = 0;
    fault_in = NULL;
}

int openat(int folder, const char *path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    if ((flags & O_TMPFILE) == O_TMPFILE && !knows_nameless) {
        errno = EOPNOTSUPP;
        return -1;
    }
    return fault_due("openat") ? -1 : (int)syscall(SYS_openat, folder, path, flags, mode);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset)
{
    return fault_due("pwrite") ? -1 : syscall(SYS_pwrite64, fd, data, size, offset);
}

int fsync(int fd)
{
    return fault_due("fsync") ? -1 : (int)syscall(SYS_fsync, fd);
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags)
{
    return fault_due("linkat") ? -1 : (int)syscall(SYS_linkat, from_folder, from, to_folder, to, flags);
}

int renameat(int from_folder, const char *from, int to_folder, const char *to)
{
    return fault_due("renameat") ? -1 : (int)syscall(SYS_renameat2, from_folder, from, to_folder, to, 0);
}

/* Only the closing of a file that was written matters; a close that fails has closed none the less. */
int close(int fd)
{
    struct stat found;
    int written = fstat(fd, &found) == 0 && S_ISREG(found.st_mode);
    int result = (int)syscall(SYS_close, fd);
    return written && fault_due("close") ? -1 : result;
}

/* --- a folder for each test ------------------------------------------------------------------------------- */

struct place {
    char *folder, *path; /* path: an output in the folder */
};

static int place_make(void **state)
{
    const char *base = getenv("TMPDIR");
    struct place *place = memory_array(1, sizeof *place);
    place->folder = memory_format("%s/weft-writer-XXXXXX", base ? base : P_tmpdir);
    if (!mkdtemp(place->folder))
        return -1;
    place->path = memory_format("%s/out.img", place->folder);
    *state = place;
    return 0;
}

static int place_remove(void **state)
{
    struct place *place = *state;
    unlink(place->path);
    int result = rmdir(place->folder);
    free(place->path);
    free(place->folder);
    free(place);
    return result;
}

static int count_entries(const char *folder)
{
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    int count = 0;
    for (struct dirent *entry = readdir(dir); entry; entry = readdir(dir))
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(dir);
    return count;
}

static void save_text(const char *path, const char *text)
{
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    assert_int_equal(fclose(out), 0);
}

static struct bytes load(const char *path)
{
    struct bytes file = {0};
    struct error error;
    if (bytes_read_file(&file, path, 1 << 24, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    return file;
}

static void assert_text(const char *path, const char *text)
{
    struct bytes file = load(path);
    assert_int_equal(file.size, strlen(text));
    assert_memory_equal(file.data, text, file.size);
    bytes_finish(&file);
}

/* --- pictures --------------------------------------------------------------------------------------------- */

static struct image_description description_of(enum pixel_format format)
{
    return (struct image_description){WIDTH, HEIGHT, format, "weft 1.2", "a scene"};
}

/* From −0.5 to 1.5, so that the codes must clamp. */
static double light_at(uint32_t x, uint32_t y, uint32_t channel)
{
    return hash_u32(x + 1000 * y + 1000000 * channel + 1) * 0x1p-31 - 0.5;
}

static void encode_row(enum pixel_format format, uint32_t y, uint8_t *out)
{
    struct vec3 pixels[WIDTH];
    for (uint32_t x = 0; x < WIDTH; x++)
        pixels[x] = vec3_make(light_at(x, y, 0), light_at(x, y, 1), light_at(x, y, 2));
    pixel_format_encode(format, pixels, WIDTH, out);
}

/* Creates, writes and completes; the first failure ends it. */
static enum status write_picture(const char *path, enum pixel_format format, struct error *error)
{
    struct image_description description = description_of(format);
    enum status status;
    struct image_writer *writer = image_writer_create(path, &description, &status, error);
    assert_true((writer == NULL) == (status != STATUS_OK));
    uint8_t row[WIDTH * 12];
    for (uint32_t y = 0; y < HEIGHT && status == STATUS_OK; y++) {
        encode_row(format, y, row);
        status = image_writer_row(writer, row, error);
    }
    if (status == STATUS_OK)
        status = image_writer_complete(&writer, error);
    image_writer_abandon(&writer);
    assert_null(writer);
    return status;
}

static void write_well(const char *path, enum pixel_format format)
{
    struct error error;
    if (write_picture(path, format, &error) != STATUS_OK)
        fail_msg("%s", error.text);
}

/* --- encoding --------------------------------------------------------------------------------------------- */

/* sRGB of 0.5 is 0.735356983: 187.5 of 255, 48191.6 of 65535. */
static void test_encoded_bytes(void **state)
{
    (void)state;
    const struct vec3 pixels[] = {{0, 0.5, 1}, {-2, 300, NAN}};
    static const uint8_t srgb8[] = {0, 188, 255, 0, 255, 0};
    static const uint8_t srgb16[] = {0, 0, 0xbc, 0x40, 0xff, 0xff, 0, 0, 0xff, 0xff, 0, 0};
    static const uint8_t linear[] = {0, 0, 0, 0,    0, 0, 0, 0x3f,       0, 0, 0x80, 0x3f,
                                     0, 0, 0, 0xc0, 0, 0, 0x96, 0x43, 0, 0, 0xc0, 0x7f};
    uint8_t out[25];
    assert_int_equal(pixel_format_bytes(PIXEL_SRGB8), 3);
    assert_int_equal(pixel_format_bytes(PIXEL_SRGB16), 6);
    assert_int_equal(pixel_format_bytes(PIXEL_LINEAR), 12);
    out[6] = 0xee;
    pixel_format_encode(PIXEL_SRGB8, pixels, 2, out);
    assert_memory_equal(out, srgb8, 6);
    assert_int_equal(out[6], 0xee);
    pixel_format_encode(PIXEL_SRGB16, pixels, 2, out);
    assert_memory_equal(out, srgb16, 12);
    pixel_format_encode(PIXEL_LINEAR, pixels, 2, out);
    assert_memory_equal(out, linear, 24);
}

/* Many pixels at once are encoded as one at a time. */
static void test_encoded_rows(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static struct vec3 pixels[COUNT];
    static uint8_t all[COUNT * 12], one[COUNT * 12];
    for (uint32_t i = 0; i < COUNT; i++)
        pixels[i] = vec3_make(light_at(i, 0, 0), light_at(i, 0, 1), light_at(i, 0, 2));
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        size_t pixel_bytes = pixel_format_bytes(format);
        pixel_format_encode(format, pixels, COUNT, all);
        for (size_t i = 0; i < COUNT; i++)
            pixel_format_encode(format, &pixels[i], 1, one + i * pixel_bytes);
        assert_memory_equal(all, one, COUNT * pixel_bytes);
    }
}

/* --- files ------------------------------------------------------------------------------------------------ */

static float expected_light(enum pixel_format format, double light)
{
    double highest = format == PIXEL_SRGB8 ? 255 : 65535;
    if (format == PIXEL_LINEAR)
        return (float)light;
    return (float)colour_decode_srgb(floor(highest * colour_encode_srgb(light) + 0.5) / highest);
}

static void test_round_trips(void **state)
{
    struct place *place = *state;
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        struct image image = {0};
        struct error error;
        write_well(place->path, format);
        assert_int_equal(image_read_file(&image, place->path, &error), STATUS_OK);
        assert_int_equal(image.width, WIDTH);
        assert_int_equal(image.height, HEIGHT);
        for (uint32_t i = 0; i < WIDTH * HEIGHT * 3; i++)
            assert_true(image.rgb[i] == expected_light(format, light_at(i / 3 % WIDTH, i / 3 / WIDTH, i % 3)));
        image_finish(&image);
        assert_int_equal(count_entries(place->folder), 1);
    }
}

static void test_same_rows_give_same_bytes(void **state)
{
    struct place *place = *state;
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        write_well(place->path, format);
        struct bytes first = load(place->path);
        write_well(place->path, format);
        struct bytes second = load(place->path);
        assert_int_equal(first.size, second.size);
        assert_memory_equal(first.data, second.data, first.size);
        bytes_finish(&first);
        bytes_finish(&second);
    }
}

/* The next chunk's type into name[5]; returns its data and sets *size. */
static const uint8_t *next_chunk(struct byte_reader *reader, char *name, size_t *size)
{
    *size = __builtin_bswap32(byte_reader_u32(reader));
    const uint8_t *type = byte_reader_take(reader, 4);
    const uint8_t *data = byte_reader_take(reader, *size);
    byte_reader_u32(reader);
    assert_false(reader->failed);
    memcpy(name, type, 4);
    name[4] = 0;
    return data;
}

static void check_chunk(struct byte_reader *reader, const char *name, const void *data, size_t size)
{
    char found[5];
    size_t found_size;
    const uint8_t *found_data = next_chunk(reader, found, &found_size);
    assert_string_equal(found, name);
    assert_int_equal(found_size, size);
    assert_memory_equal(found_data, data, size);
}

static void test_chunks_of_png(void **state)
{
    struct place *place = *state;
    write_well(place->path, PIXEL_SRGB16);
    struct bytes file = load(place->path);
    struct byte_reader reader = byte_reader_of(file.data, file.size);
    char name[5];
    size_t size;
    assert_memory_equal(byte_reader_take(&reader, 8), "\x89PNG\r\n\x1a\n", 8);
    check_chunk(&reader, "IHDR", "\0\0\0\x25\0\0\0\x17\x10\x02\0\0\0", 13);
    check_chunk(&reader, "sRGB", "\0", 1);
    check_chunk(&reader, "tEXt", "Software\0weft 1.2", 17);
    check_chunk(&reader, "tEXt", "Source\0a scene", 14);
    next_chunk(&reader, name, &size);
    assert_string_equal(name, "IDAT");
    check_chunk(&reader, "IEND", "", 0);
    assert_true(byte_reader_done(&reader));
    bytes_finish(&file);
}

static void test_text_beyond_ascii(void **state)
{
    struct place *place = *state;
    struct image_description description = {1, 1, PIXEL_SRGB8, "weft", "gr\xc3\xbcn"};
    enum status status;
    struct error error;
    struct image_writer *writer = image_writer_create(place->path, &description, &status, &error);
    assert_non_null(writer);
    assert_int_equal(image_writer_row(writer, (const uint8_t *)"abc", &error), STATUS_OK);
    assert_int_equal(image_writer_complete(&writer, &error), STATUS_OK);
    struct bytes file = load(place->path);
    struct byte_reader reader = byte_reader_of(file.data + 33 + 13, file.size - 33 - 13);
    check_chunk(&reader, "tEXt", "Software\0weft", 13);
    check_chunk(&reader, "iTXt", "Source\0\0\0\0\0gr\xc3\xbcn", 16);
    bytes_finish(&file);
}

static void test_bytes_of_pfm(void **state)
{
    struct place *place = *state;
    write_well(place->path, PIXEL_LINEAR);
    struct bytes file = load(place->path);
    uint8_t row[WIDTH * 12];
    assert_int_equal(file.size, 14 + 12 * WIDTH * HEIGHT);
    assert_memory_equal(file.data, "PF\n37 23\n-1.0\n", 14);
    encode_row(PIXEL_LINEAR, HEIGHT - 1, row);
    assert_memory_equal(file.data + 14, row, sizeof row);
    bytes_finish(&file);
}

static void test_mode_follows_umask(void **state)
{
    struct place *place = *state;
    struct stat found;
    mode_t before = umask(027);
    write_well(place->path, PIXEL_SRGB8);
    umask(before);
    assert_int_equal(stat(place->path, &found), 0);
    assert_int_equal(found.st_mode & 07777, 0640);
}

static void test_path_without_folder(void **state)
{
    struct place *place = *state;
    char *before = getcwd(NULL, 0);
    assert_int_equal(chdir(place->folder), 0);
    write_well("out.img", PIXEL_SRGB8);
    assert_int_equal(chdir(before), 0);
    free(before);
    assert_int_equal(access(place->path, R_OK), 0);
}

/* --- what stays as it was --------------------------------------------------------------------------------- */

static void test_abandoned(void **state)
{
    struct place *place = *state;
    save_text(place->path, "old");
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        struct image_description description = description_of(format);
        enum status status;
        struct error error;
        struct image_writer *writer = image_writer_create(place->path, &description, &status, &error);
        assert_non_null(writer);
        uint8_t row[WIDTH * 12] = {0};
        assert_int_equal(image_writer_row(writer, row, &error), STATUS_OK);
        assert_int_equal(count_entries(place->folder), knows_nameless ? 1 : 2);
        image_writer_abandon(&writer);
        assert_null(writer);
        assert_int_equal(count_entries(place->folder), 1);
        assert_text(place->path, "old");
    }
}

static void test_leftover_is_replaced(void **state)
{
    struct place *place = *state;
    char *leftover = memory_format("%s/.out.img.%ld.part", place->folder, (long)getpid());
    save_text(leftover, "of a killed process");
    write_well(place->path, PIXEL_SRGB8);
    assert_int_equal(count_entries(place->folder), 1);
    save_text(leftover, "of a killed process");
    knows_nameless = false;
    write_well(place->path, PIXEL_SRGB8);
    knows_nameless = true;
    assert_int_equal(count_entries(place->folder), 1);
    free(leftover);
}

static void check_refused(const char *path, const char *sentence)
{
    struct error error;
    assert_int_equal(write_picture(path, PIXEL_SRGB8, &error), STATUS_OUTPUT);
    char *expected = memory_format("%s: %s", path, sentence);
    assert_string_equal(error.text, expected);
    free(expected);
}

static void test_places_that_cannot_be_written(void **state)
{
    struct place *place = *state;
    char *missing = memory_format("%s/no/out.png", place->folder);
    char *sentence = memory_format("the folder %s/no is not there", place->folder);
    char *slash = memory_format("%s/", place->folder);
    check_refused(missing, sentence);
    check_refused(place->folder, "expected a regular file or a new one, found a folder");
    check_refused(slash, "expected the name of a file, found none after the folder");
    check_refused("/dev/null", "expected a regular file or a new one, found a device");
    assert_int_equal(mkfifo(place->path, 0600), 0);
    check_refused(place->path, "expected a regular file or a new one, found a pipe");
    assert_int_equal(unlink(place->path), 0);
    assert_int_equal(count_entries(place->folder), 0);
    free(missing);
    free(sentence);
    free(slash);
}

/* Root may write anywhere, so it becomes somebody else for this. */
static void test_folder_that_is_read_only(void **state)
{
    struct place *place = *state;
    const char *sentence = "cannot create a temporary file beside it: Permission denied";
    uid_t user = geteuid();
    assert_int_equal(chmod(place->folder, 0555), 0);
    if (user == 0)
        assert_int_equal(seteuid(65534), 0);
    check_refused(place->path, sentence);
    assert_int_equal(seteuid(user), 0);
    assert_int_equal(chmod(place->folder, 0700), 0);
}

/* A limit on file size stands for a full disk. */
static void check_limited(struct place *place, enum pixel_format format, rlim_t bytes)
{
    struct rlimit before;
    struct error error;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &(struct rlimit){bytes, before.rlim_max}), 0);
    enum status status = write_picture(place->path, format, &error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(status, STATUS_OUTPUT);
    char *expected = memory_format("%s: cannot be written: File too large", place->path);
    assert_string_equal(error.text, expected);
    free(expected);
    assert_int_equal(count_entries(place->folder), 1);
    assert_text(place->path, "old");
}

static void test_full_disk(void **state)
{
    struct place *place = *state;
    save_text(place->path, "old");
    void (*before)(int) = signal(SIGXFSZ, SIG_IGN);
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        check_limited(place, format, 0);
        check_limited(place, format, 5);
        check_limited(place, format, 1000);
    }
    signal(SIGXFSZ, before);
}

/* A fault after the rename, in syncing the folder, leaves the new file; any other leaves the old one. */
static void check_after_fault(struct place *place, enum status status, const struct error *error, int renamed)
{
    assert_int_equal(status, STATUS_OUTPUT);
    assert_ptr_equal(strstr(error->text, place->path), error->text);
    assert_non_null(strstr(error->text, "Input/output error"));
    assert_int_equal(count_entries(place->folder), 1);
    if (!renamed)
        assert_text(place->path, "old");
}

/* Writes a picture over "old" with the Nth call failing; returns the function that failed, NULL if none. */
static const char *write_with_fault(struct place *place, enum pixel_format format, int n, int renamed)
{
    struct error error;
    save_text(place->path, "old");
    fault_set(n);
    enum status status = write_picture(place->path, format, &error);
    const char *function = fault_in;
    fault_set(0);
    if (function)
        check_after_fault(place, status, &error, renamed);
    else
        assert_int_equal(status, STATUS_OK);
    return function;
}

/* The calls are of order[count], each once or more in a row; the last but one puts the file in place. */
static void check_each_call(struct place *place, const char *const *order, int count)
{
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        int at = 0;
        const char *function = write_with_fault(place, format, 1, 0);
        for (int n = 2; function; n++) {
            if (strcmp(function, order[at]) != 0)
                at++;
            assert_true(at < count);
            assert_string_equal(function, order[at]);
            function = write_with_fault(place, format, n, at >= count - 2);
        }
        assert_int_equal(at, count - 1);
    }
}

static void test_each_call_failing_in_turn(void **state)
{
    static const char *const nameless[] = {"openat", "pwrite", "fsync", "linkat", "close", "renameat", "fsync"};
    static const char *const named[] = {"openat", "pwrite", "fsync", "close", "renameat", "fsync"};
    check_each_call(*state, nameless, 7);
    knows_nameless = false;
    check_each_call(*state, named, 6);
    knows_nameless = true;
}

static void test_abandoned_with_a_name(void **state)
{
    knows_nameless = false;
    test_abandoned(state);
    knows_nameless = true;
}

/* Row 100 of 200 fails: noise of 16 bits fills the encoder's buffer before the end. */
static void test_row_that_fails_leaves_nothing(void **state)
{
    struct place *place = *state;
    struct image_description description = {1000, 200, PIXEL_SRGB16, "weft", "noise"};
    enum status status;
    struct error error;
    struct image_writer *writer = image_writer_create(place->path, &description, &status, &error);
    assert_non_null(writer);
    fault_set(1);
    uint8_t row[6000];
    for (uint32_t y = 0; y < description.height && status == STATUS_OK; y++) {
        for (uint32_t i = 0; i < sizeof row; i++)
            row[i] = (uint8_t)hash_u32(y * 6000 + i);
        status = image_writer_row(writer, row, &error);
    }
    fault_set(0);
    assert_int_equal(status, STATUS_OUTPUT);
    assert_int_equal(count_entries(place->folder), 0);
    image_writer_abandon(&writer);
    assert_int_equal(count_entries(place->folder), 0);
}

#define TEST_IN_PLACE(test) cmocka_unit_test_setup_teardown(test, place_make, place_remove)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_encoded_bytes),
        cmocka_unit_test(test_encoded_rows),
        TEST_IN_PLACE(test_round_trips),
        TEST_IN_PLACE(test_same_rows_give_same_bytes),
        TEST_IN_PLACE(test_chunks_of_png),
        TEST_IN_PLACE(test_text_beyond_ascii),
        TEST_IN_PLACE(test_bytes_of_pfm),
        TEST_IN_PLACE(test_mode_follows_umask),
        TEST_IN_PLACE(test_path_without_folder),
        TEST_IN_PLACE(test_abandoned),
        TEST_IN_PLACE(test_abandoned_with_a_name),
        TEST_IN_PLACE(test_leftover_is_replaced),
        TEST_IN_PLACE(test_places_that_cannot_be_written),
        TEST_IN_PLACE(test_folder_that_is_read_only),
        TEST_IN_PLACE(test_full_disk),
        TEST_IN_PLACE(test_each_call_failing_in_turn),
        TEST_IN_PLACE(test_row_that_fails_leaves_nothing),
    };
    return cmocka_run_group_tests_name("image_write", tests, NULL, NULL);
}
