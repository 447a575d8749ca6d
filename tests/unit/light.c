/*
 * What lights send to a point, and what a Phong surface makes of it: by hand.
 */
#include "trace/light.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "math/elementary.h"
#include "tests/phong.h"
#include "tests/random.h"

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

static void directional_light_is_everywhere_alike(void **state)
{
    (void)state;
    struct plan_light sun = {.kind = LIGHT_DIRECTIONAL, .color = {1, 2, 3}, .direction = {0, -1, 0}};
    struct light_arrival arrival;
    assert_true(light_arrive(&sun, vec3_make(5, 6, 7), &arrival));
    assert_true(arrival.direction.y == 1 && isinf(arrival.distance));
    assert_true(arrival.strength.x == 1 && arrival.strength.y == 2 && arrival.strength.z == 3);
}

static void point_light_falls_off_as_told(void **state)
{
    (void)state;
    struct plan_light lamp = {
        .kind = LIGHT_POINT, .color = {100, 50, 0}, .position = {0, 3, 4}, .falloff = {1, 2, 3}};
    struct light_arrival arrival;
    assert_true(light_arrive(&lamp, vec3_make(0, 0, 0), &arrival));
    assert_true(arrival.distance == 5);
    assert_true(is_near(arrival.direction.y, 0.6, DBL_EPSILON) &&
                is_near(arrival.direction.z, 0.8, DBL_EPSILON));
    assert_true(is_near(arrival.strength.x, 100.0 / 86, 1e-15 * 2)); /* 1 + 2 · 5 + 3 · 25 */
    assert_true(is_near(arrival.strength.y, 50.0 / 86, 1e-15) && arrival.strength.z == 0);
    assert_false(light_arrive(&lamp, lamp.position, &arrival));
}

static struct plan_light spot_down(double outer, double inner)
{
    return (struct plan_light){.kind = LIGHT_SPOT,
                               .color = {1, 1, 1},
                               .position = {0, 1, 0},
                               .direction = {0, -1, 0},
                               .falloff = {1, 0, 0},
                               .outer_cosine = math_cos_degrees(outer),
                               .inner_cosine = math_cos_degrees(inner)};
}

/* The strength on the ground at `degrees` from a spot light's axis. */
static double spot_strength(const struct plan_light *spot, double degrees)
{
    struct light_arrival arrival;
    struct vec3 ground = {math_sin_degrees(degrees) / math_cos_degrees(degrees), 0, 0};
    return light_arrive(spot, ground, &arrival) ? arrival.strength.x : 0;
}

/* Hard case 41. */
static void spot_has_its_edge_where_it_says(void **state)
{
    (void)state;
    struct plan_light hard = spot_down(30, 30), soft = spot_down(30, 20);
    for (double degrees = 0; degrees < 60; degrees += 0.125) {
        if (degrees == 30)
            continue;
        assert_true(spot_strength(&hard, degrees) == (degrees < 30));
        double strength = spot_strength(&soft, degrees);
        assert_true(degrees > 20 || strength == 1);
        assert_true(degrees < 30 || strength == 0);
        assert_true(degrees <= 20 || degrees >= 30 || (strength > 0 && strength < 1));
        assert_true(spot_strength(&soft, degrees + 0.125) <= strength);
    }
    assert_true(spot_strength(&hard, 30 - 1e-12) == 1 && spot_strength(&hard, 30 + 1e-12) == 0);
    /* Exactly on the edge: an angle of 60 degrees by a right triangle with exact sides has cosine 0.6 here. */
    struct plan_light exact = spot_down(30, 30);
    struct light_arrival arrival;
    exact.position = vec3_make(0, 3, 0);
    exact.outer_cosine = exact.inner_cosine = 0.6;
    assert_true(light_arrive(&exact, vec3_make(4, 0, 0), &arrival));
    exact.outer_cosine = exact.inner_cosine = nextafter(0.6, 1);
    assert_false(light_arrive(&exact, vec3_make(4, 0, 0), &arrival));
    /* Halfway between the cosines the smooth step is one half. */
    struct plan_light wide = spot_down(90, 0);
    assert_true(is_near(spot_strength(&wide, 60), 0.5, 1e-15));
}

static const struct plan_material shiny = {.diffuse = 0.5,
                                           .shininess = 3,
                                           .specular = {0.25, 0.5, 1},
                                           .surface_share = {1, 0.5, 0},
                                           .traits = TRAIT_HIGHLIGHTS};

static void phong_by_hand(void **state)
{
    (void)state;
    struct vec3 up = {0, 1, 0}, color = {0.5, 0.5, 0.5}, down = {0, -1, 0};
    struct vec3 light = {0, math_cos_degrees(60), math_sin_degrees(60)};
    struct vec3 seen = phong(&shiny, color, up, down, light);
    /* Diffuse 0.5 · 0.5 · cos 60° × share; mirrored light is 60° off the eye: 0.5³ of the highlight. */
    assert_true(is_near(seen.x, 0.125 + 0.25 * 0.125, 1e-15));
    assert_true(is_near(seen.y, 0.0625 + 0.5 * 0.125, 1e-15));
    assert_true(is_near(seen.z, 0.125, 1e-15));
    /* Looked at along the mirrored light: the whole highlight. */
    struct vec3 into_mirror = {0, -math_cos_degrees(60), math_sin_degrees(60)};
    assert_true(is_near(phong(&shiny, color, up, into_mirror, light).z, 1, 1e-15));
    /* Away from it: none. Light from behind: nothing at all. */
    assert_true(phong(&shiny, color, up, vec3_neg(vec3_make(0, 0.1, 0.99)), light).z == 0);
    assert_true(vec3_is_zero(phong(&shiny, color, up, down, vec3_make(0, -1, 0))));
    assert_true(vec3_is_zero(phong(&shiny, color, up, down, vec3_make(1, 0, 0))));
}

/* The highlight is never above specular, the diffuse part never above colour × diffuse × share. */
static void phong_is_bounded(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 n = random_unit(i, 0), d = random_unit(i, 3), l = random_unit(i, 6);
        struct vec3 seen = phong(&shiny, vec3_make(1, 1, 1), n, d, l);
        assert_true(seen.x >= 0 && seen.y >= 0 && seen.z >= 0);
        assert_true(seen.x <= 0.75 + 1e-14 && seen.y <= 0.75 + 1e-14 && seen.z <= 1 + 1e-14);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directional_light_is_everywhere_alike),
        cmocka_unit_test(point_light_falls_off_as_told),
        cmocka_unit_test(spot_has_its_edge_where_it_says),
        cmocka_unit_test(phong_by_hand),
        cmocka_unit_test(phong_is_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
