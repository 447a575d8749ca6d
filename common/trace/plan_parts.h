/* Private to the plan: its larger parts. */
#ifndef WEFT_TRACE_PLAN_PARTS_H
#define WEFT_TRACE_PLAN_PARTS_H

#include "trace/plan.h"

/* Fills the plan's primitives, objects and meshes. The plan's eye and materials must be set. */
void plan_primitives_build(struct plan *plan, const struct scene *scene);

/* The texture as this object wears it, in coordinates relative to the eye. */
struct plan_texture plan_texture_compile(const struct texture *texture, const struct object *object,
                                         struct vec3 eye);

/* Halvings of an image, which must outlive them. */
void plan_image_build(struct plan_image *to, const struct image *image);
void plan_image_finish(struct plan_image *image);

#endif
