#include "scene/mtl.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "scene/token.h"

enum { ILLUMINATION_MAX = 10 };

/* --- reading ---------------------------------------------------------------------------------------------- */

/* One number for a grey or three; above 1 is cut to 1. */
static void read_colour(struct token_reader *text, struct vec3 *to)
{
    static const char what[] = "a colour's channel of at least 0";
    double rgb[3];
    token_number_in(text, what, 0, SCENE_LARGEST, &rgb[0]);
    rgb[1] = rgb[2] = rgb[0];
    if (!token_at_end(text)) {
        token_number_in(text, what, 0, SCENE_LARGEST, &rgb[1]);
        token_number_in(text, what, 0, SCENE_LARGEST, &rgb[2]);
    }
    if (text->status == STATUS_OK)
        *to = vec3_make(fmin(rgb[0], 1), fmin(rgb[1], 1), fmin(rgb[2], 1));
}

static void read_scattered(struct token_reader *text, struct mtl_entry *entry)
{
    read_colour(text, &entry->scattered);
}

static void read_specular(struct token_reader *text, struct mtl_entry *entry)
{
    read_colour(text, &entry->specular);
}

static void read_filter(struct token_reader *text, struct mtl_entry *entry)
{
    read_colour(text, &entry->filter);
}

static void read_shininess(struct token_reader *text, struct mtl_entry *entry)
{
    token_number_in(text, "a number", 0, SCENE_LARGEST, &entry->shininess);
    entry->shininess = fmax(entry->shininess, SCENE_SMALLEST);
}

static void read_opacity(struct token_reader *text, struct mtl_entry *entry)
{
    token_number_in(text, "a number", 0, 1, &entry->opacity);
}

static void read_transparency(struct token_reader *text, struct mtl_entry *entry)
{
    double transparency = 1 - entry->opacity;
    token_number_in(text, "a number", 0, 1, &transparency);
    entry->opacity = 1 - transparency;
}

static void read_ior(struct token_reader *text, struct mtl_entry *entry)
{
    token_number_in(text, "a number", 0, SCENE_LARGEST, &entry->ior);
}

static void read_illumination(struct token_reader *text, struct mtl_entry *entry)
{
    token_whole(text, "a whole number from 0 to 10", 0, ILLUMINATION_MAX, &entry->illumination);
}

/* -s: one to three numbers, of which those that must be above 0 for an image to repeat count. */
static void read_repeat(struct token_reader *text, struct mtl_entry *entry)
{
    double numbers[3] = {1, 1, 1};
    for (size_t i = 0; i < 3 && token_is_number(text); i++)
        token_number_in(text, "a number", SCENE_SMALLEST, SCENE_LARGEST, &numbers[i]);
    entry->repeat[0] = numbers[0];
    entry->repeat[1] = numbers[1];
}

/* Options of a map, each beginning with '-': all but -s are passed over with their arguments. */
static void read_map_options(struct token_reader *text, struct mtl_entry *entry)
{
    char word[TOKEN_WORD_BYTES];
    while (!token_at_end(text) && *text->at == '-' && text->status == STATUS_OK) {
        token_word(text, "an option", word);
        if (strcmp(word, "-s") == 0) {
            read_repeat(text, entry);
        } else if (token_is_number(text)) {
            for (size_t i = 0; i < 3 && token_is_number(text); i++)
                token_word(text, "a number", word);
        } else {
            token_word(text, "an option's argument", word); /* on, off, a channel's letter */
        }
    }
}

static void read_map(struct token_reader *text, struct mtl_entry *entry)
{
    char file[TOKEN_WORD_BYTES];
    read_map_options(text, entry);
    entry->line = text->line;
    token_rest(text, "the name of an image file", file);
    for (char *at = file; (at = strchr(at, '\\')); at++)
        *at = '/'; /* written on Windows */
    free(entry->map);
    entry->map = text->status == STATUS_OK ? memory_string(file) : NULL;
}

static void add_entry(struct mtl *mtl, struct token_reader *text)
{
    char name[TOKEN_WORD_BYTES];
    token_rest(text, "the name of a material", name);
    mtl->entries = memory_grow(mtl->entries, &mtl->capacity, mtl->count + 1, sizeof *mtl->entries);
    mtl->entries[mtl->count] = (struct mtl_entry){
        .place = mtl->count,
        .name = memory_string(name),
        .library = mtl->library_count - 1,
        .scattered = {0.8, 0.8, 0.8},
        .filter = {1, 1, 1},
        .shininess = 32,
        .opacity = 1,
        .ior = 1,
        .repeat = {1, 1},
        .illumination = 2,
    };
    mtl->count++;
}

static void read_statement(struct mtl *mtl, struct token_reader *text, const char *keyword)
{
    static const struct {
        const char *keyword;
        void (*read)(struct token_reader *text, struct mtl_entry *entry);
    } statements[] = {
        {"Kd", read_scattered}, {"Ks", read_specular},        {"Tf", read_filter},
        {"Ns", read_shininess}, {"d", read_opacity},          {"Tr", read_transparency},
        {"Ni", read_ior},       {"illum", read_illumination}, {"map_Kd", read_map},
    };
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++) {
        if (strcmp(keyword, statements[i].keyword) != 0)
            continue;
        statements[i].read(text, &mtl->entries[mtl->count - 1]);
        token_end_line(text);
        return;
    }
    token_skip_line(text);
}

static void read_file(struct mtl *mtl, struct token_reader *text)
{
    size_t before = mtl->count;
    char keyword[TOKEN_WORD_BYTES];
    while (token_more(text)) {
        token_word(text, "a keyword", keyword);
        if (strcmp(keyword, "newmtl") == 0)
            add_entry(mtl, text);
        else if (mtl->count == before)
            token_skip_line(text); /* belongs to no material of this file */
        else
            read_statement(mtl, text, keyword);
    }
}

enum status mtl_read(struct mtl *mtl, struct asset_set *assets, const char *name, struct error *error)
{
    const struct asset *asset = asset_set_get(assets, name, error);
    if (!asset)
        return STATUS_INPUT;
    mtl->libraries =
        memory_grow(mtl->libraries, &mtl->library_capacity, mtl->library_count + 1, sizeof *mtl->libraries);
    mtl->libraries[mtl->library_count++] = memory_string(name);
    char *path = asset_set_path(assets, name);
    struct token_reader text = token_reader_of(path, asset->bytes.data, asset->bytes.size, error);
    read_file(mtl, &text);
    free(path);
    return text.status;
}

/* --- looking up ------------------------------------------------------------------------------------------- */

static int compare_names(const void *a, const void *b)
{
    return strcmp(((const struct mtl_entry *)a)->name, ((const struct mtl_entry *)b)->name);
}

static int compare_entries(const void *a, const void *b)
{
    const struct mtl_entry *x = a, *y = b;
    int order = compare_names(a, b);
    return order != 0 ? order : x->place < y->place ? -1 : x->place > y->place;
}

static void finish_entry(struct mtl_entry *entry)
{
    free(entry->name);
    free(entry->map);
}

void mtl_sort(struct mtl *mtl)
{
    if (mtl->count == 0)
        return;
    qsort(mtl->entries, mtl->count, sizeof *mtl->entries, compare_entries);
    size_t kept = 0;
    for (size_t i = 0; i < mtl->count; i++) {
        if (kept > 0 && compare_names(&mtl->entries[kept - 1], &mtl->entries[i]) == 0)
            finish_entry(&mtl->entries[i]);
        else
            mtl->entries[kept++] = mtl->entries[i];
    }
    mtl->count = kept;
}

const struct mtl_entry *mtl_find(const struct mtl *mtl, const char *name)
{
    const struct mtl_entry key = {.name = (char *)name};
    if (mtl->count == 0)
        return NULL;
    return bsearch(&key, mtl->entries, mtl->count, sizeof key, compare_names);
}

void mtl_finish(struct mtl *mtl)
{
    for (size_t i = 0; i < mtl->count; i++)
        finish_entry(&mtl->entries[i]);
    for (size_t i = 0; i < mtl->library_count; i++)
        free(mtl->libraries[i]);
    free(mtl->entries);
    free(mtl->libraries);
    *mtl = (struct mtl){0};
}
