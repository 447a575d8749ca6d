#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/json_scene.h"
#include "scene/layout.h"

enum { MAPS = MAP_MESH + 1 };

/* A material as the file has it: its texture may still wait for a shape. */
struct read_material {
    struct material material;
    struct read_texture color;
};

struct named_material {
    const char *name; /* borrowed from the tree */
    struct read_material read;
    size_t placed[MAPS]; /* in scene->materials, by map, once an object wore it so; SIZE_MAX before */
};

static const struct read_material plain = {
    .material = {.ambient = 0.1, .diffuse = 0.8, .shininess = 32, .filter = {1, 1, 1}},
    .color = {.texture = {.kind = TEXTURE_CONSTANT, .color = {{0.8, 0.8, 0.8}}}},
};

/* --- reading ---------------------------------------------------------------------------------------------- */

/* What has no effect beside the keys that are there would be a mistake that nobody notices. */
static void check_combination(const struct json_at *at)
{
    static const char *const opaque[] = {"color", "ambient", "diffuse", "reflection", "transparency"};
    bool ior = json_get(at, "ior").value, transparency = json_get(at, "transparency").value;
    for (size_t i = 0; ior && i < sizeof opaque / sizeof *opaque; i++)
        if (json_get(at, opaque[i]).value)
            json_refuse(at,
                        "expected no \"%s\" beside \"ior\" (Fresnel's equations share out all light; filter "
                        "and absorption tint it), found both",
                        opaque[i]);
    if (!ior && json_get(at, "absorption").value)
        json_refuse(at, "expected \"ior\" beside \"absorption\", found none");
    if (!ior && !transparency && json_get(at, "filter").value)
        json_refuse(at, "expected \"transparency\" or \"ior\" beside \"filter\", found neither");
}

static void check_energy(const struct json_at *at, const struct material *m)
{
    double mirrored = vec3_max(m->reflection), through = mirrored + m->transparency;
    if (through > 1)
        json_refuse(at, "expected reflection + transparency of at most 1, found %.6g", through);
    if (mirrored > 0 || m->ior > 0)
        return; /* the highlight is the lamp's image in the mirror, whose share is counted already */
    double given_back = m->diffuse + 2 * vec3_max(m->specular) / (m->shininess + 2);
    const double slack = 1e-12; /* of the division; not a figure that anybody writes */
    if (given_back > 1 + slack)
        json_refuse(at, "expected diffuse + 2 specular / (shininess + 2) of at most 1, found %.6g", given_back);
}

static void read_absorption(struct json_at at, struct vec3 *absorption)
{
    if (cJSON_IsString(at.value))
        json_expected(&at, "one number or three");
    json_colour(at, &json_not_negative, absorption);
}

static void read_material(struct scene_reader *reader, struct json_at at, struct read_material *to)
{
    static const char *const keys[] = {"color",      "ambient",      "diffuse", "specular", "shininess",
                                       "reflection", "transparency", "filter",  "ior",      "absorption",
                                       NULL};
    struct material *m = &to->material;
    *to = plain;
    json_keys(at, keys, NULL);
    json_texture(reader, json_get(&at, "color"), &to->color);
    json_number(json_get(&at, "ambient"), &json_share, &m->ambient);
    json_number(json_get(&at, "diffuse"), &json_share, &m->diffuse);
    json_colour(json_get(&at, "specular"), &json_share, &m->specular);
    json_number(json_get(&at, "shininess"), &json_positive, &m->shininess);
    json_colour(json_get(&at, "reflection"), &json_share, &m->reflection);
    json_number(json_get(&at, "transparency"), &json_share, &m->transparency);
    json_colour(json_get(&at, "filter"), &json_share, &m->filter);
    json_number(json_get(&at, "ior"), &json_positive, &m->ior);
    read_absorption(json_get(&at, "absorption"), &m->absorption);
    if (at.reader->status == STATUS_OK)
        check_combination(&at);
    if (at.reader->status == STATUS_OK)
        check_energy(&at, m);
}

static int compare_names(const void *a, const void *b)
{
    return strcmp(((const struct named_material *)a)->name, ((const struct named_material *)b)->name);
}

void json_materials(struct scene_reader *reader, struct json_at at)
{
    if (at.value && !cJSON_IsObject(at.value)) {
        json_expected(&at, "an object of materials by name");
        return;
    }
    reader->named = memory_array(at.value ? (size_t)cJSON_GetArraySize(at.value) : 0, sizeof *reader->named);
    for (struct json_at item = json_first(&at); item.value; json_next(&item)) {
        struct named_material *named = &reader->named[reader->named_count++];
        named->name = item.value->string;
        for (int map = 0; map < MAPS; map++)
            named->placed[map] = SIZE_MAX;
        read_material(reader, item, &named->read);
    }
    qsort(reader->named, reader->named_count, sizeof *reader->named, compare_names);
}

void json_materials_finish(struct scene_reader *reader)
{
    free(reader->named);
    reader->named = NULL;
    reader->named_count = 0;
}

/* --- on a shape ------------------------------------------------------------------------------------------- */

/* The material with its image laid on the shape. True if that depends on nothing of the shape but its kind. */
static bool lay_on(const struct json_at *at, const struct read_material *read, const struct shape *shape,
                   struct material *material)
{
    *material = read->material;
    material->color = read->color.texture;
    if (material->color.kind != TEXTURE_IMAGE)
        return true;
    struct layout layout = shape_layout(shape);
    struct texture *texture = &material->color;
    if (!read->color.has_map)
        texture->map = layout.map;
    if (texture->map == MAP_MESH && !(shape->kind == SHAPE_MESH && shape->mesh.uv))
        json_refuse(at, "expected a triangle or mesh with uv for the map \"mesh\", found none");
    if (texture->map != MAP_PLANAR)
        return true;
    if (!read->color.has_origin)
        texture->origin = layout.origin;
    if (!read->color.has_axes) {
        texture->axis_u = layout.axis_u;
        texture->axis_v = layout.axis_v;
    }
    return read->color.has_origin && read->color.has_axes;
}

static void check_closed(const struct json_at *at, const struct material *material, const struct shape *shape)
{
    if (material->ior > 0 && !shape_is_closed(shape))
        json_refuse(at, "expected a closed shape (sphere, box, tetrahedron, closed cylinder, cone, frustum or "
                        "mesh) for a material with \"ior\", found an open one");
}

static struct named_material *find_named(struct scene_reader *reader, const char *name)
{
    const struct named_material key = {.name = name};
    return bsearch(&key, reader->named, reader->named_count, sizeof key, compare_names);
}

static void refuse_name(struct scene_reader *reader, const struct json_at *at)
{
    const char **names = memory_array(reader->named_count, sizeof *names);
    for (size_t i = 0; i < reader->named_count; i++)
        names[i] = reader->named[i].name;
    const char *suggestion = json_suggest(at->value->valuestring, names, reader->named_count);
    char quoted[JSON_QUOTE_BYTES], suggested[JSON_QUOTE_BYTES];
    free(names);
    if (suggestion)
        json_refuse(at, "expected the name of a material, found %s; did you mean %s?",
                    json_quote(quoted, at->value->valuestring), json_quote(suggested, suggestion));
    else
        json_expected(at, "the name of one of the scene's materials");
}

static void use_named(struct scene_reader *reader, const struct json_at *at, const struct shape *shape,
                      size_t *index)
{
    struct named_material *named = find_named(reader, at->value->valuestring);
    if (!named) {
        refuse_name(reader, at);
        return;
    }
    struct material material;
    bool shared = lay_on(at, &named->read, shape, &material);
    size_t *placed = &named->placed[material.color.map];
    check_closed(at, &material, shape);
    if (!shared) {
        *index = scene_add_material(reader->scene, &material);
        return;
    }
    if (*placed == SIZE_MAX)
        *placed = scene_add_material(reader->scene, &material);
    *index = *placed;
}

static void use_own(struct scene_reader *reader, const struct json_at *at, const struct shape *shape,
                    size_t *index)
{
    struct read_material read;
    struct material material;
    read_material(reader, *at, &read);
    if (at->reader->status != STATUS_OK)
        return;
    lay_on(at, &read, shape, &material);
    check_closed(at, &material, shape);
    *index = scene_add_material(reader->scene, &material);
}

void json_object_material(struct scene_reader *reader, struct json_at at, const struct shape *shape,
                          size_t *material)
{
    if (at.reader->status != STATUS_OK)
        return;
    if (!at.value) {
        struct material grey;
        lay_on(&at, &plain, shape, &grey);
        if (reader->default_material == SIZE_MAX)
            reader->default_material = scene_add_material(reader->scene, &grey);
        *material = reader->default_material;
    } else if (cJSON_IsString(at.value)) {
        use_named(reader, &at, shape, material);
    } else if (cJSON_IsObject(at.value)) {
        use_own(reader, &at, shape, material);
    } else {
        json_expected(&at, "a material or the name of one");
    }
}
