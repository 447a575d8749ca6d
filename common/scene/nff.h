/*
 * Reading a scene in Eric Haines' Neutral File Format (version 3.1), all of it; scenes/README.md says what
 * becomes of what it describes.
 */
#ifndef WEFT_SCENE_NFF_H
#define WEFT_SCENE_NFF_H

#include "scene/assets.h"
#include "scene/model.h"

/* Reads the text of the asset `name` into *scene, which is empty before and is left half filled on failure.
 * STATUS_INPUT with "FILE:LINE: …". */
enum status nff_scene_read(struct scene *scene, const char *name, struct asset_set *assets,
                           struct error *error);

/* An "f" entity, as the file has it. */
struct nff_fill {
    struct vec3 color;
    double diffuse, specular, shininess, transmittance, ior; /* Kd, Ks, Shine, T, index of refraction */
};

/* True if light is bent in solids of this fill: T > 0, and an index of refraction other than 0 and 1. */
bool nff_fill_refracts(const struct nff_fill *fill);

/* The material of surfaces, or of the surfaces of solids if `solid`; the two differ only if the fill refracts.
 */
struct material nff_fill_material(const struct nff_fill *fill, bool solid);

#endif
