/*
 * A scene somewhere else, or of another size: every length of the model that has to change with it.
 */
#ifndef WEFT_TESTS_MOVED_SCENE_H
#define WEFT_TESTS_MOVED_SCENE_H

#include <string.h>

#include "scene/model.h"

static inline void shape_move(struct shape *shape, struct vec3 by)
{
    switch (shape->kind) {
    case SHAPE_SPHERE:
        shape->sphere.center = vec3_add(shape->sphere.center, by);
        break;
    case SHAPE_PLANE:
        shape->plane.point = vec3_add(shape->plane.point, by);
        break;
    case SHAPE_DISC:
        shape->disc.center = vec3_add(shape->disc.center, by);
        break;
    case SHAPE_FRUSTUM:
        shape->frustum.base = vec3_add(shape->frustum.base, by);
        shape->frustum.top = vec3_add(shape->frustum.top, by);
        break;
    case SHAPE_BOX:
        shape->box.min = vec3_add(shape->box.min, by);
        shape->box.max = vec3_add(shape->box.max, by);
        break;
    default:
        for (size_t i = 0; i < shape->mesh.vertex_count; i++)
            shape->mesh.points[i] = vec3_add(shape->mesh.points[i], by);
        break;
    }
}

static inline bool object_has_transform(const struct object *object)
{
    struct affine identity = affine_identity();
    return memcmp(&object->transform, &identity, sizeof identity) != 0;
}

/* Camera, lights and objects; `by_transform`: every object gets one more step of its transform, otherwise only
 * those that have one. Objects without share no textured material with others. */
static inline void scene_move(struct scene *scene, struct vec3 by, bool by_transform)
{
    scene->camera.from = vec3_add(scene->camera.from, by);
    scene->camera.at = vec3_add(scene->camera.at, by);
    for (size_t i = 0; i < scene->light_count; i++)
        scene->lights[i].position = vec3_add(scene->lights[i].position, by);
    for (size_t i = 0; i < scene->object_count; i++) {
        struct object *object = &scene->objects[i];
        if (by_transform || object_has_transform(object)) {
            object->transform.offset = vec3_add(object->transform.offset, by);
            continue;
        }
        shape_move(&object->shape, by);
        struct texture *texture = &scene->materials[object->material].color;
        if (texture->kind == TEXTURE_CHECKER || texture->kind == TEXTURE_STRIPES)
            texture->offset = vec3_add(texture->offset, by);
    }
}

static inline void shape_scale(struct shape *shape, double by)
{
    switch (shape->kind) {
    case SHAPE_SPHERE:
        shape->sphere.center = vec3_scale(shape->sphere.center, by);
        shape->sphere.radius *= by;
        break;
    case SHAPE_PLANE:
        shape->plane.point = vec3_scale(shape->plane.point, by);
        break;
    case SHAPE_DISC:
        shape->disc.center = vec3_scale(shape->disc.center, by);
        shape->disc.radius *= by;
        break;
    case SHAPE_FRUSTUM:
        shape->frustum.base = vec3_scale(shape->frustum.base, by);
        shape->frustum.top = vec3_scale(shape->frustum.top, by);
        shape->frustum.base_radius *= by;
        shape->frustum.top_radius *= by;
        break;
    case SHAPE_BOX:
        shape->box.min = vec3_scale(shape->box.min, by);
        shape->box.max = vec3_scale(shape->box.max, by);
        break;
    default:
        for (size_t i = 0; i < shape->mesh.vertex_count; i++)
            shape->mesh.points[i] = vec3_scale(shape->mesh.points[i], by);
        break;
    }
}

static inline void material_scale(struct material *material, double by)
{
    material->absorption = vec3_scale(material->absorption, 1 / by);
    material->color.size *= by;
    material->color.start *= by;
    material->color.end *= by;
    material->color.offset = vec3_scale(material->color.offset, by);
    material->color.origin = vec3_scale(material->color.origin, by);
    material->color.axis_u = vec3_scale(material->color.axis_u, by);
    material->color.axis_v = vec3_scale(material->color.axis_v, by);
}

/* All lengths, so that the picture stays the same. */
static inline void scene_scale(struct scene *scene, double by)
{
    scene->camera.from = vec3_scale(scene->camera.from, by);
    scene->camera.at = vec3_scale(scene->camera.at, by);
    for (size_t i = 0; i < scene->light_count; i++) {
        scene->lights[i].position = vec3_scale(scene->lights[i].position, by);
        scene->lights[i].falloff[1] /= by;
        scene->lights[i].falloff[2] /= by * by;
    }
    for (size_t i = 0; i < scene->material_count; i++)
        material_scale(&scene->materials[i], by);
    for (size_t i = 0; i < scene->object_count; i++) {
        shape_scale(&scene->objects[i].shape, by);
        scene->objects[i].transform.offset = vec3_scale(scene->objects[i].transform.offset, by);
    }
}

#endif
