/*
 * Hard cases 40 to 43: lights, and textures at their edges.
 */
#include "math/elementary.h"
#include "tests/numeric/bounce.h"
#include "trace/light.h"

/* --- light ------------------------------------------------------------------------------------------------ */

/* A white floor at y = 0 under a sphere of radius 1 around (0, 2, 0), and a light. */
static struct scene scene_of_lamp(struct vec3 light)
{
    struct scene scene = scene_at(vec3_make(0, 0, 0), 1);
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
    scene_add(&scene, shape_sphere(vec3_make(0, 2, 0), 1), material_matte(grey(1)));
    scene_add_light(&scene, light_point(light, grey(1)));
    return scene;
}

static void case_40_light_inside_and_on_a_solid(void **state)
{
    (void)state;
    struct scene inside = scene_of_lamp(vec3_make(0.1, 2.3, -0.2));
    for (uint32_t i = 0; i < 300; i++) {
        struct vec3 floor = {random_between(i, 0, -9, 9), 0, random_between(i, 1, -9, 9)};
        assert_true(look(&inside, vec3_add(floor, vec3_make(5, 0.5, 5)), floor) == 0);
        struct vec3 middle = {0, 2, 0}, beside = vec3_add_scaled(middle, random_unit(i, 2), 1.9);
        assert_true(look(&inside, beside, middle) == 0);
    }
    assert_true(look(&inside, vec3_make(0, 2.1, 0), vec3_make(0, 1, 0.1)) > 0.5); /* the wall from inside */
    scene_finish(&inside);
    for (uint32_t i = 0; i < 500; i++) { /* on the sphere, to within rounding: what the light faces is lit */
        struct vec3 n = random_unit(i, 5);
        struct vec3 floor = {random_between(i, 8, -3, 3), 0, random_between(i, 9, -3, 3)};
        n.y = -fabs(n.y);
        struct vec3 light = vec3_add(vec3_make(0, 2, 0), n), to = vec3_sub(floor, light);
        if (vec3_dot(n, to) < 0.01 * vec3_length(to))
            continue;
        struct scene scene = scene_of_lamp(light);
        double expected = light.y / vec3_length(to);
        double found = look(&scene, vec3_add(floor, vec3_make(3, 0.5, 4)), floor);
        assert_true(fabs(found - expected) <= 1e-12);
        scene_finish(&scene);
    }
    /* On the floor: it lights what is above, and the floor neither from below nor along itself. */
    struct scene on_floor = scene_of_lamp(vec3_make(5, 0, 0));
    assert_true(look(&on_floor, vec3_make(5, 3, 1), vec3_make(5, 0, 0)) == 0);
    assert_true(look(&on_floor, vec3_make(5, 3, 1), vec3_make(6, 0, 0)) == 0);
    assert_true(look(&on_floor, vec3_make(9, 3, 0), vec3_make(0.9, 1.9, 0)) > 0.1);
    scene_finish(&on_floor);
}

static void case_41_spot_edge(void **state)
{
    (void)state;
    static const double edges[] = {1, 30, 60, 89, 90};
    for (size_t k = 0; k < 5; k++) {
        struct plan_light light = {.kind = LIGHT_SPOT,
                                   .color = grey(1),
                                   .direction = {0, -1, 0},
                                   .falloff = {1, 0, 0},
                                   .outer_cosine = math_cos_degrees(edges[k]),
                                   .inner_cosine = math_cos_degrees(edges[k])};
        unsigned lit[2] = {0, 0};
        for (uint32_t i = 0; i < 4000; i++) {
            double angle = edges[k] + (i % 2 ? 1e-9 : 1e-14) * random_signed(i, 0);
            double turn = random_between(i, 1, 0, 360);
            double sine = math_sin_degrees(angle), length = random_between(i, 2, 0.1, 50);
            struct vec3 p = {sine * math_cos_degrees(turn), -math_cos_degrees(angle),
                             sine * math_sin_degrees(turn)};
            struct light_arrival arrival = {0};
            bool lights = light_arrive(&light, vec3_scale(p, length), &arrival);
            assert_int_equal(lights, -vec3_dot(arrival.direction, light.direction) >= light.outer_cosine);
            assert_true(fabs(angle - edges[k]) < 1e-10 || lights == (angle < edges[k]) || edges[k] < 2);
            lit[lights]++;
        }
        assert_true(lit[0] > 500 && lit[1] > 500);
    }
    struct plan_light half = {
        .kind = LIGHT_SPOT, .color = grey(1), .direction = {0, -1, 0}, .falloff = {1, 0, 0}};
    struct light_arrival arrival;
    assert_true(light_arrive(&half, vec3_make(3, 0, 4), &arrival)); /* 90 degrees: 0 is the cutoff's cosine */
}

/* --- textures --------------------------------------------------------------------------------------------- */

/* The colour at the point where a ray meets the world, not filtered. */
static struct vec3 color_at(const struct world *world, struct vec3 origin, struct vec3 direction)
{
    struct ray ray = ray_from(world, origin, direction);
    struct hit hit = shoot_ray(world, &ray);
    assert_true(hit.id != PRIMITIVE_NONE);
    struct surface surface = surface_at(world->plan, &ray, &hit);
    return surface_color(world->plan, &hit, &surface, NULL);
}

static void case_42_checker_at_integers(void **state)
{
    (void)state;
    struct material material = material_matte(grey(1));
    material.color = (struct texture){.kind = TEXTURE_CHECKER, .color = {grey(0), grey(1)}, .size = 1};
    static const double places[] = {-2,    -1.5, -1,        -1 + 1e-12, -0.5, -1e-12, 0,
                                    1e-12, 0.5,  1 - 1e-12, 1,          1.5,  2,      1e15 + 1};
    /* The plane's own height is an integer, too, and must not count. */
    for (int height = -1; height <= 1; height++) {
        struct world world = world_made_of(shape_plane(vec3_make(0, height, 0), vec3_make(0, 1, 0)), material);
        for (size_t i = 0; i < sizeof places / sizeof *places; i++)
            for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
                double x = places[i], z = places[k], parity = fmod(fabs(floor(x) + floor(z)), 2);
                assert_true(color_at(&world, vec3_make(x, height + 2, z), vec3_make(0, -1, 0)).x == parity);
            }
        for (uint32_t i = 0; i < 3000; i++) {
            struct vec3 at = {random_between(i, 0, -40, 40), height, random_between(i, 1, -40, 40)};
            struct vec3 d = random_unit(i, 2);
            d.y = -fabs(d.y) - 0.1;
            double parity = fmod(fabs(floor(at.x) + floor(at.z)), 2);
            if (fabs(at.x - nearbyint(at.x)) > 1e-12 && fabs(at.z - nearbyint(at.z)) > 1e-12)
                assert_true(color_at(&world, vec3_add_scaled(at, d, -7), d).x == parity);
        }
        world_end(&world);
    }
}

/* A sphere that wears (cos, sin) of the longitude and the latitude. */
static struct world world_of_map(void)
{
    enum { WIDTH = 128, HEIGHT = 64 };
    static float rgb[HEIGHT][WIDTH][3];
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double angle = 6.283185307179586 * (x + 0.5) / WIDTH;
            rgb[y][x][0] = (float)(0.5 + 0.5 * cos(angle));
            rgb[y][x][1] = (float)(0.5 + 0.5 * sin(angle));
            rgb[y][x][2] = (float)((y + 0.5) / HEIGHT);
        }
    struct world world = world_begin(vec3_make(0, 0, 0));
    struct material material = material_matte(grey(1));
    size_t image = scene_add_image(&world.scene, WIDTH, HEIGHT, &rgb[0][0][0]);
    material.color = (struct texture){.kind = TEXTURE_IMAGE,
                                      .map = MAP_SPHERE,
                                      .repeat_u = 1,
                                      .repeat_v = 1,
                                      .image = {image, image, image, image, image, image}};
    scene_add(&world.scene, shape_sphere(vec3_make(0, 0, 0), 1), material);
    world_compile(&world);
    return world;
}

/* Between texels 1/128 of the turn apart, linear interpolation is off by up to (2π / 128)² / 16, which is 1.5e-4;
 * texels are floats. */
static void check_color(struct vec3 found, double red, double green, double blue)
{
    assert_true(fabs(found.x - red) < 2e-4 && fabs(found.y - green) < 2e-4 && fabs(found.z - blue) < 1e-6);
}

static void case_43_uv_at_poles_and_seam(void **state)
{
    (void)state;
    struct world world = world_of_map();
    check_color(color_at(&world, vec3_make(0, 0, 3), vec3_make(0, 0, -1)), 0, 0.5, 0.5); /* +z: u = 1/2 */
    check_color(color_at(&world, vec3_make(3, 0, 0), vec3_make(-1, 0, 0)), 0.5, 0, 0.5); /* +x: u = 3/4 */
    check_color(color_at(&world, vec3_make(-3, 0, 0), vec3_make(1, 0, 0)), 0.5, 1, 0.5); /* −x: u = 1/4 */
    for (int pole = -1; pole <= 1; pole += 2)
        for (uint32_t i = 0; i < 500; i++) { /* straight at a pole, and around it down to 1e-300 */
            struct vec3 o = {0, 3 * pole, 0};
            if (i > 0) {
                o.x = pow(10, random_between(i, 0, -300, -3)) * random_signed(i, 1);
                o.z = pow(10, random_between(i, 2, -300, -3)) * random_signed(i, 3);
            }
            struct vec3 c = color_at(&world, o, vec3_make(0, -pole, 0));
            assert_true(c.x >= 0 && c.x <= 1 && c.y >= 0 && c.y <= 1 && fabs(c.z - (pole < 0)) < 0.02);
        }
    for (uint32_t i = 0; i < 500; i++) { /* either side of the seam at −z */
        double y = random_between(i, 4, -0.9, 0.9), x = i ? pow(10, random_between(i, 5, -300, -6)) : 0;
        struct vec3 left = color_at(&world, vec3_make(x, y, -3), vec3_make(0, 0, 1));
        struct vec3 right = color_at(&world, vec3_make(-x, y, -3), vec3_make(0, 0, 1));
        assert_true(vec3_max_abs(vec3_sub(left, right)) < 1e-4);
        check_color(left, 1, 0.5, acos(y) / 3.141592653589793);
    }
    world_end(&world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_40_light_inside_and_on_a_solid),
        cmocka_unit_test(case_41_spot_edge),
        cmocka_unit_test(case_42_checker_at_integers),
        cmocka_unit_test(case_43_uv_at_poles_and_seam),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
