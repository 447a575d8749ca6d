/* Private to the tracer: tracing batches of camera rays (tracer.c), and choosing which (area.c). */
#ifndef WEFT_TRACE_TRACER_PRIVATE_H
#define WEFT_TRACE_TRACER_PRIVATE_H

#include "trace/generation.h"
#include "trace/sample.h"
#include "trace/tracer.h"

enum { CAMERA_RAYS_MAX = 1024 }; /* a batch */

/* A rectangle of the image. The tracer numbers pixels grid by grid, and down each column. */
struct pixel_grid {
    uint32_t x, y; /* of its first pixel */
    uint32_t columns, rows;
    uint32_t first; /* number of its first pixel */
};

/* Of each pixel that is in work. */
struct pixel_work {
    uint32_t x, y;
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
    _Atomic uint64_t *batches;    /* counts them; may be NULL */

    /* Of each camera ray. */
    struct vec3 radiance[CAMERA_RAYS_MAX]; /* what has come of it */
    uint32_t secondary[CAMERA_RAYS_MAX], shadow[CAMERA_RAYS_MAX]; /* rays that it led to */
    _Alignas(64) double x[CAMERA_RAYS_MAX];
    double y[CAMERA_RAYS_MAX];
    uint32_t pixel[CAMERA_RAYS_MAX]; /* its number */
    uint32_t pixel_x[CAMERA_RAYS_MAX], pixel_y[CAMERA_RAYS_MAX];
    uint32_t digits_x[CAMERA_RAYS_MAX], digits_y[CAMERA_RAYS_MAX];

    uint32_t salt;    /* of the samples: see sample.h */
    uint32_t refined; /* their footprints are those of so many times as many samples */
    size_t pixels;           /* in work */
    struct pixel_work *work; /* of each of them */
    uint32_t *list;          /* some of them */
    float *near[3], *wide[3]; /* of each, in each channel: see sampling_first_measure */
    float *bound[6], *scratch; /* see find_ranges in area.c */
    size_t pixel_capacity;
};

/* Puts more pixels in work, without samples; sets grid->first. (tracer->pixels = 0 ends the work on those there
 * are.) */
void tracer_add_grid(struct tracer *tracer, struct pixel_grid *grid);

/* Adds samples first .. end − 1 to the work of pixels list[count], which have the samples before. `end` is how many
 * samples the pixel is taken to have: it decides their footprints. With `roots`, roots and squares are summed too. */
void tracer_sample(struct tracer *tracer, const uint32_t *list, size_t count, uint32_t first, uint32_t end, bool roots);

#endif
