/*
 * The filters of packets let pass whatever a primitive's own test hits: needles and specks, rays through
 * corners, beside edges, along faces and from as far off as rays that are not distant can be. They drop most of
 * what misses; and with much less than the margins that they allow for the errors of floats they would lose hits,
 * as some of these rays show.
 *
 * (The lanes here are those of the compiler's plain target.)
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#define LANES_SUFFIX filters
#include "tests/random.h"
#include "tests/scene_builder.h"
#include "trace/bounds.h"
#include "trace/lanes/filter.h"

enum { THINGS = 144, KINDS = 8, PACKETS = 18 };

/* A scene's size and how far off the camera is, in sizes: extents that floats have squares of, and others. */
static const struct {
    double size, camera;
} scales[] = {{1, 0.5}, {1, 4}, {1, 1000}, {1e-12, 0.5}, {2e-12, 4}, {1e11, 4}, {1e12, 0.5}, {1e12, 4}};

enum { SCALES = sizeof scales / sizeof *scales };

/* --- scenes ----------------------------------------------------------------------------------------------- */

/* Plain, specks, needles, slivers, in a coordinate plane, and a fan of needles with one corner in common. */
static void random_triangle(uint32_t of, uint32_t kind, struct vec3 corners[3])
{
    static const double length[KINDS] = {0.4, 1e-6, 0.5, 0.5, 0.5, 0.3, 0.5, 1e-3};
    static const double width[KINDS] = {0.4, 1e-6, 1e-7, 1e-13, 1e-9, 0.3, 1e-4, 1e-9};
    struct vec3 a = random_vector(of, 0), along = random_unit(of, 3), across = random_unit(of, 6);
    if (kind == 5)
        along.y = across.y = 0;
    if (kind == 6)
        a = vec3_make(0.25, 0.5, 0.125);
    corners[0] = a;
    corners[1] = vec3_add_scaled(a, along, length[kind]);
    corners[2] = vec3_add_scaled(vec3_mix(a, corners[1], random_between(of, 9, 0, 1)), across, width[kind]);
}

static struct shape random_mesh(uint32_t number)
{
    struct vec3 points[3 * THINGS];
    uint32_t index[3 * THINGS];
    for (uint32_t i = 0; i < 3 * THINGS; i++)
        index[i] = i;
    for (uint32_t i = 0; i < THINGS; i++)
        random_triangle(1000 * number + i, i % KINDS, points + 3 * i);
    return shape_mesh(points, 3 * THINGS, index, THINGS, false);
}

/* Cones, cylinders, frustums and tubes: plain, specks, wires, coins. */
static struct shape random_frustum(uint32_t of, uint32_t kind)
{
    static const double length[KINDS] = {0.5, 0.5, 1, 1, 1e-4, 0.5, 1e-6, 0.5};
    static const double base[KINDS] = {0.2, 0.2, 1e-4, 1e-9, 0.3, 0.2, 1e-6, 1e-3};
    static const double top[KINDS] = {0, 0.2, 1e-4, 0, 0.2, 0.1, 1e-6, 1e-3};
    struct vec3 from = random_vector(of, 0), to = vec3_add_scaled(from, random_unit(of, 3), length[kind]);
    struct shape frustum = shape_frustum(from, to, base[kind], top[kind]);
    frustum.frustum.open = of / KINDS % 2;
    return frustum;
}

static void add_round_things(struct scene *scene, uint32_t number, const struct affine *scaling)
{
    for (uint32_t i = 0; i < THINGS; i++) {
        uint32_t of = 1000 * number + i;
        struct object *object = scene_add(scene, random_frustum(of, i % KINDS), material_matte(grey(1)));
        struct affine bent = affine_scaling(vec3_make(0.5, 1, random_between(of, 10, 0.25, 1)));
        object->transform = i % 3 ? *scaling : affine_multiply(scaling, &bent);
        struct vec3 center = random_vector(of, 11);
        struct shape sphere = shape_sphere(center, i % 4 ? 0.1 : 1e-7);
        scene_add(scene, sphere, material_matte(grey(1)))->transform = *scaling;
    }
}

/* Half of the scenes are triangles, half are round things. */
static struct scene random_scene(uint32_t number)
{
    double size = scales[number % SCALES].size, camera = scales[number % SCALES].camera;
    struct affine scaling = affine_scaling(grey(size));
    struct scene scene = scene_at(vec3_scale(vec3_normalize(vec3_make(0.3, 0.2, 1)), size * camera), 50);
    if (number < SCALES)
        scene_add(&scene, random_mesh(number), material_matte(grey(1)))->transform = scaling;
    else
        add_round_things(&scene, number, &scaling);
    return scene;
}

/* --- rays ------------------------------------------------------------------------------------------------- */

/* How the rays of a packet run: along `axis` by at least `least`, lane 17 by at least `outlier`; or any way if
 * `wild`; or all from the camera. */
struct style {
    bool camera, wild;
    int axis;
    double sign, least, outlier;
};

/* For every 18 packets of any number. An eighth is the limit of a common axis. */
static struct style style_of(uint32_t packet)
{
    static const double least[3] = {0.9, 0.1250001, 0.5}, outlier[3] = {0.1250001, 0.1250001, 0.5};
    uint32_t steepness = packet / 6 % 3;
    return (struct style){packet % 6 == 4,        packet % 6 == 5,  (int)(packet % 3),
                          packet & 1 ? 1.0 : -1.0, least[steepness], outlier[steepness]};
}

/* What one ray is made from: random numbers are those of case `of`; `id` is its target's. */
struct aim {
    const struct style *style;
    double extent;
    uint32_t of, lane, id;
};

static double one_of_eight(const struct aim *aim, uint32_t draw, const double values[8])
{
    return values[hash_u32(aim->of + draw) % 8];
}

static struct vec3 random_way(const struct aim *aim)
{
    double least = aim->lane == 17 ? aim->style->outlier : aim->style->least;
    double along = aim->of % 4 == 0 || aim->lane == 17 ? least : random_between(aim->of, 21, least, 1);
    struct vec3 across = vec3_normalize(vec3_make(random_signed(aim->of, 22), random_signed(aim->of, 23), 0));
    struct vec3 way = vec3_scale(across, sqrt(1 - along * along));
    way.z = aim->style->sign * along;
    return aim->style->wild ? random_unit(aim->of, 25) : axis_to_z(way, aim->style->axis);
}

/* How far beside an edge or a surface. */
static double beside(const struct aim *aim)
{
    static const double shares[8] = {0, 0, 0x1p-53, 1e-14, 1e-10, 1e-7, 1e-4, 0.1};
    return one_of_eight(aim, 31, shares) * aim->extent * (aim->of & 8 ? 1 : -1);
}

/* Through `point` along `way`, from one of many distances; some start on the target. */
static struct ray ray_through(const struct aim *aim, struct vec3 point, struct vec3 way)
{
    static const double distances[8] = {0, 1e-7, 0.5, 1, 2.5, 3, 20, 60};
    double distance = one_of_eight(aim, 30, distances) * aim->extent * random_between(aim->of, 32, 0.5, 1);
    struct ray ray = {vec3_add_scaled(point, way, -distance), way, 0, INFINITY, KEY_NONE, PRIMITIVE_NONE, 0};
    if (aim->style->camera) {
        ray.origin = vec3_make(0, 0, 0);
        ray.direction = vec3_normalize(point);
    }
    if (aim->of % 7 == 0) {
        ray.from = aim->id;
        ray.departure = aim->of % 2 ? DEPART_INWARD : DEPART_OUTWARD;
    }
    return ray;
}

/* At a corner, within, on an edge, beside it or beyond its end; many rays run (nearly) in its plane. */
static struct ray ray_at_triangle(const struct aim *aim, const struct triangle *triangle)
{
    static const double tilts[8] = {0, 1e-16, 1e-12, 1e-8, 1e-4, 1, 1, 1};
    const struct vec3 corners[3] = {triangle->a, triangle->b, triangle->c}, n = triangle->plane.normal;
    const struct style *style = aim->style;
    uint32_t of = aim->of, first = of / 3 % 3;
    struct vec3 p = corners[first], q = corners[(first + 1) % 3], r = corners[(first + 2) % 3];
    struct vec3 point = of % 3 == 0 ? p : vec3_mix(p, q, random_between(of, 33, 0, of & 64 ? 1 : 3));
    struct vec3 in_plane = vec3_cross(vec3_normalize(vec3_sub(q, p)), n);
    if (of % 3 == 1)
        point = vec3_mix(point, r, random_between(of, 34, 0, 1));
    else
        point = vec3_add_scaled(point, in_plane, beside(aim));
    struct vec3 way = random_way(aim);
    double flatten = vec3_dot(way, n) * (one_of_eight(aim, 35, tilts) - 1);
    struct vec3 tilted = vec3_normalize(vec3_add_scaled(way, n, flatten));
    bool fits = axis_to_z(tilted, style->axis).z * style->sign >= style->least || style->wild;
    return ray_through(aim, point, fits ? tilted : way);
}

/* At an end's rim, an apex or the side, to the last bits or beside it; half of the rays run along the side. */
static struct ray ray_at_frustum(const struct aim *aim, const struct frustum *frustum)
{
    const struct mat3 back = mat3_inverse(&frustum->frame);
    uint32_t of = aim->of;
    double z = of % 3 ? random_between(of, 33, 0, frustum->height) : of & 16 ? frustum->height : 0;
    double radius = (frustum->radius + frustum->slope * z) * (1 + ((int)(of % 5) - 2) * 0x1p-52);
    struct vec3 out = vec3_normalize(vec3_make(random_signed(of, 34), random_signed(of, 35), 0));
    struct vec3 point = vec3_add_scaled(vec3_make(0, 0, z), out, radius);
    struct vec3 up = vec3_make(frustum->slope * out.x, frustum->slope * out.y, 1), around = {-out.y, out.x, 0};
    double turn = of % 11 == 0 ? 0 : of % 13 == 0 ? 1 - 1e-9 : random_between(of, 36, 0, 1);
    struct vec3 along = vec3_mix(up, around, turn);
    struct vec3 outwards = vec3_normalize(mat3_apply(&back, out));
    point = vec3_add_scaled(vec3_add(frustum->origin, mat3_apply(&back, point)), outwards, beside(aim));
    return ray_through(aim, point, of & 32 ? vec3_normalize(mat3_apply(&back, along)) : random_way(aim));
}

/* Most of them graze it. */
static struct ray ray_at_sphere(const struct aim *aim, const struct sphere *sphere)
{
    uint32_t of = aim->of;
    struct vec3 way = random_way(aim), out = vec3_normalize(vec3_cross(way, random_unit(of, 33)));
    double share = of % 3 ? 1 + ((int)(of % 5) - 2) * 0x1p-52 : random_signed(of, 36);
    return ray_through(aim, vec3_add_scaled(sphere->center, out, sphere->radius * share), way);
}

/* --- what is compared ------------------------------------------------------------------------------------- */

/* What filters made of pairs of a ray and a primitive, by kind: hits, and those that a filter lost; clear
 * misses (by a 64th of the extent), and those that filters of packets and of single rays dropped. */
struct tally {
    size_t hits[PRIMITIVE_KINDS], lost[PRIMITIVE_KINDS], clear[PRIMITIVE_KINDS], dropped[PRIMITIVE_KINDS];
    size_t dropped_alone[PRIMITIVE_KINDS];
};

struct trial {
    struct plan *plan;
    struct ray_batch rays;
    struct packet packet;
    struct tally *tally;
};

/* Whether the ray passes a box, grown as the tree's boxes are. */
static bool meets_box(const struct trial *trial, const struct bounds *box, int lane)
{
    const double grow = 0x1p-20 * trial->plan->bvh.extent;
    const struct vec3 o = packet_origin(&trial->packet, lane), d = packet_direction(&trial->packet, lane);
    struct interval inside = {0, INFINITY};
    inside = interval_cut(inside, interval_of_slab(o.x, d.x, box->low.x - grow, box->high.x + grow));
    inside = interval_cut(inside, interval_of_slab(o.y, d.y, box->low.y - grow, box->high.y + grow));
    inside = interval_cut(inside, interval_of_slab(o.z, d.z, box->low.z - grow, box->high.z + grow));
    return inside.low <= inside.high;
}

/* Whether the ray hits primitive `id` by its own test, once the tree has brought it there. (Without the box, a
 * triangle also has roots with rays in its plane, to the last bit, that pass far beside it.) */
static bool can_hit(const struct trial *trial, uint32_t id, const struct bounds *box, int lane)
{
    const struct packet *p = &trial->packet;
    const struct window window = packet_window(p, lane);
    const struct vec3 o = packet_origin(p, lane), d = packet_direction(p, lane);
    const struct shear shear = shear_of(d);
    struct roots roots = plan_roots(trial->plan, id, o, d, &shear);
    struct roots ahead = roots_ahead(roots, &window, id, plan_wall(trial->plan, id));
    return roots_nearest(ahead) < INFINITY && (meets_box(trial, box, lane) || p->from[lane] == id);
}

static bool is_clear(const struct trial *trial, const struct bounds *box, int lane)
{
    struct vec3 o = packet_origin(&trial->packet, lane), d = packet_direction(&trial->packet, lane);
    double radius = 0.5 * vec3_length(vec3_sub(box->high, box->low));
    double distance = vec3_length(vec3_cross(vec3_sub(vec3_mix(box->low, box->high, 0.5), o), d));
    return distance > radius + 0x1p-6 * trial->plan->bvh.extent;
}

/* The lanes that the packet's filter lets pass. */
static uint64_t passed_lanes(const struct trial *trial, int kind, size_t index)
{
    const struct packet *p = &trial->packet;
    const struct plan *plan = trial->plan;
    if (kind == PRIMITIVE_TRIANGLE)
        return triangle_lanes(p, &plan->triangles[index], plan->ids[kind][index], UINT64_MAX);
    if (kind == PRIMITIVE_FRUSTUM)
        return frustum_lanes(p, &plan->frustums[index], plan->ids[kind][index], UINT64_MAX);
    return UINT64_MAX;
}

/* Whether the filter of one ray lets pass the first of the four primitives from `index` on. */
static bool passes_alone(const struct trial *trial, int kind, size_t index, int lane)
{
    const struct packet *p = &trial->packet;
    const struct plan *plan = trial->plan;
    if (kind == PRIMITIVE_TRIANGLE)
        return may_meet_triangles(p, lane, &plan->triangles[index]) & 1;
    uint32_t met = kind == PRIMITIVE_SPHERE ? may_meet_spheres(p, lane, &plan->spheres[index])
                                            : may_meet_frustums(p, lane, &plan->frustums[index]);
    return met & 1 || p->from[lane] == plan->ids[kind][index];
}

/* All rays against one primitive. */
static void compare(struct trial *trial, int kind, size_t index)
{
    struct tally *tally = trial->tally;
    const uint32_t id = trial->plan->ids[kind][index];
    const uint64_t passed = passed_lanes(trial, kind, index);
    struct bounds box;
    assert_true(bounds_of_primitive(trial->plan, id, &box));
    for (int lane = 0; lane < PACKET_RAYS; lane++) {
        bool alone = passes_alone(trial, kind, index, lane), hit = can_hit(trial, id, &box, lane);
        bool clear = !hit && is_clear(trial, &box, lane);
        tally->hits[kind] += hit;
        tally->lost[kind] += hit && !(passed >> lane & 1 && alone);
        tally->clear[kind] += clear;
        tally->dropped[kind] += clear && !(passed >> lane & 1);
        tally->dropped_alone[kind] += clear && !alone;
    }
}

/* --- trials ----------------------------------------------------------------------------------------------- */

static struct ray random_ray(const struct plan *plan, int kind, size_t index, const struct aim *aim)
{
    if (kind == PRIMITIVE_TRIANGLE)
        return ray_at_triangle(aim, &plan->triangles[index]);
    if (kind == PRIMITIVE_FRUSTUM)
        return ray_at_frustum(aim, &plan->frustums[index]);
    return ray_at_sphere(aim, &plan->spheres[index]);
}

/* Aims each ray of a packet at a primitive, and tries all of them against all of those, once within the tree
 * and once as outside. share: of the margins. */
static void try_packet(struct trial *trial, int kind, uint32_t number, double share)
{
    _Alignas(64) double t[PACKET_RAYS], key[PACKET_RAYS];
    const struct plan *plan = trial->plan;
    const struct style style = style_of(number);
    struct packet *p = &trial->packet;
    size_t target[PACKET_RAYS];
    trial->rays.count = 0;
    for (uint32_t lane = 0; lane < PACKET_RAYS; lane++) {
        uint32_t of = hash_u32(number * PACKET_RAYS + lane);
        target[lane] = hash_u32(of) % plan->count[kind];
        struct aim aim = {&style, plan->bvh.extent, of, lane, plan->ids[kind][target[lane]]};
        struct ray ray = random_ray(plan, kind, target[lane], &aim);
        ray_batch_push(&trial->rays, &ray);
    }
    packet_start(p, plan, &trial->rays, 0, PACKET_RAYS, t, key);
    packet_prepare_shear(p);
    packet_prepare_floats(p);
    packet_prepare_flat(p);
    p->extent *= share;
    p->flat.error *= (float)share;
    for (int lane = 0; lane < 2 * PACKET_RAYS; lane++) {
        p->in_tree = lane < PACKET_RAYS;
        compare(trial, kind, target[lane % PACKET_RAYS]);
    }
}

static void try_scene(uint32_t number, double share, struct tally *tally)
{
    struct scene scene = random_scene(number);
    struct trace_settings settings = settings_of(&scene);
    struct trial trial = {.plan = plan_create(&scene, &settings, 1), .tally = tally};
    assert_true(trial.plan->bvh.node_count > 0 && trial.plan->bvh.loose_count == 0);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        for (uint32_t packet = 0; trial.plan->count[kind] > 0 && packet < PACKETS; packet++)
            try_packet(&trial, kind, number * PACKETS + packet, share);
    ray_batch_finish(&trial.rays);
    plan_destroy(&trial.plan);
    scene_finish(&scene);
}

/* --- tests ------------------------------------------------------------------------------------------------ */

static void what_is_hit_passes(void **state)
{
    (void)state;
    struct tally tally = {0};
    print_message("# seed %d\n", TEST_SEED);
    for (uint32_t number = 0; number < 2 * SCALES; number++) {
        try_scene(number, 1, &tally);
        for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
            if (tally.lost[kind] > 0)
                fail_msg("scene %u, primitives of kind %d: %zu hits lost", number, kind, tally.lost[kind]);
    }
    assert_true(tally.hits[PRIMITIVE_TRIANGLE] > 4000 && tally.hits[PRIMITIVE_FRUSTUM] > 20000 &&
                tally.hits[PRIMITIVE_SPHERE] > 15000);
}

/* Some of these rays need 2^-9 of the margins, which are for the worst that roundings could do. */
static void without_margins_hits_are_lost(void **state)
{
    (void)state;
    struct tally tally = {0};
    for (uint32_t number = 0; number < 2 * SCALES; number++)
        try_scene(number, 0x1p-12, &tally);
    assert_true(tally.lost[PRIMITIVE_TRIANGLE] > 20 && tally.lost[PRIMITIVE_FRUSTUM] > 50);
    assert_true(tally.lost[PRIMITIVE_SPHERE] == 0); /* that filter is the test itself */
}

/* (A frustum passes where a ray meets the endless cylinder or cone around it.) */
static void clear_misses_are_dropped(void **state)
{
    (void)state;
    struct tally tally = {0};
    try_scene(0, 1, &tally);
    try_scene(SCALES, 1, &tally);
    const size_t *clear = tally.clear, *dropped = tally.dropped, *alone = tally.dropped_alone;
    assert_true(clear[PRIMITIVE_TRIANGLE] > 50000 && clear[PRIMITIVE_FRUSTUM] > 50000);
    assert_true(dropped[PRIMITIVE_TRIANGLE] > 0.99 * clear[PRIMITIVE_TRIANGLE]);
    assert_true(alone[PRIMITIVE_TRIANGLE] > 0.99 * clear[PRIMITIVE_TRIANGLE]);
    assert_true(dropped[PRIMITIVE_FRUSTUM] > 0.8 * clear[PRIMITIVE_FRUSTUM]);
    assert_true(alone[PRIMITIVE_FRUSTUM] > 0.9 * clear[PRIMITIVE_FRUSTUM]);
    assert_true(alone[PRIMITIVE_SPHERE] == clear[PRIMITIVE_SPHERE]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_hit_passes),
        cmocka_unit_test(without_margins_hits_are_lost),
        cmocka_unit_test(clear_misses_are_dropped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
