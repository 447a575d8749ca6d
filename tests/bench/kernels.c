/* Nanoseconds a ray, for every kernel that this machine can run, kind of shape, sort of ray and number of shapes. */
#include <stdio.h>

#include "tests/bench/bench.h"

static const size_t counts[] = {1, 4, 16, 128, 1024, 16384};

enum { COUNTS = sizeof counts / sizeof *counts, PLANES_MAX = 128 }; /* planes are in no tree */

static void print_row(const struct kernel *kernel, enum bench_shape shape, enum bench_rays sort)
{
    printf("%-10s %-9s %-9s", kernel->name, bench_shape_names[shape], bench_ray_names[sort]);
    for (size_t i = 0; i < COUNTS; i++) {
        if (shape == BENCH_PLANE && counts[i] > PLANES_MAX) {
            printf("%9s", "-");
            continue;
        }
        struct scene scene = bench_scene(shape, counts[i]);
        struct plan *plan = bench_plan(&scene);
        printf("%9.1f", bench_ns_a_ray(kernel, plan, sort));
        fflush(stdout);
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    printf("\n");
}

int main(void)
{
    printf("ns a ray, by number of shapes\n%-10s %-9s %-9s", "kernel", "shape", "rays");
    for (size_t i = 0; i < COUNTS; i++)
        printf("%9zu", counts[i]);
    printf("\n");
    for (size_t k = 0; kernel_at(k); k++)
        for (int shape = 0; shape < BENCH_SHAPES; shape++)
            for (int sort = 0; sort < BENCH_RAY_SORTS; sort++)
                print_row(kernel_at(k), (enum bench_shape)shape, (enum bench_rays)sort);
    return 0;
}
