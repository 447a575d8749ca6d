#include "scene/model.h"

#include <stdlib.h>

#include "base/memory.h"
#include "scene/mesh.h"

const char *const pixel_filter_names[PIXEL_FILTERS] = {[FILTER_BOX] = "box", [FILTER_TENT] = "tent"};

void scene_finish(struct scene *scene)
{
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].shape.kind == SHAPE_MESH && !scene->objects[i].shape.mesh.shared)
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

size_t scene_add_material(struct scene *scene, const struct material *material)
{
    scene->materials = memory_grow(scene->materials, &scene->material_capacity, scene->material_count + 1,
                                   sizeof *scene->materials);
    scene->materials[scene->material_count] = *material;
    return scene->material_count++;
}

struct object *scene_add_object(struct scene *scene)
{
    scene->objects =
        memory_grow(scene->objects, &scene->object_capacity, scene->object_count + 1, sizeof *scene->objects);
    struct object *object = &scene->objects[scene->object_count++];
    *object = (struct object){.transform = affine_identity()};
    return object;
}

const char *camera_fault(const struct camera *camera)
{
    const double least_sine = 1e-9; /* below, which way is right would rest on rounding */
    struct vec3 view = vec3_sub(camera->at, camera->from);
    if (vec3_max_abs(view) < SCENE_SMALLEST)
        return "expected from and at apart, found both in one place";
    if (vec3_length(vec3_cross(vec3_normalize(camera->up), vec3_normalize(view))) < least_sine)
        return "expected an up that is not parallel to the view, found a parallel one";
    return NULL;
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
