#include "image/png_write.h"

#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <zlib.h>

#include "base/memory.h"
#include "image/png_memory.h"

/*
 * Chosen by measurement: seven pictures of 1920 × 1080 together (1 or 4 samples a pixel; textures, glass, skies),
 * libpng 1.6.39, zlib 1.2.13, one core of a Xeon, the best of two to five. "Runs" is Z_RLE, a number zlib's level.
 *
 *             sub, runs        Paeth, runs      sub, 1           all five, 1      sub, 6
 *    8 bits   0.28 s  6.9 MiB  0.40 s  6.4 MiB  0.32 s  7.0 MiB  0.56 s  6.7 MiB  1.40 s  5.8 MiB
 *   16 bits   0.69 s 30.5 MiB  0.92 s 30.0 MiB  1.11 s 29.1 MiB  1.63 s 28.6 MiB  2.73 s 27.1 MiB
 */
enum {
    LEVEL = 1, /* of no effect on Z_RLE but for a note in the file */
    STRATEGY = Z_RLE,
    FILTERS = PNG_FILTER_SUB,
    IDAT_BYTES = 1 << 18, /* of one IDAT chunk; each costs three system calls */
};

/* libpng reports a fault by longjmp; what a jump could leave behind is held here. The last three are set
 * for the length of one call. */
struct png_encoder {
    struct part_file *file;
    uint64_t offset; /* bytes written */
    png_structp png;
    png_infop info;
    enum status status;
    const struct image_description *description;
    const uint8_t *row;
    struct error *error;
};

static _Noreturn void on_error(png_structp png, png_const_charp message)
{
    struct png_encoder *encoder = png_get_error_ptr(png);
    encoder->status = error_set(encoder->error, STATUS_OUTPUT, "%s: libpng cannot write it: %s",
                                encoder->file->path, message);
    part_file_discard(encoder->file);
    png_longjmp(png, 1);
}

/* Nothing that libpng warns of changes a pixel. */
static void on_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static void on_write(png_structp png, png_bytep data, size_t size)
{
    struct png_encoder *encoder = png_get_io_ptr(png);
    encoder->status = part_file_write(encoder->file, data, size, encoder->offset, encoder->error);
    if (encoder->status != STATUS_OK)
        png_longjmp(png, 1);
    encoder->offset += size;
}

static void on_flush(png_structp png)
{
    (void)png;
}

/* Runs a step, and forwards the status that broke it off. */
static enum status attempt(struct png_encoder *encoder, void (*step)(struct png_encoder *), struct error *error)
{
    encoder->error = error;
    if (setjmp(png_jmpbuf(encoder->png)))
        return encoder->status;
    step(encoder);
    return STATUS_OK;
}

static void set_compression(png_structp png)
{
    png_set_compression_level(png, LEVEL);
    png_set_compression_strategy(png, STRATEGY);
    png_set_compression_mem_level(png, 8);
    png_set_compression_window_bits(png, 15);
    png_set_compression_buffer_size(png, IDAT_BYTES);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, FILTERS);
}

/* A tEXt chunk holds Latin-1, so what is not ASCII goes into an iTXt chunk, which holds UTF-8. */
static png_text text_chunk(const char *key, const char *value)
{
    int compression = PNG_TEXT_COMPRESSION_NONE;
    for (const char *c = value; *c; c++)
        if ((unsigned char)*c >= 0x80)
            compression = PNG_ITXT_COMPRESSION_NONE;
    return (png_text){.compression = compression, .key = (char *)key, .text = (char *)value};
}

static void write_header(struct png_encoder *encoder)
{
    const struct image_description *d = encoder->description;
    png_text texts[] = {text_chunk("Software", d->software), text_chunk("Source", d->source)};
    png_structp png = encoder->png;
    encoder->info = png_create_info_struct(png);
    png_set_write_fn(png, encoder, on_write, on_flush);
    set_compression(png);
    png_set_IHDR(png, encoder->info, d->width, d->height, d->format == PIXEL_SRGB16 ? 16 : 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
    png_set_sRGB(png, encoder->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_text(png, encoder->info, texts, 2);
    png_write_info(png, encoder->info);
}

static void write_row(struct png_encoder *encoder)
{
    png_write_row(encoder->png, encoder->row);
}

static void write_end(struct png_encoder *encoder)
{
    png_write_end(encoder->png, NULL);
}

static enum status start(struct png_encoder *encoder, struct error *error)
{
    encoder->error = error;
    encoder->png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, encoder, on_error, on_warning, NULL,
                                             png_memory_allocate, png_memory_free);
    if (!encoder->png)
        return encoder->status;
    return attempt(encoder, write_header, error);
}

struct png_encoder *png_encoder_create(struct part_file *file, const struct image_description *description,
                                       enum status *status, struct error *error)
{
    struct png_encoder *encoder = memory_array(1, sizeof *encoder);
    encoder->file = file;
    encoder->description = description;
    *status = start(encoder, error);
    if (*status == STATUS_OK)
        return encoder;
    png_encoder_destroy(encoder);
    return NULL;
}

enum status png_encoder_row(struct png_encoder *encoder, const uint8_t *row, struct error *error)
{
    encoder->row = row;
    return attempt(encoder, write_row, error);
}

enum status png_encoder_end(struct png_encoder *encoder, struct error *error)
{
    return attempt(encoder, write_end, error);
}

void png_encoder_destroy(struct png_encoder *encoder)
{
    if (!encoder)
        return;
    png_destroy_write_struct(&encoder->png, &encoder->info);
    free(encoder);
}
