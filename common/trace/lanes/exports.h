/* What the files of this folder export for one instruction set: the calls of struct kernel. */
#ifndef WEFT_TRACE_LANES_EXPORTS_H
#define WEFT_TRACE_LANES_EXPORTS_H

#include "trace/kernel.h"

#define LANES_DECLARE(isa)                                                                               \
    void closest_##isa(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits);   \
    void shadow_##isa(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,           \
                      struct crossing_list *crossings)

#endif
