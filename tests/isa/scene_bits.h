/*
 * A scene model as a string of bits: the numbers that it holds, so that two loads can be compared exactly.
 */
#ifndef WEFT_TESTS_SCENE_BITS_H
#define WEFT_TESTS_SCENE_BITS_H

#include "base/bytes.h"
#include "base/hash.h"
#include "scene/model.h"

static inline void bits_put_vec3(struct bytes *bits, struct vec3 v)
{
    bytes_put_f64(bits, v.x);
    bytes_put_f64(bits, v.y);
    bytes_put_f64(bits, v.z);
}

static inline void bits_put_doubles(struct bytes *bits, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        bytes_put_f64(bits, values[i]);
}

static inline void bits_put_texture(struct bytes *bits, const struct texture *t)
{
    bytes_put_u8(bits, (uint8_t)t->kind);
    bits_put_vec3(bits, t->color[0]);
    bits_put_vec3(bits, t->color[1]);
    bits_put_vec3(bits, t->direction);
    bits_put_doubles(bits, (const double[]){t->size, t->start, t->end}, 3);
    bits_put_vec3(bits, t->offset);
    bytes_put_u8(bits, (uint8_t)t->map);
    for (size_t i = 0; i < BOX_FACES; i++)
        bytes_put_u32(bits, (uint32_t)t->image[i]);
    bits_put_doubles(bits, (const double[]){t->repeat_u, t->repeat_v}, 2);
    bits_put_vec3(bits, t->origin);
    bits_put_vec3(bits, t->axis_u);
    bits_put_vec3(bits, t->axis_v);
}

static inline void bits_put_material(struct bytes *bits, const struct material *m)
{
    bits_put_texture(bits, &m->color);
    bits_put_doubles(bits, (const double[]){m->ambient, m->diffuse, m->shininess, m->transparency, m->ior}, 5);
    bits_put_vec3(bits, m->specular);
    bits_put_vec3(bits, m->reflection);
    bits_put_vec3(bits, m->filter);
    bits_put_vec3(bits, m->absorption);
}

static inline void bits_put_mesh(struct bytes *bits, const struct mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++)
        bits_put_vec3(bits, mesh->points[i]);
    for (size_t i = 0; mesh->normals && i < mesh->vertex_count; i++)
        bits_put_vec3(bits, mesh->normals[i]);
    if (mesh->uv)
        bits_put_doubles(bits, mesh->uv, 2 * mesh->vertex_count);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        bytes_put_u32(bits, mesh->index[i]);
    bytes_put_u8(bits, mesh->closed);
}

static inline void bits_put_shape(struct bytes *bits, const struct shape *s)
{
    bytes_put_u8(bits, (uint8_t)s->kind);
    switch (s->kind) {
    case SHAPE_SPHERE:
        bits_put_vec3(bits, s->sphere.center);
        bytes_put_f64(bits, s->sphere.radius);
        break;
    case SHAPE_PLANE:
        bits_put_vec3(bits, s->plane.point);
        bits_put_vec3(bits, s->plane.normal);
        break;
    case SHAPE_DISC:
        bits_put_vec3(bits, s->disc.center);
        bits_put_vec3(bits, s->disc.normal);
        bytes_put_f64(bits, s->disc.radius);
        break;
    case SHAPE_FRUSTUM:
        bits_put_vec3(bits, s->frustum.base);
        bits_put_vec3(bits, s->frustum.top);
        bits_put_doubles(bits, (const double[]){s->frustum.base_radius, s->frustum.top_radius}, 2);
        bytes_put_u8(bits, s->frustum.open);
        break;
    case SHAPE_BOX:
        bits_put_vec3(bits, s->box.min);
        bits_put_vec3(bits, s->box.max);
        break;
    case SHAPE_MESH:
        bits_put_mesh(bits, &s->mesh);
        break;
    case SHAPE_KINDS:
        break;
    }
}

static inline void bits_put_object(struct bytes *bits, const struct object *object)
{
    bits_put_shape(bits, &object->shape);
    bytes_put_u32(bits, (uint32_t)object->material);
    bits_put_vec3(bits, object->transform.linear.x);
    bits_put_vec3(bits, object->transform.linear.y);
    bits_put_vec3(bits, object->transform.linear.z);
    bits_put_vec3(bits, object->transform.offset);
}

static inline void bits_put_light(struct bytes *bits, const struct light *light)
{
    bytes_put_u8(bits, (uint8_t)light->kind);
    bits_put_vec3(bits, light->color);
    bits_put_vec3(bits, light->position);
    bits_put_vec3(bits, light->direction);
    bits_put_doubles(bits, light->falloff, 3);
    bits_put_doubles(bits, (const double[]){light->outer_degrees, light->inner_degrees}, 2);
}

static inline void bits_put_view(struct bytes *bits, const struct scene *scene)
{
    const uint32_t numbers[] = {scene->width, scene->height, scene->samples, scene->filter, scene->depth};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        bytes_put_u32(bits, numbers[i]);
    bits_put_vec3(bits, scene->camera.from);
    bits_put_vec3(bits, scene->camera.at);
    bits_put_vec3(bits, scene->camera.up);
    bytes_put_f64(bits, scene->camera.fov_degrees);
    bytes_put_u8(bits, (uint8_t)scene->background.kind);
    bits_put_vec3(bits, scene->background.color[0]);
    bits_put_vec3(bits, scene->background.color[1]);
    bytes_put_u32(bits, (uint32_t)scene->background.image);
    bits_put_vec3(bits, scene->ambient);
}

/* Of its texels every 16th number, of all channels in turn: an emulator takes long over all of a large image. */
static inline void bits_put_image(struct bytes *bits, const struct image *image)
{
    bytes_put_u32(bits, image->width);
    bytes_put_u32(bits, image->height);
    for (size_t i = 0; i < (size_t)image->width * image->height * 3; i += 16)
        bytes_put_f64(bits, (double)image->rgb[i]);
}

/* The digest of what the scene holds. Of a shape, only what its kind uses. */
static inline struct digest scene_bits_digest(const struct scene *scene)
{
    struct bytes bits = {0};
    bits_put_view(&bits, scene);
    for (size_t i = 0; i < scene->light_count; i++)
        bits_put_light(&bits, &scene->lights[i]);
    for (size_t i = 0; i < scene->material_count; i++)
        bits_put_material(&bits, &scene->materials[i]);
    for (size_t i = 0; i < scene->object_count; i++)
        bits_put_object(&bits, &scene->objects[i]);
    for (size_t i = 0; i < scene->image_count; i++)
        bits_put_image(&bits, &scene->images[i].image);
    struct digest digest = digest_of(bits.data, bits.size);
    bytes_finish(&bits);
    return digest;
}

#endif
