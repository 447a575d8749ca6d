#include "base/memory.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"

static _Noreturn void out_of_memory(size_t count, size_t size)
{
    char text[128];
    int length = snprintf(text, sizeof text, "weft: out of memory (%zu × %zu bytes)\n", count, size);
    ssize_t ignored = write(STDERR_FILENO, text, (size_t)length);
    (void)ignored;
    _exit(STATUS_INTERNAL);
}

void *memory_array(size_t count, size_t size)
{
    void *block = calloc(count ? count : 1, size ? size : 1);
    if (!block)
        out_of_memory(count, size);
    return block;
}

void *memory_aligned(size_t count, size_t size, size_t alignment)
{
    if (count > SIZE_MAX / size)
        out_of_memory(count, size);
    void *block = aligned_alloc(alignment, count ? count * size : size);
    if (!block)
        out_of_memory(count, size);
    return block;
}

void *memory_resize(void *block, size_t count, size_t size)
{
    if (size != 0 && count > SIZE_MAX / size)
        out_of_memory(count, size);
    size_t bytes = count * size;
    void *moved = realloc(block, bytes ? bytes : 1);
    if (!moved)
        out_of_memory(count, size);
    return moved;
}

void *memory_grow(void *block, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity)
        return block;
    size_t wanted = *capacity > SIZE_MAX / 2 ? needed : *capacity * 2;
    if (wanted < needed)
        wanted = needed;
    if (wanted < 8)
        wanted = 8;
    block = memory_resize(block, wanted, size);
    *capacity = wanted;
    return block;
}

char *memory_string(const char *text)
{
    size_t length = strlen(text);
    char *copy = memory_array(length + 1, 1);
    memcpy(copy, text, length);
    return copy;
}

char *memory_format(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *text = NULL;
    if (vasprintf(&text, format, arguments) < 0)
        out_of_memory(strlen(format), 1);
    va_end(arguments);
    return text;
}
