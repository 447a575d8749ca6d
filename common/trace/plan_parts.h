/* Private to the plan: its larger parts. */
#ifndef WEFT_TRACE_PLAN_PARTS_H
#define WEFT_TRACE_PLAN_PARTS_H

#include "trace/plan.h"

/* Fills the plan's primitives, objects and meshes. The plan's eye and materials must be set. */
void plan_primitives_build(struct plan *plan, const struct scene *scene);

/* Gives faces of different objects that lie in one plane, to within rounding, the same record of it, up to its sign.
 * The plan's primitives must be there; the tree must not yet. */
void plan_weld(struct plan *plan, const struct scene *scene);

/* Brings the plan's typed arrays into the order of these primitive numbers, all of them once; NULL: leaves them as they
 * are, rising. Fills plan.ids. */
void plan_order(struct plan *plan, const uint32_t *order);

/* Whether boxes around two dielectric objects overlap, where what is nearer than COINCIDENCE touches. The plan's
 * primitives must be set. */
bool plan_walls_may_touch(const struct plan *plan);

/* The texture as this object wears it, in coordinates relative to the eye. */
struct plan_texture plan_texture_compile(const struct texture *texture, const struct object *object,
                                         struct vec3 eye);

/* Halvings of an image, which must outlive them. */
void plan_image_build(struct plan_image *to, const struct image *image);
void plan_image_finish(struct plan_image *image);

#endif
