/* Whole renders in this process, on one thread: render WIDTH SCENE... prints seconds and rays a second by kernel. */
#include <stdio.h>

#include "tests/bench/bench.h"

struct render {
    const struct scene *scene;
    const struct kernel *kernel;
    struct ray_counts counts; /* of the last run */
};

/* Compiles the plan and renders all pixels. */
static void render_once(void *context)
{
    struct render *render = context;
    render->counts = (struct ray_counts){0};
    free(scene_render(render->scene, render->kernel, &render->counts));
}

static void print_render(const char *name, const struct scene *scene, const struct kernel *kernel)
{
    struct render render = {scene, kernel, {0}};
    double seconds = bench_least_seconds(render_once, &render);
    double rays = (double)(render.counts.camera + render.counts.secondary + render.counts.shadow);
    printf("%-36s %-8s %8.4f %8.3f %8.3f %8.3f %8.3f\n", name, kernel->name, seconds,
           1e-6 * (double)render.counts.camera, 1e-6 * (double)render.counts.secondary,
           1e-6 * (double)render.counts.shadow, 1e-6 * rays / seconds);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    struct error error;
    uint32_t width = 0;
    enum status status = bench_width(argc, argv, "render", &width, &error);
    if (status == STATUS_OK)
        printf("whole renders, %d pixels wide, 1 sample a pixel; rays in millions\n%-36s %-8s %8s %8s %8s %8s %8s\n",
               (int)width, "scene", "kernel", "seconds", "camera", "second.", "shadow", "M rays/s");
    for (int i = 2; i < argc && status == STATUS_OK; i++) {
        struct scene scene;
        status = bench_load(argv[i], width, 1, &scene, &error);
        if (status != STATUS_OK)
            break;
        for (size_t k = 0; kernel_at(k); k++)
            print_render(argv[i], &scene, kernel_at(k));
        scene_finish(&scene);
    }
    if (status != STATUS_OK)
        fprintf(stderr, "%s\n", error.text);
    return status;
}
