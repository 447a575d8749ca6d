/*
 * Row records: what the result of a band of a render carries, row by row, and what the journal holds.
 *
 * A record is the row's figures (ROW_FIGURES_BYTES, little-endian), then its pixels in the output's pixel format, then
 * in a job with maps a byte a pixel for its stage of sampling, and after those a byte a pixel for its error
 * (row_error_code). A band is its rows' records from the top.
 */
#ifndef WEFT_WIRE_ROWS_H
#define WEFT_WIRE_ROWS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"

enum { ROW_STAGES = 16 }; /* as many as the tracing core's stages of sampling */

/* Figures of a row, or sums of them. Whole numbers, so that adding them up is exact in any order. */
struct row_figures {
    uint64_t samples;            /* camera rays */
    uint64_t secondary_rays;     /* mirrored and transmitted */
    uint64_t shadow_rays;
    uint64_t error[2];           /* the pixels' estimated squared errors in units of 2^-44, each 2^44 at most: of those
                                  * with one sample ([0]) and with more ([1]). UINT64_MAX: more than can be counted */
    uint64_t stages[ROW_STAGES]; /* pixels that were done with each stage */
};

/* Adds the figures of more rows. A row's errors come to less than 2^60, a picture's to more than 2^64 only where 2^20
 * pixels or more are as wrong as can be; their sum then stays at UINT64_MAX, again in any order. */
void row_figures_add(struct row_figures *to, const struct row_figures *from);

/* Rays of every kind. */
static inline uint64_t row_figures_rays(const struct row_figures *figures)
{
    return figures->samples + figures->secondary_rays + figures->shadow_rays;
}

enum { ROW_FIGURES_BYTES = 8 * (5 + ROW_STAGES) };

/* How long the parts of a job's records are. */
struct row_layout {
    size_t pixels_bytes; /* of a row's pixels */
    size_t map_bytes;    /* of each of its two maps: a row's pixels, or 0 */
};

static inline struct row_layout row_layout_of(uint32_t width, size_t pixel_bytes, bool maps)
{
    return (struct row_layout){width * pixel_bytes, maps ? width : 0};
}

/* Bytes of one record. */
static inline size_t row_record_bytes(const struct row_layout *layout)
{
    return ROW_FIGURES_BYTES + layout->pixels_bytes + 2 * layout->map_bytes;
}

/* Where a record's maps of stages and of errors begin; its pixels do behind the figures. */
static inline size_t row_stages_at(const struct row_layout *layout)
{
    return ROW_FIGURES_BYTES + layout->pixels_bytes;
}

static inline size_t row_errors_at(const struct row_layout *layout)
{
    return row_stages_at(layout) + layout->map_bytes;
}

/* Writes the figures at the start of a record, record[ROW_FIGURES_BYTES], and reads them there. */
void row_figures_write(uint8_t *record, const struct row_figures *figures);
void row_figures_read(const uint8_t *record, struct row_figures *figures);

/* A pixel's error on a scale of eight steps an octave: 255 for an RMS error of 1 (or more), and so on down to 1; 0 for
 * none. The argument is the squared error; not a number counts as none. */
uint8_t row_error_code(double squared);

/* The RMS error that a code stands for; those that get it are within a factor of 2^(1/16), but for the lowest and the
 * highest. */
double row_error_of(uint8_t code);

#endif
