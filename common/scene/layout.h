/*
 * How an image lies on a shape when a material does not say.
 */
#ifndef WEFT_SCENE_LAYOUT_H
#define WEFT_SCENE_LAYOUT_H

#include "scene/model.h"

struct layout {
    enum texture_map map;               /* what suits the shape best */
    struct vec3 origin, axis_u, axis_v; /* of the shape's planar map */
};

/* The map is the sphere's, the frustum's, the box's or, if it has texture coordinates, the mesh's own;
 * otherwise planar. The planar frame: a plane shows the image once a scene unit from its point on; a disc,
 * sphere or box shows it once across itself; a mesh from its first corner on, as wide and as high as its first
 * edge is long. On a plane or disc u points right and v up, seen from where the normal points; on one that is
 * nearly level u points along +x. */
struct layout shape_layout(const struct shape *shape);

#endif
