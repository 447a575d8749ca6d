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

enum { LIGHTING_ARRAYS = sizeof(struct lighting) / sizeof(double *) - 1 };

void lighting_finish(struct lighting *lighting)
{
    double **arrays = lighting->direction;
    for (size_t i = 0; i < LIGHTING_ARRAYS; i++)
        free(arrays[i]);
    *lighting = (struct lighting){0};
}

void lighting_reserve(struct lighting *lighting, size_t capacity)
{
    if (capacity <= lighting->capacity)
        return;
    lighting->capacity = lanes_in_packets(capacity);
    double **arrays = lighting->direction;
    for (size_t i = 0; i < LIGHTING_ARRAYS; i++)
        lanes_grow(&arrays[i], 0, lighting->capacity);
}

void mirrored_finish(struct mirrored *mirrored)
{
    free(mirrored->surface);
    for (int axis = 0; axis < 3; axis++)
        free(mirrored->share[axis]);
    *mirrored = (struct mirrored){0};
}

void mirrored_push(struct mirrored *mirrored, uint32_t surface, struct vec3 share)
{
    if (mirrored->count == mirrored->capacity) {
        size_t capacity = lanes_in_packets(2 * mirrored->capacity + 1);
        mirrored->surface = memory_resize(mirrored->surface, capacity, sizeof *mirrored->surface);
        for (int axis = 0; axis < 3; axis++)
            lanes_grow(&mirrored->share[axis], mirrored->count, capacity);
        mirrored->capacity = capacity;
    }
    mirrored->surface[mirrored->count] = surface;
    lane_put(mirrored->share, mirrored->count++, share);
}

/* --- the list --------------------------------------------------------------------------------------------- */

#define DEFINE_LANES(isa)                                                                                \
    LANES_DECLARE(isa);                                                                                  \
    static const struct kernel kernel_##isa = {#isa,       camera_##isa, closest_##isa, surface_##isa,   \
                                               face_##isa, pattern_##isa, light_##isa, shadow_##isa, mirror_##isa}

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
