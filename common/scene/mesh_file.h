/*
 * Mesh files: Wavefront .obj (with the .mtl files that it names) and .ply.
 */
#ifndef WEFT_SCENE_MESH_FILE_H
#define WEFT_SCENE_MESH_FILE_H

#include "base/error.h"
#include "scene/assets.h"
#include "scene/model.h"

/* All faces of a file that have one material. */
struct mesh_part {
    struct mesh mesh;  /* at least one triangle */
    bool has_material; /* the file says which */
    struct material material;
};

/* All zero is an empty one. */
struct mesh_file {
    struct mesh_part *parts;
    size_t count, capacity;
};

void mesh_file_finish(struct mesh_file *file);

/* Adds a part and returns it; valid until the next one. */
struct mesh_part *mesh_file_add(struct mesh_file *file);

/* Reads the asset `name` into *file, which is empty before and stays so on failure; at least one part. With `materials`
 * the files of its materials are read too, and images go to `scene`; without, the faces are one part without material.
 * STATUS_INPUT and a sentence with file and line, or byte. */
enum status mesh_file_read(struct mesh_file *file, struct scene *scene, struct asset_set *assets, const char *name,
                           bool materials, struct error *error);

/* The two formats; `name` is the asset's. What was read before a failure is left in *file. */
enum status obj_read(struct mesh_file *file, struct scene *scene, struct asset_set *assets, const char *name,
                     bool materials, struct error *error);
enum status ply_read(struct mesh_file *file, struct asset_set *assets, const char *name, struct error *error);

#endif
