/*
 * Row records: what a band's result carries, row by row, and what the journal holds.
 *
 * A record is the row's figures (ROW_FIGURES_BYTES, little-endian) and then its pixels, in the output's
 * pixel format. A band is its rows' records from the top.
 */
#ifndef WEFT_WIRE_ROWS_H
#define WEFT_WIRE_ROWS_H

#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"

/* Whole numbers, so that adding them up is exact in any order. */
struct row_figures {
    uint64_t samples;        /* camera rays */
    uint64_t secondary_rays; /* mirrored and transmitted */
    uint64_t shadow_rays;
};

/* Rays of every kind. */
static inline uint64_t row_figures_rays(const struct row_figures *figures)
{
    return figures->samples + figures->secondary_rays + figures->shadow_rays;
}

enum { ROW_FIGURES_BYTES = 24 };

/* Bytes of one record whose pixels take row_bytes. */
static inline size_t row_record_bytes(size_t row_bytes)
{
    return ROW_FIGURES_BYTES + row_bytes;
}

/* Writes the figures at the start of a record, record[ROW_FIGURES_BYTES]. */
void row_figures_write(uint8_t *record, const struct row_figures *figures);

/* Reads the record at data[row_record_bytes(row_bytes)]; returns its pixels, borrowed from data. */
const uint8_t *row_record_decode(const uint8_t *data, struct row_figures *figures);

#endif
