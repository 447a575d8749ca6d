/*
 * Mirror reflection, refraction and Fresnel's equations, with the change of their directions over a footprint.
 * Directions and normals are unit vectors; `normal` is on the side the light comes from: d · normal <= 0.
 *
 * For one ray and for lanes of rays: inline functions of doubles, without branches, as intersect.h says.
 */
#ifndef WEFT_TRACE_OPTICS_H
#define WEFT_TRACE_OPTICS_H

#include <math.h>

#include "math/vec3.h"

/* --- reflection ------------------------------------------------------------------------------------------- */

static inline struct vec3 optics_reflect(struct vec3 direction, struct vec3 normal)
{
    return vec3_normalize(vec3_add_scaled(direction, normal, -2 * vec3_dot(direction, normal)));
}

/* The change of the reflected direction for changes of direction and normal (Igehy 1999, eq. 14–15). */
static inline struct vec3 optics_reflect_change(struct vec3 direction, struct vec3 normal,
                                                struct vec3 direction_change, struct vec3 normal_change)
{
    double cosine = vec3_dot(direction, normal);
    double cosine_change = vec3_dot(direction_change, normal) + vec3_dot(direction, normal_change);
    struct vec3 turned = vec3_add(vec3_scale(normal_change, cosine), vec3_scale(normal, cosine_change));
    return vec3_add_scaled(direction_change, turned, -2);
}

/* --- refraction ------------------------------------------------------------------------------------------- */

struct refraction {
    double eta;            /* index of the side the light comes from / of the other side */
    double cosine;         /* of the angle of incidence, 0..1 */
    double cosine_through; /* of the angle of the refracted ray, 0..1 */
    double reflectance;    /* 0..1, unpolarised; the rest passes */
    double total;          /* 1 for total internal reflection: reflectance 1, no refracted ray; else 0 */
};

/* From the index of refraction ior_from into ior_to (Snell; Fresnel, both polarisations in equal parts).
 *
 * Total reflection needs no case of its own: where cosine_through is 0, Fresnel's equations give 1. */
static inline struct refraction optics_refraction(struct vec3 direction, struct vec3 normal, double ior_from,
                                                  double ior_to)
{
    double eta = ior_from / ior_to, cosine = -vec3_dot(direction, normal);
    cosine = cosine < 0 ? 0 : cosine;
    cosine = cosine > 1 ? 1 : cosine;
    double square = 1 - eta * eta * (1 - cosine * cosine);
    double cosine_through = sqrt(square < 0 ? 0 : square);
    double from = ior_from * cosine, to = ior_to * cosine_through;
    double from_crossed = ior_from * cosine_through, to_crossed = ior_to * cosine;
    double perpendicular = (from - to) / (from + to);
    double parallel = (to_crossed - from_crossed) / (to_crossed + from_crossed);
    double reflectance = 0.5 * (perpendicular * perpendicular + parallel * parallel);
    return (struct refraction){
        .eta = eta,
        .cosine = cosine,
        .cosine_through = cosine_through,
        .reflectance = from + to == 0 ? 1 : reflectance, /* along the surface, and 0/0 */
        .total = square < 0 ? 1 : 0,
    };
}

/* How much of the normal the refracted direction holds: d' = eta d − mu normal. */
static inline double optics_normal_share(const struct refraction *r)
{
    return r->cosine_through - r->eta * r->cosine;
}

/* The refracted direction, normalised; not for total reflection. */
static inline struct vec3 optics_refract(const struct refraction *refraction, struct vec3 direction,
                                         struct vec3 normal)
{
    struct vec3 slowed = vec3_scale(direction, refraction->eta);
    return vec3_normalize(vec3_add_scaled(slowed, normal, -optics_normal_share(refraction)));
}

/* Its change (Igehy 1999, eq. 16–19): mu = cosine_through − eta cosine, and
 * cosine_through² = 1 − eta² (1 − cosine²). */
static inline struct vec3 optics_refract_change(const struct refraction *refraction, struct vec3 direction,
                                                struct vec3 normal, struct vec3 direction_change,
                                                struct vec3 normal_change)
{
    double eta = refraction->eta, through = refraction->cosine_through;
    double cosine_change = -(vec3_dot(direction_change, normal) + vec3_dot(direction, normal_change));
    double ratio = refraction->cosine / through;
    ratio = through > 0 ? ratio : 0;
    double share_change = (eta * eta * ratio - eta) * cosine_change;
    struct vec3 change = vec3_scale(direction_change, eta);
    change = vec3_add_scaled(change, normal_change, -optics_normal_share(refraction));
    return vec3_add_scaled(change, normal, -share_change);
}

#endif
