#include "trace/medium.h"

#include <stdlib.h>

#include "base/memory.h"

void medium_pool_finish(struct medium_pool *pool)
{
    free(pool->nodes);
    *pool = (struct medium_pool){0};
}

void medium_pool_clear(struct medium_pool *pool)
{
    pool->count = 0;
}

uint32_t medium_push(struct medium_pool *pool, uint32_t stack, uint32_t object)
{
    pool->nodes = memory_grow(pool->nodes, &pool->capacity, pool->count + 1, sizeof *pool->nodes);
    pool->nodes[pool->count++] = (struct medium_node){object, stack};
    return (uint32_t)pool->count;
}

uint32_t medium_top(const struct medium_pool *pool, uint32_t stack)
{
    return pool->nodes[stack - 1].object;
}

bool medium_holds(const struct medium_pool *pool, uint32_t stack, uint32_t object)
{
    while (stack != MEDIUM_SPACE && pool->nodes[stack - 1].object != object)
        stack = pool->nodes[stack - 1].below;
    return stack != MEDIUM_SPACE;
}

/* Recursion is as deep as solids are nested around the ray. */
uint32_t medium_remove(struct medium_pool *pool, uint32_t stack, uint32_t object)
{
    if (!medium_holds(pool, stack, object))
        return stack;
    struct medium_node top = pool->nodes[stack - 1];
    if (top.object == object)
        return top.below;
    return medium_push(pool, medium_remove(pool, top.below, object), top.object);
}
