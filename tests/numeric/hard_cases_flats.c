/*
 * Hard cases 25 to 31: planes, discs, boxes, triangles and meshes.
 */
#include "tests/numeric/shoot.h"

static struct shape triangle(struct vec3 a, struct vec3 b, struct vec3 c)
{
    const struct vec3 points[] = {a, b, c};
    static const uint32_t corners[] = {0, 1, 2};
    return shape_mesh(points, 3, corners, 1, false);
}

/* Rays in a plane, or parallel to it beside it, meet nothing. */
static void case_25_in_a_plane(void **state)
{
    (void)state;
    struct vec3 y = {0, 1, 0};
    struct world worlds[] = {
        world_plain(shape_plane(vec3_make(0, 1, 0), y)), world_plain(shape_disc(vec3_make(0, 1, 0), y, 2)),
        world_plain(triangle(vec3_make(-2, 1, -2), vec3_make(2, 1, -2), vec3_make(0, 1, 3)))};
    for (size_t k = 0; k < 3; k++) {
        for (uint32_t i = 0; i < 1000; i++) {
            double angle = random_between(i, 0, 0, 6.283185307179586), zero = i % 2 ? 0.0 : -0.0;
            double beside = i % 3 == 0 ? 0 : random_signed(i, 1) * 1e-12;
            assert_misses(&worlds[k], vec3_make(-3 * cos(angle), 1 + beside, -3 * sin(angle)),
                          vec3_make(cos(angle), zero, sin(angle)));
        }
        world_end(&worlds[k]);
    }
}

/* The cosine 1e-300: t is the height over it, as far as that is a number. */
static void case_26_almost_in_a_plane(void **state)
{
    (void)state;
    struct world world = world_plain(shape_plane(vec3_make(0, 0, 0), vec3_make(0, 1, 0)));
    struct world disc = world_plain(shape_disc(vec3_make(0, 0, 0), vec3_make(0, 1, 0), 1));
    check_shot(&world, vec3_make(0, 1, 0), vec3_make(1, -1e-300, 0), SIDE_ENTER, 1e300, 1e285);
    check_shot(&world, vec3_make(0, -1, 0), vec3_make(1, 1e-300, 0), SIDE_LEAVE, 1e300, 1e285);
    check_shot(&world, vec3_make(0, 1e-290, 0), vec3_make(0, -1e-300, 1), SIDE_ENTER, 1e10, 1e-5);
    assert_misses(&world, vec3_make(0, 1e10, 0), vec3_make(1, -1e-300, 0)); /* beyond all numbers */
    assert_misses(&world, vec3_make(0, 1, 0), vec3_make(1, 1e-300, 0));
    assert_misses(&world, vec3_make(0, 1, 0), vec3_make(1, -5e-324, 0));
    assert_misses(&disc, vec3_make(0, 1, 0), vec3_make(1, -1e-300, 0));
    check_shot(&disc, vec3_make(-0.5, 1e-301, 0), vec3_make(1, -1e-300, 0), SIDE_ENTER, 0.1, 1e-15);
    world_end(&world);
    world_end(&disc);
}

/* Every face, edge and corner of the cube −1..1, met head-on, in its own plane and along its own edge, with
 * both zeros. */
static void case_27_box_faces_edges_and_corners(void **state)
{
    (void)state;
    struct world world = world_plain(shape_box(vec3_make(-1, -1, -1), vec3_make(1, 1, 1)));
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 36; i++) {
            double at[3], d[3] = {i % 2 ? 0.0 : -0.0, i % 2 ? 0.0 : -0.0, i % 2 ? 0.0 : -0.0};
            double sign = i / 2 % 2 ? 1 : -1;
            at[axis] = -4 * sign;
            d[axis] = sign;
            at[(axis + 1) % 3] = i / 4 % 3 - 1; /* −1, 0, 1: edge, middle, edge */
            at[(axis + 2) % 3] = i / 12 - 1;
            struct vec3 o = {at[0], at[1], at[2]}, direction = {d[0], d[1], d[2]};
            struct hit hit = shoot(&world, o, direction);
            check_hit(&hit, SIDE_ENTER, 3, 0);
            assert_int_equal(hit.part, 2 * axis + (sign > 0));
            struct ray inside = ray_from(&world, vec3_add_scaled(o, direction, 4), direction);
            hit = shoot_ray(&world, &inside);
            check_hit(&hit, SIDE_LEAVE, 1, 0);
            at[(axis + 1) % 3] = 1 + 2 * DBL_EPSILON; /* just outside */
            assert_misses(&world, vec3_make(at[0], at[1], at[2]), direction);
        }
    for (int corner = 0; corner < 8; corner++) {
        struct vec3 c = {corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1};
        check_shot(&world, vec3_scale(c, 3), vec3_neg(c), SIDE_ENTER, 2 * sqrt(3), 4e-15);
        check_shot(&world, vec3_make(0, 0, 0), c, SIDE_LEAVE, sqrt(3), 4e-15);
    }
    world_end(&world);
}

/* Rays at points, lines and corners that fold onto themselves: none, or a number. */
static void case_28_triangles_without_area(void **state)
{
    (void)state;
    const struct vec3 a = {0, 0, 1}, b = {1, 1, 1}, c = {2, 2, 1};
    struct world worlds[] = {world_plain(triangle(a, b, c)), world_plain(triangle(a, a, a)),
                             world_plain(triangle(a, b, b)), world_plain(triangle(a, c, b))};
    for (size_t k = 0; k < 4; k++) {
        for (uint32_t i = 0; i < 3000; i++) {
            struct vec3 o = vec3_scale(random_vector(i, 0), 3);
            struct vec3 target = vec3_mix(a, c, i % 4 ? random_between(i, 3, 0, 1) : 0);
            struct ray ray = ray_from(&worlds[k], o, vec3_sub(target, o));
            struct hit hit = shoot_ray(&worlds[k], &ray); /* which sees that t is finite */
            if (hit.id != PRIMITIVE_NONE) {
                struct surface surface = surface_at(worlds[k].plan, &ray, &hit);
                assert_true(vec3_is_finite(surface.position) && vec3_is_finite(surface.normal));
            }
        }
        world_end(&worlds[k]);
    }
}

/* 10^8 long, 1 wide: in its plane's own units a hit is exact, and to either side of its edges there is none. */
static void case_29_needle(void **state)
{
    (void)state;
    struct world world = world_plain(triangle(vec3_make(0, 0, 1), vec3_make(1e8, 0, 1), vec3_make(0, 1, 1)));
    const struct vec3 down = {0, 0, -1};
    check_shot(&world, vec3_make(5e7, 0.25, 3), down, SIDE_ENTER, 2, 0);
    check_shot(&world, vec3_make(5e7, 0.5 - 1e-7, 3), down, SIDE_ENTER, 2, 1e-15);
    assert_misses(&world, vec3_make(5e7, 0.5 + 1e-7, 3), down);
    assert_misses(&world, vec3_make(5e7, -1e-12, 3), down);
    for (uint32_t i = 0; i < 5000; i++) {
        double x = random_between(i, 0, 0, 0.999), y = (1 - x) * random_between(i, 1, 0.01, 0.99);
        struct vec3 target = {1e8 * x, y, 1}, d = random_unit(i, 2);
        if (fabs(d.z) < 0.1)
            continue;
        struct ray ray = ray_from(&world, vec3_add_scaled(target, d, -random_between(i, 5, 1, 100)), d);
        double enter = exact_t(&world, &ray, SIDE_ENTER), leave = exact_t(&world, &ray, SIDE_LEAVE);
        struct hit hit = shoot_ray(&world, &ray);
        check_hit(&hit, enter > 0 ? SIDE_ENTER : SIDE_LEAVE, enter > 0 ? enter : leave,
                  1e-6); /* ulps of 10^8 */
    }
    world_end(&world);
}

/* Follows rays through all that they meet, to the end: how often each enters less how often it leaves, and
 * how often it hits. */
static void follow(const struct world *world, struct ray_batch *rays, int *balance, unsigned *met)
{
    struct hit_batch hits = {0};
    for (bool any = true; any;) {
        any = false;
        shoot_batch(world->plan, rays, &hits);
        for (size_t i = 0; i < rays->count; i++) {
            rays->t_min[i] = INFINITY; /* done */
            if (hit_batch_id(&hits, i) == PRIMITIVE_NONE)
                continue;
            rays->t_min[i] = hits.t[i];
            rays->key_min[i] = hit_key(hit_batch_id(&hits, i), hit_batch_side(&hits, i));
            balance[i] += hit_batch_side(&hits, i) == SIDE_ENTER ? 1 : -1;
            met[i]++;
            any = true;
        }
    }
    hit_batch_finish(&hits);
}

static void push(struct ray_batch *rays, const struct world *world, const struct affine *placement,
                 struct vec3 from, struct vec3 to)
{
    struct vec3 origin = affine_point(placement, from);
    struct ray ray = ray_from(world, origin, vec3_sub(affine_point(placement, to), origin));
    ray_batch_push(rays, &ray);
}

enum { GLOBE_RAYS = 9000, GLOBE_KINDS = 3 };

/* At vertices (a third) and edges of a globe: from inside; from far outside; and out of the far side through
 * its middle. */
static void push_globe_rays(struct ray_batch *rays, const struct world *world, const struct affine *placement,
                            struct vec3 center)
{
    const struct mesh *mesh = &world->scene.objects[0].shape.mesh;
    for (uint32_t i = 0; i < GLOBE_RAYS; i++) {
        const uint32_t *corner = &mesh->index[3 * (hash_u32(i) % mesh->triangle_count)];
        double along = i / GLOBE_KINDS % 3 == 0 ? 0 : random_between(i, 3, 0, 1);
        struct vec3 target = vec3_mix(mesh->points[corner[i % 3]], mesh->points[corner[(i + 1) % 3]], along);
        struct vec3 in = vec3_add(center, vec3_scale(random_vector(i, 4), 0.3));
        if (i % GLOBE_KINDS == 0)
            push(rays, world, placement, in, target);
        else if (i % GLOBE_KINDS == 1)
            push(rays, world, placement, vec3_add(center, vec3_scale(random_unit(i, 7), 30)), target);
        else
            push(rays, world, placement, vec3_mix(target, in, -20), in);
    }
}

/* From inside rays leave once more than they enter, from outside as often, and those aimed at the middle do
 * enter. Also mirrored, far off and turned. */
static void case_30_closed_mesh_does_not_leak(void **state)
{
    (void)state;
    const struct vec3 center = {0.1, -0.2, 0.3};
    struct affine turn = affine_rotation(vec3_normalize(vec3_make(1, 2, 3)), 37);
    turn.offset = vec3_make(1000, -2000, 500);
    const struct affine placements[] = {affine_identity(), affine_scaling(vec3_make(-1, 1, 1)), turn};
    for (size_t k = 0; k < 3; k++) {
        struct world world = world_of(shape_globe(center, 1, 8, 11), placements[k], placements[k].offset);
        struct ray_batch rays = {0};
        int *balance = memory_array(GLOBE_RAYS, sizeof *balance);
        unsigned *met = memory_array(GLOBE_RAYS, sizeof *met), leaks = 0;
        push_globe_rays(&rays, &world, &placements[k], center);
        follow(&world, &rays, balance, met);
        for (size_t i = 0; i < GLOBE_RAYS; i++) {
            leaks += balance[i] != (i % GLOBE_KINDS == 0 ? -1 : 0);
            leaks += i % GLOBE_KINDS == 2 && met[i] < 2;
        }
        assert_int_equal(leaks, 0);
        ray_batch_finish(&rays);
        free(balance);
        free(met);
        world_end(&world);
    }
}

/* Two of each shape at one place: the first is hit, on both sides. */
static void case_31_coincident_faces_lowest_id(void **state)
{
    (void)state;
    for (int kind = 0; kind < 5; kind++) {
        struct world world = world_begin(vec3_make(0, 0, 0));
        for (int copy = 0; copy < 3; copy++) {
            struct vec3 n = vec3_normalize(vec3_make(0.3, 0.5, 1)), o = {0.1, 0.2, 0.3};
            struct shape shape = kind == 0   ? shape_sphere(o, 1)
                                 : kind == 1 ? shape_plane(o, n)
                                 : kind == 2 ? shape_disc(o, n, 1)
                                 : kind == 3 ? shape_frustum(o, n, 0.5, 0.25)
                                             : triangle(n, vec3_make(-1, 0.2, 0.1), vec3_make(0.3, -1, 0.2));
            scene_add(&world.scene, shape, material_matte(grey(1)));
        }
        world_compile(&world);
        unsigned met[2] = {0, 0};
        for (uint32_t i = 0; i < 1000; i++) {
            struct vec3 target = vec3_add(vec3_make(0.2, 0.3, 0.6), vec3_scale(random_vector(i, 0), 0.2));
            struct vec3 d = random_unit(i, 3);
            struct hit hit = shoot(&world, i % 2 ? target : vec3_add_scaled(target, d, -3), d);
            if (hit.id == PRIMITIVE_NONE)
                continue;
            assert_int_equal(hit.id, 0);
            met[hit.side]++;
        }
        assert_true(met[SIDE_ENTER] > 50 && met[SIDE_LEAVE] > 50);
        world_end(&world);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(case_25_in_a_plane),
        cmocka_unit_test(case_26_almost_in_a_plane),
        cmocka_unit_test(case_27_box_faces_edges_and_corners),
        cmocka_unit_test(case_28_triangles_without_area),
        cmocka_unit_test(case_29_needle),
        cmocka_unit_test(case_30_closed_mesh_does_not_leak),
        cmocka_unit_test(case_31_coincident_faces_lowest_id),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
