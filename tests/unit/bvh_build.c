/* The tree's shape: every primitive is in it once or outside it, in a box that holds it, or in pieces; and the tree
 * is the same whoever builds it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/bounds.h"

/* --- scenes ----------------------------------------------------------------------------------------------- */

enum { SCATTERED = 500, EQUAL = 10000, SPREAD = 240, SOUP = 150000 };

static struct scene scene_of(uint32_t count, struct shape make(uint32_t i))
{
    struct scene scene = scene_at(vec3_make(0, 0, 30), 60);
    struct material matte = material_matte(grey(0.5));
    for (uint32_t i = 0; i < count; i++)
        scene_add(&scene, make(i), matte);
    return scene;
}

static struct shape scattered(uint32_t i)
{
    struct vec3 at = vec3_scale(random_vector(i, 0), 10);
    double size = random_between(i, 3, 0.05, 1);
    switch (i % 5) {
    case 0:
        return shape_sphere(at, size);
    case 1:
        return shape_disc(at, random_unit(i, 7), size);
    case 2:
        return shape_frustum(at, vec3_add(at, vec3_make(0.5, 0.2, -0.6)), size, 0);
    case 3:
        return shape_box(at, vec3_add(at, vec3_make(size, 2 * size, 0.3)));
    default:
        return shape_box_mesh(at, vec3_add(at, vec3_make(0.3, size, size)));
    }
}

static struct shape equal(uint32_t i)
{
    (void)i;
    return shape_sphere(vec3_make(1, 2, 3), 0.5);
}

static struct shape equal_of_all_kinds(uint32_t i)
{
    return scattered(i % 5);
}

static struct shape in_a_row(uint32_t i)
{
    return shape_sphere(vec3_make(0.01 * i, 0, 0), 0.02);
}

/* Sizes and places from 2^-60 to 2^60, so that no few bins ever tell them apart. */
static struct shape spread(uint32_t i)
{
    double at = ldexp(1, (int)(i / 2) - 60);
    return shape_sphere(vec3_make(i % 2 ? -at : at, at, 30), at / 4);
}

static struct shape huge_and_tiny(uint32_t i)
{
    struct vec3 at = random_vector(i, 0);
    return i % 100 ? shape_sphere(at, 1e-6) : shape_sphere(vec3_scale(at, 1e6), 1e5);
}

/* Triangles of any size and place. */
static struct shape soup(uint32_t i)
{
    struct mesh mesh = {.vertex_count = 3 * SOUP, .triangle_count = SOUP};
    mesh.points = memory_array(mesh.vertex_count, sizeof *mesh.points);
    mesh.index = memory_array(mesh.vertex_count, sizeof *mesh.index);
    for (uint32_t v = 0; v < 3 * SOUP; v++) {
        struct vec3 at = vec3_scale(random_vector(v / 3, i), 10);
        mesh.points[v] = vec3_add_scaled(at, random_vector(v, i + 3), 0.1);
        mesh.index[v] = v;
    }
    return (struct shape){.kind = SHAPE_MESH, .mesh = mesh};
}

static const struct {
    const char *name;
    uint32_t objects;
    struct shape (*make)(uint32_t i);
} cases[] = {
    {"one", 1, equal},
    {"few", 4, scattered},
    {"scattered", SCATTERED, scattered},
    {"equal", EQUAL, equal},
    {"equal, of all kinds", EQUAL, equal_of_all_kinds},
    {"in a row", EQUAL, in_a_row},
    {"spread", SPREAD, spread},
    {"huge and tiny", EQUAL, huge_and_tiny},
    {"soup", 1, soup},
};

/* --- checks ----------------------------------------------------------------------------------------------- */

struct cuboid {
    double low[3], high[3];
};

struct census {
    const struct plan *plan;
    const struct bvh *bvh;
    uint8_t *seen; /* of each primitive */
    int depth;
};

static struct cuboid child_box(const struct bvh_node *node, int child)
{
    struct cuboid box;
    for (int axis = 0; axis < 3; axis++) {
        box.low[axis] = node->low[axis][child];
        box.high[axis] = node->high[axis][child];
    }
    return box;
}

static void assert_holds(const struct cuboid *outer, const struct cuboid *inner, double slack)
{
    for (int axis = 0; axis < 3; axis++) {
        assert_true(outer->low[axis] <= inner->low[axis] - slack);
        assert_true(outer->high[axis] >= inner->high[axis] + slack);
    }
}

/* Room for the rounding of hits: at least half the growth, of an extent that is at least the primitive's. */
static void check_leaf(struct census *census, const struct bvh_node *node, int child)
{
    struct cuboid leaf = child_box(node, child);
    assert_true(node->child[child] + node->count[child] <= census->plan->count[node->kind[child]]);
    for (uint32_t i = 0; i < node->count[child]; i++) {
        uint32_t id = census->plan->ids[node->kind[child]][node->child[child] + i];
        struct bounds b;
        assert_int_equal(census->plan->primitives[id].kind, node->kind[child]);
        assert_true(bounds_of_primitive(census->plan, id, &b));
        struct cuboid box = {{b.low.x, b.low.y, b.low.z}, {b.high.x, b.high.y, b.high.z}};
        assert_holds(&leaf, &box, 0x1p-24 * fmax(vec3_max_abs(b.low), vec3_max_abs(b.high)));
        census->seen[id]++;
    }
}

static void check_node(struct census *census, uint32_t index, const struct cuboid *box, int depth)
{
    assert_true(index < census->bvh->node_count);
    const struct bvh_node *node = &census->bvh->nodes[index];
    census->depth = depth > census->depth ? depth : census->depth;
    for (int child = 0; child < BVH_WIDTH; child++) {
        struct cuboid inner = child_box(node, child);
        if (inner.low[0] > inner.high[0]) {
            for (int axis = 0; axis < 3; axis++)
                assert_true(inner.low[axis] == INFINITY && inner.high[axis] == -INFINITY);
            assert_int_equal(node->count[child], 0);
            continue;
        }
        if (box)
            assert_holds(box, &inner, 0);
        if (node->count[child] > 0)
            check_leaf(census, node, child);
        else
            check_node(census, node->child[child], &inner, depth + 1);
    }
}

/* Every element of the plan's typed arrays knows its primitive and the other way round. */
static void check_order(const struct plan *plan)
{
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        for (uint32_t i = 0; i < plan->count[kind]; i++) {
            const struct primitive *primitive = &plan->primitives[plan->ids[kind][i]];
            assert_int_equal(primitive->kind, kind);
            assert_int_equal(primitive->index, i);
        }
}

static void check_plan(const struct plan *plan)
{
    struct census census = {plan, &plan->bvh, memory_array(plan->primitive_count, 1), 0};
    check_order(plan);
    for (size_t i = 0; i < plan->bvh.loose_count; i++) {
        census.seen[plan->bvh.loose[i]]++;
        assert_true(i == 0 || plan->bvh.loose[i - 1] < plan->bvh.loose[i]);
    }
    if (plan->bvh.node_count > 0) {
        check_node(&census, 0, NULL, 1);
        for (size_t id = 0; id < plan->primitive_count; id++)
            assert_int_equal(census.seen[id], 1);
    }
    assert_true(census.depth <= BVH_DEPTH_MAX);
    free(census.seen);
}

/* --- tests ------------------------------------------------------------------------------------------------ */

static void test_holds_everything_once(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        print_message("# %s\n", cases[i].name);
        struct scene scene = scene_of(cases[i].objects, cases[i].make);
        struct trace_settings settings = settings_of(&scene);
        struct plan *plan = plan_create(&scene, &settings, 1);
        assert_int_equal(plan->bvh.node_count > 0, cases[i].objects > 4 || cases[i].make == soup);
        check_plan(plan);
        plan_destroy(&plan);
        scene_finish(&scene);
    }
}

static void test_does_not_depend_on_threads(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene scene = scene_of(cases[i].objects, cases[i].make);
        struct trace_settings settings = settings_of(&scene);
        struct plan *one = plan_create(&scene, &settings, 1);
        for (int threads = 2; threads <= 5; threads += 3) {
            struct plan *more = plan_create(&scene, &settings, threads);
            assert_int_equal(more->bvh.node_count, one->bvh.node_count);
            assert_int_equal(more->bvh.loose_count, one->bvh.loose_count);
            if (one->bvh.node_count > 0)
                assert_memory_equal(more->bvh.nodes, one->bvh.nodes, one->bvh.node_count * sizeof *one->bvh.nodes);
            for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
                assert_memory_equal(more->ids[kind], one->ids[kind], one->count[kind] * sizeof *one->ids[kind]);
            plan_destroy(&more);
        }
        plan_destroy(&one);
        scene_finish(&scene);
    }
}

/* --- triangles cut into pieces ---------------------------------------------------------------------------- */

enum { TUFT = 3000, NEEDLES = 500 };

/* Small triangles among needles that run across all axes. */
static struct shape needles(uint32_t object)
{
    struct mesh mesh = {.vertex_count = 3 * TUFT, .triangle_count = TUFT};
    mesh.points = memory_array(mesh.vertex_count, sizeof *mesh.points);
    mesh.index = memory_array(mesh.vertex_count, sizeof *mesh.index);
    for (uint32_t i = 0; i < TUFT; i++) {
        struct vec3 at = vec3_make(i % 10, i / 10 % 10, i / 100 % 10 - 20.0 - object);
        double length = i < NEEDLES ? 4 + i % 3 : 0.1;
        mesh.points[3 * i] = at;
        mesh.points[3 * i + 1] = vec3_add(at, vec3_make(length, 1.1 * length, -0.9 * length));
        mesh.points[3 * i + 2] = vec3_add(at, vec3_make(0.01, -0.02, 0.015));
        for (uint32_t corner = 3 * i; corner < 3 * i + 3; corner++)
            mesh.index[corner] = corner;
    }
    return (struct shape){.kind = SHAPE_MESH, .mesh = mesh};
}

/* Whether a leaf with triangle `id` holds the point. */
static bool is_held(const struct plan *plan, uint32_t id, struct vec3 p)
{
    for (size_t n = 0; n < plan->bvh.node_count; n++)
        for (int child = 0; child < BVH_WIDTH; child++) {
            const struct bvh_node *node = &plan->bvh.nodes[n];
            struct cuboid box = child_box(node, child);
            bool inside = p.x >= box.low[0] && p.x <= box.high[0] && p.y >= box.low[1] && p.y <= box.high[1] &&
                          p.z >= box.low[2] && p.z <= box.high[2];
            for (uint32_t i = 0; inside && i < node->count[child]; i++)
                if (plan->ids[node->kind[child]][node->child[child] + i] == id)
                    return true;
        }
    return false;
}

/* Long thin triangles are in several leaves, which together hold all of them. */
static void test_pieces(void **state)
{
    (void)state;
    struct scene scene = scene_of(1, needles);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    const struct vec3 *points = scene.objects[0].shape.mesh.points;
    assert_true(plan->bvh.repeats);
    for (uint32_t id = 0; id < TUFT; id += id < NEEDLES ? 7 : 97)
        for (int step = 0; step <= 20; step++) {
            struct vec3 p = vec3_mix(points[3 * id + step % 2 * 2], points[3 * id + 1], step / 20.0);
            assert_true(is_held(plan, id, vec3_sub(p, plan->eye)));
        }
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* The tree of one sphere, which no plan asks for. */
static void test_one_primitive(void **state)
{
    (void)state;
    struct scene scene = scene_of(1, equal);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    size_t count;
    uint32_t *order = bvh_build(&plan->bvh, plan, 2, &count);
    assert_int_equal(count, 1);
    assert_int_equal(order[0], 0);
    free(order);
    assert_int_equal(plan->bvh.node_count, 1);
    assert_int_equal(plan->bvh.loose_count, 0);
    check_plan(plan);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* What has no bounds, and a few giants, are outside the tree; many giants are not, as every ray would test them. */
static void test_what_stays_outside(void **state)
{
    (void)state;
    struct scene scene = scene_of(EQUAL, in_a_row);
    struct material matte = material_matte(grey(0.5));
    scene_add(&scene, shape_plane(vec3_make(0, -11, 0), vec3_make(0, 1, 0)), matte);
    scene_add(&scene, shape_sphere(vec3_make(0, -1e7, 0), 1e7 - 12), matte);
    scene_add(&scene, shape_sphere(vec3_make(0, 5, 0), 1), matte); /* 50 times the size of the others */
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    assert_int_equal(plan->bvh.loose_count, 2);
    assert_int_equal(plan->bvh.loose[0], EQUAL);
    assert_int_equal(plan->bvh.loose[1], EQUAL + 1);
    check_plan(plan);
    plan_destroy(&plan);
    scene_finish(&scene);

    scene = scene_of(EQUAL, huge_and_tiny);
    plan = plan_create(&scene, &settings, 1);
    assert_int_equal(plan->bvh.loose_count, 0);
    plan_destroy(&plan);
    scene_finish(&scene);
}

/* Primitives that lie side by side in the scene's order or not: spheres keep what they are when they are moved. */
static void test_order_moves_whole_primitives(void **state)
{
    (void)state;
    struct scene scene = scene_of(SCATTERED, scattered);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    bool moved = false;
    for (uint32_t i = 0; i < plan->count[PRIMITIVE_SPHERE]; i++) {
        uint32_t id = plan->ids[PRIMITIVE_SPHERE][i];
        const struct shape *shape = &scene.objects[plan->primitives[id].object].shape;
        assert_true(plan->spheres[i].radius == shape->sphere.radius);
        moved = moved || (i > 0 && id < plan->ids[PRIMITIVE_SPHERE][i - 1]);
    }
    assert_true(moved);
    plan_destroy(&plan);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_holds_everything_once),
        cmocka_unit_test(test_does_not_depend_on_threads),
        cmocka_unit_test(test_one_primitive),
        cmocka_unit_test(test_what_stays_outside),
        cmocka_unit_test(test_order_moves_whole_primitives),
        cmocka_unit_test(test_pieces),
    };
    return cmocka_run_group_tests_name("bvh_build", tests, NULL, NULL);
}
