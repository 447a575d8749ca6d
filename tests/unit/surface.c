/*
 * The surface at a hit against closed forms, and its footprint against neighbouring rays.
 */
#include "trace/surface.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"

/* A plan of one object and the camera at `eye`. The scene lives as long as the plan. */
struct world {
    struct scene scene;
    struct plan *plan;
};

static struct world world_of(struct shape shape, struct affine transform, struct vec3 eye)
{
    struct world world = {.scene = scene_at(eye, 40)};
    scene_add(&world.scene, shape, material_matte(grey(1)))->transform = transform;
    struct trace_settings settings = settings_of(&world.scene);
    world.plan = plan_create(&world.scene, &settings, 1);
    return world;
}

static void world_end(struct world *world)
{
    plan_destroy(&world->plan);
    scene_finish(&world->scene);
}

static struct ray ray_along(struct vec3 origin, struct vec3 direction)
{
    return (struct ray){.origin = origin,
                        .direction = direction,
                        .t_max = INFINITY,
                        .key_min = KEY_NONE,
                        .from = PRIMITIVE_NONE};
}

static bool nearest_hit(const struct world *world, const struct ray *ray, struct hit *hit)
{
    struct ray_batch rays = {0};
    struct hit_batch hits = {0};
    ray_batch_push(&rays, ray);
    hit_batch_reserve(&hits, 1);
    kernel_ref.closest(world->plan, &rays, &hits);
    *hit = hit_at(world->plan, &rays, &hits, 0);
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
    return hit->id != PRIMITIVE_NONE;
}

/* --- points and normals ----------------------------------------------------------------------------------- */

/* Rays from the eye at points spread over the shape's surroundings; check() sees point and normal relative to
 * the shape's own middle, which is at the world's origin. */
static void look_from_all_sides(struct shape (*make)(void), struct affine transform, double distance,
                                void (*check)(struct vec3 point, struct vec3 normal, double error))
{
    unsigned met = 0;
    for (uint32_t i = 0; i < 400; i++) {
        struct vec3 eye = vec3_scale(random_unit(i, 0), distance);
        struct world world = world_of(make(), transform, eye);
        for (uint32_t k = 0; k < 20; k++) {
            struct vec3 target = vec3_scale(random_vector(20 * i + k, 3), 0.9);
            struct ray ray = ray_along(vec3_make(0, 0, 0), vec3_normalize(vec3_sub(target, eye)));
            struct hit hit;
            if (!nearest_hit(&world, &ray, &hit))
                continue;
            struct surface surface = surface_at(world.plan, &ray, &hit);
            assert_true(fabs(vec3_length(surface.normal) - 1) <= 4 * DBL_EPSILON);
            assert_true(surface.error <= 64 * DBL_EPSILON * (distance + 4));
            check(vec3_add(surface.position, eye), surface.normal, surface.error + 4 * DBL_EPSILON * distance);
            met++;
        }
        world_end(&world);
    }
    assert_true(met > 3000);
}

static bool is_near(struct vec3 a, struct vec3 b, double tolerance)
{
    return vec3_max_abs(vec3_sub(a, b)) <= tolerance;
}

static struct shape the_sphere(void)
{
    return shape_sphere(vec3_make(0, 0, 0), 1);
}

static void check_sphere(struct vec3 p, struct vec3 n, double error)
{
    assert_true(fabs(vec3_length(p) - 1) <= 2 * error);
    assert_true(is_near(n, p, 4 * error));
}

static void check_ellipsoid(struct vec3 p, struct vec3 n, double error)
{
    struct vec3 gradient = {p.x / 1, p.y / 0.25, p.z / 4};
    assert_true(fabs(p.x * gradient.x + p.y * gradient.y + p.z * gradient.z - 1) <= 8 * error);
    assert_true(is_near(n, vec3_normalize(gradient), 16 * error));
}

static struct shape the_cone(void)
{
    return shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 1, 0), 1, 0);
}

/* The side's normal rises by R / H = 1/2 against its way outwards. */
static void check_cone(struct vec3 p, struct vec3 n, double error)
{
    double radius = sqrt(p.x * p.x + p.z * p.z);
    if (n.y < -0.5) {
        assert_true(fabs(p.y + 1) <= 2 * error && is_near(n, vec3_make(0, -1, 0), 2 * DBL_EPSILON));
        return;
    }
    assert_true(fabs(radius - 0.5 * (1 - p.y)) <= 4 * error);
    if (radius > 0.01)
        assert_true(is_near(n, vec3_normalize(vec3_make(p.x / radius, 0.5, p.z / radius)), 8 * error / radius));
}

static struct shape the_box(void)
{
    return shape_box(vec3_make(-0.5, -0.75, -1), vec3_make(0.5, 0.75, 1));
}

static void check_box(struct vec3 p, struct vec3 n, double error)
{
    struct vec3 distance = {fabs(fabs(p.x) - 0.5), fabs(fabs(p.y) - 0.75), fabs(fabs(p.z) - 1)};
    assert_true(vec3_dot(n, p) > 0 && fabs(n.x) + fabs(n.y) + fabs(n.z) == 1);
    assert_true(fabs(n.x) * distance.x + fabs(n.y) * distance.y + fabs(n.z) * distance.z <= 2 * error);
}

static struct shape the_disc(void)
{
    return shape_disc(vec3_make(0, 0, 0), vec3_normalize(vec3_make(1, 2, 2)), 1);
}

static void check_disc(struct vec3 p, struct vec3 n, double error)
{
    assert_true(is_near(n, vec3_normalize(vec3_make(1, 2, 2)), 2 * DBL_EPSILON));
    assert_true(fabs(vec3_dot(n, p)) <= 3 * error && vec3_length(p) <= 1 + 3 * error);
}

static void points_and_normals_are_exact(void **state)
{
    (void)state;
    struct affine one = affine_identity(), stretch = affine_scaling(vec3_make(1, 0.5, 2));
    for (double distance = 4; distance < 1e7; distance *= 1000) {
        look_from_all_sides(the_sphere, one, distance, check_sphere);
        look_from_all_sides(the_sphere, stretch, distance, check_ellipsoid);
        look_from_all_sides(the_cone, one, distance, check_cone);
        look_from_all_sides(the_box, one, distance, check_box);
        look_from_all_sides(the_disc, one, distance, check_disc);
    }
}

/* The same cone, once built in place and once placed by a turn, a mirror image and a scale: the normals agree.
 */
static void transforms_carry_points_and_normals(void **state)
{
    (void)state;
    struct affine turn = affine_rotation(vec3_normalize(vec3_make(1, 2, 3)), 50);
    struct affine mirror = affine_scaling(vec3_make(-2, 2, 2)), shear = affine_identity();
    shear.linear.x.y = 0.5;
    struct affine similar = affine_multiply(&turn, &mirror), skewed = affine_multiply(&similar, &shear);
    const struct affine *const transforms[] = {&similar, &skewed};
    for (uint32_t i = 0; i < 4000; i++) {
        const struct affine *m = transforms[i % 2];
        struct vec3 eye = vec3_scale(random_unit(i, 0), 6);
        struct world placed = world_of(the_cone(), *m, eye);
        struct world plain = world_of(the_cone(), affine_identity(), vec3_make(0, 0, 0));
        struct mat3 inverse = mat3_inverse(&m->linear);
        struct vec3 d = vec3_normalize(vec3_sub(vec3_scale(random_vector(i, 3), 0.7), eye));
        struct ray ray = ray_along(vec3_make(0, 0, 0), d),
                   back = ray_along(mat3_apply(&inverse, eye), vec3_normalize(mat3_apply(&inverse, d)));
        struct hit hit, same;
        if (nearest_hit(&placed, &ray, &hit) && nearest_hit(&plain, &back, &same)) {
            struct surface a = surface_at(placed.plan, &ray, &hit), b = surface_at(plain.plan, &back, &same);
            assert_int_equal(hit.part, same.part);
            struct vec3 position = mat3_apply(&m->linear, b.position);
            assert_true(is_near(vec3_add(a.position, eye), position, 1e-11));
            struct vec3 normal = vec3_normalize(mat3_apply_transposed(&inverse, b.normal));
            assert_true(is_near(a.normal, normal, 1e-10));
        }
        world_end(&placed);
        world_end(&plain);
    }
}

/* --- footprints ------------------------------------------------------------------------------------------- */

/* The neighbouring ray h shares away, by x or by y. */
static struct ray neighbour(const struct ray *ray, const struct footprint *footprint, bool by_y, double h)
{
    struct vec3 o = by_y ? footprint->origin_y : footprint->origin_x;
    struct vec3 d = by_y ? footprint->direction_y : footprint->direction_x;
    return ray_along(vec3_add_scaled(ray->origin, o, h), vec3_normalize(vec3_add_scaled(ray->direction, d, h)));
}

static struct surface surface_beside(const struct world *world, const struct ray *ray, const struct hit *same)
{
    struct hit hit;
    assert_true(nearest_hit(world, ray, &hit));
    assert_int_equal(hit.id, same->id);
    assert_int_equal(hit.part, same->part);
    return surface_at(world->plan, ray, &hit);
}

static void check_footprint(const struct world *world, const struct ray *ray, const struct footprint *footprint,
                            const struct hit *hit, double tolerance)
{
    const double h = 1e-5;
    struct surface here = surface_at(world->plan, ray, hit);
    struct surface_footprint spread = surface_footprint_at(world->plan, ray, footprint, hit, &here);
    for (int by_y = 0; by_y < 2; by_y++) {
        struct ray after = neighbour(ray, footprint, by_y, h), before = neighbour(ray, footprint, by_y, -h);
        struct surface a = surface_beside(world, &after, hit), b = surface_beside(world, &before, hit);
        struct vec3 position = vec3_scale(vec3_sub(a.position, b.position), 0.5 / h);
        struct vec3 normal = vec3_scale(vec3_sub(a.shading_normal, b.shading_normal), 0.5 / h);
        assert_true(is_near(by_y ? spread.position_y : spread.position_x, position, tolerance));
        assert_true(is_near(by_y ? spread.normal_y : spread.normal_x, normal, tolerance));
    }
}

/* Random rays with random footprints at a shape. Grazing ones and those near an edge, whose neighbours may meet
 * another piece, are left out. */
static void check_footprints(struct world world, double tolerance)
{
    unsigned compared = 0;
    struct vec3 eye = world.plan->eye;
    for (uint32_t i = 0; i < 3000; i++) {
        struct vec3 target = vec3_sub(vec3_scale(random_vector(i, 0), 0.6), eye);
        struct ray ray = ray_along(vec3_scale(random_vector(i, 3), 0.1), vec3_make(0, 0, 1));
        ray.direction = vec3_normalize(vec3_sub(target, ray.origin));
        struct footprint footprint = {random_vector(i, 6), random_vector(i, 9), random_vector(i, 12),
                                      random_vector(i, 15), 0.25, -0.4};
        footprint.direction_x = vec3_add_scaled(footprint.direction_x, ray.direction,
                                                -vec3_dot(footprint.direction_x, ray.direction));
        footprint.direction_y = vec3_add_scaled(footprint.direction_y, ray.direction,
                                                -vec3_dot(footprint.direction_y, ray.direction));
        struct hit hit, beside;
        bool keeps = nearest_hit(&world, &ray, &hit);
        for (int k = 0; keeps && k < 4; k++) {
            struct ray other = neighbour(&ray, &footprint, k & 1, k & 2 ? 1e-3 : -1e-3);
            keeps = nearest_hit(&world, &other, &beside) && beside.id == hit.id && beside.part == hit.part;
        }
        if (!keeps || vec3_dot(surface_at(world.plan, &ray, &hit).normal, ray.direction) > -0.5)
            continue;
        check_footprint(&world, &ray, &footprint, &hit, tolerance);
        compared++;
    }
    assert_true(compared > 100);
    world_end(&world);
}

/* Central differences over h = 1e-5: h² times third derivatives (curvature 2 at most, footprints up to 5 long
 * at the surface, a cosine above 1/2), and rounding of 1e-16 × 4 / h. */
static void footprints_are_derivatives(void **state)
{
    (void)state;
    struct vec3 eye = {0.5, 1, 3};
    struct affine one = affine_identity(), stretch = affine_scaling(vec3_make(1, 0.75, 1.25));
    check_footprints(world_of(shape_sphere(vec3_make(0, 0, 0), 1), one, eye), 1e-6);
    check_footprints(world_of(shape_sphere(vec3_make(0, 0, 0), 1), stretch, eye), 1e-6);
    check_footprints(world_of(shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 1, 0), 1, 0.5), one, eye), 1e-6);
    check_footprints(world_of(shape_frustum(vec3_make(0, -1, 0), vec3_make(0, 1, 0), 1, 0.5), stretch, eye),
                     1e-6);
    check_footprints(
        world_of(shape_plane(vec3_make(0, 0, 0), vec3_normalize(vec3_make(0.1, 0.2, 1))), one, eye), 1e-6);
    check_footprints(world_of(shape_globe(vec3_make(0, 0, 0), 1, 6, 8), one, eye), 1e-6);
    check_footprints(
        world_of(shape_globe(vec3_make(0, 0, 0), 1, 6, 8), affine_scaling(vec3_make(-1, 0.75, 1.25)), eye),
        1e-6);
}

/* --- meshes ----------------------------------------------------------------------------------------------- */

/* The normals of a smooth globe point along the exact sphere's, at the corners exactly; its flat ones are those
 * of the triangles, on the outside, mirrored or not. */
static void smooth_normals_follow_the_corners(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        struct vec3 eye = {0, 0, 5};
        struct world world = world_of(shape_globe(vec3_make(0, 0, 0), 1, 20, 30),
                                      affine_scaling(vec3_make(mirrored ? -1 : 1, 1, 1)), eye);
        for (uint32_t i = 0; i < 2000; i++) {
            struct vec3 target = vec3_scale(random_unit(i, 0), 0.9);
            struct ray ray = ray_along(vec3_make(0, 0, 0), vec3_normalize(vec3_sub(target, eye)));
            struct hit hit;
            assert_true(nearest_hit(&world, &ray, &hit));
            struct surface surface = surface_at(world.plan, &ray, &hit);
            struct vec3 out = vec3_normalize(vec3_add(surface.position, eye));
            assert_int_equal(hit.side, SIDE_ENTER);
            assert_true(is_near(surface.shading_normal, out, 0.005)); /* the sag over half a cell, squared */
            assert_true(is_near(surface.normal, out, 0.2));           /* half a cell: 0.13 and 0.1 */
            assert_true(vec3_dot(surface.normal, ray.direction) < 0);
        }
        world_end(&world);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_and_normals_are_exact),
        cmocka_unit_test(transforms_carry_points_and_normals),
        cmocka_unit_test(footprints_are_derivatives),
        cmocka_unit_test(smooth_normals_follow_the_corners),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
