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

/* Renders pixels x0 <= x < x1 of row y into pixels[x1 − x0] (mean linear radiance, not clamped) and adds its rays to
 * *counts. 0 <= x0 < x1 <= width, y < height. A pixel depends on nothing but plan and place. */
void tracer_row(struct tracer *tracer, uint32_t x0, uint32_t x1, uint32_t y, struct vec3 *pixels,
                struct ray_counts *counts);

#endif
