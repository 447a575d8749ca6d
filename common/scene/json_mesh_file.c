#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/json_scene.h"
#include "scene/mesh_file.h"

bool json_is_mesh_file(const struct json_at *object)
{
    struct json_at type = json_get(object, "type");
    return cJSON_IsString(type.value) && strcmp(type.value->valuestring, "mesh") == 0 &&
           json_get(object, "file").value;
}

void json_mesh_files_finish(struct scene_reader *reader)
{
    for (size_t i = 0; i < reader->mesh_count; i++)
        free(reader->meshes[i].name);
    free(reader->meshes);
}

static const struct read_mesh *find_read(const struct scene_reader *reader, const char *name, bool materials)
{
    for (size_t i = 0; i < reader->mesh_count; i++)
        if (reader->meshes[i].materials == materials && strcmp(reader->meshes[i].name, name) == 0)
            return &reader->meshes[i];
    return NULL;
}

/* --- a file's first use ----------------------------------------------------------------------------------- */

/* Moves the part's mesh into an object of the scene. */
static void add_object(struct scene_reader *reader, const struct json_at *at, struct mesh_part *part,
                       const struct affine *transform)
{
    struct object *object = scene_add_object(reader->scene);
    object->shape.kind = SHAPE_MESH;
    object->shape.mesh = part->mesh;
    part->mesh = (struct mesh){0};
    object->transform = *transform;
    if (part->has_material)
        object->material = scene_add_material(reader->scene, &part->material);
    else
        json_object_material(reader, json_get(at, "material"), &object->shape, &object->material);
}

static void read_file(struct scene_reader *reader, const struct json_at *at, const char *name, bool materials,
                      const struct affine *transform)
{
    struct json_at file_at = json_get(at, "file");
    struct mesh_file mesh = {0};
    size_t first = reader->scene->object_count;
    enum status status = mesh_file_read(&mesh, reader->scene, reader->assets, name, materials, reader->json.error);
    if (status != STATUS_OK)
        json_forward(&file_at, status);
    for (size_t i = 0; i < mesh.count; i++)
        add_object(reader, at, &mesh.parts[i], transform);
    reader->meshes = memory_grow(reader->meshes, &reader->mesh_capacity, reader->mesh_count + 1,
                                 sizeof *reader->meshes);
    reader->meshes[reader->mesh_count++] = (struct read_mesh){memory_string(name), materials, first, mesh.count};
    mesh_file_finish(&mesh);
}

/* --- and later ones --------------------------------------------------------------------------------------- */

static void share_objects(struct scene_reader *reader, const struct json_at *at, const struct read_mesh *mesh,
                          const struct affine *transform)
{
    for (size_t i = 0; i < mesh->object_count; i++) {
        struct object *object = scene_add_object(reader->scene);
        *object = reader->scene->objects[mesh->first_object + i];
        object->shape.mesh.shared = true;
        object->transform = *transform;
        if (!mesh->materials)
            json_object_material(reader, json_get(at, "material"), &object->shape, &object->material);
    }
}

void json_mesh_file(struct scene_reader *reader, struct json_at at)
{
    static const char *const keys[] = {"type", "name", "material", "transform", "file", NULL};
    const char *label = NULL, *file = NULL; /* the label is for people; only checked */
    struct affine transform = affine_identity();
    struct json_at file_at = json_get(&at, "file");
    char name[ASSET_NAME_MAX + 1];
    json_keys(at, keys, NULL);
    json_text(json_get(&at, "name"), &label);
    json_text(file_at, &file);
    json_transform(json_get(&at, "transform"), &transform);
    if (reader->json.status != STATUS_OK)
        return;
    enum status status = asset_name_join(name, reader->name, file, reader->json.error);
    if (status != STATUS_OK) {
        json_forward(&file_at, status);
        return;
    }
    bool materials = !json_get(&at, "material").value;
    const struct read_mesh *mesh = find_read(reader, name, materials);
    if (mesh)
        share_objects(reader, &at, mesh, &transform);
    else
        read_file(reader, &at, name, materials, &transform);
}
