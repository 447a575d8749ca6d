/* What the files of this folder export for one instruction set: the calls of struct kernel. */
#ifndef WEFT_TRACE_LANES_EXPORTS_H
#define WEFT_TRACE_LANES_EXPORTS_H

#include "trace/kernel.h"

#define LANES_DECLARE(isa)                                                                                       \
    void camera_##isa(const struct plan *plan, const struct camera_rays *rays, struct path_batch *paths);        \
    void closest_##isa(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits);           \
    void collect_##isa(const struct plan *plan, const struct path_batch *paths, const struct hit_batch *hits,    \
                       struct surfaces *surfaces);                                                               \
    void surface_##isa(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces);      \
    void face_##isa(struct surfaces *surfaces);                                                                  \
    void pattern_##isa(const struct plan *plan, struct surfaces *surfaces);                                      \
    void ambient_##isa(const struct plan *plan, struct surfaces *surfaces);                                      \
    void light_##isa(const struct plan *plan, size_t light, const struct surfaces *surfaces,                     \
                     struct lighting *lighting);                                                                 \
    void shadow_rays_##isa(const struct surfaces *surfaces, const struct lighting *lighting,                     \
                           struct shadow_batch *shadows);                                                        \
    void shadow_##isa(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,                   \
                      struct crossing_list *crossings);                                                          \
    void add_light_##isa(const struct lighting *lighting, struct surfaces *surfaces);                            \
    void find_##isa(const struct plan *plan, const struct surfaces *surfaces, struct path_batch *paths);         \
    void refract_##isa(const struct plan *plan, const struct surfaces *surfaces, struct transmitted *transmitted); \
    void mirror_##isa(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,  \
                      const struct mirrored *mirrored, struct path_batch *children);                             \
    void transmit_##isa(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces, \
                        const struct transmitted *transmitted, struct path_batch *children)

/* All of them but closest and shadow, as members of a struct kernel. */
#define LANES_STAGES(isa)                                                                                        \
    .camera = camera_##isa, .collect = collect_##isa, .surface = surface_##isa, .face = face_##isa,              \
    .pattern = pattern_##isa, .ambient = ambient_##isa, .light = light_##isa, .shadow_rays = shadow_rays_##isa,  \
    .add_light = add_light_##isa, .find = find_##isa, .refract = refract_##isa, .mirror = mirror_##isa,        \
    .transmit = transmit_##isa

#endif
