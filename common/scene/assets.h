/*
 * Assets: the files that a scene reaches (itself, its textures, its meshes, what those name in turn), each
 * with its bytes and SHA-256. Every reader asks one resolver for bytes by name: on a coordinator it reads the
 * disk, on a worker it looks among received bytes, and neither knows which.
 *
 * A name is a path relative to the scene's folder, with '/' between its parts. Names are only labels on a
 * worker: nothing there is opened by name.
 */
#ifndef WEFT_SCENE_ASSETS_H
#define WEFT_SCENE_ASSETS_H

#include <stddef.h>

#include "base/bytes.h"
#include "base/error.h"
#include "base/hash.h"

enum {
    ASSET_NAME_MAX = 1023,        /* bytes, without the NUL */
    ASSET_COUNT_MAX = 4096,       /* a scene */
    ASSET_BYTES_MAX = 1 << 30,    /* an asset */
};

struct asset {
    char *name;            /* owned */
    struct digest digest;  /* of the bytes */
    struct bytes bytes;    /* owned; a NUL that size does not count follows the data */
};

/* All zero is an empty set. The first asset is the scene file. */
struct asset_set {
    struct asset *assets;
    size_t count, capacity;
    char *folder; /* of the scene, for assets that are not yet in the set; NULL: no disk, only the set. Owned */
};

void asset_set_finish(struct asset_set *set);

/* An empty set that reads the disk for the scene at `path`; *name is the scene's own name in it (a pointer
 * into path). */
void asset_set_init_disk(struct asset_set *set, const char *path, const char **name);

/* Adds an asset with these bytes, which are moved into the set (*bytes becomes empty). The bytes must be
 * followed by a NUL that their size does not count. */
void asset_set_add(struct asset_set *set, const char *name, struct bytes *bytes);

/* The asset of that name, read from the disk first if it is not yet in the set and the set has a folder.
 * NULL with *error filled (STATUS_INPUT) if there is none. Borrowed: valid until the next call that may add. */
const struct asset *asset_set_get(struct asset_set *set, const char *name, struct error *error);

/* The asset of that name that is in the set already; NULL if none is. Borrowed likewise. */
const struct asset *asset_set_find(const struct asset_set *set, const char *name);

/* The name of a file that `from` (an asset's name) calls `reference`: relative to from's folder unless
 * absolute. Writes at most ASSET_NAME_MAX + 1 bytes; STATUS_INPUT if it is empty or too long. */
enum status asset_name_join(char *name, const char *from, const char *reference, struct error *error);

/* What sentences call an asset: its path as the user would write it, or its name where there is no folder.
 * The caller frees. */
char *asset_set_path(const struct asset_set *set, const char *name);

/* One digest over the names' contents in their order: of the scene and all it reaches. */
struct digest asset_set_digest(const struct asset_set *set);

#endif
