/*
 * Stanford .ply meshes, in text and in binary of either byte order: vertices with x, y, z and, if they have
 * them, normals and texture coordinates; faces. Other properties and elements are passed over.
 */
#include "scene/ply.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/memory.h"
#include "scene/mesh_builder.h"
#include "scene/mesh_file.h"
#include "scene/polygon.h"

struct ply_reader {
    struct ply_header header;
    struct ply_body body;
    struct mesh_builder builder;
    uint32_t *corners; /* of the face in work */
    size_t corner_count, corner_capacity;
};

static bool is_good(const struct ply_reader *ply)
{
    return ply->body.text->status == STATUS_OK;
}

/* --- rows ------------------------------------------------------------------------------------------------- */

static uint64_t read_list_length(struct ply_reader *ply, const struct ply_property *property)
{
    struct token_reader before = *ply->body.text;
    double length = ply_value(&ply->body, property->count_type, "the length of a list");
    if (is_good(ply) && (length < 0 || length != floor(length) || length > UINT32_MAX)) {
        *ply->body.text = before;
        ply_expected(&ply->body, "the length of a list, a whole number from 0", "another");
    }
    return is_good(ply) ? (uint64_t)length : 0;
}

static void skip_property(struct ply_reader *ply, const struct ply_property *property)
{
    ply_skip(&ply->body, property->type, property->list ? read_list_length(ply, property) : 1);
}

static void read_vertex(struct ply_reader *ply, const struct ply_element *element)
{
    static const char *const names[] = {"a coordinate x",         "a coordinate y",        "a coordinate z",
                                        "a normal's nx",          "a normal's ny",         "a normal's nz",
                                        "a texture coordinate u", "a texture coordinate v"};
    double value[PLY_OTHER] = {0};
    struct mesh_vertex vertex = {0};
    for (size_t i = 0; i < element->property_count && is_good(ply); i++) {
        const struct ply_property *property = &element->properties[i];
        if (property->role < PLY_OTHER)
            value[property->role] = ply_value(&ply->body, property->type, names[property->role]);
        else
            skip_property(ply, property);
        vertex.has_uv |= property->role == PLY_U;
    }
    if (!is_good(ply))
        return;
    vertex.point = vec3_make(value[PLY_X], value[PLY_Y], value[PLY_Z]);
    vertex.normal = mesh_normal(vec3_make(value[PLY_NX], value[PLY_NY], value[PLY_NZ]));
    vertex.uv[0] = value[PLY_U];
    vertex.uv[1] = value[PLY_V];
    mesh_builder_append(&ply->builder, &vertex);
}

static uint32_t read_corner(struct ply_reader *ply, enum ply_type type)
{
    size_t count = ply->builder.mesh.vertex_count;
    struct token_reader before = *ply->body.text;
    double corner = ply_value(&ply->body, type, "a corner");
    if (is_good(ply) && !(corner >= 0 && corner < (double)count && corner == floor(corner))) {
        char expected[80], found[32];
        snprintf(expected, sizeof expected, "one of the %zu vertices, counted from 0", count);
        snprintf(found, sizeof found, "%.10g", corner);
        *ply->body.text = before;
        ply_expected(&ply->body, expected, found);
    }
    return is_good(ply) ? (uint32_t)corner : 0;
}

static void read_corners(struct ply_reader *ply, const struct ply_property *property)
{
    uint64_t length = read_list_length(ply, property);
    ply->corner_count = 0;
    for (uint64_t i = 0; i < length && is_good(ply); i++) {
        ply->corners =
            memory_grow(ply->corners, &ply->corner_capacity, ply->corner_count + 1, sizeof *ply->corners);
        ply->corners[ply->corner_count++] = read_corner(ply, property->type);
    }
}

static void read_face(struct ply_reader *ply, const struct ply_element *element)
{
    for (size_t i = 0; i < element->property_count && is_good(ply); i++) {
        if (element->properties[i].role == PLY_CORNERS)
            read_corners(ply, &element->properties[i]);
        else
            skip_property(ply, &element->properties[i]);
    }
    if (!is_good(ply))
        return;
    if (ply->corner_count < 3)
        ply_expected(&ply->body, "a face of at least 3 corners", "one of fewer");
    else if (!mesh_builder_face(&ply->builder, ply->corners, ply->corner_count))
        ply_expected(&ply->body, "a convex face or at most 1024 corners", "a concave one of more");
}

static void skip_row(struct ply_reader *ply, const struct ply_element *element)
{
    for (size_t i = 0; i < element->property_count && is_good(ply); i++)
        skip_property(ply, &element->properties[i]);
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void read_rows(struct ply_reader *ply, const struct ply_element *element)
{
    static void (*const read[])(struct ply_reader *, const struct ply_element *) = {
        [PLY_VERTICES] = read_vertex, [PLY_FACES] = read_face, [PLY_SKIPPED] = skip_row};
    static const char *const names[] = {
        [PLY_VERTICES] = "a vertex", [PLY_FACES] = "a face", [PLY_SKIPPED] = "an element's line"};
    if (element->property_count == 0)
        return; /* nothing stands in the file */
    for (uint64_t i = 0; i < element->count && is_good(ply); i++) {
        ply_begin_row(&ply->body, names[element->kind]);
        read[element->kind](ply, element);
        ply_end_row(&ply->body);
    }
}

static void read_body(struct ply_reader *ply)
{
    for (size_t i = 0; i < ply->header.element_count && is_good(ply); i++)
        read_rows(ply, &ply->header.elements[i]);
    struct token_reader *text = ply->body.text;
    bool more = ply->body.format == PLY_ASCII ? token_more(text) : text->at < text->end;
    if (is_good(ply) && more)
        ply_expected(&ply->body, "the end of the file", "more bytes");
    if (is_good(ply) && ply->builder.mesh.triangle_count == 0)
        token_refuse(text, "expected faces, found none");
}

enum status ply_read(struct mesh_file *file, struct asset_set *assets, const char *name, struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    char *path = asset_set_path(assets, name);
    struct token_reader text = token_reader_of(path, asset->bytes.data, asset->bytes.size, error);
    struct ply_reader ply = {.body = {.start = asset->bytes.data, .text = &text}};
    ply_header_read(&ply.header, &text);
    ply.body.format = ply.header.format;
    if (text.status == STATUS_OK)
        read_body(&ply);
    if (text.status == STATUS_OK)
        mesh_builder_finish(&ply.builder, &mesh_file_add(file)->mesh);
    mesh_builder_discard(&ply.builder);
    ply_header_finish(&ply.header);
    free(ply.corners);
    free(path);
    return text.status;
}
