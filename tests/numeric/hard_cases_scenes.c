/*
 * Hard cases 9, 39, 44 to 46 and 48: whole scenes, bands, kernels and files.
 */
#include "scene/load.h"
#include "tests/numeric/bounce.h"

/* --- one scene of everything ------------------------------------------------------------------------------ */

static struct texture checker(double size, struct vec3 even, struct vec3 odd)
{
    return (struct texture){.kind = TEXTURE_CHECKER, .color = {even, odd}, .size = size};
}

static void add_round_things(struct scene *scene, double s)
{
    struct material glossy = material_matte(vec3_make(0.8, 0.3, 0.2));
    glossy.specular = grey(0.5);
    glossy.shininess = 20;
    scene_add(scene, shape_sphere(vec3_make(-1.5 * s, 0.2 * s, 0), s), glossy);
    scene_add(scene, shape_sphere(vec3_make(0.4 * s, 0.3 * s, 1.7 * s), 0.7 * s),
              material_glass(1.5, vec3_scale(vec3_make(0.1, 0.6, 0.3), 1 / s)));
    scene_add(scene, shape_sphere(vec3_make(0, 0, 0), 0.6 * s), material_mirror(grey(0.7)))->transform =
        affine_multiply(&(struct affine){mat3_identity(), {1.9 * s, 0, -0.4 * s}},
                        &(struct affine){{{1, 0.3, 0}, {0, 1.4, 0}, {0, 0.2, 0.8}}, {0, 0, 0}});
    scene_add(scene,
              shape_frustum(vec3_make(-2.2 * s, -s, 1.4 * s), vec3_make(-2 * s, 0.5 * s, 1.3 * s), 0.5 * s, 0),
              glossy);
    scene_add(
        scene,
        shape_tube(vec3_make(1.6 * s, -s, 1.8 * s), vec3_make(1.8 * s, 0.2 * s, 1.9 * s), 0.4 * s, 0.3 * s),
        material_matte(vec3_make(0.2, 0.4, 0.9)));
}

/* All lengths are s times those of a scene a few units large. */
static struct scene scene_of_everything(double s)
{
    struct scene scene = scene_at(vec3_make(0.7 * s, 1.9 * s, 6.3 * s), 42);
    scene.width = 40;
    scene.height = 30;
    scene.samples = 2;
    scene.ambient = grey(0.1);
    scene.background =
        (struct background){.kind = BACKGROUND_GRADIENT, .color = {grey(0.2), vec3_make(0.5, 0.6, 0.9)}};
    struct material floor = material_matte(grey(1));
    floor.color = checker(0.7 * s, grey(0.9), vec3_make(0.1, 0.2, 0.1));
    scene_add(&scene, shape_plane(vec3_make(0, -s, 0), vec3_make(0, 1, 0)), floor);
    add_round_things(&scene, s);
    scene_add(&scene, shape_disc(vec3_make(0, 2 * s, -2 * s), vec3_normalize(vec3_make(0.2, -0.3, 1)), 0.8 * s),
              material_filter(vec3_make(0.9, 0.5, 0.4)));
    scene_add(&scene, shape_box(vec3_make(-0.5 * s, -s, -1.5 * s), vec3_make(0.6 * s, 0.4 * s, -0.7 * s)),
              floor);
    scene_add(&scene, shape_globe(vec3_make(-0.6 * s, -0.4 * s, 2.4 * s), 0.4 * s, 6, 9),
              material_mirror(grey(0.4)));
    struct light lamp = light_point(vec3_make(3 * s, 5 * s, 4 * s), grey(0.9));
    lamp.falloff[1] = 0.05 / s;
    lamp.falloff[2] = 0.01 / (s * s);
    scene_add_light(&scene, lamp);
    scene_add_light(&scene, light_directional(vec3_make(-0.4, -1, -0.7), grey(0.4)));
    scene_add_light(&scene, light_spot(vec3_make(-3 * s, 4 * s, 3 * s), vec3_make(3, -4, -3), 35, 20));
    return scene;
}

static size_t pixels_of(const struct scene *scene)
{
    return (size_t)scene->width * scene->height;
}

static void check_same_pixels(const struct scene *scene, const struct vec3 *expected, const struct vec3 *found)
{
    for (size_t i = 0; i < pixels_of(scene); i++)
        if (memcmp(&expected[i], &found[i], sizeof *found) != 0)
            fail_msg("pixel %zu, %zu is %a %a %a, expected %a %a %a", i % scene->width, i / scene->width,
                     found[i].x, found[i].y, found[i].z, expected[i].x, expected[i].y, expected[i].z);
}

static void case_09_scaled_by_powers_of_two(void **state)
{
    (void)state;
    struct scene plain = scene_of_everything(1);
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *expected = scene_render(&plain, kernel_at(k), NULL);
        for (int exponent = -20; exponent <= 20; exponent += 40) {
            struct scene scaled = scene_of_everything(ldexp(1, exponent));
            struct vec3 *found = scene_render(&scaled, kernel_at(k), NULL);
            check_same_pixels(&plain, expected, found);
            free(found);
            scene_finish(&scaled);
        }
        free(expected);
    }
    scene_finish(&plain);
}

/* Between walls that glow by g (1 − r) and mirror r = 1/2, each pixel sees the sum of (1 − r) rᵏ: all but r
 * to the number of walls seen. Perfect mirrors show as many surroundings as none, and the depth limit ends
 * them. */
static void case_39_two_facing_mirrors(void **state)
{
    (void)state;
    for (uint32_t depth = 0; depth <= SCENE_DEPTH_MAX; depth += depth < 16 ? 4 : 16) {
        struct scene scene = scene_at(vec3_make(0, 0, 0.25), 20);
        struct material wall = material_glowing(grey(1));
        wall.reflection = grey(0.5);
        scene.depth = depth;
        scene_add(&scene, shape_plane(vec3_make(0, 0, -1), vec3_make(0, 0, 1)), wall);
        scene_add(&scene, shape_plane(vec3_make(0, 0, 1), vec3_make(0, 0, -1)), wall);
        uint32_t seen = (depth < 12 ? depth : 12) + 1; /* a path of 2^-12 is still followed */
        double found = scene_look(&scene).x;
        assert_true(found == 1 - ldexp(1, -(int)seen));
        scene.materials[0].reflection = scene.materials[1].reflection = grey(1);
        struct ray_counts counts = {0};
        free(scene_render(&scene, kernel_default(), &counts));
        assert_int_equal(counts.secondary, depth);
        scene_finish(&scene);
    }
}

static void case_44_two_filters_in_either_order(void **state)
{
    (void)state;
    static const double halves[][2] = {{0.5, 0.5}, {0.5, 0.25}, {0.25, 0.5}};
    for (size_t k = 0; k < 3; k++)
        for (int order = 0; order < 2; order++) {
            struct scene scene = scene_at(vec3_make(0, 0, 0), 10);
            scene.background.color[0] = grey(1);
            for (int i = 0; i < 2; i++) {
                double y = (i == order) + 1;
                scene_add(&scene, shape_disc(vec3_make(0, y, 0), vec3_make(0, 1, 0), 3),
                          material_filter(grey(halves[k][i])));
            }
            double expected = halves[k][0] * halves[k][1];
            assert_true(look(&scene, vec3_make(0.1, 4, 0.2), vec3_make(0, 0, 0)) == expected);
            scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
            scene_add_light(&scene, light_directional(vec3_make(0, -1, 0), grey(1)));
            assert_true(look(&scene, vec3_make(0.5, 0.5, 0), vec3_make(0, 0, 0)) == expected);
            scene_finish(&scene);
        }
}

/* --- bands, kernels, files -------------------------------------------------------------------------------- */

/* The picture in bands of `rows` rows, each made by a tracer of its own, and each row in pieces of
 * `columns`. */
static struct vec3 *render_in_pieces(const struct scene *scene, const struct kernel *kernel, uint32_t rows,
                                     uint32_t columns)
{
    struct trace_settings settings = settings_of(scene);
    struct plan *plan = plan_create(scene, &settings, 1);
    struct vec3 *pixels = memory_array(pixels_of(scene), sizeof *pixels);
    for (uint32_t first = 0; first < scene->height; first += rows) {
        struct tracer *tracer = tracer_create(plan, kernel);
        uint32_t end = first + rows < scene->height ? first + rows : scene->height;
        for (uint32_t y = end; y-- > first;) /* the order must not matter, either */
            for (uint32_t x = 0; x < scene->width; x += columns) {
                struct ray_counts counts = {0};
                uint32_t x1 = x + columns < scene->width ? x + columns : scene->width;
                area_render(tracer, samples_of(scene), &(struct pixel_area){x, x1, y, y + 1},
                            pixels + (size_t)y * scene->width + x, &counts);
            }
        tracer_destroy(&tracer);
    }
    plan_destroy(&plan);
    return pixels;
}

static void case_45_band_splits(void **state)
{
    (void)state;
    struct scene scene = scene_of_everything(1);
    const uint32_t rows[] = {1, 7, scene.height}, columns[] = {scene.width, 1, 7};
    struct vec3 *expected = scene_render(&scene, kernel_default(), NULL);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            struct vec3 *found = render_in_pieces(&scene, kernel_default(), rows[i], columns[k]);
            check_same_pixels(&scene, expected, found);
            free(found);
        }
    free(expected);
    scene_finish(&scene);
}

/* Every kernel, and batches of every size up to a few vectors: the lanes of a ray must not matter. */
static void case_46_every_kernel_and_lane(void **state)
{
    (void)state;
    struct scene scene = scene_of_everything(1);
    struct vec3 *expected = scene_render(&scene, kernel_at(0), NULL);
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *found = scene_render(&scene, kernel_at(k), NULL);
        check_same_pixels(&scene, expected, found);
        free(found);
    }
    free(expected);
    struct world world = {.scene = scene};
    world_compile(&world);
    for (uint32_t i = 0; i < 300; i++) {
        struct ray ray = ray_from(&world, vec3_scale(random_vector(i, 0), 4), random_unit(i, 3));
        struct hit alone = shoot_ray(&world, &ray);
        for (uint32_t size = 1; size <= 33; size += 4) {
            struct ray_batch rays = {0};
            struct hit_batch hits = {0};
            for (uint32_t lane = 0; lane < size; lane++) {
                struct ray other = ray_from(&world, random_vector(lane, 6), random_unit(lane, 9));
                ray_batch_push(&rays, lane == hash_u32(i) % size ? &ray : &other);
            }
            shoot_batch(world.plan, &rays, &hits);
            struct hit among = hit_at(world.plan, &rays, &hits, hash_u32(i) % size);
            assert_true(hits_are_equal(&alone, &among));
            ray_batch_finish(&rays);
            hit_batch_finish(&hits);
        }
    }
    world_end(&world);
}

static enum status load_text(const char *number)
{
    char *json = memory_format(
        "{\"camera\": {\"from\": [0, 1, 5], \"at\": [0, 0, 0]}, \"objects\": [{\"type\": \"sphere\","
        " \"center\": [0, %s, 0], \"radius\": 1}]}",
        number);
    struct bytes text = {0};
    bytes_put(&text, json, strlen(json) + 1);
    text.size--; /* the NUL */
    struct asset_set assets = {0};
    asset_set_add(&assets, "test.json", &text);
    struct scene scene = {0};
    struct error error;
    enum status status = scene_load(&scene, "test.json", &assets, &error);
    scene_finish(&scene);
    asset_set_finish(&assets);
    free(json);
    return status;
}

static void case_48_what_is_no_number_is_refused(void **state)
{
    (void)state;
    static const char *const refused[] = {"NaN",   "nan",    "-NaN",  "Infinity", "-Infinity", "inf",
                                          "1e999", "-1e999", "1e309", "null",     "\"NaN\""};
    assert_int_equal(load_text("0.5"), STATUS_OK);
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        assert_int_equal(load_text(refused[i]), STATUS_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_09_scaled_by_powers_of_two),
        cmocka_unit_test(case_39_two_facing_mirrors),
        cmocka_unit_test(case_44_two_filters_in_either_order),
        cmocka_unit_test(case_45_band_splits),
        cmocka_unit_test(case_46_every_kernel_and_lane),
        cmocka_unit_test(case_48_what_is_no_number_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
