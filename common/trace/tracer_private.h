/* Private to the tracer: tracing batches of camera rays (tracer.c), and choosing which (area.c). */
#ifndef WEFT_TRACE_TRACER_PRIVATE_H
#define WEFT_TRACE_TRACER_PRIVATE_H

#include "trace/generation.h"
#include "trace/sample.h"
#include "trace/tracer.h"

enum { CAMERA_RAYS_MAX = 1024 }; /* a batch */

/* Pixels of the image that are in work together, numbered down each column. */
struct pixel_grid {
    uint32_t x, y; /* of its first pixel */
    uint32_t columns, rows;
};

/* Of each pixel of a grid. */
struct pixel_work {
    struct pixel_sums sums;
    uint32_t samples;                   /* that the sums hold */
    uint32_t secondary, shadow, camera; /* rays traced */
};

struct tracer {
    struct generation generation;
    struct lighting lighting;
    struct shadow_batch shadows;
    struct crossing_list crossings;
    struct sample_digits *digits; /* of each sample of a pixel */
    size_t digit_capacity;
    bool follows_footprints;      /* the next batch begins with them */

    /* Of each camera ray. */
    struct vec3 radiance[CAMERA_RAYS_MAX]; /* what has come of it */
    uint32_t secondary[CAMERA_RAYS_MAX], shadow[CAMERA_RAYS_MAX]; /* rays that it led to */
    _Alignas(64) double x[CAMERA_RAYS_MAX];
    double y[CAMERA_RAYS_MAX];
    uint32_t pixel[CAMERA_RAYS_MAX]; /* of the grid */
    uint32_t pixel_x[CAMERA_RAYS_MAX], pixel_y[CAMERA_RAYS_MAX];
    uint32_t digits_x[CAMERA_RAYS_MAX], digits_y[CAMERA_RAYS_MAX];

    uint32_t salt; /* of the samples: see sample.h */
    struct pixel_grid grid;
    struct pixel_work *work; /* of each pixel of the grid */
    uint32_t *list;          /* pixels of the grid */
    struct vec3 *range;      /* of each pixel of the grid: see sampling_first_measure */
    struct vec3 *low, *high; /* scratch */
    size_t grid_capacity;    /* pixels */
};

/* Makes a grid the tracer's, with empty work. */
void tracer_set_grid(struct tracer *tracer, const struct pixel_grid *grid);

/* Adds samples first .. end − 1 to the work of pixels list[count] of the grid, which has the samples before. `end` is how
 * many samples the pixel is taken to have: it decides their footprints. With `roots`, roots and squares are summed too. */
void tracer_sample(struct tracer *tracer, const uint32_t *list, size_t count, uint32_t first, uint32_t end, bool roots);

#endif
