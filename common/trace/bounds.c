#include "trace/bounds.h"

#include <math.h>

#include "trace/instance.h"

static struct bounds around(struct vec3 center, struct vec3 half)
{
    return (struct bounds){vec3_sub(center, half), vec3_add(center, half)};
}

static struct bounds sphere_bounds(const struct sphere *sphere)
{
    return around(sphere->center, vec3_make(sphere->radius, sphere->radius, sphere->radius));
}

/* The image of the unit ball under a matrix reaches as far along an axis as that row is long. */
static struct bounds ellipsoid_bounds(const struct ellipsoid *ellipsoid)
{
    struct mat3 m = mat3_inverse(&ellipsoid->frame);
    return around(ellipsoid->center, vec3_make(vec3_length(m.x), vec3_length(m.y), vec3_length(m.z)));
}

/* The disc's edge is center + a cos φ + b sin φ, where a and b are dual to u and v within the plane. */
static struct bounds disc_bounds(const struct disc *disc)
{
    struct vec3 a = vec3_cross(disc->v, disc->plane.normal), b = vec3_cross(disc->plane.normal, disc->u);
    a = vec3_scale(a, 1 / vec3_dot(disc->u, a));
    b = vec3_scale(b, 1 / vec3_dot(disc->v, b));
    return around(disc->center, vec3_make(sqrt(a.x * a.x + b.x * b.x), sqrt(a.y * a.y + b.y * b.y),
                                          sqrt(a.z * a.z + b.z * b.z)));
}

/* One end: a disc of that radius across the axis at height z. Rows of m take the frame to the world. */
static struct bounds frustum_end(const struct frustum *frustum, const struct mat3 *m, double z, double radius)
{
    struct vec3 center = vec3_add(frustum->origin, vec3_make(m->x.z * z, m->y.z * z, m->z.z * z));
    return around(center, vec3_make(radius * sqrt(m->x.x * m->x.x + m->x.y * m->x.y),
                                    radius * sqrt(m->y.x * m->y.x + m->y.y * m->y.y),
                                    radius * sqrt(m->z.x * m->z.x + m->z.y * m->z.y)));
}

static struct bounds frustum_bounds(const struct frustum *frustum)
{
    struct mat3 m = mat3_inverse(&frustum->frame);
    struct bounds narrow = frustum_end(frustum, &m, 0, frustum->radius);
    struct bounds wide = frustum_end(frustum, &m, frustum->height, frustum->radius + frustum->slope * frustum->height);
    return bounds_join(&narrow, &wide);
}

static double reach(struct vec3 row, struct vec3 half)
{
    return fabs(row.x) * half.x + fabs(row.y) * half.y + fabs(row.z) * half.z;
}

static struct bounds box_bounds(const struct box *box)
{
    struct mat3 m = mat3_inverse(&box->frame);
    struct vec3 center = vec3_mix(box->low, box->high, 0.5), half = vec3_scale(vec3_sub(box->high, box->low), 0.5);
    return around(mat3_apply(&m, center), vec3_make(reach(m.x, half), reach(m.y, half), reach(m.z, half)));
}

struct bounds bounds_of_triangle(const struct triangle *triangle)
{
    struct bounds a = {triangle->a, triangle->a}, b = {triangle->b, triangle->b}, c = {triangle->c, triangle->c};
    struct bounds ab = bounds_join(&a, &b);
    return bounds_join(&ab, &c);
}

bool bounds_of_primitive(const struct plan *plan, uint32_t number, struct bounds *bounds)
{
    uint32_t index = plan->primitives[number].index;
    switch ((enum primitive_kind)plan->primitives[number].kind) {
    case PRIMITIVE_SPHERE:
        *bounds = sphere_bounds(&plan->spheres[index]);
        return true;
    case PRIMITIVE_GLOBE:
        *bounds = sphere_bounds(&plan->globes[index].sphere);
        return true;
    case PRIMITIVE_ELLIPSOID:
        *bounds = ellipsoid_bounds(&plan->ellipsoids[index]);
        return true;
    case PRIMITIVE_DISC:
        *bounds = disc_bounds(&plan->discs[index]);
        return true;
    case PRIMITIVE_FRUSTUM:
        *bounds = frustum_bounds(&plan->frustums[index]);
        return true;
    case PRIMITIVE_BOX:
        *bounds = box_bounds(&plan->boxes[index]);
        return true;
    case PRIMITIVE_TRIANGLE:
        *bounds = bounds_of_triangle(&plan->triangles[index]);
        return true;
    case PRIMITIVE_INSTANCE:
        *bounds = plan->instances[index].bounds;
        return true;
    default:
        return false;
    }
}

bool bounds_of_object(const struct plan *plan, size_t object, struct bounds *bounds)
{
    size_t end = object + 1 < plan->object_count ? plan->objects[object + 1].first_primitive : plan->primitive_count;
    size_t first = plan->objects[object].first_primitive;
    struct bounds one;
    for (size_t number = first; number < end; number++) {
        if (!bounds_of_primitive(plan, (uint32_t)number, &one))
            return false;
        *bounds = number == first ? one : bounds_join(bounds, &one);
    }
    return true;
}
