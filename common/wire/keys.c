#include "wire/keys.h"

#include <stdlib.h>
#include <unistd.h>

#include <sodium.h>

#include "base/memory.h"

static enum status read_key(struct key *key, const char *folder, const char *name, enum key_secrecy secrecy,
                            struct error *error)
{
    char *path = memory_format("%s/%s", folder, name);
    enum status status = key_file_read(key, path, secrecy, error);
    free(path);
    return status;
}

static enum status read_list(struct key_list *list, const char *folder, const char *name, struct error *error)
{
    char *path = memory_format("%s/%s", folder, name);
    enum status status = key_list_read(list, path, error);
    free(path);
    return status;
}

enum status coordinator_keys_read(struct coordinator_keys *keys, const char *folder, struct error *error)
{
    *keys = (struct coordinator_keys){0};
    enum status status = read_list(&keys->workers, folder, "workers", error);
    if (status == STATUS_OK)
        status = read_list(&keys->watchers, folder, "watchers", error);
    if (status == STATUS_OK)
        status = read_key(&keys->secret, folder, "coordinator.key", KEY_SECRET, error);
    if (status != STATUS_OK)
        coordinator_keys_finish(keys);
    return status;
}

static enum status read_client_keys(struct worker_keys *keys, const char *folder, const char *secret,
                                    struct error *error)
{
    *keys = (struct worker_keys){0};
    enum status status = read_key(&keys->coordinator, folder, "coordinator.pub", KEY_PUBLIC, error);
    if (status == STATUS_OK)
        status = read_key(&keys->secret, folder, secret, KEY_SECRET, error);
    if (status != STATUS_OK)
        worker_keys_finish(keys);
    return status;
}

enum status worker_keys_read(struct worker_keys *keys, const char *folder, struct error *error)
{
    return read_client_keys(keys, folder, "worker.key", error);
}

static bool has_file(const char *folder, const char *name)
{
    char *path = memory_format("%s/%s", folder, name);
    bool there = access(path, F_OK) == 0;
    free(path);
    return there;
}

enum status watcher_keys_read(struct worker_keys *keys, const char *folder, struct error *error)
{
    bool works = !has_file(folder, "watcher.key") && has_file(folder, "worker.key");
    return read_client_keys(keys, folder, works ? "worker.key" : "watcher.key", error);
}

void coordinator_keys_finish(struct coordinator_keys *keys)
{
    key_list_finish(&keys->workers);
    key_list_finish(&keys->watchers);
    sodium_memzero(keys, sizeof *keys);
}

void worker_keys_finish(struct worker_keys *keys)
{
    sodium_memzero(keys, sizeof *keys);
}
