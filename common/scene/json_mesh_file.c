#include <string.h>

#include "scene/json_scene.h"
#include "scene/mesh_file.h"

bool json_is_mesh_file(const struct json_at *object)
{
    struct json_at type = json_get(object, "type");
    return cJSON_IsString(type.value) && strcmp(type.value->valuestring, "mesh") == 0 &&
           json_get(object, "file").value;
}

/* Moves the part's mesh into an object of the scene. */
static void add_object(struct scene_reader *reader, const struct json_at *at, struct mesh_part *part,
                       const struct affine *transform)
{
    struct json_at material = json_get(at, "material");
    struct object *object = scene_add_object(reader->scene);
    object->shape.kind = SHAPE_MESH;
    object->shape.mesh = part->mesh;
    part->mesh = (struct mesh){0};
    object->transform = *transform;
    if (part->has_material)
        object->material = scene_add_material(reader->scene, &part->material);
    else
        json_object_material(reader, material, &object->shape, &object->material);
}

void json_mesh_file(struct scene_reader *reader, struct json_at at)
{
    static const char *const keys[] = {"type", "name", "material", "transform", "file", NULL};
    const char *label = NULL, *file = NULL; /* the label is for people; only checked */
    struct affine transform = affine_identity();
    struct json_at file_at = json_get(&at, "file");
    struct mesh_file mesh = {0};
    json_keys(at, keys, NULL);
    json_text(json_get(&at, "name"), &label);
    json_text(file_at, &file);
    json_transform(json_get(&at, "transform"), &transform);
    if (reader->json.status != STATUS_OK)
        return;
    bool own = !json_get(&at, "material").value;
    enum status status =
        mesh_file_read(&mesh, reader->scene, reader->assets, reader->name, file, own, reader->json.error);
    if (status != STATUS_OK)
        json_forward(&file_at, status);
    for (size_t i = 0; i < mesh.count; i++)
        add_object(reader, &at, &mesh.parts[i], &transform);
    mesh_file_finish(&mesh);
}
