/*
 * The colour of a texture at a point, filtered over the footprint that the ray covers there.
 */
#ifndef WEFT_TRACE_TEXTURE_H
#define WEFT_TRACE_TEXTURE_H

#include "trace/image_filter.h"
#include "trace/plan.h"

/* Where a texture is looked up, in coordinates relative to the camera. */
struct texture_point {
    struct vec3 position;
    struct vec3 position_x, position_y; /* how it moves over the footprint: its two edges; zero for a point */
    int8_t flat_axis;                   /* the object coordinate that is constant here, 0..2, or −1 */
    int8_t box_face;                    /* 0..5 on a box, else −1 */
    struct image_point mesh;            /* MAP_MESH only: as map_mesh says */
};

/* Linear light, within the range of the texture's own colours. */
struct vec3 texture_color(const struct plan *plan, const struct plan_texture *texture,
                          const struct texture_point *point);

/* That of an image texture at a point of its image, as the map and map_repeated give it; face: of a box's map, else
 * 0. */
struct vec3 texture_image_color(const struct plan *plan, const struct plan_texture *texture,
                                const struct image_point *at, int face);

/* An image all around, seen along the unit vector `direction`, which moves by direction_x and direction_y over
 * the footprint. */
struct vec3 texture_surroundings(const struct plan_image *image, struct vec3 direction, struct vec3 direction_x,
                                 struct vec3 direction_y);

#endif
