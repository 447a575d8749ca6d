/*
 * Where rays meet the solids and the flat primitives, against closed forms and at the hard cases: tangents,
 * rims, apexes, rays along generators, edges and in planes.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/unit/roots_help.h"
#include "trace/ahead.h"

static const struct vec3 forward = {0, 0, 1};
static const struct sphere unit_sphere = {{0, 0, 0}, 1};

static struct frustum upright(struct vec3 origin, double radius, double slope, double height)
{
    struct vec3 top = vec3_add(origin, vec3_make(0, 0, height));
    return frustum_make(mat3_identity(), origin, top, radius, slope, height, false);
}

/* k = 1/2, H = 2, the apex at the origin and the axis along +z. */
static struct frustum cone, cylinder;

static int make_solids(void **state)
{
    (void)state;
    cone = upright(vec3_make(0, 0, 0), 0, 0.5, 2);
    cylinder = upright(vec3_make(0, 0, 0), 1, 0, 2);
    return 0;
}

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

static void check_both(struct roots roots, double enter, double leave, double tolerance)
{
    assert_int_equal(which(roots), ENTERS | LEAVES);
    assert_true(is_near(roots.enter, enter, tolerance));
    assert_true(is_near(roots.leave, leave, tolerance));
}

static struct frustum opened(struct frustum frustum)
{
    frustum.open = true;
    return frustum;
}

/* --- sphere and ellipsoid --------------------------------------------------------------------------------- */

static void sphere_is_met_where_it_is(void **state)
{
    (void)state;
    check_both(sphere_roots(&unit_sphere, vec3_make(0, 0, -3), forward), 2, 4, 0);
    check_both(sphere_roots(&unit_sphere, vec3_make(0, 0, 0), forward), -1, 1, 0);
    check_both(sphere_roots(&unit_sphere, vec3_make(0.6, 0, -3), forward), 3 - 0.8, 3 + 0.8, 4 * DBL_EPSILON);
    assert_int_equal(which(sphere_roots(&unit_sphere, vec3_make(0, 1 - 1e-12, -3), forward)), 3);
    assert_int_equal(which(sphere_roots(&unit_sphere, vec3_make(0, 1 + 1e-12, -3), forward)), 0);
    struct roots tangent = sphere_roots(&unit_sphere, vec3_make(0, 1, -3), forward);
    check_both(tangent, 3, 3, 0);
}

/* From a point of the sphere inwards the far wall is 2 r cos θ away. */
static void sphere_chord_from_its_surface(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10000; i++) {
        double radius = ldexp(1, (int)(i % 61) - 30);
        struct sphere sphere = {vec3_scale(random_vector(i, 0), radius), radius};
        struct vec3 n = random_unit(i, 3), d = random_unit(i, 6);
        double cosine = -vec3_dot(n, d);
        if (cosine < 0.01)
            continue;
        struct roots roots = sphere_roots(&sphere, vec3_add_scaled(sphere.center, n, radius), d);
        assert_int_equal(which(roots), 3);
        /* The origin is off the sphere by a few ulp of its coordinates, along the ray by that over the cosine.
         */
        check_both(roots, 0, 2 * radius * cosine, 16 * DBL_EPSILON * radius / cosine);
    }
}

/* Hard cases 3 and 4: t from a million radii away, aimed at a known point of the near side. */
static void sphere_is_exact_from_afar(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10000; i++) {
        struct vec3 n = random_unit(i, 0), d = random_unit(i, 3);
        if (vec3_dot(n, d) > 0)
            d = vec3_neg(d);
        if (vec3_dot(n, d) > -0.1)
            continue;
        for (double distance = 4; distance < 2e6; distance *= 100) {
            struct roots roots = sphere_roots(&unit_sphere, vec3_add_scaled(n, d, -distance), d);
            assert_int_equal(which(roots), 3);
            assert_true(is_near(roots.enter, distance, 20 * DBL_EPSILON * distance));
        }
    }
}

/* Every root lies on the surface x² + y² + z² = 1 of the ellipsoid's own frame. */
static void ellipsoid_is_met_on_its_surface(void **state)
{
    (void)state;
    unsigned met = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        struct ellipsoid e = {{random_vector(i, 0), random_vector(i, 3), random_vector(i, 6)},
                              random_vector(i, 9)};
        if (fabs(mat3_determinant(&e.frame)) < 0.1)
            continue;
        struct vec3 o = vec3_scale(random_vector(i, 12), 10);
        struct vec3 d = vec3_normalize(vec3_sub(vec3_add(e.center, random_vector(i, 15)), o));
        struct roots roots = ellipsoid_roots(&e, o, d);
        if (!which(roots))
            continue;
        met++;
        assert_true(roots.enter <= roots.leave);
        for (int root = 0; root < 2; root++) {
            struct vec3 p = vec3_add_scaled(o, d, root ? roots.leave : roots.enter);
            struct vec3 q = mat3_apply(&e.frame, vec3_sub(p, e.center));
            assert_true(is_near(vec3_dot(q, q), 1, 1e-12)); /* coordinates up to 20, condition up to 50 */
        }
    }
    assert_true(met > 1000);
}

static void round_ellipsoid_equals_the_sphere(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct sphere sphere = {random_vector(i, 0), 0.5};
        struct ellipsoid ellipsoid = {{{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}, sphere.center};
        struct vec3 o = vec3_scale(random_vector(i, 3), 3), d = random_unit(i, 6);
        struct roots a = sphere_roots(&sphere, o, d), b = ellipsoid_roots(&ellipsoid, o, d);
        double chord = a.leave - a.enter;
        if (!which(a) || !which(b) || chord < 1e-3) {
            assert_true(which(a) == which(b) || chord < 1e-6);
            continue;
        }
        check_both(b, a.enter, a.leave, 100 * DBL_EPSILON / chord);
    }
}

/* --- plane and disc --------------------------------------------------------------------------------------- */

static void plane_shows_its_front_and_its_back(void **state)
{
    (void)state;
    struct plane plane = {{0, 0, -1}, -2}; /* z = 2, front towards −z */
    struct roots front = plane_roots(&plane, vec3_make(5, 6, 0), forward);
    assert_int_equal(which(front), ENTERS);
    assert_true(front.enter == 2);
    struct roots back = plane_roots(&plane, vec3_make(5, 6, 7), vec3_neg(forward));
    assert_int_equal(which(back), LEAVES);
    assert_true(back.leave == 5);
    assert_int_equal(which(plane_roots(&plane, vec3_make(0, 0, 0), vec3_make(1, 0, 0))), 0);
    assert_int_equal(which(plane_roots(&plane, vec3_make(0, 0, 2), vec3_make(1, 0, 0))), 0); /* within it */
    struct roots steep = plane_roots(&plane, vec3_make(0, 0, 0), vec3_make(1, 0, 1e-300));
    assert_true(!which(steep) || isfinite(steep.enter));
    assert_true(is_near(steep.enter, 2e300, 1e285));
    assert_int_equal(which(plane_roots(&plane, vec3_make(0, 0, 0), vec3_make(1, 0, 1e-310))),
                     0); /* beyond DBL_MAX */
}

static void disc_is_round_and_closed(void **state)
{
    (void)state;
    struct disc disc = {{{0, 0, -1}, -2}, {1, 0, 2}, {0.5, 0, 0}, {0, 0.5, 0}}; /* radius 2 */
    assert_int_equal(which(disc_roots(&disc, vec3_make(1, 0, 0), forward)), ENTERS);
    assert_int_equal(which(disc_roots(&disc, vec3_make(3, 0, 0), forward)),
                     ENTERS); /* the rim belongs to it */
    assert_int_equal(which(disc_roots(&disc, vec3_make(3 + 1e-12, 0, 0), forward)), 0);
    assert_int_equal(which(disc_roots(&disc, vec3_make(-0.5, 1.4, 0), forward)), 0);
    assert_int_equal(which(disc_roots(&disc, vec3_make(-0.5, 1.2, 5), vec3_neg(forward))), LEAVES);
    assert_int_equal(which(disc_roots(&disc, vec3_make(1, 0, 2), vec3_make(1, 0, 0))), 0);
}

/* --- frustum ---------------------------------------------------------------------------------------------- */

/* Hard cases 13 to 15. */
static void cylinder_along_its_axis(void **state)
{
    (void)state;
    struct frustum tube = opened(cylinder);
    for (int i = -1; i <= 1; i++) {
        struct vec3 o = {i * 1e-15, 0, -3}, d = vec3_normalize(vec3_make(0, i * 1e-15, 1));
        struct roots roots = frustum_roots(&cylinder, o, d);
        check_both(roots, 3, 5, 0);
        assert_int_equal(frustum_part(&cylinder, o, d, SIDE_ENTER), PART_NARROW_CAP);
        assert_int_equal(frustum_part(&cylinder, o, d, SIDE_LEAVE), PART_WIDE_CAP);
        assert_int_equal(which(frustum_roots(&tube, o, d)), 0);
    }
    struct vec3 above = {0.5, 0, 4}, down = vec3_neg(forward);
    check_both(frustum_roots(&cylinder, above, down), 2, 4, 0);
    assert_int_equal(frustum_part(&cylinder, above, down, SIDE_ENTER), PART_WIDE_CAP);
    assert_int_equal(which(frustum_roots(&cylinder, vec3_make(1.1, 0, -3), forward)), 0);
}

/* Hard case 24: a ray in the plane of a cap meets the solid's rim there, and misses just outside. */
static void cylinder_in_the_plane_of_its_cap(void **state)
{
    (void)state;
    for (double z = 0; z <= 2; z += 2) {
        check_both(frustum_roots(&cylinder, vec3_make(-3, 0, z), vec3_make(1, 0, 0)), 2, 4, 0);
        check_both(frustum_roots(&cylinder, vec3_make(-3, 0, z), vec3_make(1, 0, -0.0)), 2, 4, 0);
    }
    assert_int_equal(which(frustum_roots(&cylinder, vec3_make(-3, 0, 2 + 1e-12), vec3_make(1, 0, 0))), 0);
    assert_int_equal(which(frustum_roots(&cylinder, vec3_make(-3, 0, -1e-12), vec3_make(1, 0, 0))), 0);
}

/* Hard cases 18 to 22. */
static void cone_by_hand(void **state)
{
    (void)state;
    check_both(frustum_roots(&cone, vec3_make(0, 0, -3), forward), 3, 5, 0);
    assert_int_equal(frustum_part(&cone, vec3_make(0, 0, -3), forward, SIDE_LEAVE), PART_WIDE_CAP);
    check_both(frustum_roots(&cone, vec3_make(0.25, 0, -3), forward), 3.5, 5, 4 * DBL_EPSILON);
    struct vec3 beside = {3, 0, 1}, across = {-1, 0, 0};
    check_both(frustum_roots(&cone, beside, across), 2.5, 3.5, 4 * DBL_EPSILON);
    assert_int_equal(frustum_part(&cone, beside, across, SIDE_ENTER), PART_SIDE);
    /* Parallel to the generator x = z/2, and never near it. */
    struct vec3 generator = vec3_normalize(vec3_make(0.5, 0, 1));
    assert_int_equal(which(frustum_roots(&cone, vec3_make(-1, 0.3, -2), generator)), 0);
    /* Through where the second nappe would be. */
    assert_int_equal(which(frustum_roots(&cone, vec3_make(-3, 0, -1), vec3_make(1, 0, 0))), 0);
    assert_int_equal(which(frustum_roots(&cone, vec3_make(-1, 0, -1), vec3_normalize(vec3_make(1, 0, 0.2)))), 0);
    struct frustum funnel = opened(cone);
    assert_int_equal(which(frustum_roots(&funnel, vec3_make(0.1, 0, -3), vec3_make(0, 0, -1))),
                     LEAVES); /* behind the origin: t < 0 is for the caller to sort out */
}

/* A ray along a generator lies in the side: from outside to the wide end. It may or may not be met, but never
 * beyond the solid, and never with a NaN. */
static void cone_along_a_generator(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) {
        double angle = i * 0.00628;
        struct vec3 g = {0.5 * cos(angle), 0.5 * sin(angle), 1};
        struct roots roots = frustum_roots(&cone, vec3_scale(g, -2), vec3_normalize(g));
        double length = vec3_length(g);
        if (!which(roots))
            continue;
        assert_true(roots.enter >= 2 * length * (1 - 1e-7) && roots.leave <= 4 * length * (1 + 1e-7));
    }
    /* Parallel to a generator but inside: through the side, out of the cap (a = 0, one root). */
    struct vec3 d = vec3_normalize(vec3_make(0.5, 0, 1));
    struct roots inner = frustum_roots(&cone, vec3_make(-3.5, 0, -6), d);
    /* x = −1/2 + z/2 meets x = −z/2 at z = 1/2 */
    check_both(inner, 6.5 * sqrt(1.25), 8 * sqrt(1.25), 1e-13);
    assert_int_equal(frustum_part(&cone, vec3_make(-3.5, 0, -6), d, SIDE_LEAVE), PART_WIDE_CAP);
}

static void open_frustum_is_its_side_alone(void **state)
{
    (void)state;
    struct frustum tube = opened(cylinder), funnel = opened(cone);
    check_both(frustum_roots(&tube, vec3_make(-3, 0, 1), vec3_make(1, 0, 0)), 2, 4, 0);
    /* In through the missing lid, out through the side. */
    struct vec3 d = vec3_normalize(vec3_make(1, 0, 1));
    struct roots slant = frustum_roots(&tube, vec3_make(-1, 0, -1), d);
    assert_int_equal(which(slant), LEAVES);
    assert_true(is_near(slant.leave, 2 * sqrt(2), 1e-15));
    struct roots steep = frustum_roots(&funnel, vec3_make(0.25, 0, -3), forward);
    assert_int_equal(which(steep), ENTERS);
    assert_true(is_near(steep.enter, 3.5, 4 * DBL_EPSILON));
}

/* Hard case 23: a frustum whose ends are equal is the cylinder, and nearly equal ends come near it. */
static void frustum_goes_over_into_the_cylinder(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 o = vec3_scale(random_vector(i, 0), 4), d = random_unit(i, 3);
        struct frustum almost = cylinder;
        almost.slope = 1e-13;
        struct roots a = frustum_roots(&cylinder, o, d), b = frustum_roots(&almost, o, d);
        if (!which(a) || a.leave - a.enter < 1e-3)
            continue;
        check_both(b, a.enter, a.leave, 1e-9);
    }
}

/* Every root of a capped frustum lies on the piece that it names. */
static void frustum_parts_are_where_they_say(void **state)
{
    (void)state;
    struct frustum frustum = upright(vec3_make(0.5, -0.25, 0.125), 0.5, 0.75, 1);
    unsigned seen[3] = {0, 0, 0};
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 o = vec3_scale(random_vector(i, 0), 4),
                    d = vec3_normalize(vec3_sub(random_vector(i, 3), o));
        struct roots roots = frustum_roots(&frustum, o, d);
        if (!which(roots))
            continue;
        for (int root = 0; root < 2; root++) {
            struct vec3 q = vec3_sub(vec3_add_scaled(o, d, root ? roots.leave : roots.enter), frustum.origin);
            uint8_t part = frustum_part(&frustum, o, d, root ? SIDE_LEAVE : SIDE_ENTER);
            double radius = sqrt(q.x * q.x + q.y * q.y), local = frustum.radius + frustum.slope * q.z;
            seen[part]++;
            assert_true(radius <= local + 2e-13 && q.z >= -1e-14 && q.z <= 1 + 1e-14);
            assert_true(part != PART_SIDE || is_near(radius, local, 2e-12));
            assert_true(part != PART_NARROW_CAP || is_near(q.z, 0, 1e-14));
            assert_true(part != PART_WIDE_CAP || is_near(q.z, 1, 1e-14));
        }
    }
    assert_true(seen[0] > 1000 && seen[1] > 300 && seen[2] > 1000);
}

/* Hard cases 16 and 17: rays through points of the rim, and of the apex, moved inside by 1e-12: none slips
 * through. */
static void rims_and_apex_do_not_leak(void **state)
{
    (void)state;
    static const struct vec3 rims[] = {{1, 1, 0}, {1, 1, 2}, {1, 1, 2}, {0, 0, 0}};
    const struct frustum *of[] = {&cylinder, &cylinder, &cone, &cone};
    unsigned leaks = 0;
    for (uint32_t i = 0; i < 1000000; i++) {
        const struct frustum *frustum = of[i % 4];
        struct vec3 rim = rims[i % 4], d = random_unit(i, 0), inside = {0, 0, 1};
        double angle = random_between(i, 3, 0, 6.283185307179586), s = random_between(i, 4, 1, 100);
        if (frustum == &cone)
            inside.z = 1.5;
        struct vec3 p = {rim.x * cos(angle), rim.y * sin(angle), rim.z};
        p = vec3_mix(p, inside, 1e-12);
        struct roots roots = frustum_roots(frustum, vec3_add_scaled(p, d, -s), d);
        leaks += !(which(roots) == 3 && roots.enter <= s + 1e-9 && roots.leave >= s - 1e-9);
    }
    assert_int_equal(leaks, 0);
}

/* --- box
 * -----------------------------------------------------------------------------------------------------------
 */

static const struct box cube = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {-1, -1, -1}, {1, 1, 1}};

static void box_faces_edges_and_corners(void **state)
{
    (void)state;
    struct vec3 before = {0.5, -0.5, -4};
    check_both(box_roots(&cube, before, forward), 3, 5, 0);
    assert_int_equal(box_part(&cube, before, forward, SIDE_ENTER), 5);
    assert_int_equal(box_part(&cube, before, forward, SIDE_LEAVE), 4);
    check_both(box_roots(&cube, vec3_make(1, 0, -4), forward), 3, 5, 0);                /* in a face */
    check_both(box_roots(&cube, vec3_make(1, -1, -4), vec3_make(-0.0, 0, 1)), 3, 5, 0); /* along an edge */
    check_both(box_roots(&cube, vec3_make(1, -1, 4), vec3_make(0, -0.0, -1)), 3, 5, 0);
    assert_int_equal(which(box_roots(&cube, vec3_make(1 + 1e-12, 0, -4), forward)), 0);
    struct vec3 d = vec3_normalize(vec3_make(1, 1, 1));
    check_both(box_roots(&cube, vec3_make(-3, -3, -3), d), 2 * sqrt(3), 4 * sqrt(3),
               1e-15 * 8); /* corner to corner */
    struct vec3 across = vec3_normalize(vec3_make(1, -1, 0));
    struct roots touch = box_roots(&cube, vec3_make(0, 2, 0), across); /* touches the edge x = y = 1 */
    assert_true(!which(touch) || is_near(touch.enter, sqrt(2), 1e-15 * 4));
}

/* A ray that starts on a face, outside by rounding, and leaves over the next edge before it comes in: it has gone in,
 * so it comes out at the edge. Any other ray misses. */
static void what_goes_in_over_an_edge_comes_out_there(void **state)
{
    (void)state;
    struct vec3 o = {1 + DBL_EPSILON, 1 - 1e-9, 0}, d = vec3_normalize(vec3_make(-1e-8, 1, 0));
    struct ray ray = {o, d, 0, INFINITY, KEY_NONE, 5, DEPART_INWARD};
    struct window window = window_of(&ray);
    struct roots own = roots_ahead(box_roots(&cube, o, d), &window, 5, WALL_SOLID);
    assert_true(own.enter == INFINITY && is_near(own.leave, 1e-9, DBL_EPSILON));
    struct roots other = roots_ahead(box_roots(&cube, o, d), &window, 6, WALL_SOLID);
    assert_true(other.enter == INFINITY && other.leave == INFINITY);
    ray.departure = DEPART_OUTWARD;
    window = window_of(&ray);
    own = roots_ahead(box_roots(&cube, o, d), &window, 5, WALL_SOLID);
    assert_true(own.enter == INFINITY && own.leave == INFINITY);
}

/* Every root lies on the face that it names, and a turned box gives what turning the ray back gives. */
static void box_parts_are_where_they_say(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) {
        struct vec3 o = vec3_scale(random_vector(i, 0), 4), d = random_unit(i, 3);
        struct roots roots = box_roots(&cube, o, d);
        for (int root = 0; which(roots) && root < 2; root++) {
            struct vec3 p = vec3_add_scaled(o, d, root ? roots.leave : roots.enter);
            const double at[3] = {p.x, p.y, p.z};
            uint8_t part = box_part(&cube, o, d, root ? SIDE_LEAVE : SIDE_ENTER);
            assert_true(is_near(at[part / 2], part % 2 ? -1 : 1, 1e-14));
            assert_true(vec3_max_abs(p) <= 1 + 1e-13);
        }
        struct affine turn = affine_rotation(random_unit(i, 6), 77);
        struct box turned = {mat3_transpose(&turn.linear), cube.low, cube.high};
        struct roots same = box_roots(&turned, mat3_apply(&turn.linear, o), mat3_apply(&turn.linear, d));
        if (which(roots) && roots.leave - roots.enter > 1e-6 &&
            vec3_max_abs(vec3_make(1 / d.x, 1 / d.y, 1 / d.z)) < 1e3)
            check_both(same, roots.enter, roots.leave, 1e-10); /* a coordinate's error is divided by d's */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_is_met_where_it_is),
        cmocka_unit_test(sphere_chord_from_its_surface),
        cmocka_unit_test(sphere_is_exact_from_afar),
        cmocka_unit_test(ellipsoid_is_met_on_its_surface),
        cmocka_unit_test(round_ellipsoid_equals_the_sphere),
        cmocka_unit_test(plane_shows_its_front_and_its_back),
        cmocka_unit_test(disc_is_round_and_closed),
        cmocka_unit_test(cylinder_along_its_axis),
        cmocka_unit_test(cylinder_in_the_plane_of_its_cap),
        cmocka_unit_test(cone_by_hand),
        cmocka_unit_test(cone_along_a_generator),
        cmocka_unit_test(open_frustum_is_its_side_alone),
        cmocka_unit_test(frustum_goes_over_into_the_cylinder),
        cmocka_unit_test(frustum_parts_are_where_they_say),
        cmocka_unit_test(rims_and_apex_do_not_leak),
        cmocka_unit_test(box_faces_edges_and_corners),
        cmocka_unit_test(what_goes_in_over_an_edge_comes_out_there),
        cmocka_unit_test(box_parts_are_where_they_say),
    };
    return cmocka_run_group_tests(tests, make_solids, NULL);
}
