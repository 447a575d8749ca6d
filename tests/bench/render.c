/* Whole renders in this process, on one thread: render WIDTH SCENE... prints seconds and rays a second by kernel. */
#include <stdio.h>

#include "base/options.h"
#include "scene/load.h"
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

static enum status bench_scene_file(const char *path, uint32_t width, struct error *error)
{
    struct scene scene = {0};
    struct asset_set assets;
    const char *name;
    asset_set_init_disk(&assets, path, &name);
    enum status status = scene_load(&scene, name, &assets, error);
    if (status == STATUS_OK) {
        scene.height = (width * scene.height + scene.width - 1) / scene.width;
        scene.width = width;
        scene.samples = 1;
        for (size_t k = 0; kernel_at(k); k++)
            print_render(path, &scene, kernel_at(k));
    }
    scene_finish(&scene);
    asset_set_finish(&assets);
    return status;
}

int main(int argc, char **argv)
{
    struct error error;
    int64_t width = 0;
    enum status status = argc < 3 ? error_set(&error, STATUS_USAGE, "usage: render WIDTH SCENE...")
                                  : options_integer("WIDTH", argv[1], 1, 4096, &width, &error);
    if (status == STATUS_OK)
        printf("whole renders, %d pixels wide, 1 sample a pixel; rays in millions\n%-36s %-8s %8s %8s %8s %8s %8s\n",
               (int)width, "scene", "kernel", "seconds", "camera", "second.", "shadow", "M rays/s");
    for (int i = 2; i < argc && status == STATUS_OK; i++)
        status = bench_scene_file(argv[i], (uint32_t)width, &error);
    if (status != STATUS_OK)
        fprintf(stderr, "%s\n", error.text);
    return status;
}
