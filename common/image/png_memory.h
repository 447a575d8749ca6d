/*
 * Allocation for libpng by base/memory.h, so that running out of memory is never taken for a damaged file.
 */
#ifndef WEFT_IMAGE_PNG_MEMORY_H
#define WEFT_IMAGE_PNG_MEMORY_H

#include <png.h>
#include <stdlib.h>

#include "base/memory.h"

static inline png_voidp png_memory_allocate(png_structp png, png_alloc_size_t size)
{
    (void)png;
    return memory_array(size, 1);
}

static inline void png_memory_free(png_structp png, png_voidp block)
{
    (void)png;
    free(block);
}

#endif
