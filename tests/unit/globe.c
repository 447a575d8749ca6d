/*
 * Spheres whose surface passes near the camera: the heights of hits above the ground, in quadruple precision.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "math/twofold.h"
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "tests/unit/roots_help.h"
#include "trace/surface.h"

typedef __float128 real;

enum { CASES = 20000 };

/* A globe and a camera at `height` above some place of it. No double can say where its centre is, seen from there. */
struct ground {
    struct scene scene;
    struct plan *plan;
};

static struct ground ground_create(uint32_t i, double radius, double height)
{
    struct vec3 up = random_unit(i, 0), away = vec3_scale(random_vector(i, 3), radius);
    struct vec3 place = vec3_scale(random_vector(i, 30), 0.3 * radius);
    struct ground ground = {.scene = scene_at(vec3_add_scaled(place, up, radius + height), 40)};
    ground.scene.camera.at = vec3_add(ground.scene.camera.from, random_unit(i, 6));
    scene_add(&ground.scene, shape_sphere(vec3_sub(place, away), radius), material_matte(grey(1)))->transform =
        affine_translation(away);
    struct trace_settings settings = settings_of(&ground.scene);
    ground.plan = plan_create(&ground.scene, &settings, 1);
    return ground;
}

static void ground_destroy(struct ground *ground)
{
    plan_destroy(&ground->plan);
    scene_finish(&ground->scene);
}

static real square(real x)
{
    return x * x;
}

/* How high o + t d, relative to the camera, is above the globe, as long as that is little compared with the radius. */
static double height_at(const struct ground *ground, struct vec3 o, struct vec3 d, double t)
{
    const struct scene *scene = &ground->scene;
    const struct vec3 eye = scene->camera.from, away = scene->objects[0].transform.offset;
    const struct vec3 center = scene->objects[0].shape.sphere.center;
    real radius = scene->objects[0].shape.sphere.radius;
    real x = (real)eye.x + o.x + (real)t * d.x - away.x - center.x;
    real y = (real)eye.y + o.y + (real)t * d.y - away.y - center.y;
    real z = (real)eye.z + o.z + (real)t * d.z - away.z - center.z;
    return (double)((square(x) + square(y) + square(z) - square(radius)) / (2 * radius));
}

static void sums_and_products_are_exact(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < CASES; i++) {
        double a = ldexp(random_signed(i, 0), (int)(i % 40)), b = random_signed(i, 1) + 1e-9 * random_signed(i, 2);
        struct twofold sum = twofold_sum(a, b), product = twofold_product(a, b), all = twofold_add(sum, product);
        assert_true((real)sum.high + sum.low == (real)a + b);
        assert_true((real)product.high + product.low == (real)a * b);
        double off = (double)((real)all.high + all.low - ((real)a + b + (real)a * b));
        assert_true(fabs(off) <= 0x1p-100 * (fabs(a) + fabs(b)));
    }
}

/* Of its distance, whatever the radius. */
static void the_ground_is_where_it_is(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < CASES; i++) {
        double radius = pow(10, random_between(i, 10, 0, 9)), height = radius * ldexp(1, -5 - (int)(i % 25));
        struct ground ground = ground_create(i, radius, height);
        struct vec3 o = {0, 0, 0}, d = random_unit(i, 11);
        assert_int_equal(ground.plan->count[PRIMITIVE_GLOBE], 1);
        struct roots roots = globe_roots(&ground.plan->globes[0], o, d);
        if (roots.enter > 0 && roots.enter < 0.4 * radius) {
            assert_true(fabs(height_at(&ground, o, d, roots.enter)) <= 4 * DBL_EPSILON * roots.enter);
            struct ray ray = {o, d, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, DEPART_OUTWARD};
            struct hit hit = {roots.enter, 0, SIDE_ENTER, 0};
            struct surface surface = surface_at(ground.plan, &ray, &hit);
            assert_true(fabs(height_at(&ground, surface.position, d, 0)) <= surface.error);
            assert_true(surface.error <= 20 * DBL_EPSILON * roots.enter);
        }
        ground_destroy(&ground);
    }
}

/* Rays past the horizon, whose nearest points are a little above or below the ground: by 2^-50 of their distance. */
static void the_horizon_is_where_it_is(void **state)
{
    (void)state;
    unsigned met = 0, missed = 0;
    for (uint32_t i = 0; i < CASES; i++) {
        double radius = 1e8, height = ldexp(1, (int)(i % 20));
        struct ground ground = ground_create(i, radius, height);
        struct vec3 center = ground.plan->globes[0].sphere.center;
        struct vec3 up = vec3_neg(vec3_normalize(center)), side = vec3_cross(up, random_unit(i, 11));
        double sine = sqrt(1 - square(radius / (radius + height))), dip = sine * (1 + 1e-6 * random_signed(i, 14));
        struct vec3 d = vec3_add_scaled(vec3_scale(vec3_normalize(side), sqrt(1 - dip * dip)), up, -dip);
        struct vec3 o = {0, 0, 0};
        d = vec3_normalize(d);
        double t = vec3_dot(d, center), nearest = height_at(&ground, o, d, t);
        bool meets = which(globe_roots(&ground.plan->globes[0], o, d)) != 0;
        if (fabs(nearest) > 8 * DBL_EPSILON * t) {
            assert_int_equal(meets, nearest < 0);
            met += meets;
            missed += !meets;
        }
        ground_destroy(&ground);
    }
    assert_true(met > CASES / 4 && missed > CASES / 4);
}

/* Through the globe, and from anywhere around it: as good as a sphere's. */
static void elsewhere_a_globe_is_a_sphere(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < CASES; i++) {
        double radius = pow(10, random_between(i, 10, 0, 9));
        struct ground ground = ground_create(i, radius, 0.05 * radius * random_signed(i, 11));
        const struct globe *globe = &ground.plan->globes[0];
        assert_int_equal(ground.plan->count[PRIMITIVE_GLOBE], 1);
        double far = radius * ldexp(1, (int)(i % 12) - 2);
        struct vec3 o = vec3_scale(random_unit(i, 12), far);
        struct vec3 to = vec3_add_scaled(globe->sphere.center, random_vector(i, 15), 0.6 * radius);
        struct vec3 d = vec3_normalize(vec3_sub(to, o));
        struct roots found = globe_roots(globe, o, d), expected = sphere_roots(&globe->sphere, o, d);
        if (which(expected) == (ENTERS | LEAVES) && expected.leave - expected.enter > 0.1 * radius) {
            double tolerance = 64 * DBL_EPSILON * (far + radius);
            assert_true(fabs(found.enter - expected.enter) <= tolerance);
            assert_true(fabs(found.leave - expected.leave) <= tolerance);
            assert_true(found.enter <= found.leave);
        }
        ground_destroy(&ground);
    }
}

static void other_spheres_are_no_globes(void **state)
{
    (void)state;
    static const double heights[] = {-0.9, -0.1, 0.1, 2, 1e6};
    for (size_t k = 0; k < sizeof heights / sizeof *heights; k++) {
        struct ground ground = ground_create((uint32_t)k, 100, 100 * heights[k]);
        assert_int_equal(ground.plan->count[PRIMITIVE_GLOBE], 0);
        assert_int_equal(ground.plan->count[PRIMITIVE_SPHERE], 1);
        ground_destroy(&ground);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_and_products_are_exact), cmocka_unit_test(the_ground_is_where_it_is),
        cmocka_unit_test(the_horizon_is_where_it_is),  cmocka_unit_test(elsewhere_a_globe_is_a_sphere),
        cmocka_unit_test(other_spheres_are_no_globes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
