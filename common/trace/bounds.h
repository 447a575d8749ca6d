/*
 * Boxes around primitives, for the tree.
 */
#ifndef WEFT_TRACE_BOUNDS_H
#define WEFT_TRACE_BOUNDS_H

#include <stdbool.h>

#include "trace/plan.h"

struct bounds {
    struct vec3 low, high;
};

/* A box around the primitive of that number, in coordinates relative to the camera, to rounding; false for a plane,
 * which has none. */
bool bounds_of_primitive(const struct plan *plan, uint32_t number, struct bounds *bounds);

/* A box around all of an object; false for a plane. */
bool bounds_of_object(const struct plan *plan, size_t object, struct bounds *bounds);

struct bounds bounds_of_triangle(const struct triangle *triangle);

/* By `share` of the coordinates' size. */
static inline struct bounds bounds_grown(struct bounds box, double share)
{
    double low = vec3_max_abs(box.low), high = vec3_max_abs(box.high), by = share * (low > high ? low : high);
    struct vec3 margin = vec3_make(by, by, by);
    return (struct bounds){vec3_sub(box.low, margin), vec3_add(box.high, margin)};
}

static inline bool bounds_overlap(const struct bounds *a, const struct bounds *b)
{
    return a->low.x <= b->high.x && b->low.x <= a->high.x && a->low.y <= b->high.y && b->low.y <= a->high.y &&
           a->low.z <= b->high.z && b->low.z <= a->high.z;
}

static inline struct bounds bounds_join(const struct bounds *a, const struct bounds *b)
{
    return (struct bounds){
        .low = {a->low.x < b->low.x ? a->low.x : b->low.x, a->low.y < b->low.y ? a->low.y : b->low.y,
                a->low.z < b->low.z ? a->low.z : b->low.z},
        .high = {a->high.x > b->high.x ? a->high.x : b->high.x, a->high.y > b->high.y ? a->high.y : b->high.y,
                 a->high.z > b->high.z ? a->high.z : b->high.z},
    };
}

#endif
