/*
 * Textures: patterns at their borders, means over footprints, and images the right way up on every map.
 */
#include "trace/texture.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"

/* One textured object, seen from the eye. */
struct world {
    struct scene scene;
    struct plan *plan;
};

/* An image whose red is u and green is v at every texel's middle, so that interpolation gives (u, v) back; its
 * blue tells images apart. */
static void add_ramp(struct scene *scene, float blue)
{
    enum { SIDE = 64 };
    static float rgb[SIDE][SIDE][3];
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            rgb[y][x][0] = ((float)x + 0.5f) / SIDE;
            rgb[y][x][1] = ((float)y + 0.5f) / SIDE;
            rgb[y][x][2] = blue;
        }
    scene_add_image(scene, SIDE, SIDE, &rgb[0][0][0]);
}

static struct world world_of(struct shape shape, struct texture texture, struct affine transform,
                             struct vec3 eye)
{
    struct world world = {.scene = scene_at(eye, 40)};
    struct material material = material_matte(grey(1));
    material.color = texture;
    scene_add(&world.scene, shape, material)->transform = transform;
    if (texture.kind == TEXTURE_IMAGE)
        for (int face = 0; face < BOX_FACES; face++)
            add_ramp(&world.scene, (float)face / 8);
    struct trace_settings settings = settings_of(&world.scene);
    world.plan = plan_create(&world.scene, &settings, 1);
    return world;
}

static struct world plain_world(struct texture texture)
{
    return world_of(shape_sphere(vec3_make(0, 0, 0), 1), texture, affine_identity(), vec3_make(0, 0, 5));
}

static void world_end(struct world *world)
{
    plan_destroy(&world->plan);
    scene_finish(&world->scene);
}

/* The colour at a point of the world, over a footprint. */
static struct vec3 color_over(const struct world *world, struct vec3 p, struct vec3 by_x, struct vec3 by_y)
{
    const struct plan *plan = world->plan;
    struct texture_point point = {.position = vec3_sub(p, plan->eye),
                                  .position_x = by_x,
                                  .position_y = by_y,
                                  .flat_axis = -1,
                                  .box_face = -1};
    return texture_color(plan, &plan->textures[plan->objects[0].texture], &point);
}

static struct vec3 color_at(const struct world *world, double x, double y, double z)
{
    return color_over(world, vec3_make(x, y, z), grey(0), grey(0));
}

/* --- patterns --------------------------------------------------------------------------------------------- */

static const struct vec3 even = {1, 0, 0}, odd = {0, 0, 1};

static struct texture checker(double size)
{
    return (struct texture){.kind = TEXTURE_CHECKER, .color = {even, odd}, .size = size};
}

static struct texture stripes(struct vec3 direction, double size)
{
    return (struct texture){
        .kind = TEXTURE_STRIPES, .color = {even, odd}, .size = size, .direction = vec3_normalize(direction)};
}

static bool is_even(struct vec3 color)
{
    assert_true((color.x == 1 && color.z == 0) || (color.x == 0 && color.z == 1));
    return color.x == 1;
}

/* Hard case 42: cells begin at whole numbers, also below 0. */
static void checker_cells_begin_at_whole_numbers(void **state)
{
    (void)state;
    struct world world = plain_world(checker(1));
    assert_true(is_even(color_at(&world, 0, 0, 0)));
    assert_true(is_even(color_at(&world, 0.5, 0.5, 0.5)));
    assert_false(is_even(color_at(&world, -0.5, 0.5, 0.5)));
    assert_false(is_even(color_at(&world, -1, 0.5, 0.5)));
    assert_true(is_even(color_at(&world, -1.5, 0.5, 0.5)));
    assert_true(is_even(color_at(&world, -0.5, -0.5, 0.5)));
    assert_false(is_even(color_at(&world, 1, 0.5, 0.5)));
    assert_true(is_even(color_at(&world, 2, 0.5, 0.5)));
    for (int i = 0; i < 8; i++)
        assert_int_equal(is_even(color_at(&world, (i & 1) + 0.5, (i >> 1 & 1) - 3.5, (i >> 2) + 8.25)),
                         ((i & 1) + (i >> 1 & 1) + (i >> 2)) % 2 == 0);
    world_end(&world);
}

/* floor, not truncation; along x + z; a cell begins at the offset; the same far from the world's origin. */
static void stripes_run_along_any_direction(void **state)
{
    (void)state;
    struct texture texture = stripes(vec3_make(1, 0, 1), 0.5);
    texture.offset = vec3_make(0.25, 0, 0);
    struct world world = plain_world(texture);
    texture.offset.x += 2 * sqrt(2) * 0.5 * 1e6;
    struct world far =
        world_of(shape_sphere(grey(0), 1), texture,
                 affine_translation(vec3_make(-2 * sqrt(2) * 0.5 * 1e6, 0, 0)), vec3_make(0, 0, 5));
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 p = vec3_scale(random_vector(i, 0), 5);
        double s = ((p.x - 0.25) + p.z) / sqrt(2) / 0.5;
        if (fabs(s - floor(s + 0.5)) < 1e-8)
            continue;
        double cell = floor(s);
        assert_int_equal(is_even(color_at(&world, p.x, p.y, p.z)), cell - 2 * floor(cell / 2) == 0);
        assert_int_equal(is_even(color_at(&far, p.x, p.y, p.z)), cell - 2 * floor(cell / 2) == 0);
    }
    world_end(&world);
    world_end(&far);
}

static void gradient_is_linear_and_clamped(void **state)
{
    (void)state;
    struct world world = plain_world((struct texture){
        .kind = TEXTURE_GRADIENT, .color = {even, odd}, .direction = {0, 1, 0}, .start = 3, .end = -1});
    assert_true(color_at(&world, 7, 3, 0).x == 1 && color_at(&world, 7, 5, 0).x == 1);
    assert_true(color_at(&world, 7, -1, 0).z == 1 && color_at(&world, 7, -5, 0).z == 1);
    assert_true(fabs(color_at(&world, 0, 2, 0).z - 0.25) < 1e-15);
    world_end(&world);
}

/* A pattern stays on its object: seen through a transform it is what the object's own point has. */
static void patterns_are_in_object_coordinates(void **state)
{
    (void)state;
    struct affine turn = affine_rotation(vec3_normalize(vec3_make(1, 1, 0)), 35);
    struct affine stretch = affine_scaling(vec3_make(2, 3, 0.5)), m = affine_multiply(&turn, &stretch);
    m.offset = vec3_make(4, 5, 6);
    struct world own = plain_world(checker(0.7));
    struct world placed = world_of(shape_sphere(grey(0), 1), checker(0.7), m, vec3_make(1, 2, 9));
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 p = vec3_scale(random_vector(i, 0), 4), q = affine_point(&m, p);
        assert_int_equal(is_even(color_at(&own, p.x, p.y, p.z)), is_even(color_at(&placed, q.x, q.y, q.z)));
    }
    world_end(&own);
    world_end(&placed);
}

/* The share of even cells over s ± width/2, counted at many points. */
static double counted_mean(double s, double width)
{
    enum { POINTS = 20000 };
    int count = 0;
    for (int i = 0; i < POINTS; i++) {
        double cell = floor(s + width * ((i + 0.5) / POINTS - 0.5));
        count += cell - 2 * floor(cell / 2) == 0;
    }
    return count / (double)POINTS;
}

/* Over a footprint a pattern gives its mean; the counting is off by a point or two a border. */
static void patterns_are_filtered_over_the_footprint(void **state)
{
    (void)state;
    struct world lines = plain_world(stripes(vec3_make(1, 0, 0), 1)), cubes = plain_world(checker(1));
    for (uint32_t i = 0; i < 1000; i++) {
        struct vec3 p = vec3_scale(random_vector(i, 0), 3);
        double width = random_between(i, 3, 0, 1) * (i % 2 ? 0.5 : 6), height = random_between(i, 4, 0, 2);
        double mean = counted_mean(p.x, width), tolerance = (width + 2) / 10000;
        struct vec3 across = vec3_make(width, 0, 0), along = vec3_make(0, 0.3, -0.2);
        assert_true(fabs(color_over(&lines, p, across, grey(0)).x - mean) < tolerance);
        assert_true(fabs(color_over(&lines, p, across, along).x - mean) < tolerance);
        assert_true(fabs(color_over(&lines, p, along, across).x - mean) < tolerance);
        double both = 2 * mean - 1, by_z = 2 * counted_mean(p.z, height) - 1;
        double parity = floor(p.y) - 2 * floor(floor(p.y) / 2) == 0 ? 1 : -1;
        struct vec3 color = color_over(&cubes, p, across, vec3_make(0, 0, height));
        assert_true(fabs(color.x - (1 + both * by_z * parity) / 2) < 2 * tolerance + height / 5000);
        assert_true(color.x >= 0 && color.x <= 1 && fabs(color.x + color.z - 1) < 1e-15);
    }
    struct vec3 endless = color_over(&cubes, grey(0.3), vec3_make(INFINITY, 0, 0), vec3_make(0, 1e300, 0));
    assert_true(fabs(endless.x - 0.5) < 1e-6);
    world_end(&lines);
    world_end(&cubes);
}

/* The share of even cells over s ± a/2 ± b/2, counted at many points. */
static double counted_mean_of_both(double s, double a, double b)
{
    enum { POINTS = 100 };
    double sum = 0;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < POINTS; k++) {
            double cell = floor(s + a * ((i + 0.5) / POINTS - 0.5) + b * ((k + 0.5) / POINTS - 0.5));
            sum += cell - 2 * floor(cell / 2) == 0;
        }
    return sum / (POINTS * POINTS);
}

/* Over a footprint across which the pattern changes along both edges: far nearer than the mean over their sum is. */
static void slanting_footprints_are_no_wider_than_they_are(void **state)
{
    (void)state;
    struct world lines = plain_world(stripes(vec3_make(1, 0, 0), 1));
    double off = 0, off_by_sum = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        struct vec3 p = vec3_scale(random_vector(i, 5), 3);
        double a = random_between(i, 6, -1, 1), b = random_between(i, 7, -1, 1);
        double mean = counted_mean_of_both(p.x, a, b);
        double found = color_over(&lines, p, vec3_make(a, 0.1, 0), vec3_make(b, 0, 0.3)).x;
        double by_sum = counted_mean(p.x, fabs(a) + fabs(b));
        off += (found - mean) * (found - mean);
        off_by_sum += (by_sum - mean) * (by_sum - mean);
    }
    print_message("# off by %.4f, by the sum of the edges %.4f\n", sqrt(off / 1000), sqrt(off_by_sum / 1000));
    assert_true(off < off_by_sum / 16);
    world_end(&lines);
}

/* A flat surface on a cell's border has one colour a cell, not noise; through whole surfaces, as a ray finds
 * them. */
static void flat_surfaces_drop_their_own_coordinate(void **state)
{
    (void)state;
    struct material material = material_glowing(grey(1));
    material.color = checker(1);
    struct scene scene = scene_at(vec3_make(0.3, 4.1, 5.7), 60);
    scene_add(&scene, shape_plane(vec3_make(0, 1, 0), vec3_make(0, 1, 0)), material);
    scene.depth = 0;
    scene.samples = 16;
    struct vec3 *pixels = scene_render(&scene, &kernel_ref, NULL);
    for (uint32_t i = 0; i < scene.width * scene.height; i++)
        assert_true(fabs(pixels[i].x + pixels[i].z - 1) < 1e-14 || vec3_is_zero(pixels[i]));
    /* The middle of a cell close to the camera is one colour. */
    size_t at = (size_t)31 * 32 + 16, pure = 0;
    for (size_t i = at - 12; i < at + 12; i++)
        pure += pixels[i].x > 1 - 1e-14 || pixels[i].z > 1 - 1e-14;
    assert_true(pure > 8);
    free(pixels);
    scene_finish(&scene);
}

/* --- images ----------------------------------------------------------------------------------------------- */

static struct texture image_texture(enum texture_map map)
{
    return (struct texture){.kind = TEXTURE_IMAGE,
                            .map = map,
                            .image = {0, 1, 2, 3, 4, 5},
                            .repeat_u = 1,
                            .repeat_v = 1,
                            .axis_u = {2, 0, 0},
                            .axis_v = {0, 0, -4},
                            .origin = {-1, 0, 2}};
}

/* The ramp image is in float: 2^-24 a texel. */
static void check_uv(struct vec3 color, double u, double v)
{
    assert_true(fabs(color.x - u) < 2e-7);
    assert_true(fabs(color.y - v) < 2e-7);
}

/* Hard case 43. */
static void sphere_map_is_upright(void **state)
{
    (void)state;
    struct world world = plain_world(image_texture(MAP_SPHERE));
    check_uv(color_at(&world, 0, 0, 1), 0.5, 0.5);
    check_uv(color_at(&world, 1, 0, 0), 0.75, 0.5); /* to the right, seen from +z */
    check_uv(color_at(&world, -1, 0, 0), 0.25, 0.5);
    check_uv(color_at(&world, 0.3, sqrt(0.5), 0.4), 0.5 + atan2(0.3, 0.4) / (2 * M_PI),
             atan2(0.5, sqrt(0.5)) / M_PI);
    double top = 0.5 / 64; /* the middle of the first row */
    assert_true(fabs(color_at(&world, 0, 1, 0).y - top) < 1e-7);
    assert_true(fabs(color_at(&world, 0, -1, 0).y - (1 - top)) < 1e-7);
    /* Both sides of the seam, at −z: the last texel and the first meet. */
    double left = color_at(&world, -1e-9, 0, -1).x, right = color_at(&world, 1e-9, 0, -1).x;
    assert_true(fabs(left - 0.5) < 1e-6 && fabs(right - 0.5) < 1e-6); /* the mean of u = 0 and u = 1 */
    world_end(&world);
}

static void cylinder_map_is_upright(void **state)
{
    (void)state;
    struct shape shape = shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 3, 0), 1, 1);
    struct world world = world_of(shape, image_texture(MAP_CYLINDER), affine_identity(), vec3_make(0, 0, 9));
    check_uv(color_at(&world, 0, 1, 1), 0.5, 0.5);
    check_uv(color_at(&world, 1, 2, 0), 0.75, 0.25); /* higher up is nearer the image's top */
    check_uv(color_at(&world, -0.6, 0, 0.8), 0.5 - atan2(0.6, 0.8) / (2 * M_PI), 0.75);
    world_end(&world);
}

/* u along axis_u from origin, v upwards in the image along axis_v; beyond 0..1 the image repeats. */
static void planar_map_is_upright_and_repeats(void **state)
{
    (void)state;
    struct shape floor_shape = shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0));
    struct texture texture = image_texture(MAP_PLANAR);
    struct world world = world_of(floor_shape, texture, affine_identity(), vec3_make(0, 5, 5));
    check_uv(color_at(&world, -0.5, 0, 1), 0.25, 0.75);
    check_uv(color_at(&world, -0.5 + 4, 7, 1 - 8), 0.25, 0.75);
    texture.repeat_u = 2;
    texture.repeat_v = 3;
    struct world many = world_of(floor_shape, texture, affine_identity(), vec3_make(0, 5, 5));
    check_uv(color_at(&many, -0.5 + 0.25, 0, 1), 0.75, 0.25);
    world_end(&world);
    world_end(&many);
}

/* Each face of a box, seen from outside with y up (top and bottom: −z and +z up): the image's corners are where
 * a viewer expects them. */
static void box_map_is_upright_on_every_face(void **state)
{
    (void)state;
    static const struct {
        struct vec3 out, up;
    } faces[BOX_FACES] = {{{1, 0, 0}, {0, 1, 0}},  {{-1, 0, 0}, {0, 1, 0}}, {{0, 1, 0}, {0, 0, -1}},
                          {{0, -1, 0}, {0, 0, 1}}, {{0, 0, 1}, {0, 1, 0}},  {{0, 0, -1}, {0, 1, 0}}};
    struct vec3 middle = {1, 2, 3}, half = {2, 1, 0.5};
    struct shape box = shape_box(vec3_sub(middle, half), vec3_add(middle, half));
    struct world world = world_of(box, image_texture(MAP_BOX), affine_identity(), vec3_make(0, 0, 9));
    for (int face = 0; face < BOX_FACES; face++) {
        struct vec3 right = vec3_cross(faces[face].up, faces[face].out);
        for (double u = 0.125; u < 1; u += 0.25)
            for (double v = 0.125; v < 1; v += 0.25) {
                struct vec3 on = vec3_add_scaled(faces[face].out, right, 2 * u - 1);
                on = vec3_add_scaled(on, faces[face].up, 1 - 2 * v);
                struct vec3 p = vec3_add(middle, vec3_mul(half, on));
                struct vec3 color = color_at(&world, p.x, p.y, p.z);
                check_uv(color, u, v);
                assert_true(color.z == face / 8.0f);
            }
    }
    world_end(&world);
}

/* The mesh's own coordinates, with v upwards, also where a mirroring transform turns its triangles over. */
static void mesh_map_follows_the_corners(void **state)
{
    (void)state;
    static const struct vec3 points[4] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
    static const uint32_t index[6] = {0, 1, 2, 0, 2, 3};
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        struct shape shape = shape_mesh(points, 4, index, 2, false);
        shape.mesh.uv = memory_array(8, sizeof *shape.mesh.uv);
        memcpy(shape.mesh.uv, (const double[8]){0, 0, 1, 0, 1, 1, 0, 1}, 8 * sizeof(double));
        struct affine m = affine_scaling(vec3_make(mirrored ? -1 : 1, 1, 1));
        struct world world = world_of(shape, image_texture(MAP_MESH), m, vec3_make(0, 0, 5));
        world.scene.materials[0].ambient = 1;
        for (uint32_t i = 0; i < 200; i++) {
            double u = random_between(i, 0, 0.1, 0.9), v = random_between(i, 1, 0.1, 0.9);
            double x = mirrored ? -2 * u : 2 * u;
            world.scene.camera = (struct camera){{x, v, 5}, {x, v, 0}, {0, 1, 0}, 0.001};
            check_uv(scene_look(&world.scene), u, 1 - v);
        }
        world_end(&world);
    }
}

/* --- filtering images ------------------------------------------------------------------------------------- */

/* An image of one colour is that colour over every footprint. */
static void a_plain_image_is_plain(void **state)
{
    (void)state;
    float rgb[13 * 7 * 3];
    for (size_t i = 0; i < sizeof rgb / sizeof *rgb; i++)
        rgb[i] = (float[]){0.3f, 0.6f, 0.9f}[i % 3];
    struct world world = plain_world(image_texture(MAP_PLANAR));
    scene_add_image(&world.scene, 13, 7, rgb);
    for (int face = 0; face < BOX_FACES; face++)
        world.scene.materials[0].color.image[face] = 6;
    plan_destroy(&world.plan);
    struct trace_settings settings = settings_of(&world.scene);
    world.plan = plan_create(&world.scene, &settings, 1);
    for (uint32_t i = 0; i < 20000; i++) {
        double wide = ldexp(1, (int)(i % 40) - 20), narrow = ldexp(1, (int)(i / 40 % 40) - 20);
        struct vec3 color = color_over(&world, random_vector(i, 0), vec3_scale(random_vector(i, 3), wide),
                                       vec3_scale(random_vector(i, 6), narrow));
        assert_true(vec3_max_abs(vec3_sub(color, vec3_make(0.3f, 0.6f, 0.9f))) < 2e-15);
    }
    world_end(&world);
}

/* Wider footprints go over continuously into the image's mean; narrow ones into the interpolated texels. */
static void footprints_lead_from_texels_to_the_mean(void **state)
{
    (void)state;
    struct world world = plain_world(image_texture(MAP_PLANAR));
    struct vec3 p = {-0.37, 0, 0.71}, point = color_at(&world, p.x, p.y, p.z);
    struct vec3 tiny = color_over(&world, p, vec3_make(1e-9, 0, 0), vec3_make(0, 0, 1e-9));
    assert_true(vec3_max_abs(vec3_sub(tiny, point)) == 0);
    struct vec3 whole = color_over(&world, p, vec3_make(300, 0, 0), vec3_make(0, 0, 300));
    assert_true(vec3_max_abs(vec3_sub(whole, vec3_make(0.5, 0.5, 0))) < 1e-6);
    struct vec3 last = point;
    double largest = 0;
    for (double size = 0.001; size < 100; size *= 1.002) {
        struct vec3 color = color_over(&world, p, vec3_make(size, 0, 0), vec3_make(0, 0, 1.5 * size));
        double jump = vec3_max_abs(vec3_sub(color, last));
        largest = jump > largest ? jump : largest;
        last = color;
    }
    assert_true(largest < 0.05);
    world_end(&world);
}

/* The filter is no wider than it must be: stripes of a texel vanish in a footprint of four, and the border
 * between a black and a white half does not show half the picture away. */
static void filtering_is_not_wider_than_the_footprint(void **state)
{
    (void)state;
    static float thin[64][64][3], halves[64][64][3];
    for (int i = 0; i < 64 * 64; i++) {
        thin[i / 64][i % 64][0] = (float)(i % 2);
        halves[i / 64][i % 64][0] = (float)(i % 64 >= 32);
    }
    struct world world = plain_world(image_texture(MAP_PLANAR));
    size_t first = scene_add_image(&world.scene, 64, 64, &thin[0][0][0]);
    scene_add_image(&world.scene, 64, 64, &halves[0][0][0]);
    for (size_t image = first; image < first + 2; image++) {
        for (int face = 0; face < BOX_FACES; face++)
            world.scene.materials[0].color.image[face] = image;
        plan_destroy(&world.plan);
        struct trace_settings settings = settings_of(&world.scene);
        world.plan = plan_create(&world.scene, &settings, 1);
        struct vec3 by_x = {4 * 2.0 / 64, 0, 0}, by_y = {0, 0, 4 * 4.0 / 64}; /* the map is 2 × 4 */
        for (int i = 0; i < 100; i++) {
            struct vec3 p = {-1 + 2 * (0.3 + 0.001 * i), 0, 1};
            double seen = color_over(&world, p, by_x, by_y).x;
            assert_true(fabs(seen - (image == first ? 0.5 : 0)) < 1e-6);
        }
    }
    world_end(&world);
}

/* An image of squares: texel i is (i + 1/2)² / 64², left to right. Interpolating between texels makes x² + 1/6 of that,
 * on average over x, and a box of b texels b²/12 more. Looks are as wide as the box on average over where they are;
 * single ones need not be. The footprint's other edge is `by` texels. */
static void check_width(const struct world *world, double b, double by)
{
    struct vec3 by_x = {b * 2 / 64, 0, 0}, by_y = {0, 0, by * 4 / 64}; /* the map is 2 × 4 */
    double above = 0;
    for (int i = 0; i < 256; i++) { /* over 16 texels, a multiple of the coarsest ones */
        double x = 24 + (i + 0.5) / 16;
        above += color_over(world, vec3_make(-1 + x * 2 / 64, 0, 1), by_x, by_y).x - x * x / 4096;
    }
    if (!(fabs(above / 256 * 4096 - (b * b + 2) / 12) < 0.01))
        fail_msg("%g x %g texels: found a variance of %g", b, by, above / 256 * 4096);
}

static void filtering_is_as_wide_as_the_footprint(void **state)
{
    (void)state;
    static float squares[64][64][3];
    const double widths[] = {1, 1.5, 1.7, 2, 3, 4.5, 5, 8};
    for (int i = 0; i < 64 * 64; i++)
        squares[i / 64][i % 64][0] = (float)((i % 64 + 0.5) * (i % 64 + 0.5) / 4096);
    struct world world = plain_world(image_texture(MAP_PLANAR));
    size_t image = scene_add_image(&world.scene, 64, 64, &squares[0][0][0]);
    for (int face = 0; face < BOX_FACES; face++)
        world.scene.materials[0].color.image[face] = image;
    plan_destroy(&world.plan);
    struct trace_settings settings = settings_of(&world.scene);
    world.plan = plan_create(&world.scene, &settings, 1);
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++)
        for (size_t j = 0; j < sizeof widths / sizeof *widths; j++)
            check_width(&world, widths[i], widths[j]);
    world_end(&world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(checker_cells_begin_at_whole_numbers),
        cmocka_unit_test(stripes_run_along_any_direction),
        cmocka_unit_test(gradient_is_linear_and_clamped),
        cmocka_unit_test(patterns_are_in_object_coordinates),
        cmocka_unit_test(patterns_are_filtered_over_the_footprint),
        cmocka_unit_test(slanting_footprints_are_no_wider_than_they_are),
        cmocka_unit_test(flat_surfaces_drop_their_own_coordinate),
        cmocka_unit_test(sphere_map_is_upright),
        cmocka_unit_test(cylinder_map_is_upright),
        cmocka_unit_test(planar_map_is_upright_and_repeats),
        cmocka_unit_test(box_map_is_upright_on_every_face),
        cmocka_unit_test(mesh_map_follows_the_corners),
        cmocka_unit_test(a_plain_image_is_plain),
        cmocka_unit_test(footprints_lead_from_texels_to_the_mean),
        cmocka_unit_test(filtering_is_not_wider_than_the_footprint),
        cmocka_unit_test(filtering_is_as_wide_as_the_footprint),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
