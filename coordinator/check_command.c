/* weft check */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "scene/load.h"
#include "trace/kernel.h"
#include "trace/plan.h"

enum { OPTION_HELP = 256, OPTION_VERSION };

static const struct option_spec options[] = {
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    (void)context, (void)argument, (void)error;
    if (key == OPTION_HELP) {
        puts("usage: weft check SCENE\n"
             "Checks a scene with all that it reaches and prints what rendering it needs.\n");
        options_help(stdout, options);
    } else {
        puts("weft " WEFT_VERSION);
    }
    exit(STATUS_OK);
}

static void print_primitives(const struct plan *plan)
{
    static const char *const names[PRIMITIVE_KINDS] = {
        [PRIMITIVE_SPHERE] = "spheres", [PRIMITIVE_GLOBE] = "spheres with the camera near their surface",
        [PRIMITIVE_ELLIPSOID] = "ellipsoids", [PRIMITIVE_PLANE] = "planes", [PRIMITIVE_DISC] = "discs",
        [PRIMITIVE_FRUSTUM] = "cylinders, cones and frustums", [PRIMITIVE_BOX] = "boxes",
        [PRIMITIVE_TRIANGLE] = "triangles"};
    printf("primitives: %zu\n", plan->primitive_count);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        if (plan->count[kind])
            printf("  %s: %zu\n", names[kind], plan->count[kind]);
}

static void print_features(const struct plan *plan)
{
    size_t mirrors = 0, transparent = 0, dielectrics = 0, textured = plan->texture_count - plan->material_count;
    for (size_t i = 0; i < plan->object_count; i++) {
        const struct plan_material *material = &plan->materials[plan->objects[i].material];
        mirrors += material->mirrors;
        dielectrics += material->dielectric;
        transparent += material->transmits && !material->dielectric;
    }
    printf("objects: %zu (%zu textured, %zu mirrors, %zu transparent, %zu dielectric)\n", plan->object_count, textured,
           mirrors, transparent, dielectrics);
    printf("lights: %zu\nimages: %zu\ndepth: %u\n", plan->light_count, plan->image_count, plan->depth);
    printf("kernel: %s\n", kernel_default()->name);
}

static void print_needs(const char *path, const struct scene *scene, const struct asset_set *assets)
{
    const struct trace_settings settings = {scene->width, scene->height, scene->samples ? scene->samples : 1};
    struct plan *plan = plan_create(scene, &settings, 1);
    size_t bytes = 0;
    for (size_t i = 0; i < assets->count; i++)
        bytes += assets->assets[i].bytes.size;
    printf("%s: good\nimage: %u×%u\nfiles: %zu, %zu bytes\n", path, scene->width, scene->height, assets->count, bytes);
    print_primitives(plan);
    print_features(plan);
    plan_destroy(&plan);
}

static enum status check(const char *path, struct error *error)
{
    struct asset_set assets = {0};
    struct scene scene = {0};
    const char *name;
    asset_set_init_disk(&assets, path, &name);
    enum status status = scene_load(&scene, name, &assets, error);
    if (status == STATUS_OK)
        print_needs(path, &scene, &assets);
    scene_finish(&scene);
    asset_set_finish(&assets);
    return status;
}

int command_check(int argc, char **argv)
{
    struct error error;
    int first;
    enum status status = options_parse(argc, argv, options, handle_option, NULL, &first, &error);
    if (status == STATUS_OK && argc - first != 1)
        status = error_set(&error, STATUS_USAGE, "expected one scene; see weft check --help");
    if (status == STATUS_OK)
        status = check(argv[first], &error);
    if (status != STATUS_OK)
        log_error("%s", error.text);
    return (int)status;
}
