/*
 * A picture that is being rendered, small enough to be kept in memory, for those who watch: 8 bits a channel, and its
 * maps of samples and of errors. Rows come in any order, and may be taken back.
 *
 * Where the picture is larger than what is kept, a cell stands for a square of its pixels: the mean of their codes, of
 * those rows that are there. A row of cells of which some rows are taken back is gone, and shows what comes from then
 * on.
 *
 * One thread adds and takes back; any thread may read meanwhile, and makes the other wait for a few rows of cells at
 * most.
 */
#ifndef WEFT_COORDINATOR_PREVIEW_H
#define WEFT_COORDINATOR_PREVIEW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "image/encode.h"

enum preview_kind { PREVIEW_PICTURE, PREVIEW_SAMPLES, PREVIEW_ERROR, PREVIEW_KINDS };

enum {
    PREVIEW_SIDE_MAX = 1920,       /* cells */
    PREVIEWS_BYTES_MAX = 64 << 20, /* of all previews of a command together */
};

struct preview;

/* Of a picture whose row records (wire/rows.h) have pixels in that format, and maps or not; without, the map of a row
 * is what its figures say of the whole row. Takes at most about so many bytes. */
struct preview *preview_create(uint32_t width, uint32_t height, enum pixel_format format, bool maps, size_t bytes);

/* Frees *preview and sets it to NULL; *preview may be NULL. */
void preview_destroy(struct preview **preview);

/* Takes the records of rows first_row..first_row + rows − 1, which are not there, rendered by the worker of that number
 * (0: in an earlier run). */
void preview_add(struct preview *preview, uint32_t first_row, uint32_t rows, uint32_t worker, const uint8_t *records);

/* Takes rows back that are there. */
void preview_drop(struct preview *preview, uint32_t first_row, uint32_t rows);

/* Grows with whatever is added or taken back. */
uint64_t preview_version(struct preview *preview);

/* Cells across and down. */
uint32_t preview_width(const struct preview *preview);
uint32_t preview_height(const struct preview *preview);

/* Its present state as a PNG, RGBA of 8 bits, into *png, which is empty before, and stays so if libpng has no memory;
 * rows that are not there are transparent. Returns its version. */
uint64_t preview_png(struct preview *preview, enum preview_kind kind, struct bytes *png);

/* Rows of the picture side by side that are there, by one worker. */
struct preview_share {
    uint32_t first_row, rows, worker;
};

/* All that are there, from the top: *shares is the caller's to free. Returns how many. */
size_t preview_shares(struct preview *preview, struct preview_share **shares);

#endif
