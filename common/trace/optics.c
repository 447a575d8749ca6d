#include "trace/optics.h"

#include <math.h>

struct vec3 optics_reflect(struct vec3 direction, struct vec3 normal)
{
    return vec3_normalize(vec3_add_scaled(direction, normal, -2 * vec3_dot(direction, normal)));
}

struct vec3 optics_reflect_change(struct vec3 direction, struct vec3 normal, struct vec3 direction_change,
                                  struct vec3 normal_change)
{
    double cosine = vec3_dot(direction, normal);
    double cosine_change = vec3_dot(direction_change, normal) + vec3_dot(direction, normal_change);
    struct vec3 turned = vec3_add(vec3_scale(normal_change, cosine), vec3_scale(normal, cosine_change));
    return vec3_add_scaled(direction_change, turned, -2);
}

struct refraction optics_refraction(struct vec3 direction, struct vec3 normal, double ior_from, double ior_to)
{
    struct refraction r = {.eta = ior_from / ior_to};
    double cosine = -vec3_dot(direction, normal);
    r.cosine = cosine < 0 ? 0 : cosine > 1 ? 1 : cosine;
    double square = 1 - r.eta * r.eta * (1 - r.cosine * r.cosine);
    r.total = square < 0;
    if (r.total) {
        r.reflectance = 1;
        return r;
    }
    r.cosine_through = sqrt(square);
    double from = ior_from * r.cosine, to = ior_to * r.cosine_through;
    double from_crossed = ior_from * r.cosine_through, to_crossed = ior_to * r.cosine;
    if (from + to == 0) { /* along the surface */
        r.reflectance = 1;
        return r;
    }
    double perpendicular = (from - to) / (from + to);
    double parallel = (to_crossed - from_crossed) / (to_crossed + from_crossed);
    r.reflectance = 0.5 * (perpendicular * perpendicular + parallel * parallel);
    return r;
}

/* How much of the normal the refracted direction holds: d' = eta d − mu normal. */
static double normal_share(const struct refraction *r)
{
    return r->cosine_through - r->eta * r->cosine;
}

struct vec3 optics_refract(const struct refraction *r, struct vec3 direction, struct vec3 normal)
{
    return vec3_normalize(vec3_add_scaled(vec3_scale(direction, r->eta), normal, -normal_share(r)));
}

struct vec3 optics_refract_change(const struct refraction *r, struct vec3 direction, struct vec3 normal,
                                  struct vec3 direction_change, struct vec3 normal_change)
{
    /* mu = cosine_through − eta cosine, and cosine_through² = 1 − eta² (1 − cosine²). */
    double cosine_change = -(vec3_dot(direction_change, normal) + vec3_dot(direction, normal_change));
    double ratio = r->cosine_through > 0 ? r->cosine / r->cosine_through : 0;
    double share_change = (r->eta * r->eta * ratio - r->eta) * cosine_change;
    struct vec3 change = vec3_scale(direction_change, r->eta);
    change = vec3_add_scaled(change, normal_change, -normal_share(r));
    return vec3_add_scaled(change, normal, -share_change);
}
