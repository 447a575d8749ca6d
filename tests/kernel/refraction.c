/*
 * Rays through glass: where they come out, and that they come out.
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
#include "trace/shade.h"

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

/* Follows the last child of every hit to where it leaves the scene, in at most `steps` steps: the medium that
 * it believes to be in there, or UINT32_MAX if it is still on its way. */
static uint32_t follow_through(const struct plan *plan, struct vec3 origin, struct vec3 direction, int steps,
                               struct ray *out)
{
    struct medium_pool media = {0};
    struct path_batch paths = {0}, children = {0};
    struct hit_batch hits = {0};
    struct path path = {.ray = {origin, direction, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, 0},
                        .throughput = {1, 1, 1}};
    uint32_t medium = UINT32_MAX;
    hit_batch_reserve(&hits, 1);
    for (int step = 0; step <= steps && path.throughput.x > 0.01; step++) {
        path_batch_clear(&paths);
        path_batch_clear(&children);
        path_batch_push(&paths, &path);
        kernel_ref.closest(plan, &paths.rays, &hits);
        if (hits.id[0] == PRIMITIVE_NONE) {
            medium = path.medium;
            break;
        }
        struct shading shading;
        struct hit hit = {hits.t[0], hits.id[0], hits.side[0], hits.part[0]};
        shading_init(&shading, plan, &media, &path, &hit);
        shading_push_children(plan, &shading, &media, &children);
        path = path_batch_get(&children, children.rays.count - 1); /* transmitted, if anything is */
    }
    *out = path.ray;
    path_batch_finish(&paths);
    path_batch_finish(&children);
    hit_batch_finish(&hits);
    medium_pool_finish(&media);
    return medium;
}

static struct plan *plan_of(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    return plan_create(scene, &settings);
}

/* Hard case 35: a plate at 45° shifts the ray by 0.329142308 of its thickness and keeps its direction. */
static void a_plate_shifts_the_ray(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 0, 0), 10);
    scene.camera.at = vec3_make(0, 0, -1);
    scene_add(&scene, shape_box(vec3_make(-99, -99, -3), vec3_make(99, 99, -2)), material_glass(1.5, grey(0)));
    struct plan *plan = plan_of(&scene);
    struct vec3 d = vec3_normalize(vec3_make(1, 0, -1));
    struct ray out;
    assert_int_equal(follow_through(plan, vec3_make(0, 0, 0), d, 2, &out), MEDIUM_SPACE);
    assert_true(vec3_max_abs(vec3_sub(out.direction, d)) < 4 * DBL_EPSILON);
    /* sin 45° (1 − cos 45° / √(n² − sin² 45°)) */
    double shift = sqrt(0.5) * (1 - sqrt(0.5) / sqrt(2.25 - 0.5));
    assert_true(is_near(vec3_length(vec3_cross(out.origin, d)), shift, 1e-14) &&
                is_near(shift, 0.329142308, 5e-10));
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Hard case 36: out of a sphere as steeply as in, without total reflection. */
static void a_glass_ball_lets_every_ray_out(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 0, 0), 10);
    struct vec3 center = {0.3, -0.2, -5};
    scene.camera.at = vec3_make(0, 0, -1);
    scene_add(&scene, shape_sphere(center, 1.7), material_glass(1.5, grey(0)));
    struct plan *plan = plan_of(&scene);
    for (uint32_t i = 0; i < 200000; i++) {
        struct vec3 n = random_unit(i, 0), d = random_unit(i, 3);
        d = vec3_dot(n, d) > 0 ? vec3_neg(d) : d;
        struct vec3 o = vec3_add_scaled(vec3_add_scaled(center, n, 1.7), d, -4);
        struct ray out;
        double in = -vec3_dot(n, d);
        if (in < 0.02) /* where nearly all is mirrored, and what passes is too weak to be followed */
            continue;
        assert_int_equal(follow_through(plan, o, d, 2, &out), MEDIUM_SPACE);
        double through = vec3_dot(vec3_sub(out.origin, center), out.direction) / 1.7;
        assert_true(is_near(through, in, 1e-13 / in));
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* What has gone into a solid comes out of it, however flat the ray: no medium is left behind. Light that is
 * totally reflected inside is followed as it goes round. */
static void what_goes_in_comes_out(void **state)
{
    (void)state;
    const struct shape solids[] = {shape_sphere(grey(0), 1), shape_box(grey(-1), grey(1)),
                                   shape_frustum(vec3_make(0, -1, 0), vec3_make(0.5, 1, 0), 1, 1),
                                   shape_frustum(vec3_make(0, -1, 0), vec3_make(0.5, 1, 0), 1, 0),
                                   shape_sphere(grey(0), 1)};
    unsigned lost = 0, through = 0;
    for (size_t k = 0; k < 5; k++) {
        struct scene scene = scene_at(vec3_make(0, 0, 5), 10);
        struct object *object = scene_add(&scene, solids[k], material_glass(k % 2 ? 1.5 : 0.8, grey(0)));
        object->transform =
            k == 4 ? affine_scaling(vec3_make(1, 0.3, 2)) : affine_rotation(random_unit(9, 0), 33);
        struct plan *plan = plan_of(&scene);
        for (uint32_t i = 0; i < 40000; i++) {
            struct vec3 o = vec3_scale(random_unit(i, 0), 4), eye = {0, 0, -5};
            struct vec3 d = vec3_normalize(vec3_sub(random_vector(i, 3), o));
            struct ray out;
            uint32_t medium = follow_through(plan, vec3_add(o, eye), d, 60, &out);
            lost +=
                medium != MEDIUM_SPACE && medium != UINT32_MAX; /* light may be caught for longer than that */
            through += medium == MEDIUM_SPACE;
        }
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    assert_int_equal(lost, 0);
    assert_true(through > 150000);
}

/* Also where the ray is so flat that rounding would have it miss the solid that it starts on. */
static void flat_rays_come_out_too(void **state)
{
    (void)state;
    const struct shape solids[] = {shape_sphere(grey(0), 1), shape_box(grey(-1), grey(1)),
                                   shape_frustum(vec3_make(0, -1, 0), vec3_make(0.5, 1, 0), 1, 0),
                                   shape_sphere(grey(0), 1)};
    struct ray_batch rays = {0};
    struct hit_batch hits = {0};
    hit_batch_reserve(&hits, 1);
    for (size_t k = 0; k < 4; k++) {
        struct scene scene = scene_at(vec3_make(0, 0, 5), 10);
        struct object *object = scene_add(&scene, solids[k], material_glass(0.8, grey(0)));
        object->transform =
            k == 3 ? affine_scaling(vec3_make(1, 0.3, 2)) : affine_rotation(random_unit(9, 0), 33);
        struct plan *plan = plan_of(&scene);
        for (uint32_t i = 0; i < 20000; i++) {
            struct vec3 inside = {0, 0, -5}, d = random_unit(i, 0);
            struct ray ray = {inside, d, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, DEPART_OUTWARD};
            rays.count = 0;
            ray_batch_push(&rays, &ray);
            kernel_ref.closest(plan, &rays, &hits);
            struct hit hit = {hits.t[0], hits.id[0], hits.side[0], hits.part[0]};
            struct surface at = surface_at(plan, &ray, &hit);
            struct vec3 along = vec3_normalize(vec3_cross(at.normal, random_vector(i, 3)));
            d = vec3_normalize(vec3_add_scaled(along, at.normal, -ldexp(1, -(int)(i % 64))));
            ray = (struct ray){at.position, d, -at.error, INFINITY, KEY_NONE, hit.id, DEPART_INWARD};
            rays.count = 0;
            ray_batch_push(&rays, &ray);
            kernel_ref.closest(plan, &rays, &hits);
            assert_true(hits.id[0] == 0 && hits.side[0] == SIDE_LEAVE && hits.t[0] >= 0 && hits.t[0] < 5);
        }
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plate_shifts_the_ray),
        cmocka_unit_test(a_glass_ball_lets_every_ray_out),
        cmocka_unit_test(what_goes_in_comes_out),
        cmocka_unit_test(flat_rays_come_out_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
