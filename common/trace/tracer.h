/*
 * From a plan to pixels. A tracer is one thread's scratch memory; many tracers share one plan.
 */
#ifndef WEFT_TRACE_TRACER_H
#define WEFT_TRACE_TRACER_H

#include <stdint.h>

#include "base/hash.h"
#include "trace/kernel.h"
#include "trace/plan.h"
#include "trace/sampling.h"

/* Rays traced. */
struct ray_counts {
    uint64_t camera, secondary, shadow;
};

struct tracer;

/* Both are borrowed and must outlive the tracer. */
struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel);

/* Frees *tracer and sets it to NULL; *tracer may be NULL. */
void tracer_destroy(struct tracer **tracer);

/* From now on counts the batches of camera rays there as it traces them, so that whoever reads it, in any thread, sees
 * that an area that takes minutes advances. Borrowed. */
void tracer_count_batches(struct tracer *tracer, _Atomic uint64_t *batches);

/* Pixels x0 <= x < x1 of rows y0 <= y < y1. */
struct pixel_area {
    uint32_t x0, x1, y0, y1;
};

/* What became of one pixel. */
struct pixel {
    struct vec3 light; /* mean linear radiance, not clamped */
    double error;      /* its estimated squared error as it is shown: see sampling.h */
    uint32_t samples;
};

/* Squared errors are summed as whole multiples of this. */
#define PIXEL_ERROR_UNIT 0x1p-44

/* Renders an area of the image, which must not be empty, into pixels[(y1 − y0) (x1 − x0)], row by row, and adds each
 * row's rays to counts[y1 − y0]. A pixel depends on nothing but plan, sampling and place. (Rays that only look at the
 * neighbours of the area are not counted: so the counts do not depend on how an image is cut into areas.) */
void tracer_area(struct tracer *tracer, const struct sampling *sampling, const struct pixel_area *area,
                 struct pixel *pixels, struct ray_counts *counts);

enum { HISTORY_TRIALS = 3 };

/* What a pixel came to, stage by stage. */
struct pixel_trial {
    uint32_t stages; /* that it went through, from stage 0 on; at least 2 */
    struct {
        struct vec3 light; /* mean */
        double error;      /* estimated */
        uint32_t measure;
    } stage[SAMPLING_STAGES];
};

/* A pixel is tried several times, each time with samples of its own, but for the first look. Where textures are filtered
 * it is tried once: samples that were taken stage by stage are filtered otherwise than those taken at once, which would
 * not show. mean[i] is what trial i came to at last; those of trials that were not made are of as many samples as trial
 * 0's last stage has, taken at once, with narrower footprints. */
struct pixel_history {
    uint32_t pixel;  /* its number in the tracer */
    uint32_t weight; /* how many pixels it stands for */
    uint32_t trials; /* HISTORY_TRIALS or 1 */
    struct pixel_trial trial[HISTORY_TRIALS];
    struct vec3 mean[HISTORY_TRIALS];
};

enum { HISTORY_AREAS_MAX = 32 };

/* As tracer_area, but of areas[count], 1 <= count <= HISTORY_AREAS_MAX, which do not overlap, with an adaptive sampling
 * whose least is 1 and whose most at least 4; and pixels go through stage 1 at least. Many of those whose first measure
 * is at least `even` are left out, and some of the others where an area has many; those that are followed stand for
 * them. `histories` has room for all pixels, and gets those that were followed in some order; returns how many.
 * `counts` is one sum, of all rays. */
size_t tracer_histories(struct tracer *tracer, const struct sampling *sampling, uint32_t even,
                        const struct pixel_area *areas, size_t count, struct pixel_history *histories,
                        struct ray_counts *counts);

#endif
