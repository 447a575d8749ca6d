#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/ply.h"

void ply_header_finish(struct ply_header *header)
{
    for (size_t i = 0; i < header->element_count; i++)
        free(header->elements[i].properties);
    free(header->elements);
    *header = (struct ply_header){0};
}

/* --- lines ------------------------------------------------------------------------------------------------ */

/* The place of the next word in a list of `count`; otherwise a failure, and 0. */
static size_t read_choice(struct token_reader *text, const char *what, const char *const *names, size_t count)
{
    char word[TOKEN_WORD_BYTES];
    struct token_reader before = *text;
    token_word(text, what, word);
    if (text->status != STATUS_OK)
        return 0;
    for (size_t i = 0; i < count; i++)
        if (strcmp(word, names[i]) == 0)
            return i;
    *text = before;
    token_expected(text, "%s", what);
    return 0;
}

static void read_format(struct ply_header *header, struct token_reader *text)
{
    static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    double version = 0;
    header->format =
        (enum ply_format)read_choice(text, "ascii, binary_little_endian or binary_big_endian", formats, 3);
    token_number_in(text, "the version 1.0, a number", 1, 1, &version);
}

static void read_element(struct ply_header *header, struct token_reader *text)
{
    char name[TOKEN_WORD_BYTES];
    int64_t count = 0;
    token_word(text, "an element's name", name);
    token_whole(text, "how many there are of the element", 0, INT64_MAX / 16, &count);
    header->elements = memory_grow(header->elements, &header->element_capacity, header->element_count + 1,
                                   sizeof *header->elements);
    header->elements[header->element_count++] = (struct ply_element){
        .kind = strcmp(name, "vertex") == 0 ? PLY_VERTICES
                : strcmp(name, "face") == 0 ? PLY_FACES
                                            : PLY_SKIPPED,
        .count = (uint64_t)count,
    };
}

static enum ply_type read_type(struct token_reader *text)
{
    static const char *const names[] = {"char",  "uchar",  "short",   "ushort", "int",   "uint",
                                        "float", "double", "int8",    "uint8",  "int16", "uint16",
                                        "int32", "uint32", "float32", "float64"};
    size_t name = read_choice(text, "a type such as float, uchar or int", names, 2 * PLY_TYPES);
    return (enum ply_type)(name % PLY_TYPES);
}

/* A list's length or corner must be of a whole type. */
static enum ply_type read_whole_type(struct token_reader *text)
{
    struct token_reader before = *text;
    enum ply_type type = read_type(text);
    if (text->status == STATUS_OK && (type == PLY_FLOAT32 || type == PLY_FLOAT64)) {
        *text = before;
        token_expected(text, "a whole type such as uchar or int");
    }
    return type;
}

static enum ply_role vertex_role(const char *name)
{
    static const struct {
        const char *name;
        enum ply_role role;
    } roles[] = {
        {"x", PLY_X},         {"y", PLY_Y},         {"z", PLY_Z},         {"nx", PLY_NX},       {"ny", PLY_NY},
        {"nz", PLY_NZ},       {"s", PLY_U},         {"t", PLY_V},         {"u", PLY_U},         {"v", PLY_V},
        {"texture_u", PLY_U}, {"texture_v", PLY_V}, {"texture_s", PLY_U}, {"texture_t", PLY_V},
    };
    for (size_t i = 0; i < sizeof roles / sizeof *roles; i++)
        if (strcmp(name, roles[i].name) == 0)
            return roles[i].role;
    return PLY_OTHER;
}

static enum ply_role role_of(const struct ply_element *element, const struct ply_property *property,
                             const char *name)
{
    if (element->kind == PLY_VERTICES && !property->list)
        return vertex_role(name);
    bool corners = strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0;
    return element->kind == PLY_FACES && property->list && corners ? PLY_CORNERS : PLY_OTHER;
}

static bool next_is_list(struct token_reader *text)
{
    char word[TOKEN_WORD_BYTES];
    struct token_reader before = *text;
    token_word(text, "a type or list", word);
    if (strcmp(word, "list") == 0)
        return true;
    if (text->status == STATUS_OK)
        *text = before;
    return false;
}

static void read_property(struct ply_header *header, struct token_reader *text)
{
    char name[TOKEN_WORD_BYTES];
    struct ply_property property = {.list = next_is_list(text)};
    if (property.list)
        property.count_type = read_whole_type(text);
    struct token_reader at_type = *text;
    property.type = read_type(text);
    token_word(text, "a property's name", name);
    if (header->element_count == 0)
        token_refuse(text, "expected an element before its properties, found none");
    if (text->status != STATUS_OK)
        return;
    struct ply_element *element = &header->elements[header->element_count - 1];
    property.role = role_of(element, &property, name);
    if (property.role == PLY_CORNERS) {
        read_whole_type(&at_type);
        text->status = at_type.status;
    }
    element->properties = memory_grow(element->properties, &element->property_capacity,
                                      element->property_count + 1, sizeof *element->properties);
    element->properties[element->property_count++] = property;
}

/* --- what a mesh needs ------------------------------------------------------------------------------------ */

static bool has_role(const struct ply_element *element, enum ply_role role)
{
    for (size_t i = 0; i < element->property_count; i++)
        if (element->properties[i].role == role)
            return true;
    return false;
}

static size_t count_kind(const struct ply_header *header, enum ply_element_kind kind)
{
    size_t count = 0;
    for (size_t i = 0; i < header->element_count; i++)
        count += header->elements[i].kind == kind;
    return count;
}

/* Normals and texture coordinates count only if they are whole. */
static void drop_halves(struct ply_element *element)
{
    bool normal = has_role(element, PLY_NX) && has_role(element, PLY_NY) && has_role(element, PLY_NZ);
    bool uv = has_role(element, PLY_U) && has_role(element, PLY_V);
    for (size_t i = 0; i < element->property_count; i++) {
        enum ply_role *role = &element->properties[i].role;
        if ((!normal && *role >= PLY_NX && *role <= PLY_NZ) || (!uv && (*role == PLY_U || *role == PLY_V)))
            *role = PLY_OTHER;
    }
}

static void check_header(struct ply_header *header, struct token_reader *text)
{
    bool vertices_read = false;
    if (count_kind(header, PLY_VERTICES) != 1 || count_kind(header, PLY_FACES) != 1)
        token_refuse(text, "expected one element vertex and one element face, found %zu and %zu",
                     count_kind(header, PLY_VERTICES), count_kind(header, PLY_FACES));
    for (size_t i = 0; i < header->element_count; i++) {
        struct ply_element *element = &header->elements[i];
        if (element->kind == PLY_VERTICES) {
            vertices_read = true;
            if (!has_role(element, PLY_X) || !has_role(element, PLY_Y) || !has_role(element, PLY_Z))
                token_refuse(text, "expected properties x, y and z of the element vertex, found not all");
            drop_halves(element);
        } else if (element->kind == PLY_FACES) {
            if (!vertices_read)
                token_refuse(text, "expected the element vertex before face, found it after");
            if (!has_role(element, PLY_CORNERS))
                token_refuse(text, "expected a property list vertex_indices of the element face, found none");
        }
    }
}

/* --- the whole -------------------------------------------------------------------------------------------- */

/* Past the end of the header's last line: what follows may be binary. */
static void pass_line_end(struct token_reader *text)
{
    token_end_line(text);
    if (text->status == STATUS_OK && *text->at == '\n') {
        text->at++;
        text->line++;
    }
}

static void read_line(struct ply_header *header, struct token_reader *text, size_t keyword)
{
    switch (keyword) {
    case 0:
        read_format(header, text);
        break;
    case 1:
        read_element(header, text);
        break;
    case 2:
        read_property(header, text);
        break;
    default:
        token_skip_line(text); /* comment, obj_info */
    }
    token_end_line(text);
}

void ply_header_read(struct ply_header *header, struct token_reader *text)
{
    static const char *const magic[] = {"ply"};
    static const char *const keywords[] = {"format",  "element",  "property",
                                           "comment", "obj_info", "end_header"};
    enum { END = 5 };
    text->comments = false;
    read_choice(text, "the word ply", magic, 1);
    token_end_line(text);
    bool has_format = false;
    for (;;) {
        if (text->status == STATUS_OK && !token_more(text))
            token_expected(text, "end_header");
        size_t keyword =
            read_choice(text, "format, element, property, comment or end_header", keywords, END + 1);
        if (text->status != STATUS_OK || keyword == END)
            break;
        has_format |= keyword == 0;
        read_line(header, text, keyword);
    }
    if (!has_format)
        token_refuse(text, "expected a line format before the end of the header, found none");
    check_header(header, text);
    pass_line_end(text);
}
