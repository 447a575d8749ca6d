/*
 * A farm's keys (CURVE, Curve25519): who is who, and who may come in. A folder holds them, as files of key_file.h:
 *
 *   coordinator.key  secret of the coordinator; only its machine has it
 *   coordinator.pub  by which workers know the coordinator
 *   worker.key       secret of a worker; each worker may have its own
 *   worker.pub       its public key
 *   watcher.key      secret of one who may only look
 *   watcher.pub      its public key
 *   workers          public keys that may join as workers
 *   watchers         public keys that may only look
 *
 * A coordinator reads coordinator.key, workers and watchers, a worker coordinator.pub and worker.key, a watcher
 * coordinator.pub and watcher.key; a worker may also look.
 */
#ifndef WEFT_WIRE_KEYS_H
#define WEFT_WIRE_KEYS_H

#include "base/error.h"
#include "wire/key_file.h"

struct coordinator_keys {
    struct key secret;
    struct key_list workers, watchers; /* a key in both is a worker's */
};

/* Of a worker, or of a watcher. */
struct worker_keys {
    struct key secret, coordinator;
};

/* Read a folder; that of a watcher worker.key where it has no watcher.key. STATUS_INPUT with a sentence about the file
 * otherwise, and *keys is all zero. What they read is to be finished, which also wipes the secrets and leaves all zero;
 * finishing that once more does no harm. */
enum status coordinator_keys_read(struct coordinator_keys *keys, const char *folder, struct error *error);
enum status worker_keys_read(struct worker_keys *keys, const char *folder, struct error *error);
enum status watcher_keys_read(struct worker_keys *keys, const char *folder, struct error *error);
void coordinator_keys_finish(struct coordinator_keys *keys);
void worker_keys_finish(struct worker_keys *keys);

/* Makes all the files of a farm in a folder, which is made (mode 0700) unless it is there. STATUS_OUTPUT if one of them
 * is there already or cannot be made; nothing is then changed. */
enum status keys_make(const char *folder, struct error *error);

/* Makes a further worker's folder, FOLDER/NAME, with worker.key, worker.pub and coordinator.pub: all that its machine
 * needs. Its public key is added to FOLDER/workers. NAME is of letters, digits, '-', '_' and '.', the first none of
 * these. STATUS_USAGE for another name; STATUS_INPUT or STATUS_OUTPUT for what is wrong with the folder, in which
 * nothing is then changed. */
enum status keys_add_worker(const char *folder, const char *name, struct error *error);

#endif
