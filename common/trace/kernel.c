#include "trace/kernel.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

void crossing_list_finish(struct crossing_list *list)
{
    free(list->items);
    *list = (struct crossing_list){0};
}

void crossing_list_push(struct crossing_list *list, const struct crossing *crossing)
{
    list->items = memory_grow(list->items, &list->capacity, list->count + 1, sizeof *list->items);
    list->items[list->count++] = *crossing;
}

/* Slowest first. */
static const struct kernel *const kernels[] = {&kernel_ref};

enum { KERNELS = sizeof kernels / sizeof *kernels };

const struct kernel *kernel_find(const char *name)
{
    for (size_t i = 0; i < KERNELS; i++)
        if (strcmp(kernels[i]->name, name) == 0)
            return kernels[i];
    return NULL;
}

const struct kernel *kernel_default(void)
{
    return kernels[KERNELS - 1];
}

const struct kernel *kernel_at(size_t index)
{
    return index < KERNELS ? kernels[index] : NULL;
}
