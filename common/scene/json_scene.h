/*
 * Reading a JSON scene; the format is described in scenes/README.md. Each file reads one part of it.
 */
#ifndef WEFT_SCENE_JSON_SCENE_H
#define WEFT_SCENE_JSON_SCENE_H

#include "scene/assets.h"
#include "scene/json_value.h"
#include "scene/model.h"

struct named_material;

/* A mesh file that the scene has read, with or without its materials: the objects that it became, which others may
 * share the meshes of. */
struct read_mesh {
    char *name; /* the asset's name; owned */
    bool materials;
    size_t first_object, object_count;
};

struct scene_reader {
    struct json_reader json;
    struct scene *scene;
    struct asset_set *assets;
    const char *name; /* the scene's own, among the assets */

    struct named_material *named; /* sorted by name */
    size_t named_count;
    size_t default_material; /* in scene->materials, once an object needed it; SIZE_MAX before */

    struct read_mesh *meshes;
    size_t mesh_count, mesh_capacity;
};

/* A texture, and what the file left to the shape that wears it. */
struct read_texture {
    struct texture texture;
    bool has_map, has_origin, has_axes;
};

/* Reads the JSON text of the asset `name` into *scene, which is empty before and is left half filled on
 * failure. STATUS_INPUT with "FILE: PATH: …" or "FILE:LINE:COLUMN: …". */
enum status json_scene_read(struct scene *scene, const char *name, struct asset_set *assets,
                            struct error *error);

/* An image file by its name in the scene; *image becomes its place in scene->images. */
void json_image(struct scene_reader *reader, struct json_at at, size_t *image);

/* A colour, or an object with a "type" that says which texture. */
void json_texture(struct scene_reader *reader, struct json_at at, struct read_texture *to);

/* The scene's "materials", for objects to name. */
void json_materials(struct scene_reader *reader, struct json_at at);
void json_materials_finish(struct scene_reader *reader);

/* An object's "material" (a name, a material, or missing) as the shape wears it; *material becomes its
 * place in scene->materials. */
void json_object_material(struct scene_reader *reader, struct json_at at, const struct shape *shape,
                          size_t *material);

/* The shape that `object` describes; unknown keys of the object are failures. What a mesh allocates belongs
 * to *shape even after a failure. */
void json_shape(struct json_at object, struct shape *shape);

/* The shapes that are meshes: `shape` becomes one. */
void json_triangle(const struct json_at *object, struct shape *shape);
void json_tetrahedron(const struct json_at *object, struct shape *shape);
void json_polygon(const struct json_at *object, struct shape *shape);
void json_mesh(const struct json_at *object, struct shape *shape);

/* True for an object that is a mesh with a "file". */
bool json_is_mesh_file(const struct json_at *object);

/* Reads such an object: an object of the scene for each material of the file, or one if it names a material itself. A
 * file that an earlier object has read is not read again: the objects share its meshes. */
void json_mesh_file(struct scene_reader *reader, struct json_at at);
void json_mesh_files_finish(struct scene_reader *reader);

void json_transform(struct json_at at, struct affine *transform);
void json_light(struct json_at at, struct light *light);

#endif
