/*
 * Wavefront .obj: vertices, texture coordinates, normals and faces.
 *
 * Read: v (x y z; a weight or colours after them are passed over), vt (u v), vn, f, usemtl, mtllib. Passed
 * over, because they change no triangle: groups and names (g, o), smoothing (s: a face is smooth if it names
 * normals), points and lines (p, l), and what steers other renderers. Free-form curves and surfaces are
 * refused.
 */
#include <search.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/json_value.h"
#include "scene/mesh_builder.h"
#include "scene/mesh_file.h"
#include "scene/mtl.h"
#include "scene/polygon.h"
#include "scene/token.h"

/* The faces of one material. */
struct group {
    char *name;  /* of the material; "": none. Owned */
    size_t line; /* of its first usemtl */
    struct mesh_builder builder;
};

/* A file that mtllib names. */
struct library {
    char *reference; /* the rest of the line; owned */
    size_t line;
};

struct obj_reader {
    struct token_reader text;
    bool materials;
    struct vec3 *points, *normals;
    double (*uv)[2];
    size_t point_count, point_capacity, normal_count, normal_capacity, uv_count, uv_capacity;
    struct group **groups, *current; /* owned */
    size_t group_count, group_capacity;
    void *groups_by_name; /* a search tree of pointers into groups */
    struct library *libraries;
    size_t library_count, library_capacity;
    struct mesh_vertex *face; /* the corners of the face in work */
    uint32_t *corners;
    size_t face_capacity, corner_capacity;
};

/* --- vertices --------------------------------------------------------------------------------------------- */

static void read_point(struct obj_reader *obj)
{
    double rest, xyz[3] = {0};
    token_numbers(&obj->text, "a coordinate", 3, xyz);
    for (int i = 0; i < 4 && !token_at_end(&obj->text); i++)
        token_number(&obj->text, "a weight or a colour", &rest);
    obj->points = memory_grow(obj->points, &obj->point_capacity, obj->point_count + 1, sizeof *obj->points);
    obj->points[obj->point_count++] = vec3_make(xyz[0], xyz[1], xyz[2]);
}

static void read_normal(struct obj_reader *obj)
{
    double xyz[3] = {0};
    token_numbers(&obj->text, "a normal's coordinate", 3, xyz);
    obj->normals =
        memory_grow(obj->normals, &obj->normal_capacity, obj->normal_count + 1, sizeof *obj->normals);
    obj->normals[obj->normal_count++] = mesh_normal(vec3_make(xyz[0], xyz[1], xyz[2]));
}

static void read_uv(struct obj_reader *obj)
{
    double rest, uv[2] = {0};
    token_number(&obj->text, "a texture coordinate", &uv[0]);
    if (!token_at_end(&obj->text))
        token_number(&obj->text, "a texture coordinate", &uv[1]);
    if (!token_at_end(&obj->text))
        token_number(&obj->text, "a texture coordinate", &rest);
    obj->uv = memory_grow(obj->uv, &obj->uv_capacity, obj->uv_count + 1, sizeof *obj->uv);
    memcpy(obj->uv[obj->uv_count++], uv, sizeof uv);
}

/* --- groups ----------------------------------------------------------------------------------------------- */

static int compare_groups(const void *a, const void *b)
{
    return strcmp(((const struct group *)a)->name, ((const struct group *)b)->name);
}

/* The faces that follow belong to the material `name`. */
static void use_group(struct obj_reader *obj, const char *name)
{
    struct group *group = memory_array(1, sizeof *group);
    *group = (struct group){.name = memory_string(name), .line = obj->text.line};
    struct group **found = tsearch(group, &obj->groups_by_name, compare_groups);
    if (!found) {
        obj->text.status = error_set(obj->text.error, STATUS_INTERNAL, "%s: out of memory", obj->text.file);
    } else if (*found != group) {
        free(group->name);
        free(group);
        obj->current = *found;
        return;
    }
    obj->groups = memory_grow(obj->groups, &obj->group_capacity, obj->group_count + 1, sizeof *obj->groups);
    obj->groups[obj->group_count++] = group;
    obj->current = group;
}

static void read_usemtl(struct obj_reader *obj)
{
    char name[TOKEN_WORD_BYTES];
    token_rest(&obj->text, "the name of a material", name);
    if (obj->materials)
        use_group(obj, name);
}

static void read_mtllib(struct obj_reader *obj)
{
    char reference[TOKEN_WORD_BYTES];
    token_rest(&obj->text, "the name of a .mtl file", reference);
    for (char *at = reference; (at = strchr(at, '\\')); at++)
        *at = '/'; /* written on Windows */
    if (!obj->materials || obj->text.status != STATUS_OK)
        return;
    obj->libraries =
        memory_grow(obj->libraries, &obj->library_capacity, obj->library_count + 1, sizeof *obj->libraries);
    obj->libraries[obj->library_count++] =
        (struct library){.reference = memory_string(reference), .line = obj->text.line};
}

/* --- faces ------------------------------------------------------------------------------------------------ */

/* A reference of a corner to one of `count` things: from 1, or from −1 for the last one. *index counts from 0.
 */
static const char *read_reference(struct obj_reader *obj, const char *at, const char *what, size_t count,
                                  size_t *index)
{
    bool backwards = *at == '-';
    const char *first = at + backwards;
    size_t number = 0;
    for (at = first; *at >= '0' && *at <= '9' && number <= UINT32_MAX; at++)
        number = 10 * number + (size_t)(*at - '0');
    if (at == first)
        token_expected(&obj->text, "a corner such as 1, 1/2, 1//3 or 1/2/3");
    else if (number == 0 || number > count)
        token_refuse(&obj->text, "expected one of the %zu %s so far, found number %s%zu%s", count, what,
                     backwards ? "-" : "", number, number > UINT32_MAX ? "…" : "");
    else
        *index = backwards ? count - number : number - 1;
    return at;
}

/* v, v/vt, v//vn or v/vt/vn */
static void read_corner(struct obj_reader *obj, struct mesh_vertex *corner)
{
    size_t point = 0, uv = 0, normal = 0;
    *corner = (struct mesh_vertex){0};
    const char *at = read_reference(obj, obj->text.at, "points (v)", obj->point_count, &point);
    if (obj->text.status == STATUS_OK && at[0] == '/' && at[1] != '/') {
        at = read_reference(obj, at + 1, "texture coordinates (vt)", obj->uv_count, &uv);
        corner->has_uv = true;
    } else if (at[0] == '/') {
        at++; /* no texture coordinates between the two strokes */
    }
    bool has_normal = obj->text.status == STATUS_OK && at[0] == '/';
    if (has_normal)
        at = read_reference(obj, at + 1, "normals (vn)", obj->normal_count, &normal);
    if (obj->text.status != STATUS_OK)
        return;
    corner->point = obj->points[point];
    if (corner->has_uv)
        memcpy(corner->uv, obj->uv[uv], sizeof corner->uv);
    if (has_normal)
        corner->normal = obj->normals[normal];
    token_pass(&obj->text, at, "a corner such as 1, 1/2, 1//3 or 1/2/3");
}

static void add_face(struct obj_reader *obj, size_t count)
{
    obj->corners = memory_grow(obj->corners, &obj->corner_capacity, count, sizeof *obj->corners);
    for (size_t i = 0; i < count; i++)
        obj->corners[i] = mesh_builder_vertex(&obj->current->builder, &obj->face[i]);
    if (!mesh_builder_face(&obj->current->builder, obj->corners, count))
        token_refuse(&obj->text, "expected a convex face or at most %d corners, found %zu", POLYGON_CORNERS_MAX,
                     count);
}

static void read_face(struct obj_reader *obj)
{
    size_t count = 0;
    while (!token_at_end(&obj->text) && obj->text.status == STATUS_OK) {
        obj->face = memory_grow(obj->face, &obj->face_capacity, count + 1, sizeof *obj->face);
        read_corner(obj, &obj->face[count++]);
    }
    if (count < 3)
        token_expected(&obj->text, "a face of at least 3 corners");
    if (obj->text.status != STATUS_OK)
        return;
    if (!obj->current)
        use_group(obj, "");
    add_face(obj, count);
}

/* --- statements ------------------------------------------------------------------------------------------- */

static void skip_statement(struct obj_reader *obj)
{
    token_skip_line(&obj->text);
}

static const struct statement {
    const char *keyword;
    void (*read)(struct obj_reader *obj);
} statements[] = {
    {"v", read_point},
    {"f", read_face},
    {"vn", read_normal},
    {"vt", read_uv},
    {"usemtl", read_usemtl},
    {"mtllib", read_mtllib},
    {"fo", read_face}, /* what old programs wrote for f */
    {"g", skip_statement},
    {"o", skip_statement},
    {"s", skip_statement},
    {"l", skip_statement},
    {"p", skip_statement},
    {"mg", skip_statement},
    {"vp", skip_statement},
    {"lod", skip_statement},
    {"bevel", skip_statement},
    {"c_interp", skip_statement},
    {"d_interp", skip_statement},
    {"usemap", skip_statement},
    {"maplib", skip_statement},
    {"shadow_obj", skip_statement},
    {"trace_obj", skip_statement},
};

static const struct statement *find_statement(const char *keyword)
{
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++)
        if (strcmp(keyword, statements[i].keyword) == 0)
            return &statements[i];
    return NULL;
}

static void read_statements(struct obj_reader *obj)
{
    char keyword[TOKEN_WORD_BYTES];
    while (token_more(&obj->text)) {
        struct token_reader start = obj->text;
        token_word(&obj->text, "a statement such as v or f", keyword);
        const struct statement *statement = find_statement(keyword);
        if (statement) {
            statement->read(obj);
            token_end_line(&obj->text);
        } else if (obj->text.status == STATUS_OK) {
            obj->text = start;
            token_expected(&obj->text, "a statement such as v, vt, vn, f, g, usemtl or mtllib");
        }
    }
}

/* --- materials -------------------------------------------------------------------------------------------- */

static bool library_is_read(const struct mtl *mtl, const char *name)
{
    for (size_t i = 0; i < mtl->library_count; i++)
        if (strcmp(mtl->libraries[i], name) == 0)
            return true;
    return false;
}

/* One file that a mtllib line names. Each is read once: a short line, said often, would else cost much. */
static enum status read_library_file(struct mtl *mtl, struct asset_set *assets, const char *from,
                                     const char *reference, struct error *error)
{
    char name[ASSET_NAME_MAX + 1];
    enum status status = asset_name_join(name, from, reference, error);
    if (status != STATUS_OK || library_is_read(mtl, name))
        return status;
    return mtl_read(mtl, assets, name, error);
}

static bool library_exists(struct asset_set *assets, const char *from, const char *reference)
{
    char name[ASSET_NAME_MAX + 1];
    struct error ignored;
    return asset_name_join(name, from, reference, &ignored) == STATUS_OK &&
           asset_set_get(assets, name, &ignored);
}

/* The line may name several files, or one whose name has blanks. */
static enum status read_library(struct mtl *mtl, struct asset_set *assets, const char *from,
                                const struct library *library, struct error *error)
{
    const char *blanks = " \t";
    char *rest = library->reference, *file;
    if (!strpbrk(rest, blanks) || library_exists(assets, from, rest))
        return read_library_file(mtl, assets, from, rest, error);
    enum status status = STATUS_OK;
    for (char *state = NULL; status == STATUS_OK && (file = strtok_r(rest, blanks, &state)); rest = NULL)
        status = read_library_file(mtl, assets, from, file, error);
    return status;
}

static enum status read_libraries(struct obj_reader *obj, struct mtl *mtl, struct asset_set *assets,
                                  const char *name, struct error *error)
{
    enum status status = STATUS_OK;
    for (size_t i = 0; status == STATUS_OK && i < obj->library_count; i++) {
        status = read_library(mtl, assets, name, &obj->libraries[i], error);
        if (status != STATUS_OK)
            error_prefix(error, status, "%s:%zu: ", obj->text.file, obj->libraries[i].line);
    }
    mtl_sort(mtl);
    return status;
}

static enum status refuse_material(const struct obj_reader *obj, const struct group *group, struct error *error)
{
    char quoted[JSON_QUOTE_BYTES];
    return error_set(error, STATUS_INPUT, "%s:%zu: expected the name of a material of the %s, found %s",
                     obj->text.file, group->line,
                     obj->library_count ? "mtllib files" : "mtllib files, of which there are none",
                     json_quote(quoted, group->name));
}

/* Moves the group's faces to a part of the file. */
static enum status add_part(const struct obj_reader *obj, struct group *group, const struct mtl *mtl,
                            struct mesh_file *file, struct scene *scene, struct asset_set *assets,
                            struct error *error)
{
    if (group->builder.mesh.triangle_count == 0)
        return STATUS_OK;
    struct mesh_part *part = mesh_file_add(file);
    mesh_builder_finish(&group->builder, &part->mesh);
    if (!*group->name)
        return STATUS_OK;
    const struct mtl_entry *entry = mtl_find(mtl, group->name);
    if (!entry)
        return refuse_material(obj, group, error);
    part->has_material = true;
    return mtl_material(mtl, entry, &part->mesh, scene, assets, &part->material, error);
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void finish_groups(struct obj_reader *obj)
{
    for (size_t i = 0; i < obj->group_count; i++) {
        tdelete(obj->groups[i], &obj->groups_by_name, compare_groups);
        mesh_builder_discard(&obj->groups[i]->builder);
        free(obj->groups[i]->name);
        free(obj->groups[i]);
    }
    free(obj->groups);
}

static void finish_reader(struct obj_reader *obj)
{
    finish_groups(obj);
    for (size_t i = 0; i < obj->library_count; i++)
        free(obj->libraries[i].reference);
    void *const arrays[] = {obj->points, obj->normals, obj->uv, obj->libraries, obj->face, obj->corners};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free(arrays[i]);
}

/* From the statements to the parts. */
static enum status make_parts(struct obj_reader *obj, struct mesh_file *file, struct scene *scene,
                              struct asset_set *assets, const char *name, struct error *error)
{
    struct mtl mtl = {0};
    enum status status = read_libraries(obj, &mtl, assets, name, error);
    for (size_t i = 0; status == STATUS_OK && i < obj->group_count; i++)
        status = add_part(obj, obj->groups[i], &mtl, file, scene, assets, error);
    mtl_finish(&mtl);
    if (status == STATUS_OK && file->count == 0)
        return error_set(error, STATUS_INPUT, "%s: expected faces (f), found none", obj->text.file);
    return status;
}

enum status obj_read(struct mesh_file *file, struct scene *scene, struct asset_set *assets, const char *name,
                     bool materials, struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    char *path = asset_set_path(assets, name);
    struct obj_reader obj = {
        .text = token_reader_of(path, asset->bytes.data, asset->bytes.size, error),
        .materials = materials,
    };
    obj.text.continued = true;
    read_statements(&obj);
    enum status status = obj.text.status;
    if (status == STATUS_OK)
        status = make_parts(&obj, file, scene, assets, name, error);
    finish_reader(&obj);
    free(path);
    return status;
}
