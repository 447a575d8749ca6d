/*
 * Scenes for tests, built in C: shapes, materials, lights and a render of the whole.
 */
#ifndef WEFT_TESTS_SCENE_BUILDER_H
#define WEFT_TESTS_SCENE_BUILDER_H

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/mesh.h"
#include "scene/model.h"
#include "trace/kernel.h"
#include "trace/tracer.h"

/* --- shapes ----------------------------------------------------------------------------------------------- */

static inline struct shape shape_sphere(struct vec3 center, double radius)
{
    return (struct shape){.kind = SHAPE_SPHERE, .sphere = {center, radius}};
}

static inline struct shape shape_plane(struct vec3 point, struct vec3 normal)
{
    return (struct shape){.kind = SHAPE_PLANE, .plane = {point, normal}};
}

static inline struct shape shape_disc(struct vec3 center, struct vec3 normal, double radius)
{
    return (struct shape){.kind = SHAPE_DISC, .disc = {center, normal, radius}};
}

static inline struct shape shape_frustum(struct vec3 base, struct vec3 top, double base_radius,
                                         double top_radius)
{
    return (struct shape){.kind = SHAPE_FRUSTUM, .frustum = {base, top, base_radius, top_radius, false}};
}

static inline struct shape shape_tube(struct vec3 base, struct vec3 top, double base_radius, double top_radius)
{
    return (struct shape){.kind = SHAPE_FRUSTUM, .frustum = {base, top, base_radius, top_radius, true}};
}

static inline struct shape shape_box(struct vec3 min, struct vec3 max)
{
    return (struct shape){.kind = SHAPE_BOX, .box = {min, max}};
}

/* A copy of the points and corners; no normals, no uv. */
static inline struct shape shape_mesh(const struct vec3 *points, size_t vertices, const uint32_t *index,
                                      size_t triangles, bool closed)
{
    struct mesh mesh = {.vertex_count = vertices, .triangle_count = triangles, .closed = closed};
    mesh.points = memory_array(vertices, sizeof *mesh.points);
    mesh.index = memory_array(3 * triangles, sizeof *mesh.index);
    memcpy(mesh.points, points, vertices * sizeof *points);
    memcpy(mesh.index, index, 3 * triangles * sizeof *index);
    return (struct shape){.kind = SHAPE_MESH, .mesh = mesh};
}

/* A sphere of `rings` × `sectors` quadrangles, two triangles each; at the poles one of them has no area. With
 * normals, which are the exact sphere's. */
static inline struct shape shape_globe(struct vec3 center, double radius, uint32_t rings, uint32_t sectors)
{
    const double turn = 6.283185307179586;
    struct mesh mesh = {.vertex_count = (size_t)(rings + 1) * sectors, .closed = true};
    mesh.triangle_count = (size_t)2 * rings * sectors;
    mesh.points = memory_array(mesh.vertex_count, sizeof *mesh.points);
    mesh.normals = memory_array(mesh.vertex_count, sizeof *mesh.normals);
    mesh.index = memory_array(3 * mesh.triangle_count, sizeof *mesh.index);
    for (uint32_t ring = 0; ring <= rings; ring++)
        for (uint32_t s = 0; s < sectors; s++) {
            double polar = 0.5 * turn * ring / rings, along = turn * s / sectors;
            double across = ring == 0 || ring == rings ? 0 : sin(polar);
            struct vec3 n = {across * sin(along),
                             ring == 0       ? 1
                             : ring == rings ? -1
                                             : cos(polar),
                             across * cos(along)};
            mesh.normals[(size_t)ring * sectors + s] = vec3_normalize(n);
            mesh.points[(size_t)ring * sectors + s] = vec3_add_scaled(center, n, radius);
        }
    uint32_t *corner = mesh.index;
    for (uint32_t ring = 0; ring < rings; ring++)
        for (uint32_t s = 0; s < sectors; s++) {
            uint32_t right = (s + 1) % sectors, a = ring * sectors + s, b = a + sectors;
            uint32_t c = (ring + 1) * sectors + right, d = ring * sectors + right;
            const uint32_t quad[6] = {a, b, c, a, c, d};
            memcpy(corner, quad, sizeof quad);
            corner += 6;
        }
    return (struct shape){.kind = SHAPE_MESH, .mesh = mesh};
}

/* A box of twelve triangles. */
static inline struct shape shape_box_mesh(struct vec3 min, struct vec3 max)
{
    struct vec3 points[8];
    for (int i = 0; i < 8; i++)
        points[i] = vec3_make(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z);
    static const uint32_t index[36] = {1, 3, 7, 1, 7, 5, 0, 4, 6, 0, 6, 2, 2, 6, 7, 2, 7, 3,
                                       0, 1, 5, 0, 5, 4, 4, 5, 7, 4, 7, 6, 0, 2, 3, 0, 3, 1};
    return shape_mesh(points, 8, index, 12, true);
}

/* --- materials -------------------------------------------------------------------------------------------- */

static inline struct vec3 grey(double value)
{
    return vec3_make(value, value, value);
}

static inline struct texture texture_plain(struct vec3 color)
{
    return (struct texture){.kind = TEXTURE_CONSTANT, .color = {color, color}};
}

/* Diffuse only. */
static inline struct material material_matte(struct vec3 color)
{
    return (struct material){.color = texture_plain(color), .diffuse = 1, .shininess = 1, .filter = grey(1)};
}

/* Ambient only: what a camera sees is the scene's ambient light × color. */
static inline struct material material_glowing(struct vec3 color)
{
    return (struct material){.color = texture_plain(color), .ambient = 1, .shininess = 1, .filter = grey(1)};
}

static inline struct material material_mirror(struct vec3 reflection)
{
    struct material material = material_matte(grey(0));
    material.reflection = reflection;
    return material;
}

/* Lets everything through, tinted. */
static inline struct material material_filter(struct vec3 filter)
{
    struct material material = material_matte(grey(0));
    material.transparency = 1;
    material.filter = filter;
    return material;
}

static inline struct material material_glass(double ior, struct vec3 absorption)
{
    struct material material = material_matte(grey(0));
    material.ior = ior;
    material.absorption = absorption;
    return material;
}

/* --- scenes ----------------------------------------------------------------------------------------------- */

/* A camera at `from` that looks at the origin, black surroundings, ambient light 1. scene_finish frees it. */
static inline struct scene scene_at(struct vec3 from, double fov_degrees)
{
    struct vec3 up = {0, from.x == 0 && from.z == 0 ? 0 : 1, from.x == 0 && from.z == 0 ? -1 : 0};
    return (struct scene){.width = 32,
                          .height = 32,
                          .depth = SCENE_DEPTH_DEFAULT,
                          .ambient = grey(1),
                          .camera = {.from = from, .up = up, .fov_degrees = fov_degrees}};
}

/* The object, which moves if another one is added. */
static inline struct object *scene_add(struct scene *scene, struct shape shape, struct material material)
{
    scene->materials = memory_grow(scene->materials, &scene->material_capacity, scene->material_count + 1,
                                   sizeof *scene->materials);
    scene->objects =
        memory_grow(scene->objects, &scene->object_capacity, scene->object_count + 1, sizeof *scene->objects);
    scene->materials[scene->material_count] = material;
    scene->objects[scene->object_count] = (struct object){shape, scene->material_count++, affine_identity()};
    return &scene->objects[scene->object_count++];
}

/* Another object with the mesh of that one, as if they came from one file. It moves if another one is added. */
static inline struct object *scene_share(struct scene *scene, size_t object, struct material material)
{
    struct shape shape = scene->objects[object].shape;
    shape.mesh.shared = true;
    return scene_add(scene, shape, material);
}

static inline void scene_add_light(struct scene *scene, struct light light)
{
    scene->lights =
        memory_grow(scene->lights, &scene->light_capacity, scene->light_count + 1, sizeof *scene->lights);
    scene->lights[scene->light_count++] = light;
}

/* No falloff. */
static inline struct light light_point(struct vec3 position, struct vec3 color)
{
    return (struct light){.kind = LIGHT_POINT, .color = color, .position = position, .falloff = {1, 0, 0}};
}

static inline struct light light_directional(struct vec3 direction, struct vec3 color)
{
    return (struct light){.kind = LIGHT_DIRECTIONAL, .color = color, .direction = vec3_normalize(direction)};
}

static inline struct light light_spot(struct vec3 position, struct vec3 direction, double outer, double inner)
{
    return (struct light){.kind = LIGHT_SPOT,
                          .color = grey(1),
                          .position = position,
                          .falloff = {1, 0, 0},
                          .direction = vec3_normalize(direction),
                          .outer_degrees = outer,
                          .inner_degrees = inner};
}

/* Texels as 3 floats each, rows from the top; copied. The image's index. */
static inline size_t scene_add_image(struct scene *scene, uint32_t width, uint32_t height, const float *rgb)
{
    scene->images =
        memory_grow(scene->images, &scene->image_capacity, scene->image_count + 1, sizeof *scene->images);
    float *copy = memory_array((size_t)width * height, 3 * sizeof *copy);
    memcpy(copy, rgb, (size_t)width * height * 3 * sizeof *copy);
    scene->images[scene->image_count] = (struct scene_image){memory_string("test"), {width, height, copy}};
    return scene->image_count++;
}

/* --- rendering -------------------------------------------------------------------------------------------- */

static inline struct trace_settings settings_of(const struct scene *scene)
{
    return (struct trace_settings){scene->width, scene->height, scene->filter};
}

static inline uint32_t samples_of(const struct scene *scene)
{
    return scene->samples ? scene->samples : 1;
}

/* The light of an area's pixels, by so many samples each; otherwise as tracer_area. */
static inline void area_render(struct tracer *tracer, uint32_t samples, const struct pixel_area *area,
                               struct vec3 *lights, struct ray_counts *counts)
{
    size_t count = (size_t)(area->x1 - area->x0) * (area->y1 - area->y0);
    struct pixel *pixels = memory_array(count, sizeof *pixels);
    tracer_area(tracer, &(struct sampling){samples, samples, 0}, area, pixels, counts);
    for (size_t i = 0; i < count; i++)
        lights[i] = pixels[i].light;
    free(pixels);
}

/* All pixels, rows from the top, which the caller frees. counts may be NULL. */
static inline struct vec3 *plan_render(const struct plan *plan, const struct kernel *kernel, uint32_t samples,
                                       struct ray_counts *counts)
{
    const uint32_t width = plan->settings.width, height = plan->settings.height;
    struct tracer *tracer = tracer_create(plan, kernel);
    struct vec3 *pixels = memory_array((size_t)width * height, sizeof *pixels);
    struct ray_counts *rows = memory_array(height, sizeof *rows);
    for (uint32_t y0 = 0, y1; y0 < height; y0 = y1) {
        y1 = y0 + 7 < height ? y0 + 7 : height;
        area_render(tracer, samples, &(struct pixel_area){0, width, y0, y1}, pixels + (size_t)y0 * width, &rows[y0]);
    }
    for (uint32_t y = 0; counts && y < height; y++) {
        counts->camera += rows[y].camera;
        counts->secondary += rows[y].secondary;
        counts->shadow += rows[y].shadow;
    }
    free(rows);
    tracer_destroy(&tracer);
    return pixels;
}

static inline struct vec3 *scene_render(const struct scene *scene, const struct kernel *kernel,
                                        struct ray_counts *counts)
{
    struct trace_settings settings = settings_of(scene);
    struct plan *plan = plan_create(scene, &settings, 1);
    struct vec3 *pixels = plan_render(plan, kernel, samples_of(scene), counts);
    plan_destroy(&plan);
    return pixels;
}

/* What the middle of the image shows: one pixel, one sample. */
static inline struct vec3 scene_look(struct scene *scene)
{
    scene->width = scene->height = scene->samples = 1;
    struct vec3 *pixels = scene_render(scene, kernel_default(), NULL), seen = pixels[0];
    free(pixels);
    return seen;
}

#endif
