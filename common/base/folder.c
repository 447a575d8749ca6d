#include "base/folder.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"

/* The caller frees. */
static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    if (!slash)
        return memory_string(".");
    return slash == path ? memory_string("/") : memory_format("%.*s", (int)(slash - path), path);
}

static enum status look_up(const char *path, const char *folder, struct error *error)
{
    struct stat info;
    int failure = stat(folder, &info) == 0 ? 0 : errno;
    if (failure == ENOENT)
        return error_set(error, STATUS_OUTPUT, "%s: the folder %s is not there", path, folder);
    if (failure == ENOTDIR)
        return error_set(error, STATUS_OUTPUT, "%s: expected a folder at %s, found a file on the way to it", path,
                         folder);
    if (failure != 0)
        return error_set(error, STATUS_OUTPUT, "%s: the folder %s cannot be looked up: %s", path, folder,
                         strerror(failure));
    if (!S_ISDIR(info.st_mode))
        return error_set(error, STATUS_OUTPUT, "%s: expected a folder at %s, found a file", path, folder);
    return STATUS_OK;
}

enum status folder_is_there(const char *path, struct error *error)
{
    char *folder = folder_of(path);
    enum status status = look_up(path, folder, error);
    free(folder);
    return status;
}

enum status folder_takes_files(const char *path, struct error *error)
{
    char *folder = folder_of(path);
    enum status status = look_up(path, folder, error);
    if (status == STATUS_OK && faccessat(AT_FDCWD, folder, W_OK | X_OK, AT_EACCESS) != 0)
        status = error_set(error, STATUS_OUTPUT, "%s: the folder %s cannot be written to: %s", path, folder,
                           strerror(errno));
    free(folder);
    return status;
}
