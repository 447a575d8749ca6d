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

static enum status make_folder(char folder[FOLDER_BYTES], struct error *error)
{
    const char *base = getenv("XDG_RUNTIME_DIR");
    int length = -1;
    if (base && base[0] == '/' && access(base, W_OK) == 0)
        length = snprintf(folder, FOLDER_BYTES, "%s/weft", base);
    if (length < 0 || length >= FOLDER_BYTES)
        snprintf(folder, FOLDER_BYTES, "/tmp/weft-%lu", (unsigned long)geteuid());
    if (mkdir(folder, 0700) != 0 && errno != EEXIST)
        return error_set(error, STATUS_FAILED, "%s: cannot be made: %s", folder, strerror(errno));
    if (!is_private(folder))
        return error_set(error, STATUS_FAILED, "%s: expected a folder that only this user can enter", folder);
    return STATUS_OK;
}

/* A coordinator that was killed leaves its socket's file. */
static void remove_stale(const char *folder)
{
    DIR *list = opendir(folder);
    if (!list)
        return;
    for (struct dirent *entry = readdir(list); entry; entry = readdir(list)) {
        char *end;
        long pid = strtol(entry->d_name, &end, 10);
        if (pid > 0 && strcmp(end, ".ipc") == 0 && kill((pid_t)pid, 0) != 0 && errno == ESRCH)
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
