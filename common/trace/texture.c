#include "trace/texture.h"

#include "trace/image_filter.h"
#include "trace/texture_maps.h"
#include "trace/texture_patterns.h"

static struct image_point image_point_of(const struct plan_texture *texture, const struct texture_point *at,
                                         const struct texture_area *area, double face)
{
    switch ((enum texture_map)texture->map) {
    case MAP_SPHERE:
        return map_sphere(texture, area);
    case MAP_CYLINDER:
        return map_cylinder(texture, area);
    case MAP_PLANAR:
        return map_planar(texture, area);
    case MAP_BOX:
        return map_box(texture, area, face);
    case MAP_MESH:
        break;
    }
    return at->mesh;
}

/* Round maps go around u; flat ones that are not a box's go on everywhere. What is repeated goes on anyway. */
static struct image_edges edges_of(const struct plan_texture *texture)
{
    bool endless = texture->map == MAP_PLANAR || texture->map == MAP_MESH;
    bool round = texture->map == MAP_SPHERE || texture->map == MAP_CYLINDER;
    return (struct image_edges){endless || round || texture->repeat_u != 1, endless || texture->repeat_v != 1};
}

struct vec3 texture_image_color(const struct plan *plan, const struct plan_texture *texture,
                                const struct image_point *at, int face)
{
    return image_filter(&plan->images[texture->image[face]], at, edges_of(texture));
}

static struct vec3 image_color(const struct plan *plan, const struct plan_texture *texture,
                               const struct texture_point *at, const struct texture_area *area)
{
    double face = 0;
    if (texture->map == MAP_BOX)
        face = at->box_face >= 0 ? at->box_face : map_box_face(texture, area);
    struct image_point point = map_repeated(texture, image_point_of(texture, at, area, face));
    return texture_image_color(plan, texture, &point, (int)face);
}

struct vec3 texture_color(const struct plan *plan, const struct plan_texture *texture, const struct texture_point *at)
{
    struct texture_area area = {at->position, at->position_x, at->position_y};
    double share = 0;
    switch ((enum texture_kind)texture->kind) {
    case TEXTURE_CONSTANT:
        return texture->color[0];
    case TEXTURE_CHECKER:
        share = checker_share(texture, &area, at->flat_axis);
        break;
    case TEXTURE_STRIPES:
        share = stripes_share(texture, &area);
        break;
    case TEXTURE_GRADIENT:
        share = gradient_share(texture, &area);
        break;
    case TEXTURE_IMAGE:
        return image_color(plan, texture, at, &area);
    }
    return vec3_mix(texture->color[0], texture->color[1], share);
}

struct vec3 texture_surroundings(const struct plan_image *image, struct vec3 direction, struct vec3 direction_x,
                                 struct vec3 direction_y)
{
    struct texture_area area = {direction, direction_x, direction_y};
    struct image_point point = map_sphere_of(area);
    return image_filter(image, &point, (struct image_edges){.repeat_u = true});
}
