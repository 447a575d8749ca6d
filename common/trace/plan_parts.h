/* Private to the plan: its larger parts. */
#ifndef WEFT_TRACE_PLAN_PARTS_H
#define WEFT_TRACE_PLAN_PARTS_H

#include "trace/plan.h"

/* plan_create, with instances of each mesh that several objects wear if they have at least `least` triangles together:
 * for tests. With any number it makes the same picture. */
struct plan *plan_create_sharing(const struct scene *scene, const struct trace_settings *settings, int threads,
                                 size_t least);

#define MESH_NONE UINT32_MAX
#define MESH_COPIED (UINT32_MAX - 1)

/* Fills plan->shared_meshes with what plan_create_sharing says. Returns, for the caller to free, of each object the
 * place of its mesh there, MESH_COPIED if it is not there though others share it, or MESH_NONE. The plan's eye must be
 * set. */
uint32_t *plan_share_meshes(struct plan *plan, const struct scene *scene, size_t least, int threads);

/* Fills the plan's primitives, objects and meshes, and frees `shared`, which plan_share_meshes made. The plan's eye and
 * materials must be set. */
void plan_primitives_build(struct plan *plan, const struct scene *scene, uint32_t *shared);

/* One behind the last id of an object's primitives and, of an instance, triangles; the first is its first primitive's.
 * The plan's primitives must be there. */
size_t plan_end_id(const struct plan *plan, size_t object);

/* Gives faces of different objects that lie in one plane, to within rounding, the same record of it, up to its sign; of
 * shared meshes, those that plan_touching finds. The plan's primitives must be there; the tree must not yet. */
void plan_weld(struct plan *plan, const struct scene *scene);

/* The ids, rising and for the caller to free, of triangles of objects that share their meshes and touch others. The
 * plan's primitives must be there; the tree must not yet. */
uint32_t *plan_touching(const struct plan *plan, size_t *count);

/* Brings the plan's typed arrays into the order of these `count` primitives' numbers; NULL: leaves them as they are,
 * rising. What comes more than once gets as many copies, which plan.count does not count; any of them is as good as
 * another. Behind its last element each array that is moved has BVH_LEAF_MAX − 1 more that may be read. Fills plan.ids.
 */
void plan_order(struct plan *plan, const uint32_t *order, size_t count);

/* Fills the plan's lights with those of the scene that add something to some surface, in their order. The plan's
 * primitives, objects and materials must be there. */
void plan_lights_build(struct plan *plan, const struct scene *scene);

/* A light as the plan keeps it. */
struct plan_light plan_light_compile(const struct light *light, struct vec3 eye);

/* Fills the plan's contacts: where the boxes of two dielectric objects overlap, if what is nearer than COINCIDENCE
 * touches. If there are too many, one box around all space. The plan's primitives must be set. */
void plan_contacts_find(struct plan *plan);

/* The texture as this object wears it, in coordinates relative to the eye. */
struct plan_texture plan_texture_compile(const struct texture *texture, const struct object *object,
                                         struct vec3 eye);

/* Halvings of an image, which must outlive them. */
void plan_image_build(struct plan_image *to, const struct image *image);
void plan_image_finish(struct plan_image *image);

#endif
