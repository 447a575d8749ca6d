/*
 * Scenes in JSON, rendered in 4 × 4 pixels and surveyed: every kernel of this machine must come to the bytes of the
 * scalar one.
 */
#include "image/encode.h"
#include "tests/fuzz/scene_help.h"
#include "worker/band.h"

enum { SIDE = 4, DEPTH_MAX = 3, PRIMITIVES_MAX = 200 };

/* Few primitives and lights, so that a render takes no time. */
static bool is_small(const struct scene *scene)
{
    size_t primitives = scene->light_count;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct shape *shape = &scene->objects[i].shape;
        primitives += shape->kind == SHAPE_MESH ? shape->mesh.triangle_count : 1;
    }
    return primitives <= PRIMITIVES_MAX;
}

/* All of the picture or of its survey, which is one tile. */
static struct bytes work(const struct plan *plan, const struct kernel *kernel, const struct order *order)
{
    static const struct job_settings settings = {
        .width = SIDE, .height = SIDE, .pixel_format = PIXEL_LINEAR, .maps = 1};
    static struct tile_outcome outcome;
    struct tracer *tracer = tracer_create(plan, kernel);
    struct band band;
    band_init(&band, &settings, order);
    for (uint32_t tile = 0; tile < band.tiles; tile++) {
        band_work(&band, tracer, tile, &outcome);
        band_add(&band, tile, &outcome);
    }
    struct bytes bytes = band_complete(&band);
    band_finish(&band);
    tracer_destroy(&tracer);
    return bytes;
}

static void compare_kernels(const struct plan *plan, const struct order *order)
{
    struct bytes expected = work(plan, &kernel_ref, order);
    const struct kernel *kernel;
    for (size_t i = 0; (kernel = kernel_at(i)); i++) {
        if (kernel == &kernel_ref)
            continue;
        struct bytes found = work(plan, kernel, order);
        require(found.size == expected.size && memcmp(found.data, expected.data, found.size) == 0);
        bytes_finish(&found);
    }
    bytes_finish(&expected);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct order orders[] = {
        {PASS_RENDER, 0, SIDE, {2, 2, 0}},
        {PASS_RENDER, 0, SIDE, {1, 8, 100}},
        {PASS_SURVEY, 0, 1, {1, 8, 100}},
    };
    struct asset_set assets = {0};
    struct scene scene;
    add_bytes(&assets, "scene.json", data, size);
    add_files(&assets);
    if (!load_scene(&assets, "scene.json", &scene))
        return 0;
    if (is_small(&scene)) {
        const struct trace_settings settings = {SIDE, SIDE, scene.filter};
        scene.depth = scene.depth < DEPTH_MAX ? scene.depth : DEPTH_MAX;
        struct plan *plan = plan_create(&scene, &settings, 1);
        for (size_t i = 0; i < sizeof orders / sizeof *orders; i++)
            compare_kernels(plan, &orders[i]);
        plan_destroy(&plan);
    }
    scene_finish(&scene);
    return 0;
}
