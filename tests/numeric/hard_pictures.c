/*
 * Pictures of the scenes in scenes/hard, which break naive arithmetic, against pictures that textbook formulas
 * give in quadruple precision, pixel by pixel; and the showcase moved and scaled, against itself.
 *
 * HARD_PICTURES=FOLDER writes them there as PNG: each as found, as expected, and in red where it is wrong.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/numeric/moved_scene.h"
#include "tests/numeric/oracle_picture.h"
#include "tests/numeric/picture_file.h"
#include "tests/scene_builder.h"
#include "tests/scene_file.h"

/* Half a step of a 16 bit image: what is nearer than this is the same light. */
static const double light_tolerance = 0x1p-17;

/* Flat colours are copied, not computed: what is seen is a matter of yes and no. */
static const double flat_tolerance = 0;

/* How far rounding may turn a ray: the camera's basis, the pixel's direction and the places of things relative
 * to the camera are each rounded a few times. A pixel's size is 10^-10 rad or more here. */
static const double ray_rounding = 4 * DBL_EPSILON;

/* Pixels each way. */
enum { SIDE = 36 };

static struct scene load(const char *path, uint32_t side)
{
    struct scene scene = scene_of_file(path, side, side);
    scene.samples = 1;
    return scene;
}

/* --- against the oracle ----------------------------------------------------------------------------------- */

static double difference(struct vec3 a, struct vec3 b)
{
    struct vec3 off = vec3_sub(a, b);
    return vec3_is_finite(off) ? vec3_max_abs(off) : INFINITY;
}

/* Whether the oracle itself sees `found` from a ray that is turned by no more than rounding may turn it. */
static bool is_on_an_edge(const struct oracle *oracle, struct quad3 direction, struct vec3 found,
                          double tolerance)
{
    struct quad3 u = quad_normalize(quad_cross(direction, quad_of(oracle->scene->camera.up)));
    struct quad3 v = quad_cross(u, direction);
    for (int i = 0; i < 9; i++) {
        struct quad3 turned = quad_add_scaled(direction, u, (i % 3 - 1) * ray_rounding);
        turned = quad_normalize(quad_add_scaled(turned, v, (i / 3 - 1) * ray_rounding));
        if (difference(oracle_look(oracle, turned), found) <= tolerance)
            return true;
    }
    return false;
}

struct tally {
    size_t wrong, edge;
    double worst; /* over the pixels that are not wrong */
};

/* So many pixels can be on edges by chance; more are a fault. */
static const double edge_share = 0.01;

static struct tally compare(const struct oracle *oracle, const struct vec3 *found, const struct vec3 *expected,
                            double tolerance, const char *label)
{
    const struct scene *scene = oracle->scene;
    struct tally tally = {0};
    const size_t edges_max = (size_t)(edge_share * scene->width * scene->height);
    for (uint32_t i = 0; i < scene->width * scene->height; i++) {
        double off = difference(found[i], expected[i]);
        uint32_t x = i % scene->width, y = i / scene->width;
        if (off <= tolerance)
            tally.worst = off > tally.worst ? off : tally.worst;
        else if (tally.wrong + tally.edge < edges_max &&
                 is_on_an_edge(oracle, oracle_direction(scene, x + 0.5, y + 0.5), found[i], tolerance))
            tally.edge++;
        else if (tally.wrong++ < 3)
            print_message("%s: pixel (%u, %u): expected %.17g %.17g %.17g, found %.17g %.17g %.17g\n", label,
                          x, y, expected[i].x, expected[i].y, expected[i].z, found[i].x, found[i].y,
                          found[i].z);
    }
    return tally;
}

static struct vec3 *expected_picture(const struct oracle *oracle)
{
    const struct scene *scene = oracle->scene;
    struct vec3 *pixels = memory_array((size_t)scene->width * scene->height, sizeof *pixels);
    for (uint32_t i = 0; i < scene->width * scene->height; i++) {
        uint32_t x = i % scene->width, y = i / scene->width;
        pixels[i] = oracle_look(oracle, oracle_direction(scene, x + 0.5, y + 0.5));
    }
    return pixels;
}

/* Wrong pixels over all kernels. */
static size_t check(const struct scene *scene, const char *label, double tolerance)
{
    struct oracle oracle = oracle_create(scene);
    struct vec3 *expected = expected_picture(&oracle);
    size_t wrong = 0;
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *found = scene_render(scene, kernel_at(k), NULL);
        struct tally tally = compare(&oracle, found, expected, tolerance, label);
        print_message("%-40s %-6s %5u pixels %5zu wrong %3zu on an edge, others within %.1e\n", label,
                      kernel_at(k)->name, scene->width * scene->height, tally.wrong, tally.edge, tally.worst);
        picture_file_write(scene, label, found, expected, tolerance);
        wrong += tally.wrong;
        free(found);
    }
    free(expected);
    oracle_destroy(&oracle);
    return wrong;
}

/* How a scene is changed by one number, which makes it hard; all zero: as it is. */
struct variation {
    const char *name;
    void (*vary)(struct scene *scene, double value);
};

static size_t check_file(const char *name, uint32_t side, struct variation how, double value, double tolerance)
{
    char path[128], label[128];
    snprintf(path, sizeof path, "scenes/hard/%s.json", name);
    snprintf(label, sizeof label, how.vary ? "%s, %s %g" : "%s", name, how.name, value);
    struct scene scene = load(path, side);
    if (how.vary)
        how.vary(&scene, value);
    size_t wrong = check(&scene, label, tolerance);
    scene_finish(&scene);
    return wrong;
}

/* The scene as it is. */
static size_t check_plain(const char *name, uint32_t side, double tolerance)
{
    return check_file(name, side, (struct variation){0}, 0, tolerance);
}

/* For value = first, first × step, first × step² and so on, `count` of them. */
static size_t check_family(const char *name, struct variation how, double first, double step, int count,
                           double tolerance)
{
    size_t wrong = 0;
    for (int i = 0; i < count; i++, first *= step)
        wrong += check_file(name, SIDE, how, first, tolerance);
    return wrong;
}

/* --- spheres and their like, from afar -------------------------------------------------------------------- */

/* Every object gets a grey of its own, whatever light falls on it. */
static void make_flat(struct scene *scene)
{
    scene->light_count = 0;
    scene->materials = memory_grow(scene->materials, &scene->material_capacity,
                                   scene->material_count + scene->object_count, sizeof *scene->materials);
    for (size_t i = 0; i < scene->object_count; i++) {
        scene->objects[i].material = scene->material_count;
        scene->materials[scene->material_count++] = material_glowing(grey((double)(i + 1) / 8));
    }
}

/* So many units away; the picture is four units wide. */
static void see_from(struct scene *scene, double distance)
{
    scene->camera.from = vec3_make(0.36 * distance, 0.48 * distance, 0.8 * distance);
    scene->camera.fov_degrees = 2 * atan2(2, distance) * (180 / 3.14159265358979323846);
}

static void see_flat_from(struct scene *scene, double distance)
{
    make_flat(scene);
    see_from(scene, distance);
}

static void things_seen_from_afar(void **state)
{
    (void)state;
    static const struct variation flat = {"flat from", see_flat_from}, lit = {"from", see_from};
    size_t wrong = check_family("far", flat, 1e2, 10, 6, flat_tolerance);
    wrong += check_family("far", lit, 1e3, 100, 3, light_tolerance);
    assert_int_equal(wrong, 0);
}

/* --- on a globe ------------------------------------------------------------------------------------------- */

static void stand_on_globe(struct scene *scene, double radius)
{
    scene->objects[0].shape.sphere.center = vec3_make(0, -radius, 0);
    scene->objects[0].shape.sphere.radius = radius;
}

static void stand_flat_on_globe(struct scene *scene, double radius)
{
    make_flat(scene);
    stand_on_globe(scene, radius);
}

/* Where the box's shadow begins, on a globe of radius 10^8. */
static void look_closely(struct scene *scene, double width)
{
    scene->camera.at = vec3_make(-0.5, 0, 0.4);
    scene->camera.from = vec3_make(-1.5, 1, 3);
    scene->camera.fov_degrees = 2 * atan2(width / 2, 3) * (180 / 3.14159265358979323846);
}

static void things_on_a_globe(void **state)
{
    (void)state;
    static const struct variation flat = {"flat, radius", stand_flat_on_globe};
    static const struct variation lit = {"radius", stand_on_globe};
    size_t wrong = check_family("ground", flat, 1e4, 100, 3, flat_tolerance);
    wrong += check_family("ground", lit, 1e3, 10, 6, light_tolerance);
    assert_int_equal(wrong, 0);
}

static void the_ground_of_a_globe_from_near(void **state)
{
    (void)state;
    static const struct variation near = {"width", look_closely};
    assert_int_equal(check_family("ground", near, 1, 0.1, 5, light_tolerance), 0);
}

/* The same from a place that makes the globe's centre, relative to the camera, one that no double can say. */
static void look_closely_aside(struct scene *scene, double width)
{
    look_closely(scene, width);
    scene->camera.from = vec3_make(-1.51, 1.07, 3.13);
}

/* A sphere's roots are good to 2^-53 of its radius, here 10^8: within 10^-7 of a contact that would be too little. */
static void the_ground_of_a_globe_from_nearer(void **state)
{
    (void)state;
    static const struct variation near = {"width", look_closely}, aside = {"aside, width", look_closely_aside};
    size_t wrong = check_family("ground", near, 1e-5, 0.1, 3, light_tolerance);
    wrong += check_family("ground", aside, 1e-5, 0.1, 3, light_tolerance);
    assert_int_equal(wrong, 0);
}

/* --- inside a cylinder, at a cone's apex ------------------------------------------------------------------ */

static void lengthen(struct scene *scene, double length)
{
    scene->objects[0].shape.frustum.top.z = -length;
    scene->objects[2].shape.disc.center.z = -0.9 * length;
}

/* Off the axis and along a generator of the side. */
static void lengthen_and_step_aside(struct scene *scene, double length)
{
    lengthen(scene, length);
    scene->camera.from = vec3_make(0.7, 0.55, 0);
    scene->camera.at = vec3_make(0.7, 0.55, -1);
}

static void open_tube(struct scene *scene, double length)
{
    lengthen_and_step_aside(scene, length);
    make_flat(scene);
    scene->objects[0].shape.frustum.open = true;
}

/* An odd number of pixels: the middle one looks along the axis itself. */
static void inside_a_cylinder(void **state)
{
    (void)state;
    static const struct variation middle = {"length", lengthen};
    static const struct variation aside = {"aside, length", lengthen_and_step_aside};
    static const struct variation open = {"open, length", open_tube};
    size_t wrong = 0;
    for (double length = 1e2; length < 1e9; length *= 1e3) {
        wrong += check_file("tube", SIDE + 1, middle, length, light_tolerance);
        wrong += check_file("tube", SIDE + 1, aside, length, light_tolerance);
        wrong += check_file("tube", SIDE + 1, open, length, flat_tolerance);
    }
    assert_int_equal(wrong, 0);
}

static void see_apex_from(struct scene *scene, double distance)
{
    scene->camera.from = vec3_make(0.6 * distance, 1 + 0.3 * distance, 0.8 * distance);
}

static void see_flat_apex_from(struct scene *scene, double distance)
{
    make_flat(scene);
    see_apex_from(scene, distance);
}

/* Inside the cone, below the apex. */
static void see_apex_from_within(struct scene *scene, double distance)
{
    scene->camera.from = vec3_make(0.1 * distance, 1 - distance, 0.2 * distance);
    scene->lights[0] = light_point(vec3_make(-0.2 * distance, 1 - distance, 0.1 * distance), grey(1));
}

static void the_apex_of_a_cone(void **state)
{
    (void)state;
    static const struct variation flat = {"flat from", see_flat_apex_from}, lit = {"from", see_apex_from};
    static const struct variation within = {"from within", see_apex_from_within};
    size_t wrong = check_family("apex", flat, 5, 0.01, 5, flat_tolerance);
    wrong += check_family("apex", lit, 5, 0.1, 9, light_tolerance);
    wrong += check_family("apex", within, 0.5, 0.01, 4, light_tolerance);
    assert_int_equal(wrong, 0);
}

/* --- far from home ---------------------------------------------------------------------------------------- */

/* far-from-home.json is at 10^8. */
static void move_home_and_away(struct scene *scene, double to)
{
    scene_move(scene, grey(-1e8), false);
    scene_move(scene, grey(to), false);
}

static void move_home_and_away_by_transforms(struct scene *scene, double to)
{
    scene_move(scene, grey(-1e8), false);
    scene_move(scene, grey(to), true);
}

static void things_far_from_home(void **state)
{
    (void)state;
    static const struct variation by_coordinates = {"moved to", move_home_and_away};
    static const struct variation by_transforms = {"moved by", move_home_and_away_by_transforms};
    size_t wrong = check_family("far-from-home", by_coordinates, 1e4, 100, 3, light_tolerance);
    wrong += check_family("far-from-home", by_transforms, 1e3, 1e5, 2, light_tolerance);
    assert_int_equal(wrong, 0);
}

/* --- thin, coplanar --------------------------------------------------------------------------------------- */

static void needles(void **state)
{
    (void)state;
    size_t wrong = check_plain("needles", SIDE, flat_tolerance);
    wrong += check_plain("needle-tip", SIDE, flat_tolerance);
    assert_int_equal(wrong, 0);
}

static void turn_all(struct scene *scene, double degrees)
{
    struct affine turn = affine_rotation(vec3_make(0, 1, 0), degrees);
    for (size_t i = 0; i < scene->object_count; i++)
        scene->objects[i].transform = turn;
}

static const struct variation turned = {"turned", turn_all};

static void of_coplanar_boxes_the_first_wins(void **state)
{
    (void)state;
    size_t wrong = check_plain("coplanar-boxes", SIDE, flat_tolerance);
    wrong += check_family("coplanar-boxes", turned, 20, 2, 2, flat_tolerance);
    assert_int_equal(wrong, 0);
}

static void of_coplanar_shapes_the_first_wins(void **state)
{
    (void)state;
    assert_int_equal(check_plain("coplanar", SIDE, flat_tolerance), 0);
}

/* Turned, the same plane has other last bits in a box, a triangle, a disc and a plane: the plan makes them one. */
static void of_turned_coplanar_shapes_the_first_wins(void **state)
{
    (void)state;
    assert_int_equal(check_family("coplanar", turned, 20, 2, 2, flat_tolerance), 0);
}

static void coincident_filters_both_filter_once(void **state)
{
    (void)state;
    assert_int_equal(check_plain("coincident-filters", SIDE, light_tolerance), 0);
}

/* --- many surfaces ---------------------------------------------------------------------------------------- */

static void a_bubble_in_glass(void **state)
{
    (void)state;
    assert_int_equal(check_plain("bubble", SIDE, light_tolerance), 0);
}

static void water_that_touches_its_glass(void **state)
{
    (void)state;
    assert_int_equal(check_plain("water-in-glass", SIDE / 2, light_tolerance), 0);
}

/* What passes a boundary is tinted by each wall of it, what is mirrored by none. */
static void tint_and_turn(struct scene *scene, double degrees)
{
    scene->materials[scene->objects[0].material].filter = vec3_make(0.9, 0.8, 0.7);
    scene->materials[scene->objects[1].material].filter = vec3_make(1, 0.9, 0.6);
    scene->materials[scene->objects[2].material].filter = vec3_make(0.7, 0.9, 1);
    turn_all(scene, degrees);
}

/* Of air and water, both entered at once from the glass, the water is inside the air, as it comes last. */
static void walls_entered_together_are_one(void **state)
{
    (void)state;
    static const struct variation tinted = {"tinted and turned", tint_and_turn};
    size_t wrong = check_plain("water-in-bubble", SIDE / 2, light_tolerance);
    for (int degrees = 20; degrees <= 60; degrees += 20) {
        wrong += check_file("water-in-bubble", SIDE / 2, turned, degrees, light_tolerance);
        wrong += check_file("water-in-bubble", SIDE / 2, tinted, degrees, light_tolerance);
    }
    assert_int_equal(wrong, 0);
}

static void glass_blocks_face_to_face_are_one(void **state)
{
    (void)state;
    assert_int_equal(check_plain("two-blocks", SIDE, light_tolerance), 0);
}

static void mirrors_that_face_each_other(void **state)
{
    (void)state;
    assert_int_equal(check_plain("mirrors", SIDE / 2, light_tolerance), 0);
}

/* --- the showcase against itself -------------------------------------------------------------------------- */

/* Wrong pixels of each kernel's picture against the first kernel's `expected`. */
static size_t count_different(const struct scene *scene, const struct vec3 *expected, const char *label)
{
    size_t different = 0;
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *found = scene_render(scene, kernel_at(k), NULL);
        for (size_t i = 0; i < (size_t)scene->width * scene->height; i++)
            different += memcmp(&found[i], &expected[i], sizeof *found) != 0;
        print_message("%-40s %-6s %5u pixels %5zu with other bits\n", label, kernel_at(k)->name,
                      scene->width * scene->height, different);
        picture_file_write(scene, label, found, expected, 0);
        free(found);
    }
    return different;
}

/* Whoever moves a scene rounds its coordinates to what doubles can say there. So the picture must be the one of
 * the scene at home with coordinates rounded like that, bit for bit: it is moved there and back, each time
 * farther. */
static size_t check_moved(const char *path, double home, bool by_transform)
{
    size_t different = 0;
    struct scene scene = load(path, SIDE);
    scene_move(&scene, grey(-home), false);
    for (double to = 1e3; to < 1e9; to *= 10) {
        char label[128];
        snprintf(label, sizeof label, "%s moved %s %g", strrchr(path, '/') + 1, by_transform ? "by" : "to", to);
        scene_move(&scene, vec3_make(to, -to, 0.75 * to), by_transform);
        scene_move(&scene, vec3_make(-to, to, -0.75 * to), by_transform);
        struct vec3 *expected = scene_render(&scene, kernel_at(0), NULL);
        scene_move(&scene, vec3_make(to, -to, 0.75 * to), by_transform);
        different += count_different(&scene, expected, label);
        scene_move(&scene, vec3_make(-to, to, -0.75 * to), by_transform);
        free(expected);
    }
    scene_finish(&scene);
    return different;
}

static void moving_changes_nothing(void **state)
{
    (void)state;
    size_t different = 0;
    for (int by_transform = 0; by_transform < 2; by_transform++) {
        different += check_moved("scenes/showcase.json", 0, by_transform);
        different += check_moved("scenes/hard/far-from-home.json", 1e8, by_transform);
    }
    assert_int_equal(different, 0);
}

static void scaling_changes_nothing(void **state)
{
    (void)state;
    static const char *const paths[] = {"scenes/showcase.json", "scenes/hard/ground.json",
                                        "scenes/hard/two-blocks.json"};
    size_t different = 0;
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        struct scene scene = load(paths[i], SIDE);
        struct vec3 *expected = scene_render(&scene, kernel_at(0), NULL);
        for (int exponent = -20; exponent <= 20; exponent += 40) {
            char label[128];
            snprintf(label, sizeof label, "%s scaled by 2^%d", strrchr(paths[i], '/') + 1, exponent);
            scene_scale(&scene, ldexp(1, exponent));
            different += count_different(&scene, expected, label);
            scene_scale(&scene, ldexp(1, -exponent));
        }
        free(expected);
        scene_finish(&scene);
    }
    assert_int_equal(different, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(things_seen_from_afar),
        cmocka_unit_test(things_on_a_globe),
        cmocka_unit_test(the_ground_of_a_globe_from_near),
        cmocka_unit_test(the_ground_of_a_globe_from_nearer),
        cmocka_unit_test(inside_a_cylinder),
        cmocka_unit_test(the_apex_of_a_cone),
        cmocka_unit_test(things_far_from_home),
        cmocka_unit_test(needles),
        cmocka_unit_test(of_coplanar_boxes_the_first_wins),
        cmocka_unit_test(of_coplanar_shapes_the_first_wins),
        cmocka_unit_test(of_turned_coplanar_shapes_the_first_wins),
        cmocka_unit_test(coincident_filters_both_filter_once),
        cmocka_unit_test(a_bubble_in_glass),
        cmocka_unit_test(water_that_touches_its_glass),
        cmocka_unit_test(walls_entered_together_are_one),
        cmocka_unit_test(glass_blocks_face_to_face_are_one),
        cmocka_unit_test(mirrors_that_face_each_other),
        cmocka_unit_test(moving_changes_nothing),
        cmocka_unit_test(scaling_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
