/*
 * The streaming tracer against a plain recursive one, bit for bit, on scenes that use everything.
 */
#include "tests/kernel/recursive_tracer.h"

#include "tests/random.h"
#include "tests/scene_builder.h"

static bool same_pixel(const struct vec3 *a, const struct vec3 *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* Renders the scene in both ways, and in pieces of rows, and finishes it. */
static void check_scene(struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    struct plan *plan = plan_create(scene, &settings, 1);
    struct tracer *tracer = tracer_create(plan, kernel_default());
    struct ray_counts counts = {0}, again = {0};
    struct vec3 *row = memory_array(scene->width, sizeof *row),
                *pieces = memory_array(scene->width, sizeof *pieces);
    double least = INFINITY, most = -INFINITY;
    for (uint32_t y = 0; y < scene->height; y++) {
        area_render(tracer, samples_of(scene), &(struct pixel_area){0, scene->width, y, y + 1}, row, &counts);
        for (uint32_t x = 0, width = 1; x < scene->width; x += width, width = 1 + hash_u32(x + y) % 7) {
            width = width < scene->width - x ? width : scene->width - x;
            struct pixel_area piece = {x, x + width, y, y + 1};
            area_render(tracer, samples_of(scene), &piece, pieces + x, &again);
        }
        for (uint32_t x = 0; x < scene->width; x++) {
            struct vec3 plain = recursive_pixel(plan, x, y, samples_of(scene));
            assert_true(vec3_is_finite(row[x]));
            assert_true(same_pixel(&row[x], &plain));
            assert_true(same_pixel(&row[x], &pieces[x]));
            least = row[x].y < least ? row[x].y : least;
            most = row[x].y > most ? row[x].y : most;
        }
    }
    assert_true(most > least + 0.1); /* the scene shows something */
    assert_memory_equal(&counts, &again, sizeof counts);
    free(row);
    free(pieces);
    tracer_destroy(&tracer);
    plan_destroy(&plan);
    scene_finish(scene);
}

/* --- scenes ----------------------------------------------------------------------------------------------- */

static struct material checkered(double size)
{
    struct material material = material_matte(grey(1));
    material.color =
        (struct texture){.kind = TEXTURE_CHECKER, .color = {{0.9, 0.8, 0.7}, {0.1, 0.2, 0.3}}, .size = size};
    material.ambient = 0.2;
    return material;
}

/* A floor, three kinds of light, and a camera above. */
static struct scene lit_floor(void)
{
    struct scene scene = scene_at(vec3_make(0.3, 1.7, 6.1), 45);
    scene.background =
        (struct background){.kind = BACKGROUND_GRADIENT, .color = {{0.1, 0.1, 0.2}, {0.4, 0.6, 0.9}}};
    scene_add(&scene, shape_plane(vec3_make(0, -1, 0), vec3_make(0, 1, 0)), checkered(0.7));
    scene_add_light(&scene, light_point(vec3_make(3, 4, 5), vec3_make(0.7, 0.6, 0.5)));
    scene_add_light(&scene, light_directional(vec3_make(1, -3, -1), vec3_make(0.2, 0.3, 0.4)));
    scene_add_light(&scene, light_spot(vec3_make(-2, 5, 2), vec3_make(2, -5, -2), 30, 10));
    scene.samples = 2;
    return scene;
}

static void mirrors_filters_and_lights(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    struct material shiny = material_mirror(vec3_make(0.6, 0.5, 0.4)),
                    half = material_filter(vec3_make(0.9, 0.5, 0.2));
    shiny.specular = grey(0.4);
    shiny.shininess = 20;
    shiny.color = texture_plain(grey(0.5));
    half.transparency = 0.6;
    half.reflection = grey(0.2);
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 1), shiny);
    scene_add(&scene, shape_box(vec3_make(0.4, -1, -0.5), vec3_make(1.4, 0.5, 0.5)), half);
    scene_add(&scene, shape_tube(vec3_make(0, -1, 1.5), vec3_make(0, 0, 1.5), 0.5, 0.3), half);
    scene_add(&scene, shape_disc(vec3_make(0.5, 1, 0), vec3_normalize(vec3_make(1, 1, 1)), 0.6), shiny);
    check_scene(&scene);
}

static void nested_glass(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    struct material glass = material_glass(1.5, vec3_make(0.1, 0.3, 0.5)),
                    water = material_glass(1.33, grey(0.2));
    glass.specular = grey(0.5);
    glass.shininess = 50;
    water.filter = vec3_make(0.9, 0.95, 1);
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 1), glass);
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 0.7), material_glass(1, grey(0)));
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0.1), 0.3), water);
    scene_add(&scene, shape_frustum(vec3_make(1, -1, 0.5), vec3_make(1.2, 0.7, 0.5), 0.7, 0), glass)
        ->transform = affine_scaling(vec3_make(1, 1, 1.3));
    scene_add(&scene, shape_box(vec3_make(0.8, -1, 0.2), vec3_make(2, 0, 1)), water); /* overlaps the cone */
    check_scene(&scene);
}

static void camera_inside_glass(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    scene_add(&scene, shape_box(vec3_make(-4, -0.5, -4), vec3_make(4, 5, 8)),
              material_glass(1.33, vec3_make(0.2, 0.1, 0)));
    scene_add(&scene, shape_box_mesh(vec3_make(-1, 1, 4), vec3_make(1.5, 3, 7)), material_glass(1.5, grey(0)));
    scene_add(&scene, shape_sphere(vec3_make(0, 0.5, 0), 1), checkered(0.3));
    check_scene(&scene);
}

static void smooth_meshes_and_images(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    float sky[16][8][3], picture[8 * 8 * 3];
    for (uint32_t i = 0; i < sizeof sky / sizeof(float); i++)
        (&sky[0][0][0])[i] = (float)random_between(i, 0, 0, 1);
    for (uint32_t i = 0; i < sizeof picture / sizeof(float); i++)
        picture[i] = (float)random_between(i, 1, 0, 1);
    scene.background =
        (struct background){.kind = BACKGROUND_IMAGE, .image = scene_add_image(&scene, 8, 16, &sky[0][0][0])};
    size_t image = scene_add_image(&scene, 8, 8, picture);
    struct material pictured = material_matte(grey(1));
    pictured.color = (struct texture){.kind = TEXTURE_IMAGE,
                                      .map = MAP_SPHERE,
                                      .repeat_u = 2,
                                      .repeat_v = 1,
                                      .image = {image, image, image, image, image, image}};
    pictured.reflection = grey(0.3);
    pictured.ambient = 0.3;
    scene_add(&scene, shape_globe(vec3_make(-1, 0, 0), 1, 5, 7), pictured);
    scene_add(&scene, shape_globe(vec3_make(1.2, 0, 0.6), 0.9, 6, 8),
              material_glass(1.5, vec3_make(0.1, 0.2, 0.1)));
    check_scene(&scene);
}

/* Solids that touch: glass on the floor, on other glass, and flush with it. */
static void touching_glass(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    struct material glass = material_glass(1.5, grey(0.1)),
                    water = material_glass(1.33, vec3_make(0.3, 0.1, 0));
    scene_add(&scene, shape_box(vec3_make(-1.5, -1, -1), vec3_make(0, 0, 1)), glass);
    scene_add(&scene, shape_box(vec3_make(-1.5, 0, -1), vec3_make(0, 1, 1)), water);
    scene_add(&scene, shape_box_mesh(vec3_make(0, -1, -1), vec3_make(1.5, 0.5, 1)), glass);
    scene_add(&scene, shape_box_mesh(vec3_make(0.5, -0.5, 0), vec3_make(1.2, 0.5, 1)), water);
    check_scene(&scene);
}

/* Several samples spread around each pixel, and one, whose filter shows in the texture alone. */
static void pixels_with_a_tent(void **state)
{
    (void)state;
    for (uint32_t samples = 1; samples <= 5; samples += 4) {
        struct scene scene = lit_floor();
        scene.samples = samples;
        scene.filter = FILTER_TENT;
        scene_add(&scene, shape_sphere(vec3_make(-1, 0, 0), 1), material_mirror(grey(0.6)));
        scene_add(&scene, shape_sphere(vec3_make(1, 0, 0.5), 0.8), material_glass(1.5, grey(0.1)));
        check_scene(&scene);
    }
}

/* Mirrors that face one another, to the greatest depth. */
static void hall_of_mirrors(void **state)
{
    (void)state;
    struct scene scene = lit_floor();
    struct material mirror = material_mirror(grey(0.95));
    mirror.color = texture_plain(grey(1));
    scene.depth = SCENE_DEPTH_MAX;
    scene.samples = 1;
    scene_add(&scene, shape_plane(vec3_make(0, 0, -2), vec3_make(0, 0, 1)), mirror);
    scene_add(&scene, shape_plane(vec3_make(0, 0, 7), vec3_make(0, 0, -1)), mirror);
    scene_add(&scene, shape_sphere(vec3_make(1, 0, 0), 0.7), material_matte(vec3_make(1, 0.2, 0.2)));
    check_scene(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mirrors_filters_and_lights),
        cmocka_unit_test(nested_glass),
        cmocka_unit_test(camera_inside_glass),
        cmocka_unit_test(smooth_meshes_and_images),
        cmocka_unit_test(touching_glass),
        cmocka_unit_test(pixels_with_a_tent),
        cmocka_unit_test(hall_of_mirrors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
