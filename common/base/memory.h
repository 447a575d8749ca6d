/*
 * Allocation. Running out of memory ends the process with a sentence and exit status 5, so no caller
 * handles NULL. A size that comes from a file or a peer is capped by its reader before it gets here.
 */
#ifndef WEFT_BASE_MEMORY_H
#define WEFT_BASE_MEMORY_H

#include <stddef.h>

/* count * size bytes, zeroed; never NULL (one byte is allocated for an empty array). The caller frees. */
void *memory_array(size_t count, size_t size);

/* The same, not zeroed, at a multiple of `alignment`: a power of two that divides size. */
void *memory_aligned(size_t count, size_t size, size_t alignment);

/* Resizes block (or NULL) to count * size bytes; what is beyond the old size is not initialised.
 * Returns the block, which may have moved; the caller frees. */
void *memory_resize(void *block, size_t count, size_t size);

/* Makes room for `needed` elements in a growing array: returns block, moved if it had to grow, and sets
 * *capacity to the new capacity (at least doubled when it grows). */
void *memory_grow(void *block, size_t *capacity, size_t needed, size_t size);

/* A copy of a string, which the caller frees. */
char *memory_string(const char *text);

/* A formatted string, which the caller frees. */
char *memory_format(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
