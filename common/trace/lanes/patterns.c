/* Textures on surfaces: shares of patterns, and where in images. */
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
#include "trace/texture_maps.h"
#include "trace/texture_patterns.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* Surfaces patterned->surface[first .. end − 1] wear one texture. The footprint is a point where the plan needs none:
 * `spread` is 0. */
#define DEFINE_PATTERN(name, share_of)                                                                       \
    static void find_##name(const struct plan_texture *from, const struct surface_lanes *lanes,              \
                            const struct patterned *patterned, size_t first, size_t end)                     \
    {                                                                                                        \
        const struct surface_lanes s = *lanes;                                                               \
        const struct plan_texture copy = *from, *texture = &copy;                                            \
        const uint32_t *surface = patterned->surface;                                                        \
        const double *flat_axis = patterned->flat_axis;                                                      \
        double *share = patterned->share;                                                                    \
        LANES_LOOP                                                                                           \
        for (size_t i = first; i < end; i++) {                                                               \
            struct texture_area area = {lane_get(s.middle, surface[i]), lane_get(s.spread[0], surface[i]),   \
                                        lane_get(s.spread[1], surface[i])};                                  \
            double flat = flat_axis[i];                                                                      \
            (void)flat;                                                                                      \
            share[i] = share_of;                                                                             \
        }                                                                                                    \
    }

DEFINE_PATTERN(checker, checker_share(texture, &area, flat))
DEFINE_PATTERN(stripes, stripes_share(texture, &area))
DEFINE_PATTERN(gradient, gradient_share(texture, &area))

typedef void find(const struct plan_texture *texture, const struct surface_lanes *lanes,
                  const struct patterned *patterned, size_t first, size_t end);

static find *const finders[TEXTURE_IMAGE] = {
    [TEXTURE_CHECKER] = find_checker, [TEXTURE_STRIPES] = find_stripes, [TEXTURE_GRADIENT] = find_gradient};

/* The end of the run of surfaces from `first` on that wear one texture: neighbours mostly do. */
static size_t run_end(const uint32_t *texture, size_t first, size_t count)
{
    size_t end = first;
    while (end < count && texture[end] == texture[first])
        end++;
    return end;
}

static void find_patterns(const struct plan *plan, struct surfaces *surfaces)
{
    for (int kind = TEXTURE_CHECKER; kind < TEXTURE_IMAGE; kind++) {
        const struct patterned *patterned = &surfaces->patterned[kind];
        for (size_t first = 0, end; first < patterned->count; first = end) {
            end = run_end(patterned->texture, first, patterned->count);
            finders[kind](&plan->textures[patterned->texture[first]], &surfaces->lanes, patterned, first, end);
        }
    }
}

/* --- images ----------------------------------------------------------------------------------------------- */

static inline void put_point(double *const point[6], size_t i, struct image_point at)
{
    point[0][i] = at.u;
    point[1][i] = at.v;
    point[2][i] = at.u_x;
    point[3][i] = at.v_x;
    point[4][i] = at.u_y;
    point[5][i] = at.v_y;
}

/* Surfaces imaged->surface[first .. end − 1] wear one texture, whose map is of that name. */
#define DEFINE_MAP(name, chosen_face, point_of)                                                              \
    static void map_by_##name(const struct plan_texture *from, const struct surface_lanes *lanes,            \
                              const struct imaged *imaged, size_t first, size_t end)                         \
    {                                                                                                        \
        const struct surface_lanes s = *lanes;                                                               \
        const struct plan_texture copy = *from, *texture = &copy;                                            \
        const struct imaged to = *imaged;                                                                    \
        LANES_LOOP                                                                                           \
        for (size_t i = first; i < end; i++) {                                                               \
            struct texture_area all = {lane_get(s.middle, to.surface[i]), lane_get(s.spread[0], to.surface[i]), \
                                       lane_get(s.spread[1], to.surface[i])}, *area = &all;                  \
            double given = to.face[i], chosen = chosen_face, face = given < 0 ? chosen : given;              \
            to.face[i] = face;                                                                               \
            put_point(to.point, i, map_repeated(texture, point_of));                                         \
        }                                                                                                    \
    }

DEFINE_MAP(sphere, 0, map_sphere(texture, area))
DEFINE_MAP(cylinder, 0, map_cylinder(texture, area))
DEFINE_MAP(plane, 0, map_planar(texture, area))
DEFINE_MAP(box, map_box_face(texture, area), map_box(texture, area, face))

static void find_image_points(const struct plan *plan, const struct surfaces *surfaces)
{
    const struct imaged *imaged = &surfaces->imaged;
    for (size_t first = 0, end; first < imaged->count; first = end) {
        const struct plan_texture *texture = &plan->textures[imaged->texture[first]];
        end = run_end(imaged->texture, first, imaged->count);
        switch ((enum texture_map)texture->map) {
        case MAP_SPHERE:
            map_by_sphere(texture, &surfaces->lanes, imaged, first, end);
            break;
        case MAP_CYLINDER:
            map_by_cylinder(texture, &surfaces->lanes, imaged, first, end);
            break;
        case MAP_PLANAR:
            map_by_plane(texture, &surfaces->lanes, imaged, first, end);
            break;
        case MAP_BOX:
            map_by_box(texture, &surfaces->lanes, imaged, first, end);
            break;
        case MAP_MESH:
            break;
        }
    }
}

void LANES_NAME(pattern)(const struct plan *plan, struct surfaces *surfaces)
{
    find_patterns(plan, surfaces);
    find_image_points(plan, surfaces);
}
