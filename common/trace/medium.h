/*
 * What a ray travels in: a stack of the dielectric objects that it is inside of, the innermost on top.
 *
 * Stacks share their tails: a stack is the index of its top node, and pushing makes a node that points to
 * the rest. Index 0 is the empty stack, the space around everything (index of refraction 1).
 */
#ifndef WEFT_TRACE_MEDIUM_H
#define WEFT_TRACE_MEDIUM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MEDIUM_SPACE 0u

struct medium_node {
    uint32_t object; /* index of the plan's object */
    uint32_t below;
};

/* All zero is ready for use. */
struct medium_pool {
    struct medium_node *nodes; /* nodes[i] is stack i + 1 */
    size_t count, capacity;
};

void medium_pool_finish(struct medium_pool *pool);

/* Forgets all stacks but the empty one. */
void medium_pool_clear(struct medium_pool *pool);

/* The stack with `object` on top of `stack`. */
uint32_t medium_push(struct medium_pool *pool, uint32_t stack, uint32_t object);

/* The stack without the topmost entry of `object`; `stack` itself if it holds none. */
uint32_t medium_remove(struct medium_pool *pool, uint32_t stack, uint32_t object);

bool medium_holds(const struct medium_pool *pool, uint32_t stack, uint32_t object);

/* The topmost object; stack must not be MEDIUM_SPACE. */
uint32_t medium_top(const struct medium_pool *pool, uint32_t stack);

#endif
