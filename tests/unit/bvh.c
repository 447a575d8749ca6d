/* The tree changes nothing: every ray finds behind it, to the last bit, what a scan of all primitives finds. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"
#include "tests/unit/roots_help.h"
#include "trace/bounds.h"

enum { OBJECTS = 400, RAYS = 4000 };

/* A solid or disc of any kind, at a place and of a size that vary by orders of magnitude. */
static struct shape random_shape(uint32_t i)
{
    struct vec3 at = vec3_scale(random_vector(i, 0), 10), along = vec3_scale(random_unit(i, 3), 0.8);
    double size = 0.01 * pow(100, random_between(i, 6, 0, 1));
    switch (i % 6) {
    case 0:
        return shape_sphere(at, size);
    case 1:
        return shape_disc(at, random_unit(i, 7), size);
    case 2:
        return shape_frustum(at, vec3_add(at, along), size, 0);
    case 3:
        return shape_tube(at, vec3_add(at, along), size, 0.5 * size);
    case 4:
        return shape_box(at, vec3_add(at, vec3_make(size, 2 * size, 0.3)));
    default:
        return shape_globe(at, size, 4, 6);
    }
}

/* Half of the objects turned and stretched. */
static void add_objects(struct scene *scene)
{
    struct material opaque = material_matte(grey(0.5)), clear = material_filter(grey(0.5));
    for (uint32_t i = 0; i < OBJECTS; i++) {
        struct object *object = scene_add(scene, random_shape(i), i % 7 ? opaque : clear);
        if (i % 2 == 0)
            continue;
        struct affine turn = affine_rotation(random_unit(i, 20), 360 * random_between(i, 23, 0, 1));
        struct vec3 by = {random_between(i, 24, 0.5, 2), 1, random_between(i, 25, 0.5, 2)};
        struct affine stretch = affine_scaling(by);
        object->transform = affine_multiply(&turn, &stretch);
    }
    scene_add(scene, shape_plane(vec3_make(0, -11, 0), vec3_make(0, 1, 0)), opaque);
    scene_add(scene, shape_sphere(vec3_make(0, -1e7, 0), 1e7 - 12), opaque);
}

static const struct vec3 eye = {0, 0, 15}; /* the origin of the plan's coordinates */

/* Most are aimed near the place of an object that is not turned; some run along an axis. */
static struct ray random_ray(uint32_t i)
{
    struct vec3 origin = vec3_scale(random_vector(i, 40), 12);
    uint32_t object = 2 * (i % (OBJECTS / 2));
    struct vec3 target = vec3_add_scaled(vec3_scale(random_vector(object, 0), 10), random_vector(i, 43), 0.1);
    return (struct ray){
        .origin = vec3_sub(origin, eye),
        .direction = i % 5 ? vec3_normalize(vec3_sub(target, origin)) : vec3_make(i % 2 ? -1 : 1, 0, 0),
        .t_max = i % 3 ? INFINITY : 9,
        .key_min = KEY_NONE,
        .from = PRIMITIVE_NONE,
    };
}

struct fixture {
    struct scene scene;
    struct plan *tree;
    struct plan scan; /* the same plan without its tree */
    struct ray_batch rays;
};

static int make(void **state)
{
    struct fixture *f = memory_array(1, sizeof *f);
    f->scene = scene_at(eye, 60);
    add_objects(&f->scene);
    struct trace_settings settings = settings_of(&f->scene);
    f->tree = plan_create(&f->scene, &settings, 1);
    f->scan = *f->tree;
    f->scan.bvh = (struct bvh){0};
    for (uint32_t i = 0; i < RAYS; i++) {
        struct ray ray = random_ray(i);
        ray_batch_push(&f->rays, &ray);
    }
    *state = f;
    return 0;
}

static int unmake(void **state)
{
    struct fixture *f = *state;
    ray_batch_finish(&f->rays);
    plan_destroy(&f->tree);
    scene_finish(&f->scene);
    free(f);
    return 0;
}

static void test_same_hits(void **state)
{
    const struct fixture *f = *state;
    struct hit_batch tree = {0}, scan = {0};
    hit_batch_reserve(&tree, RAYS);
    hit_batch_reserve(&scan, RAYS);
    kernel_ref.closest(f->tree, &f->rays, &tree);
    kernel_ref.closest(&f->scan, &f->rays, &scan);
    size_t met = 0;
    for (size_t i = 0; i < RAYS; i++) {
        assert_int_equal(hit_batch_id(&tree, i), hit_batch_id(&scan, i));
        assert_memory_equal(&tree.t[i], &scan.t[i], sizeof tree.t[i]);
        if (hit_batch_id(&tree, i) == PRIMITIVE_NONE)
            continue;
        assert_int_equal(hit_batch_side(&tree, i), hit_batch_side(&scan, i));
        met += hit_batch_id(&tree, i) + 2 < f->tree->primitive_count; /* neither plane nor giant */
    }
    assert_true(met > RAYS / 4);
    hit_batch_finish(&tree);
    hit_batch_finish(&scan);
}

static int compare_crossings(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->ray != b->ray)
        return a->ray < b->ray ? -1 : 1;
    if (a->id != b->id)
        return a->id < b->id ? -1 : 1;
    return a->side - b->side;
}

/* Crossings of rays that are not blocked, each once, in an order of their own. */
static size_t sorted(struct crossing_list *list, const uint8_t *blocked)
{
    size_t count = 0;
    for (size_t i = 0; i < list->count; i++)
        if (!blocked[list->items[i].ray])
            list->items[count++] = list->items[i];
    qsort(list->items, count, sizeof *list->items, compare_crossings);
    size_t kept = count > 0;
    for (size_t i = 1; i < count; i++)
        if (compare_crossings(&list->items[kept - 1], &list->items[i]) != 0)
            list->items[kept++] = list->items[i];
    return kept;
}

static void test_same_shadows(void **state)
{
    const struct fixture *f = *state;
    uint8_t *tree_blocked = memory_array(RAYS, 1), *scan_blocked = memory_array(RAYS, 1);
    struct crossing_list tree = {0}, scan = {0};
    kernel_ref.shadow(f->tree, &f->rays, tree_blocked, &tree);
    kernel_ref.shadow(&f->scan, &f->rays, scan_blocked, &scan);
    assert_memory_equal(tree_blocked, scan_blocked, RAYS);
    size_t count = sorted(&tree, tree_blocked);
    assert_int_equal(count, sorted(&scan, scan_blocked));
    assert_true(count > 0);
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(compare_crossings(&tree.items[i], &scan.items[i]), 0);
        assert_memory_equal(&tree.items[i].t, &scan.items[i].t, sizeof tree.items[i].t);
    }
    crossing_list_finish(&tree);
    crossing_list_finish(&scan);
    free(tree_blocked);
    free(scan_blocked);
}

/* Where rays meet a primitive is within its bounds, to rounding, and the bounds are not much larger than that. */
static void test_bounds(void **state)
{
    const struct fixture *f = *state;
    for (uint32_t i = 0; i < RAYS; i++) {
        uint32_t id = hash_u32(i) % (uint32_t)(f->tree->primitive_count - 2);
        struct bounds bounds;
        assert_true(bounds_of_primitive(f->tree, id, &bounds));
        struct vec3 share = {random_between(i, 60, 0, 1), random_between(i, 61, 0, 1), random_between(i, 62, 0, 1)};
        struct vec3 size = vec3_sub(bounds.high, bounds.low);
        struct vec3 o = vec3_scale(random_unit(i, 63), 50);
        struct vec3 d = vec3_normalize(vec3_sub(vec3_add(bounds.low, vec3_mul(size, share)), o));
        struct shear shear = shear_of(d);
        struct roots roots = plan_roots(f->tree, id, o, d, &shear);
        struct vec3 p = vec3_add_scaled(o, d, roots.enter);
        if (!(which(roots) & ENTERS))
            continue;
        double slack = 1e-13 * 60;
        assert_true(p.x >= bounds.low.x - slack && p.x <= bounds.high.x + slack);
        assert_true(p.y >= bounds.low.y - slack && p.y <= bounds.high.y + slack);
        assert_true(p.z >= bounds.low.z - slack && p.z <= bounds.high.z + slack);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_hits),
        cmocka_unit_test(test_same_shadows),
        cmocka_unit_test(test_bounds),
    };
    return cmocka_run_group_tests_name("bvh", tests, make, unmake);
}
