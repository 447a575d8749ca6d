#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

/* How many elements ahead of its use one is fetched: they come from all over memory. */
enum { AHEAD = 16, CACHE_LINE = 64 };

static void fetch(const char *element, size_t size)
{
    for (size_t at = 0; at < size; at += CACHE_LINE)
        __builtin_prefetch(element + at);
    __builtin_prefetch(element + size - 1);
}

/* The array with elements in the order of `numbers`, whose primitives still have the old indices. Frees the old one. */
static inline void *in_order(const struct plan *plan, void *array, size_t size, const uint32_t *numbers, size_t count)
{
    const char *from = array;
    char *moved = memory_array(count + BVH_LEAF_MAX - 1, size);
    for (size_t i = 0; i < count; i++) {
        if (i + AHEAD < count)
            fetch(from + plan->primitives[numbers[i + AHEAD]].index * size, size);
        memcpy(moved + i * size, from + plan->primitives[numbers[i]].index * size, size);
    }
    free(array);
    return moved;
}

/* From numbers to ids, which are the same without instances. */
static void find_ids(const struct plan *plan, const size_t *room)
{
    if (plan->count[PRIMITIVE_INSTANCE] == 0)
        return;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        for (size_t i = 0; i < room[kind]; i++)
            plan->ids[kind][i] = plan->primitives[plan->ids[kind][i]].id;
}

void plan_order(struct plan *plan, const uint32_t *order, size_t count)
{
    size_t next[PRIMITIVE_KINDS] = {0}, room[PRIMITIVE_KINDS] = {0};
    for (size_t i = 0; i < count; i++)
        room[plan->primitives[order ? order[i] : i].kind]++;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        plan->ids[kind] = memory_array(room[kind], sizeof *plan->ids[kind]);
    for (size_t i = 0; i < count; i++) {
        uint32_t number = order ? order[i] : (uint32_t)i;
        enum primitive_kind kind = plan->primitives[number].kind;
        plan->ids[kind][next[kind]++] = number;
    }
    if (!order) {
        find_ids(plan, room);
        return;
    }
#define IN_ORDER(KIND, ARRAY) \
    plan->ARRAY = in_order(plan, plan->ARRAY, sizeof *plan->ARRAY, plan->ids[KIND], room[KIND])
    IN_ORDER(PRIMITIVE_SPHERE, spheres);
    IN_ORDER(PRIMITIVE_GLOBE, globes);
    IN_ORDER(PRIMITIVE_ELLIPSOID, ellipsoids);
    IN_ORDER(PRIMITIVE_PLANE, planes);
    IN_ORDER(PRIMITIVE_DISC, discs);
    IN_ORDER(PRIMITIVE_FRUSTUM, frustums);
    IN_ORDER(PRIMITIVE_BOX, boxes);
    IN_ORDER(PRIMITIVE_TRIANGLE, triangles);
    IN_ORDER(PRIMITIVE_INSTANCE, instances);
#undef IN_ORDER
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        for (size_t i = 0; i < room[kind]; i++)
            plan->primitives[plan->ids[kind][i]].index = (uint32_t)i;
    find_ids(plan, room);
}
