/*
 * Material files (.mtl) of Wavefront meshes.
 *
 * Read: newmtl, Kd, Ks, Ns, d, Tr, Ni, Tf, illum, map_Kd. Everything else is passed over: Ka too, because
 * programs write 0 or 1 there whatever they mean (the ambient share is that of a JSON material without one),
 * and all other maps. scenes/README.md says what becomes of each.
 */
#ifndef WEFT_SCENE_MTL_H
#define WEFT_SCENE_MTL_H

#include "base/error.h"
#include "scene/assets.h"
#include "scene/model.h"

struct mtl_entry {
    char *name;     /* owned */
    char *map;      /* map_Kd's file as the .mtl names it; NULL: none. Owned */
    size_t place;   /* among all that were read */
    size_t library; /* index of the file that it stands in */
    size_t line;    /* of map_Kd */
    struct vec3 scattered, specular, filter;
    double shininess, opacity, ior;
    double repeat[2];
    int64_t illumination;
};

/* The materials of one or more files. All zero is an empty one. */
struct mtl {
    struct mtl_entry *entries; /* as read; once sorted, by name */
    size_t count, capacity;
    char **libraries; /* the files' names among the assets; owned */
    size_t library_count, library_capacity;
};

void mtl_finish(struct mtl *mtl);

/* Adds the materials of the asset `name`. STATUS_INPUT and "FILE:LINE: …" if it is broken. */
enum status mtl_read(struct mtl *mtl, struct asset_set *assets, const char *name, struct error *error);

/* After the last file: makes the entries ready for mtl_find. Of several with one name the first one counts. */
void mtl_sort(struct mtl *mtl);
const struct mtl_entry *mtl_find(const struct mtl *mtl, const char *name);

/* The material as this mesh wears it: refracting if the mesh is closed, with the image if it has uv. Reads the
 * image through `assets` at its first use. */
enum status mtl_material(const struct mtl *mtl, const struct mtl_entry *entry, const struct mesh *mesh,
                         struct scene *scene, struct asset_set *assets, struct material *material,
                         struct error *error);

#endif
