/*
 * What rays hit does not depend on the tree: all kernels find, to the bit, what trying every primitive finds. The rays
 * are those whose hits rounding moves most: in the planes of triangles, and at very flat frustums from very far away.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/sanitized.h"
#include "tests/scene_builder.h"
#include "trace/plan_parts.h"

#ifdef SANITIZED /* some ten times slower */
enum { RAYS = 1000 };
#else
enum { RAYS = 8000 };
#endif

/* --- what is found ---------------------------------------------------------------------------------------- */

struct found {
    struct hit_batch hits;
    struct crossing_list crossings;
    uint8_t *blocked;
};

static int compare_crossings(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->ray != b->ray)
        return a->ray < b->ray ? -1 : 1;
    return a->id != b->id ? (a->id < b->id ? -1 : 1) : (a->side > b->side) - (a->side < b->side);
}

/* Sorts them, without those of blocked rays and doubles, which a kernel may give or not. */
static void tidy_crossings(struct found *found)
{
    struct crossing_list *list = &found->crossings;
    size_t kept = 0;
    if (list->count > 0)
        qsort(list->items, list->count, sizeof *list->items, compare_crossings);
    for (size_t i = 0; i < list->count; i++) {
        const struct crossing *item = &list->items[i];
        if (!found->blocked[item->ray] && (kept == 0 || compare_crossings(&list->items[kept - 1], item) != 0))
            list->items[kept++] = *item;
    }
    list->count = kept;
}

static struct found find(const struct kernel *kernel, const struct plan *plan, const struct ray_batch *rays)
{
    struct found found = {.blocked = memory_array(rays->count, 1)};
    hit_batch_reserve(&found.hits, rays->count);
    kernel->closest(plan, rays, &found.hits);
    kernel->shadow(plan, rays, found.blocked, &found.crossings);
    tidy_crossings(&found);
    return found;
}

static void found_finish(struct found *found)
{
    hit_batch_finish(&found->hits);
    crossing_list_finish(&found->crossings);
    free(found->blocked);
}

static size_t count_hits(const struct found *found, size_t rays)
{
    size_t hits = 0;
    for (size_t i = 0; i < rays; i++)
        hits += found->hits.key[i] != LANE_HIT_NONE;
    return hits;
}

static bool same_double(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0;
}

/* How many rays hit something else, or at another t. */
static size_t count_other_hits(const struct found *a, const struct found *b, size_t rays)
{
    size_t others = 0;
    for (size_t i = 0; i < rays; i++)
        others += !same_double(a->hits.t[i], b->hits.t[i]) || !same_double(a->hits.key[i], b->hits.key[i]) ||
                  a->blocked[i] != b->blocked[i];
    return others;
}

static bool same_crossings(const struct found *a, const struct found *b)
{
    if (a->crossings.count != b->crossings.count)
        return false;
    for (size_t i = 0; i < a->crossings.count; i++) {
        const struct crossing *x = &a->crossings.items[i], *y = &b->crossings.items[i];
        if (compare_crossings(x, y) != 0 || !same_double(x->t, y->t))
            return false;
    }
    return true;
}

/* The scene without its tree, but for the extent, which tells what rays are distant. */
static struct found try_all(const struct plan *plan, const struct ray_batch *rays)
{
    struct plan all = *plan;
    all.bvh = (struct bvh){.extent = plan->bvh.extent};
    return find(&kernel_ref, &all, rays);
}

/* All kernels with the tree of `plan` against the scan of `copied`, a plan of the same scene without instances. */
static size_t count_failures(const char *name, const struct plan *plan, const struct plan *copied,
                             const struct ray_batch *rays)
{
    struct found expected = try_all(copied, rays);
    size_t failures = 0, hits = count_hits(&expected, rays->count);
    for (size_t k = 0; kernel_at(k); k++) {
        struct found found = find(kernel_at(k), plan, rays);
        size_t others = count_other_hits(&expected, &found, rays->count);
        bool same = same_crossings(&expected, &found);
        if (others > 0 || !same)
            print_message("# %s, %s: of %zu rays, with %zu hits, %zu hit otherwise; crossings %s\n", name,
                          kernel_at(k)->name, rays->count, hits, others, same ? "are the same" : "differ");
        failures += others + !same;
        found_finish(&found);
    }
    assert_true(hits > rays->count / 4 && expected.crossings.count > 0);
    found_finish(&expected);
    return failures;
}

/* --- triangles -------------------------------------------------------------------------------------------- */

enum { TRIANGLES = 400, MESH_SCENES = 4 };

/* Small ones, and for every eighth a long thin or a large one, which the tree cuts into pieces. */
static void random_triangle(uint32_t of, struct vec3 corners[3])
{
    double length = of % 8 ? 0.1 : 1.5, width = of % 8 ? 0.1 : of % 16 ? 0.02 : 1;
    corners[0] = random_vector(of, 0);
    corners[1] = vec3_add_scaled(corners[0], random_unit(of, 3), length);
    corners[2] = vec3_add_scaled(vec3_mix(corners[0], corners[1], random_between(of, 6, 0, 1)), random_unit(of, 7),
                                 width);
}

static struct shape random_mesh(uint32_t number)
{
    struct vec3 points[3 * TRIANGLES];
    uint32_t index[3 * TRIANGLES];
    for (uint32_t i = 0; i < 3 * TRIANGLES; i++)
        index[i] = i;
    for (uint32_t i = 0; i < TRIANGLES; i++)
        random_triangle(1000 * number + i, points + 3 * i);
    return shape_mesh(points, 3 * TRIANGLES, index, TRIANGLES, false);
}

/* Two meshes, one of them twice; one blocks light. */
static struct scene mesh_scene(uint32_t number)
{
    struct scene scene = scene_at(vec3_scale(random_unit(number, 90), 3), 50);
    scene_add(&scene, random_mesh(2 * number), material_matte(grey(1)));
    scene_add(&scene, random_mesh(2 * number + 1), material_filter(grey(0.5)));
    struct object *again = scene_share(&scene, 1, material_filter(grey(0.5)));
    again->transform = affine_rotation(random_unit(number, 93), 180 * random_signed(number, 96));
    return scene;
}

/* Runs in a triangle's plane, or off it by one of the tilts; starts before it, in it or behind it, and ends before it,
 * in it, behind it or never. */
static struct ray ray_in_plane(const struct plan *plan, uint32_t i)
{
    static const double tilts[8] = {0, 0, 0x1p-53, 0x1p-50, 0x1p-40, 0x1p-30, 0x1p-20, 0x1p-12};
    const struct triangle *t = &plan->triangles[hash_u32(i) % plan->count[PRIMITIVE_TRIANGLE]];
    const struct vec3 ab = vec3_sub(t->b, t->a), ac = vec3_sub(t->c, t->a), n = t->plane.normal;
    double u = random_between(i, 30, 0, 1), v = random_between(i, 31, 0, 1 - u);
    struct vec3 at = vec3_add_scaled(vec3_add_scaled(t->a, ab, i % 5 ? u : 0), ac, v);
    struct vec3 along = random_unit(i, 32);
    along = vec3_normalize(vec3_add_scaled(along, n, -vec3_dot(along, n)));
    struct vec3 direction = vec3_normalize(vec3_add_scaled(along, n, tilts[hash_u32(i + 1) % 8]));
    double before = random_between(i, 35, -0.2, i % 3 ? 2 : 0.2);
    struct ray ray = {vec3_add_scaled(at, direction, -before), direction, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, 0};
    if (i % 4 == 1)
        ray.t_max = fabs(before) * random_between(i, 36, 0.5, 2);
    if (i % 4 == 2)
        ray.t_min = fabs(before) * random_between(i, 37, 0, 1);
    return ray;
}

static size_t try_meshes(uint32_t number)
{
    struct scene scene = mesh_scene(number);
    struct trace_settings settings = settings_of(&scene);
    struct plan *copied = plan_create_sharing(&scene, &settings, 1, SIZE_MAX);
    struct plan *shared = plan_create_sharing(&scene, &settings, 1, 0);
    struct ray_batch rays = {0};
    assert_true(copied->bvh.node_count > 0 && copied->bvh.repeats);
    assert_int_equal(shared->count[PRIMITIVE_INSTANCE], 2);
    for (uint32_t i = 0; i < RAYS; i++) {
        struct ray ray = ray_in_plane(copied, RAYS * number + i);
        ray_batch_push(&rays, &ray);
    }
    size_t failures = count_failures("copies", copied, copied, &rays);
    failures += count_failures("instances", shared, copied, &rays);
    ray_batch_finish(&rays);
    plan_destroy(&copied);
    plan_destroy(&shared);
    scene_finish(&scene);
    return failures;
}

static void triangles_are_found_by_rays_in_their_planes(void **state)
{
    (void)state;
    size_t failures = 0;
    print_message("# seed %d\n", TEST_SEED);
    for (uint32_t number = 0; number < MESH_SCENES; number++)
        failures += try_meshes(number);
    assert_int_equal(failures, 0);
}

/* --- flat frustums ---------------------------------------------------------------------------------------- */

enum { FRUSTUMS = 160, FRUSTUM_SCENES = 9 };

/* Cones, frustums and cylinders, each fourth a tube, about 1 wide and by 2^4 to 2^20 flatter. */
static struct shape flat_frustum(uint32_t of)
{
    double radius = random_between(of, 7, 0.2, 1), height = radius * exp2(-random_between(of, 8, 4, 20));
    double top = of % 3 == 0 ? 0 : of % 3 == 1 ? radius : radius * random_between(of, 9, 0, 1);
    struct vec3 base = vec3_scale(random_vector(of, 0), 4);
    struct shape shape = shape_frustum(base, vec3_add_scaled(base, random_unit(of, 3), height), radius, top);
    shape.frustum.open = of / 3 % 4 == 0;
    return shape;
}

static struct scene frustum_scene(uint32_t number, double away)
{
    struct scene scene = scene_at(vec3_scale(random_unit(number, 90), away), 50);
    for (uint32_t i = 0; i < FRUSTUMS; i++)
        scene_add(&scene, flat_frustum(1000 * number + i),
                  i % 2 ? material_matte(grey(1)) : material_filter(grey(0.5)));
    return scene;
}

/* To a point of the rim or the side, or beside it. */
static struct vec3 point_at_frustum(const struct frustum *frustum, uint32_t i, struct vec3 *along)
{
    static const double besides[4] = {0, 1e-15, 1e-9, 1e-4};
    const struct mat3 back = mat3_inverse(&frustum->frame);
    double z = i % 3 ? frustum->height * (i % 3 == 1) : random_between(i, 33, 0, frustum->height);
    double radius = (frustum->radius + frustum->slope * z) * (1 + besides[hash_u32(i) % 4] * random_signed(i, 34));
    struct vec3 out = vec3_normalize(vec3_make(random_signed(i, 35), random_signed(i, 36), 0));
    struct vec3 up = {frustum->slope * out.x, frustum->slope * out.y, 1}, around = {-out.y, out.x, 0};
    *along = vec3_normalize(mat3_apply(&back, vec3_mix(up, around, random_between(i, 37, 0, 1))));
    return vec3_add(frustum->origin, mat3_apply(&back, vec3_add_scaled(vec3_make(0, 0, z), out, radius)));
}

/* Along a side or less so, from 2^-4 to 2^40 extents away, from the camera, or from where squares are infinite. */
static struct ray ray_at_frustum(const struct plan *plan, uint32_t i)
{
    static const double tilts[4] = {0, 1e-9, 1e-4, 1};
    struct vec3 along;
    struct vec3 at = point_at_frustum(&plan->frustums[hash_u32(i) % plan->count[PRIMITIVE_FRUSTUM]], i, &along);
    double distance = i % 16 == 3 ? 1e160 : plan->bvh.extent * exp2(random_between(i, 38, -4, 40));
    struct vec3 direction = vec3_normalize(vec3_mix(along, random_unit(i, 39), tilts[hash_u32(i + 1) % 4]));
    struct ray ray = {vec3_add_scaled(at, direction, -distance), direction, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, 0};
    if (i % 16 == 0) {
        ray.origin = vec3_make(0, 0, 0);
        ray.direction = vec3_normalize(at);
    }
    if (i % 8 == 1)
        ray.t_max = distance * random_between(i, 42, 0.9, 1.1);
    return ray;
}

static size_t try_frustums(uint32_t number)
{
    static const double aways[3] = {6, 1e3, 1e6};
    struct scene scene = frustum_scene(number, aways[number % 3]);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct ray_batch rays = {0};
    assert_true(plan->bvh.node_count > 0);
    for (uint32_t i = 0; i < RAYS; i++) {
        struct ray ray = ray_at_frustum(plan, RAYS * number + i);
        ray_batch_push(&rays, &ray);
    }
    size_t failures = count_failures("frustums", plan, plan, &rays);
    ray_batch_finish(&rays);
    plan_destroy(&plan);
    scene_finish(&scene);
    return failures;
}

static void flat_frustums_are_found_from_anywhere(void **state)
{
    (void)state;
    size_t failures = 0;
    print_message("# seed %d\n", TEST_SEED);
    for (uint32_t number = 0; number < FRUSTUM_SCENES; number++)
        failures += try_frustums(number);
    assert_int_equal(failures, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_are_found_by_rays_in_their_planes),
        cmocka_unit_test(flat_frustums_are_found_from_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
