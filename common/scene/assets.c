#include "scene/assets.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

void asset_set_finish(struct asset_set *set)
{
    for (size_t i = 0; i < set->count; i++) {
        free(set->assets[i].name);
        bytes_finish(&set->assets[i].bytes);
    }
    free(set->assets);
    free(set->folder);
    *set = (struct asset_set){0};
}

void asset_set_init_disk(struct asset_set *set, const char *path, const char **name)
{
    *set = (struct asset_set){0};
    const char *slash = strrchr(path, '/');
    *name = slash ? slash + 1 : path;
    if (!slash)
        set->folder = memory_string(".");
    else if (slash == path)
        set->folder = memory_string("/");
    else
        set->folder = memory_format("%.*s", (int)(slash - path), path);
}

void asset_set_add(struct asset_set *set, const char *name, struct bytes *bytes)
{
    set->assets = memory_grow(set->assets, &set->capacity, set->count + 1, sizeof *set->assets);
    set->assets[set->count++] = (struct asset){
        .name = memory_string(name),
        .digest = digest_of(bytes->data, bytes->size),
        .bytes = *bytes,
    };
    *bytes = (struct bytes){0};
}

char *asset_set_path(const struct asset_set *set, const char *name)
{
    if (!set->folder || strcmp(set->folder, ".") == 0 || name[0] == '/')
        return memory_string(name);
    return memory_format("%s%s%s", set->folder, strcmp(set->folder, "/") == 0 ? "" : "/", name);
}

static enum status read_asset(struct asset_set *set, const char *name, struct error *error)
{
    if (!set->folder)
        return error_set(error, STATUS_INPUT, "%s: expected among the files received, found none", name);
    if (set->count == ASSET_COUNT_MAX)
        return error_set(error, STATUS_INPUT, "%s: expected at most %d files for a scene, found more", name,
                         ASSET_COUNT_MAX);
    struct bytes bytes = {0};
    char *path = asset_set_path(set, name);
    enum status status = bytes_read_file(&bytes, path, ASSET_BYTES_MAX, error);
    free(path);
    if (status == STATUS_OK)
        asset_set_add(set, name, &bytes);
    return status;
}

const struct asset *asset_set_find(const struct asset_set *set, const char *name)
{
    for (size_t i = 0; i < set->count; i++)
        if (strcmp(set->assets[i].name, name) == 0)
            return &set->assets[i];
    return NULL;
}

const struct asset *asset_set_get(struct asset_set *set, const char *name, struct error *error)
{
    const struct asset *known = asset_set_find(set, name);
    if (known)
        return known;
    return read_asset(set, name, error) == STATUS_OK ? &set->assets[set->count - 1] : NULL;
}

/* Takes away every "." and empty part, so that "./sky.png" and "sky.png" are one asset. ".." stays: where
 * it leads depends on links. */
static void drop_empty_parts(char *name)
{
    const char *from = name;
    char *to = name;
    while (*from == '/' && to == name)
        *to++ = *from++;
    while (*from) {
        size_t length = strcspn(from, "/");
        bool empty = length == 0 || (length == 1 && *from == '.');
        const char *part = from;
        from += length + (from[length] == '/');
        if (empty)
            continue;
        size_t kept = (size_t)(from - part);
        memmove(to, part, kept);
        to += kept;
    }
    *to = '\0';
}

enum status asset_name_join(char *name, const char *from, const char *reference, struct error *error)
{
    const char *slash = reference[0] == '/' ? NULL : strrchr(from, '/');
    size_t folder = slash ? (size_t)(slash - from) + 1 : 0, length = strlen(reference);
    if (length == 0)
        return error_set(error, STATUS_INPUT, "expected the name of a file, found \"\"");
    if (folder + length > ASSET_NAME_MAX)
        return error_set(error, STATUS_INPUT, "expected a file name of at most %d bytes, found %zu",
                         ASSET_NAME_MAX, folder + length);
    memcpy(name, from, folder);
    memcpy(name + folder, reference, length + 1);
    drop_empty_parts(name);
    if (!*name)
        return error_set(error, STATUS_INPUT, "expected the name of a file, found \"%s\"", reference);
    return STATUS_OK;
}

struct digest asset_set_digest(const struct asset_set *set)
{
    struct bytes digests = {0};
    for (size_t i = 0; i < set->count; i++)
        bytes_put(&digests, set->assets[i].digest.bytes, DIGEST_BYTES);
    struct digest digest = digest_of(digests.data, digests.size);
    bytes_finish(&digests);
    return digest;
}
