#include "trace/kernel.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/lanes/exports.h"

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

size_t crossing_list_run(const struct crossing_list *list, size_t start, uint32_t ray)
{
    size_t end = start;
    while (end < list->count && list->items[end].ray == ray)
        end++;
    return end - start;
}

/* --- the list --------------------------------------------------------------------------------------------- */

#define DEFINE_LANES(isa)                              \
    LANES_DECLARE(isa);                                \
    static const struct kernel kernel_##isa = {        \
        .name = #isa,                                  \
        .closest = closest_##isa,                      \
        .shadow = shadow_##isa,                        \
        LANES_STAGES(isa),                             \
    }

#if defined(__x86_64__)
DEFINE_LANES(sse2);
DEFINE_LANES(avx2);
DEFINE_LANES(avx512);

static bool runs_avx2(void)
{
    return __builtin_cpu_supports("avx2");
}

static bool runs_avx512(void)
{
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
}
#elif defined(__aarch64__)
DEFINE_LANES(neon);
#endif

static bool runs_anywhere(void)
{
    return true;
}

/* Slowest first. */
static const struct {
    const struct kernel *kernel;
    bool (*runs)(void);
} kernels[] = {
    {&kernel_ref, runs_anywhere},
#if defined(__x86_64__)
    {&kernel_sse2, runs_anywhere},
    {&kernel_avx2, runs_avx2},
    {&kernel_avx512, runs_avx512},
#elif defined(__aarch64__)
    {&kernel_neon, runs_anywhere},
#endif
};

enum { KERNELS = sizeof kernels / sizeof *kernels };

const struct kernel *kernel_at(size_t index)
{
    for (size_t i = 0; i < KERNELS; i++)
        if (kernels[i].runs() && index-- == 0)
            return kernels[i].kernel;
    return NULL;
}

const struct kernel *kernel_find(const char *name)
{
    const struct kernel *kernel;
    for (size_t i = 0; (kernel = kernel_at(i)); i++)
        if (strcmp(kernel->name, name) == 0)
            return kernel;
    return NULL;
}

const struct kernel *kernel_default(void)
{
    const struct kernel *fastest = NULL, *kernel;
    for (size_t i = 0; (kernel = kernel_at(i)); i++)
        fastest = kernel;
    return fastest;
}
