/*
 * Weaving a picture from bands that come in any order: the file equals the one written row by row, and rows go to
 * disk before the last have come.
 */
#include <dirent.h>
#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/hash.h"
#include "base/memory.h"
#include "coordinator/assembly.h"
#include "coordinator/map_colours.h"
#include "image/image.h"
#include "trace/sampling.h"

enum { WIDTH = 19, HEIGHT = 61 };

static char folder[] = "/tmp/weft-assembly-XXXXXX";
static char rows_path[64], output[64], reference[64], sample_map[64], error_map[64];
static struct error error;
static struct journal *journal; /* where rows wait */
static bool maps; /* of the records */

static const struct image_description description = {WIDTH, HEIGHT, PIXEL_SRGB8, "weft test", "scene.json"};

static uint8_t pixel_byte(uint32_t row, size_t i)
{
    return (uint8_t)(hash_u32(row * 1000 + (uint32_t)i) >> 8);
}

static uint8_t stage_at(uint32_t row, size_t x)
{
    return (uint8_t)((row + x) % SAMPLING_STAGES);
}

static uint8_t error_at(uint32_t row, size_t x)
{
    return (uint8_t)(7 * row + 3 * x);
}

/* Appends a row's record: its pixels, figures that tell rows apart, and maps if there are any. */
static void put_record(struct bytes *to, uint32_t row)
{
    const struct row_layout layout = row_layout_of(WIDTH, pixel_format_bytes(description.format), maps);
    uint8_t *record = bytes_extend(to, row_record_bytes(&layout));
    memset(record, 0x99, row_record_bytes(&layout));
    struct row_figures figures = {row + 1, 100 * row, (uint64_t)row << 40, {row << 8, 3}, {[5] = row}};
    row_figures_write(record, &figures);
    for (size_t i = 0; i < layout.pixels_bytes; i++)
        record[ROW_FIGURES_BYTES + i] = pixel_byte(row, i);
    for (size_t i = 0; i < layout.map_bytes; i++) {
        record[row_stages_at(&layout) + i] = stage_at(row, i);
        record[row_errors_at(&layout) + i] = error_at(row, i);
    }
}

static enum status add_records(struct assembly *assembly, uint32_t first_row, uint32_t rows, const uint8_t *records)
{
    struct journal_band band = {.pass = PASS_RENDER, .first_row = first_row, .rows = rows,
                                .size = rows * assembly_record_bytes(assembly)};
    enum status status = journal_add(journal, &band, records, &error);
    return status == STATUS_OK ? assembly_add(assembly, first_row, rows, band.offset, &error) : status;
}

static void add_band(struct assembly *assembly, uint32_t first_row, uint32_t rows)
{
    struct bytes records = {0};
    for (uint32_t row = first_row; row < first_row + rows; row++)
        put_record(&records, row);
    assert_int_equal(records.size, rows * assembly_record_bytes(assembly));
    assert_int_equal(add_records(assembly, first_row, rows, records.data), STATUS_OK);
    bytes_finish(&records);
}

static struct assembly *create(void)
{
    enum status status;
    const struct assembly_paths paths = {output, maps ? sample_map : NULL, maps ? error_map : NULL, maps};
    struct assembly *assembly = assembly_create(&paths, &description, journal, &status, &error);
    if (!assembly)
        fail_msg("%s", error.text);
    return assembly;
}

/* The output is there, alone, and has the reference's bytes. */
static void assert_complete(struct assembly *assembly)
{
    struct bytes found = {0}, expected = {0};
    assert_int_equal(access(output, F_OK), -1); /* never in part */
    assembly_finish(assembly, -1);
    assert_int_equal(assembly_complete(&assembly, &error), STATUS_OK);
    assert_null(assembly);
    assert_int_equal(bytes_read_file(&found, output, 1 << 20, &error), STATUS_OK);
    assert_int_equal(bytes_read_file(&expected, reference, 1 << 20, &error), STATUS_OK);
    assert_int_equal(found.size, expected.size);
    assert_memory_equal(found.data, expected.data, found.size);
    bytes_finish(&found);
    bytes_finish(&expected);
    unlink(output);
}

static void test_in_order(void **state)
{
    (void)state;
    struct assembly *assembly = create();
    for (uint32_t row = 0; row < HEIGHT; row++)
        add_band(assembly, row, 1);
    assert_complete(assembly);
}

static void test_whole(void **state)
{
    (void)state;
    struct assembly *assembly = create();
    add_band(assembly, 0, HEIGHT);
    assert_complete(assembly);
}

/* Rows that are taken back and come again, before they could be written and after, first ones and last ones. */
static void test_dropped(void **state)
{
    (void)state;
    static const struct { uint32_t first_row, rows; } dropped[] = {{1, 1}, {HEIGHT - 1, 1}, {20, 21}, {0, HEIGHT}};
    for (size_t i = 0; i < sizeof dropped / sizeof *dropped; i++)
        for (int written = 0; written < 2; written++) {
            struct assembly *assembly = create();
            uint32_t first_row = dropped[i].first_row, rows = dropped[i].rows;
            add_band(assembly, 0, 1);
            for (uint32_t row = HEIGHT; --row > 0;)
                add_band(assembly, row, 1);
            for (int waited = 0; written && waited < 100; waited++)
                usleep(100); /* most are written by now; if not, it is the other case again */
            for (uint32_t row = first_row; row < first_row + rows; row++)
                assert_int_equal(assembly_drop(assembly, row, 1, &error), STATUS_OK);
            add_band(assembly, first_row, rows);
            assert_complete(assembly);
        }
}

/* Who waits for the bell need not wait for anything else. */
static void test_bell(void **state)
{
    (void)state;
    struct assembly *assembly = create();
    struct pollfd bell = {.fd = eventfd(0, EFD_CLOEXEC), .events = POLLIN};
    add_band(assembly, 1, HEIGHT - 1);
    add_band(assembly, 0, 1);
    assert_int_equal(poll(&bell, 1, 0), 0);
    assembly_finish(assembly, bell.fd);
    assert_int_equal(poll(&bell, 1, -1), 1);
    assert_true(assembly_is_finished(assembly));
    assert_int_equal(access(output, F_OK), 0);
    assert_int_equal(assembly_complete(&assembly, &error), STATUS_OK);
    close(bell.fd);
    unlink(output);
}

static size_t count_files(void)
{
    size_t count = 0;
    DIR *entries = opendir(folder);
    for (struct dirent *entry; (entry = readdir(entries));)
        count += entry->d_name[0] != '.' || strlen(entry->d_name) > 2;
    closedir(entries);
    return count;
}

/* The map has these colours. */
static void assert_map(const char *path, uint8_t (*code_at)(uint32_t row, size_t x),
                       void (*colour_of)(uint8_t code, uint8_t codes[3]))
{
    struct image image = {0};
    assert_int_equal(image_read_file(&image, path, &error), STATUS_OK);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (size_t x = 0; x < WIDTH; x++) {
            const float *rgb = image.rgb + 3 * (y * WIDTH + x);
            const struct vec3 light = {rgb[0], rgb[1], rgb[2]};
            uint8_t expected[3], found[3];
            colour_of(code_at(y, x), expected);
            pixel_format_encode(PIXEL_SRGB8, &light, 1, found);
            assert_memory_equal(found, expected, 3);
        }
    image_finish(&image);
    assert_int_equal(unlink(path), 0);
}

static void test_maps(void **state)
{
    (void)state;
    maps = true;
    struct assembly *assembly = create();
    add_band(assembly, HEIGHT / 2, HEIGHT - HEIGHT / 2);
    add_band(assembly, 0, HEIGHT / 2);
    assert_complete(assembly);
    assert_map(sample_map, stage_at, map_colour_of_stage);
    assert_map(error_map, error_at, map_colour_of_error);
    maps = false;
}

/* One that cannot be written: nothing is left of the others. */
static void test_map_without_folder(void **state)
{
    (void)state;
    const struct assembly_paths paths = {output, sample_map, "/nowhere/at/all.png", true};
    enum status status = STATUS_OK;
    assert_null(assembly_create(&paths, &description, journal, &status, &error));
    assert_int_equal(status, STATUS_OUTPUT);
    assert_non_null(strstr(error.text, "/nowhere/at/all.png"));
    assert_int_equal(count_files(), 1); /* the reference alone */
}

static void test_sum(void **state)
{
    (void)state;
    enum { ROWS = 5 };
    struct assembly *assembly = create();
    struct bytes records = {0};
    for (uint32_t row = 0; row < ROWS; row++)
        put_record(&records, row);
    struct row_figures sum = assembly_sum(assembly, ROWS, records.data);
    assert_int_equal(sum.samples, 15);
    assert_int_equal(sum.secondary_rays, 1000);
    assert_true(sum.shadow_rays == UINT64_C(10) << 40);
    assert_int_equal(sum.error[0], 10 << 8);
    assert_int_equal(sum.error[1], 15);
    assert_int_equal(sum.stages[5], 10);
    bytes_finish(&records);
    assembly_abandon(&assembly);
}

static void test_backwards(void **state)
{
    (void)state;
    struct assembly *assembly = create();
    for (uint32_t row = HEIGHT; row-- > 0;)
        add_band(assembly, row, 1);
    assert_complete(assembly);
}

/* Bands of every height in a shuffled order. */
static void test_shuffled(void **state)
{
    (void)state;
    for (uint32_t height = 1; height <= 20; height++) {
        uint32_t order[HEIGHT], bands = (HEIGHT + height - 1) / height;
        struct assembly *assembly = create();
        for (uint32_t i = 0; i < bands; i++) { /* Fisher and Yates */
            uint32_t k = hash_u32(height * 1000 + i) % (i + 1);
            order[i] = order[k];
            order[k] = i;
        }
        for (uint32_t i = 0; i < bands; i++) {
            uint32_t first = order[i] * height;
            add_band(assembly, first, HEIGHT - first < height ? HEIGHT - first : height);
        }
        assert_complete(assembly);
    }
}

static void test_abandon(void **state)
{
    (void)state;
    struct assembly *assembly = create();
    add_band(assembly, 0, 3);
    add_band(assembly, 10, 5); /* rows that still wait */
    assembly_abandon(&assembly);
    assert_null(assembly);
    assembly_abandon(&assembly);
    assert_int_equal(count_files(), 1); /* the reference alone */
}

/* --- a picture of more than one block of compressed bytes -------------------------------------------------- */

enum { LARGE_WIDTH = 600, LARGE_HEIGHT = 500 };

static struct assembly *create_large(void)
{
    struct image_description large = {LARGE_WIDTH, LARGE_HEIGHT, PIXEL_SRGB8, "weft test", "scene.json"};
    enum status status;
    const struct assembly_paths paths = {.picture = output};
    struct assembly *assembly = assembly_create(&paths, &large, journal, &status, &error);
    assert_non_null(assembly);
    return assembly;
}

/* Puts rows of noise, which does not compress, into the journal, and says where they are. */
static uint64_t put_large(const struct assembly *assembly, uint32_t rows)
{
    size_t record_bytes = assembly_record_bytes(assembly);
    uint8_t *records = memory_array(rows, record_bytes);
    for (size_t i = 0; i < rows * record_bytes; i++)
        if (i % record_bytes >= ROW_FIGURES_BYTES)
            records[i] = (uint8_t)hash_u32((uint32_t)i);
    struct journal_band band = {.pass = PASS_RENDER, .rows = rows, .size = rows * record_bytes};
    assert_int_equal(journal_add(journal, &band, records, &error), STATUS_OK);
    free(records);
    return band.offset;
}

static enum status add_large(struct assembly *assembly, uint32_t first_row, uint32_t rows)
{
    return assembly_add(assembly, first_row, rows, put_large(assembly, rows), &error);
}

/* Bytes of the file that becomes the output: it has no name, but this process has it open. */
static int64_t part_bytes(void)
{
    int64_t size = -1;
    DIR *open_files = opendir("/proc/self/fd");
    for (struct dirent *entry; (entry = readdir(open_files));) {
        char target[128] = "";
        struct stat info;
        ssize_t length = readlinkat(dirfd(open_files), entry->d_name, target, sizeof target - 1);
        bool is_ours = length > 0 && strncmp(target, folder, strlen(folder)) == 0 && target[strlen(folder)] == '/';
        if (is_ours && fstatat(dirfd(open_files), entry->d_name, &info, 0) == 0 && S_ISREG(info.st_mode))
            size = (int64_t)info.st_size;
    }
    closedir(open_files);
    return size;
}

static void test_written_while_rows_are_missing(void **state)
{
    (void)state;
    enum { ROWS_NOW = 400, WRITTEN = 1 << 18, PATIENCE_MS = 20000 };
    struct assembly *assembly = create_large();
    assert_int_equal(add_large(assembly, 1, ROWS_NOW - 1), STATUS_OK);
    assert_true(part_bytes() < 1000); /* the first row is missing */
    assert_int_equal(add_large(assembly, 0, 1), STATUS_OK);
    int waited_ms = 0;
    for (; part_bytes() < WRITTEN && waited_ms < PATIENCE_MS; waited_ms++)
        usleep(1000);
    assert_true(part_bytes() >= WRITTEN);
    assert_int_equal(add_large(assembly, ROWS_NOW, LARGE_HEIGHT - ROWS_NOW), STATUS_OK);
    assembly_finish(assembly, -1);
    assert_int_equal(assembly_complete(&assembly, &error), STATUS_OK);
    assert_int_equal(unlink(output), 0);
}

/* A file that may not grow: adding or completing says so, and nothing is left. */
static void test_failure_to_write(void **state)
{
    (void)state;
    struct rlimit before, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = (struct rlimit){.rlim_cur = 1 << 17, .rlim_max = before.rlim_max};
    signal(SIGXFSZ, SIG_IGN);
    struct assembly *assembly = create_large();
    uint64_t rows = put_large(assembly, LARGE_HEIGHT - 1), last = put_large(assembly, 1);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    enum status status = assembly_add(assembly, 0, LARGE_HEIGHT - 1, rows, &error);
    if (status == STATUS_OK)
        status = assembly_add(assembly, LARGE_HEIGHT - 1, 1, last, &error);
    if (status == STATUS_OK) {
        assembly_finish(assembly, -1);
        status = assembly_complete(&assembly, &error);
    }
    assembly_abandon(&assembly);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(status, STATUS_OUTPUT);
    assert_non_null(strstr(error.text, "cannot be written"));
    assert_int_equal(count_files(), 1);
}

/* --- the rest ---------------------------------------------------------------------------------------------- */

static void test_no_folder(void **state)
{
    (void)state;
    enum status status = STATUS_OK;
    const struct assembly_paths paths = {.picture = "/nowhere/at/all.png"};
    assert_null(assembly_create(&paths, &description, journal, &status, &error));
    assert_int_equal(status, STATUS_OUTPUT);
    assert_non_null(strstr(error.text, "/nowhere/at/all.png"));
}

static void test_record_bytes(void **state)
{
    (void)state;
    static const size_t pixel_bytes[PIXEL_FORMATS] = {3, 6, 12};
    for (int format = 0; format < PIXEL_FORMATS; format++) {
        struct image_description other = description;
        enum status status;
        other.format = (enum pixel_format)format;
        for (size_t mapped = 0; mapped < 3; mapped++) {
            const struct assembly_paths paths = {output, NULL, mapped == 1 ? error_map : NULL, mapped == 2};
            struct assembly *assembly = assembly_create(&paths, &other, journal, &status, &error);
            assert_non_null(assembly);
            assert_int_equal(assembly_record_bytes(assembly),
                             ROW_FIGURES_BYTES + WIDTH * (pixel_bytes[format] + (mapped ? 2 : 0)));
            assembly_abandon(&assembly);
        }
    }
}

/* Writes the reference without an assembly. */
static int make_reference(void **state)
{
    (void)state;
    enum status status;
    if (!mkdtemp(folder))
        return -1;
    snprintf(output, sizeof output, "%s/out.png", folder);
    snprintf(reference, sizeof reference, "%s/reference.png", folder);
    snprintf(sample_map, sizeof sample_map, "%s/samples.png", folder);
    snprintf(error_map, sizeof error_map, "%s/errors.png", folder);
    snprintf(rows_path, sizeof rows_path, "%s-rows", folder);
    journal = journal_open(rows_path, &(struct journal_key){{{0}}, {{0}}, {{0}}}, false, &status, &error);
    if (!journal)
        return -1;
    struct image_writer *writer = image_writer_create(reference, &description, &status, &error);
    for (uint32_t row = 0; writer && row < HEIGHT; row++) {
        uint8_t pixels[3 * WIDTH];
        for (size_t i = 0; i < sizeof pixels; i++)
            pixels[i] = pixel_byte(row, i);
        if (image_writer_row(writer, pixels, &error) != STATUS_OK)
            return -1;
    }
    return writer && image_writer_complete(&writer, &error) == STATUS_OK ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    journal_close(&journal, true);
    unlink(output);
    unlink(reference);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_in_order), cmocka_unit_test(test_whole),
        cmocka_unit_test(test_dropped),
        cmocka_unit_test(test_bell),   cmocka_unit_test(test_backwards),
        cmocka_unit_test(test_maps), cmocka_unit_test(test_map_without_folder), cmocka_unit_test(test_sum),
        cmocka_unit_test(test_shuffled), cmocka_unit_test(test_abandon), cmocka_unit_test(test_no_folder),
        cmocka_unit_test(test_record_bytes),
        cmocka_unit_test(test_written_while_rows_are_missing),
        cmocka_unit_test(test_failure_to_write),
    };
    return cmocka_run_group_tests_name("assembly", tests, make_reference, remove_folder);
}
