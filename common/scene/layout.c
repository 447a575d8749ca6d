#include "scene/layout.h"

#include <assert.h>

/* The part of `along` that is perpendicular to the unit vector n, as a unit vector. */
static struct vec3 perpendicular_part(struct vec3 along, struct vec3 n)
{
    return vec3_normalize(vec3_add_scaled(along, n, -vec3_dot(along, n)));
}

static void flat_axes(struct vec3 normal, struct vec3 *u, struct vec3 *v)
{
    const double level = 0.9; /* steeper surfaces have an up of their own */
    if (fabs(normal.y) > level) {
        *u = perpendicular_part(vec3_make(1, 0, 0), normal);
        *v = vec3_cross(normal, *u);
    } else {
        *v = perpendicular_part(vec3_make(0, 1, 0), normal);
        *u = vec3_cross(*v, normal);
    }
}

/* The square of edge 2 radius about center. */
static void set_square(struct layout *layout, struct vec3 center, double radius, struct vec3 u, struct vec3 v)
{
    layout->origin = vec3_add_scaled(vec3_add_scaled(center, u, -radius), v, -radius);
    layout->axis_u = vec3_scale(u, 2 * radius);
    layout->axis_v = vec3_scale(v, 2 * radius);
}

static void set_first_edge(struct layout *layout, const struct mesh *mesh)
{
    const uint32_t *corner = mesh->index;
    layout->origin = mesh->points[corner[0]];
    struct vec3 u = vec3_sub(mesh->points[corner[1]], layout->origin);
    struct vec3 normal = vec3_cross(u, vec3_sub(mesh->points[corner[2]], layout->origin));
    if (vec3_is_zero(normal))
        return; /* a triangle without area: keep x and y */
    layout->axis_u = u;
    layout->axis_v = vec3_cross(vec3_normalize(normal), u);
}

struct layout shape_layout(const struct shape *shape)
{
    const struct vec3 x = {1, 0, 0}, y = {0, 1, 0};
    struct layout layout = {.map = MAP_PLANAR, .axis_u = x, .axis_v = y};
    switch (shape->kind) {
    case SHAPE_SPHERE:
        layout.map = MAP_SPHERE;
        set_square(&layout, shape->sphere.center, shape->sphere.radius, x, y);
        break;
    case SHAPE_PLANE:
        layout.origin = shape->plane.point;
        flat_axes(shape->plane.normal, &layout.axis_u, &layout.axis_v);
        break;
    case SHAPE_DISC:
        flat_axes(shape->disc.normal, &layout.axis_u, &layout.axis_v);
        set_square(&layout, shape->disc.center, shape->disc.radius, layout.axis_u, layout.axis_v);
        break;
    case SHAPE_FRUSTUM:
        layout.map = MAP_CYLINDER;
        layout.origin = shape->frustum.base;
        break;
    case SHAPE_BOX:
        layout.map = MAP_BOX;
        layout.origin = shape->box.min;
        layout.axis_u.x = shape->box.max.x - shape->box.min.x;
        layout.axis_v.y = shape->box.max.y - shape->box.min.y;
        break;
    case SHAPE_MESH:
        if (shape->mesh.uv)
            layout.map = MAP_MESH;
        set_first_edge(&layout, &shape->mesh);
        break;
    case SHAPE_KINDS:
        assert(!"a shape");
    }
    return layout;
}
