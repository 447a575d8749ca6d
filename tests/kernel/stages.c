/*
 * Every kernel does at every stage what the scalar one does, bit for bit: in batches of many sizes, over random
 * scenes of all kinds of things, along camera rays and nasty ones, for several generations.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "tests/kernel/compared.h"
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/generation.h"
#include "trace/plan_parts.h"
#include "trace/sample.h"

enum { OBJECTS = 36, SCENES = 6, GENERATIONS = 4, BATCH_MAX = 1024 };

/* --- scenes ----------------------------------------------------------------------------------------------- */

/* Random numbers of thing i of scene `scene` are those of case 1000 scene + i. */
static struct shape random_shape(uint32_t of, uint32_t kind)
{
    struct vec3 a = vec3_scale(random_vector(of, 0), 4), b = vec3_add(a, random_vector(of, 3)), n = random_unit(of, 6);
    double r = random_between(of, 9, 0.3, 1.2), s = random_between(of, 10, 0.1, 1);
    switch (kind % 9) {
    case 0:
        return shape_sphere(a, r);
    case 1:
        return shape_sphere(vec3_make(0, 0, 0), r); /* an ellipsoid, once it is stretched */
    case 2:
        return shape_plane(vec3_scale(n, -6), n);
    case 3:
        return shape_disc(a, n, r);
    case 4:
        return shape_frustum(a, b, r, s);
    case 5:
        return shape_tube(a, b, r, of % 2 ? 0 : s);
    case 6:
        return shape_box(vec3_sub(a, grey(s)), vec3_add(a, grey(r)));
    case 7:
        return shape_globe(a, r, 4, 6);
    default:
        return shape_box_mesh(vec3_sub(a, grey(s)), vec3_add(a, grey(r)));
    }
}

/* A mesh that has none gets texture coordinates. */
static struct texture random_texture(uint32_t of, uint32_t kind, struct shape *shape)
{
    struct texture texture = {.kind = (enum texture_kind)(kind % 5),
                              .color = {vec3_scale(random_unit(of, 20), 0.5), random_vector(of, 23)},
                              .direction = random_unit(of, 26),
                              .size = random_between(of, 29, 0.05, 1),
                              .end = random_between(of, 30, 0.5, 3),
                              .offset = random_vector(of, 31),
                              .map = (enum texture_map)(kind / 5 % MAP_MESH),
                              .repeat_u = 1 + of % 3,
                              .repeat_v = 2,
                              .axis_u = {1, 0.5, 0},
                              .axis_v = {0, 0.25, 1}};
    if (shape->kind == SHAPE_MESH && kind % 2) {
        shape->mesh.uv = memory_array(2 * shape->mesh.vertex_count, sizeof *shape->mesh.uv);
        for (uint32_t i = 0; i < 2 * shape->mesh.vertex_count; i++)
            shape->mesh.uv[i] = random_signed(i, 34);
        texture.kind = TEXTURE_IMAGE;
        texture.map = MAP_MESH;
    }
    return texture;
}

/* Matte, mirroring, clear, or glass if the shape is closed; some with highlights. */
static struct material random_material(uint32_t of, uint32_t kind, bool closed)
{
    struct material material = material_matte(random_unit(of, 40));
    if (kind % 4 == 1)
        material.reflection = vec3_make(0.8, 0.7, 0.6);
    if (kind % 4 == 2)
        material = material_filter(vec3_make(0.9, 0.5, 1));
    if (kind % 4 == 3 && closed)
        material = material_glass(random_between(of, 43, 0.7, 2.4), kind % 8 == 7 ? vec3_make(0.3, 0, 0.1) : grey(0));
    material.transparency *= 0.75;
    material.ambient = 0.3;
    material.specular = of % 3 ? grey(0.5) : grey(0);
    material.shininess = random_between(of, 44, 0.5, 90);
    return material;
}

static void add_random_object(struct scene *scene, uint32_t of, uint32_t i, bool textured)
{
    struct shape shape = random_shape(of, i);
    struct material material = random_material(of, i / 9 + i, shape_is_closed(&shape));
    if (textured)
        material.color = random_texture(of, i / 2, &shape);
    struct object *object = scene_add(scene, shape, material);
    if (i % 9 == 1)
        object->transform = affine_scaling(vec3_make(1, random_between(of, 50, 0.3, 3), 0.5));
    if (i % 9 == 1 || i % 4 == 3) {
        struct affine turn = affine_rotation(random_unit(of, 51), 180 * random_signed(of, 54));
        object->transform = affine_multiply(&turn, &object->transform);
        object->transform.offset = random_vector(of, 55);
    }
}

static void add_lights_of_all_kinds(struct scene *scene, uint32_t of)
{
    struct light spot = light_spot(vec3_scale(random_unit(of, 60), 8), random_unit(of, 63), 60, 20), sharp = spot;
    spot.direction = vec3_normalize(vec3_neg(spot.position));
    sharp.direction = spot.direction;
    sharp.inner_degrees = sharp.outer_degrees = 30;
    struct light point = light_point(vec3_scale(random_vector(of, 66), 3), vec3_make(1, 0.5, 0.25));
    point.falloff[2] = 0.5;
    scene_add_light(scene, spot);
    scene_add_light(scene, sharp);
    scene_add_light(scene, point);
    scene_add_light(scene, light_directional(random_unit(of, 69), grey(0.7)));
}

/* Number `number` of the random scenes: every other one is textured, two of three have many things, two of four have
 * pixels with a tent. The camera stands close to a large sphere's surface, which makes that a globe. */
static struct scene random_scene(uint32_t number)
{
    struct scene scene = scene_at(vec3_make(5, 4, 6), 50);
    scene.filter = number / 2 % 2 ? FILTER_TENT : FILTER_BOX;
    float texels[5 * 4 * 3];
    for (uint32_t i = 0; i < 60; i++)
        texels[i] = (float)random_between(i, 70, 0, 1);
    scene_add_image(&scene, 5, 4, texels);
    scene.background = (struct background){.kind = number % 2 ? BACKGROUND_GRADIENT : BACKGROUND_CONSTANT,
                                           .color = {{0.1, 0.2, 0.3}, {1, 0, 1}}};
    for (uint32_t i = 0; i < (number % 3 ? OBJECTS : 9); i++)
        add_random_object(&scene, 1000 * number + i, i, number % 2);
    for (uint32_t i = 0; i < 3; i++) { /* the globe's mesh again, in other places */
        struct object *object = scene_share(&scene, 7, random_material(1000 * number + 500 + i, 3 * i + number, true));
        object->transform = affine_rotation(random_unit(i, 90), 180 * random_signed(i, 93));
        object->transform.linear.x = vec3_scale(object->transform.linear.x, i == 1 ? -0.75 : 1.5);
    }
    struct vec3 down = {0, -40, 0};
    scene_add(&scene, shape_sphere(vec3_add(scene.camera.from, down), 40 - 0.125), material_mirror(grey(0.5)));
    add_lights_of_all_kinds(&scene, 1000 * number);
    return scene;
}

/* --- paths ------------------------------------------------------------------------------------------------ */

/* What a comparison runs on. All zero but for the generation's plan and kernel is ready for use. */
struct run {
    struct generation generation;
    struct lighting lighting;
    struct shadow_batch shadows;
    struct crossing_list crossings;
    size_t met[PRIMITIVE_KINDS], patterned[TEXTURE_IMAGE], imaged; /* surfaces, by kind */
};

static void run_finish(struct run *run)
{
    generation_finish(&run->generation);
    lighting_finish(&run->lighting);
    shadow_batch_finish(&run->shadows);
    crossing_list_finish(&run->crossings);
}

static void start_camera_paths(struct generation *g, size_t count, uint32_t samples)
{
    static uint32_t pixel_x[BATCH_MAX], pixel_y[BATCH_MAX], digits_x[BATCH_MAX], digits_y[BATCH_MAX];
    static double x[BATCH_MAX], y[BATCH_MAX];
    struct sample_cells cells = sample_cells(0, samples, g->plan->settings.filter);
    struct camera_rays rays = {count, samples, 0, cells, pixel_x, pixel_y, digits_x, digits_y, x, y};
    for (uint32_t i = 0; i < count; i++) {
        struct sample_digits digits = sample_digits(i % samples);
        pixel_x[i] = hash_u32(i) % 32;
        pixel_y[i] = hash_u32(i + 7) % 32;
        digits_x[i] = digits.x;
        digits_y[i] = digits.y;
    }
    medium_pool_clear(&g->media);
    path_batch_clear(&g->paths);
    g->paths.has_footprints = g->plan->needs_footprints;
    g->kernel->camera(g->plan, &rays, &g->paths);
    for (uint32_t i = 0; i < count; i++) {
        g->paths.sample[i] = i;
        g->paths.medium[i] = MEDIUM_SPACE;
    }
}

static struct vec3 nasty_direction(uint32_t i)
{
    double sign = i & 8 ? -1 : 1, tiny = i & 16 ? 1e-160 : -0.0;
    struct vec3 axis = {tiny, tiny, tiny}, slanting = random_unit(i, 80);
    *(i % 3 == 0 ? &axis.x : i % 3 == 1 ? &axis.y : &axis.z) = sign;
    slanting.y = i & 32 ? 0 : slanting.y;
    return vec3_normalize(i & 1 ? axis : slanting);
}

/* On some corner, edge or surface of the scene's objects, at the camera, at the end of the world, or anywhere near. */
static struct vec3 nasty_origin(const struct plan *plan, uint32_t i)
{
    struct vec3 away = vec3_neg(plan->eye), random = vec3_add(vec3_scale(random_vector(i, 83), 5), away);
    const struct sphere *sphere = &plan->spheres[i % plan->count[PRIMITIVE_SPHERE]];
    const struct box *box = &plan->boxes[i % plan->count[PRIMITIVE_BOX]];
    const struct triangle *triangle = &plan->triangles[i % plan->count[PRIMITIVE_TRIANGLE]];
    switch (i / 2 % 7) {
    case 0:
        return vec3_add_scaled(sphere->center, nasty_direction(i + 1), sphere->radius);
    case 1:
        return mat3_apply_transposed(&box->frame, i & 4 ? box->low : box->high);
    case 2:
        return vec3_mix(triangle->a, triangle->b, i & 4 ? 0.5 : 0);
    case 3:
        return vec3_scale(random, 1e12);
    case 4:
        return vec3_scale(random, 1e-300);
    case 5:
        return vec3_add_scaled(away, nasty_direction(i + 1), i & 4 ? 1e6 : 1e-6);
    default:
        return random;
    }
}

/* Every second path gets a nasty ray instead of the camera's. */
static void make_paths_nasty(struct generation *g)
{
    struct path_batch *paths = &g->paths;
    for (uint32_t i = 1; i < paths->rays.count; i += 2) {
        uint32_t from = hash_u32(i) % (uint32_t)g->plan->id_count;
        lane_put(paths->rays.origin, i, nasty_origin(g->plan, i));
        lane_put(paths->rays.direction, i, nasty_direction(i));
        paths->rays.t_min[i] = i % 5 == 0 ? -1e-9 : i % 5 == 1 ? 2 : 0;
        paths->rays.t_max[i] = i % 11 == 0 ? 3 : INFINITY;
        paths->rays.from[i] = i % 3 == 0 ? from : LANE_FROM_NONE;
        paths->rays.inward[i] = i % 6 == 0;
        lane_put(paths->throughput, i, i % 13 == 0 ? vec3_make(0, 1e-300, 1) : grey(1));
        lane_put(paths->footprint[0], i, vec3_scale(random_vector(i, 86), i % 7 == 0 ? 1e9 : 1e-3));
    }
}

/* --- generations ------------------------------------------------------------------------------------------ */

/* As the tracer does. */
static void add_lights(struct run *run)
{
    struct generation *g = &run->generation;
    for (size_t light = 0; light < g->plan->light_count; light++) {
        g->kernel->light(g->plan, light, &g->surfaces, &run->lighting);
        shadow_batch_collect(&run->shadows, &run->lighting, g->surfaces.count);
        g->kernel->shadow_rays(&g->surfaces, &run->lighting, &run->shadows);
        run->crossings.count = 0;
        g->kernel->shadow(g->plan, &run->shadows.rays, run->shadows.blocked, &run->crossings);
        shadow_batch_dim(&run->shadows, g->plan, &g->media, &g->paths, &g->surfaces, &run->crossings, &run->lighting);
        g->kernel->add_light(&run->lighting, &g->surfaces);
    }
}

static void count_surfaces(struct run *run)
{
    const struct surfaces *s = &run->generation.surfaces;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        run->met[kind] += s->first[kind + 1] - s->first[kind];
    for (int kind = TEXTURE_CHECKER; kind < TEXTURE_IMAGE; kind++)
        run->patterned[kind] += s->patterned[kind].count;
    run->imaged += s->imaged.count;
}

/* Follows a batch of `count` paths. */
static void follow(struct run *run, size_t count, uint32_t samples)
{
    struct generation *g = &run->generation;
    start_camera_paths(g, count, samples);
    make_paths_nasty(g);
    for (int generation = 0; generation < GENERATIONS && !trial.differs; generation++) {
        generation_find_hits(g);
        assert_true(generation_find_surfaces(g));
        g->kernel->ambient(g->plan, &g->surfaces);
        add_lights(run);
        g->kernel->find(g->plan, &g->surfaces, &g->paths);
        count_surfaces(run);
        generation_find_children(g);
        generation_pass(g);
    }
}

static void follow_all_sizes(struct run *run)
{
    static const size_t sizes[] = {1000, 0, 1, 7, 8, 9, 63, 64, 65};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes && !trial.differs; i++) {
        follow(run, sizes[i], i % 2 ? 1 : 4);
        if (trial.differs)
            print_message("# %s (batch of %zu)\n", trial.difference, sizes[i]);
    }
}

/* --- tests ------------------------------------------------------------------------------------------------ */

static void every_kernel_agrees_at_every_stage(void **state)
{
    (void)state;
    print_message("# seed %d\n", TEST_SEED);
    struct run run = {.generation.kernel = &kernel_compared};
    for (uint32_t number = 0; number < SCENES; number++) {
        struct scene scene = random_scene(number);
        struct trace_settings settings = settings_of(&scene);
        struct plan *plan = plan_create_sharing(&scene, &settings, 1, 0);
        run.generation.plan = plan;
        for (size_t k = 1; kernel_at(k); k++) {
            memset(&trial, 0, sizeof trial);
            trial.kernel = kernel_at(k);
            follow_all_sizes(&run);
            if (trial.differs)
                fail_msg("scene %u: %s", number, trial.difference);
        }
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        assert_true(run.met[kind] > 0);
    for (int kind = TEXTURE_CHECKER; kind < TEXTURE_IMAGE; kind++)
        assert_true(run.patterned[kind] > 0);
    assert_true(run.imaged > 0);
    run_finish(&run);
}

/* One wrong bit, in whichever stage, is found and put down to that stage. */
static void a_wrong_bit_is_found_at_every_stage(void **state)
{
    (void)state;
    struct scene scene = random_scene(1);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    for (int stage = 0; stage < STAGES; stage++) {
        struct run run = {.generation = {.plan = plan, .kernel = &kernel_compared}};
        memset(&trial, 0, sizeof trial);
        trial.kernel = &kernel_ref;
        trial.spoiled = stage_names[stage];
        follow(&run, 65, 1);
        char expected[64];
        snprintf(expected, sizeof expected, "stage %s, kernel ref, ", stage_names[stage]);
        assert_true(trial.differs);
        assert_memory_equal(trial.difference, expected, strlen(expected));
        run_finish(&run);
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kernel_agrees_at_every_stage),
        cmocka_unit_test(a_wrong_bit_is_found_at_every_stage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
