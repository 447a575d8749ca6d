/*
 * Reflection, refraction and Fresnel's equations, and the changes of direction over a footprint against finite
 * differences.
 */
#include "trace/optics.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "math/elementary.h"
#include "tests/random.h"

static const struct vec3 up = {0, 1, 0};

/* Coming down onto y = 0 at `degrees` from the normal. */
static struct vec3 coming_down(double degrees)
{
    return vec3_make(math_sin_degrees(degrees), -math_cos_degrees(degrees), 0);
}

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

static void reflection_turns_the_normal_part(void **state)
{
    (void)state;
    struct vec3 d = optics_reflect(coming_down(30), up);
    assert_true(is_near(d.x, 0.5, DBL_EPSILON) && is_near(d.y, math_cos_degrees(30), DBL_EPSILON) && d.z == 0);
    for (uint32_t i = 0; i < 10000; i++) {
        struct vec3 in = random_unit(i, 0), n = random_unit(i, 3), out = optics_reflect(in, n);
        assert_true(is_near(vec3_length(out), 1, 2 * DBL_EPSILON));
        assert_true(is_near(vec3_dot(out, n), -vec3_dot(in, n), 4 * DBL_EPSILON));
        assert_true(vec3_max_abs(vec3_sub(vec3_cross(out, n), vec3_cross(in, n))) <= 4 * DBL_EPSILON);
    }
}

/* n1 sin θ1 = n2 sin θ2, in the plane of incidence, on the other side. */
static void refraction_follows_snell(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 in = random_unit(i, 0), n = random_unit(i, 3);
        if (vec3_dot(in, n) > 0)
            n = vec3_neg(n);
        double from = random_between(i, 6, 1, 2.5), to = random_between(i, 7, 1, 2.5);
        struct refraction r = optics_refraction(in, n, from, to);
        double sine = vec3_length(vec3_cross(in, n));
        assert_int_equal(r.total, sine * from / to > 1);
        if (r.total)
            continue;
        struct vec3 out = optics_refract(&r, in, n);
        assert_true(is_near(vec3_length(out), 1, 2 * DBL_EPSILON));
        assert_true(vec3_dot(out, n) <= 0);
        struct vec3 before = vec3_scale(vec3_cross(in, n), from), after = vec3_scale(vec3_cross(out, n), to);
        assert_true(vec3_max_abs(vec3_sub(before, after)) <= 32 * DBL_EPSILON);
        assert_true(is_near(r.cosine_through, -vec3_dot(out, n), 16 * DBL_EPSILON / (r.cosine_through + 1e-6)));
    }
}

/* Hard cases 32 to 34, for n = 1.5. */
static void fresnel_at_known_angles(void **state)
{
    (void)state;
    assert_true(is_near(optics_refraction(coming_down(0), up, 1, 1.5).reflectance, 0.04, DBL_EPSILON));
    assert_true(is_near(optics_refraction(coming_down(0), up, 1.5, 1).reflectance, 0.04, DBL_EPSILON));
    /* At Brewster's angle only the perpendicular part is mirrored: ((n² − 1) / (n² + 1))² of its half. */
    double brewster = 56.30993247402021, perpendicular = (1.25 / 3.25) * (1.25 / 3.25);
    assert_true(
        is_near(optics_refraction(coming_down(brewster), up, 1, 1.5).reflectance, perpendicular / 2, 1e-15));
    double critical = 41.81031489577860;
    assert_false(optics_refraction(coming_down(critical - 1e-9), up, 1.5, 1).total);
    assert_true(optics_refraction(coming_down(critical + 1e-9), up, 1.5, 1).total);
    assert_true(optics_refraction(coming_down(critical + 1e-9), up, 1.5, 1).reflectance == 1);
    assert_true(optics_refraction(coming_down(90), up, 1, 1.5).reflectance == 1);
}

/* Both ways along the same line the same share is mirrored (Stokes), it grows to 1 and never beyond. */
static void fresnel_is_symmetric_and_bounded(void **state)
{
    (void)state;
    double last = 0.04;
    for (double angle = 0; angle < 90; angle += 0.01) {
        struct vec3 in = coming_down(angle);
        struct refraction there = optics_refraction(in, up, 1, 1.5);
        struct vec3 out = optics_refract(&there, in, up);
        struct refraction back = optics_refraction(vec3_neg(out), vec3_neg(up), 1.5, 1);
        /* cos θ is off by an ulp of sin θ / cos θ, and R changes with it by at most a factor of about 3. */
        double tolerance = 16 * DBL_EPSILON / math_cos_degrees(angle);
        assert_true(is_near(there.reflectance, back.reflectance, tolerance));
        assert_true(there.reflectance >= last - tolerance && there.reflectance <= 1);
        last = there.reflectance;
    }
    assert_true(last > 0.99);
}

/* --- changes over a footprint ----------------------------------------------------------------------------- */

/* A vector across `unit`, so that unit + h × it stays a unit vector to first order. */
static struct vec3 change_across(struct vec3 unit, uint32_t i, uint32_t draw)
{
    struct vec3 v = random_vector(i, draw);
    return vec3_add_scaled(v, unit, -vec3_dot(v, unit));
}

static struct vec3 moved(struct vec3 unit, struct vec3 change, double h)
{
    return vec3_normalize(vec3_add_scaled(unit, change, h));
}

/* Central differences with h = 1e-5: the error of the method is about h² times a third derivative, of rounding
 * 1e-16 / h. */
static const double STEP = 1e-5, TOLERANCE = 1e-7;

static void reflected_change_is_the_derivative(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10000; i++) {
        struct vec3 d = random_unit(i, 0), n = random_unit(i, 3);
        struct vec3 by_d = change_across(d, i, 6), by_n = change_across(n, i, 9);
        struct vec3 after = optics_reflect(moved(d, by_d, STEP), moved(n, by_n, STEP));
        struct vec3 before = optics_reflect(moved(d, by_d, -STEP), moved(n, by_n, -STEP));
        struct vec3 slope = vec3_scale(vec3_sub(after, before), 0.5 / STEP);
        struct vec3 change = optics_reflect_change(d, n, by_d, by_n);
        assert_true(vec3_max_abs(vec3_sub(slope, change)) <= TOLERANCE);
        struct vec3 even = optics_reflect_change(d, vec3_neg(n), by_d, vec3_neg(by_n));
        assert_true(vec3_max_abs(vec3_sub(even, change)) == 0); /* either side's normal serves */
    }
}

static struct vec3 refracted(struct vec3 d, struct vec3 n, double from, double to)
{
    struct refraction r = optics_refraction(d, n, from, to);
    return optics_refract(&r, d, n);
}

static void refracted_change_is_the_derivative(void **state)
{
    (void)state;
    unsigned compared = 0;
    for (uint32_t i = 0; i < 10000; i++) {
        struct vec3 d = random_unit(i, 0), n = random_unit(i, 3);
        if (vec3_dot(d, n) > 0)
            n = vec3_neg(n);
        double from = random_between(i, 12, 1, 2), to = random_between(i, 13, 1, 2);
        struct refraction r = optics_refraction(d, n, from, to);
        if (r.total || r.cosine_through < 0.5) /* where third derivatives are small */
            continue;
        struct vec3 by_d = change_across(d, i, 6), by_n = change_across(n, i, 9);
        struct vec3 after = refracted(moved(d, by_d, STEP), moved(n, by_n, STEP), from, to);
        struct vec3 before = refracted(moved(d, by_d, -STEP), moved(n, by_n, -STEP), from, to);
        struct vec3 slope = vec3_scale(vec3_sub(after, before), 0.5 / STEP);
        struct vec3 change = optics_refract_change(&r, d, n, by_d, by_n);
        assert_true(vec3_max_abs(vec3_sub(slope, change)) <= TOLERANCE);
        compared++;
    }
    assert_true(compared > 2000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reflection_turns_the_normal_part),
        cmocka_unit_test(refraction_follows_snell),
        cmocka_unit_test(fresnel_at_known_angles),
        cmocka_unit_test(fresnel_is_symmetric_and_bounded),
        cmocka_unit_test(reflected_change_is_the_derivative),
        cmocka_unit_test(refracted_change_is_the_derivative),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
