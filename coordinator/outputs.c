#include "coordinator/outputs.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/folder.h"
#include "base/memory.h"

/* The scene's file name without folder and ending. The caller frees. */
static char *stem_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *stem = memory_string(slash ? slash + 1 : path);
    char *dot = strrchr(stem, '.');
    if (dot && dot != stem)
        *dot = '\0';
    return stem;
}

char *outputs_path(const char *asked, const char *scene, bool several)
{
    if (asked && !several)
        return memory_string(asked);
    char *stem = stem_of(scene);
    char *path = asked ? memory_format("%s/%s.png", asked, stem) : memory_format("%s.png", stem);
    free(stem);
    return path;
}

static bool is_picture_name(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && (strcmp(dot, ".png") == 0 || strcmp(dot, ".pfm") == 0);
}

enum status outputs_make_folder(const char *folder, struct error *error)
{
    struct stat info;
    if (stat(folder, &info) == 0 && S_ISDIR(info.st_mode))
        return STATUS_OK;
    if (stat(folder, &info) == 0)
        return error_set(error, STATUS_OUTPUT, "%s: expected a folder for the pictures: it is a file", folder);
    if (is_picture_name(folder))
        return error_set(error, STATUS_USAGE, "%s: expected a folder for the pictures of several scenes", folder);
    if (mkdir(folder, 0777) == 0)
        return STATUS_OK;
    int failure = errno;
    if (folder_is_there(folder, error) != STATUS_OK)
        return STATUS_OUTPUT;
    return error_set(error, STATUS_OUTPUT, "%s: expected a folder for the pictures: %s", folder, strerror(failure));
}

/* Where the file's name begins in its path. */
static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* The folder's, so that two paths to it can be told to be one. False if it is not there. */
static bool find_folder(const char *path, struct stat *info)
{
    int length = (int)(name_of(path) - path);
    char *folder = length > 0 ? memory_format("%.*s", length, path) : memory_string(".");
    bool found = stat(folder, info) == 0;
    free(folder);
    return found;
}

static bool is_same_file(const char *a, const char *b)
{
    struct stat folders[2];
    if (strcmp(a, b) == 0)
        return true;
    return strcmp(name_of(a), name_of(b)) == 0 && find_folder(a, &folders[0]) && find_folder(b, &folders[1]) &&
           folders[0].st_dev == folders[1].st_dev && folders[0].st_ino == folders[1].st_ino;
}

enum status outputs_check_distinct(const struct output *outputs, size_t count, struct error *error)
{
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < i; k++)
            if (is_same_file(outputs[k].path, outputs[i].path))
                return error_set(error, STATUS_USAGE, "%s and %s would both be written to %s", outputs[k].what,
                                 outputs[i].what, outputs[i].path);
    return STATUS_OK;
}

/* A path that ends with its folder is no file's, which whoever opens it says. */
enum status outputs_check_folders(const struct output *outputs, size_t count, struct error *error)
{
    enum status status = STATUS_OK;
    for (size_t i = 0; i < count && status == STATUS_OK; i++)
        if (*name_of(outputs[i].path))
            status = folder_takes_files(outputs[i].path, error);
    return status;
}

enum status outputs_check_spare(const struct output *outputs, size_t count, const char *input, struct error *error)
{
    for (size_t i = 0; input && i < count; i++)
        if (is_same_file(outputs[i].path, input))
            return error_set(error, STATUS_USAGE, "%s: expected another output than %s, which is read",
                             outputs[i].what, input);
    return STATUS_OK;
}
