/*
 * Mirror reflection, refraction and Fresnel's equations, with the change of their directions over a footprint.
 * Directions and normals are unit vectors; `normal` is on the side the light comes from: d · normal <= 0.
 */
#ifndef WEFT_TRACE_OPTICS_H
#define WEFT_TRACE_OPTICS_H

#include <stdbool.h>

#include "math/vec3.h"

struct vec3 optics_reflect(struct vec3 direction, struct vec3 normal);

/* The change of the reflected direction for changes of direction and normal (Igehy 1999, eq. 14–15). */
struct vec3 optics_reflect_change(struct vec3 direction, struct vec3 normal, struct vec3 direction_change,
                                  struct vec3 normal_change);

struct refraction {
    double eta;             /* index of the side the light comes from / of the other side */
    double cosine;          /* of the angle of incidence, 0..1 */
    double cosine_through;  /* of the angle of the refracted ray, 0..1 */
    double reflectance;     /* 0..1, unpolarised; the rest passes */
    bool total;             /* total internal reflection: reflectance 1, no refracted ray */
};

/* From the index of refraction ior_from into ior_to (Snell; Fresnel, both polarisations in equal parts). */
struct refraction optics_refraction(struct vec3 direction, struct vec3 normal, double ior_from, double ior_to);

/* The refracted direction, normalised; not for total reflection. */
struct vec3 optics_refract(const struct refraction *refraction, struct vec3 direction, struct vec3 normal);

/* Its change (Igehy 1999, eq. 16–19). */
struct vec3 optics_refract_change(const struct refraction *refraction, struct vec3 direction, struct vec3 normal,
                                  struct vec3 direction_change, struct vec3 normal_change);

#endif
