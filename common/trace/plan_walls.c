/* Whether a scene needs boundaries (boundary.h). */
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"
#include "trace/plan_parts.h"

/* A box around all of an object, whose shape is closed, so that it has one. */
static struct bounds bounds_of_object(const struct plan *plan, size_t object)
{
    size_t end = object + 1 < plan->object_count ? plan->objects[object + 1].first_primitive : plan->primitive_count;
    struct bounds all = {0}, one;
    for (size_t id = plan->objects[object].first_primitive; id < end; id++)
        if (bounds_of_primitive(plan, (uint32_t)id, &one))
            all = id == plan->objects[object].first_primitive ? one : bounds_join(&all, &one);
    return all;
}

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
    for (size_t i = 0; i < plan->object_count; i++)
        if (plan->materials[plan->objects[i].material].dielectric)
            boxes[count++] = grown(bounds_of_object(plan, i));
    qsort(boxes, count, sizeof *boxes, compare_by_low_x);
    bool overlap = any_overlap(boxes, count);
    free(boxes);
    return overlap;
}
