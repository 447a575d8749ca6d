#include "image/part_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/folder.h"
#include "base/memory.h"

/* Frees and closes what *file holds, whichever of it there is; the temporary file is somebody else's care. */
static void release(struct part_file *file)
{
    if (file->fd >= 0)
        close(file->fd);
    if (file->folder_fd >= 0)
        close(file->folder_fd);
    free(file->path);
    free(file->temporary);
    *file = (struct part_file){.folder_fd = -1, .fd = -1};
}

/* Names the output and errno, then discards the file. */
static enum status fail(struct part_file *file, const char *doing, struct error *error)
{
    error_set(error, STATUS_OUTPUT, "%s: %s: %s", file->path, doing, strerror(errno));
    part_file_discard(file);
    return STATUS_OUTPUT;
}

/* Holds the folder open, so that a folder that cannot be synced shows before a render and not after it. */
static enum status open_folder(struct part_file *file, struct error *error)
{
    size_t length = (size_t)(file->name - file->path);
    char *folder = length > 0 ? memory_format("%.*s", (int)length, file->path) : memory_string(".");
    enum status status = STATUS_OK;
    file->folder_fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int failure = errno;
    if (file->folder_fd < 0)
        status = folder_is_there(file->path, error);
    if (file->folder_fd < 0 && status == STATUS_OK)
        status = error_set(error, STATUS_OUTPUT, "%s: cannot open the folder %s: %s", file->path, folder,
                           strerror(failure));
    free(folder);
    return status;
}

enum { OWN_PATH_BYTES = 32 };

/* Where a file that this process has open can be found. */
static void own_path(int fd, char path[OWN_PATH_BYTES])
{
    snprintf(path, OWN_PATH_BYTES, "/proc/self/fd/%d", fd);
}

static const char *type_name(mode_t mode)
{
    switch (mode & S_IFMT) {
    case S_IFDIR:
        return "a folder";
    case S_IFIFO:
        return "a pipe";
    case S_IFSOCK:
        return "a socket";
    default:
        return "a device";
    }
}

static enum status check_target(const struct part_file *file, struct error *error)
{
    struct stat found;
    if (*file->name == 0)
        return error_set(error, STATUS_OUTPUT, "%s: expected the name of a file, found none after the folder",
                         file->path);
    if (fstatat(file->folder_fd, file->name, &found, 0) < 0) {
        if (errno == ENOENT)
            return STATUS_OK;
        return error_set(error, STATUS_OUTPUT, "%s: cannot be looked up: %s", file->path, strerror(errno));
    }
    if (!S_ISREG(found.st_mode))
        return error_set(error, STATUS_OUTPUT, "%s: expected a regular file or a new one, found %s", file->path,
                         type_name(found.st_mode));
    return STATUS_OK;
}

/* A file without a name goes with the process that writes it, however that ends. Leaves fd −1 where the file system
 * knows none, or no name could be given to it later. */
static int open_nameless(const struct part_file *file)
{
    char path[OWN_PATH_BYTES];
    int fd = openat(file->folder_fd, ".", O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
    if (fd < 0)
        return -1;
    own_path(fd, path);
    if (access(path, F_OK) == 0)
        return fd;
    close(fd);
    errno = EOPNOTSUPP;
    return -1;
}

static enum status create_temporary(struct part_file *file, struct error *error)
{
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
    file->fd = open_nameless(file);
    if (file->fd < 0 && (errno == EOPNOTSUPP || errno == EISDIR || errno == EINVAL)) {
        file->named = true;
        file->fd = openat(file->folder_fd, file->temporary, flags, 0666);
        if (file->fd < 0 && errno == EEXIST && unlinkat(file->folder_fd, file->temporary, 0) == 0)
            file->fd = openat(file->folder_fd, file->temporary, flags, 0666);
    }
    if (file->fd < 0)
        return error_set(error, STATUS_OUTPUT, "%s: cannot create a temporary file beside it: %s", file->path,
                         strerror(errno));
    return STATUS_OK;
}

enum status part_file_open(struct part_file *file, const char *path, struct error *error)
{
    *file = (struct part_file){.path = memory_string(path), .folder_fd = -1, .fd = -1};
    const char *slash = strrchr(file->path, '/');
    file->name = slash ? slash + 1 : file->path;
    file->temporary = memory_format(".%s.%ld.part", file->name, (long)getpid());
    enum status status = open_folder(file, error);
    if (status == STATUS_OK)
        status = check_target(file, error);
    if (status == STATUS_OK)
        status = create_temporary(file, error);
    if (status != STATUS_OK)
        release(file);
    return status;
}

enum status part_file_write(struct part_file *file, const void *data, size_t size, uint64_t offset,
                            struct error *error)
{
    const uint8_t *bytes = data;
    while (size > 0) {
        ssize_t written = pwrite(file->fd, bytes, size, (off_t)offset);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return fail(file, "cannot be written", error);
        bytes += written;
        size -= (size_t)written;
        offset += (uint64_t)written;
    }
    return STATUS_OK;
}

/* Some file systems cannot sync a folder and say EINVAL; they leave nothing better to do. */
static int sync_folder(int folder_fd)
{
    int result = fsync(folder_fd);
    return result < 0 && errno == EINVAL ? 0 : result;
}

/* Gives it its temporary name, which replaces what another process may have left. */
static int give_name(struct part_file *file)
{
    char path[OWN_PATH_BYTES];
    own_path(file->fd, path);
    int result = linkat(AT_FDCWD, path, file->folder_fd, file->temporary, AT_SYMLINK_FOLLOW);
    if (result < 0 && errno == EEXIST && unlinkat(file->folder_fd, file->temporary, 0) == 0)
        result = linkat(AT_FDCWD, path, file->folder_fd, file->temporary, AT_SYMLINK_FOLLOW);
    file->named = result == 0;
    return result;
}

enum status part_file_publish(struct part_file *file, struct error *error)
{
    if (fsync(file->fd) < 0)
        return fail(file, "cannot be brought to disk", error);
    if (!file->named && give_name(file) < 0)
        return fail(file, "cannot be given its name", error);
    int closed = close(file->fd);
    file->fd = -1;
    if (closed < 0)
        return fail(file, "cannot be closed", error);
    if (renameat(file->folder_fd, file->temporary, file->folder_fd, file->name) < 0)
        return fail(file, "cannot be put in place", error);
    if (sync_folder(file->folder_fd) < 0)
        return fail(file, "is written, but its folder cannot be brought to disk", error);
    release(file);
    return STATUS_OK;
}

void part_file_discard(struct part_file *file)
{
    if (file->named)
        unlinkat(file->folder_fd, file->temporary, 0);
    release(file);
}
