/*
 * Instances of a mesh make the picture that copies of it make, to the bit, on every kernel; and rays of all sorts hit
 * the same.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

/* --- scenes ----------------------------------------------------------------------------------------------- */

/* A mesh with a flat bottom, a few dents, and texture coordinates; smooth if it has normals. */
static struct shape bumpy_globe(bool smooth, uint32_t rings)
{
    struct shape shape = shape_globe(vec3_make(0.25, 0.5, 0), 1, rings, 2 * rings);
    struct mesh *mesh = &shape.mesh;
    mesh->uv = memory_array(2 * mesh->vertex_count, sizeof *mesh->uv);
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        mesh->points[i].y = mesh->points[i].y < 0 ? 0 : mesh->points[i].y;
        mesh->uv[2 * i] = mesh->points[i].x;
        mesh->uv[2 * i + 1] = mesh->points[i].y + mesh->points[i].z;
    }
    if (!smooth) {
        free(mesh->normals);
        mesh->normals = NULL;
    }
    return shape;
}

static struct material material_of(uint32_t i)
{
    struct material material = material_matte(vec3_make(0.9, 0.6, 0.3));
    if (i % 5 == 1)
        material.reflection = vec3_make(0.5, 0.6, 0.4);
    if (i % 5 == 2)
        material = material_glass(1.4, vec3_make(0.1, 0.2, 0.05));
    if (i % 5 == 3)
        material.color = (struct texture){.kind = TEXTURE_CHECKER, .color = {{1, 0, 0}, {0, 0, 1}}, .size = 0.3};
    if (i % 5 == 4)
        material.color = (struct texture){.kind = TEXTURE_IMAGE, .map = MAP_MESH, .repeat_u = 1, .repeat_v = 2};
    material.ambient = 0.2;
    material.specular = grey(i % 2 ? 0.4 : 0);
    material.shininess = 20;
    return material;
}

/* Upright, or turned, stretched, sheared and mirrored. */
static struct affine transform_of(uint32_t i)
{
    struct affine to = affine_rotation(i % 3 ? vec3_make(0, 1, 0) : random_unit(i, 0), 180 * random_signed(i, 3));
    struct affine stretch = affine_scaling(vec3_make(i % 4 == 1 ? -0.7 : 0.7, 0.5, i % 4 == 2 ? 1.1 : 0.6));
    stretch.linear.x.y = i % 4 == 3 ? 0.4 : 0;
    to = affine_multiply(&to, &stretch);
    to.offset = vec3_make(1.6 * (i % 5) - 3.2, i % 3 ? 0 : 0.5, -1.3 * (i / 5));
    return to;
}

/* `wearers` of two meshes in turn, on and above a floor that reaches nearly as far as they do. */
static struct scene scene_of(uint32_t wearers, bool textured)
{
    struct scene scene = scene_at(vec3_make(1, 3, 7), 50);
    scene.width = 80;
    scene.height = 60;
    scene.samples = 4;
    scene.background = (struct background){.kind = BACKGROUND_GRADIENT, .color = {{0.2, 0.2, 0.3}, {0.5, 0.7, 1}}};
    static const float texels[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0.5F};
    scene_add_image(&scene, 2, 2, texels);
    for (uint32_t i = 0; i < wearers; i++) {
        struct material material = material_of(textured || i % 5 < 3 ? i : i % 5 - 3);
        struct object *object = i < 2 ? scene_add(&scene, bumpy_globe(i == 0, 8), material)
                                      : scene_share(&scene, i % 2, material);
        object->transform = transform_of(i);
        if (i == 3) /* something between: ids go on behind it */
            scene_add(&scene, shape_sphere(vec3_make(0, 2, -3), 0.7), material_mirror(grey(0.7)));
    }
    scene_add(&scene, shape_disc(vec3_make(0, 0, 0), vec3_make(0, 1, 0), 9), material_matte(grey(0.8)));
    scene_add_light(&scene, light_point(vec3_make(3, 6, 4), grey(0.6)));
    scene_add_light(&scene, light_directional(vec3_make(-1, -2, -1.5), grey(0.4)));
    return scene;
}

/* --- pictures --------------------------------------------------------------------------------------------- */

static size_t count_differences(const struct vec3 *a, const struct vec3 *b, size_t count)
{
    size_t different = 0;
    for (size_t i = 0; i < count; i++)
        different += memcmp(&a[i], &b[i], sizeof a[i]) != 0;
    return different;
}

static void assert_alike(const struct scene *scene, size_t instances)
{
    struct trace_settings settings = settings_of(scene);
    struct plan *copied = plan_create_sharing(scene, &settings, 1, SIZE_MAX);
    struct plan *shared = plan_create_sharing(scene, &settings, 1, 0);
    assert_int_equal(copied->count[PRIMITIVE_INSTANCE], 0);
    assert_int_equal(shared->count[PRIMITIVE_INSTANCE], instances);
    assert_int_equal(shared->id_count, copied->primitive_count);
    for (size_t k = 0; kernel_at(k); k++) {
        struct ray_counts rays = {0}, as_many = {0};
        struct vec3 *expected = plan_render(copied, kernel_at(k), samples_of(scene), &rays);
        struct vec3 *found = plan_render(shared, kernel_at(k), samples_of(scene), &as_many);
        size_t different = count_differences(expected, found, (size_t)scene->width * scene->height);
        if (different > 0)
            print_message("# %s: %zu pixels differ\n", kernel_at(k)->name, different);
        assert_int_equal(different, 0);
        assert_memory_equal(&rays, &as_many, sizeof rays);
        free(expected);
        free(found);
    }
    plan_destroy(&copied);
    plan_destroy(&shared);
}

static void instances_look_like_copies(void **state)
{
    (void)state;
    print_message("# seed %d\n", TEST_SEED);
    static const uint32_t wearers[] = {4, 8, 25};
    for (size_t i = 0; i < sizeof wearers / sizeof *wearers; i++)
        for (int textured = 0; textured < 2; textured++) {
            struct scene scene = scene_of(wearers[i], textured);
            assert_alike(&scene, wearers[i]);
            scene_finish(&scene);
        }
}

/* Bricks side by side on a slab, matte, mirroring and of glass, and a wall behind them, all turned: so that rounding
 * makes something else of every face, and only welding brings those together that touch. */
static struct scene brick_scene(uint32_t number)
{
    struct scene scene = scene_at(vec3_make(1, 4, 7), 50);
    struct affine turn = affine_rotation(random_unit(number, 10), 30 * random_signed(number, 13));
    scene.width = 60;
    scene.height = 40;
    turn.offset = vec3_scale(random_vector(number, 14), 0.3);
    for (uint32_t i = 0; i < 12; i++) {
        struct shape brick = shape_box_mesh(vec3_make(0, 0, 0), vec3_make(1, 0.7, 0.9));
        struct object *object = i == 0 ? scene_add(&scene, brick, material_of(0))
                                       : scene_share(&scene, 0, material_of(i % 3));
        if (i > 0)
            mesh_finish(&brick.mesh);
        struct affine place = affine_scaling(vec3_make(i % 4 == 1 ? -1 : 1, 1, 1));
        place.offset = vec3_make(i % 4 + (i % 4 == 1) - 2.0, 0, 0.9 * (i / 4) - 1);
        object->transform = affine_multiply(&turn, &place);
    }
    const struct shape others[] = {shape_box(vec3_make(-3, -1, -3), vec3_make(3, 0, 3)),
                                   shape_plane(vec3_make(0, 0, -1), vec3_make(0, 0, 1)),
                                   shape_box_mesh(vec3_make(2, 0, -1), vec3_make(3, 0.7, 2))};
    for (uint32_t i = 0; i < sizeof others / sizeof *others; i++)
        scene_add(&scene, others[i], material_of(i))->transform = turn;
    scene_add_light(&scene, light_point(vec3_make(3, 6, 4), grey(0.6)));
    return scene;
}

static void what_instances_touch_is_welded(void **state)
{
    (void)state;
    print_message("# seed %d\n", TEST_SEED);
    for (uint32_t number = 0; number < 6; number++) {
        struct scene scene = brick_scene(number);
        assert_alike(&scene, 12);
        scene_finish(&scene);
    }
}

/* --- rays ------------------------------------------------------------------------------------------------- */

enum { RAYS = 4000, WEARERS = 8 };

/* What makes a tree in the mesh's space hard: to what a mesh is turned and where its own coordinates are. */
static const struct {
    const char *name;
    double mesh_at;        /* its distance from its own origin */
    struct vec3 scale;
    double shear, away;    /* away: its distance from the camera */
} placements[] = {
    {"plain", 0, {1, 1, 1}, 0, 3},
    {"far away", 0, {1, 1, 1}, 0, 1e5},
    {"tiny", 0, {1e-5, 1e-5, 1e-5}, 0, 1e-4},
    {"huge", 0, {1e7, 1e7, 1e7}, 0, 1e8},
    {"flat", 0, {1, 1e-3, 1}, 0, 3},
    {"sheared", 0, {1, -0.5, 1}, 40, 30},
    {"modelled far from its origin", 1e4, {1, 1, 1}, 0, 3},
};

static struct scene placed_scene(size_t placement)
{
    struct scene scene = scene_at(vec3_make(1, 2, 7), 50);
    struct shape globe = bumpy_globe(false, 6);
    struct vec3 away = vec3_scale(vec3_make(1, 0.3, -0.7), placements[placement].mesh_at);
    for (size_t i = 0; i < globe.mesh.vertex_count; i++)
        globe.mesh.points[i] = vec3_add(globe.mesh.points[i], away);
    for (uint32_t i = 0; i < WEARERS; i++) {
        struct object *object = i == 0 ? scene_add(&scene, globe, material_of(0))
                                       : scene_share(&scene, 0, i % 3 ? material_of(0) : material_filter(grey(0.5)));
        struct affine shape = affine_scaling(placements[placement].scale);
        struct affine to_origin = affine_translation(vec3_neg(away));
        struct affine turn = affine_rotation(random_unit(i, 20), 180 * random_signed(i, 23));
        shape.linear.x.z = placements[placement].shear * shape.linear.x.x;
        shape = affine_multiply(&shape, &to_origin);
        object->transform = affine_multiply(&turn, &shape);
        struct vec3 at = vec3_scale(random_unit(i, 24), placements[placement].away);
        object->transform.offset = vec3_add(object->transform.offset, at);
    }
    return scene;
}

/* To a corner, to the middle of an edge, along an edge, along a triangle, or into it; from a place that is a few sizes,
 * or as far as the camera, away; or from a corner. No ray runs in a triangle's plane, to rounding: where it meets that
 * is anybody's guess, with copies too. */
static struct ray ray_at(const struct plan *copied, uint32_t i)
{
    const struct triangle *t = &copied->triangles[hash_u32(i) % copied->count[PRIMITIVE_TRIANGLE]];
    struct vec3 ab = vec3_sub(t->b, t->a), ac = vec3_sub(t->c, t->a);
    double size = 20 * vec3_length(ab) + vec3_length(ac);
    double u = random_between(i, 30, 0, 0.5), v = random_between(i, 31, 0, 0.5);
    struct vec3 inner = vec3_add_scaled(vec3_add_scaled(t->a, ab, u), ac, v);
    struct vec3 at = i % 5 == 0 ? t->a : i % 5 == 1 ? vec3_mix(t->a, t->b, 0.5) : inner;
    struct vec3 from = vec3_add_scaled(at, random_unit(i, 32), i % 7 ? size : vec3_length(at));
    if (i % 5 == 3)
        from = vec3_add_scaled(at, ab, 5);
    if (i % 5 == 4)
        from = vec3_add_scaled(vec3_add_scaled(at, ab, 3 * random_signed(i, 35)), ac, 9);
    if (i % 5 >= 3)
        from = vec3_add_scaled(from, random_unit(i, 37), 1e-6 * size);
    struct vec3 way = vec3_sub(at, from);
    struct vec3 direction = vec3_normalize(way);
    if (i % 11 == 0) {
        from = t->b;
        direction = random_unit(i, 40);
    }
    uint32_t own = i % 13 ? PRIMITIVE_NONE : hash_u32(i + 1) % (uint32_t)copied->primitive_count;
    double t_max = i % 4 ? INFINITY : vec3_length(way) * (1 + 1e-9);
    return (struct ray){.origin = from, .direction = direction, .t_max = t_max, .key_min = KEY_NONE, .from = own};
}

/* Everything that rays meet, sorted. */
static int compare_crossings(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->ray != b->ray)
        return a->ray < b->ray ? -1 : 1;
    return a->id != b->id ? (a->id < b->id ? -1 : 1) : (a->side > b->side) - (a->side < b->side);
}

/* Without those of blocked rays and doubles, which a kernel may give or not. */
static size_t tidy_crossings(struct crossing_list *list, const uint8_t *blocked)
{
    size_t kept = 0;
    if (list->count > 0)
        qsort(list->items, list->count, sizeof *list->items, compare_crossings);
    for (size_t i = 0; i < list->count; i++) {
        const struct crossing *item = &list->items[i];
        if (!blocked[item->ray] && (kept == 0 || compare_crossings(&list->items[kept - 1], item) != 0))
            list->items[kept++] = *item;
    }
    return kept;
}

static void assert_same_hits(const struct kernel *kernel, const struct plan *copied, const struct plan *shared,
                             const struct ray_batch *rays)
{
    const struct plan *plans[2] = {copied, shared};
    struct hit_batch hits[2] = {{0}, {0}};
    struct crossing_list crossings[2] = {{0}, {0}};
    static uint8_t blocked[2][RAYS];
    size_t met = 0, passed[2];
    for (int k = 0; k < 2; k++) {
        hit_batch_reserve(&hits[k], rays->count);
        kernel->closest(plans[k], rays, &hits[k]);
        kernel->shadow(plans[k], rays, blocked[k], &crossings[k]);
        passed[k] = tidy_crossings(&crossings[k], blocked[k]);
    }
    for (size_t i = 0; i < rays->count; i++)
        met += hits[0].key[i] != LANE_HIT_NONE;
    assert_true(met > RAYS / 4);
    assert_memory_equal(hits[0].t, hits[1].t, rays->count * sizeof(double));
    assert_memory_equal(hits[0].key, hits[1].key, rays->count * sizeof(double));
    assert_memory_equal(blocked[0], blocked[1], rays->count);
    assert_int_equal(passed[0], passed[1]);
    for (size_t i = 0; i < passed[0]; i++) {
        assert_int_equal(compare_crossings(&crossings[0].items[i], &crossings[1].items[i]), 0);
        assert_true(crossings[0].items[i].t == crossings[1].items[i].t);
    }
    for (int k = 0; k < 2; k++) {
        hit_batch_finish(&hits[k]);
        crossing_list_finish(&crossings[k]);
    }
}

static void rays_meet_what_they_meet_among_copies(void **state)
{
    (void)state;
    print_message("# seed %d\n", TEST_SEED);
    for (size_t placement = 0; placement < sizeof placements / sizeof *placements; placement++) {
        struct scene scene = placed_scene(placement);
        struct trace_settings settings = settings_of(&scene);
        struct plan *copied = plan_create_sharing(&scene, &settings, 1, SIZE_MAX);
        struct plan *shared = plan_create_sharing(&scene, &settings, 1, 0);
        struct ray_batch rays = {0};
        print_message("# %s\n", placements[placement].name);
        assert_int_equal(shared->count[PRIMITIVE_INSTANCE], WEARERS);
        for (uint32_t i = 0; i < RAYS; i++) {
            struct ray ray = ray_at(copied, i);
            ray_batch_push(&rays, &ray);
        }
        for (size_t k = 0; kernel_at(k); k++)
            assert_same_hits(kernel_at(k), copied, shared, &rays);
        ray_batch_finish(&rays);
        plan_destroy(&copied);
        plan_destroy(&shared);
        scene_finish(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(instances_look_like_copies),
        cmocka_unit_test(what_instances_touch_is_welded),
        cmocka_unit_test(rays_meet_what_they_meet_among_copies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
