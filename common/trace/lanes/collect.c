/* What surfaces take over from their paths, hits, primitives, objects and textures. */
#include "math/elementary_lanes.h"
#include "trace/lanes.h"
#include "trace/lanes/exports.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

static void take_hits(const struct path_batch *paths, const struct hit_batch *hits, const struct surfaces *surfaces)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct path_batch from = *paths;
    const struct hit_batch hit = *hits;
    const uint32_t *path = surfaces->path;
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++) {
        double key = hit.key[path[i]], id = math_floor(0.5 * key); /* as hit_key makes it */
        s.t[i] = hit.t[path[i]];
        s.id[i] = id;
        s.side[i] = key - 2 * id;
        lane_put(s.direction, i, lane_get(from.rays.direction, path[i]));
        lane_put(s.throughput, i, lane_get(from.throughput, path[i]));
    }
}

static void take_objects(const struct plan *plan, const struct surfaces *surfaces)
{
    const struct surface_lanes s = surfaces->lanes;
    const struct plan_object *objects = plan->objects;
    const struct primitive *primitives = plan->primitives;
    const struct plan_texture *textures = plan->textures;
    const uint32_t *primitive = surfaces->primitive;
    uint32_t *index = surfaces->index, *material = surfaces->material, *texture = surfaces->texture;
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++) {
        uint32_t object = primitives[primitive[i]].object;
        index[i] = primitives[primitive[i]].index;
        material[i] = objects[object].material;
        texture[i] = objects[object].texture;
        s.leave_share[i] = objects[object].leave_share;
        s.extent[i] = objects[object].extent;
    }
    LANES_LOOP
    for (size_t i = 0; i < surfaces->count; i++) {
        s.color[0][i] = textures[texture[i]].color[0].x;
        s.color[1][i] = textures[texture[i]].color[0].y;
        s.color[2][i] = textures[texture[i]].color[0].z;
    }
}

void LANES_NAME(collect)(const struct plan *plan, const struct path_batch *paths, const struct hit_batch *hits,
                         struct surfaces *surfaces)
{
    take_hits(paths, hits, surfaces);
    take_objects(plan, surfaces);
}
