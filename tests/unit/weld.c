/*
 * Faces of different kinds of objects in one plane, turned and moved by any chain of transforms: rays meet them at
 * equal t. Faces that are really apart stay so.
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

enum { CASES = 3000 };

/* Up to six steps, multiplied from the left or from the right, which rounds differently. */
static struct affine chain(uint32_t i, bool from_left)
{
    const unsigned steps = 1 + i % 6;
    const double far = ldexp(1, (int)(i % 11));
    struct affine step[6], whole = affine_identity();
    for (unsigned k = 0; k < steps; k++) {
        uint32_t draw = 100 + 10 * k;
        step[k] = k % 2 ? affine_translation(vec3_scale(random_vector(i, draw), far))
                        : affine_rotation(random_unit(i, draw), random_between(i, draw + 5, -180, 180));
        if (k == 2 && i % 4 == 0)
            step[k] = affine_scaling(vec3_make(0.5, 2, 1.3));
    }
    for (unsigned k = 0; k < steps; k++)
        whole = from_left ? affine_multiply(&whole, &step[k]) : affine_multiply(&step[steps - 1 - k], &whole);
    return whole;
}

/* All have a face in the plane z = `height`, over the point (0.1, 0.2), that lets rays through from above. */
static void add_faces(struct scene *scene, uint32_t i, double height)
{
    struct vec3 at = {0.1, 0.2, height}, below = {0.1, 0.2, height - 1};
    const struct vec3 corners[3] = {{-1, -1, height}, {1, -1, height}, {0, 1.5, height}};
    const struct shape shapes[] = {
        shape_plane(vec3_make(random_signed(i, 0), random_signed(i, 1), height), vec3_make(0, 0, 1)),
        shape_disc(at, vec3_make(0, 0, 1), 0.5),
        shape_box(vec3_make(-1, -0.7, height - 1), vec3_make(0.9, 1, height)),
        shape_frustum(at, below, 0.4, 0.3),
        shape_frustum(at, below, 0.3, 0.5),
        shape_mesh(corners, 3, (const uint32_t[3]){0, 1, 2}, 1, false),
    };
    const size_t count = sizeof shapes / sizeof *shapes;
    for (size_t k = 0; k < count; k++)
        scene_add(scene, shapes[(k + i) % count], material_matte(grey(1)));
}

static struct scene faces_scene(uint32_t i, double height)
{
    double far = ldexp(1, (int)(i % 11));
    struct scene scene = scene_at(vec3_scale(random_vector(i, 10), far), 40);
    scene.camera.at = vec3_add(scene.camera.from, random_unit(i, 13));
    add_faces(&scene, i, height);
    for (size_t k = 0; k < scene.object_count; k++)
        scene.objects[k].transform = chain(i, hash_u32(8 * i + (uint32_t)k) % 2);
    return scene;
}

/* A ray from above, in the object's coordinates, to where all faces are. */
static void aim(const struct scene *scene, uint32_t i, uint32_t draw, double height, struct vec3 *o, struct vec3 *d)
{
    const struct affine *transform = &scene->objects[0].transform;
    struct vec3 from = {random_signed(i, draw), random_signed(i, draw + 1), height + 3};
    struct vec3 to = {0.1 + 0.1 * random_signed(i, draw + 2), 0.2 + 0.1 * random_signed(i, draw + 3), height};
    *o = affine_point_relative(transform, from, scene->camera.from);
    *d = vec3_normalize(vec3_sub(affine_point_relative(transform, to, scene->camera.from), *o));
}

static void faces_in_one_plane_are_met_together(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < CASES; i++) {
        double height = random_between(i, 14, -2, 2);
        struct scene scene = faces_scene(i, height);
        struct trace_settings settings = settings_of(&scene);
        struct plan *plan = plan_create(&scene, &settings, 1);
        for (uint32_t draw = 20; draw < 60; draw += 4) {
            struct vec3 o, d;
            aim(&scene, i, draw, height, &o, &d);
            struct shear shear = shear_of(d);
            double t = plan_roots(plan, 0, o, d, &shear).enter;
            assert_true(t > 1);
            for (uint32_t id = 1; id < plan->primitive_count; id++)
                assert_true(plan_roots(plan, id, o, d, &shear).enter == t);
        }
        plan_destroy(&plan);
        scene_finish(&scene);
    }
}

/* Both faces of a box, each with a plane of its own that another kind of rounding made. */
static void a_box_between_two_planes_touches_both(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < CASES; i++) {
        struct scene scene = faces_scene(i, 1);
        scene_add(&scene, shape_plane(vec3_make(5, 7, 0), vec3_make(0, 0, -1)), material_matte(grey(1)))->transform =
            chain(i, i % 2);
        struct trace_settings settings = settings_of(&scene);
        struct plan *plan = plan_create(&scene, &settings, 1);
        uint32_t ground = (uint32_t)plan->primitive_count - 1, box = 0;
        while (plan->primitives[box].kind != PRIMITIVE_BOX)
            box++;
        struct vec3 o, d;
        aim(&scene, i, 20, 1, &o, &d);
        struct shear shear = shear_of(d);
        struct roots roots = plan_roots(plan, box, o, d, &shear);
        assert_true(roots.enter == plan_roots(plan, box == 0, o, d, &shear).enter);
        assert_true(box_part(&plan->boxes[0], o, d, SIDE_LEAVE) != 5 ||
                    roots.leave == plan_roots(plan, ground, o, d, &shear).leave);
        plan_destroy(&plan);
        scene_finish(&scene);
    }
}

/* Many planes at steps of 10^-12 of their coordinates, and others turned by as much: none is moved. */
static void what_is_apart_stays_apart(void **state)
{
    (void)state;
    enum { STEPS = 100 };
    struct scene scene = scene_at(vec3_make(1, 2, 3), 40);
    for (uint32_t i = 0; i < STEPS; i++) {
        scene_add(&scene, shape_plane(vec3_make(0, 0, 1 + 1e-12 * i), vec3_make(0, 0, 1)), material_matte(grey(1)));
        scene_add(&scene, shape_disc(vec3_make(0, 0, 2), vec3_normalize(vec3_make(1e-12 * i, 0, 1)), 1),
                  material_matte(grey(1)));
    }
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    for (uint32_t i = 1; i < STEPS; i++) {
        assert_true(plan->planes[i].offset > plan->planes[i - 1].offset);
        assert_true(plan->discs[i].plane.normal.x > plan->discs[i - 1].plane.normal.x);
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* The triangles of a finely tessellated globe keep their planes when there is a floor below it. */
static void a_curved_mesh_keeps_its_planes(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(1, 2, 30), 40);
    scene_add(&scene, shape_globe(vec3_make(0, 1, 0), 1, 100, 100), material_matte(grey(1)));
    scene_add(&scene, shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)), material_matte(grey(1)));
    scene_add(&scene, shape_globe(vec3_make(0, 1, 0), 1 + 1e-9, 100, 100), material_matte(grey(1)));
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    for (size_t i = 0; i < plan->count[PRIMITIVE_TRIANGLE]; i++) {
        const struct triangle *welded = &plan->triangles[i];
        struct triangle alone = triangle_make(welded->a, welded->b, welded->c);
        assert_memory_equal(&welded->plane, &alone.plane, sizeof alone.plane);
    }
    plan_destroy(&plan);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_in_one_plane_are_met_together),
        cmocka_unit_test(a_box_between_two_planes_touches_both),
        cmocka_unit_test(what_is_apart_stays_apart),
        cmocka_unit_test(a_curved_mesh_keeps_its_planes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
