/*
 * What a plan keeps of objects that share a mesh: their ids, boxes and triangles are those that copies would have, and
 * the memory that of one mesh.
 */
#include <malloc.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "scene/load.h"
#include "tests/random.h"
#include "tests/sanitized.h"
#include "tests/scene_builder.h"
#include "trace/instance.h"
#include "trace/plan_facts.h"
#include "trace/plan_parts.h"
#include "trace/surface.h"

static struct affine place_of(uint32_t i)
{
    struct affine turn = affine_rotation(random_unit(i, 0), 180 * random_signed(i, 3));
    struct affine place = affine_scaling(vec3_make(i % 2 ? 1 : -0.5, 0.75, 1.25));
    place = affine_multiply(&turn, &place);
    place.offset = vec3_scale(random_vector(i, 4), 9);
    return place;
}

/* Bricks, three of which stand on a slab, among other things, and a mesh that nothing shares. */
static struct scene mixed_scene(void)
{
    struct scene scene = scene_at(vec3_make(3, 5, 20), 40);
    struct material matte = material_matte(grey(1));
    scene_add(&scene, shape_sphere(vec3_make(0, 5, 0), 1), matte);
    size_t brick = scene.object_count;
    scene_add(&scene, shape_box_mesh(vec3_make(0, 0, 0), vec3_make(2, 1, 1)), matte)->transform = place_of(1);
    scene_share(&scene, brick, matte)->transform = place_of(2);
    scene_add(&scene, shape_globe(vec3_make(0, 0, 5), 1, 3, 4), matte);
    for (uint32_t i = 0; i < 3; i++)
        scene_share(&scene, brick, i == 1 ? material_filter(grey(0.5)) : matte)->transform =
            affine_translation(vec3_make(3 * i, 0, 0));
    scene_add(&scene, shape_box(vec3_make(-9, -1, -9), vec3_make(9, 0, 9)), matte);
    struct affine turn = affine_rotation(vec3_normalize(vec3_make(1, 2, 3)), 77);
    for (size_t i = 0; i < scene.object_count; i++)
        scene.objects[i].transform = affine_multiply(&turn, &scene.objects[i].transform);
    return scene;
}

static void assert_same_triangle(const struct triangle *a, const struct triangle *b)
{
    assert_memory_equal(a, b, sizeof *a);
}

static void an_instance_has_what_a_copy_would(void **state)
{
    (void)state;
    print_message("# seed %d\n", TEST_SEED);
    struct scene scene = mixed_scene();
    struct trace_settings settings = settings_of(&scene);
    struct plan *copied = plan_create_sharing(&scene, &settings, 1, SIZE_MAX);
    struct plan *shared = plan_create_sharing(&scene, &settings, 1, 0);
    assert_int_equal(shared->count[PRIMITIVE_INSTANCE], 5);
    assert_int_equal(shared->count[PRIMITIVE_TRIANGLE], 24);
    assert_int_equal(shared->shared_mesh_count, 1);
    assert_int_equal(shared->primitive_count, 1 + 5 + 24 + 1);
    assert_int_equal(shared->id_count, copied->id_count);
    for (uint32_t id = 0; id < copied->id_count; id++) {
        const struct primitive *a = plan_primitive(copied, id), *b = plan_primitive(shared, id);
        assert_int_equal(a - copied->primitives, id);
        assert_int_equal(a->object, b->object);
        assert_int_equal(a->traits, b->traits);
        assert_int_equal(a->blocks_light, b->blocks_light);
        assert_int_equal(surface_flat_axis(copied, id, 0), surface_flat_axis(shared, id, 0));
        assert_int_equal(primitive_is_of_mesh(a), primitive_is_of_mesh(b));
        if (!primitive_is_of_mesh(a))
            continue;
        struct triangle one = plan_triangle(copied, id), other = plan_triangle(shared, id);
        assert_same_triangle(&one, &other);
    }
    for (size_t i = 0; i < scene.object_count; i++) {
        struct bounds a, b;
        assert_true(bounds_of_object(copied, i, &a) && bounds_of_object(shared, i, &b));
        assert_memory_equal(&a, &b, sizeof a);
    }
    plan_destroy(&copied);
    plan_destroy(&shared);
    scene_finish(&scene);
}

/* The three bricks' bottoms, of two triangles each, lie on the slab; and nothing else touches. */
static void only_what_touches_is_welded(void **state)
{
    (void)state;
    struct scene scene = mixed_scene();
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create_sharing(&scene, &settings, 1, 0);
    assert_int_equal(plan->welded_count, 6);
    for (size_t i = 0; i < plan->welded_count; i++) {
        struct triangle triangle = plan_triangle(plan, plan->welded[i].id);
        assert_true(i == 0 || plan->welded[i - 1].id < plan->welded[i].id);
        assert_memory_equal(&triangle.plane, &plan->welded[i].plane, sizeof triangle.plane);
        assert_true(vec3_max_abs(vec3_add(triangle.plane.normal, plan->boxes[0].frame.y)) == 0);
        assert_true(triangle.plane.offset == -plan->boxes[0].high.y);
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Where the way to the mesh's space and back would lose too much, and where nothing is gained. */
static void some_are_copied_all_the_same(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(3, 5, 20), 40);
    struct material matte = material_matte(grey(1));
    scene_add(&scene, shape_globe(vec3_make(0, 0, 0), 1, 3, 4), matte);
    scene_share(&scene, 0, matte)->transform.offset.x = 5;
    scene_share(&scene, 0, matte)->transform.offset.x = 1e9;
    scene_share(&scene, 0, matte)->transform.linear.x.x = 1e-9;
    scene_share(&scene, 0, matte)->transform.linear.x.y = 1e7;
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create_sharing(&scene, &settings, 1, 0);
    assert_int_equal(plan->count[PRIMITIVE_INSTANCE], 2);
    assert_int_equal(plan->count[PRIMITIVE_TRIANGLE], 3 * 24);
    for (size_t i = 0; i < scene.object_count; i++)
        assert_true(plan->objects[i].shares_mesh);
    plan_destroy(&plan);
    plan = plan_create(&scene, &settings, 1);
    assert_int_equal(plan->count[PRIMITIVE_INSTANCE], 0);
    plan_destroy(&plan);
    scene_finish(&scene);
}

#ifndef SANITIZED
static size_t heap_bytes(void)
{
    struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}
#endif

/* 1000 wearers of 100,000 triangles take little more than the mesh's tree, of 40 bytes a triangle. */
static void a_thousand_take_little_more_than_one(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(3, 5, 20), 40);
    struct material matte = material_matte(grey(1));
    scene_add(&scene, shape_globe(vec3_make(0, 0, 0), 1, 200, 250), matte);
    for (uint32_t i = 1; i < 1000; i++)
        scene_share(&scene, 0, matte)->transform = place_of(i);
    struct trace_settings settings = settings_of(&scene);
#ifndef SANITIZED
    size_t before = heap_bytes();
#endif
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct plan_facts facts = plan_facts_of(plan, &scene);
#ifndef SANITIZED
    size_t bytes = heap_bytes() - before;
    print_message("# %zu bytes\n", bytes);
    assert_true(bytes < 40 * 100000 + 1000 * 1000);
#endif
    assert_int_equal(facts.primitives, 100000000);
    assert_int_equal(facts.primitives_of[PRIMITIVE_INSTANCE], 1000);
    assert_int_equal(facts.shared_meshes, 1);
    assert_int_equal(facts.shared_triangles, 100000);
    assert_true(facts.shared_bytes > 4 * 100000 && facts.shared_bytes < 40 * 100000);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Counts are all that is looked at. */
static void there_are_as_many_as_ids(void **state)
{
    (void)state;
    struct object objects[43];
    struct scene scene = {.objects = objects, .object_count = sizeof objects / sizeof *objects};
    struct error error = {0};
    for (size_t i = 0; i < scene.object_count; i++)
        objects[i] = (struct object){.shape = {.kind = SHAPE_MESH, .mesh = {.triangle_count = 100000000}}};
    assert_int_equal(scene_check_size(&scene, "wood.json", &error), STATUS_INPUT);
    assert_string_equal(error.text, "wood.json: expected at most 4294967295 primitives (each triangle counts, of a mesh "
                                    "anew for each object), found 4300000000");
    objects[42].shape.mesh.triangle_count = 94967295;
    assert_int_equal(scene_check_size(&scene, "wood.json", &error), STATUS_OK);
    objects[42].shape.mesh.triangle_count++;
    assert_int_equal(scene_check_size(&scene, "wood.json", &error), STATUS_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_instance_has_what_a_copy_would), cmocka_unit_test(only_what_touches_is_welded),
        cmocka_unit_test(some_are_copied_all_the_same),      cmocka_unit_test(a_thousand_take_little_more_than_one),
        cmocka_unit_test(there_are_as_many_as_ids),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
