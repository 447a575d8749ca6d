/*
 * .ply meshes in the model, from text and from binary of both byte orders. What is refused is in scenes/bad/.
 */
#include <math.h>
#include <stdio.h>

#include "tests/unit/scene_help.h"

#define TETRAHEDRON_BODY                                                                                       \
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"                                                                             \
    "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"

static const char plain_header[] = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                                   "element face 4\nproperty list uchar int vertex_indices\nend_header\n";

static void text_is_read(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "ply\nformat ascii 1.0\ncomment by hand\nobj_info 7\n%s" TETRAHEDRON_BODY,
             plain_header);
    struct scene scene = load_mesh("a.ply", text, "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(scene.object_count, 1);
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->triangle_count, 4);
    assert_true(mesh->closed);
    assert_null(mesh->normals);
    assert_null(mesh->uv);
    assert_vec3(mesh->points[3], 0, 0, 1);
    scene_finish(&scene);
}

static void line_ends_of_windows_and_blank_lines_do_not_count(void **state)
{
    (void)state;
    struct scene scene =
        load_mesh("a.ply",
                  "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n"
                  "property float z\r\nelement face 1\r\nproperty list uint8 int32 vertex_index\r\n"
                  "end_header\r\n0 0 0\r\n\r\n 1 0 0 \r\n0 1 0\r\n3 0 1 2",
                  "");
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, 1);
    scene_finish(&scene);
}

/* Properties in another order, lists among them, elements that nobody asked for, four-cornered faces. */
static void what_a_mesh_does_not_need_is_passed_over(void **state)
{
    (void)state;
    struct scene scene =
        load_mesh("a.ply",
                  "ply\nformat ascii 1.0\nelement camera 1\nproperty float view_px\nproperty list int float q\n"
                  "element vertex 4\nproperty uchar red\nproperty double z\nproperty list uchar short spots\n"
                  "property float y\nproperty int x\nproperty float s\nproperty float t\nproperty float ny\n"
                  "element nothing 3\nelement face 1\nproperty int flags\n"
                  "property list uchar uint vertex_indices\nproperty list uchar float texcoord\n"
                  "element edge 1\nproperty int a\nend_header\n"
                  "1.5 2 8 9\n255 0 2 7 8 0 0 .5 .25 1\n255 0 0 0 2 0 0 1\n255 0 0 2 2 0 0 1\n"
                  "255 0 0 2 0 0 0 1\n-7 4 0 1 2 3 2 .5 .5\n12\n",
                  "");
    const struct mesh *mesh = mesh_of(&scene, 0);
    assert_int_equal(mesh->triangle_count, 2);
    assert_vec3(mesh->points[2], 2, 2, 0);
    assert_true(mesh->uv[0] == 0.5 && mesh->uv[1] == 0.25);
    assert_null(mesh->normals); /* ny alone is none */
    scene_finish(&scene);
}

/* --- binary ----------------------------------------------------------------------------------------------- */

/* The lowest `size` bytes of bits. */
static void put_bits(struct bytes *to, uint64_t bits, size_t size, bool big)
{
    for (size_t i = 0; i < size; i++)
        bytes_put_u8(to, (uint8_t)(bits >> 8 * (big ? size - 1 - i : i)));
}

static void put_float(struct bytes *to, float value, bool big)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bits(to, bits, sizeof bits, big);
}

static void put_double(struct bytes *to, double value, bool big)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bits(to, bits, sizeof bits, big);
}

/* All eight types, with values that only their own sign and width give. */
static void binary_of_either_order_is_read(void **state)
{
    (void)state;
    static const char header[] =
        "element vertex 3\nproperty char x\nproperty short y\nproperty double z\nproperty float32 nx\n"
        "property int ny\nproperty uchar nz\nproperty ushort u\nproperty uint v\nproperty list ushort int8 "
        "tags\n"
        "element face 2\nproperty list int ushort vertex_indices\nproperty uint16 flags\nend_header\n";
    for (int big = 0; big < 2; big++) {
        struct bytes file = {0};
        char line[64];
        bytes_put(&file, line,
                  (size_t)sprintf(line, "ply\nformat binary_%s_endian 1.0\n", big ? "big" : "little"));
        bytes_put(&file, header, sizeof header - 1);
        for (uint32_t i = 0; i < 3; i++) {
            put_bits(&file, (uint64_t) - (int64_t)i, 1, big);
            put_bits(&file, (uint64_t)(-300 * (int64_t)(i / 2)), 2, big);
            put_double(&file, 0.1, big);
            put_float(&file, 0, big);
            put_bits(&file, (uint64_t)-3, 4, big);
            put_bits(&file, 4, 1, big);
            put_bits(&file, 65535, 2, big);
            put_bits(&file, 4294967295u, 4, big);
            put_bits(&file, i, 2, big);
            put_bits(&file, 0x0a0d0a, i, big);
        }
        for (uint32_t i = 0; i < 2; i++) {
            put_bits(&file, 3, 4, big);
            for (uint32_t k = 0; k < 3; k++)
                put_bits(&file, (i + k) % 3, 2, big);
            put_bits(&file, 1, 2, big);
        }
        struct scene scene = load_mesh_bytes("a.ply", file.data, file.size, "");
        const struct mesh *mesh = mesh_of(&scene, 0);
        assert_int_equal(mesh->triangle_count, 2);
        assert_vec3(mesh->points[1], -1, 0, 0.1);
        assert_vec3(mesh->points[2], -2, -300, 0.1);
        assert_near(mesh->normals[1].y, -0.6);
        assert_near(mesh->normals[1].z, 0.8);
        assert_true(mesh->uv[2] == 65535 && mesh->uv[3] == 4294967295.0);
        assert_int_equal(mesh->index[3], 1);
        bytes_finish(&file);
        scene_finish(&scene);
    }
}

/* A file cut anywhere is refused, and what it claims to hold is not allocated. */
static void every_cut_is_refused(void **state)
{
    (void)state;
    char whole[512];
    size_t header = (size_t)sprintf(whole, "ply\nformat binary_little_endian 1.0\n%s", plain_header),
           size = header;
    memset(whole + size, 0, sizeof whole - size);
    size += 4 * 12;
    for (int i = 0; i < 4; i++) {
        whole[size] = 3;
        size += 13;
    }
    for (size_t cut = 0; cut < size; cut++) {
        struct asset_set assets = {0};
        struct scene scene;
        struct error error = {{0}};
        add_bytes(&assets, "a.ply", whole, cut);
        add_object_scene(&assets, "'type': 'mesh', 'file': 'a.ply'");
        assert_int_equal(scene_load(&scene, "scene.json", &assets, &error), STATUS_INPUT);
        assert_non_null(strstr(error.text, "a.ply:"));
        asset_set_finish(&assets);
    }
    struct scene scene = load_mesh_bytes("a.ply", whole, size, "");
    assert_int_equal(mesh_of(&scene, 0)->triangle_count, 4);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_is_read),
        cmocka_unit_test(line_ends_of_windows_and_blank_lines_do_not_count),
        cmocka_unit_test(what_a_mesh_does_not_need_is_passed_over),
        cmocka_unit_test(binary_of_either_order_is_read),
        cmocka_unit_test(every_cut_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
