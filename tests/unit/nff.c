/*
 * Scenes in the Neutral File Format in the model. What is refused, and with which words, is in scenes/bad/.
 */
#include <math.h>
#include <stdio.h>

#include "tests/unit/scene_help.h"

#define VIEW "v\nfrom 1 2 3\nat 0 0.5 0\nup 0 0 2\nangle 45\nhither 0.01\nresolution 320 200\n"
#define LEAST "v from 1 2 3 at 0 0 0 up 0 0 1 angle 45 "

static struct scene load_nff(const char *text)
{
    struct asset_set assets = {0};
    add_text(&assets, "scene.nff", text);
    return load_assets(&assets, "scene.nff");
}

/* --- view, lights
 * --------------------------------------------------------------------------------------------- */

static void the_view_is_read(void **state)
{
    (void)state;
    struct scene scene = load_nff("# a view\nb 0.1 0.2 0.3\n" VIEW "s 1 2 3 4\n");
    assert_int_equal(scene.width, 320);
    assert_int_equal(scene.height, 200);
    assert_vec3(scene.camera.from, 1, 2, 3);
    assert_vec3(scene.camera.at, 0, 0.5, 0);
    assert_vec3(scene.camera.up, 0, 0, 1);
    assert_true(scene.camera.fov_degrees == 45);
    assert_vec3(scene.background.color[0], 0.1, 0.2, 0.3);
    assert_vec3(scene.ambient, 0, 0, 0);
    assert_int_equal(scene.depth, SCENE_DEPTH_DEFAULT);
    assert_vec3(scene.objects[0].shape.sphere.center, 1, 2, 3);
    assert_true(scene.objects[0].shape.sphere.radius == 4);
    scene_finish(&scene);
}

/* Tokens may stand on any lines; the last view and background count. */
static void lines_do_not_count(void **state)
{
    (void)state;
    struct scene scene =
        load_nff(LEAST "s 0 0 0\n1 c 0 0 0 1 0\n0 1\n0.5 # and\nc\r\n0 0 0 1\r\n0 0 1 1 b 1 1 1 " VIEW);
    assert_int_equal(scene.object_count, 3);
    assert_int_equal(scene.width, 320);
    assert_vec3(scene.background.color[0], 1, 1, 1);
    assert_true(scene.objects[1].shape.frustum.open);
    assert_true(scene.objects[1].shape.frustum.top_radius == 0.5);
    assert_vec3(scene.objects[2].shape.frustum.top, 0, 0, 1);
    scene_finish(&scene);
}

static void lights_without_colour_share_their_strength(void **state)
{
    (void)state;
    struct scene scene = load_nff(LEAST "l 1 2 3\nl 4 5 6 0.5 0.25 2\nl 7 8 9\nl 1 1 1\n");
    assert_int_equal(scene.light_count, 4);
    assert_vec3(scene.lights[0].color, 0.5, 0.5, 0.5); /* 1 / √4 */
    assert_vec3(scene.lights[1].color, 0.5, 0.25, 2);
    assert_vec3(scene.lights[3].color, 0.5, 0.5, 0.5);
    assert_vec3(scene.lights[1].position, 4, 5, 6);
    scene_finish(&scene);
}

/* --- shapes
 * --------------------------------------------------------------------------------------------------- */

static void shapes_that_show_their_inside_are_shapes(void **state)
{
    (void)state;
    struct scene scene = load_nff(LEAST "s 0 0 0 -2\nc 0 0 0 -1 0 0 1 0\n");
    assert_true(scene.objects[0].shape.sphere.radius == 2);
    assert_true(scene.objects[1].shape.frustum.base_radius == 1);
    assert_true(scene.objects[1].shape.frustum.top_radius == 0);
    scene_finish(&scene);
}

/* Polygons of one fill are one mesh, whatever stands between them; fills that say the same are one. */
static void polygons_of_a_fill_are_one_object(void **state)
{
    (void)state;
    struct scene scene =
        load_nff(LEAST "f 1 0 0 1 0 1 0 1\np 3 0 0 0 1 0 0 0 1 0\ns 0 0 0 1\nf 1 0 0 1 0 1 0 1\n"
                       "p 4 0 0 0 1 0 0 1 1 0 0 1 0\nf 0 1 0 1 0 1 0 1\np 3 0 0 0 1 0 0 0 1 0\n"
                       "p 4 0 0 0 4 0 0 1 1 0 0 4 0\n");
    assert_int_equal(scene.object_count, 3);
    assert_int_equal(scene.material_count, 2);
    assert_int_equal(mesh_of(&scene, 1)->triangle_count, 3);
    assert_int_equal(mesh_of(&scene, 1)->vertex_count, 4);
    assert_true(mesh_area(mesh_of(&scene, 2)) == 0.5 + 4); /* the second one is concave */
    assert_vec3(material_of(&scene, 0)->color.color[0], 1, 0, 0);
    assert_int_equal(scene.objects[0].material, scene.objects[1].material);
    scene_finish(&scene);
}

static void patches_keep_their_normals(void **state)
{
    (void)state;
    struct scene scene = load_nff(LEAST "pp 3\n0 0 0 0 3 4\n1 0 0 0 0 2\n0 1 0 0 0 0\np 3 0 0 0 0 1 0 0 0 1\n");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_vec3(mesh->normals[mesh->index[0]], 0, 0.6, 0.8);
    assert_vec3(mesh->normals[mesh->index[1]], 0, 0, 1);
    assert_vec3(mesh->normals[mesh->index[2]], 0, 0, 1); /* none: the triangle's */
    for (size_t k = 3; k < 6; k++)
        assert_vec3(mesh->normals[mesh->index[k]], 1, 0, 0);
    scene_finish(&scene);
}

/* A hundred thousand polygons: one object, whose 224-by-224 grid has each point once. */
static void large_meshes_share_their_points(void **state)
{
    (void)state;
    enum { SIDE = 224 };
    struct bytes text = {0};
    char line[256];
    bytes_put(&text, LEAST "\n", sizeof LEAST);
    for (int x = 0; x < SIDE; x++)
        for (int y = 0; y < SIDE; y++) {
            double u = 0.1 * x, v = 0.1 * y, w = 0.1;
            bytes_put(&text, line,
                      (size_t)sprintf(line, "p 3\n%g %g 0\n%g %g 0\n%g %g 0\n", u, v, u + w, v, u + w, v + w));
            bytes_put(&text, line,
                      (size_t)sprintf(line, "p 3\n%g %g 0\n%g %g 0\n%g %g 0\n", u, v, u + w, v + w, u, v + w));
        }
    bytes_put_u8(&text, 0);
    struct scene scene = load_nff((const char *)text.data);
    assert_int_equal(scene.object_count, 1);
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, 2 * SIDE * SIDE);
    assert_int_equal(mesh_of(&scene, 0)->vertex_count, (SIDE + 1) * (SIDE + 1));
    bytes_finish(&text);
    scene_finish(&scene);
}

/* --- fills
 * ---------------------------------------------------------------------------------------------------- */

static void a_fill_shares_out_light(void **state)
{
    (void)state;
    struct scene scene = load_nff(LEAST "f 1 0.5 0 0.5 0.25 20 0 0\ns 0 0 0 1\n");
    const struct material *m = material_of(&scene, 0);
    assert_vec3(m->reflection, 0.25, 0.25, 0.25);
    assert_vec3(m->specular, 0.25, 0.25, 0.25);
    assert_true(m->shininess == 20 && m->transparency == 0 && m->ior == 0);
    assert_near(m->diffuse * (1 - 0.25), 0.5); /* Kd of the light, though a quarter is mirrored */
    assert_vec3(m->color.color[0], 1, 0.5, 0);
    scene_finish(&scene);
}

/* Kd + Ks + T = 1.1 is divided by 1.1. An index of 1 bends nothing. */
static void shares_beyond_one_are_scaled(void **state)
{
    (void)state;
    struct scene scene = load_nff(LEAST "f 0.5 1 1 0.1 0.1 100 0.9 1\ns 0 0 0 1\n");
    const struct material *m = material_of(&scene, 0);
    assert_near(m->reflection.x, 0.1 / 1.1);
    assert_near(m->transparency, 0.9 / 1.1);
    assert_near(m->diffuse * (1 - m->reflection.x - m->transparency), 0.1 / 1.1);
    assert_vec3(m->filter, 0.5, 1, 1);
    assert_true(vec3_max(m->reflection) + m->transparency <= 1);
    scene_finish(&scene);
}

/* Spheres and closed runs of polygons refract; open ones and cones let light straight on. */
static void solids_of_glass_refract(void **state)
{
    (void)state;
    struct scene scene =
        load_nff(LEAST "f 1 1 0.5 0.2 0 100 0.8 1.1\ns 0 0 0 1\nc 0 0 0 1 0 0 1 1\n"
                       "p 3 0 0 0 0 1 0 1 0 0\np 3 0 0 0 1 0 0 0 0 1\np 3 1 0 0 0 1 0 0 0 1\n"
                       "p 3 0 1 0 0 0 0 0 0 1\nf 1 1 0 0.2 0 100 0.8 1.1\np 3 0 0 0 0 1 0 1 0 0\n");
    assert_int_equal(scene.object_count, 4);
    assert_true(material_of(&scene, 0)->ior == 1.1);
    assert_vec3(material_of(&scene, 0)->filter, 0.8, 0.8, 0.4);
    assert_true(material_of(&scene, 1)->ior == 0);
    assert_near(material_of(&scene, 1)->transparency, 0.8);
    assert_true(mesh_of(&scene, 2)->closed);
    assert_int_equal(scene.objects[2].material, scene.objects[0].material);
    assert_true(material_of(&scene, 3)->ior == 0);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_view_is_read),
        cmocka_unit_test(lines_do_not_count),
        cmocka_unit_test(lights_without_colour_share_their_strength),
        cmocka_unit_test(shapes_that_show_their_inside_are_shapes),
        cmocka_unit_test(polygons_of_a_fill_are_one_object),
        cmocka_unit_test(patches_keep_their_normals),
        cmocka_unit_test(large_meshes_share_their_points),
        cmocka_unit_test(a_fill_shares_out_light),
        cmocka_unit_test(shares_beyond_one_are_scaled),
        cmocka_unit_test(solids_of_glass_refract),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
