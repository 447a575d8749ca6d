#include "scene/model.h"

#include <stdlib.h>

#include "scene/mesh.h"

void scene_finish(struct scene *scene)
{
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].shape.kind == SHAPE_MESH)
            mesh_finish(&scene->objects[i].shape.mesh);
    for (size_t i = 0; i < scene->image_count; i++) {
        free(scene->images[i].name);
        image_finish(&scene->images[i].image);
    }
    free(scene->lights);
    free(scene->materials);
    free(scene->objects);
    free(scene->images);
    *scene = (struct scene){0};
}

bool shape_is_closed(const struct shape *shape)
{
    switch (shape->kind) {
    case SHAPE_SPHERE:
    case SHAPE_BOX:
        return true;
    case SHAPE_FRUSTUM:
        return !shape->frustum.open;
    case SHAPE_MESH:
        return shape->mesh.closed;
    default:
        return false;
    }
}
