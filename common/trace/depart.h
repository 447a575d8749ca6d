/* How rays depart from surfaces: inline functions of doubles, without branches, as intersect.h says. */
#ifndef WEFT_TRACE_DEPART_H
#define WEFT_TRACE_DEPART_H

#include <math.h>

#include "trace/optics.h"
#include "trace/plan.h"

/* The least t of a ray along the unit vector `direction` that starts on a surface, known to within `error`: surfaces
 * that coincide with this one are not met. */
static inline double depart_t_min(struct vec3 position, double error, struct vec3 normal, struct vec3 direction)
{
    double cosine = fabs(vec3_dot(direction, normal)), along = error / cosine;
    return (cosine > 0 ? along : error) + COINCIDENCE * vec3_max_abs(position);
}

/* The largest t of such a ray to a light at that distance (INFINITY: from afar). A surface with the light on it is not
 * met. */
static inline double depart_t_max(double t_min, double distance)
{
    return distance * (1 - COINCIDENCE) - t_min;
}

/* A mirrored direction: about the shading normal, or about the geometric one where that would send it into the
 * surface. Both normals are on the side that `incoming` comes from. */
struct mirroring {
    struct vec3 direction, normal;
};

static inline struct mirroring depart_mirrored(struct vec3 incoming, struct vec3 shading_normal, struct vec3 facing)
{
    struct vec3 smooth = optics_reflect(incoming, shading_normal), flat = optics_reflect(incoming, facing);
    double out = vec3_dot(smooth, facing) > 0 ? 1 : 0;
    return (struct mirroring){vec3_choose(out, smooth, flat), vec3_choose(out, shading_normal, facing)};
}

/* A refraction, and the normal that it is about: the shading normal, or the geometric one where that would leave the
 * ray on its side. Both normals are on the side that `incoming` comes from. */
struct bending {
    struct refraction refraction;
    struct vec3 normal;
};

static inline struct bending depart_refracted(struct vec3 incoming, struct vec3 shading_normal, struct vec3 facing,
                                              double ior_here, double ior_beyond)
{
    struct refraction smooth = optics_refraction(incoming, shading_normal, ior_here, ior_beyond);
    double ahead = vec3_dot(optics_refract(&smooth, incoming, shading_normal), facing);
    ahead = smooth.total > 0 ? -1 : ahead;
    struct vec3 normal = vec3_choose(ahead < 0 ? 1 : 0, shading_normal, facing);
    return (struct bending){optics_refraction(incoming, normal, ior_here, ior_beyond), normal};
}

#endif
