/* Where a scene needs boundaries (boundary.h). */
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/bounds.h"
#include "trace/plan_parts.h"

enum { CONTACTS_MAX = 8 }; /* of more boxes, looking for a point in each would cost too much */

static int compare_by_low_x(const void *left, const void *right)
{
    const struct bounds *a = left, *b = right;
    return a->low.x < b->low.x ? -1 : a->low.x > b->low.x;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static struct bounds overlap(const struct bounds *a, const struct bounds *b)
{
    return (struct bounds){{larger(a->low.x, b->low.x), larger(a->low.y, b->low.y), larger(a->low.z, b->low.z)},
                           {smaller(a->high.x, b->high.x), smaller(a->high.y, b->high.y),
                            smaller(a->high.z, b->high.z)}};
}

/* The overlaps of any two of the boxes, which are sorted by low.x: each is compared with those that begin, along x,
 * before it ends. Returns how many of them there are, or CONTACTS_MAX + 1 if there are more. */
static size_t find_overlaps(const struct bounds *boxes, size_t count, struct bounds overlaps[CONTACTS_MAX])
{
    size_t found = 0;
    for (size_t i = 0; i < count; i++)
        for (size_t k = i + 1; k < count && boxes[k].low.x <= boxes[i].high.x; k++) {
            if (!bounds_overlap(&boxes[i], &boxes[k]))
                continue;
            if (found == CONTACTS_MAX)
                return CONTACTS_MAX + 1;
            overlaps[found++] = overlap(&boxes[i], &boxes[k]);
        }
    return found;
}

void plan_contacts_find(struct plan *plan)
{
    struct bounds *boxes = memory_array(plan->object_count, sizeof *boxes);
    size_t count = 0;
    struct bounds box;
    for (size_t i = 0; i < plan->object_count; i++) /* what is closed, as dielectrics are, has a box */
        if (plan->materials[plan->objects[i].material].dielectric && bounds_of_object(plan, i, &box))
            boxes[count++] = bounds_grown(box, COINCIDENCE);
    qsort(boxes, count, sizeof *boxes, compare_by_low_x);
    plan->contacts = memory_array(CONTACTS_MAX, sizeof *plan->contacts);
    plan->contact_count = find_overlaps(boxes, count, plan->contacts);
    if (plan->contact_count > CONTACTS_MAX) {
        plan->contacts[0] = (struct bounds){{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
        plan->contact_count = 1;
    }
    free(boxes);
}
