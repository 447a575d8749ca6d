#include "coordinator/runtime.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char scheme[] = "ipc://";

/* Leaves room for "/PID.ipc" within the 107 bytes of a socket's path. */
enum { FOLDER_BYTES = 92 };

static bool is_private(const char *folder)
{
    struct stat info;
    return lstat(folder, &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == geteuid() &&
           (info.st_mode & 077) == 0;
}

/* Where sessions have a folder of the user's own; false: this one has none, or its path is too long. */
static bool session_folder(char folder[FOLDER_BYTES])
{
    const char *base = getenv("XDG_RUNTIME_DIR");
    if (!base || base[0] != '/' || access(base, W_OK) != 0)
        return false;
    return snprintf(folder, FOLDER_BYTES, "%s/weft", base) < FOLDER_BYTES;
}

/* Everywhere else. */
static void common_folder(char folder[FOLDER_BYTES])
{
    snprintf(folder, FOLDER_BYTES, "/tmp/weft-%lu", (unsigned long)geteuid());
}

static enum status make_folder(char folder[FOLDER_BYTES], struct error *error)
{
    if (!session_folder(folder))
        common_folder(folder);
    if (mkdir(folder, 0700) != 0 && errno != EEXIST)
        return error_set(error, STATUS_FAILED, "%s: cannot be made: %s", folder, strerror(errno));
    if (!is_private(folder))
        return error_set(error, STATUS_FAILED, "%s: expected a folder that only this user can enter", folder);
    return STATUS_OK;
}

/* The process that a socket's file is named for; 0: it is no such file. */
static pid_t owner_of(const char *name)
{
    char *end;
    long pid = strtol(name, &end, 10);
    return pid > 0 && strcmp(end, ".ipc") == 0 ? (pid_t)pid : 0;
}

static bool lives(pid_t pid)
{
    return kill(pid, 0) == 0 || errno != ESRCH;
}

/* A coordinator that was killed leaves its socket's file. */
static void remove_stale(const char *folder)
{
    DIR *list = opendir(folder);
    if (!list)
        return;
    for (struct dirent *entry = readdir(list); entry; entry = readdir(list)) {
        pid_t pid = owner_of(entry->d_name);
        if (pid > 0 && !lives(pid))
            unlinkat(dirfd(list), entry->d_name, 0);
    }
    closedir(list);
}

enum status runtime_endpoint(char endpoint[WIRE_ENDPOINT_BYTES], struct error *error)
{
    char folder[FOLDER_BYTES];
    enum status status = make_folder(folder, error);
    if (status != STATUS_OK)
        return status;
    remove_stale(folder);
    snprintf(endpoint, WIRE_ENDPOINT_BYTES, "%s%s/%ld.ipc", scheme, folder, (long)getpid());
    return STATUS_OK;
}

void runtime_endpoint_remove(const char *endpoint)
{
    unlink(endpoint + strlen(scheme));
}

static size_t find_in(const char *folder, char (*endpoints)[WIRE_ENDPOINT_BYTES], size_t max)
{
    DIR *list = is_private(folder) ? opendir(folder) : NULL;
    size_t count = 0;
    if (!list)
        return 0;
    for (struct dirent *entry = readdir(list); entry; entry = readdir(list)) {
        pid_t pid = owner_of(entry->d_name);
        if (pid <= 0 || !lives(pid))
            continue;
        if (count < max)
            snprintf(endpoints[count], WIRE_ENDPOINT_BYTES, "%s%s/%ld.ipc", scheme, folder, (long)pid);
        count++;
    }
    closedir(list);
    return count;
}

size_t runtime_find(char (*endpoints)[WIRE_ENDPOINT_BYTES], size_t max)
{
    char folder[FOLDER_BYTES];
    size_t count = session_folder(folder) ? find_in(folder, endpoints, max) : 0;
    if (count > 0)
        return count;
    common_folder(folder);
    return find_in(folder, endpoints, max);
}
