/*
 * Hard cases 1 to 12: spheres, and what any primitive must do under scaling, mirroring, turning and moving.
 */
#include "tests/numeric/shoot.h"

static const double u = DBL_EPSILON / 2;

/* Any vector of length 1 across d. */
static struct vec3 across(struct vec3 d, uint32_t index, uint32_t draw)
{
    return vec3_normalize(vec3_cross(d, random_unit(index, draw)));
}

/* A ray that passes the middle at distance b, from s before its nearest point. */
static struct ray passing(const struct world *world, struct vec3 center, double b, double s, uint32_t index)
{
    struct vec3 d = random_unit(index, 0), w = across(d, index, 3);
    return ray_from(world, vec3_add_scaled(vec3_add_scaled(center, w, b), d, -s), d);
}

static void case_01_just_inside_and_just_outside(void **state)
{
    (void)state;
    const struct vec3 center = {0.5, -0.25, 0.75};
    struct world world = world_plain(shape_sphere(center, 1));
    for (uint32_t i = 0; i < 2000; i++) {
        double s = random_between(i, 6, 1.5, 4);
        struct ray inside = passing(&world, center, 1 - 1e-12, s, i);
        struct ray outside = passing(&world, center, 1 + 1e-12, s, i);
        struct hit hit = shoot_ray(&world, &inside);
        check_hit(&hit, SIDE_ENTER, s, 2e-6); /* half the chord is √(2e-12) */
        assert_int_equal(shoot_ray(&world, &outside).id, PRIMITIVE_NONE);
    }
    world_end(&world);
}

/* Hit or miss, but the same on every kernel (shoot_ray sees to that), and a hit is near the point of
 * tangency. */
static void case_02_exactly_tangent(void **state)
{
    (void)state;
    struct world world = world_plain(shape_sphere(vec3_make(0, 0, 0), 1));
    struct hit exact = shoot(&world, vec3_make(1, 0, -3), vec3_make(0, 0, 1));
    assert_true(exact.id == PRIMITIVE_NONE || exact.t == 3);
    for (uint32_t i = 0; i < 2000; i++) {
        double s = random_between(i, 6, 1.5, 4);
        struct ray ray = passing(&world, vec3_make(0, 0, 0), 1, s, i);
        struct hit hit = shoot_ray(&world, &ray);
        assert_true(hit.id == PRIMITIVE_NONE || fabs(hit.t - s) <= sqrt(2 * 32 * 4 * u)); /* moved by 32 D u */
    }
    world_end(&world);
}

/* Not grazing: at most 0.9 r beside the middle. */
static void case_03_camera_a_million_radii_away(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 500; i++) {
        double r = random_between(i, 20, 0.5, 2);
        struct vec3 eye = vec3_scale(random_unit(i, 21), 1e6 * r);
        struct world world = world_of(shape_sphere(vec3_make(0, 0, 0), r), affine_identity(), eye);
        for (uint32_t k = 0; k < 8; k++) {
            struct vec3 target = vec3_scale(random_unit(8 * i + k, 24), 0.9 * r);
            struct ray ray = ray_from(&world, eye, vec3_sub(target, eye));
            check_against_oracle(&world, &ray, 1e-9 * r);
        }
        world_end(&world);
    }
}

/* The sphere a million away from the world's origin; the camera moved with it, or left behind. */
static void case_04_scene_moved_by_a_million(void **state)
{
    (void)state;
    const struct vec3 far = {1e6, -1e6, 1e6 / 3};
    for (uint32_t i = 0; i < 400; i++) {
        struct vec3 eye = vec3_add_scaled(far, random_unit(i, 20), 4), left = {0, 0, 0};
        struct shape moved = shape_sphere(far, 1), placed = shape_sphere(vec3_make(0.1, 0.2, -0.3), 1);
        struct affine stay = affine_identity(), move = affine_translation(far);
        struct world worlds[] = {world_of(moved, stay, eye), world_of(placed, move, eye),
                                 world_of(moved, stay, left), world_of(placed, move, left)};
        for (size_t k = 0; k < 4; k++) {
            struct vec3 target = vec3_add_scaled(far, random_unit(i, 23), 0.6);
            struct ray ray = ray_from(&worlds[k], eye, vec3_sub(target, eye));
            check_against_oracle(&worlds[k], &ray,
                                 k < 3 ? 1e-10 : 4e-10); /* last: the centre is rounded to 1e-10 */
            world_end(&worlds[k]);
        }
    }
}

static void case_05_origin_at_the_centre(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) {
        double r = ldexp(random_between(i, 0, 1, 2), (int)(i % 60) - 30);
        struct vec3 center = vec3_scale(random_vector(i, 1), 10);
        struct world world = world_plain(shape_sphere(center, r));
        check_shot(&world, center, random_unit(i, 4), SIDE_LEAVE, r, 4 * u * r);
        world_end(&world);
    }
}

/* On the sphere, a ray leaves it or goes in: no distance can say which, so `departure` does. */
static void case_06_from_the_surface_outwards_meets_nothing(void **state)
{
    (void)state;
    struct world world = world_plain(shape_sphere(vec3_make(0, 0, 0), 1));
    for (uint32_t i = 0; i < 5000; i++) {
        struct vec3 n = random_unit(i, 0), t = across(n, i, 3);
        double rise = pow(10, random_between(i, 6, -17, 0)); /* down to nearly tangent */
        struct ray ray = ray_from(&world, n, vec3_add_scaled(t, n, rise));
        ray.from = 0;
        ray.departure = DEPART_OUTWARD;
        assert_int_equal(shoot_ray(&world, &ray).id, PRIMITIVE_NONE);
    }
    assert_misses(&world, vec3_make(0, 0, 1),
                  vec3_make(0, 0, 1)); /* a camera on the sphere: t = 0 is behind it */
    world_end(&world);
}

static void case_07_from_the_surface_inwards_crosses_the_chord(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 5000; i++) {
        double r = random_between(i, 0, 0.1, 10);
        struct world world = world_plain(shape_sphere(vec3_make(0, 0, 0), r));
        struct vec3 n = random_unit(i, 1), t = across(n, i, 4);
        double angle = random_between(i, 7, 0, 1.57);
        struct vec3 d = vec3_sub(vec3_scale(t, sin(angle)), vec3_scale(n, cos(angle)));
        struct ray ray = ray_from(&world, vec3_scale(n, r), d);
        ray.from = 0;
        ray.departure = DEPART_INWARD;
        struct hit hit = shoot_ray(&world, &ray);
        double rounded_start = 4 * u * r / cos(angle);
        check_hit(&hit, SIDE_LEAVE, 2 * r * cos(angle), 8 * u * r + rounded_start);
        world_end(&world);
    }
}

static void case_08_tiny_and_huge_radii(void **state)
{
    (void)state;
    static const double radii[] = {1e-9, 1e9, 1e-60, 1e60};
    for (size_t k = 0; k < 4; k++)
        for (uint32_t i = 0; i < 500; i++) {
            double r = radii[k], D = random_between(i, 0, 2, 20);
            struct vec3 eye = vec3_scale(random_unit(i, 1), D * r);
            struct world world = world_of(shape_sphere(vec3_make(0, 0, 0), r), affine_identity(), eye);
            struct ray ray = ray_from(&world, eye, vec3_sub(vec3_scale(random_unit(i, 4), 0.9 * r), eye));
            check_against_oracle(&world, &ray, 200 * u * D * r);
            world_end(&world);
        }
}

/* --- every kind of primitive ------------------------------------------------------------------------------ */

enum { KINDS = 8 };

static struct shape shape_number(size_t kind)
{
    static const struct vec3 triangle[] = {{-1, -0.8, 0.2}, {1.1, -0.7, -0.1}, {0.1, 1.2, 0.3}};
    static const uint32_t corners[] = {0, 1, 2};
    switch (kind) {
    case 0:
        return shape_sphere(vec3_make(0.1, -0.2, 0.15), 1.1);
    case 1:
        return shape_plane(vec3_make(0.1, 0.2, 0.3), vec3_normalize(vec3_make(1, 2, -2)));
    case 2:
        return shape_disc(vec3_make(0.1, 0.2, 0.1), vec3_normalize(vec3_make(-1, 2, 3)), 1.2);
    case 3:
        return shape_frustum(vec3_make(0.2, -0.9, 0.1), vec3_make(-0.1, 0.8, 0.3), 0.7, 0.7);
    case 4:
        return shape_frustum(vec3_make(0.2, -0.9, 0.1), vec3_make(-0.1, 0.8, 0.3), 0.9, 0);
    case 5:
        return shape_tube(vec3_make(0.2, -0.9, 0.1), vec3_make(-0.1, 0.8, 0.3), 0.5, 0.9);
    case 6:
        return shape_box(vec3_make(-0.8, -0.6, -0.9), vec3_make(0.7, 0.9, 0.6));
    default:
        return shape_mesh(triangle, 3, corners, 1, false);
    }
}

static struct vec3 mirrored(struct vec3 v, int axis)
{
    return vec3_make(axis == 0 ? -v.x : v.x, axis == 1 ? -v.y : v.y, axis == 2 ? -v.z : v.z);
}

static struct affine mirror(int axis)
{
    return affine_scaling(mirrored(vec3_make(1, 1, 1), axis));
}

/* The scene mirrored as a scene file would say it, by a scale of −1 along one axis, and the ray with it. */
static void case_10_mirrored_scene_mirrors_exactly(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++)
        for (int axis = 0; axis < 3; axis++) {
            struct vec3 eye = {0.3, 0.7, 4.1};
            struct world plain = world_of(shape_number(kind), affine_identity(), eye);
            struct world turned = world_of(shape_number(kind), mirror(axis), mirrored(eye, axis));
            unsigned met = 0, different = 0;
            for (uint32_t i = 0; i < 400; i++) {
                struct vec3 o = vec3_scale(random_vector(i, 0), 4), d = vec3_sub(random_vector(i, 3), o);
                struct hit a = shoot(&plain, o, d), b = shoot(&turned, mirrored(o, axis), mirrored(d, axis));
                met += a.id != PRIMITIVE_NONE;
                different += !hits_are_equal(&a, &b);
            }
            if (different || met < 60)
                fail_msg("primitive %zu mirrored along %d: %u of %u hits differ", kind, axis, different, met);
            world_end(&plain);
            world_end(&turned);
        }
}

/* A scene and ray turned about a common point give the same t. Rays that meet their surface at less than
 * about six degrees are left out: there t is ill-conditioned. */
static void case_11_rigid_rotation_keeps_t(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++) {
        unsigned met = 0;
        for (uint32_t i = 0; i < 400; i++) {
            struct affine turn = affine_rotation(random_unit(i, 30), random_between(i, 33, -180, 180));
            struct vec3 eye = vec3_scale(random_unit(i, 34), 3);
            struct world plain = world_of(shape_number(kind), affine_identity(), eye);
            struct world turned = world_of(shape_number(kind), turn, affine_point(&turn, eye));
            struct ray ray = ray_from(&plain, eye, vec3_sub(vec3_scale(random_vector(i, 0), 0.5), eye));
            struct ray same =
                ray_from(&turned, affine_point(&turn, eye), mat3_apply(&turn.linear, ray.direction));
            struct hit a = shoot_ray(&plain, &ray), b = shoot_ray(&turned, &same);
            assert_int_equal(a.id, b.id);
            if (a.id != PRIMITIVE_NONE &&
                fabs(vec3_dot(surface_at(plain.plan, &ray, &a).normal, ray.direction)) > 0.1) {
                check_hit(&b, a.side, a.t, 1e-12 * a.t);
                met++;
            }
            world_end(&plain);
            world_end(&turned);
        }
        assert_true(met > 100);
    }
}

/* From a to b the near wall is at t; from b to a the far wall is: the two t's sum to the distance. */
static void case_12_both_directions_sum_to_the_distance(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++) {
        struct world world = world_plain(shape_number(kind));
        bool solid = shape_is_closed(&world.scene.objects[0].shape) && kind != 5;
        unsigned met = 0;
        for (uint32_t i = 0; i < 1000; i++) {
            struct vec3 a = vec3_scale(random_unit(i, 0), 4);
            struct vec3 b = vec3_add_scaled(vec3_scale(random_vector(i, 6), 0.6), a, -1);
            double distance = vec3_length(vec3_sub(b, a));
            struct hit there = shoot(&world, a, vec3_sub(b, a));
            struct ray back = ray_from(&world, b, vec3_sub(a, b));
            struct hit here = shoot_ray(&world, &back);
            if (here.id != PRIMITIVE_NONE && solid) {
                struct ray rest = ray_beyond(back, &here);
                here = shoot_ray(&world, &rest);
            }
            if (there.id == PRIMITIVE_NONE || there.t > distance || (kind == 5 && there.side == here.side))
                continue; /* a plane may be met beyond b, and a tube from inside first */
            assert_true(here.id == 0);
            struct vec3 n = surface_at(world.plan, &back, &here).normal;
            check_hit(&here, there.side == SIDE_ENTER ? SIDE_LEAVE : SIDE_ENTER, distance - there.t,
                      64 * u * distance / fabs(vec3_dot(n, back.direction)));
            met++;
        }
        assert_true(met > 200);
        world_end(&world);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_01_just_inside_and_just_outside),
        cmocka_unit_test(case_02_exactly_tangent),
        cmocka_unit_test(case_03_camera_a_million_radii_away),
        cmocka_unit_test(case_04_scene_moved_by_a_million),
        cmocka_unit_test(case_05_origin_at_the_centre),
        cmocka_unit_test(case_06_from_the_surface_outwards_meets_nothing),
        cmocka_unit_test(case_07_from_the_surface_inwards_crosses_the_chord),
        cmocka_unit_test(case_08_tiny_and_huge_radii),
        cmocka_unit_test(case_10_mirrored_scene_mirrors_exactly),
        cmocka_unit_test(case_11_rigid_rotation_keeps_t),
        cmocka_unit_test(case_12_both_directions_sum_to_the_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
