/* Whether a scene needs boundaries (boundary.h). */
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"
#include "trace/plan_parts.h"

/* By COINCIDENCE of the coordinates' size. */
static struct bounds grown(struct bounds box)
{
    double low = vec3_max_abs(box.low), high = vec3_max_abs(box.high), by = COINCIDENCE * (low > high ? low : high);
    struct vec3 margin = vec3_make(by, by, by);
    return (struct bounds){vec3_sub(box.low, margin), vec3_add(box.high, margin)};
}

static int compare_by_low_x(const void *left, const void *right)
{
    const struct bounds *a = left, *b = right;
    return a->low.x < b->low.x ? -1 : a->low.x > b->low.x;
}

/* Whether any two of the boxes, which are sorted by low.x, overlap: each is compared with those that begin, along x,
 * before it ends. */
static bool any_overlap(const struct bounds *boxes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (size_t k = i + 1; k < count && boxes[k].low.x <= boxes[i].high.x; k++)
            if (boxes[k].low.y <= boxes[i].high.y && boxes[i].low.y <= boxes[k].high.y &&
                boxes[k].low.z <= boxes[i].high.z && boxes[i].low.z <= boxes[k].high.z)
                return true;
    return false;
}

bool plan_walls_may_touch(const struct plan *plan)
{
    struct bounds *boxes = memory_array(plan->object_count, sizeof *boxes);
    size_t count = 0;
    struct bounds box;
    for (size_t i = 0; i < plan->object_count; i++) /* what is closed, as dielectrics are, has a box */
        if (plan->materials[plan->objects[i].material].dielectric && bounds_of_object(plan, i, &box))
            boxes[count++] = grown(box);
    qsort(boxes, count, sizeof *boxes, compare_by_low_x);
    bool overlap = any_overlap(boxes, count);
    free(boxes);
    return overlap;
}
