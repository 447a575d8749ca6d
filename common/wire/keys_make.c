/* Making the keys that keys.h describes. */
#include "wire/keys.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sodium.h>
#include <zmq.h>

#include "base/memory.h"

/* What has been made so far, so that it can be taken back. */
enum { MADE_MAX = 8 };
struct making {
    const char *folder;
    bool made_folder;
    char *paths[MADE_MAX];
    size_t count;
};

/* A folder that is there already is as good, unless it must be new. */
static enum status make_folder(struct making *making, bool must_be_new, struct error *error)
{
    struct stat info;
    making->made_folder = mkdir(making->folder, 0700) == 0;
    if (making->made_folder)
        return STATUS_OK;
    if (errno != EEXIST)
        return error_set(error, STATUS_OUTPUT, "%s: cannot be made: %s", making->folder, strerror(errno));
    if (must_be_new)
        return error_set(error, STATUS_OUTPUT, "%s: is there already, and keys are never overwritten", making->folder);
    if (stat(making->folder, &info) != 0 || !S_ISDIR(info.st_mode))
        return error_set(error, STATUS_OUTPUT, "%s: expected a folder", making->folder);
    return STATUS_OK;
}

static enum status make_file(struct making *making, const char *name, const char *text, enum key_secrecy secrecy,
                             struct error *error)
{
    char *path = memory_format("%s/%s", making->folder, name);
    enum status status = key_file_create(path, text, secrecy, error);
    if (status == STATUS_OK)
        making->paths[making->count++] = path;
    else
        free(path);
    return status;
}

/* Takes back what was made unless all went well. Returns status. */
static enum status end(struct making *making, enum status status)
{
    for (size_t i = 0; i < making->count; i++) {
        if (status != STATUS_OK)
            unlink(making->paths[i]);
        free(making->paths[i]);
    }
    if (status != STATUS_OK && making->made_folder)
        rmdir(making->folder);
    return status;
}

/* WHO.key and WHO.pub. `remark`: what to know of the secret. Writes the public key's text. */
static enum status make_pair(struct making *making, const char *who, const char *remark, char public[KEY_TEXT_BYTES],
                             struct error *error)
{
    char secret[KEY_TEXT_BYTES], name[32], text[256];
    if (zmq_curve_keypair(public, secret) != 0)
        return error_set(error, STATUS_INTERNAL, "ZeroMQ cannot make keys: %s", zmq_strerror(errno));
    snprintf(name, sizeof name, "%s.key", who);
    snprintf(text, sizeof text, "# The secret key of a weft %s. %s\n%s\n", who, remark, secret);
    enum status status = make_file(making, name, text, KEY_SECRET, error);
    sodium_memzero(text, sizeof text);
    sodium_memzero(secret, sizeof secret);
    if (status != STATUS_OK)
        return status;
    snprintf(name, sizeof name, "%s.pub", who);
    snprintf(text, sizeof text, "# The public key of a weft %s.\n%s\n", who, public);
    return make_file(making, name, text, KEY_PUBLIC, error);
}

static enum status make_list(struct making *making, const char *who, const char *may, const char *key,
                             struct error *error)
{
    char name[32], text[256];
    snprintf(name, sizeof name, "%ss", who);
    snprintf(text, sizeof text, "# Public keys that may %s, one a line.\n%s # %s.pub\n", may, key, who);
    return make_file(making, name, text, KEY_PUBLIC, error);
}

static const char worker_remark[] = "Only workers may have it.";

static enum status make_farm(struct making *making, struct error *error)
{
    char key[KEY_TEXT_BYTES];
    enum status status = make_folder(making, false, error);
    if (status == STATUS_OK)
        status = make_pair(making, "coordinator", "It stays on the coordinator's machine.", key, error);
    if (status == STATUS_OK)
        status = make_pair(making, "worker", worker_remark, key, error);
    if (status == STATUS_OK)
        status = make_list(making, "worker", "join as workers", key, error);
    if (status == STATUS_OK)
        status = make_pair(making, "watcher", "Who has it may see what the farm is doing.", key, error);
    if (status == STATUS_OK)
        status = make_list(making, "watcher", "see what the farm is doing, and no more", key, error);
    return status;
}

enum status keys_make(const char *folder, struct error *error)
{
    struct making making = {.folder = folder};
    return end(&making, make_farm(&making, error));
}

/* --- a further worker ------------------------------------------------------------------------------------- */

static enum status check_name(const char *name, struct error *error)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
    enum { NAME_MAX_BYTES = 64 };
    size_t length = strlen(name);
    if (length >= 1 && length <= NAME_MAX_BYTES && !strchr("-_.", *name) && strspn(name, letters) == length)
        return STATUS_OK;
    return error_set(error, STATUS_USAGE,
                     "worker \"%s\": expected a name of 1 to %d letters, digits, -, _ and ., beginning with a letter "
                     "or a digit", name, (int)NAME_MAX_BYTES);
}

/* In one write, so that two who add keys at once do not mix them; on a line of its own even where the last lacks its
 * end. */
static enum status append_line(const char *path, const char *key, const char *name, struct error *error)
{
    int file = open(path, O_RDWR | O_APPEND | O_CLOEXEC);
    if (file < 0)
        return error_set(error, STATUS_OUTPUT, "%s: cannot be opened to add a key: %s", path, strerror(errno));
    char last = '\n';
    off_t size = lseek(file, 0, SEEK_END);
    bool whole = size <= 0 || pread(file, &last, 1, size - 1) == 1;
    char *line = memory_format("%s%s # %s\n", last == '\n' ? "" : "\n", key, name);
    whole = whole && write(file, line, strlen(line)) == (ssize_t)strlen(line) && fsync(file) == 0;
    enum status status = STATUS_OK;
    if (!whole) {
        status = error_set(error, STATUS_OUTPUT, "%s: a key cannot be added: %s", path, strerror(errno));
        if (size >= 0 && ftruncate(file, size) != 0) /* a part of a line would spoil the list */
            error_prefix(error, status, "%s: may end with a broken line: ", path);
    }
    free(line);
    close(file);
    return status;
}

static enum status make_worker(struct making *making, const struct key *coordinator, const char *list,
                               const char *name, struct error *error)
{
    char key[KEY_TEXT_BYTES], text[256];
    enum status status = make_folder(making, true, error);
    if (status == STATUS_OK)
        status = make_pair(making, "worker", worker_remark, key, error);
    if (status != STATUS_OK)
        return status;
    char coordinator_key[KEY_TEXT_BYTES];
    key_text(coordinator, coordinator_key);
    snprintf(text, sizeof text, "# The public key of a weft coordinator.\n%s\n", coordinator_key);
    status = make_file(making, "coordinator.pub", text, KEY_PUBLIC, error);
    if (status == STATUS_OK)
        status = append_line(list, key, name, error);
    return status;
}

enum status keys_add_worker(const char *folder, const char *name, struct error *error)
{
    struct key coordinator;
    struct key_list workers = {0};
    enum status status = check_name(name, error);
    if (status != STATUS_OK)
        return status;
    char *own = memory_format("%s/%s", folder, name), *public = memory_format("%s/coordinator.pub", folder);
    char *list = memory_format("%s/workers", folder);
    struct making making = {.folder = own};
    status = key_file_read(&coordinator, public, KEY_PUBLIC, error);
    if (status == STATUS_OK)
        status = key_list_read(&workers, list, error);
    if (status == STATUS_OK)
        status = end(&making, make_worker(&making, &coordinator, list, name, error));
    key_list_finish(&workers);
    free(own);
    free(public);
    free(list);
    return status;
}
