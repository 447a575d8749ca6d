#include "scene/nff.h"
#include "scene/shares.h"

bool nff_fill_refracts(const struct nff_fill *fill)
{
    return fill->transmittance > 0 && fill->ior > 0 && fill->ior != 1;
}

static struct vec3 grey(double share)
{
    return vec3_make(share, share, share);
}

/* What passes a surface of T > 0 is multiplied by the fill's colour. */
struct material nff_fill_material(const struct nff_fill *fill, bool solid)
{
    bool glass = solid && nff_fill_refracts(fill);
    struct shares shares = {.highlight = grey(fill->specular),
                            .shininess = fmax(fill->shininess, SCENE_SMALLEST)};
    struct material material = {.filter = fill->color};
    if (glass) {
        material.ior = fill->ior;
        material.filter = vec3_scale(fill->color, fmin(fill->transmittance, 1));
    } else {
        shares.scattered = vec3_scale(fill->color, fill->diffuse);
        shares.mirrored = grey(fill->specular);
        shares.transmitted = fill->transmittance;
    }
    shares_apply(&shares, &material);
    return material;
}
