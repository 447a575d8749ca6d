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

/* A box around primitive `id`, in coordinates relative to the camera, to rounding; false for a plane, which has
 * none. */
bool bounds_of_primitive(const struct plan *plan, uint32_t id, struct bounds *bounds);

/* A box around all of an object; false for a plane. */
bool bounds_of_object(const struct plan *plan, size_t object, struct bounds *bounds);

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
