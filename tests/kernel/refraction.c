/*
 * Rays through glass: where they come out, and that they come out; glass that touches other things; light within it.
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
#include "trace/bounds.h"
#include "trace/generation.h"

static bool is_near(double a, double b, double tolerance)
{
    return fabs(a - b) <= tolerance;
}

/* Follows the last child of every hit to where it leaves the scene, in at most `steps` steps: the medium that
 * it believes to be in there, or UINT32_MAX if it is still on its way. */
static uint32_t follow_through(const struct plan *plan, struct vec3 origin, struct vec3 direction, int steps,
                               struct ray *out)
{
    static struct generation g; /* the same one every time, so that its arrays need not grow anew */
    struct path path = {.ray = {origin, direction, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, 0},
                        .throughput = {1, 1, 1}};
    uint32_t medium = UINT32_MAX;
    g.plan = plan;
    g.kernel = &kernel_ref;
    medium_pool_clear(&g.media);
    for (int step = 0; step <= steps && path.throughput.x > 0.01; step++) {
        path_batch_clear(&g.paths);
        path_batch_push(&g.paths, &path);
        generation_find_hits(&g);
        if (hit_batch_id(&g.hits, 0) == PRIMITIVE_NONE) {
            medium = path.medium;
            break;
        }
        generation_find_surfaces(&g);
        generation_find_children(&g);
        path = path_batch_get(&g.children, g.children.rays.count - 1); /* transmitted, if anything is */
    }
    *out = path.ray;
    return medium;
}

static struct plan *plan_of(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    return plan_create(scene, &settings, 1);
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
            struct hit hit = hit_at(plan, &rays, &hits, 0);
            struct surface at = surface_at(plan, &ray, &hit);
            struct vec3 along = vec3_normalize(vec3_cross(at.normal, random_vector(i, 3)));
            d = vec3_normalize(vec3_add_scaled(along, at.normal, -ldexp(1, -(int)(i % 64))));
            ray = (struct ray){at.position, d, -at.error, INFINITY, KEY_NONE, hit.id, DEPART_INWARD};
            rays.count = 0;
            ray_batch_push(&rays, &ray);
            kernel_ref.closest(plan, &rays, &hits);
            assert_true(hit_batch_id(&hits, 0) == 0 && hit_batch_side(&hits, 0) == SIDE_LEAVE);
            assert_true(hits.t[0] >= 0 && hits.t[0] < 5);
        }
        plan_destroy(&plan);
        scene_finish(&scene);
    }
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
}

/* --- things in one place ---------------------------------------------------------------------------------- */

/* Pixels in which a red disc is seen that lies on the front of a block of glass, both turned by the angle. */
static unsigned count_red(double degrees, bool glass_first)
{
    struct scene scene = scene_at(vec3_make(1.3, 1.9, 4), 35);
    struct affine turn = affine_rotation(vec3_make(0, 1, 0), degrees);
    for (int i = 0; i < 2; i++)
        if ((i == 0) == glass_first)
            scene_add(&scene, shape_box(grey(-1), grey(1)), material_glass(1.5, grey(0)))->transform = turn;
        else
            scene_add(&scene, shape_disc(vec3_make(0, 0, 1), vec3_make(0, 0, 1), 0.7),
                      material_glowing(vec3_make(1, 0, 0)))
                ->transform = turn;
    struct vec3 *pixels = scene_render(&scene, kernel_default(), NULL);
    unsigned red = 0;
    for (size_t i = 0; i < (size_t)scene.width * scene.height; i++)
        red += pixels[i].x > 0.5;
    free(pixels);
    scene_finish(&scene);
    return red;
}

/* The same disc whichever comes first, in the scene or by rounding. */
static void glass_does_not_hide_what_lies_on_it(void **state)
{
    (void)state;
    for (double degrees = 0; degrees < 50; degrees += 7) {
        unsigned red = count_red(degrees, false);
        assert_true(red > 100);
        assert_int_equal(count_red(degrees, true), red);
    }
}

/* Blocks of glass in a row, those from the middle on off by `gap`; the first one stands apart. */
static struct scene row_of_blocks(unsigned count, double gap)
{
    struct scene scene = scene_at(vec3_make(0, 0, 9), 40);
    for (unsigned i = 0; i < count; i++) {
        struct vec3 low = {i + (i > count / 2 ? gap : 0), 0.1 * i, 0};
        scene_add(&scene, shape_box(low, vec3_add(low, grey(1))), material_glass(1.5, grey(0)));
        low.y -= 0.5; /* other things do not matter */
        scene_add(&scene, shape_box(low, vec3_add(low, grey(1))), material_matte(grey(1)));
    }
    scene.objects[0].transform = affine_translation(vec3_make(-1, 0, 0));
    return scene;
}

static size_t count_contacts(unsigned count, double gap)
{
    struct scene scene = row_of_blocks(count, gap);
    struct plan *plan = plan_of(&scene);
    size_t contacts = plan->contact_count;
    if (contacts == 1 && count == 3) /* the faces at x = 2 */
        assert_true(fabs(plan->contacts->low.x - 2) <= fabs(gap) + 1e-9 && fabs(plan->contacts->high.x - 2) <= 1e-9);
    if (count > 10)
        assert_true(plan->contacts->low.x == -INFINITY && plan->contacts->high.y == INFINITY);
    plan_destroy(&plan);
    scene_finish(&scene);
    return contacts;
}

static void a_plan_knows_where_walls_may_touch(void **state)
{
    (void)state;
    assert_int_equal(count_contacts(1, 0), 0);
    assert_int_equal(count_contacts(3, 1e-9), 0);
    assert_int_equal(count_contacts(3, 0), 1);
    assert_int_equal(count_contacts(3, 1e-14), 1); /* less than COINCIDENCE of the coordinates */
    assert_int_equal(count_contacts(3, -0.5), 1);
    assert_int_equal(count_contacts(9, 0), 7);
    assert_int_equal(count_contacts(12, 0), 1); /* too many: everywhere */
}

/* The pixels of 64 rows of 64, of which the caller frees the array. */
static struct vec3 *pixels_of(const struct plan *plan)
{
    struct tracer *tracer = tracer_create(plan, kernel_default());
    struct vec3 *pixels = memory_array(64 * 64, sizeof *pixels);
    struct ray_counts rows[64] = {{0}};
    area_render(tracer, 1, &(struct pixel_area){0, 64, 0, 64}, pixels, rows);
    tracer_destroy(&tracer);
    return pixels;
}

/* Looking for walls that touch only where they may gives the same picture as looking everywhere. */
static void elsewhere_walls_need_no_looking_for(void **state)
{
    (void)state;
    struct scene scene = row_of_blocks(7, 0);
    struct affine turn = affine_rotation(vec3_normalize(vec3_make(1, 2, 3)), 20); /* and so round all faces */
    for (size_t i = 0; i < scene.object_count; i++)
        scene.objects[i].transform = affine_multiply(&turn, &scene.objects[i].transform);
    scene.width = scene.height = 64;
    scene.background = (struct background){.kind = BACKGROUND_GRADIENT, .color = {{0.1, 0.2, 0.3}, {1, 0, 1}}};
    struct plan *plan = plan_of(&scene);
    struct vec3 *found = pixels_of(plan);
    assert_int_equal(plan->contact_count, 5);
    plan->contact_count = 1;
    plan->contacts[0] = (struct bounds){grey(-INFINITY), grey(INFINITY)};
    struct vec3 *expected = pixels_of(plan);
    assert_memory_equal(found, expected, 64 * 64 * sizeof *found);
    plan->contact_count = 0; /* and not looking at all does not */
    struct vec3 *without = pixels_of(plan);
    assert_memory_not_equal(without, expected, 64 * 64 * sizeof *found);
    free(found);
    free(expected);
    free(without);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* --- light within ----------------------------------------------------------------------------------------- */

/* A wall at z = 0 seen head on from (0, 0, 3), with a lamp at (2, 0, 2), all within water; or all in a pocket of air in
 * it. */
static struct vec3 wall_within_water(struct vec3 absorption, bool pocket)
{
    struct scene scene = scene_at(vec3_make(0, 0, 3), 10);
    scene_add(&scene, shape_sphere(grey(0), 50), material_glass(1.33, absorption));
    scene_add(&scene, shape_box(vec3_make(-1, -1, -1), vec3_make(1, 1, 0)), material_matte(grey(1)));
    if (pocket)
        scene_add(&scene, shape_sphere(grey(0), 40), material_glass(1, grey(0)));
    scene_add_light(&scene, light_point(vec3_make(2, 0, 2), grey(1)));
    struct vec3 seen = scene_look(&scene);
    scene_finish(&scene);
    return seen;
}

/* exp(−absorption × length) from the lamp to the wall and on to the eye, though neither way crosses a surface. */
static void water_absorbs_from_a_lamp_within_it(void **state)
{
    (void)state;
    const struct vec3 absorption = {0.1, 0.3, 0};
    struct vec3 seen = wall_within_water(absorption, false), dry = wall_within_water(absorption, true);
    double cosine = sqrt(0.5), length = sqrt(8) + 3, tolerance = 4 * COINCIDENCE; /* shadow rays end so near the lamp */
    assert_true(is_near(seen.x, cosine * exp(-0.1 * length), tolerance));
    assert_true(is_near(seen.y, cosine * exp(-0.3 * length), tolerance));
    assert_true(is_near(seen.z, cosine, tolerance));
    assert_true(is_near(dry.x, cosine, tolerance) && is_near(dry.y, cosine, tolerance));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plate_shifts_the_ray),
        cmocka_unit_test(a_glass_ball_lets_every_ray_out),
        cmocka_unit_test(what_goes_in_comes_out),
        cmocka_unit_test(flat_rays_come_out_too),
        cmocka_unit_test(glass_does_not_hide_what_lies_on_it),
        cmocka_unit_test(a_plan_knows_where_walls_may_touch),
        cmocka_unit_test(elsewhere_walls_need_no_looking_for),
        cmocka_unit_test(water_absorbs_from_a_lamp_within_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
