/*
 * Small pictures whose values physics or geometry gives in closed form.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "math/elementary.h"
#include "tests/random.h"
#include "tests/scene_builder.h"

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

static bool same_pictures(const struct vec3 *a, const struct vec3 *b, const struct scene *scene)
{
    return memcmp(a, b, (size_t)scene->width * scene->height * sizeof *a) == 0;
}

static struct material checkered(double size)
{
    struct material material = material_matte(grey(1));
    material.color =
        (struct texture){.kind = TEXTURE_CHECKER, .color = {{0.9, 0.8, 0.7}, {0.1, 0.2, 0.3}}, .size = size};
    material.ambient = 0.3;
    return material;
}

/* A checkered floor at y = 0 under a point light and a sun. */
static struct scene floor_scene(void)
{
    struct scene scene = scene_at(vec3_make(1.3, 3.1, 5.7), 40);
    scene.depth = 24;
    scene.background = (struct background){.kind = BACKGROUND_CONSTANT, .color = {{0.2, 0.3, 0.4}}};
    scene_add(&scene, shape_plane(vec3_make(0.1, 0, 0.7), vec3_make(0, 1, 0)), checkered(0.5));
    scene_add_light(&scene, light_point(vec3_make(3, 8, 2), grey(0.5)));
    scene_add_light(&scene, light_directional(vec3_make(1, -2, -1), grey(0.25)));
    return scene;
}

/* --- what must not be seen -------------------------------------------------------------------------------- */

/* Hard case 37. */
static void glass_of_index_one_is_invisible(void **state)
{
    (void)state;
    struct scene with = floor_scene(), without = floor_scene();
    struct material nothing = material_glass(1, grey(0)), red = material_matte(vec3_make(1, 0, 0));
    scene_add(&with, shape_sphere(vec3_make(0.3, 1, 0.2), 0.9), nothing);
    scene_add(&with, shape_box(vec3_make(-1, 0.2, -1), vec3_make(1, 1, 2)), nothing);
    scene_add(&with, shape_globe(vec3_make(0, 0.5, 0), 1.2, 5, 6), nothing);
    scene_add(&with, shape_frustum(vec3_make(0, 0.1, 0), vec3_make(0, 2, 1), 0.7, 0), nothing);
    scene_add(&with, shape_sphere(vec3_make(0, 0.4, 0), 0.4), red);
    scene_add(&without, shape_sphere(vec3_make(0, 0.4, 0), 0.4), red);
    struct vec3 *a = scene_render(&with, kernel_default(), NULL),
                *b = scene_render(&without, kernel_default(), NULL);
    assert_true(same_pictures(a, b, &with));
    free(a);
    free(b);
    scene_finish(&with);
    scene_finish(&without);
}

/* A pane of two triangles darkens once, also where a ray meets their common edge exactly. */
static void a_panes_diagonal_does_not_show(void **state)
{
    (void)state;
    static const struct vec3 points[4] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static const uint32_t index[6] = {0, 1, 2, 0, 2, 3};
    struct scene scene = scene_at(vec3_make(0, 0, 4), 20);
    scene.background.color[0] = grey(1);
    scene_add(&scene, shape_mesh(points, 4, index, 2, false), material_filter(grey(0.5)));
    struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
    for (uint32_t i = 0; i < scene.width * scene.height; i++)
        assert_true(pixels[i].x == 0.5);
    free(pixels);
    scene_finish(&scene);
}

/* Glass that touches the floor, or other glass, looks like glass that dips into it by next to nothing. */
static void touching_glass_shows_no_noise(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        struct vec3 *pixels[2];
        struct scene scene;
        for (int dips = 0; dips < 2; dips++) {
            double y = dips ? -1e-7 : 0;
            struct vec3 low = {-1.1, y, -1.3}, high = {1.2, 1.4 + y, 1.4};
            struct material glass = material_glass(1.5, vec3_make(0.2, 0.1, 0));
            scene = floor_scene();
            if (kind == 0)
                scene_add(&scene, shape_box(low, high), glass);
            if (kind == 1)
                scene_add(&scene, shape_frustum(vec3_make(0.1, y, 0.2), vec3_make(0.1, 1.4, 0.2), 1.2, 1),
                          glass);
            if (kind == 2)
                scene_add(&scene, shape_box_mesh(low, high), glass);
            if (kind == 3) {
                scene_add(&scene, shape_box(low, vec3_make(1.2, 0.7, 1.4)), glass);
                scene_add(&scene, shape_box(vec3_make(-1.1, 0.7 + y, -1.3), high),
                          material_glass(1.3, grey(0.1)));
            }
            pixels[dips] = scene_render(&scene, kernel_default(), NULL);
            if (!dips)
                scene_finish(&scene);
        }
        for (uint32_t i = 0; i < scene.width * scene.height; i++)
            assert_true(vec3_max_abs(vec3_sub(pixels[0][i], pixels[1][i])) < 1e-4);
        free(pixels[0]);
        free(pixels[1]);
        scene_finish(&scene);
    }
}

/* --- filters and shadows ---------------------------------------------------------------------------------- */

/* Hard case 44, in the line of sight and in a shadow. */
static void filters_multiply_in_any_order(void **state)
{
    (void)state;
    struct vec3 *pictures[2];
    struct scene scene;
    for (int order = 0; order < 2; order++) {
        scene = scene_at(vec3_make(0, 0, 4), 20);
        scene.background.color[0] = grey(1);
        for (int i = 0; i < 2; i++) {
            double z = i == order ? 1 : -1;
            scene_add(&scene, shape_disc(vec3_make(0, 0, z), vec3_make(0, 0, 1), 9),
                      material_filter(z > 0 ? vec3_make(0.5, 0.3, 0.7) : vec3_make(0.5, 0.7, 0.1)));
        }
        pictures[order] = scene_render(&scene, kernel_default(), NULL);
        assert_true(pictures[order][0].x == 0.25 && is_near(pictures[order][0].y, 0.21, DBL_EPSILON));
        if (order == 0)
            scene_finish(&scene);
    }
    assert_true(same_pictures(pictures[0], pictures[1], &scene));
    free(pictures[0]);
    free(pictures[1]);
    scene_finish(&scene);
}

static void shadows_take_the_filters_colour(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 4, 4), 1);
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
    scene_add(&scene, shape_disc(vec3_make(0, 1, 0), vec3_make(0, 1, 0), 0.5),
              material_filter(vec3_make(0.5, 0.25, 1)));
    struct material half = material_filter(vec3_make(0.5, 1, 0.5));
    half.transparency = 0.5;
    scene_add(&scene, shape_disc(vec3_make(0, 2, 0), vec3_make(0, -1, 0), 0.5), half);
    scene_add_light(&scene, light_directional(vec3_make(0, -1, 0), grey(1)));
    struct vec3 seen = scene_look(&scene);
    assert_true(is_near(seen.x, 0.125, 1e-15) && is_near(seen.y, 0.125, 1e-15) && is_near(seen.z, 0.25, 1e-15));
    scene.objects[2].material = 0; /* opaque: all dark */
    assert_true(vec3_is_zero(scene_look(&scene)));
    scene_finish(&scene);
}

/* Every pixel of a plane and a sphere under the sun is lit or dark as geometry says, but for those at a
 * shadow's edge. */
static void shadows_fall_where_geometry_says(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(1.3, 3.1, 5.7), 40);
    struct vec3 center = {0.1, 0.9, 0.2}, sun = vec3_normalize(vec3_make(-1, 2, 1));
    double radius = 0.9;
    scene.width = scene.height = 128;
    scene.ambient = grey(0);
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
    scene_add(&scene, shape_sphere(center, radius), material_matte(grey(1)));
    scene_add_light(&scene, light_directional(vec3_neg(sun), grey(1)));
    struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    unsigned lit = 0, dark = 0;
    for (uint32_t i = 0; i < 128 * 128; i++) {
        const struct plan_camera *camera = &plan->camera;
        struct vec3 d = vec3_add_scaled(camera->corner, camera->right, i % 128 + 0.5), n = {0, 1, 0};
        d = vec3_normalize(vec3_add_scaled(d, camera->down, i / 128 + 0.5));
        struct vec3 o = vec3_sub(plan->eye, center), p = vec3_add_scaled(plan->eye, d, -plan->eye.y / d.y);
        double along = -vec3_dot(o, d), square = radius * radius - vec3_dot(o, o) + along * along, light;
        if (square > 0) {
            n = vec3_scale(vec3_add_scaled(o, d, along - sqrt(square)), 1 / radius);
            light = vec3_dot(n, sun);
            light = light > 0 ? light : 0;
        } else {
            struct vec3 to = vec3_sub(center, p);
            double miss = vec3_length(vec3_cross(to, sun)) - radius;
            if (fabs(miss) < 1e-9)
                continue;
            light = miss > 0 ? sun.y : 0;
        }
        assert_true(is_near(pixels[i].x, light, 1e-12));
        lit += light > 0;
        dark += light == 0;
    }
    assert_true(lit > 5000 && dark > 500);
    free(pixels);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Hard case 40, first half. */
static void a_light_inside_a_solid_stays_there(void **state)
{
    (void)state;
    const struct shape hulls[] = {shape_sphere(vec3_make(0, 1, 0), 0.5),
                                  shape_box(vec3_make(-0.5, 0.5, -0.5), vec3_make(0.5, 1.5, 0.5)),
                                  shape_frustum(vec3_make(0, 0.5, 0), vec3_make(0, 2, 0), 0.5, 0.2),
                                  shape_globe(vec3_make(0, 1, 0), 0.5, 5, 6)};
    for (size_t i = 0; i < 4; i++) {
        struct scene scene = scene_at(vec3_make(1.3, 3.1, 5.7), 60);
        scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
        scene_add(&scene, hulls[i], material_matte(grey(1)));
        scene_add_light(&scene, light_point(vec3_make(0, 1, 0), grey(1)));
        struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
        for (uint32_t k = 0; k < scene.width * scene.height; k++)
            assert_true(vec3_is_zero(pixels[k]));
        free(pixels);
        scene_finish(&scene);
    }
}

/* Hard case 40, second half: a light on a surface is not shadowed by that surface, from wherever it is seen. */
static void a_light_on_a_surface_is_not_shadowed_by_it(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 60; i++) {
        struct vec3 n = random_unit(i, 0), point = random_vector(i, 3), *pictures[2];
        struct scene scene;
        for (int on_surface = 0; on_surface < 2; on_surface++) {
            scene = scene_at(vec3_scale(random_unit(i, 6), 9), 70);
            struct vec3 room_center = vec3_add_scaled(point, n, 3);
            scene_add(&scene, shape_sphere(room_center, 8), material_matte(grey(1)));
            scene_add_light(&scene, light_point(point, grey(1)));
            struct vec3 behind = vec3_add_scaled(point, n, -1);
            if (i % 2)
                scene_add(&scene, shape_plane(point, n), material_filter(grey(1)));
            else
                scene_add(&scene, shape_sphere(behind, 1), material_filter(grey(1)));
            if (on_surface)
                scene.materials[1] = material_matte(grey(0));
            scene.camera.from = vec3_add_scaled(room_center, n, 2);
            scene.camera.at = vec3_add_scaled(room_center, random_unit(i, 9), 2.1);
            pictures[on_surface] = scene_render(&scene, kernel_default(), NULL);
            if (!on_surface)
                scene_finish(&scene);
        }
        /* The wall in front of the surface's tangent plane is lit as if the surface were not there. */
        struct trace_settings settings = settings_of(&scene);
        struct plan *plan = plan_create(&scene, &settings, 1);
        for (uint32_t k = 0; k < scene.width * scene.height; k++) {
            struct vec3 d = vec3_add_scaled(plan->camera.corner, plan->camera.right, k % 32 + 0.5);
            d = vec3_normalize(vec3_add_scaled(d, plan->camera.down, k / 32 + 0.5));
            double b = vec3_dot(vec3_scale(n, 2), d), t = -b + sqrt(b * b + 60);
            struct vec3 wall = vec3_add_scaled(plan->eye, d, t);
            if (vec3_dot(vec3_sub(wall, point), n) > 0.01)
                assert_true(vec3_max_abs(vec3_sub(pictures[0][k], pictures[1][k])) == 0);
        }
        plan_destroy(&plan);
        free(pictures[0]);
        free(pictures[1]);
        scene_finish(&scene);
    }
}

/* --- energy ----------------------------------------------------------------------------------------------- */

/* Hard case 38: in a room that is evenly white all things that absorb nothing look white, but for what is cut
 * off. */
static void white_room_stays_white(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(1, 2, 5), 50);
    struct material mirror = material_mirror(grey(0.7)), pane = material_filter(grey(1));
    mirror.color = pane.color = texture_plain(grey(1));
    mirror.ambient = pane.ambient = 1;
    pane.transparency = 0.5;
    pane.reflection = grey(0.25);
    scene.depth = SCENE_DEPTH_MAX;
    scene_add(&scene, shape_sphere(vec3_make(0, 0, 0), 20), material_glowing(grey(1)));
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 1), material_glass(1.5, grey(0)));
    scene_add(&scene, shape_sphere(vec3_make(1, 0, 0.5), 1), mirror);
    scene_add(&scene, shape_sphere(vec3_make(0, 1.5, 0), 0.7), material_glass(2.4, grey(0)));
    scene_add(&scene, shape_box(vec3_make(0, -2, 1), vec3_make(1, -1, 2)), pane);
    struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
    for (uint32_t i = 0; i < scene.width * scene.height; i++) {
        assert_true(vec3_max(pixels[i]) <= 1 + 1e-13);
        assert_true(pixels[i].x > 0.99); /* the paths below THROUGHPUT_MIN */
    }
    free(pixels);
    scene_finish(&scene);
}

/* Hard case 39: 1 − r of each reflection's own white, summed to the depth limit. */
static void facing_mirrors_make_a_geometric_series(void **state)
{
    (void)state;
    struct material mirror = material_mirror(grey(0.9));
    mirror.color = texture_plain(grey(1));
    mirror.ambient = 1;
    for (uint32_t depth = 0; depth <= 40; depth += 8) {
        struct scene scene = scene_at(vec3_make(0, 0, 1), 10);
        scene.depth = depth;
        scene_add(&scene, shape_plane(vec3_make(0, 0, -2), vec3_make(0, 0, 1)), mirror);
        scene_add(&scene, shape_plane(vec3_make(0, 0, 3), vec3_make(0, 0, -1)), mirror);
        assert_true(is_near(scene_look(&scene).x, 1 - math_pow(0.9, depth + 1), 1e-14));
        scene_finish(&scene);
    }
}

/* exp(−absorption × length), along the line of sight, from inside, and in a shadow through a slab. */
static void absorption_follows_beer_and_lambert(void **state)
{
    (void)state;
    struct vec3 absorption = {0.1, 0.5, 2};
    struct scene scene = scene_at(vec3_make(0, 0, 5), 1);
    scene.background.color[0] = grey(1);
    scene_add(&scene, shape_box(vec3_make(-2, -2, -1.5), vec3_make(2, 2, 1)), material_glass(1, absorption));
    struct vec3 seen = scene_look(&scene);
    assert_true(is_near(seen.x, exp(-0.25), 1e-11) &&
                is_near(seen.z, exp(-5), 1e-11)); /* COINCIDENCE × length */
    scene.camera.from = vec3_make(0, 0, 0.5);
    assert_true(is_near(scene_look(&scene).y, exp(-1), 1e-11));
    /* Panes in it divide the way without changing it. */
    scene_add(&scene, shape_disc(vec3_make(0, 0, -0.5), vec3_make(0, 0, 1), 1), material_filter(grey(1)));
    scene_add(&scene, shape_disc(vec3_make(0, 0, -0.7), vec3_make(0, 0, 1), 1), material_filter(grey(1)));
    assert_true(is_near(scene_look(&scene).y, exp(-1), 1e-11));
    scene_finish(&scene);

    scene = scene_at(vec3_make(0, 1, 4), 1);
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
    scene_add(&scene, shape_box(vec3_make(-1, 2, -1), vec3_make(1, 5, 1)), material_glass(1, absorption));
    scene_add_light(&scene, light_directional(vec3_make(0, -1, 0), grey(1)));
    seen = scene_look(&scene);
    assert_true(is_near(seen.x, exp(-0.3), 1e-11) && is_near(seen.y, exp(-1.5), 1e-11));
    scene.lights[0] = light_point(vec3_make(0, 3, 0), grey(1)); /* the light inside the slab */
    assert_true(is_near(scene_look(&scene).y, exp(-0.5), 1e-11));
    scene.materials[1].ior = 1.5; /* and Fresnel's share at the one wall on the way */
    assert_true(is_near(scene_look(&scene).y, 0.96 * exp(-0.5), 1e-11));
    scene_finish(&scene);
}

/* --- filters of pixels ------------------------------------------------------------------------------------ */

/* The share of the filter around a pixel that lies before a line `x` pixels from the pixel's left side. */
static double share_before(double x, enum pixel_filter filter)
{
    double low = filter == FILTER_TENT ? -0.5 : 0, high = 1 - low;
    x = x < low ? low : x > high ? high : x;
    if (filter == FILTER_BOX)
        return x;
    return x < 0.5 ? (x - low) * (x - low) / 2 : 1 - (high - x) * (high - x) / 2;
}

/* A wall's vertical edge in front of white. Samples of which one lies in each of SAMPLES strata of equal share miss the
 * share before the edge by less than one of them. */
static void check_edge(enum pixel_filter filter, double edge)
{
    enum { SAMPLES = 256 };
    struct scene scene = scene_at(vec3_make(0, 0, 4), 20);
    scene.samples = SAMPLES;
    scene.filter = filter;
    scene.background.color[0] = grey(1);
    scene_add(&scene, shape_box(vec3_make(-9, -9, -1), vec3_make(edge, 9, 0)), material_glowing(grey(0)));
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    double line = scene.width / 2.0 + edge / 4 / plan->camera.right.x; /* pixels from the left */
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *pixels = plan_render(plan, kernel_at(k), SAMPLES, NULL);
        for (uint32_t i = 0; i < scene.width * scene.height; i++) {
            double expected = 1 - share_before(line - i % scene.width, filter);
            assert_true(is_near(pixels[i].x, expected, 1.0 / SAMPLES));
        }
        free(pixels);
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* The tent's ramp across it is two pixels wide, the box's one. */
static void edges_are_as_soft_as_the_filter(void **state)
{
    (void)state;
    for (double edge = 0; edge < 0.3; edge += 0.0123) {
        check_edge(FILTER_BOX, edge);
        check_edge(FILTER_TENT, edge);
    }
}

/* --- scale ------------------------------------------------------------------------------------------------ */

static struct scene scaled_scene(double s)
{
    struct scene scene = scene_at(vec3_make(1.3 * s, 3.1 * s, 5.7 * s), 40);
    struct material glass = material_glass(1.5, vec3_make(0.3 / s, 0.1 / s, 0)),
                    mirror = material_mirror(grey(0.5));
    mirror.color = texture_plain(grey(0.7));
    scene.samples = 4;
    scene.background =
        (struct background){.kind = BACKGROUND_GRADIENT, .color = {{0.1, 0.1, 0.2}, {0.4, 0.6, 0.9}}};
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), checkered(0.5 * s));
    scene_add(&scene, shape_sphere(vec3_make(-1 * s, 0.8 * s, 0), 0.8 * s), glass);
    scene_add(&scene, shape_box(vec3_make(0.2 * s, 0, -0.6 * s), vec3_make(1 * s, 0.9 * s, 0.3 * s)), mirror);
    scene_add(&scene, shape_frustum(vec3_make(0, 0, 1.3 * s), vec3_make(0.1 * s, 0.7 * s, 1.3 * s), 0.4 * s, 0),
              glass);
    scene_add(&scene, shape_globe(vec3_make(1.1 * s, 0.3 * s, 1.2 * s), 0.3 * s, 5, 6), mirror)
        ->transform.linear.x.y = 0.25;
    scene_add_light(&scene, light_point(vec3_make(3 * s, 8 * s, 2 * s), grey(0.5)));
    return scene;
}

/* Hard case 9. */
static void a_power_of_two_changes_no_bit(void **state)
{
    (void)state;
    struct scene one = scaled_scene(1);
    struct vec3 *expected = scene_render(&one, kernel_default(), NULL);
    for (int exponent = -20; exponent <= 20; exponent += 40) {
        struct scene scene = scaled_scene(ldexp(1, exponent));
        struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
        assert_true(same_pictures(pixels, expected, &scene));
        free(pixels);
        scene_finish(&scene);
    }
    free(expected);
    scene_finish(&one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glass_of_index_one_is_invisible),
        cmocka_unit_test(a_panes_diagonal_does_not_show),
        cmocka_unit_test(touching_glass_shows_no_noise),
        cmocka_unit_test(filters_multiply_in_any_order),
        cmocka_unit_test(shadows_take_the_filters_colour),
        cmocka_unit_test(shadows_fall_where_geometry_says),
        cmocka_unit_test(a_light_inside_a_solid_stays_there),
        cmocka_unit_test(a_light_on_a_surface_is_not_shadowed_by_it),
        cmocka_unit_test(white_room_stays_white),
        cmocka_unit_test(facing_mirrors_make_a_geometric_series),
        cmocka_unit_test(absorption_follows_beer_and_lambert),
        cmocka_unit_test(edges_are_as_soft_as_the_filter),
        cmocka_unit_test(a_power_of_two_changes_no_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
