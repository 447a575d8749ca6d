/*
 * What a JSON scene becomes: each value in its place in the model, each default, the layout of images on
 * shapes. What is refused, and with which words, is in scenes/bad/ and tests/golden/bad_scenes.t.
 */
#include "scene/load.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "math/colour.h"

/* A grey PNG of 2×2 pixels. */
static const uint8_t grey_png[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
    0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x00, 0x00, 0x00, 0x00, 0x57, 0xdd, 0x52, 0xf8, 0x00, 0x00, 0x00,
    0x0e, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x68, 0x68, 0x60, 0x68, 0x68, 0x00, 0x00, 0x06, 0x06, 0x02,
    0x01, 0x2c, 0xc1, 0x50, 0xd7, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

static void add_bytes(struct asset_set *assets, const char *name, const void *data, size_t size)
{
    struct bytes bytes = {0};
    bytes_put(&bytes, data, size);
    bytes_put_u8(&bytes, 0);
    bytes.size--;
    asset_set_add(assets, name, &bytes);
}

/* Loads a scene from memory, beside which there is the picture grey.png. For the reader's sake the text has
 * ' where JSON has quotation marks. */
static enum status load_text(struct scene *scene, const char *text, struct error *error)
{
    struct asset_set assets = {0};
    char *json = memory_string(text);
    for (char *quote = json; (quote = strchr(quote, '\'')); quote++)
        *quote = '"';
    add_bytes(&assets, "scene.json", json, strlen(json));
    free(json);
    add_bytes(&assets, "grey.png", grey_png, sizeof grey_png);
    enum status status = scene_load(scene, "scene.json", &assets, error);
    asset_set_finish(&assets);
    return status;
}

#define CAMERA "'camera': {'from': [0, 1, 5], 'at': [0, 0, 0]}"

/* The scene with a camera and these members. */
static struct scene load_members(const char *members)
{
    struct scene scene;
    struct error error = {{0}};
    char *text = memory_format("{" CAMERA ", %s}", members);
    if (load_text(&scene, text, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    free(text);
    return scene;
}

static struct scene load_objects(const char *objects)
{
    char *members = memory_format("'objects': [%s]", objects);
    struct scene scene = load_members(members);
    free(members);
    return scene;
}

static void assert_vec3(struct vec3 found, double x, double y, double z)
{
    if (found.x != x || found.y != y || found.z != z)
        fail_msg("expected %a %a %a, found %a %a %a", x, y, z, found.x, found.y, found.z);
}

/* --- settings, lights, background ------------------------------------------------------------------------- */

static void the_least_scene_has_the_documented_defaults(void **state)
{
    (void)state;
    struct scene scene;
    struct error error;
    assert_int_equal(load_text(&scene, "{" CAMERA "}", &error), STATUS_OK);
    assert_int_equal(scene.width, 640);
    assert_int_equal(scene.height, 360);
    assert_int_equal(scene.samples, 0);
    assert_int_equal(scene.filter, FILTER_BOX);
    assert_int_equal(scene.depth, 8);
    assert_vec3(scene.camera.up, 0, 1, 0);
    assert_true(scene.camera.fov_degrees == 40);
    assert_vec3(scene.ambient, 1, 1, 1);
    assert_int_equal(scene.background.kind, BACKGROUND_CONSTANT);
    assert_vec3(scene.background.color[0], 0, 0, 0);
    assert_int_equal(scene.light_count + scene.object_count + scene.image_count, 0);
    scene_finish(&scene);
}

static void settings_are_read(void **state)
{
    (void)state;
    struct scene scene = load_members("'$schema': 'weft.schema.json', 'depth': 0, 'ambient': 0.25,"
                                      "'image': {'width': 1, 'height': 65535, 'samples': 16, 'filter': 'tent'},"
                                      "'background': {'type': 'gradient', 'bottom': 2, 'top': '#ff0080'}");
    assert_int_equal(scene.width, 1);
    assert_int_equal(scene.height, 65535);
    assert_int_equal(scene.samples, 16);
    assert_int_equal(scene.filter, FILTER_TENT);
    assert_int_equal(scene.depth, 0);
    assert_vec3(scene.ambient, 0.25, 0.25, 0.25);
    assert_int_equal(scene.background.kind, BACKGROUND_GRADIENT);
    assert_vec3(scene.background.color[0], 2, 2, 2);
    assert_vec3(scene.background.color[1], 1, 0, colour_from_srgb8(0x80));
    scene_finish(&scene);
}

static void lights_are_read(void **state)
{
    (void)state;
    struct scene scene = load_members(
        "'lights': [{'type': 'point', 'position': [1, 2, 3], 'color': [1, 0.5, 0], 'intensity': 4},"
        "{'type': 'directional', 'direction': [0, -2, 0], 'color': '#00f'},"
        "{'type': 'spot', 'position': [0, 5, 0], 'at': [0, 5, 3], 'angle': 30, 'falloff': [0, 0, 1]},"
        "{'type': 'spot', 'position': [0, 5, 0], 'direction': [4, 0, 0], 'angle': 90, 'inner': 10}]");
    assert_int_equal(scene.light_count, 4);
    assert_int_equal(scene.lights[0].kind, LIGHT_POINT);
    assert_vec3(scene.lights[0].position, 1, 2, 3);
    assert_vec3(scene.lights[0].color, 4, 2, 0);
    assert_true(scene.lights[0].falloff[0] == 1 && scene.lights[0].falloff[2] == 0);
    assert_int_equal(scene.lights[1].kind, LIGHT_DIRECTIONAL);
    assert_vec3(scene.lights[1].direction, 0, -1, 0);
    assert_int_equal(scene.lights[2].kind, LIGHT_SPOT);
    assert_vec3(scene.lights[2].direction, 0, 0, 1);
    assert_true(scene.lights[2].outer_degrees == 30 && scene.lights[2].inner_degrees == 30);
    assert_true(scene.lights[2].falloff[0] == 0 && scene.lights[2].falloff[2] == 1);
    assert_vec3(scene.lights[3].direction, 1, 0, 0);
    assert_true(scene.lights[3].outer_degrees == 90 && scene.lights[3].inner_degrees == 10);
    scene_finish(&scene);
}

static void numbers_are_the_nearest_doubles(void **state)
{
    (void)state;
    struct scene scene = load_objects("{'type': 'sphere', 'center': [-0, 1E-5, 123456789.123456789e+1],"
                                      "'radius': 0.1}");
    assert_true(signbit(scene.objects[0].shape.sphere.center.x));
    assert_vec3(scene.objects[0].shape.sphere.center, 0, 1e-5, 1234567891.23456789);
    assert_true(scene.objects[0].shape.sphere.radius == 0.1);
    scene_finish(&scene);
}

/* --- shapes ----------------------------------------------------------------------------------------------- */

static void simple_shapes_are_read(void **state)
{
    (void)state;
    struct scene scene = load_objects(
        "{'type': 'sphere', 'radius': 2}, {'type': 'plane', 'point': [0, 1, 0], 'normal': [0, 0, 9]},"
        "{'type': 'disc', 'center': [1, 2, 3], 'normal': [0, -3, 0], 'radius': 4},"
        "{'type': 'box', 'min': [-1, -2, -3], 'max': [1, 2, 3]}");
    assert_int_equal(scene.objects[0].shape.kind, SHAPE_SPHERE);
    assert_vec3(scene.objects[0].shape.sphere.center, 0, 0, 0);
    assert_int_equal(scene.objects[1].shape.kind, SHAPE_PLANE);
    assert_vec3(scene.objects[1].shape.plane.normal, 0, 0, 1);
    assert_int_equal(scene.objects[2].shape.kind, SHAPE_DISC);
    assert_vec3(scene.objects[2].shape.disc.normal, 0, -1, 0);
    assert_int_equal(scene.objects[3].shape.kind, SHAPE_BOX);
    assert_vec3(scene.objects[3].shape.box.max, 1, 2, 3);
    assert_int_equal(scene.material_count, 1);
    assert_true(shape_is_closed(&scene.objects[0].shape) && shape_is_closed(&scene.objects[3].shape));
    assert_false(shape_is_closed(&scene.objects[1].shape) || shape_is_closed(&scene.objects[2].shape));
    scene_finish(&scene);
}

static void cylinders_and_cones_are_frustums(void **state)
{
    (void)state;
    struct scene scene = load_objects(
        "{'type': 'cylinder', 'base': [0, 0, 0], 'top': [0, 2, 0], 'radius': 0.5},"
        "{'type': 'cone', 'base': [0, 0, 0], 'apex': [0, 3, 0], 'radius': 1, 'open': true},"
        "{'type': 'frustum', 'base': [0, 0, 0], 'top': [0, 1, 0], 'base_radius': 0, 'top_radius': 2}");
    const struct shape *cylinder = &scene.objects[0].shape, *cone = &scene.objects[1].shape;
    assert_true(cylinder->frustum.base_radius == 0.5 && cylinder->frustum.top_radius == 0.5);
    assert_true(cone->frustum.base_radius == 1 && cone->frustum.top_radius == 0);
    assert_vec3(cone->frustum.top, 0, 3, 0);
    assert_true(scene.objects[2].shape.frustum.top_radius == 2);
    assert_true(shape_is_closed(cylinder) && !shape_is_closed(cone));
    scene_finish(&scene);
}

static void a_transform_is_applied_in_the_order_written(void **state)
{
    (void)state;
    struct scene scene = load_objects(
        "{'type': 'sphere', 'radius': 1, 'transform': [{'scale': [2, 3, 4]}, {'rotate': [90, 0, 0]},"
        "{'translate': [10, 20, 30]}]},"
        "{'type': 'sphere', 'radius': 1, 'transform': [{'translate': [1, 0, 0]}, {'scale': 2},"
        "{'rotate': {'axis': [0, 0, 7], 'angle': 90}}]},"
        "{'type': 'sphere', 'radius': 1, 'transform': [{'rotate': [90, 90, 90]}]},"
        "{'type': 'sphere', 'radius': 1, 'transform': [{'matrix': [1, 2, 0, 4, 0, 1, 3, 5, 0, 0, 1, 6]}]}");
    const struct vec3 p = {1, 1, 1};
    assert_vec3(affine_point(&scene.objects[0].transform, p), 12, 16, 33);
    assert_vec3(affine_point(&scene.objects[1].transform, p), -2, 4, 2);
    assert_vec3(affine_point(&scene.objects[2].transform, vec3_make(0, 0, 1)), 1, 0, 0);
    assert_vec3(affine_point(&scene.objects[3].transform, p), 7, 9, 7);
    scene_finish(&scene);
}

static const char cube_mesh[] =
    "{'type': 'mesh', 'points': [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1],"
    "[0, 1, 1]], 'faces': [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]%s]}";

static void meshes_know_whether_they_are_closed(void **state)
{
    (void)state;
    char *closed = memory_format(cube_mesh, ", [3, 0, 4, 7]"), *open = memory_format(cube_mesh, "");
    char *twisted = memory_format(cube_mesh, ", [3, 7, 4, 0]");
    char *objects = memory_format("%s, %s, %s, {'type': 'tetrahedron', 'points':"
                                  "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}", closed, open, twisted);
    struct scene scene = load_objects(objects);
    assert_int_equal(scene.objects[0].shape.mesh.triangle_count, 12);
    assert_true(shape_is_closed(&scene.objects[0].shape));
    assert_false(shape_is_closed(&scene.objects[1].shape));
    assert_false(shape_is_closed(&scene.objects[2].shape));
    assert_true(shape_is_closed(&scene.objects[3].shape));
    scene_finish(&scene);
    free(closed);
    free(open);
    free(twisted);
    free(objects);
}

/* --- materials -------------------------------------------------------------------------------------------- */

static void a_material_has_the_documented_defaults(void **state)
{
    (void)state;
    struct scene scene = load_objects("{'type': 'sphere', 'radius': 1, 'material': {}}");
    const struct material *m = &scene.materials[scene.objects[0].material];
    assert_int_equal(m->color.kind, TEXTURE_CONSTANT);
    assert_vec3(m->color.color[0], 0.8, 0.8, 0.8);
    assert_true(m->ambient == 0.1 && m->diffuse == 0.8 && m->shininess == 32);
    assert_vec3(m->specular, 0, 0, 0);
    assert_vec3(m->reflection, 0, 0, 0);
    assert_vec3(m->filter, 1, 1, 1);
    assert_true(m->transparency == 0 && m->ior == 0);
    scene_finish(&scene);
}

static void named_materials_are_shared(void **state)
{
    (void)state;
    struct scene scene = load_members(
        "'objects': [{'type': 'sphere', 'radius': 1, 'material': 'b'},"
        "{'type': 'disc', 'center': [0, 0, 0], 'normal': [0, 1, 0], 'radius': 1, 'material': 'a'},"
        "{'type': 'sphere', 'radius': 2, 'material': 'b'}],"
        "'materials': {'b': {'ior': 1.5, 'absorption': [0, 1, 40], 'filter': 0.5},"
        "'a': {'color': '#fff', 'reflection': 0.5, 'transparency': 0.5}}");
    assert_int_equal(scene.material_count, 2);
    assert_int_equal(scene.objects[0].material, scene.objects[2].material);
    const struct material *b = &scene.materials[scene.objects[0].material];
    const struct material *a = &scene.materials[scene.objects[1].material];
    assert_true(b->ior == 1.5);
    assert_vec3(b->absorption, 0, 1, 40);
    assert_vec3(b->filter, 0.5, 0.5, 0.5);
    assert_vec3(a->color.color[0], 1, 1, 1);
    assert_vec3(a->reflection, 0.5, 0.5, 0.5);
    scene_finish(&scene);
}

static void patterns_are_read(void **state)
{
    (void)state;
    struct scene scene = load_objects(
        "{'type': 'sphere', 'radius': 1, 'material': {'color': {'type': 'checker', 'colors': [0, 1],"
        "'size': 2, 'offset': [1, 2, 3]}}},"
        "{'type': 'sphere', 'radius': 1, 'material': {'color': {'type': 'stripes',"
        "'colors': [[1, 0, 0], '#0f0'], 'direction': [0, 5, 0], 'width': 0.25}}},"
        "{'type': 'sphere', 'radius': 1, 'material': {'color': {'type': 'gradient', 'colors': [0, 1],"
        "'direction': [0, 0, 2], 'start': 3, 'end': -1}}}");
    const struct texture *checker = &scene.materials[0].color, *stripes = &scene.materials[1].color;
    const struct texture *gradient = &scene.materials[2].color;
    assert_int_equal(checker->kind, TEXTURE_CHECKER);
    assert_true(checker->size == 2);
    assert_vec3(checker->offset, 1, 2, 3);
    assert_int_equal(stripes->kind, TEXTURE_STRIPES);
    assert_vec3(stripes->direction, 0, 1, 0);
    assert_vec3(stripes->color[0], 1, 0, 0);
    assert_vec3(stripes->color[1], 0, 1, 0);
    assert_true(stripes->size == 0.25);
    assert_int_equal(gradient->kind, TEXTURE_GRADIENT);
    assert_true(gradient->start == 3 && gradient->end == -1);
    scene_finish(&scene);
}

/* --- images on shapes ------------------------------------------------------------------------------------- */

static const struct texture *texture_of(const struct scene *scene, size_t object)
{
    return &scene->materials[scene->objects[object].material].color;
}

static void one_material_lies_on_each_shape_as_suits_it(void **state)
{
    (void)state;
    struct scene scene = load_members(
        "'materials': {'picture': {'color': {'type': 'image', 'file': 'grey.png'}}}, 'objects': ["
        "{'type': 'sphere', 'radius': 1, 'material': 'picture'},"
        "{'type': 'sphere', 'radius': 2, 'material': 'picture'},"
        "{'type': 'cone', 'base': [0, 0, 0], 'apex': [0, 1, 0], 'radius': 1, 'material': 'picture'},"
        "{'type': 'box', 'min': [0, 0, 0], 'max': [1, 1, 1], 'material': 'picture'},"
        "{'type': 'plane', 'point': [1, 0, 2], 'normal': [0, 1, 0], 'material': 'picture'},"
        "{'type': 'disc', 'center': [0, 0, 5], 'normal': [0, 0, 1], 'radius': 2, 'material': 'picture'},"
        "{'type': 'triangle', 'points': [[0, 0, 0], [3, 0, 0], [0, 1, 0]], 'material': 'picture'},"
        "{'type': 'triangle', 'points': [[0, 0, 0], [3, 0, 0], [0, 1, 0]], 'uv': [[0, 0], [1, 0], [0, 1]],"
        "'material': 'picture'}]");
    static const enum texture_map maps[] = {MAP_SPHERE, MAP_SPHERE, MAP_CYLINDER, MAP_BOX,
                                            MAP_PLANAR, MAP_PLANAR, MAP_PLANAR,   MAP_MESH};
    for (size_t i = 0; i < sizeof maps / sizeof *maps; i++)
        assert_int_equal(texture_of(&scene, i)->map, maps[i]);
    assert_int_equal(scene.objects[0].material, scene.objects[1].material);
    assert_int_equal(scene.image_count, 1);
    assert_vec3(texture_of(&scene, 4)->origin, 1, 0, 2); /* a floor: right is +x, up is −z */
    assert_vec3(texture_of(&scene, 4)->axis_u, 1, 0, 0);
    assert_vec3(texture_of(&scene, 4)->axis_v, 0, 0, -1);
    assert_vec3(texture_of(&scene, 5)->origin, -2, -2, 5); /* upright, across the disc */
    assert_vec3(texture_of(&scene, 5)->axis_u, 4, 0, 0);
    assert_vec3(texture_of(&scene, 5)->axis_v, 0, 4, 0);
    assert_vec3(texture_of(&scene, 6)->axis_u, 3, 0, 0); /* along the first edge */
    assert_vec3(texture_of(&scene, 6)->axis_v, 0, 3, 0);
    scene_finish(&scene);
}

static void what_a_texture_says_goes_before_what_suits_the_shape(void **state)
{
    (void)state;
    struct scene scene = load_objects(
        "{'type': 'sphere', 'radius': 1, 'material': {'color': {'type': 'image', 'file': 'grey.png',"
        "'origin': [1, 2, 3], 'u': [2, 0, 0], 'v': [0, 0, 5], 'repeat': [3, 0.5]}}},"
        "{'type': 'sphere', 'radius': 1, 'material': {'color': {'type': 'image', 'files':"
        "['grey.png', './grey.png', 'grey.png', 'grey.png', 'grey.png', 'grey.png']}}},"
        "{'type': 'box', 'min': [0, 0, 0], 'max': [1, 1, 1], 'material': {'color': {'type': 'image',"
        "'file': 'grey.png', 'map': 'sphere'}}}");
    const struct texture *planar = texture_of(&scene, 0);
    assert_int_equal(planar->map, MAP_PLANAR);
    assert_vec3(planar->origin, 1, 2, 3);
    assert_vec3(planar->axis_u, 2, 0, 0);
    assert_vec3(planar->axis_v, 0, 0, 5);
    assert_true(planar->repeat_u == 3 && planar->repeat_v == 0.5);
    assert_int_equal(texture_of(&scene, 1)->map, MAP_BOX);
    assert_int_equal(texture_of(&scene, 2)->map, MAP_SPHERE);
    assert_int_equal(scene.image_count, 1);
    assert_int_equal(scene.images[0].image.width, 2);
    assert_true(scene.images[0].image.rgb[0] == (float)colour_from_srgb8(0x80));
    scene_finish(&scene);
}

/* --- hostile text ----------------------------------------------------------------------------------------- */

/* A scene whose "objects" hold `count` times the same text. */
static char *repeat_object(const char *object, size_t count)
{
    struct bytes text = {0};
    const char *start = "{" CAMERA ", 'materials': {'m': {}}, 'objects': [";
    bytes_put(&text, start, strlen(start));
    for (size_t i = 0; i < count; i++) {
        bytes_put(&text, ",", i > 0);
        bytes_put(&text, object, strlen(object));
    }
    bytes_put(&text, "]}", 3);
    return (char *)text.data;
}

static void large_scenes_take_linear_time(void **state)
{
    (void)state;
    struct scene scene;
    struct error error;
    const size_t count = 200000;
    char *text = repeat_object("{'type': 'sphere', 'radius': 1, 'material': 'm'}", count);
    assert_int_equal(load_text(&scene, text, &error), STATUS_OK);
    assert_int_equal(scene.object_count, count);
    assert_int_equal(scene.material_count, 1);
    scene_finish(&scene);
    free(text);
}

static void an_object_with_many_keys_is_checked_in_time(void **state)
{
    (void)state;
    const size_t count = 200000;
    struct bytes text = {0};
    bytes_put(&text, "{", 1);
    for (size_t i = 0; i < count; i++) {
        char *member = memory_format("'k%zu':0,", i);
        bytes_put(&text, member, strlen(member));
        free(member);
    }
    bytes_put(&text, "'k7':0}", 8);
    struct scene scene;
    struct error error;
    assert_int_equal(load_text(&scene, (const char *)text.data, &error), STATUS_INPUT);
    assert_string_equal(error.text, "scene.json: expected every key once, found \"k7\" twice");
    bytes_finish(&text);
}

static void every_beginning_of_a_scene_is_refused_and_leaves_nothing(void **state)
{
    (void)state;
    static const char text[] =
        "{" CAMERA ", 'lights': [{'type': 'point', 'position': [1, 2e1, 3.5]}], 'objects':"
        "[{'type': 'triangle', 'points': [[0, 0, 0], [1, 0, 0], [0, 1, 0]], 'name': '\\u00e9\\ud83d\\ude00',"
        "'material': {'color': {'type': 'image', 'file': 'grey.png'}}}]}";
    struct scene scene;
    struct error error;
    for (size_t length = 0; length < sizeof text - 1; length++) {
        char *start = memory_format("%.*s", (int)length, text);
        assert_int_equal(load_text(&scene, start, &error), STATUS_INPUT);
        assert_memory_equal(error.text, "scene.json:1:", strlen("scene.json:1:"));
        assert_null(scene.objects);
        free(start);
    }
    assert_int_equal(load_text(&scene, text, &error), STATUS_OK);
    scene_finish(&scene);
}

static void sentences_stay_on_one_line_and_end(void **state)
{
    (void)state;
    struct scene scene;
    struct error error;
    struct bytes text = {0};
    const char *start = "{" CAMERA ", 'objects': [{'type': 'sphere', 'radius': 'line\\nbreak";
    bytes_put(&text, start, strlen(start));
    memset(bytes_extend(&text, 5000), 'x', 5000);
    bytes_put(&text, "'}]}", 5);
    assert_int_equal(load_text(&scene, (const char *)text.data, &error), STATUS_INPUT);
    assert_null(strchr(error.text, '\n'));
    assert_non_null(strstr(error.text, "objects[0].radius: expected a number above 0, found"));
    assert_non_null(strstr(error.text, "\"line\\u000abreakxxx"));
    assert_non_null(strstr(error.text, "…\""));
    bytes_finish(&text);
}

static void only_known_formats_are_read(void **state)
{
    (void)state;
    struct asset_set assets = {0};
    struct scene scene;
    struct error error;
    assert_int_equal(scene_load(&scene, "scene.xml", &assets, &error), STATUS_INPUT);
    assert_string_equal(error.text, "scene.xml: expected a scene file whose name ends in .json or .nff");
    assert_int_equal(scene_load(&scene, "scene.json", &assets, &error), STATUS_INPUT);
    asset_set_finish(&assets);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_least_scene_has_the_documented_defaults),
        cmocka_unit_test(settings_are_read),
        cmocka_unit_test(lights_are_read),
        cmocka_unit_test(numbers_are_the_nearest_doubles),
        cmocka_unit_test(simple_shapes_are_read),
        cmocka_unit_test(cylinders_and_cones_are_frustums),
        cmocka_unit_test(a_transform_is_applied_in_the_order_written),
        cmocka_unit_test(meshes_know_whether_they_are_closed),
        cmocka_unit_test(a_material_has_the_documented_defaults),
        cmocka_unit_test(named_materials_are_shared),
        cmocka_unit_test(patterns_are_read),
        cmocka_unit_test(one_material_lies_on_each_shape_as_suits_it),
        cmocka_unit_test(what_a_texture_says_goes_before_what_suits_the_shape),
        cmocka_unit_test(large_scenes_take_linear_time),
        cmocka_unit_test(an_object_with_many_keys_is_checked_in_time),
        cmocka_unit_test(every_beginning_of_a_scene_is_refused_and_leaves_nothing),
        cmocka_unit_test(sentences_stay_on_one_line_and_end),
        cmocka_unit_test(only_known_formats_are_read),
    };
    return cmocka_run_group_tests_name("JSON scenes", tests, NULL, NULL);
}
