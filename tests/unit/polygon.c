/*
 * Cutting faces into triangles, and finding out whether a mesh is closed.
 */
#include "scene/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "base/hash.h"
#include "base/memory.h"
#include "math/elementary.h"
#include "scene/mesh.h"

enum { SEED = 7420, POLYGONS = 2000, CORNERS = 60 };

static double uniform(uint32_t *counter)
{
    return hash_u32(SEED + 0x9e3779b9u * (*counter)++) / 4294967296.0;
}

static struct vec3 triangle_area(const struct vec3 *points, const uint32_t *t)
{
    struct vec3 a = vec3_sub(points[t[1]], points[t[0]]), b = vec3_sub(points[t[2]], points[t[0]]);
    return vec3_scale(vec3_cross(a, b), 0.5);
}

/* Corners at rising angles about a centre, at random distances: simple, and as a rule concave. Tilted so that
 * every coordinate takes its turn as the one that is dropped. */
static size_t make_star(struct vec3 *points, uint32_t *counter)
{
    size_t count = 3 + (size_t)(uniform(counter) * (CORNERS - 3));
    struct vec3 normal = {uniform(counter) - 0.5, uniform(counter) - 0.5, uniform(counter) - 0.5}, u, v;
    normal = vec3_normalize(normal);
    vec3_frame(normal, &u, &v);
    for (size_t i = 0; i < count; i++) {
        double degrees = 360 * (double)i / (double)count, radius = 0.2 + uniform(counter);
        struct vec3 p = vec3_scale(u, radius * math_cos_degrees(degrees));
        points[i] = vec3_add_scaled(p, v, radius * math_sin_degrees(degrees));
    }
    return count;
}

/* All triangles turn the polygon's way and their areas sum to its area: they cover it once. */
static void check_cover(const struct vec3 *points, size_t count, struct vec3 area)
{
    uint32_t corners[POLYGON_CORNERS_MAX], *triangles = memory_array(3 * count, sizeof *triangles);
    for (size_t i = 0; i < count; i++)
        corners[i] = (uint32_t)i;
    polygon_triangulate(points, corners, count, triangles);
    struct vec3 unit = vec3_normalize(area);
    double sum = 0;
    for (size_t i = 0; i < count - 2; i++) {
        double share = vec3_dot(triangle_area(points, triangles + 3 * i), unit);
        assert_true(share > 0);
        sum += share;
    }
    /* Each of the CORNERS areas is off by a few units in the last place. */
    double error = fabs(sum - vec3_length(area)) / sum;
    if (error > 1e-13)
        fail_msg("seed %d: the triangles' area is off by %g", SEED, error);
    assert_true(triangles[0] == 0 && triangles[1] == 1);
    free(triangles);
}

static void triangles_cover_a_polygon_once(void **state)
{
    (void)state;
    uint32_t counter = 0;
    for (int n = 0; n < POLYGONS; n++) {
        struct vec3 points[CORNERS], area = {0};
        struct error error = {{0}};
        size_t count = make_star(points, &counter);
        for (size_t i = 0; i < count; i++)
            area = vec3_add(area, vec3_scale(vec3_cross(points[i], points[(i + 1) % count]), 0.5));
        if (polygon_check(points, count, &error) != STATUS_OK)
            fail_msg("seed %d, polygon %d: %s", SEED, n, error.text);
        check_cover(points, count, area);
    }
}

/* Corners in the middle of straight edges, where ears of no area would be. */
static void straight_corners_make_no_empty_triangles(void **state)
{
    (void)state;
    static const struct vec3 comb[] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0},
                                       {4, 2, 0}, {3, 2, 0}, {3, 1, 0}, {2, 1, 0}, {1, 1, 0},
                                       {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
    struct error error;
    assert_int_equal(polygon_check(comb, sizeof comb / sizeof *comb, &error), STATUS_OK);
    check_cover(comb, sizeof comb / sizeof *comb, vec3_make(0, 0, 6));
}

static void the_largest_polygon_is_cut(void **state)
{
    (void)state;
    struct vec3 saw[POLYGON_CORNERS_MAX];
    for (size_t i = 0; i < POLYGON_CORNERS_MAX; i++) /* teeth, seen along −y */
        saw[i] = vec3_make((double)i, 0, i == 0 || i == POLYGON_CORNERS_MAX - 1 ? 0 : 1 + (double)(i % 2));
    struct error error;
    assert_int_equal(polygon_check(saw, POLYGON_CORNERS_MAX, &error), STATUS_OK);
    double area = 0;
    for (size_t i = 0; i + 1 < POLYGON_CORNERS_MAX; i++)
        area += (saw[i].z + saw[i + 1].z) / 2;
    check_cover(saw, POLYGON_CORNERS_MAX, vec3_make(0, area, 0));
}

static void edges_that_touch_are_refused(void **state)
{
    (void)state;
    static const struct vec3 corner_on_edge[] = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 0, 0}, {0, 4, 0}};
    static const struct vec3 two_in_one_place[] = {{0, 0, 0}, {2, 2, 0}, {4, 0, 0},
                                                   {4, 4, 0}, {2, 2, 0}, {0, 4, 0}};
    struct error error;
    assert_int_equal(polygon_check(corner_on_edge, 5, &error), STATUS_INPUT);
    assert_int_equal(polygon_check(two_in_one_place, 6, &error), STATUS_INPUT);
    assert_string_equal(error.text, "expected edges that meet only at corners, found that 0-1 and 3-4 meet");
}

/* --- meshes ----------------------------------------------------------------------------------------------- */

/* A square-based pyramid whose every face has corners of its own, as files with sharp edges have. `turned`:
 * inside out. */
static struct mesh make_pyramid(bool turned)
{
    static const struct vec3 base[4] = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}}, apex = {0, 2, 0};
    struct mesh mesh = {.points = memory_array(16, sizeof *mesh.points), .vertex_count = 16};
    size_t capacity = 0;
    for (uint32_t i = 0; i < 4; i++) {
        mesh.points[3 * i] = base[i];
        mesh.points[3 * i + 1] = base[(i + 1) % 4];
        mesh.points[3 * i + 2] = apex;
        mesh.points[12 + i] = base[3 - i];
        uint32_t side[3] = {3 * i, 3 * i + 1 + turned, 3 * i + 2 - turned};
        mesh_add_face(&mesh, &capacity, side, 3);
    }
    const uint32_t floor[2][4] = {{12, 13, 14, 15}, {15, 14, 13, 12}};
    mesh_add_face(&mesh, &capacity, floor[turned], 4);
    mesh_close(&mesh);
    return mesh;
}

static double volume_of(const struct mesh *mesh)
{
    double volume = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        struct vec3 area = triangle_area(mesh->points, mesh->index + 3 * i);
        volume += vec3_dot(mesh->points[mesh->index[3 * i]], area) / 3;
    }
    return volume;
}

static void faces_with_corners_of_their_own_can_close_a_mesh(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        struct mesh mesh = make_pyramid(turned);
        assert_int_equal(mesh.triangle_count, 6);
        assert_true(mesh.closed);
        assert_true(fabs(volume_of(&mesh) - 8.0 / 3) < 1e-15);
        mesh_finish(&mesh);
        assert_null(mesh.points);
    }
}

static void a_gap_however_small_leaves_a_mesh_open(void **state)
{
    (void)state;
    struct mesh mesh = make_pyramid(false);
    mesh.points[0].x = nextafter(mesh.points[0].x, 0);
    mesh_close(&mesh);
    assert_false(mesh.closed);
    mesh_finish(&mesh);
}

static void two_equal_faces_close_nothing(void **state)
{
    (void)state;
    static const uint32_t there[3] = {0, 1, 2}, back[3] = {0, 2, 1};
    struct mesh mesh = {.points = memory_array(3, sizeof *mesh.points), .vertex_count = 3};
    size_t capacity = 0;
    mesh.points[1] = vec3_make(1, 0, 0);
    mesh.points[2] = vec3_make(0, 1, 0);
    mesh_add_face(&mesh, &capacity, there, 3);
    mesh_add_face(&mesh, &capacity, back, 3);
    mesh_close(&mesh);
    assert_false(mesh.closed);
    mesh_finish(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_cover_a_polygon_once),
        cmocka_unit_test(straight_corners_make_no_empty_triangles),
        cmocka_unit_test(the_largest_polygon_is_cut),
        cmocka_unit_test(edges_that_touch_are_refused),
        cmocka_unit_test(faces_with_corners_of_their_own_can_close_a_mesh),
        cmocka_unit_test(a_gap_however_small_leaves_a_mesh_open),
        cmocka_unit_test(two_equal_faces_close_nothing),
    };
    return cmocka_run_group_tests_name("polygons and meshes", tests, NULL, NULL);
}
