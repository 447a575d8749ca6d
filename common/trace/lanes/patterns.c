/* Procedural textures on surfaces. */
#include "trace/lanes.h"
#include "trace/lanes/exports.h"
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
            struct texture_area area = {lane_get(s.position, surface[i]), lane_get(s.spread[0], surface[i]), \
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

/* Texture by texture: neighbours mostly wear the same. */
void LANES_NAME(pattern)(const struct plan *plan, struct surfaces *surfaces)
{
    for (int kind = TEXTURE_CHECKER; kind < TEXTURE_IMAGE; kind++) {
        const struct patterned *patterned = &surfaces->patterned[kind];
        for (size_t first = 0, end; first < patterned->count; first = end) {
            uint32_t texture = patterned->texture[first];
            for (end = first; end < patterned->count && patterned->texture[end] == texture; end++)
                continue;
            finders[kind](&plan->textures[texture], &surfaces->lanes, patterned, first, end);
        }
    }
}
