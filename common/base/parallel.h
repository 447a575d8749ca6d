/*
 * A loop shared out among threads.
 */
#ifndef WEFT_BASE_PARALLEL_H
#define WEFT_BASE_PARALLEL_H

#include <stddef.h>

/* Calls run(context, i) once for every i below count, in any order, on up to `threads` threads, of which the caller's
 * is one; returns when all are done. Where the system has no more threads to give, fewer do the work. */
void parallel_for(int threads, size_t count, void (*run)(void *context, size_t index), void *context);

#endif
