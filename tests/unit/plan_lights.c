/*
 * Lights that reach nothing are not in the plan; every other one is, in the scene's order. No surface would have found
 * any light of those that were left out.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "math/elementary.h"
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/light.h"
#include "trace/plan_parts.h"
#include "trace/surface.h"

static struct plan *plan_of(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    return plan_create(scene, &settings, 1);
}

static size_t lights_kept(struct scene *scene)
{
    struct plan *plan = plan_of(scene);
    size_t count = plan->light_count;
    plan_destroy(&plan);
    return count;
}

/* One shape of a material, and one light. */
static void assert_kept(struct shape shape, struct material material, struct light light, size_t expected)
{
    struct scene scene = scene_at(vec3_make(1, 4, 9), 40);
    scene_add(&scene, shape, material);
    scene_add_light(&scene, light);
    assert_int_equal(lights_kept(&scene), expected);
    scene_finish(&scene);
}

/* --- by hand ---------------------------------------------------------------------------------------------- */

static void black_lights_are_left_out_and_the_others_stay_in_order(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 0, 9), 40);
    scene_add(&scene, shape_sphere(vec3_make(0, 0, 0), 1), material_matte(grey(1)));
    for (int i = 0; i < 6; i++)
        scene_add_light(&scene, light_point(vec3_make(i, 5, 0), grey(i % 2 ? 0 : 1 + i)));
    struct plan *plan = plan_of(&scene);
    assert_int_equal(plan->light_count, 3);
    for (int i = 0; i < 3; i++)
        assert_true(plan->lights[i].color.x == 1 + 2 * i);
    plan_destroy(&plan);
    scene_finish(&scene);
}

static void a_light_needs_something_that_answers(void **state)
{
    (void)state;
    struct shape ball = shape_sphere(vec3_make(0, 0, 0), 1);
    struct light lamp = light_point(vec3_make(0, 5, 0), grey(1)), sun = light_directional(vec3_make(0, -1, 0), grey(1));
    struct material shiny = material_glass(1.5, grey(0)), dull = material_matte(grey(1));
    shiny.specular = grey(0.5);
    dull.diffuse = 0;
    dull.ambient = 1;
    assert_kept(ball, material_matte(grey(1)), lamp, 1);
    assert_kept(ball, material_glass(1.5, grey(0)), lamp, 0);
    assert_kept(ball, material_glass(1.5, grey(0)), sun, 0);
    assert_kept(ball, shiny, lamp, 1);
    assert_kept(ball, dull, sun, 0);
    struct scene nothing = scene_at(vec3_make(0, 0, 9), 40);
    scene_add_light(&nothing, lamp);
    assert_int_equal(lights_kept(&nothing), 0);
    scene_finish(&nothing);
}

static void a_spot_must_be_turned_to_something(void **state)
{
    (void)state;
    struct material matte = material_matte(grey(1));
    struct vec3 up = {0, 1, 0}, at = {0, 3, 0};
    struct shape floor = shape_plane(vec3_make(0, 0, 0), up);
    struct shape slab = shape_box(vec3_make(-50, -1, -50), vec3_make(50, 0, 50));
    struct shape globe = shape_sphere(vec3_make(0, -1000, 0), 1000);
    struct shape ball = shape_sphere(vec3_make(0, 0, 0), 1);
    struct vec3 slope = {0, math_sin_degrees(31), math_cos_degrees(31)}; /* the cone's edge is 1° above the horizon */
    struct vec3 flatter = {0, math_sin_degrees(29), math_cos_degrees(29)};
    assert_kept(floor, matte, light_spot(at, slope, 30, 10), 0);
    assert_kept(floor, matte, light_spot(at, flatter, 30, 10), 1);
    assert_kept(slab, matte, light_spot(at, slope, 30, 10), 0);
    assert_kept(slab, matte, light_spot(at, flatter, 30, 10), 1);
    assert_kept(globe, matte, light_spot(at, slope, 30, 10), 0);
    assert_kept(floor, matte, light_spot(vec3_make(0, -3, 0), up, 30, 10), 1); /* its back is lit too */
    assert_kept(floor, matte, light_spot(vec3_make(0, 0, 0), up, 30, 10), 1);  /* it might touch the floor */
    assert_kept(ball, matte, light_spot(at, vec3_make(1, 0, 0), 54, 10), 0);
    assert_kept(ball, matte, light_spot(at, vec3_make(1, 0, 0), 75, 10), 1);
    assert_kept(ball, matte, light_spot(vec3_make(0.5, 0, 0), vec3_make(1, 0, 0), 5, 5), 1);
}

/* --- by chance -------------------------------------------------------------------------------------------- */

static struct shape random_shape(uint32_t index, uint32_t draw)
{
    struct vec3 at = vec3_scale(random_vector(index, draw), 4);
    double size = random_between(index, draw + 3, 0.1, 2.5);
    struct vec3 other = vec3_add_scaled(at, random_unit(index, draw + 4), size);
    switch (hash_u32(index * 97 + draw) % 7) {
    case 0:
        return shape_plane(at, random_unit(index, draw + 4));
    case 1:
        return shape_disc(at, random_unit(index, draw + 4), size);
    case 2:
        return shape_frustum(at, other, 0.7 * size, 0);
    case 3:
        return shape_box(at, vec3_add(at, vec3_make(size, 0.1 * size, 3 * size)));
    case 4:
        return shape_globe(at, size, 4, 5);
    default:
        return shape_sphere(at, size);
    }
}

/* One to three things far from the origin or near it, stretched or not, under a spot that hardly misses a point of the
 * first one's middle, or does not. */
static struct scene random_scene(uint32_t index)
{
    double far = index % 3 ? 0 : random_between(index, 90, 0, 1e6);
    struct vec3 home = vec3_scale(random_unit(index, 91), far), aim = vec3_scale(random_vector(index, 1), 4);
    struct scene scene = scene_at(vec3_add(home, vec3_scale(random_unit(index, 40), 12)), 40);
    scene.camera.at = home;
    for (uint32_t i = 0; i <= index % 3; i++) {
        struct object *object = scene_add(&scene, random_shape(index, 1 + 10 * i), material_matte(grey(1)));
        if (index % 2)
            object->transform.linear.y.y = random_between(index, 50 + i, 0.1, 3);
        object->transform.offset = home;
    }
    struct vec3 from = vec3_scale(random_vector(index, 60), 8), side = random_unit(index, 63);
    double spread = random_between(index, 66, 0, 1.5), outer = random_between(index, 67, 0, index % 5 ? 60 : 90);
    struct vec3 direction = vec3_add_scaled(vec3_normalize(vec3_sub(aim, from)), side, spread);
    scene_add_light(&scene, light_spot(vec3_add(home, from), direction, outer, random_between(index, 68, 0, outer)));
    return scene;
}

/* A direction within the light's cone, often on its edge, or beside it. */
static struct vec3 cone_direction(const struct light *light, uint32_t index, uint32_t draw)
{
    struct vec3 x, y;
    vec3_frame(light->direction, &x, &y);
    double share = random_between(index, draw, 0, 1.2), turn = random_between(index, draw + 1, 0, 360);
    double angle = light->outer_degrees * (share > 1 ? 1 : share), across = math_sin_degrees(angle);
    struct vec3 along = vec3_scale(light->direction, math_cos_degrees(angle));
    along = vec3_add_scaled(along, x, across * math_cos_degrees(turn));
    return vec3_normalize(vec3_add_scaled(along, y, across * math_sin_degrees(turn)));
}

/* How many rays from the light through its cone end on a surface that the light reaches. */
static int points_reached(const struct plan *plan, const struct light *light, uint32_t index)
{
    enum { RAYS = 200 };
    struct plan_light lamp = plan_light_compile(light, plan->eye);
    struct ray_batch rays = {0};
    struct hit_batch hits = {0};
    int reached = 0;
    for (uint32_t i = 0; i < RAYS; i++)
        ray_batch_push(&rays, &(struct ray){.origin = lamp.position,
                                            .direction = cone_direction(light, index, 100 + 2 * i),
                                            .t_max = INFINITY, .key_min = KEY_NONE, .from = PRIMITIVE_NONE});
    hit_batch_reserve(&hits, rays.count);
    kernel_ref.closest(plan, &rays, &hits);
    for (uint32_t i = 0; i < RAYS; i++) {
        struct hit hit = hit_at(plan, &rays, &hits, i);
        if (hit.id == PRIMITIVE_NONE)
            continue;
        struct ray ray = ray_batch_get(&rays, i);
        struct light_arrival arrival;
        reached += light_arrive(&lamp, surface_at(plan, &ray, &hit).position, &arrival);
    }
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
    return reached;
}

static void what_is_left_out_reaches_nothing(void **state)
{
    (void)state;
    enum { SCENES = 3000 };
    int left_out = 0, idle = 0;
    for (uint32_t index = 0; index < SCENES; index++) {
        struct scene scene = random_scene(index);
        struct plan *plan = plan_of(&scene);
        int reached = points_reached(plan, &scene.lights[0], index);
        if (plan->light_count == 0 && reached > 0)
            fail_msg("scene %u of seed %d: a light that reaches %d points was left out", index, TEST_SEED, reached);
        left_out += plan->light_count == 0;
        idle += reached == 0;
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    print_message("# seed %d: %d of %d spots left out; %d were found to reach nothing\n", TEST_SEED, left_out, SCENES,
                  idle);
    assert_true(left_out > idle / 2 && left_out < SCENES / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(black_lights_are_left_out_and_the_others_stay_in_order),
        cmocka_unit_test(a_light_needs_something_that_answers),
        cmocka_unit_test(a_spot_must_be_turned_to_something),
        cmocka_unit_test(what_is_left_out_reaches_nothing),
    };
    return cmocka_run_group_tests_name("plan_lights", tests, NULL, NULL);
}
