/*
 * Where rays meet triangles: orientation, weights, and meshes without gaps.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"
#include "tests/unit/roots_help.h"

static struct roots roots_with(const struct triangle *triangle, struct vec3 origin, struct vec3 direction)
{
    struct shear shear = shear_of(direction);
    return triangle_roots(triangle, origin, direction, &shear);
}

/* Counter-clockwise seen from +z. */
static const struct triangle facing = {{0, 0, 1}, {2, 0, 1}, {0, 2, 1}, {{0, 0, 1}, 1}};

static void front_is_counter_clockwise(void **state)
{
    (void)state;
    struct roots front = roots_with(&facing, vec3_make(0.5, 0.5, 5), vec3_make(0, 0, -1));
    assert_int_equal(which(front), ENTERS);
    assert_true(front.enter == 4);
    struct roots back = roots_with(&facing, vec3_make(0.5, 0.5, -5), vec3_make(0, 0, 1));
    assert_int_equal(which(back), LEAVES);
    assert_true(back.leave == 6);
    assert_int_equal(which(roots_with(&facing, vec3_make(1.5, 1.5, 5), vec3_make(0, 0, -1))), 0);
    assert_int_equal(which(roots_with(&facing, vec3_make(-3, 0.5, 1), vec3_make(1, 0, 0))),
                     0); /* in its plane */
}

/* Any triangle, any ray at a point of it: the side is the sign of d · n, t and weights are those of the point.
 */
static void triangle_is_met_where_it_is(void **state)
{
    (void)state;
    unsigned fronts = 0, backs = 0;
    for (uint32_t i = 0; i < 50000; i++) {
        struct triangle t = triangle_make(random_vector(i, 0), random_vector(i, 3), random_vector(i, 6));
        double v = random_between(i, 9, 0.05, 0.45), w = random_between(i, 10, 0.05, 0.45), u = 1 - v - w;
        struct vec3 p = vec3_add(vec3_scale(t.a, u), vec3_add(vec3_scale(t.b, v), vec3_scale(t.c, w)));
        struct vec3 o = vec3_scale(random_vector(i, 11), 10), d = vec3_normalize(vec3_sub(p, o));
        struct vec3 n = vec3_cross(vec3_sub(t.b, t.a), vec3_sub(t.c, t.a));
        double distance = vec3_length(vec3_sub(p, o)), steep = -vec3_dot(d, n);
        if (fabs(steep) < 1e-2)
            continue;
        struct shear shear = shear_of(d);
        struct roots roots = triangle_roots(&t, o, d, &shear);
        assert_int_equal(which(roots), steep > 0 ? ENTERS : LEAVES);
        double met = steep > 0 ? roots.enter : roots.leave;
        assert_true(fabs(met - distance) <= 1e-12); /* a few ulp of 20 over the least |d · n| */
        struct vec3 weights = triangle_weights(&t, o, &shear);
        assert_true(vec3_max_abs(vec3_sub(weights, vec3_make(u, v, w))) <= 1e-12);
        fronts += steep > 0;
        backs += steep < 0;
    }
    assert_true(fronts > 10000 && backs > 10000);
}

/* Hard cases 28 and 29. */
static void degenerate_triangles_are_harmless(void **state)
{
    (void)state;
    const struct triangle flat[] = {
        triangle_make(vec3_make(0, 0, 1), vec3_make(1, 1, 1), vec3_make(2, 2, 1)),
        triangle_make(vec3_make(0, 0, 1), vec3_make(0, 0, 1), vec3_make(0, 0, 1)),
        triangle_make(vec3_make(0, 0, 1), vec3_make(1, 0, 1), vec3_make(1, 0, 1)),
    };
    for (size_t k = 0; k < 3; k++)
        for (uint32_t i = 0; i < 10000; i++) {
            struct vec3 o = vec3_scale(random_vector(i, 0), 3);
            struct vec3 target = vec3_mix(flat[k].a, flat[k].c, random_between(i, 3, 0, 1));
            struct roots roots = roots_with(&flat[k], o, vec3_normalize(vec3_sub(target, o)));
            assert_true(!isinf(roots.enter) && !isinf(roots.leave));
        }
    const struct triangle needle = triangle_make(vec3_make(0, 0, 1), vec3_make(1e8, 0, 1), vec3_make(0, 1, 1));
    struct roots roots = roots_with(&needle, vec3_make(5e7, 0.25, 3), vec3_make(0, 0, -1));
    assert_int_equal(which(roots), ENTERS);
    assert_true(roots.enter == 2);
}

/* From inside a closed mesh every ray leaves it, also through edges and vertices, and enters as often as it
 * leaves from outside but for hits that an edge counts twice. Hard case 30. */
static void closed_mesh_does_not_leak(void **state)
{
    (void)state;
    struct shape globe = shape_globe(vec3_make(0.1, -0.2, 0.3), 1, 12, 17);
    const struct mesh *mesh = &globe.mesh;
    unsigned leaks = 0;
    for (uint32_t i = 0; i < 120000; i++) {
        struct vec3 o = vec3_add(vec3_make(0.1, -0.2, 0.3), vec3_scale(random_vector(i, 0), 0.3));
        const uint32_t *corner = &mesh->index[3 * (hash_u32(i) % mesh->triangle_count)];
        double along = i % 3 == 0 ? 0 : random_between(i, 3, 0, 1); /* a third at vertices, the rest at edges */
        struct vec3 target = vec3_mix(mesh->points[corner[i % 3]], mesh->points[corner[(i + 1) % 3]], along);
        struct vec3 d = vec3_normalize(vec3_sub(target, o));
        struct shear shear = shear_of(d);
        bool left = false;
        for (size_t k = 0; k < mesh->triangle_count && !left; k++) {
            const uint32_t *v = &mesh->index[3 * k];
            struct triangle t = triangle_make(mesh->points[v[0]], mesh->points[v[1]], mesh->points[v[2]]);
            struct roots roots = triangle_roots(&t, o, d, &shear);
            assert_true(!(which(roots) & ENTERS) || roots.enter < 0);
            left = (which(roots) & LEAVES) && roots.leave > 0;
        }
        leaks += !left;
    }
    mesh_finish(&globe.mesh);
    assert_int_equal(leaks, 0);
}

/* Random rays at a cube of triangles, with the plan's own compiled triangles, mirrored or not: enter and leave
 * once. */
static void cube_mesh_equals_the_box(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 0, 8), 40);
    scene_add(&scene, shape_box_mesh(vec3_make(-1, -1, -1), vec3_make(1, 1, 1)), material_matte(grey(1)));
    scene_add(&scene, shape_box_mesh(vec3_make(-1, -1, -1), vec3_make(1, 1, 1)), material_matte(grey(1)))
        ->transform = affine_scaling(vec3_make(-1, 1, 1));
    scene_add(&scene, shape_box(vec3_make(-1, -1, -1), vec3_make(1, 1, 1)), material_matte(grey(1)));
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    for (uint32_t i = 0; i < 200000; i++) {
        struct vec3 o = vec3_scale(random_unit(i, 0), 5), target = random_vector(i, 3), center = {0, 0, -8};
        struct vec3 d = vec3_normalize(vec3_sub(target, o));
        struct shear shear = shear_of(d);
        o = vec3_add(o, center);
        struct roots box = plan_roots(plan, 24, o, d, &shear);
        for (uint32_t first = 0; first < 24; first += 12) {
            int enters = 0, leaves = 0;
            for (uint32_t id = first; id < first + 12; id++) {
                struct roots roots = plan_roots(plan, id, o, d, &shear);
                enters += (which(roots) & ENTERS) && fabs(roots.enter - box.enter) < 1e-12;
                leaves += (which(roots) & LEAVES) && fabs(roots.leave - box.leave) < 1e-12;
            }
            assert_int_equal(which(box), 3);
            assert_int_equal(enters, 1);
            assert_int_equal(leaves, 1);
        }
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(front_is_counter_clockwise),        cmocka_unit_test(triangle_is_met_where_it_is),
        cmocka_unit_test(degenerate_triangles_are_harmless), cmocka_unit_test(closed_mesh_does_not_leak),
        cmocka_unit_test(cube_mesh_equals_the_box),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
