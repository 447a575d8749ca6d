/* Private to textures: looking up a halved image over a footprint. */
#ifndef WEFT_TRACE_IMAGE_FILTER_H
#define WEFT_TRACE_IMAGE_FILTER_H

#include <stdbool.h>

#include "trace/plan.h"

/* Where in an image: u to the right and v downwards, 1 being its width and height, and the footprint's two
 * edges in the same units. */
struct image_point {
    double u, v;
    double u_x, v_x, u_y, v_y;
};

/* Beyond the edge: the image again, or its outermost texels. */
struct image_edges {
    bool repeat_u, repeat_v;
};

struct vec3 image_filter(const struct plan_image *image, const struct image_point *point, struct image_edges edges);

#endif
