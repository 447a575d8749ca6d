#include "worker/band.h"

#include <assert.h>
#include <stdlib.h>

#include "base/memory.h"
#include "image/encode.h"

static_assert((int)ROW_STAGES == (int)SAMPLING_STAGES, "rows count the pixels of every stage");

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (a + b - 1) / b;
}

static void init_survey(struct band *band)
{
    band->tiles_across = divide_up(survey_grid(band->settings->width, band->settings->height).across, SURVEY_RUN);
    band->tiles = band->tiles_across * band->order.rows;
    band->survey = memory_array(1, sizeof *band->survey);
}

static void init_render(struct band *band)
{
    const struct job_settings *settings = band->settings;
    band->tiles_across = divide_up(settings->width, TILE_WIDTH);
    band->tiles = band->tiles_across * divide_up(band->order.rows, TILE_ROWS);
    band->layout = row_layout_of(settings->width, pixel_format_bytes((enum pixel_format)settings->pixel_format),
                                 settings->maps);
    band->figures = memory_array(band->order.rows, sizeof *band->figures);
    bytes_extend(&band->result, band->order.rows * row_record_bytes(&band->layout));
}

void band_init(struct band *band, const struct job_settings *settings, const struct order *order)
{
    *band = (struct band){.settings = settings, .order = *order};
    if (order->pass == PASS_SURVEY)
        init_survey(band);
    else
        init_render(band);
}

void band_finish(struct band *band)
{
    free(band->survey);
    free(band->figures);
    bytes_finish(&band->result);
}

/* --- tiles ------------------------------------------------------------------------------------------------ */

/* Which pixels of a render's band. */
struct tile {
    uint32_t x0, x1;
    uint32_t row0, row1; /* within the band */
};

static uint8_t *record_of(const struct band *band, uint32_t row)
{
    return band->result.data + row * row_record_bytes(&band->layout);
}

static struct tile tile_at(const struct band *band, uint32_t index)
{
    uint32_t width = band->settings->width, rows = band->order.rows;
    uint32_t column = index % band->tiles_across, row = index / band->tiles_across;
    struct tile tile = {.x0 = column * TILE_WIDTH, .row0 = row * TILE_ROWS};
    tile.x1 = width - tile.x0 < TILE_WIDTH ? width : tile.x0 + TILE_WIDTH;
    tile.row1 = rows - tile.row0 < TILE_ROWS ? rows : tile.row0 + TILE_ROWS;
    return tile;
}

/* The record's pixels from x on, and what its maps say of them. */
static void encode_pixels(const struct band *band, uint8_t *record, uint32_t x, uint32_t count,
                          const struct pixel *pixels)
{
    enum pixel_format format = (enum pixel_format)band->settings->pixel_format;
    struct vec3 light[TILE_WIDTH];
    for (uint32_t i = 0; i < count; i++)
        light[i] = pixels[i].light;
    pixel_format_encode(format, light, count, record + ROW_FIGURES_BYTES + x * pixel_format_bytes(format));
    for (uint32_t i = 0; i < count && band->settings->maps; i++) {
        record[row_stages_at(&band->layout) + x + i] = (uint8_t)sampling_stage_within(pixels[i].samples);
        record[row_errors_at(&band->layout) + x + i] = row_error_code(pixels[i].error);
    }
}

static uint64_t whole_error(double squared)
{
    return (uint64_t)((squared > 0 ? squared < 1 ? squared : 1 : 0) / PIXEL_ERROR_UNIT);
}

static void add_pixels(struct row_figures *to, const struct pixel *pixels, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        to->error[pixels[i].samples > 1] += whole_error(pixels[i].error);
        to->stages[sampling_stage_within(pixels[i].samples)]++;
    }
}

static uint64_t count_rays(const struct ray_counts *counts)
{
    return counts->camera + counts->secondary + counts->shadow;
}

static void render_tile(struct tracer *tracer, const struct band *band, const struct tile *tile,
                        struct tile_outcome *outcome)
{
    struct pixel pixels[TILE_ROWS * TILE_WIDTH];
    struct ray_counts counts[TILE_ROWS] = {{0}};
    uint32_t top = band->order.first_row, width = tile->x1 - tile->x0;
    struct pixel_area area = {tile->x0, tile->x1, top + tile->row0, top + tile->row1};
    tracer_area(tracer, &band->order.sampling, &area, pixels, counts);
    for (uint32_t i = 0; i < tile->row1 - tile->row0; i++) {
        struct row_figures *figures = &outcome->figures[i];
        *figures = (struct row_figures){counts[i].camera, counts[i].secondary, counts[i].shadow, {0}, {0}};
        add_pixels(figures, pixels + i * width, width);
        encode_pixels(band, record_of(band, tile->row0 + i), tile->x0, width, pixels + i * width);
        outcome->rays += count_rays(&counts[i]);
    }
}

static void survey_tile(struct tracer *tracer, const struct band *band, uint32_t index, struct tile_outcome *outcome)
{
    struct survey_grid grid = survey_grid(band->settings->width, band->settings->height);
    struct ray_counts counts = {0};
    outcome->survey = (struct survey){0};
    uint32_t first = index % band->tiles_across * SURVEY_RUN, left = grid.across - first;
    survey_cells(tracer, &band->order.sampling, &grid, first, left < SURVEY_RUN ? left : SURVEY_RUN,
                 band->order.first_row + index / band->tiles_across, &outcome->survey, &counts);
    outcome->rays += count_rays(&counts);
}

void band_work(const struct band *band, struct tracer *tracer, uint32_t index, struct tile_outcome *outcome)
{
    outcome->rays = 0;
    if (band->survey) {
        survey_tile(tracer, band, index, outcome);
    } else {
        struct tile tile = tile_at(band, index);
        render_tile(tracer, band, &tile, outcome);
    }
}

void band_add(struct band *band, uint32_t index, const struct tile_outcome *outcome)
{
    if (band->survey) {
        survey_add(band->survey, &outcome->survey);
        return;
    }
    struct tile tile = tile_at(band, index);
    for (uint32_t row = tile.row0; row < tile.row1; row++)
        row_figures_add(&band->figures[row], &outcome->figures[row - tile.row0]);
}

/* --- the result ------------------------------------------------------------------------------------------- */

struct bytes band_complete(struct band *band)
{
    if (band->survey)
        survey_write(band->survey, bytes_extend(&band->result, SURVEY_BYTES));
    for (uint32_t row = 0; row < band->order.rows && !band->survey; row++)
        row_figures_write(record_of(band, row), &band->figures[row]);
    struct bytes result = band->result;
    band->result = (struct bytes){0};
    return result;
}
