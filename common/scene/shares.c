#include "scene/shares.h"

static struct vec3 at_most_one(struct vec3 v)
{
    return vec3_make(fmin(v.x, 1), fmin(v.y, 1), fmin(v.z, 1));
}

/* The model scatters diffuse × colour of what is neither mirrored nor transmitted. */
static void set_scattering(struct material *material, struct vec3 scattered)
{
    double through = material->transparency;
    struct vec3 left = vec3_make(1 - through - material->reflection.x, 1 - through - material->reflection.y,
                                 1 - through - material->reflection.z);
    struct vec3 share = vec3_make(left.x > 0 ? scattered.x / left.x : 0, left.y > 0 ? scattered.y / left.y : 0,
                                  left.z > 0 ? scattered.z / left.z : 0);
    double most = vec3_max(share);
    material->diffuse = fmin(most, 1);
    material->color = (struct texture){.kind = TEXTURE_CONSTANT};
    if (most > 0)
        material->color.color[0] = at_most_one(vec3_scale(share, 1 / most));
}

static void limit_highlight(struct material *material)
{
    double given_back = material->diffuse + 2 * vec3_max(material->specular) / (material->shininess + 2);
    if (vec3_max(material->reflection) > 0 || given_back <= 1)
        return;
    material->diffuse /= given_back;
    material->specular = vec3_scale(material->specular, 1 / given_back);
}

void shares_apply(const struct shares *shares, struct material *material)
{
    double sum = vec3_max(shares->scattered) + vec3_max(shares->mirrored) + shares->transmitted;
    double scale = sum > 1 ? 1 / sum : 1;
    material->reflection = vec3_scale(shares->mirrored, scale);
    material->transparency = fmin(shares->transmitted * scale, 1 - vec3_max(material->reflection));
    material->specular = at_most_one(shares->highlight);
    material->shininess = shares->shininess;
    set_scattering(material, vec3_scale(shares->scattered, scale));
    limit_highlight(material);
}
