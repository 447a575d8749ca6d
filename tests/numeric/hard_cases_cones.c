/*
 * Hard cases 13 to 24: cylinders, cones and frustums.
 */
#include "scene/load.h"
#include "tests/numeric/shoot.h"

static const struct vec3 up = {0, 0, 1}; /* the axis of all of them */

/* Radius 1, from z = 0 to z = 2. */
static struct shape cylinder(bool open)
{
    struct shape shape = shape_frustum(vec3_make(0, 0, 0), vec3_make(0, 0, 2), 1, 1);
    shape.frustum.open = open;
    return shape;
}

/* k = 1/2, H = 2: the apex at the origin, the base of radius 1 at z = 2. */
static struct shape cone(bool open)
{
    struct shape shape = shape_frustum(vec3_make(0, 0, 2), vec3_make(0, 0, 0), 1, 0);
    shape.frustum.open = open;
    return shape;
}

static void case_13_along_the_axis_from_inside(void **state)
{
    (void)state;
    struct world capped = world_plain(cylinder(false)), open = world_plain(cylinder(true));
    check_shot(&capped, vec3_make(0, 0, 0.5), up, SIDE_LEAVE, 1.5, 0);
    check_shot(&capped, vec3_make(0, 0, 0.5), vec3_neg(up), SIDE_LEAVE, 0.5, 0);
    check_shot(&capped, vec3_make(0.3, -0.4, 0.5), vec3_make(-0.0, 0, 1), SIDE_LEAVE, 1.5, 0);
    check_shot(&capped, vec3_make(0, 0, -3), up, SIDE_ENTER, 3, 0);
    check_shot(&capped, vec3_make(1, 0, -3), up, SIDE_ENTER, 3,
               0); /* in the side itself: it belongs to the solid */
    assert_misses(&open, vec3_make(0, 0, 0.5), up);
    assert_misses(&open, vec3_make(0, 0, 0.5), vec3_neg(up));
    assert_misses(&open, vec3_make(0.3, -0.4, -3), vec3_make(-0.0, 0, 1));
    world_end(&capped);
    world_end(&open);
}

static void case_14_along_the_axis_from_outside_misses(void **state)
{
    (void)state;
    struct world worlds[] = {world_plain(cylinder(false)), world_plain(cylinder(true))};
    for (size_t k = 0; k < 2; k++) {
        for (uint32_t i = 0; i < 500; i++) {
            double angle = random_between(i, 0, 0, 6.283185307179586),
                   r = 1 + pow(10, random_between(i, 1, -12, 3));
            struct vec3 o = {r * cos(angle), r * sin(angle), random_between(i, 2, -3, 5)};
            assert_misses(&worlds[k], o, i % 2 ? up : vec3_neg(up));
        }
        world_end(&worlds[k]);
    }
}

/* Beside the axis by 1e-15, or turned from it by 1e-15: next to the same t, and still nothing if open. */
static void case_15_almost_along_the_axis(void **state)
{
    (void)state;
    struct world capped = world_plain(cylinder(false)), open = world_plain(cylinder(true));
    for (uint32_t i = 0; i < 500; i++) {
        struct vec3 offset = vec3_scale(random_vector(i, 0), 1e-15),
                    tilt = vec3_scale(random_vector(i, 3), 1e-15);
        struct vec3 o = vec3_add(vec3_make(0, 0, 0.5), i % 3 == 1 ? vec3_make(0, 0, 0) : offset);
        struct vec3 d = vec3_add(up, i % 3 == 0 ? vec3_make(0, 0, 0) : tilt);
        check_shot(&capped, o, d, SIDE_LEAVE, 1.5, 2e-15);
        assert_misses(&open, o, d);
        check_shot(&capped, vec3_add_scaled(o, up, -3.5), d, SIDE_ENTER, 3, 3e-15);
    }
    world_end(&capped);
    world_end(&open);
}

/* Rays from all around through points of a rim that are pulled in by 1e-12 towards the middle, from outside,
 * at 3 to 100 radii: each must enter before that point and leave after it. */
static void check_rim(const struct world *world, double radius, double height, struct vec3 middle)
{
    enum { RAYS = 60000 };
    struct ray_batch rays = {0}, rest = {0};
    struct hit_batch enters = {0}, leaves = {0};
    unsigned leaks = 0;
    for (uint32_t i = 0; i < RAYS; i++) {
        double angle = random_between(i, 3, 0, 6.283185307179586), s = random_between(i, 4, 3, 100);
        struct vec3 rim = vec3_make(radius * cos(angle), radius * sin(angle), height), d = random_unit(i, 0);
        struct ray ray = ray_from(world, vec3_add_scaled(vec3_mix(rim, middle, 1e-12), d, -s), d);
        ray_batch_push(&rays, &ray);
    }
    shoot_batch(world->plan, &rays, &enters);
    check_shadows(world->plan, &rays, &enters);
    for (size_t i = 0; i < RAYS; i++) {
        struct hit hit = hit_at(world->plan, &rays, &enters, i);
        struct ray ray = ray_beyond(ray_batch_get(&rays, i), &hit);
        leaks += hit.id == PRIMITIVE_NONE || hit.side != SIDE_ENTER;
        ray_batch_push(&rest, &ray);
    }
    shoot_batch(world->plan, &rest, &leaves);
    for (size_t i = 0; i < RAYS; i++)
        leaks += hit_batch_id(&enters, i) != PRIMITIVE_NONE &&
                 (hit_batch_id(&leaves, i) == PRIMITIVE_NONE || hit_batch_side(&leaves, i) != SIDE_LEAVE);
    ray_batch_finish(&rays);
    ray_batch_finish(&rest);
    hit_batch_finish(&enters);
    hit_batch_finish(&leaves);
    assert_int_equal(leaks, 0);
}

static void case_16_cylinder_rim_does_not_leak(void **state)
{
    (void)state;
    struct world world = world_plain(cylinder(false));
    check_rim(&world, 1, 0, vec3_make(0, 0, 1));
    check_rim(&world, 1, 2, vec3_make(0, 0, 1));
    world_end(&world);
}

static void case_17_cone_rim_does_not_leak(void **state)
{
    (void)state;
    struct world world = world_plain(cone(false));
    check_rim(&world, 1, 2, vec3_make(0, 0, 1.5));
    check_rim(&world, 0, 0, vec3_make(0, 0, 1.5)); /* the apex */
    world_end(&world);
}

static void case_18_apex_through_the_axis(void **state)
{
    (void)state;
    struct world capped = world_plain(cone(false)), open = world_plain(cone(true));
    check_shot(&capped, vec3_make(0, 0, -3), up, SIDE_ENTER, 3, 0);
    check_shot(&open, vec3_make(0, 0, -3), up, SIDE_ENTER, 3, 0);
    struct ray ray = ray_from(&capped, vec3_make(0, 0, -3), up);
    struct hit hit = shoot_ray(&capped, &ray);
    struct vec3 normal = surface_at(capped.plan, &ray, &hit).normal; /* 0/0 at the apex: along the axis */
    assert_true(normal.x == 0 && normal.y == 0 && normal.z == -1);
    world_end(&capped);
    world_end(&open);
}

static void case_19_parallel_to_the_axis_beside_it(void **state)
{
    (void)state;
    struct world capped = world_plain(cone(false)), open = world_plain(cone(true));
    check_shot(&capped, vec3_make(0.25, 0, -3), up, SIDE_ENTER, 3.5, 1e-15);
    check_shot(&open, vec3_make(0.25, 0, -3), up, SIDE_ENTER, 3.5, 1e-15);
    check_shot(&capped, vec3_make(0.25, 0, 5), vec3_neg(up), SIDE_ENTER, 3, 0);
    check_shot(&open, vec3_make(0.25, 0, 5), vec3_neg(up), SIDE_LEAVE, 4.5, 1e-15);
    world_end(&capped);
    world_end(&open);
}

static void case_20_cone_from_the_side(void **state)
{
    (void)state;
    struct world world = world_plain(cone(false));
    check_shot(&world, vec3_make(3, 0, 1), vec3_make(-1, 0, 0), SIDE_ENTER, 2.5, 1e-15);
    check_shot(&world, vec3_make(0, 0, 1), vec3_make(-1, 0, 0), SIDE_LEAVE, 0.5, 1e-15);
    world_end(&world);
}

/* A ray along a generator, or parallel to one: a = b = 0 in the quadratic, whatever the signs of the zeros. */
static void case_21_parallel_to_a_generator(void **state)
{
    (void)state;
    struct world capped = world_plain(cone(false)), open = world_plain(cone(true));
    static const double zeros[] = {0.0, -0.0};
    for (int k = 0; k < 2; k++) {
        struct vec3 generator = {1, zeros[k], 2}, falling = {-1, zeros[k], -2};
        assert_misses(&capped, vec3_make(-1, 0.3, -2), generator);
        assert_misses(&open, vec3_make(-1, 0.3, -2), generator);
        assert_misses(&capped, vec3_make(2, 0.3, 4), falling);
        /* In the surface: none, or there. */
        struct hit along = shoot(&capped, vec3_make(-1, zeros[k], -2), generator);
        assert_true(along.id == PRIMITIVE_NONE || fabs(along.t - sqrt(5)) <= 1e-7);
        shoot(&open, vec3_make(-1, zeros[k], -2), generator);
        check_shot(&capped, vec3_make(-1.5, zeros[k], -2), generator, SIDE_ENTER, 1.25 * sqrt(5), 4e-15);
        check_shot(&open, vec3_make(0.25, zeros[k], 1), falling, SIDE_LEAVE, 0.375 * sqrt(5), 4e-15);
    }
    world_end(&capped);
    world_end(&open);
}

/* Rays that would meet the other nappe, at z < 0, but not this one. */
static void case_22_second_nappe_is_never_hit(void **state)
{
    (void)state;
    struct world capped = world_plain(cone(false)), open = world_plain(cone(true));
    unsigned met = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        double angle = random_between(i, 0, 0, 6.283185307179586), z = random_between(i, 1, -4, -1e-9);
        struct vec3 target = {-z / 2 * cos(angle), -z / 2 * sin(angle), z};
        struct vec3 o = vec3_add_scaled(target, random_unit(i, 2), 5), d = vec3_sub(target, o);
        struct ray ray = ray_from(&capped, o, d);
        double leave = exact_t(&capped, &ray, SIDE_LEAVE);
        struct hit a = shoot_ray(&capped, &ray), b = shoot_ray(&open, &ray);
        assert_true(a.id == PRIMITIVE_NONE || o.z + a.t * ray.direction.z >= -1e-14);
        assert_true(b.id == PRIMITIVE_NONE || o.z + b.t * ray.direction.z >= -1e-14);
        assert_true((a.id != PRIMITIVE_NONE) == (leave > 0));
        met += a.id != PRIMITIVE_NONE;
    }
    assert_true(met > 100 && met < 19000);
    world_end(&capped);
    world_end(&open);
}

/* The world of a scene file's text with one object. */
static struct world world_of_text(const char *object)
{
    char *json =
        memory_format("{\"camera\": {\"from\": [0, 0, 9], \"at\": [0, 0, 0]}, \"objects\": [%s]}", object);
    struct bytes text = {0};
    bytes_put(&text, json, strlen(json) + 1);
    text.size--; /* the NUL */
    struct asset_set assets = {0};
    asset_set_add(&assets, "test.json", &text);
    struct world world = {.plan = NULL};
    struct error error;
    assert_int_equal(scene_load(&world.scene, "test.json", &assets, &error), STATUS_OK);
    world_compile(&world);
    asset_set_finish(&assets);
    free(json);
    return world;
}

/* The same bits as a cylinder's from a file, and next to a frustum's whose radii differ by an ulp. */
static void case_23_frustum_of_equal_radii_is_the_cylinder(void **state)
{
    (void)state;
    struct world cylinders = world_of_text(
        "{\"type\": \"cylinder\", \"base\": [0.1, -1, 0.2], \"top\": [0.4, 1, 0], \"radius\": 0.75}");
    struct world frustums =
        world_of_text("{\"type\": \"frustum\", \"base\": [0.1, -1, 0.2], \"top\": [0.4, 1, 0],"
                      " \"base_radius\": 0.75, \"top_radius\": 0.75}");
    struct world almost =
        world_of_text("{\"type\": \"frustum\", \"base\": [0.1, -1, 0.2], \"top\": [0.4, 1, 0],"
                      " \"base_radius\": 0.75, \"top_radius\": 0.7500000000000001}");
    unsigned met = 0;
    for (uint32_t i = 0; i < 5000; i++) {
        struct vec3 o = vec3_scale(random_unit(i, 0), 4), d = vec3_sub(vec3_scale(random_vector(i, 3), 0.6), o);
        struct hit a = shoot(&cylinders, o, d), b = shoot(&frustums, o, d), c = shoot(&almost, o, d);
        assert_true(hits_are_equal(&a, &b));
        if (a.id == PRIMITIVE_NONE)
            continue;
        struct ray ray = ray_from(&cylinders, o, d);
        double cosine = fabs(vec3_dot(surface_at(cylinders.plan, &ray, &a).normal, ray.direction));
        if (cosine > 0.05)
            check_hit(&c, a.side, a.t, 1e-13);
        met++;
    }
    assert_true(met > 3000);
    world_end(&cylinders);
    world_end(&frustums);
    world_end(&almost);
}

/* A ray in the plane of a cap has no closed answer: none, or that of the ray just inside, and no NaN. */
static void case_24_in_the_plane_of_a_cap(void **state)
{
    (void)state;
    struct world worlds[] = {world_plain(cylinder(false)), world_plain(cone(false))};
    for (size_t k = 0; k < 2; k++) {
        for (uint32_t i = 0; i < 2000; i++) {
            double angle = random_between(i, 0, 0, 6.283185307179586), b = random_between(i, 1, -0.99, 0.99);
            double half_chord = sqrt(1 - b * b), zero = i % 2 ? 0.0 : -0.0;
            struct vec3 d = {cos(angle), sin(angle), zero}, side = {-d.y, d.x, 0};
            struct vec3 o = vec3_add_scaled(vec3_add_scaled(vec3_make(0, 0, 2), side, b), d, -3);
            struct hit in = shoot(&worlds[k], o, d);
            assert_true(in.id == PRIMITIVE_NONE ||
                        (in.side == SIDE_ENTER && fabs(in.t - 3 + half_chord) <= 1e-13));
            o.z = 2 - 1e-12;
            check_shot(&worlds[k], o, d, SIDE_ENTER, 3 - half_chord, 2e-11);
            o.z = 2 + 1e-12;
            assert_misses(&worlds[k], o, d);
        }
        world_end(&worlds[k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_13_along_the_axis_from_inside),
        cmocka_unit_test(case_14_along_the_axis_from_outside_misses),
        cmocka_unit_test(case_15_almost_along_the_axis),
        cmocka_unit_test(case_16_cylinder_rim_does_not_leak),
        cmocka_unit_test(case_17_cone_rim_does_not_leak),
        cmocka_unit_test(case_18_apex_through_the_axis),
        cmocka_unit_test(case_19_parallel_to_the_axis_beside_it),
        cmocka_unit_test(case_20_cone_from_the_side),
        cmocka_unit_test(case_21_parallel_to_a_generator),
        cmocka_unit_test(case_22_second_nappe_is_never_hit),
        cmocka_unit_test(case_23_frustum_of_equal_radii_is_the_cylinder),
        cmocka_unit_test(case_24_in_the_plane_of_a_cap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
