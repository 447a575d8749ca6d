#include "coordinator/preview.h"

#include <assert.h>
#include <png.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "coordinator/map_colours.h"
#include "trace/sampling.h"
#include "wire/rows.h"

enum {
    CELL_BYTES = 5,  /* red, green, blue, the codes of its stage and of its error */
    PIXEL_BYTES = 4, /* of a PNG */
    ROWS_AT_ONCE = 16, /* of cells that are read under the lock */
};

#define ROW_MISSING UINT32_MAX

struct preview {
    uint32_t width, height; /* of the picture */
    uint32_t side;          /* pixels: of the square that a cell stands for */
    uint32_t across, down;  /* cells */
    enum pixel_format format;
    struct row_layout layout;
    struct vec3 *light; /* scratch of preview_add: a row of linear light, */
    uint8_t *codes;     /* and its codes, then those of its maps, a byte a pixel each; */
    uint8_t *fresh;     /* and of the row's cells */

    pthread_mutex_t mutex; /* guards what follows */
    uint8_t *cells;
    uint16_t *counts; /* of rows that are in a row of cells */
    uint32_t *owners; /* of each row: the worker's number, or ROW_MISSING */
    uint64_t version;
};

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (a + b - 1) / b;
}

/* Pixels of a cell's side. */
static uint32_t choose_side(uint32_t width, uint32_t height, size_t bytes)
{
    uint32_t larger = width > height ? width : height, side = divide_up(larger, PREVIEW_SIDE_MAX);
    while (side < larger && (uint64_t)divide_up(width, side) * divide_up(height, side) * CELL_BYTES > bytes)
        side++;
    return side;
}

struct preview *preview_create(uint32_t width, uint32_t height, enum pixel_format format, bool maps, size_t bytes)
{
    struct preview *p = memory_array(1, sizeof *p);
    p->width = width;
    p->height = height;
    p->side = choose_side(width, height, bytes);
    p->across = divide_up(width, p->side);
    p->down = divide_up(height, p->side);
    p->format = format;
    p->layout = row_layout_of(width, pixel_format_bytes(format), maps);
    p->light = format == PIXEL_LINEAR ? memory_array(width, sizeof *p->light) : NULL;
    p->codes = memory_array(width, CELL_BYTES);
    p->fresh = memory_array(p->across, CELL_BYTES);
    pthread_mutex_init(&p->mutex, NULL);
    p->cells = memory_array((size_t)p->across * p->down, CELL_BYTES);
    p->counts = memory_array(p->down, sizeof *p->counts);
    p->owners = memory_array(height, sizeof *p->owners);
    memset(p->owners, 0xff, height * sizeof *p->owners);
    return p;
}

void preview_destroy(struct preview **pointer)
{
    struct preview *p = *pointer;
    if (!p)
        return;
    pthread_mutex_destroy(&p->mutex);
    free(p->light);
    free(p->codes);
    free(p->fresh);
    free(p->cells);
    free(p->counts);
    free(p->owners);
    free(p);
    *pointer = NULL;
}

/* --- rows to cells ---------------------------------------------------------------------------------------- */

static float little_endian_float(const uint8_t *bytes)
{
    uint32_t bits = bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The pixels of a record as codes of 8 bits, into codes[3 * width]. */
static void read_codes(struct preview *p, const uint8_t *pixels)
{
    if (p->format == PIXEL_SRGB8) {
        memcpy(p->codes, pixels, 3 * (size_t)p->width);
    } else if (p->format == PIXEL_SRGB16) {
        for (size_t i = 0; i < 3 * (size_t)p->width; i++)
            p->codes[i] = pixels[2 * i];
    } else {
        for (size_t x = 0; x < p->width; x++, pixels += 12)
            p->light[x] = (struct vec3){little_endian_float(pixels), little_endian_float(pixels + 4),
                                        little_endian_float(pixels + 8)};
        pixel_format_encode(PIXEL_SRGB8, p->light, p->width, p->codes);
    }
}

/* What the row's figures say of all of its pixels. */
static void spread_figures(const struct preview *p, const uint8_t *record, uint8_t *stages, uint8_t *errors)
{
    struct row_figures figures;
    row_figures_read(record, &figures);
    double squared = ((double)figures.error[0] + (double)figures.error[1]) / 0x1p44 / p->width;
    uint64_t samples = figures.samples / p->width;
    memset(stages, (int)sampling_stage_within(samples < 1 ? 1 : samples > 65536 ? 65536 : (uint32_t)samples), p->width);
    memset(errors, row_error_code(squared), p->width);
}

static void read_maps(struct preview *p, const uint8_t *record)
{
    uint8_t *stages = p->codes + 3 * (size_t)p->width, *errors = stages + p->width;
    if (p->layout.map_bytes == 0) {
        spread_figures(p, record, stages, errors);
        return;
    }
    memcpy(stages, record + row_stages_at(&p->layout), p->width);
    memcpy(errors, record + row_errors_at(&p->layout), p->width);
}

/* The mean of `count` codes that lie so far apart. */
static uint8_t mean_of(const uint8_t *codes, size_t stride, uint32_t count)
{
    uint32_t sum = count / 2;
    for (uint32_t i = 0; i < count; i++)
        sum += codes[i * stride];
    return (uint8_t)(sum / count);
}

static void make_cells(struct preview *p)
{
    const uint8_t *stages = p->codes + 3 * (size_t)p->width, *errors = stages + p->width;
    for (uint32_t i = 0; i < p->across; i++) {
        uint32_t x = i * p->side, count = p->width - x < p->side ? p->width - x : p->side;
        uint8_t *cell = p->fresh + CELL_BYTES * (size_t)i;
        for (int channel = 0; channel < 3; channel++)
            cell[channel] = mean_of(p->codes + 3 * (size_t)x + channel, 3, count);
        cell[3] = mean_of(stages + x, 1, count);
        cell[4] = mean_of(errors + x, 1, count);
    }
}

/* The row's cells join those of `count` rows before it. */
static void merge_cells(uint8_t *cells, const uint8_t *fresh, size_t bytes, uint32_t count)
{
    if (count == 0) {
        memcpy(cells, fresh, bytes);
        return;
    }
    for (size_t i = 0; i < bytes; i++)
        cells[i] = (uint8_t)((cells[i] * count + fresh[i] + (count + 1) / 2) / (count + 1));
}

static void add_row(struct preview *p, uint32_t row, uint32_t worker, const uint8_t *record)
{
    size_t bytes = CELL_BYTES * (size_t)p->across;
    uint32_t down = row / p->side;
    read_codes(p, record + ROW_FIGURES_BYTES);
    read_maps(p, record);
    make_cells(p);
    pthread_mutex_lock(&p->mutex);
    assert(p->owners[row] == ROW_MISSING);
    merge_cells(p->cells + down * bytes, p->fresh, bytes, p->counts[down]);
    p->counts[down]++;
    p->owners[row] = worker;
    p->version++;
    pthread_mutex_unlock(&p->mutex);
}

void preview_add(struct preview *p, uint32_t first_row, uint32_t rows, uint32_t worker, const uint8_t *records)
{
    for (uint32_t i = 0; i < rows; i++)
        add_row(p, first_row + i, worker, records + i * row_record_bytes(&p->layout));
}

void preview_drop(struct preview *p, uint32_t first_row, uint32_t rows)
{
    pthread_mutex_lock(&p->mutex);
    for (uint32_t row = first_row; row < first_row + rows; row++) {
        p->owners[row] = ROW_MISSING;
        p->counts[row / p->side] = 0;
    }
    p->version++;
    pthread_mutex_unlock(&p->mutex);
}

/* --- looking at it ---------------------------------------------------------------------------------------- */

uint32_t preview_width(const struct preview *p)
{
    return p->across;
}

uint32_t preview_height(const struct preview *p)
{
    return p->down;
}

uint64_t preview_version(struct preview *p)
{
    pthread_mutex_lock(&p->mutex);
    uint64_t version = p->version;
    pthread_mutex_unlock(&p->mutex);
    return version;
}

static void show_cell(enum preview_kind kind, const uint8_t *cell, uint8_t *rgba)
{
    if (kind == PREVIEW_PICTURE)
        memcpy(rgba, cell, 3);
    else if (kind == PREVIEW_SAMPLES)
        map_colour_of_stage(cell[3], rgba);
    else
        map_colour_of_error(cell[4], rgba);
    rgba[3] = 255;
}

/* Into rgba, which is all 0 before. */
static void show_row(const struct preview *p, enum preview_kind kind, uint32_t down, uint8_t *rgba)
{
    if (p->counts[down] == 0)
        return;
    const uint8_t *cells = p->cells + CELL_BYTES * (size_t)p->across * down;
    for (size_t i = 0; i < p->across; i++)
        show_cell(kind, cells + CELL_BYTES * i, rgba + PIXEL_BYTES * i);
}

/* A few rows under one lock, so that who adds rows never waits for all. */
static uint64_t show_all(struct preview *p, enum preview_kind kind, uint8_t *rgba)
{
    uint64_t version = preview_version(p);
    for (uint32_t down = 0; down < p->down; down += ROWS_AT_ONCE) {
        pthread_mutex_lock(&p->mutex);
        for (uint32_t i = down; i < p->down && i < down + ROWS_AT_ONCE; i++)
            show_row(p, kind, i, rgba + PIXEL_BYTES * (size_t)p->across * i);
        pthread_mutex_unlock(&p->mutex);
    }
    return version;
}

/* Quickly rather than small. Nothing where libpng has no memory. */
static void compress(const struct preview *p, const uint8_t *rgba, struct bytes *png)
{
    png_image image = {.version = PNG_IMAGE_VERSION, .width = p->across, .height = p->down, .format = PNG_FORMAT_RGBA,
                       .flags = PNG_IMAGE_FLAG_FAST};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    bytes_extend(png, size);
    bool is_whole = png_image_write_to_memory(&image, png->data, &size, 0, rgba, 0, NULL);
    png->size = size;
    if (!is_whole)
        bytes_finish(png);
}

uint64_t preview_png(struct preview *p, enum preview_kind kind, struct bytes *png)
{
    uint8_t *rgba = memory_array((size_t)p->across * p->down, PIXEL_BYTES);
    uint64_t version = show_all(p, kind, rgba);
    compress(p, rgba, png);
    free(rgba);
    if (png->size > 0)
        png->data = memory_resize(png->data, png->size, 1);
    png->capacity = png->size;
    return version;
}

size_t preview_shares(struct preview *p, struct preview_share **shares)
{
    size_t count = 0, capacity = 0;
    *shares = NULL;
    pthread_mutex_lock(&p->mutex);
    for (uint32_t row = 0; row < p->height; row++) {
        if (p->owners[row] == ROW_MISSING)
            continue;
        if (row > 0 && p->owners[row] == p->owners[row - 1]) {
            (*shares)[count - 1].rows++;
            continue;
        }
        *shares = memory_grow(*shares, &capacity, count + 1, sizeof **shares);
        (*shares)[count++] = (struct preview_share){row, 1, p->owners[row]};
    }
    pthread_mutex_unlock(&p->mutex);
    return count;
}
