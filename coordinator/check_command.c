/* weft check */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/log.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "coordinator/render_job.h"
#include "scene/load.h"
#include "trace/kernel.h"
#include "trace/plan_facts.h"

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
             "Checks a scene (.json or .nff) with all that it reaches: says what is wrong, or\n"
             "else what rendering it takes, what of weft is compiled in for it and what is\n"
             "left out.\n");
        options_help(stdout, options);
        puts("\nExit status: 0 the scene is good; 2 wrong usage; 3 it is not, or a file that it\n"
             "names; 5 an internal failure. weft-scene(5) says how scenes are written.");
    } else {
        puts("weft " WEFT_VERSION);
    }
    exit(STATUS_OK);
}

/* --- what was compiled in --------------------------------------------------------------------------------- */

struct name {
    const char *one, *many;
};

static const struct name primitive_names[PRIMITIVE_KINDS] = {
    [PRIMITIVE_SPHERE] = {"sphere", "spheres"},
    [PRIMITIVE_GLOBE] = {"sphere close to the camera", "spheres close to the camera"},
    [PRIMITIVE_ELLIPSOID] = {"ellipsoid", "ellipsoids"},
    [PRIMITIVE_PLANE] = {"plane", "planes"},
    [PRIMITIVE_DISC] = {"disc", "discs"},
    [PRIMITIVE_FRUSTUM] = {"cylinder or cone", "cylinders or cones"},
    [PRIMITIVE_BOX] = {"box", "boxes"},
    [PRIMITIVE_TRIANGLE] = {"triangle", "triangles"},
    [PRIMITIVE_INSTANCE] = {"instance of a shared mesh", "instances of shared meshes"},
};

static const struct name texture_names[TEXTURE_KINDS] = {
    [TEXTURE_CONSTANT] = {"of one colour", "of one colour"}, [TEXTURE_CHECKER] = {"checker", "checkers"},
    [TEXTURE_STRIPES] = {"striped", "striped"},              [TEXTURE_GRADIENT] = {"gradient", "gradients"},
    [TEXTURE_IMAGE] = {"with an image", "with images"},
};

static const struct name light_names[LIGHT_KINDS] = {
    [LIGHT_POINT] = {"point", "point"},
    [LIGHT_DIRECTIONAL] = {"directional", "directional"},
    [LIGHT_SPOT] = {"spot", "spot"},
};

enum { MATERIAL_FEATURES = 6 };

static const struct name material_names[MATERIAL_FEATURES] = {
    {"with a highlight", "with highlights"}, {"mirror", "mirrors"},
    {"transparent", "transparent"},          {"refracting", "refracting"},
    {"absorbing", "absorbing"},              {"smooth mesh", "smooth meshes"},
};

static void count_materials(const struct plan_facts *facts, size_t counts[MATERIAL_FEATURES])
{
    const size_t found[MATERIAL_FEATURES] = {facts->highlights, facts->mirrors,   facts->transparent,
                                             facts->dielectric, facts->absorbing, facts->smooth};
    memcpy(counts, found, sizeof found);
}

/* "  title: 2 spheres, 1 box": those that there are, if any. */
static void print_present(const char *title, const struct name *names, const size_t *counts, size_t kinds)
{
    const char *before = "";
    for (size_t i = 0; i < kinds; i++) {
        if (counts[i] == 0)
            continue;
        if (!*before)
            printf("  %s: ", title);
        printf("%s%zu %s", before, counts[i], counts[i] == 1 ? names[i].one : names[i].many);
        before = ", ";
    }
    if (*before)
        putchar('\n');
}

static void print_search(const struct plan_facts *facts)
{
    if (facts->tree_nodes == 0) {
        puts("  search: every ray tries every primitive");
        return;
    }
    printf("  search: a tree of %zu %s (%zu bytes)", facts->tree_nodes, facts->tree_nodes == 1 ? "node" : "nodes",
           facts->tree_bytes);
    if (facts->loose)
        printf(", and %zu beside it that every ray tries", facts->loose);
    putchar('\n');
}

static void print_compiled_in(const struct plan_facts *facts)
{
    size_t materials[MATERIAL_FEATURES];
    count_materials(facts, materials);
    puts("compiled in:");
    print_present("primitives", primitive_names, facts->primitives_of, PRIMITIVE_KINDS);
    if (facts->shared_meshes)
        printf("  shared: %zu %s of %zu triangles, kept once (%zu bytes with what finds them)\n", facts->shared_meshes,
               facts->shared_meshes == 1 ? "mesh" : "meshes", facts->shared_triangles, facts->shared_bytes);
    print_search(facts);
    print_present("lights", light_names, facts->lights_of, LIGHT_KINDS);
    print_present("objects by texture", texture_names, facts->textured, TEXTURE_KINDS);
    print_present("objects by material", material_names, materials, MATERIAL_FEATURES);
    if (facts->images)
        printf("  images: %zu (%zu bytes with their smaller copies)\n", facts->images, facts->image_bytes);
    if (facts->footprints)
        puts("  texture footprints: what a sample covers of a texture is averaged");
    if (facts->touching)
        puts("  boundaries: refracting objects may touch or overlap");
    if (facts->around_camera)
        printf("  the camera is inside %zu refracting object%s\n", facts->around_camera,
               facts->around_camera == 1 ? "" : "s");
}

/* --- what was left out ------------------------------------------------------------------------------------ */

/* "  title: discs, boxes": those that there are none of, if any. */
static void print_absent(const char *title, const struct name *names, const size_t *counts, size_t kinds)
{
    const char *before = "";
    for (size_t i = 0; i < kinds; i++) {
        if (counts[i] > 0)
            continue;
        if (!*before)
            printf("  %s: ", title);
        printf("%s%s", before, names[i].many);
        before = ", ";
    }
    if (*before)
        putchar('\n');
}

/* "  2 lights: why" */
static void print_dropped(size_t count, const struct name *name, const char *why)
{
    if (count > 0)
        printf("  %zu %s: %s\n", count, count == 1 ? name->one : name->many, why);
}

static void print_left_out(const struct plan_facts *facts)
{
    static const struct name light = {"light", "lights"}, image = {"image", "images"};
    static const struct name pattern = {"pattern", "patterns"};
    size_t materials[MATERIAL_FEATURES];
    count_materials(facts, materials);
    puts("left out:");
    print_dropped(facts->black_lights, &light, "black");
    print_dropped(facts->idle_lights, &light, "no surface in reach answers");
    print_dropped(facts->images_unworn, &image, "nothing wears it");
    print_dropped(facts->folded, &pattern, "its colours are equal");
    if (facts->tree_nodes == 0)
        puts("  the search tree: there are too few primitives");
    if (!facts->footprints)
        puts("  texture footprints: nothing is textured");
    if (!facts->touching)
        puts("  boundaries: no two refracting objects touch");
    print_absent("primitives", primitive_names, facts->primitives_of, PRIMITIVE_KINDS);
    print_absent("lights", light_names, facts->lights_of, LIGHT_KINDS);
    print_absent("objects by texture", texture_names, facts->textured, TEXTURE_KINDS);
    print_absent("objects by material", material_names, materials, MATERIAL_FEATURES);
}

/* What a render takes that is told nothing else. */
static void print_sampling(uint32_t samples)
{
    if (samples > 0)
        printf("sampling: %u sample%s a pixel\n", samples, samples == 1 ? "" : "s");
    else
        printf("sampling: until the error is %g\n", RENDER_ERROR_DEFAULT);
}

static void print_needs(const char *path, const struct scene *scene, const struct asset_set *assets)
{
    const struct trace_settings settings = {scene->width, scene->height, scene->filter};
    struct plan *plan = plan_create(scene, &settings, cpu_available());
    struct plan_facts facts = plan_facts_of(plan, scene);
    size_t bytes = 0;
    for (size_t i = 0; i < assets->count; i++)
        bytes += assets->assets[i].bytes.size;
    printf("%s: good\nimage: %u×%u\n", path, scene->width, scene->height);
    print_sampling(scene->samples);
    if (scene->filter != FILTER_BOX)
        printf("filter: %s\n", pixel_filter_names[scene->filter]);
    printf("files: %zu, %zu bytes\n", assets->count, bytes);
    printf("objects: %zu, of %zu primitives\nlights: %zu\ndepth: %u\nkernel: %s\n", facts.objects, facts.primitives,
           facts.lights, scene->depth, kernel_default()->name);
    print_compiled_in(&facts);
    print_left_out(&facts);
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
