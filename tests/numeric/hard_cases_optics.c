/*
 * Hard cases 32 to 38 and 47: reflection, refraction and long chains of bounces.
 *
 * FULL=1 in the environment shoots as many rays as the case asks for; otherwise a fiftieth.
 */
#include <stdlib.h>

#include "math/elementary.h"
#include "tests/numeric/bounce.h"

static const double u = DBL_EPSILON / 2;
static const double degree = 3.14159265358979323846 / 180;

static struct material clear_glass(double ior)
{
    return material_glass(ior, vec3_make(0, 0, 0));
}

/* Fresnel's reflectance from index n1 into n2 at this angle, in degrees. */
static struct refraction refraction_at(double degrees, double n1, double n2)
{
    struct vec3 d = {math_sin_degrees(degrees), -math_cos_degrees(degrees), 0};
    return optics_refraction(d, vec3_make(0, 1, 0), n1, n2);
}

static void case_32_reflectance_head_on(void **state)
{
    (void)state;
    assert_true(fabs(refraction_at(0, 1, 1.5).reflectance - 0.04) <= 2 * u);
    assert_true(fabs(refraction_at(0, 1.5, 1).reflectance - 0.04) <= 2 * u);
    struct world world = world_made_of(shape_sphere(vec3_make(0, 0, 0), 1), clear_glass(1.5));
    struct medium_pool media = {0};
    struct path path = path_along(ray_from(&world, vec3_make(0, 0, 4), vec3_make(0, 0, -1)));
    struct bounce bounce = bounce_of(&world, &media, &path);
    assert_true(bounce.is_mirrored && fabs(bounce.mirrored.throughput.x - 0.04) <= 2 * u);
    assert_true(bounce.is_transmitted && fabs(bounce.transmitted.throughput.x - 0.96) <= 2 * u);
    assert_true(bounce.transmitted.ray.direction.z == -1);
    medium_pool_finish(&media);
    world_end(&world);
}

/* asin(1 / 1.5) = 41.8103148957786 degrees. */
static void case_33_total_internal_reflection(void **state)
{
    (void)state;
    assert_true(refraction_at(41.810314896, 1.5, 1).total);
    assert_true(!refraction_at(41.810314895, 1.5, 1).total);
    assert_true(refraction_at(41.810314895, 1.5, 1).reflectance < 1);
    assert_true(refraction_at(89.9999, 1.5, 1).total && !refraction_at(89.9999, 1, 1.5).total);
    struct world world = world_made_of(shape_box(vec3_make(-9, -9, -9), vec3_make(9, 1, 9)), clear_glass(1.5));
    struct medium_pool media = {0};
    for (int sign = -1; sign <= 1; sign += 2) {
        double angle = (41.8103148957786 + sign * 1e-3) * degree;
        struct path path =
            path_along(ray_from(&world, vec3_make(0, 0, 0), vec3_make(sin(angle), cos(angle), 0)));
        path.medium = medium_push(&media, MEDIUM_SPACE, 0);
        struct bounce bounce = bounce_of(&world, &media, &path);
        assert_true(bounce.is_mirrored && bounce.is_transmitted == (sign < 0));
        assert_true(sign < 0 || bounce.mirrored.throughput.x == 1);
    }
    medium_pool_finish(&media);
    world_end(&world);
}

/* At Brewster's angle atan 1.5 only light across the plane of incidence is reflected: R = Rs / 2, and
 * Rs = ((n² − 1) / (n² + 1))². */
static void case_34_brewster(void **state)
{
    (void)state;
    double rs = (1.25 / 3.25) * (1.25 / 3.25);
    assert_true(fabs(refraction_at(56.309932474020215, 1, 1.5).reflectance - 0.5 * rs) <= 4 * u);
    assert_true(fabs(refraction_at(33.690067525979785, 1.5, 1).reflectance - 0.5 * rs) <= 4 * u);
    for (double angle = 1; angle < 90; angle++) { /* Rp >= 0, so Rs <= 2 R, with equality only here */
        double c = cos(angle * degree), through = sqrt(1 - (1 - c * c) / 2.25);
        double s = (c - 1.5 * through) / (c + 1.5 * through), p = (c * 1.5 - through) / (c * 1.5 + through);
        assert_true(fabs(refraction_at(angle, 1, 1.5).reflectance - 0.5 * (s * s + p * p)) <= 16 * u);
    }
}

/* Shifted by sin θ (1 − cos θ / (n cos θ')) of the thickness, to the same direction. */
static void case_35_slab_shifts_and_keeps_direction(void **state)
{
    (void)state;
    struct world world =
        world_made_of(shape_box(vec3_make(-50, 0, -50), vec3_make(50, 1, 50)), clear_glass(1.5));
    struct medium_pool media = {0};
    struct vec3 o = {0, 2, 0}, d = vec3_normalize(vec3_make(1, -1, 0));
    struct path path = path_along(ray_from(&world, o, d));
    struct bounce in = bounce_of(&world, &media, &path);
    assert_true(in.is_transmitted);
    struct bounce out = bounce_of(&world, &media, &in.transmitted);
    assert_true(out.is_transmitted && out.transmitted.medium == MEDIUM_SPACE);
    struct ray exit = out.transmitted.ray;
    assert_true(vec3_max_abs(vec3_sub(exit.direction, d)) <= 4 * u);
    assert_true(shoot_ray(&world, &exit).id == PRIMITIVE_NONE);
    double shift = vec3_length(vec3_cross(vec3_sub(exit.origin, o), d));
    double sine = sqrt(0.5), expected = sine * (1 - sine / sqrt(2.25 - 0.5));
    assert_true(fabs(expected - 0.329142308) < 1e-9 && fabs(shift - expected) <= 32 * u);
    medium_pool_finish(&media);
    world_end(&world);
}

/* Spread evenly across the sphere; every hundredth grazes it, down to 1e-12 of the radius. */
static struct ray ray_at_glass(const struct world *world, uint32_t i)
{
    struct vec3 d = random_unit(i, 0), w = vec3_normalize(vec3_cross(d, random_unit(i, 3)));
    double b = i % 100 ? sqrt(random_between(i, 6, 0, 1)) : 1 - pow(10, random_between(i, 6, -12, -2));
    return ray_from(world, vec3_add_scaled(vec3_scale(w, b), d, -3), d);
}

/* What enters a sphere can leave it: the angles are equal, so no exit is totally reflected. */
static void case_36_glass_sphere(void **state)
{
    (void)state;
    uint32_t total = getenv("FULL") ? 2000000 : 40000, wrong = 0, followed = 0;
    struct world world = world_made_of(shape_sphere(vec3_make(0, 0, 0), 1), clear_glass(1.5));
    for (uint32_t first = 0; first < total; first += 1000) {
        struct medium_pool media = {0};
        struct path_batch inside = {0};
        struct hit_batch hits = {0};
        double entry[1000];
        for (uint32_t i = first; i < first + 1000; i++) {
            struct path path = path_along(ray_at_glass(&world, i));
            struct hit_batch one = {0};
            struct ray_batch rays = {0};
            ray_batch_push(&rays, &path.ray);
            shoot_batch(world.plan, &rays, &one);
            struct hit hit = hit_at(world.plan, &rays, &one, 0);
            struct bounce bounce = bounce_at(&world, &media, &path, &hit);
            ray_batch_finish(&rays);
            hit_batch_finish(&one);
            if (!bounce.is_transmitted) /* so grazing that too little passes */
                continue;
            entry[inside.rays.count] = -vec3_dot(path.ray.direction, bounce.facing);
            path_batch_push(&inside, &bounce.transmitted);
        }
        shoot_batch(world.plan, &inside.rays, &hits);
        for (size_t i = 0; i < inside.rays.count; i++) {
            struct path path = path_batch_get(&inside, i);
            struct hit hit = hit_at(world.plan, &inside.rays, &hits, i);
            struct bounce bounce = bounce_at(&world, &media, &path, &hit);
            struct refraction exit = optics_refraction(path.ray.direction, bounce.facing, 1.5, 1);
            /* The sine carries the errors of point and normal, a few u; the cosine their quotient by itself. */
            bool same = !exit.total && fabs(exit.cosine_through - entry[i]) <= 64 * u / entry[i];
            wrong += !bounce.met || hit.side != SIDE_LEAVE || !same;
            followed++;
        }
        medium_pool_finish(&media);
        path_batch_finish(&inside);
        hit_batch_finish(&hits);
    }
    assert_int_equal(wrong, 0);
    assert_true(followed > total / 10 * 9);
    world_end(&world);
}

/* A textured, lit scene, with or without things of glass whose index is 1 in front, inside each other and in
 * the way of the light. */
static struct scene scene_with_nothing_glass(bool with)
{
    struct scene scene = scene_at(vec3_make(1, 3, 6), 45);
    scene.depth = 32;
    struct material floor = material_matte(grey(0.8));
    floor.color = (struct texture){.kind = TEXTURE_CHECKER, .color = {grey(0.9), grey(0.1)}, .size = 0.7};
    scene_add(&scene, shape_plane(vec3_make(0, -1, 0), vec3_make(0, 1, 0)), floor);
    scene_add(&scene, shape_sphere(vec3_make(-1, 0, -2), 1), material_mirror(grey(0.5)));
    scene_add_light(&scene, light_point(vec3_make(3, 6, 2), grey(1)));
    if (!with)
        return scene;
    scene_add(&scene, shape_sphere(vec3_make(0, 0, 0), 0.9), clear_glass(1));
    scene_add(&scene, shape_box(vec3_make(-0.3, -0.8, -0.2), vec3_make(1.7, 0.4, 0.5)), clear_glass(1));
    scene_add(&scene, shape_globe(vec3_make(0.4, 0.5, 1), 0.6, 6, 9), clear_glass(1));
    scene_add(&scene, shape_frustum(vec3_make(-1, -1, 1), vec3_make(-1, 1, 0.4), 0.5, 0.2), clear_glass(1));
    return scene;
}

static void case_37_glass_of_index_one_is_invisible(void **state)
{
    (void)state;
    struct scene without = scene_with_nothing_glass(false), with = scene_with_nothing_glass(true);
    for (size_t k = 0; kernel_at(k); k++) {
        struct vec3 *a = scene_render(&without, kernel_at(k), NULL),
                    *b = scene_render(&with, kernel_at(k), NULL);
        unsigned different = 0;
        for (size_t i = 0; i < (size_t)with.width * with.height; i++)
            different += vec3_max_abs(vec3_sub(a[i], b[i])) != 0;
        assert_int_equal(different, 0);
        free(a);
        free(b);
    }
    scene_finish(&without);
    scene_finish(&with);
}

/* What a ray finds at a glass sphere in white surroundings, whose reflectance there is r: it is mirrored
 * (r), or goes in and is let out at some meeting with the wall; depth and the least throughput cut the rest. */
static double furnace_radiance(double r, uint32_t depth)
{
    double found = r >= THROUGHPUT_MIN ? r : 0, inside = 1 - r;
    for (uint32_t generation = 1; generation < depth && inside >= THROUGHPUT_MIN; generation++) {
        double out = inside * (1 - r);
        found += out >= THROUGHPUT_MIN ? out : 0;
        inside *= r;
    }
    return found;
}

static void case_38_furnace(void **state)
{
    (void)state;
    struct world world = world_made_of(shape_sphere(vec3_make(0, 0, 0), 1), clear_glass(1.5));
    world.scene.background.color[0] = grey(1);
    for (uint32_t depth = 2; depth <= 16; depth += 7)
        for (uint32_t i = 0; i < 300; i++) {
            double b = 0.995 * sqrt(random_between(i, 0, 0, 1)), angle = asin(b) / degree;
            double expected = furnace_radiance(refraction_at(angle, 1, 1.5).reflectance, depth);
            struct vec3 eye = {0, 0,
                               5}; /* the sphere's silhouette is seen at asin(1/5), the ray at asin(b/5) */
            world.scene.camera = (struct camera){eye, {b / sqrt(1 - b * b / 25), 0, 0}, {0, 1, 0}, 30};
            world.scene.depth = depth;
            double found = scene_look(&world.scene).x;
            assert_true(found <= 1 + 8 * u && fabs(found - expected) <= 1e-12 / (1 - b));
        }
    struct world mirror = world_made_of(shape_sphere(vec3_make(0, 0, 0), 1), material_mirror(grey(1)));
    mirror.scene.background.color[0] = grey(1);
    mirror.scene.camera = (struct camera){{0.3, 0.2, 5}, {0, 0, 0}, {0, 1, 0}, 15};
    struct vec3 *pixels = scene_render(&mirror.scene, kernel_default(), NULL);
    for (size_t i = 0; i < (size_t)mirror.scene.width * mirror.scene.height; i++)
        assert_true(pixels[i].x == 1);
    free(pixels);
    world_end(&world);
    world_end(&mirror);
}

/* A hundred bounces inside a closed mirror never leave it and never meet the place they start from: each
 * point is on the wall to within its stated error, and each way is as long as the closed form says where
 * there is one. */
static void case_47_a_hundred_bounces(void **state)
{
    (void)state;
    struct world worlds[] = {
        world_made_of(shape_sphere(vec3_make(0, 0, 0), 1), material_mirror(grey(1))),
        world_made_of(shape_box(vec3_make(-1, -0.7, -0.9), vec3_make(1, 0.8, 0.6)), material_mirror(grey(1))),
        world_made_of(shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 1, 0), 1, 1), material_mirror(grey(1))),
        world_made_of(shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 1, 0), 1, 0.4), material_mirror(grey(1))),
        world_made_of(shape_globe(vec3_make(0, 0, 0), 1, 6, 9), material_mirror(grey(1)))};
    for (size_t k = 0; k < 5; k++) {
        const struct shape *shape = &worlds[k].scene.objects[0].shape;
        for (uint32_t i = 0; i < 60; i++) {
            struct medium_pool media = {0};
            struct vec3 from = vec3_scale(random_vector(i, 0), 0.3);
            struct path path = path_along(ray_from(&worlds[k], from, random_unit(i, 3)));
            double chord = 0;
            for (int bounces = 0; bounces < 100; bounces++) {
                struct bounce bounce = bounce_of(&worlds[k], &media, &path);
                assert_true(bounce.is_mirrored && bounce.hit.side == SIDE_LEAVE);
                struct surface at = bounce.surface;
                if (shape->kind != SHAPE_MESH)
                    assert_true(fabs((double)limits_distance(shape, quad_of(at.position))) <= 2 * at.error);
                if (k == 0 && bounces > 1) /* u a bounce, over the sine at which the chord meets the wall */
                    assert_true(fabs(bounce.hit.t - chord) <= 800 * u / chord);
                chord = bounces == 1 ? bounce.hit.t : chord;
                path = bounce.mirrored;
            }
            medium_pool_finish(&media);
        }
        world_end(&worlds[k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_32_reflectance_head_on),
        cmocka_unit_test(case_33_total_internal_reflection),
        cmocka_unit_test(case_34_brewster),
        cmocka_unit_test(case_35_slab_shifts_and_keeps_direction),
        cmocka_unit_test(case_36_glass_sphere),
        cmocka_unit_test(case_37_glass_of_index_one_is_invisible),
        cmocka_unit_test(case_38_furnace),
        cmocka_unit_test(case_47_a_hundred_bounces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
