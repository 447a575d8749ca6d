#include <stdlib.h>

#include "scene/images.h"
#include "scene/mtl.h"
#include "scene/shares.h"

/* The illumination models: highlights from 2 on, a mirror from 3 to 7, refraction in 6 and 7. */
static bool is_mirror(const struct mtl_entry *entry)
{
    return entry->illumination >= 3 && entry->illumination <= 7;
}

static bool refracts(const struct mtl_entry *entry, const struct mesh *mesh)
{
    bool wanted = entry->illumination == 6 || entry->illumination == 7;
    return wanted && entry->ior > 0 && entry->ior != 1 && mesh->closed;
}

static void set_surface(const struct mtl_entry *entry, bool glass, struct material *material)
{
    double opaque = glass ? 0 : entry->opacity;
    struct shares shares = {
        .scattered = vec3_scale(entry->scattered, opaque),
        .transmitted = glass ? 0 : 1 - opaque,
        .shininess = entry->shininess,
    };
    if (entry->illumination >= 2)
        shares.highlight = entry->specular;
    if (is_mirror(entry))
        shares.mirrored = vec3_scale(entry->specular, opaque);
    *material = (struct material){.filter = entry->filter, .ior = glass ? entry->ior : 0};
    shares_apply(&shares, material);
    material->ambient = 0.1 * material->diffuse; /* of Kd, then, as color × diffuse is */
}

static enum status set_image(const struct mtl *mtl, const struct mtl_entry *entry, struct scene *scene,
                             struct asset_set *assets, struct texture *texture, struct error *error)
{
    size_t image = 0;
    const char *library = mtl->libraries[entry->library];
    enum status status = scene_image_use(scene, assets, library, entry->map, &image, error);
    if (status != STATUS_OK) {
        char *path = asset_set_path(assets, library);
        error_prefix(error, status, "%s:%zu: ", path, entry->line);
        free(path);
        return status;
    }
    *texture = (struct texture){
        .kind = TEXTURE_IMAGE,
        .map = MAP_MESH,
        .repeat_u = entry->repeat[0],
        .repeat_v = entry->repeat[1],
    };
    for (int i = 0; i < BOX_FACES; i++)
        texture->image[i] = image;
    return STATUS_OK;
}

enum status mtl_material(const struct mtl *mtl, const struct mtl_entry *entry, const struct mesh *mesh,
                         struct scene *scene, struct asset_set *assets, struct material *material,
                         struct error *error)
{
    bool glass = refracts(entry, mesh);
    set_surface(entry, glass, material);
    if (glass || !entry->map || !mesh->uv)
        return STATUS_OK;
    return set_image(mtl, entry, scene, assets, &material->color, error);
}
