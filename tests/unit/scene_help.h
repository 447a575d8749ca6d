/*
 * Scenes from memory for tests of the readers.
 */
#ifndef WEFT_TESTS_SCENE_HELP_H
#define WEFT_TESTS_SCENE_HELP_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "scene/load.h"

static inline void add_bytes(struct asset_set *assets, const char *name, const void *data, size_t size)
{
    struct bytes bytes = {0};
    bytes_put(&bytes, data, size);
    bytes_put_u8(&bytes, 0);
    bytes.size--;
    asset_set_add(assets, name, &bytes);
}

static inline void add_text(struct asset_set *assets, const char *name, const char *text)
{
    add_bytes(assets, name, text, strlen(text));
}

/* Loads the scene `name` of *assets, which is finished. */
static inline struct scene load_assets(struct asset_set *assets, const char *name)
{
    struct scene scene;
    struct error error = {{0}};
    if (scene_load(&scene, name, assets, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    asset_set_finish(assets);
    return scene;
}

/* A JSON scene with one object, whose members (with ' for quotation marks) these are. */
static inline void add_object_scene(struct asset_set *assets, const char *members)
{
    char *text = memory_format("{'camera': {'from': [0, 1, 5], 'at': [0, 0, 0]}, 'objects': [{%s}]}", members);
    for (char *quote = text; (quote = strchr(quote, '\'')); quote++)
        *quote = '"';
    add_text(assets, "scene.json", text);
    free(text);
}

/* The scene with the mesh file `name` of that content; `more` are further members of its object, each with a
 * comma. */
static inline struct scene load_mesh_bytes(const char *name, const void *data, size_t size, const char *more)
{
    struct asset_set assets = {0};
    char *members = memory_format("'type': 'mesh', 'file': '%s'%s", name, more);
    add_bytes(&assets, name, data, size);
    add_object_scene(&assets, members);
    free(members);
    return load_assets(&assets, "scene.json");
}

static inline struct scene load_mesh(const char *name, const char *text, const char *more)
{
    return load_mesh_bytes(name, text, strlen(text), more);
}

static inline void assert_vec3(struct vec3 found, double x, double y, double z)
{
    if (found.x != x || found.y != y || found.z != z)
        fail_msg("expected %a %a %a, found %a %a %a", x, y, z, found.x, found.y, found.z);
}

/* For numbers that a division or two has rounded. */
static inline void assert_near(double found, double expected)
{
    if (!(fabs(found - expected) <= 4e-16 * fmax(1, fabs(expected))))
        fail_msg("expected %.17g, found %.17g", expected, found);
}

static inline const struct mesh *mesh_of(const struct scene *scene, size_t object)
{
    assert_true(object < scene->object_count);
    assert_int_equal(scene->objects[object].shape.kind, SHAPE_MESH);
    return &scene->objects[object].shape.mesh;
}

static inline const struct material *material_of(const struct scene *scene, size_t object)
{
    assert_true(object < scene->object_count);
    return &scene->materials[scene->objects[object].material];
}

/* Corner `k` of triangle `i`. */
static inline struct vec3 corner_of(const struct mesh *mesh, size_t i, size_t k)
{
    return mesh->points[mesh->index[3 * i + k]];
}

static inline double mesh_area(const struct mesh *mesh)
{
    double area = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        struct vec3 a = corner_of(mesh, i, 0);
        struct vec3 cross = vec3_cross(vec3_sub(corner_of(mesh, i, 1), a), vec3_sub(corner_of(mesh, i, 2), a));
        area += vec3_length(cross) / 2;
    }
    return area;
}

#endif
