/*
 * Scenes from memory for the fuzz targets of the scene's readers.
 */
#ifndef WEFT_TESTS_FUZZ_SCENE_HELP_H
#define WEFT_TESTS_FUZZ_SCENE_HELP_H

#include <math.h>

#include "base/memory.h"
#include "scene/load.h"
#include "tests/fuzz/fuzz.h"

/* As many bytes are allocated as there are, with their NUL, so that reading on is noticed. */
static inline void add_bytes(struct asset_set *assets, const char *name, const void *data, size_t size)
{
    struct bytes bytes = {memory_array(size + 1, 1), size, size + 1};
    if (size > 0)
        memcpy(bytes.data, data, size);
    asset_set_add(assets, name, &bytes);
}

static inline void add_text(struct asset_set *assets, const char *name, const char *text)
{
    add_bytes(assets, name, text, strlen(text));
}

/* --- what a model promises (scene/model.h) ---------------------------------------------------------------- */

static inline void require_point(struct vec3 v)
{
    require(vec3_max_abs(v) <= SCENE_LARGEST);
}

static inline void require_share(double share)
{
    require(share >= 0 && share <= 1);
}

static inline void require_material(const struct scene *scene, const struct material *material)
{
    const struct texture *color = &material->color;
    require(material->diffuse >= 0 && material->diffuse <= 1);
    require_share(material->ambient);
    require_share(material->transparency + vec3_max(material->reflection));
    require(material->shininess > 0 && material->ior >= 0);
    for (int face = 0; color->kind == TEXTURE_IMAGE && face < BOX_FACES; face++)
        require(color->image[face] < scene->image_count);
}

static inline void require_mesh(const struct mesh *mesh)
{
    require(mesh->triangle_count > 0);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        require(mesh->index[i] < mesh->vertex_count);
    for (size_t i = 0; i < mesh->vertex_count; i++)
        require_point(mesh->points[i]);
    for (size_t i = 0; mesh->normals && i < mesh->vertex_count; i++)
        require(fabs(vec3_length(mesh->normals[i]) - 1) < 1e-9);
}

static inline void require_model(const struct scene *scene)
{
    require(scene->width >= 1 && scene->width <= IMAGE_SIDE_MAX);
    require(scene->height >= 1 && scene->height <= IMAGE_SIDE_MAX);
    require(scene->depth <= SCENE_DEPTH_MAX && scene->samples <= SCENE_SAMPLES_MAX);
    require(scene->filter < PIXEL_FILTERS && !camera_fault(&scene->camera));
    require(scene->background.kind != BACKGROUND_IMAGE || scene->background.image < scene->image_count);
    for (size_t i = 0; i < scene->material_count; i++)
        require_material(scene, &scene->materials[i]);
    for (size_t i = 0; i < scene->object_count; i++) {
        require(scene->objects[i].material < scene->material_count);
        require(scene->objects[i].shape.kind < SHAPE_KINDS);
        if (scene->objects[i].shape.kind == SHAPE_MESH)
            require_mesh(&scene->objects[i].shape.mesh);
    }
}

/* --- loading ---------------------------------------------------------------------------------------------- */

/* Loads the scene `name` of *assets, which is finished. False if it is refused. */
static inline bool load_scene(struct asset_set *assets, const char *name, struct scene *scene)
{
    struct error error = {{0}};
    enum status status = scene_load(scene, name, assets, &error);
    asset_set_finish(assets);
    if (status != STATUS_OK) {
        require_refusal(status, &error);
        return false;
    }
    require_model(scene);
    return true;
}

/* Loads and drops it. */
static inline void try_scene(struct asset_set *assets, const char *name)
{
    struct scene scene;
    if (load_scene(assets, name, &scene))
        scene_finish(&scene);
}

/* Adds files for a scene to name: a.png, a.ply, and a.obj with a.mtl. */
static inline void add_files(struct asset_set *assets)
{
    static const uint8_t png[] = { /* 2 × 2 pixels of 8 bits of grey */
        0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R', 0, 0, 0, 2, 0, 0, 0, 2,
        8, 0, 0, 0, 0, 0x57, 0xdd, 0x52, 0xf8, 0, 0, 0, 14, 'I', 'D', 'A', 'T',
        0x78, 0xda, 0x63, 0x60, 0xf8, 0xcf, 0xd0, 0xe0, 0x00, 0x00, 0x05, 0x42, 0x01, 0xc0, 0x6d, 0x5e, 0x78, 0xa0,
        0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
    add_bytes(assets, "a.png", png, sizeof png);
    add_text(assets, "a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                              "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    add_text(assets, "a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\n"
                              "f 1/1 3/3 2/2\nf 1 2 4\nf 2 3 4\nusemtl n\nf 3 1 4\n");
    add_text(assets, "a.mtl", "newmtl m\nmap_Kd a.png\nnewmtl n\nKd 0.5 0.2 0.1\nKs 1 1 1\nillum 3\n");
}

#endif
