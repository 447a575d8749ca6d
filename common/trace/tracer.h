/*
 * From a plan to pixels. A tracer is one thread's scratch memory; many tracers share one plan.
 */
#ifndef WEFT_TRACE_TRACER_H
#define WEFT_TRACE_TRACER_H

#include <stdint.h>

#include "base/hash.h"
#include "trace/kernel.h"
#include "trace/plan.h"

/* Rays traced. */
struct ray_counts {
    uint64_t camera, secondary, shadow;
};

struct tracer;

/* Both are borrowed and must outlive the tracer. */
struct tracer *tracer_create(const struct plan *plan, const struct kernel *kernel);

/* Frees *tracer and sets it to NULL; *tracer may be NULL. */
void tracer_destroy(struct tracer **tracer);

/* Pixels x0 <= x < x1 of rows y0 <= y < y1. */
struct pixel_area {
    uint32_t x0, x1, y0, y1;
};

/* Renders an area of the image, which must not be empty, into pixels[(y1 − y0) (x1 − x0)] (mean linear radiance, not
 * clamped; row by row) and adds each row's rays to counts[y1 − y0]. A pixel depends on nothing but plan and place. */
void tracer_area(struct tracer *tracer, const struct pixel_area *area, struct vec3 *pixels, struct ray_counts *counts);

#endif
