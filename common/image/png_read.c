/*
 * Reading PNG through libpng. libpng reports a fault by longjmp; everything that a jump could leave behind
 * is held in struct png_decoder, in the frame of a function that no jump crosses.
 */
#include <png.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "image/image.h"
#include "image/kind.h"
#include "image/png_memory.h"
#include "math/colour.h"

enum {
    CHUNKS_MAX = 64,           /* chunks that libpng may store */
    CHUNK_BYTES_MAX = 1 << 16, /* of one of them; the largest that we use is a palette's 768 */
    FIRST_ROWS = 16,           /* rows allocated before the first is decoded */
};

struct png_decoder {
    struct byte_reader source;
    png_structp png;
    png_infop info;
    bool keeps;              /* the pixels; otherwise they are only read */
    struct image image;
    uint32_t rows_allocated; /* of image.rgb */
    uint32_t code_bytes;     /* 1 or 2 */
    uint8_t *codes;          /* one row: red, green, blue; two bytes are big-endian. Not kept: as in the file */
    float *light;            /* the linear light of every code; of two bytes, 0 until it is needed */
    char reason[256];        /* libpng's last word */
    char warning[256];       /* its latest warning, or "" */
};

/* The pixels x0 + i dx, y0 + j dy that the rows of a pass hold. */
struct png_pass {
    uint32_t x0, y0, dx, dy, columns, rows;
};

/* Of a bad header libpng says only that it is invalid, having said why in a warning. */
static _Noreturn void on_error(png_structp png, png_const_charp message)
{
    struct png_decoder *decoder = png_get_error_ptr(png);
    if (strcmp(message, "Invalid IHDR data") == 0 && decoder->warning[0])
        message = decoder->warning;
    snprintf(decoder->reason, sizeof decoder->reason, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    struct png_decoder *decoder = png_get_error_ptr(png);
    snprintf(decoder->warning, sizeof decoder->warning, "%s", message);
}

static void on_read(png_structp png, png_bytep out, size_t size)
{
    struct png_decoder *decoder = png_get_io_ptr(png);
    const uint8_t *bytes = byte_reader_take(&decoder->source, size);
    if (!bytes)
        png_error(png, "the file ends too early");
    memcpy(out, bytes, size);
}

/* Runs a step; false if libpng broke it off. */
static bool attempt(struct png_decoder *decoder, void (*step)(struct png_decoder *))
{
    if (setjmp(png_jmpbuf(decoder->png)))
        return false;
    step(decoder);
    return true;
}

static void read_header(struct png_decoder *decoder)
{
    png_structp png = decoder->png;
    decoder->info = png_create_info_struct(png);
    png_set_read_fn(png, decoder, on_read);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX); /* check_size has a clearer sentence */
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_set_chunk_cache_max(png, CHUNKS_MAX);
    png_set_chunk_malloc_max(png, CHUNK_BYTES_MAX);
    /* Skips every ancillary chunk that could change colours or hold a compressed bomb. */
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, NULL, -1);
    png_read_info(png, decoder->info);
    decoder->image.width = png_get_image_width(png, decoder->info);
    decoder->image.height = png_get_image_height(png, decoder->info);
}

/* Asks for red, green and blue of 8 or 16 bits, whatever the file holds. */
static void choose_codes(struct png_decoder *decoder)
{
    png_set_expand(decoder->png);
    png_set_strip_alpha(decoder->png);
    png_set_gray_to_rgb(decoder->png);
    png_read_update_info(decoder->png, decoder->info);
    decoder->code_bytes = png_get_bit_depth(decoder->png, decoder->info) / 8u;
    if (png_get_rowbytes(decoder->png, decoder->info) != (size_t)decoder->image.width * 3 * decoder->code_bytes)
        png_error(decoder->png, "unexpected row size");
    decoder->codes = memory_array((size_t)decoder->image.width * 3, decoder->code_bytes);
    decoder->light = memory_array(decoder->code_bytes == 1 ? 256 : 65536, sizeof *decoder->light);
    for (int code = 0; decoder->code_bytes == 1 && code < 256; code++)
        decoder->light[code] = (float)colour_from_srgb8((uint8_t)code);
}

/* The image grows as rows arrive, since a small file may claim a large one: what is touched stays in
 * proportion to what the file really holds. Rows of one pass are at most 8 apart, less than any step. */
static void reach_row(struct png_decoder *decoder, uint32_t y)
{
    struct image *image = &decoder->image;
    if (y < decoder->rows_allocated)
        return;
    uint64_t rows = decoder->rows_allocated ? 2 * (uint64_t)decoder->rows_allocated : FIRST_ROWS;
    decoder->rows_allocated = rows < image->height ? (uint32_t)rows : image->height;
    size_t pixels = (size_t)decoder->rows_allocated * image->width;
    image->rgb = memory_resize(image->rgb, pixels, 3 * sizeof *image->rgb);
}

/* Both put the pixels of a row dx pixels apart. */
static void put_8_bits(const struct png_decoder *decoder, const struct png_pass *pass, float *out)
{
    const uint8_t *codes = decoder->codes;
    for (uint32_t i = 0; i < pass->columns; i++, codes += 3, out += (size_t)pass->dx * 3)
        for (int c = 0; c < 3; c++)
            out[c] = decoder->light[codes[c]];
}

static float light_of_16_bits(struct png_decoder *decoder, uint32_t code)
{
    float *light = &decoder->light[code];
    if (*light == 0)
        *light = (float)colour_decode_srgb(code / 65535.0);
    return *light;
}

static void put_16_bits(struct png_decoder *decoder, const struct png_pass *pass, float *out)
{
    const uint8_t *codes = decoder->codes;
    for (uint32_t i = 0; i < pass->columns; i++, codes += 6, out += (size_t)pass->dx * 3)
        for (int c = 0; c < 3; c++)
            out[c] = light_of_16_bits(decoder, (uint32_t)codes[2 * c] << 8 | codes[2 * c + 1]);
}

static void store_row(struct png_decoder *decoder, const struct png_pass *pass, uint32_t y)
{
    float *out = decoder->image.rgb + ((size_t)y * decoder->image.width + pass->x0) * 3;
    if (decoder->code_bytes == 1)
        put_8_bits(decoder, pass, out);
    else
        put_16_bits(decoder, pass, out);
}

static struct png_pass pass_of(const struct png_decoder *decoder, int pass)
{
    uint32_t width = decoder->image.width, height = decoder->image.height;
    if (png_get_interlace_type(decoder->png, decoder->info) == PNG_INTERLACE_NONE)
        return (struct png_pass){0, 0, 1, 1, width, height};
    return (struct png_pass){
        PNG_PASS_START_COL(pass), PNG_PASS_START_ROW(pass), PNG_PASS_COL_OFFSET(pass),
        PNG_PASS_ROW_OFFSET(pass), PNG_PASS_COLS(width, pass), PNG_PASS_ROWS(height, pass),
    };
}

/* Places the pixels of an interlaced file itself, for libpng would need the codes of all rows at once. A
 * pass without columns has no rows in the file. */
static void read_rows(struct png_decoder *decoder)
{
    if (decoder->keeps)
        choose_codes(decoder);
    else
        decoder->codes = memory_array(png_get_rowbytes(decoder->png, decoder->info), 1);
    bool interlaced = png_get_interlace_type(decoder->png, decoder->info) != PNG_INTERLACE_NONE;
    for (int p = 0; p < (interlaced ? PNG_INTERLACE_ADAM7_PASSES : 1); p++) {
        struct png_pass pass = pass_of(decoder, p);
        for (uint32_t j = 0; pass.columns > 0 && j < pass.rows; j++) {
            png_read_row(decoder->png, decoder->codes, NULL);
            if (!decoder->keeps)
                continue;
            uint32_t y = pass.y0 + j * pass.dy;
            reach_row(decoder, y);
            store_row(decoder, &pass, y);
        }
    }
    png_read_end(decoder->png, NULL);
}

/* Nothing as large as the image has been allocated before this. */
static enum status check_size(const struct png_decoder *decoder, const char *name, struct error *error)
{
    uint32_t width = decoder->image.width, height = decoder->image.height;
    if (width > IMAGE_SIDE_MAX || height > IMAGE_SIDE_MAX || (uint64_t)width * height > IMAGE_PIXELS_MAX)
        return error_set(error, STATUS_INPUT,
                         "%s: expected at most %d pixels a side and %d in all, found %u × %u", name,
                         IMAGE_SIDE_MAX, IMAGE_PIXELS_MAX, width, height);
    return STATUS_OK;
}

static enum status decode(struct png_decoder *decoder, const char *name, struct error *error)
{
    decoder->png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, decoder, on_error, on_warning, NULL,
                                            png_memory_allocate, png_memory_free);
    if (!decoder->png)
        return error_set(error, STATUS_INTERNAL, "%s: libpng cannot start: %s", name, decoder->reason);
    if (!attempt(decoder, read_header))
        return error_set(error, STATUS_INPUT, "%s: damaged PNG: %s", name, decoder->reason);
    enum status status = check_size(decoder, name, error);
    if (status == STATUS_OK && !attempt(decoder, read_rows))
        return error_set(error, STATUS_INPUT, "%s: damaged PNG: %s", name, decoder->reason);
    return status;
}

/* The image of the decoder, which must be all zero but for source and keeps, stays empty on failure. */
static enum status run(struct png_decoder *decoder, const char *name, struct error *error)
{
    const uint8_t *data = decoder->source.data;
    size_t size = decoder->source.size;
    if (image_kind_of(data, size) != IMAGE_KIND_PNG) {
        char found[IMAGE_KIND_TEXT_BYTES];
        image_kind_describe(data, size, found);
        return error_set(error, STATUS_INPUT, "%s: expected a PNG image, found %s", name, found);
    }
    enum status status = decode(decoder, name, error);
    png_destroy_read_struct(&decoder->png, &decoder->info, NULL);
    free(decoder->codes);
    free(decoder->light);
    if (status != STATUS_OK)
        image_finish(&decoder->image);
    return status;
}

enum status image_decode_png(struct image *image, const void *data, size_t size, const char *name,
                             struct error *error)
{
    struct png_decoder decoder = {.source = byte_reader_of(data, size), .keeps = true};
    enum status status = run(&decoder, name, error);
    if (status == STATUS_OK)
        *image = decoder.image;
    return status;
}

enum status image_check_png(const void *data, size_t size, const char *name, struct error *error)
{
    struct png_decoder decoder = {.source = byte_reader_of(data, size)};
    return run(&decoder, name, error);
}
