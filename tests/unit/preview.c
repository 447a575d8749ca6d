/* The preview: rows in any order, taken back, reduced, in every format; its PNG decoded again. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <png.h>

#include "base/memory.h"
#include "coordinator/map_colours.h"
#include "coordinator/preview.h"
#include "wire/rows.h"

enum { BYTES = 1 << 24 };

struct picture {
    uint32_t width, height;
    uint8_t *rgba;
    uint64_t version;
};

static struct picture look(struct preview *preview, enum preview_kind kind)
{
    struct bytes png = {0};
    struct picture picture = {.version = preview_png(preview, kind, &png)};
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_memory(&image, png.data, png.size));
    image.format = PNG_FORMAT_RGBA;
    picture.width = image.width;
    picture.height = image.height;
    picture.rgba = memory_array(PNG_IMAGE_SIZE(image), 1);
    assert_true(png_image_finish_read(&image, NULL, picture.rgba, 0, NULL));
    bytes_finish(&png);
    return picture;
}

static const uint8_t *cell(const struct picture *picture, uint32_t x, uint32_t y)
{
    return picture->rgba + 4 * ((size_t)y * picture->width + x);
}

static void assert_cell(const struct picture *picture, uint32_t x, uint32_t y, int red, int green, int blue)
{
    const uint8_t *found = cell(picture, x, y);
    assert_int_equal(found[0], red);
    assert_int_equal(found[1], green);
    assert_int_equal(found[2], blue);
    assert_int_equal(found[3], 255);
}

/* Adds one row; each of its pixels has that code in all channels of 8 or 16 bits, and in maps that stage and error. */
static void add_plain(struct preview *preview, uint32_t width, size_t pixel_bytes, bool maps, uint32_t row,
                      uint32_t worker, uint8_t code)
{
    struct row_layout layout = row_layout_of(width, pixel_bytes, maps);
    uint8_t *record = memory_array(row_record_bytes(&layout), 1);
    const struct row_figures figures = {.samples = 16 * (uint64_t)width, .error = {0, (uint64_t)width << 36}};
    row_figures_write(record, &figures);
    memset(record + ROW_FIGURES_BYTES, code, layout.pixels_bytes);
    memset(record + row_stages_at(&layout), 2, layout.map_bytes);
    memset(record + row_errors_at(&layout), 200, layout.map_bytes);
    preview_add(preview, row, 1, worker, record);
    free(record);
}

static void test_rows_come_in_any_order(void **state)
{
    (void)state;
    struct preview *preview = preview_create(3, 4, PIXEL_SRGB8, true, BYTES);
    uint64_t before = preview_version(preview);
    add_plain(preview, 3, 3, true, 2, 1, 77);
    add_plain(preview, 3, 3, true, 0, 2, 11);
    assert_true(preview_version(preview) > before);
    struct picture picture = look(preview, PREVIEW_PICTURE);
    assert_int_equal(picture.width, 3);
    assert_int_equal(picture.height, 4);
    assert_int_equal(picture.version, preview_version(preview));
    for (uint32_t x = 0; x < 3; x++) {
        assert_cell(&picture, x, 0, 11, 11, 11);
        assert_int_equal(cell(&picture, x, 1)[3], 0);
        assert_cell(&picture, x, 2, 77, 77, 77);
        assert_int_equal(cell(&picture, x, 3)[3], 0);
    }
    free(picture.rgba);
    preview_destroy(&preview);
    assert_null(preview);
}

static void test_rows_are_taken_back(void **state)
{
    (void)state;
    struct preview *preview = preview_create(2, 3, PIXEL_SRGB8, false, BYTES);
    for (uint32_t row = 0; row < 3; row++)
        add_plain(preview, 2, 3, false, row, 1, 50);
    uint64_t before = preview_version(preview);
    preview_drop(preview, 1, 1);
    assert_true(preview_version(preview) > before);
    struct picture picture = look(preview, PREVIEW_PICTURE);
    assert_int_equal(cell(&picture, 0, 1)[3], 0);
    assert_cell(&picture, 0, 2, 50, 50, 50);
    free(picture.rgba);
    add_plain(preview, 2, 3, false, 1, 2, 60);
    picture = look(preview, PREVIEW_PICTURE);
    assert_cell(&picture, 0, 1, 60, 60, 60);
    free(picture.rgba);
    preview_destroy(&preview);
}

static void test_maps(void **state)
{
    (void)state;
    struct preview *preview = preview_create(2, 1, PIXEL_SRGB8, true, BYTES);
    uint8_t stage[3], error[3];
    add_plain(preview, 2, 3, true, 0, 1, 50);
    map_colour_of_stage(2, stage);
    map_colour_of_error(200, error);
    struct picture samples = look(preview, PREVIEW_SAMPLES), errors = look(preview, PREVIEW_ERROR);
    assert_cell(&samples, 1, 0, stage[0], stage[1], stage[2]);
    assert_cell(&errors, 1, 0, error[0], error[1], error[2]);
    free(samples.rgba);
    free(errors.rgba);
    preview_destroy(&preview);
}

/* 16 samples are stage 3; a squared error of 2^-8 is an RMS error of 2^-4. */
static void test_without_maps_a_row_has_its_figures(void **state)
{
    (void)state;
    struct preview *preview = preview_create(2, 1, PIXEL_SRGB8, false, BYTES);
    uint8_t stage[3], error[3];
    add_plain(preview, 2, 3, false, 0, 1, 50);
    map_colour_of_stage(3, stage);
    map_colour_of_error(row_error_code(0x1p-8), error);
    struct picture samples = look(preview, PREVIEW_SAMPLES), errors = look(preview, PREVIEW_ERROR);
    assert_cell(&samples, 0, 0, stage[0], stage[1], stage[2]);
    assert_cell(&errors, 0, 0, error[0], error[1], error[2]);
    free(samples.rgba);
    free(errors.rgba);
    preview_destroy(&preview);
}

static void test_wider_formats(void **state)
{
    (void)state;
    struct row_layout layout = row_layout_of(2, 12, false);
    const float light[6] = {0, 0.5F, 1, 7, -1, 0};
    struct preview *preview = preview_create(2, 1, PIXEL_SRGB16, false, BYTES);
    add_plain(preview, 2, 6, false, 0, 1, 0x42);
    struct picture picture = look(preview, PREVIEW_PICTURE);
    assert_cell(&picture, 0, 0, 0x42, 0x42, 0x42);
    free(picture.rgba);
    preview_destroy(&preview);

    uint8_t *record = memory_array(row_record_bytes(&layout), 1);
    memcpy(record + ROW_FIGURES_BYTES, light, sizeof light);
    preview = preview_create(2, 1, PIXEL_LINEAR, false, BYTES);
    preview_add(preview, 0, 1, 1, record);
    picture = look(preview, PREVIEW_PICTURE);
    assert_cell(&picture, 0, 0, 0, 188, 255);
    assert_cell(&picture, 1, 0, 255, 0, 0);
    free(picture.rgba);
    free(record);
    preview_destroy(&preview);
}

/* A picture of 3,841 pixels across is kept at a third, the last cell of a row standing for one pixel. */
static void test_large_pictures_are_reduced(void **state)
{
    (void)state;
    enum { WIDTH = 3841, HEIGHT = 7 };
    struct row_layout layout = row_layout_of(WIDTH, 3, false);
    uint8_t *records = memory_array(3, row_record_bytes(&layout));
    for (uint32_t row = 0; row < 3; row++)
        for (uint32_t x = 0; x < WIDTH; x++)
            records[row * row_record_bytes(&layout) + ROW_FIGURES_BYTES + 3 * x] = (uint8_t)(10 * row + 30 * (x % 3));
    struct preview *preview = preview_create(WIDTH, HEIGHT, PIXEL_SRGB8, false, BYTES);
    preview_add(preview, 0, 3, 1, records);
    struct picture picture = look(preview, PREVIEW_PICTURE);
    assert_int_equal(picture.width, 1281);
    assert_int_equal(picture.height, 3);
    assert_cell(&picture, 0, 0, 40, 0, 0);    /* the mean of 10 row + 30 column */
    assert_cell(&picture, 1279, 0, 40, 0, 0);
    assert_cell(&picture, 1280, 0, 10, 0, 0); /* of one column */
    assert_int_equal(cell(&picture, 0, 1)[3], 0);
    free(picture.rgba);

    preview_drop(preview, 1, 2);
    picture = look(preview, PREVIEW_PICTURE);
    assert_int_equal(cell(&picture, 0, 0)[3], 0);
    free(picture.rgba);
    preview_add(preview, 1, 1, 1, records + row_record_bytes(&layout));
    picture = look(preview, PREVIEW_PICTURE);
    assert_cell(&picture, 0, 0, 40, 0, 0);
    free(picture.rgba);
    free(records);
    preview_destroy(&preview);
}

static void test_many_share_the_room(void **state)
{
    (void)state;
    static const size_t budgets[] = {1 << 20, 10000, 600, 1};
    for (size_t i = 0; i < sizeof budgets / sizeof *budgets; i++) {
        struct preview *preview = preview_create(1920, 1080, PIXEL_SRGB8, true, budgets[i]);
        size_t cells = (size_t)preview_width(preview) * preview_height(preview);
        assert_true(cells == 1 || cells * 5 <= budgets[i]);
        for (uint32_t row = 0; row < 1080; row += 7)
            add_plain(preview, 1920, 3, true, row, 1, 99);
        struct picture picture = look(preview, PREVIEW_PICTURE);
        assert_cell(&picture, 0, 0, 99, 99, 99);
        free(picture.rgba);
        preview_destroy(&preview);
    }
}

static void test_shares(void **state)
{
    (void)state;
    static const struct preview_share expected[] = {{1, 2, 3}, {3, 1, 0}, {5, 1, 3}};
    struct preview *preview = preview_create(1, 7, PIXEL_SRGB8, false, BYTES);
    struct preview_share *shares;
    add_plain(preview, 1, 3, false, 5, 3, 1);
    add_plain(preview, 1, 3, false, 1, 3, 1);
    add_plain(preview, 1, 3, false, 2, 3, 1);
    add_plain(preview, 1, 3, false, 3, 0, 1);
    add_plain(preview, 1, 3, false, 6, 9, 1);
    preview_drop(preview, 6, 1);
    assert_int_equal(preview_shares(preview, &shares), 3);
    assert_memory_equal(shares, expected, sizeof expected);
    free(shares);
    preview_destroy(&preview);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_come_in_any_order),
        cmocka_unit_test(test_rows_are_taken_back),
        cmocka_unit_test(test_maps),
        cmocka_unit_test(test_without_maps_a_row_has_its_figures),
        cmocka_unit_test(test_wider_formats),
        cmocka_unit_test(test_large_pictures_are_reduced),
        cmocka_unit_test(test_many_share_the_room),
        cmocka_unit_test(test_shares),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
