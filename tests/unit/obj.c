/*
 * Wavefront meshes and their materials in the model. What is refused, and with which words, is in scenes/bad/.
 */
#include <math.h>
#include <stdio.h>

#include "math/elementary.h"
#include "tests/unit/scene_help.h"

#define SQUARE "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
#define TETRAHEDRON "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
#define TETRAHEDRON_FACES "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"

/* A grey PNG of 2×2 pixels. */
static const uint8_t grey_png[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
    0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x00, 0x00, 0x00, 0x00, 0x57, 0xdd, 0x52, 0xf8, 0x00, 0x00, 0x00,
    0x0e, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x68, 0x68, 0x60, 0x68, 0x68, 0x00, 0x00, 0x06, 0x06, 0x02,
    0x01, 0x2c, 0xc1, 0x50, 0xd7, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

/* --- faces ------------------------------------------------------------------------------------------------ */

static void faces_become_triangles(void **state)
{
    (void)state;
    struct scene scene = load_mesh("a.obj", SQUARE "f 1 2 3 4\n", "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(scene.object_count, 1);
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->triangle_count, 2);
    assert_null(mesh->normals);
    assert_null(mesh->uv);
    assert_false(mesh->closed);
    assert_vec3(corner_of(mesh, 0, 0), 0, 0, 0);
    assert_vec3(corner_of(mesh, 0, 1), 2, 0, 0);
    assert_vec3(corner_of(mesh, 0, 2), 2, 2, 0);
    scene_finish(&scene);
}

static void all_forms_of_a_corner_are_read(void **state)
{
    (void)state;
    struct scene scene = load_mesh("a.obj",
                                   SQUARE "vt 0.25 0.5\nvt 1 0 0\nvt 0.75\nvn 0 0 4\nvn 3 0 0\n"
                                          "f 1/1/1 2/2/1 3/3/2\nf -4/-3/-2 -3/-2/-2 -2/-1/-1\n",
                                   "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(mesh->triangle_count, 2);
    assert_int_equal(mesh->vertex_count, 3); /* both faces have the same corners */
    assert_vec3(mesh->normals[mesh->index[0]], 0, 0, 1);
    assert_vec3(mesh->normals[mesh->index[2]], 1, 0, 0);
    assert_true(mesh->uv[0] == 0.25 && mesh->uv[1] == 0.5);
    assert_true(mesh->uv[4] == 0.75 && mesh->uv[5] == 0);
    assert_memory_equal(mesh->index, mesh->index + 3, 3 * sizeof *mesh->index);
    scene_finish(&scene);
}

/* Comments, line ends of Windows, continued lines, a mark, blanks, statements without meaning here. */
static void the_forms_of_lines_do_not_count(void **state)
{
    (void)state;
    struct scene scene =
        load_mesh("a.obj",
                  "\xef\xbb\xbf# a comment \\\r\n\r\no thing\r\ng a b\r\ns 1\r\nv 0 \\\r\n 0 0 1.0\r\n"
                  "\tv 2 0 0 0.1 0.2 0.3 # red\r\nv 2 2 0\r\nl 1 2\r\np 1\r\n  f 1 2 \\\n3\\\n\r\n#end",
                  "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(mesh->triangle_count, 1);
    assert_vec3(corner_of(mesh, 0, 2), 2, 2, 0);
    scene_finish(&scene);
}

/* An arrow, concave at its tail; a fan from its first corner would stick out. */
static void concave_faces_are_cut_properly(void **state)
{
    (void)state;
    struct scene scene = load_mesh("a.obj", "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 4 1 2 3\nf 1 2 3 4\n", "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(mesh->triangle_count, 4);
    assert_true(mesh_area(mesh) == 8); /* the arrow's is 4 */
    scene_finish(&scene);
}

/* A disc of more corners than the cutting of concave ones takes. */
static void convex_faces_may_have_any_number_of_corners(void **state)
{
    (void)state;
    enum { CORNERS = 5000 };
    struct bytes text = {0};
    char line[64];
    for (int i = 0; i < CORNERS; i++) {
        double angle = 360.0 * i / CORNERS;
        bytes_put(&text, line,
                  (size_t)sprintf(line, "v %.17g %.17g 0\n", math_cos_degrees(angle), math_sin_degrees(angle)));
    }
    bytes_put(&text, "f", 1);
    for (int i = 0; i < CORNERS; i++)
        bytes_put(&text, line, (size_t)sprintf(line, " %d", i + 1));
    struct scene scene = load_mesh_bytes("a.obj", text.data, text.size, "");
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, CORNERS - 2);
    double area = CORNERS / 2.0 * math_sin_degrees(360.0 / CORNERS);
    assert_true(fabs(mesh_area(mesh_of(&scene, 0)) - area) < 1e-11); /* 5,000 roundings of 1e-16 and less */
    bytes_finish(&text);
    scene_finish(&scene);
}

/* Faces without normals among faces with them stay flat; their points stay those of the neighbours. */
static void missing_normals_are_the_faces(void **state)
{
    (void)state;
    struct scene scene =
        load_mesh("a.obj", SQUARE "v 0 0 2\nvn 1 0 0\nvn 0 0 0\nf 1//1 2//1 3//2\nf 1 2 5\n", "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_vec3(mesh->normals[mesh->index[0]], 1, 0, 0);
    assert_vec3(mesh->normals[mesh->index[2]], 0, 0, 1); /* vn 0 0 0 is none */
    for (size_t k = 3; k < 6; k++)
        assert_vec3(mesh->normals[mesh->index[k]], 0, -1, 0);
    assert_vec3(corner_of(mesh, 1, 1), 2, 0, 0);
    scene_finish(&scene);
}

/* Programs that mirror a mesh may leave its faces clockwise where its normals are. */
static void faces_follow_the_normals(void **state)
{
    (void)state;
    struct scene scene = load_mesh("a.obj", SQUARE "vn 0 0 -1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\nf 1 4 3\n", "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_vec3(corner_of(mesh, 0, 1), 2, 2, 0);
    assert_vec3(corner_of(mesh, 0, 2), 2, 0, 0);
    assert_vec3(mesh->normals[mesh->index[6]], 0, 0, 1); /* the third face's own, after turning round */
    scene_finish(&scene);
}

static void seams_keep_a_mesh_closed(void **state)
{
    (void)state;
    struct scene scene = load_mesh("a.obj",
                                   TETRAHEDRON "vn 1 0 0\nvn 0 1 0\nv 0 0 0\nv -0 1 0\n"
                                               "f 1//1 6//1 2//1\nf 5//2 2//2 4//2\nf 2 3 4\nf 3 1 4\n",
                                   "");
    assert_true(mesh_of(&scene, 0)->closed);
    scene_finish(&scene);
}

/* A closed grid with 20,000 triangles: each vertex once, each edge matched. */
static void large_meshes_share_their_vertices(void **state)
{
    (void)state;
    enum { RINGS = 100, SIDES = 100 };
    struct bytes text = {0};
    char line[128];
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SIDES; k++) {
            double u = 360.0 * i / RINGS, v = 360.0 * k / SIDES, r = 3 + math_cos_degrees(v);
            bytes_put(&text, line,
                      (size_t)sprintf(line, "v %.7g %.7g %.7g\n", r * math_cos_degrees(u), math_sin_degrees(v),
                                      r * math_sin_degrees(u)));
        }
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SIDES; k++) {
            int j = (i + 1) % RINGS, l = (k + 1) % SIDES;
            bytes_put(&text, line,
                      (size_t)sprintf(line, "f %d %d %d %d\n", 1 + i * SIDES + k, 1 + i * SIDES + l,
                                      1 + j * SIDES + l, 1 + j * SIDES + k));
        }
    struct scene scene = load_mesh_bytes("a.obj", text.data, text.size, "");
    assert_int_equal(mesh_of(&scene, 0)->vertex_count, RINGS * SIDES);
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, 2 * RINGS * SIDES);
    assert_true(mesh_of(&scene, 0)->closed);
    bytes_finish(&text);
    scene_finish(&scene);
}

/* --- materials -------------------------------------------------------------------------------------------- */

static struct scene load_materials(const char *obj, const char *mtl, const char *more)
{
    struct asset_set assets = {0};
    char *members = memory_format("'type': 'mesh', 'file': 'meshes/a.obj'%s", more);
    add_text(&assets, "meshes/a.obj", obj);
    add_text(&assets, "meshes/a.mtl", mtl);
    add_text(&assets, "meshes/my own.mtl", "newmtl a\nKd 1 0 0\nnewmtl c\nKd 0 0 1\n");
    add_bytes(&assets, "meshes/maps/grey.png", grey_png, sizeof grey_png);
    add_object_scene(&assets, members);
    free(members);
    return load_assets(&assets, "scene.json");
}

static void each_material_is_an_object(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\nmtllib my own.mtl\n" SQUARE
                       "f 1 2 3\nusemtl a\nf 1 2 3\nusemtl c\nf 2 3 4\nusemtl a\nf 1 3 4\nusemtl b b\n",
                       "newmtl a\nKd 0.5 0.25 0\n", ", 'transform': [{'translate': [0, 7, 0]}]");
    assert_int_equal(scene.object_count, 3);
    assert_int_equal(mesh_of(&scene, 1)->triangle_count, 2);
    assert_vec3(scene.objects[2].transform.offset, 0, 7, 0);
    assert_vec3(material_of(&scene, 0)->color.color[0], 0.8, 0.8, 0.8); /* none: the default */
    const struct material *a = material_of(&scene, 1);                  /* the first definition counts */
    assert_vec3(vec3_scale(a->color.color[0], a->diffuse), 0.5, 0.25, 0);
    assert_near(a->ambient, 0.05);
    assert_vec3(material_of(&scene, 2)->color.color[0], 0, 0, 1);
    scene_finish(&scene);
}

static void the_objects_own_material_goes_first(void **state)
{
    (void)state;
    struct scene scene = load_materials("mtllib nowhere.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl c\nf 1 3 4\n",
                                        "", ", 'material': {'color': 0.25}");
    assert_int_equal(scene.object_count, 1);
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, 2);
    assert_vec3(material_of(&scene, 0)->color.color[0], 0.25, 0.25, 0.25);
    scene_finish(&scene);
}

static void images_lie_by_the_texture_coordinates(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\n" SQUARE "vt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1 2 3\n",
                       "newmtl a\nKd 0.5 0.5 0.5\nmap_Kd -clamp on -s 2 3 1 maps\\grey.png\n"
                       "newmtl b\nKd 0.5 0.5 0.5\nmap_Kd maps/grey.png\n",
                       "");
    const struct texture *texture = &material_of(&scene, 0)->color;
    assert_int_equal(texture->kind, TEXTURE_IMAGE);
    assert_int_equal(texture->map, MAP_MESH);
    assert_true(texture->repeat_u == 2 && texture->repeat_v == 3);
    assert_true(material_of(&scene, 0)->diffuse == 0.5);
    assert_int_equal(scene.image_count, 1);
    assert_int_equal(material_of(&scene, 1)->color.kind, TEXTURE_CONSTANT); /* without vt: Kd alone */
    scene_finish(&scene);
}

/* Half of the light passes; of the rest a quarter is mirrored and half scattered. */
static void shares_of_light_are_kept(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\n" SQUARE "usemtl a\nf 1 2 3\n",
                       "newmtl a\nKd 0.5 0.5 0.25\nKs 0.25\nNs 10\nd 0.5\nTf 1 0.5 0\nillum 3\n", "");
    const struct material *a = material_of(&scene, 0);
    assert_true(a->transparency == 0.5);
    assert_vec3(a->reflection, 0.125, 0.125, 0.125);
    assert_vec3(a->filter, 1, 0.5, 0);
    assert_vec3(a->specular, 0.25, 0.25, 0.25);
    assert_true(a->shininess == 10);
    double left = 1 - 0.5 - 0.125;
    assert_near(a->diffuse * a->color.color[0].x * left, 0.25);
    assert_near(a->diffuse * a->color.color[0].z * left, 0.125);
    scene_finish(&scene);
}

static void what_gives_back_too_much_is_scaled(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl c\nf 1 2 3\n",
                       "newmtl a\nKd 1 1 1\nKs 1 1 1\nillum 3\nnewmtl c\nKd 1 1 1\nKs 1 1 1\nNs 0\n", "");
    const struct material *a = material_of(&scene, 0), *c = material_of(&scene, 1);
    assert_vec3(a->reflection, 0.5, 0.5, 0.5);
    assert_near(a->diffuse * (1 - a->reflection.x), 0.5);
    assert_near(c->diffuse + 2 * c->specular.x / (c->shininess + 2), 1);
    assert_near(c->diffuse, c->specular.x); /* both by the same factor */
    scene_finish(&scene);
}

static void assert_shared(const struct scene *scene, size_t owner, size_t sharer)
{
    const struct mesh *owned = mesh_of(scene, owner), *shared = mesh_of(scene, sharer);
    assert_false(owned->shared);
    assert_true(shared->shared);
    assert_ptr_equal(shared->index, owned->index);
    assert_ptr_equal(shared->points, owned->points);
}

static void a_file_is_read_once(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n",
                       "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n",
                       "}, {'type': 'mesh', 'file': 'meshes/a.obj', 'transform': [{'translate': [9, 0, 0]}]"
                       "}, {'type': 'mesh', 'file': 'meshes/a.obj', 'material': {'color': [0, 0, 1]}"
                       "}, {'type': 'mesh', 'file': 'meshes/a.obj', 'material': {'color': [1, 1, 1]}");
    assert_int_equal(scene.object_count, 6);
    assert_shared(&scene, 0, 2);
    assert_shared(&scene, 1, 3);
    assert_shared(&scene, 4, 5); /* without the file's materials it is one mesh */
    assert_int_equal(scene.objects[3].material, scene.objects[1].material);
    assert_true(scene.objects[2].transform.offset.x == 9);
    assert_vec3(material_of(&scene, 4)->color.color[0], 0, 0, 1);
    assert_vec3(material_of(&scene, 5)->color.color[0], 1, 1, 1);
    scene_finish(&scene);
}

static void closed_meshes_refract(void **state)
{
    (void)state;
    struct scene scene =
        load_materials("mtllib a.mtl\n" TETRAHEDRON "usemtl a\n" TETRAHEDRON_FACES "usemtl b\nf 1 2 3\n",
                       "newmtl a\nNi 1.5\nillum 7\nTf 0.5\nnewmtl b\nNi 1.5\nillum 7\nTr 0.75\n", "");
    assert_true(material_of(&scene, 0)->ior == 1.5);
    assert_vec3(material_of(&scene, 0)->filter, 0.5, 0.5, 0.5);
    assert_true(material_of(&scene, 1)->ior == 0); /* open: thin */
    assert_true(material_of(&scene, 1)->transparency == 0.75);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_become_triangles),
        cmocka_unit_test(all_forms_of_a_corner_are_read),
        cmocka_unit_test(the_forms_of_lines_do_not_count),
        cmocka_unit_test(concave_faces_are_cut_properly),
        cmocka_unit_test(convex_faces_may_have_any_number_of_corners),
        cmocka_unit_test(missing_normals_are_the_faces),
        cmocka_unit_test(faces_follow_the_normals),
        cmocka_unit_test(seams_keep_a_mesh_closed),
        cmocka_unit_test(large_meshes_share_their_vertices),
        cmocka_unit_test(each_material_is_an_object),
        cmocka_unit_test(the_objects_own_material_goes_first),
        cmocka_unit_test(images_lie_by_the_texture_coordinates),
        cmocka_unit_test(shares_of_light_are_kept),
        cmocka_unit_test(what_gives_back_too_much_is_scaled),
        cmocka_unit_test(closed_meshes_refract),
        cmocka_unit_test(a_file_is_read_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
