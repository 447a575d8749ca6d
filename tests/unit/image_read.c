/*
 * Decoding PNG and PFM: every colour type, and every kind of broken file. The PNGs are made here by libpng.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <png.h>

#include "base/bytes.h"
#include "base/hash.h"
#include "base/memory.h"
#include "image/image.h"
#include "math/colour.h"

enum { SIDE_MAX = 40 };

/* A PNG to be made: its samples are hashes of their place. */
struct recipe {
    int colour_type, depth, interlace;
    int transparent; /* with a tRNS chunk */
    uint32_t width, height;
};

static uint32_t channels_of(int colour_type)
{
    static const uint32_t channels[] = {
        [PNG_COLOR_TYPE_GRAY] = 1, [PNG_COLOR_TYPE_PALETTE] = 1,   [PNG_COLOR_TYPE_RGB] = 3,
        [PNG_COLOR_TYPE_GRAY_ALPHA] = 2, [PNG_COLOR_TYPE_RGB_ALPHA] = 4,
    };
    return channels[colour_type];
}

static uint32_t sample_of(const struct recipe *recipe, uint32_t x, uint32_t y, uint32_t channel)
{
    return hash_u32(x + 1000 * y + 1000000 * channel + 1) >> (32 - recipe->depth);
}

static png_color palette_colour(uint32_t index)
{
    uint32_t h = hash_u32(index + 77);
    return (png_color){(png_byte)h, (png_byte)(h >> 8), (png_byte)(h >> 16)};
}

static void write_bytes(png_structp png, png_bytep data, size_t size)
{
    bytes_put(png_get_io_ptr(png), data, size);
}

static png_structp writer_into(struct bytes *out)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    assert_non_null(png);
    png_set_write_fn(png, out, write_bytes, NULL);
    return png;
}

static void set_palette(png_structp png, png_infop info, const struct recipe *recipe)
{
    png_color palette[256];
    png_byte alpha[256];
    for (uint32_t i = 0; i < 256; i++) {
        palette[i] = palette_colour(i);
        alpha[i] = (png_byte)(i * 37);
    }
    if (recipe->colour_type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 1 << recipe->depth);
    png_color_16 hidden = {0};
    if (recipe->transparent)
        png_set_tRNS(png, info, alpha, 1 << (recipe->depth < 8 ? recipe->depth : 8), &hidden);
}

/* Packs the samples of row y as the file holds them: big-endian, the first in the highest bits. */
static void pack_row(const struct recipe *recipe, uint32_t y, uint8_t *row)
{
    uint32_t channels = channels_of(recipe->colour_type);
    for (uint32_t i = 0; i < recipe->width * channels; i++) {
        uint32_t sample = sample_of(recipe, i / channels, y, i % channels);
        for (int b = 0; b < recipe->depth; b++) {
            uint32_t at = i * (uint32_t)recipe->depth + (uint32_t)b;
            uint8_t mask = (uint8_t)(0x80 >> at % 8);
            uint32_t bit = sample >> (recipe->depth - 1 - b) & 1;
            row[at / 8] = (uint8_t)(bit ? row[at / 8] | mask : row[at / 8] & ~mask);
        }
    }
}

static void make_png(struct bytes *out, const struct recipe *recipe)
{
    static uint8_t rows[SIDE_MAX][SIDE_MAX * 8];
    uint8_t *pointers[SIDE_MAX];
    for (uint32_t y = 0; y < recipe->height; y++) {
        pack_row(recipe, y, rows[y]);
        pointers[y] = rows[y];
    }
    png_structp png = writer_into(out);
    png_infop info = png_create_info_struct(png);
    png_set_IHDR(png, info, recipe->width, recipe->height, recipe->depth, recipe->colour_type,
                 recipe->interlace, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
    set_palette(png, info, recipe);
    png_set_rows(png, info, pointers);
    png_write_png(png, info, PNG_TRANSFORM_IDENTITY, NULL);
    png_destroy_write_struct(&png, &info);
}

static float light_of(const struct recipe *recipe, uint32_t x, uint32_t y, uint32_t channel)
{
    if (recipe->colour_type == PNG_COLOR_TYPE_PALETTE) {
        png_color c = palette_colour(sample_of(recipe, x, y, 0));
        return (float)colour_from_srgb8(channel == 0 ? c.red : channel == 1 ? c.green : c.blue);
    }
    uint32_t sample = sample_of(recipe, x, y, channels_of(recipe->colour_type) >= 3 ? channel : 0);
    if (recipe->depth == 16)
        return (float)colour_decode_srgb(sample / 65535.0);
    return (float)colour_from_srgb8((uint8_t)(sample * 255 / ((1u << recipe->depth) - 1)));
}

static void assert_pixels(const struct image *image, const struct recipe *recipe)
{
    assert_int_equal(image->width, recipe->width);
    assert_int_equal(image->height, recipe->height);
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++)
            for (uint32_t c = 0; c < 3; c++)
                if (image->rgb[3 * (y * image->width + x) + c] != light_of(recipe, x, y, c))
                    fail_msg("type %d depth %d interlace %d tRNS %d: pixel (%u, %u) channel %u",
                             recipe->colour_type, recipe->depth, recipe->interlace, recipe->transparent, x, y,
                             c);
}

static void check_recipe(const struct recipe *recipe)
{
    struct bytes file = {0};
    struct image image = {0};
    struct error error;
    make_png(&file, recipe);
    enum status status = image_decode_png(&image, file.data, file.size, "x.png", &error);
    if (status != STATUS_OK)
        fail_msg("type %d depth %d: %s", recipe->colour_type, recipe->depth, error.text);
    assert_int_equal(image_check_png(file.data, file.size, "x.png", &error), STATUS_OK);
    assert_pixels(&image, recipe);
    image_finish(&image);
    assert_null(image.rgb);
    bytes_finish(&file);
}

static const struct recipe kinds[] = {
    {PNG_COLOR_TYPE_GRAY, 1, 0, 0, 0, 0},       {PNG_COLOR_TYPE_GRAY, 2, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_GRAY, 4, 0, 0, 0, 0},       {PNG_COLOR_TYPE_GRAY, 8, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_GRAY, 16, 0, 0, 0, 0},      {PNG_COLOR_TYPE_GRAY, 1, 0, 1, 0, 0},
    {PNG_COLOR_TYPE_GRAY, 8, 0, 1, 0, 0},       {PNG_COLOR_TYPE_GRAY, 16, 0, 1, 0, 0},
    {PNG_COLOR_TYPE_RGB, 8, 0, 0, 0, 0},        {PNG_COLOR_TYPE_RGB, 16, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_RGB, 8, 0, 1, 0, 0},        {PNG_COLOR_TYPE_RGB, 16, 0, 1, 0, 0},
    {PNG_COLOR_TYPE_PALETTE, 1, 0, 0, 0, 0},    {PNG_COLOR_TYPE_PALETTE, 2, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_PALETTE, 4, 0, 0, 0, 0},    {PNG_COLOR_TYPE_PALETTE, 8, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_PALETTE, 2, 0, 1, 0, 0},    {PNG_COLOR_TYPE_PALETTE, 8, 0, 1, 0, 0},
    {PNG_COLOR_TYPE_GRAY_ALPHA, 8, 0, 0, 0, 0}, {PNG_COLOR_TYPE_GRAY_ALPHA, 16, 0, 0, 0, 0},
    {PNG_COLOR_TYPE_RGB_ALPHA, 8, 0, 0, 0, 0},  {PNG_COLOR_TYPE_RGB_ALPHA, 16, 0, 0, 0, 0},
};

enum { KINDS = sizeof kinds / sizeof *kinds };

/* 1 × 1 to 5 × 3 have interlace passes without pixels; 40 rows need the image to grow twice. */
static void test_every_kind_of_png(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {2, 1}, {1, 2}, {5, 3}, {13, 9}, {8, 8}, {33, 40}};
    for (size_t k = 0; k < KINDS; k++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
            for (int interlace = 0; interlace < 2; interlace++) {
                struct recipe recipe = kinds[k];
                recipe.width = sizes[s][0];
                recipe.height = sizes[s][1];
                recipe.interlace = interlace;
                check_recipe(&recipe);
            }
}

/* Codes whose light is known from the standard's formula, worked out apart from our code. */
static void test_known_light(void **state)
{
    (void)state;
    static const uint8_t row[] = {0, 255, 188, 10, 11, 128};
    static const double light[] = {0, 1, 0.50288646, 0.00303527, 0.00334654, 0.21586050};
    struct bytes file = {0};
    struct image image = {0};
    struct error error;
    png_structp png = writer_into(&file);
    png_infop info = png_create_info_struct(png);
    png_set_IHDR(png, info, 2, 1, 8, PNG_COLOR_TYPE_RGB, 0, 0, 0);
    png_set_gAMA(png, info, 1.0); /* to be ignored */
    png_write_info(png, info);
    png_write_row(png, row);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    assert_int_equal(image_decode_png(&image, file.data, file.size, "x.png", &error), STATUS_OK);
    for (int i = 0; i < 6; i++)
        assert_true(image.rgb[i] > light[i] - 1e-7 && image.rgb[i] < light[i] + 1e-7);
    image_finish(&image);
    bytes_finish(&file);
}

static void assert_refused(enum status status, const struct image *image, const struct error *error)
{
    assert_int_equal(status, STATUS_INPUT);
    assert_null(image->rgb);
    assert_int_equal(image->width, 0);
    assert_ptr_equal(strstr(error->text, "bad.png: "), error->text);
    assert_null(strchr(error->text, '\n'));
}

/* A copy of exactly the size, so that the address sanitizer sees a byte read too far. A mere check ends alike. */
static enum status decode_exact(struct image *image, const uint8_t *data, size_t size, struct error *error)
{
    struct error by_check = {{0}};
    uint8_t *copy = malloc(size);
    memcpy(copy, data, size);
    *error = by_check;
    enum status status = image_decode_png(image, copy, size, "bad.png", error);
    assert_int_equal(image_check_png(copy, size, "bad.png", &by_check), status);
    assert_string_equal(by_check.text, error->text);
    free(copy);
    return status;
}

static void test_png_cut_anywhere(void **state)
{
    (void)state;
    for (size_t k = 0; k < KINDS; k++) {
        struct recipe recipe = kinds[k];
        recipe.width = 7;
        recipe.height = 6;
        recipe.interlace = k % 2;
        struct bytes file = {0};
        make_png(&file, &recipe);
        for (size_t size = 0; size < file.size; size++) {
            struct image image = {0};
            struct error error;
            enum status status = decode_exact(&image, file.data, size, &error);
            assert_refused(status, &image, &error);
        }
        bytes_finish(&file);
    }
}

/* Every byte of these files lies under a checksum or in the signature. */
static void check_flips(const struct recipe *recipe, uint8_t mask)
{
    struct bytes file = {0};
    make_png(&file, recipe);
    for (size_t i = 0; i < file.size; i++) {
        struct image image = {0};
        struct error error;
        file.data[i] ^= mask;
        enum status status = decode_exact(&image, file.data, file.size, &error);
        file.data[i] ^= mask;
        assert_refused(status, &image, &error);
    }
    bytes_finish(&file);
}

static void test_png_with_any_byte_changed(void **state)
{
    (void)state;
    for (size_t k = 0; k < KINDS; k++) {
        struct recipe recipe = kinds[k];
        recipe.width = 7;
        recipe.height = 6;
        recipe.interlace = k % 2;
        check_flips(&recipe, 0x01);
        check_flips(&recipe, 0x20);
        check_flips(&recipe, 0xff);
    }
}

/* A PNG with right checksums whose header claims a size, and with `idat` as its only data. */
static void make_claim(struct bytes *file, uint32_t width, uint32_t height, const void *idat, size_t size)
{
    png_byte header[13] = {0};
    png_save_uint_32(header, width);
    png_save_uint_32(header + 4, height);
    header[8] = 8; /* bits; grey, not interlaced */
    png_structp png = writer_into(file);
    png_write_sig(png);
    png_write_chunk(png, (png_const_bytep) "IHDR", header, sizeof header);
    png_write_chunk(png, (png_const_bytep) "IDAT", idat, size);
    png_write_chunk(png, (png_const_bytep) "IEND", NULL, 0);
    png_destroy_write_struct(&png, NULL);
}

/* A zlib stream, without its end, of one row of 65535 grey pixels and the filter's byte: two stored blocks. */
static void make_one_row(struct bytes *stream)
{
    static const uint8_t zeros[65535];
    bytes_put(stream, "\x78\x01\x00\xff\xff\x00\x00", 7);
    bytes_put(stream, zeros, sizeof zeros);
    bytes_put(stream, "\x00\x01\x00\xfe\xff\x00", 6);
}

static void check_claim(uint32_t width, uint32_t height, const char *sentence)
{
    struct bytes stream = {0}, file = {0};
    struct image image = {0};
    struct error error;
    make_one_row(&stream);
    make_claim(&file, width, height, stream.data, stream.size);
    enum status status = decode_exact(&image, file.data, file.size, &error);
    assert_refused(status, &image, &error);
    assert_string_equal(error.text, sentence);
    bytes_finish(&stream);
    bytes_finish(&file);
}

/* The most address space that this process ever had, in KiB. */
static long peak_memory_kib(void)
{
    char line[256];
    long kib = -1;
    FILE *status = fopen("/proc/self/status", "r");
    assert_non_null(status);
    while (kib < 0 && fgets(line, sizeof line, status))
        sscanf(line, "VmPeak: %ld", &kib);
    fclose(status);
    assert_true(kib > 0);
    return kib;
}

static void test_png_that_claims_too_much(void **state)
{
    (void)state;
    static const char limit[] = "bad.png: expected at most 65535 pixels a side and 268435456 in all, found ";
    static const uint32_t sizes[][2] = {{65535, 65535}, {65536, 1}, {1, 65536}, {1, 0x7fffffff}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char *sentence = memory_format("%s%u × %u", limit, sizes[i][0], sizes[i][1]);
        check_claim(sizes[i][0], sizes[i][1], sentence);
        free(sentence);
    }
    check_claim(0, 7, "bad.png: damaged PNG: Image width is zero in IHDR");
}

/* 65535 × 4000 pixels are 3 GB; the one row that is there calls for the first step of growth, 13 MB. */
static void test_memory_follows_the_rows_that_are_there(void **state)
{
    (void)state;
    long before = peak_memory_kib();
    check_claim(65535, 4000, "bad.png: damaged PNG: Not enough image data");
    assert_true(peak_memory_kib() - before < 256 * 1024);
}

static void test_not_a_png(void **state)
{
    (void)state;
    static const struct {
        const char *data;
        size_t size;
        const char *sentence;
    } cases[] = {
        {"", 0, "bad.png: expected a PNG image, found an empty file"},
        {"\x89PN", 3, "bad.png: expected a PNG image, found a file that begins with the bytes 89 50 4e"},
        {"\xff\xd8\xff\xe0 JFIF", 9, "bad.png: expected a PNG image, found a JPEG image"},
        {"PF\n1 1\n", 7, "bad.png: expected a PNG image, found a PFM image"},
        {"just text", 9,
         "bad.png: expected a PNG image, found a file that begins with the bytes 6a 75 73 74 20 74 65 78"},
        {"\x89PNG\r\n\x1a\n", 8, "bad.png: damaged PNG: the file ends too early"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct image image = {0};
        struct error error;
        enum status status = decode_exact(&image, (const uint8_t *)cases[i].data, cases[i].size, &error);
        assert_refused(status, &image, &error);
        assert_string_equal(error.text, cases[i].sentence);
    }
}

/* A PFM of 2 × 3 with the values 0.5, 1.5, 2.5, … from the file's first float on. */
static void make_pfm(struct bytes *file, const char *header, size_t floats, int big_endian)
{
    bytes_put(file, header, strlen(header));
    for (size_t i = 0; i < floats; i++) {
        float value = (float)i + 0.5f;
        uint32_t bits;
        memcpy(&bits, &value, sizeof bits);
        bytes_put_u32(file, big_endian ? __builtin_bswap32(bits) : bits);
    }
}

static void test_pfm_kinds(void **state)
{
    (void)state;
    static const struct {
        const char *header;
        size_t channels;
        int big_endian;
    } cases[] = {
        {"PF\n2 3\n-1.0\n", 3, 0}, {"PF\n2 3\n1.0\n", 3, 1},   {"Pf\n2 3\n-1.0\n", 1, 0},
        {"Pf 2 3 2e3\n", 1, 1},    {"PF\r\n2\n3\n-.5 ", 3, 0}, {"PF\n2\t3 \n-1\n", 3, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct bytes file = {0};
        struct image image = {0};
        struct error error;
        size_t channels = cases[k].channels;
        make_pfm(&file, cases[k].header, 6 * channels, cases[k].big_endian);
        assert_int_equal(image_decode_pfm(&image, file.data, file.size, "x.pfm", &error), STATUS_OK);
        assert_int_equal(image.width, 2);
        assert_int_equal(image.height, 3);
        for (size_t i = 0; i < 18; i++) {
            size_t pixel = (2 - i / 6) * 2 + i / 3 % 2;
            assert_true(image.rgb[i] == (float)(pixel * channels + (channels == 3 ? i % 3 : 0)) + 0.5f);
        }
        image_finish(&image);
        bytes_finish(&file);
    }
}

static void test_broken_pfm(void **state)
{
    (void)state;
    static const struct {
        const char *header, *sentence;
    } cases[] = {
        {"", "x.pfm: expected a PFM image, found a file that begins with the bytes 00 00 00 3f 00 00 c0 3f"},
        {"PF4\n2 3\n-1\n", "x.pfm: expected a PFM image, PF or Pf, found \"PF4\""},
        {"PF\n0 3\n-1\n", "x.pfm: expected a PFM width of 1..65535 pixels, found \"0\""},
        {"PF\n-2 3\n-1\n", "x.pfm: expected a PFM width of 1..65535 pixels, found \"-2\""},
        {"PF\n2 65536\n-1\n", "x.pfm: expected a PFM height of 1..65535 pixels, found \"65536\""},
        {"PF\n2 99999999999999999999999999999999999999999999999999\n-1\n",
         "x.pfm: expected a PFM height of 1..65535 pixels, "
         "found \"99999999999999999999999999999999999999999999999\""},
        {"PF\n2 3\n0\n", "x.pfm: expected a PFM scale, a number other than 0, found \"0\""},
        {"PF\n2 3\nnan\n", "x.pfm: expected a PFM scale, a number other than 0, found \"nan\""},
        {"PF\n2 3\n-1x\n", "x.pfm: expected a PFM scale, a number other than 0, found \"-1x\""},
        {"PF\n3 3\n-1\n", "x.pfm: expected 108 bytes of PFM pixels, found 72"},
        {"PF\n1 3\n-1\n", "x.pfm: expected 36 bytes of PFM pixels, found 72"},
        {"PF\n65535 65535\n-1\n", "x.pfm: expected at most 268435456 pixels, found 65535 × 65535"},
        {"PF\n65535 4000\n-1\n", "x.pfm: expected 3145680000 bytes of PFM pixels, found 72"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct bytes file = {0};
        struct image image = {0};
        struct error error;
        make_pfm(&file, cases[k].header, 18, 0);
        assert_int_equal(image_decode_pfm(&image, file.data, file.size, "x.pfm", &error), STATUS_INPUT);
        assert_string_equal(error.text, cases[k].sentence);
        assert_null(image.rgb);
        bytes_finish(&file);
    }
}

static void test_pfm_cut_anywhere(void **state)
{
    (void)state;
    struct bytes file = {0};
    make_pfm(&file, "PF\n2 3\n-1.0\n", 18, 0);
    for (size_t size = 0; size < file.size; size++) {
        struct image image = {0};
        struct error error;
        uint8_t *copy = malloc(size);
        memcpy(copy, file.data, size);
        assert_int_equal(image_decode_pfm(&image, copy, size, "x.pfm", &error), STATUS_INPUT);
        assert_null(image.rgb);
        free(copy);
    }
    bytes_finish(&file);
}

static void test_pfm_must_be_finite(void **state)
{
    (void)state;
    struct bytes file = {0};
    struct image image = {0};
    struct error error;
    make_pfm(&file, "PF\n2 3\n-1.0\n", 17, 0);
    bytes_put_u32(&file, 0x7fc00000); /* NaN: blue of the last pixel, at the top right */
    assert_int_equal(image_decode_pfm(&image, file.data, file.size, "x.pfm", &error), STATUS_INPUT);
    assert_string_equal(error.text, "x.pfm: pixel (1, 0): expected finite numbers, found infinity or NaN");
    assert_null(image.rgb);
    bytes_finish(&file);
}

static void save(const char *path, const struct bytes *file)
{
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(file->data, 1, file->size, out), file->size);
    assert_int_equal(fclose(out), 0);
}

/* The kind is told by the content: the PNG is called .pfm here. */
static void test_files(void **state)
{
    (void)state;
    const char *base = getenv("TMPDIR");
    char *folder = memory_format("%s/weft-image-XXXXXX", base ? base : P_tmpdir);
    assert_non_null(mkdtemp(folder));
    char *path = memory_format("%s/image.pfm", folder);
    struct recipe recipe = {PNG_COLOR_TYPE_RGB, 8, 0, 0, 6, 5};
    struct bytes png = {0}, pfm = {0}, text = {0};
    struct image image = {0};
    struct error error;
    make_png(&png, &recipe);
    save(path, &png);
    assert_int_equal(image_read_file(&image, path, &error), STATUS_OK);
    assert_pixels(&image, &recipe);
    image_finish(&image);
    make_pfm(&pfm, "Pf\n2 3\n-1.0\n", 6, 0);
    save(path, &pfm);
    assert_int_equal(image_read_file(&image, path, &error), STATUS_OK);
    assert_true(image.rgb[0] == 4.5f);
    image_finish(&image);
    bytes_put(&text, "GIF89a", 6);
    save(path, &text);
    assert_int_equal(image_read_file(&image, path, &error), STATUS_INPUT);
    assert_non_null(strstr(error.text, "image.pfm: expected a PNG or PFM image, found a GIF image"));
    assert_int_equal(unlink(path), 0);
    assert_int_equal(image_read_file(&image, path, &error), STATUS_INPUT);
    assert_non_null(strstr(error.text, path));
    assert_null(image.rgb);
    assert_int_equal(rmdir(folder), 0);
    bytes_finish(&png);
    bytes_finish(&pfm);
    bytes_finish(&text);
    free(path);
    free(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_kind_of_png),
        cmocka_unit_test(test_known_light),
        cmocka_unit_test(test_png_cut_anywhere),
        cmocka_unit_test(test_png_with_any_byte_changed),
        cmocka_unit_test(test_png_that_claims_too_much),
        cmocka_unit_test(test_memory_follows_the_rows_that_are_there),
        cmocka_unit_test(test_not_a_png),
        cmocka_unit_test(test_pfm_kinds),
        cmocka_unit_test(test_broken_pfm),
        cmocka_unit_test(test_pfm_cut_anywhere),
        cmocka_unit_test(test_pfm_must_be_finite),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests_name("image_read", tests, NULL, NULL);
}
