/*
 * Materials of other formats, which name shares of the light that need not add up to 1 or less.
 */
#ifndef WEFT_SCENE_SHARES_H
#define WEFT_SCENE_SHARES_H

#include "scene/model.h"

/* What a surface does with the light that meets it, each >= 0. */
struct shares {
    struct vec3 scattered; /* Lambert */
    struct vec3 mirrored;
    double transmitted;    /* straight on */
    struct vec3 highlight; /* Phong's lobe, its height */
    double shininess;      /* > 0 */
};

/* Sets color (a constant), diffuse, reflection, transparency, specular and shininess so that the surface does
 * that, after two rules that keep it from giving back more than it gets:
 *
 * - Where the largest channels of scattered and mirrored and transmitted add up to more than 1, all three are
 * divided by their sum.
 * - The highlight is cut to 1. On what is no mirror, where diffuse + 2 highlight / (shininess + 2) is more than
 * 1, both are divided by it (scenes/README.md has the reason).
 *
 * `color` is as bright as it can be and `diffuse` the rest of the product, so that an image can take color's
 * place. */
void shares_apply(const struct shares *shares, struct material *material);

#endif
