/*
 * Where in a pixel its samples lie.
 */
#ifndef WEFT_TRACE_SAMPLE_H
#define WEFT_TRACE_SAMPLE_H

#include <stdint.h>

struct sample_position {
    double x, y; /* within the pixel, 0 <= x < 1 */
};

/* The index-th of `count` samples of pixel (x, y): the first two dimensions of Sobol's sequence (a (0,2)-sequence),
 * Owen-scrambled with a seed hashed from the pixel. A function of these numbers alone. The only sample of a pixel
 * with one is its centre. */
struct sample_position sample_position(uint32_t x, uint32_t y, uint32_t index, uint32_t count);

#endif
