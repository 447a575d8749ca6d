#include "scene/mesh_file.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/mesh.h"

void mesh_file_finish(struct mesh_file *file)
{
    for (size_t i = 0; i < file->count; i++)
        mesh_finish(&file->parts[i].mesh);
    free(file->parts);
    *file = (struct mesh_file){0};
}

struct mesh_part *mesh_file_add(struct mesh_file *file)
{
    file->parts = memory_grow(file->parts, &file->capacity, file->count + 1, sizeof *file->parts);
    struct mesh_part *part = &file->parts[file->count++];
    *part = (struct mesh_part){0};
    return part;
}

enum status mesh_file_read(struct mesh_file *file, struct scene *scene, struct asset_set *assets, const char *name,
                           bool materials, struct error *error)
{
    enum status status;
    const char *dot = strrchr(name, '.');
    if (dot && strcmp(dot, ".obj") == 0)
        status = obj_read(file, scene, assets, name, materials, error);
    else if (dot && strcmp(dot, ".ply") == 0)
        status = ply_read(file, assets, name, error);
    else
        status = error_set(error, STATUS_INPUT,
                           "expected a mesh file whose name ends in .obj or .ply, found \"%s\"", name);
    if (status != STATUS_OK)
        mesh_file_finish(file);
    return status;
}
