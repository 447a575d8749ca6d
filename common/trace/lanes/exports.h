/* What the files of this folder export for one instruction set: the calls of struct kernel. */
#ifndef WEFT_TRACE_LANES_EXPORTS_H
#define WEFT_TRACE_LANES_EXPORTS_H

#include "trace/kernel.h"

#define LANES_DECLARE(isa)                                                                                       \
    void camera_##isa(const struct plan *plan, const double *x, const double *y, size_t count,                   \
                      struct path_batch *paths);                                                                 \
    void closest_##isa(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits);           \
    void shadow_##isa(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,                   \
                      struct crossing_list *crossings);                                                          \
    void surface_##isa(const struct plan *plan, const struct path_batch *paths, struct surfaces *surfaces);      \
    void face_##isa(struct surfaces *surfaces);                                                                  \
    void pattern_##isa(const struct plan *plan, struct surfaces *surfaces);                                      \
    void light_##isa(const struct plan *plan, size_t light, const struct surfaces *surfaces,                     \
                     struct lighting *lighting);                                                                 \
    void mirror_##isa(const struct plan *plan, const struct path_batch *paths, const struct surfaces *surfaces,  \
                      const struct mirrored *mirrored, struct path_batch *children)

#endif
