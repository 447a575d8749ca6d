/*
 * Affine maps p -> linear p + offset, in double.
 */
#ifndef WEFT_MATH_TRANSFORM_H
#define WEFT_MATH_TRANSFORM_H

#include "math/vec3.h"

/* Three rows. */
struct mat3 {
    struct vec3 x, y, z;
};

struct affine {
    struct mat3 linear;
    struct vec3 offset;
};

static inline struct vec3 mat3_apply(const struct mat3 *m, struct vec3 v)
{
    return vec3_make(vec3_dot(m->x, v), vec3_dot(m->y, v), vec3_dot(m->z, v));
}

/* The transposed matrix times v. */
static inline struct vec3 mat3_apply_transposed(const struct mat3 *m, struct vec3 v)
{
    return vec3_make(m->x.x * v.x + m->y.x * v.y + m->z.x * v.z, m->x.y * v.x + m->y.y * v.y + m->z.y * v.z,
                     m->x.z * v.x + m->y.z * v.y + m->z.z * v.z);
}

struct mat3 mat3_identity(void);
struct mat3 mat3_multiply(const struct mat3 *a, const struct mat3 *b);
struct mat3 mat3_transpose(const struct mat3 *m);
double mat3_determinant(const struct mat3 *m);

/* The inverse by cofactors; the determinant must not be zero. */
struct mat3 mat3_inverse(const struct mat3 *m);

struct affine affine_identity(void);
struct affine affine_translation(struct vec3 by);
struct affine affine_scaling(struct vec3 by);

/* Turn by `degrees` about the unit vector `axis` through the origin, counter-clockwise seen from its tip
 * (Rodrigues' formula). Multiples of 90 degrees about a coordinate axis are exact. */
struct affine affine_rotation(struct vec3 axis, double degrees);

/* First b, then a. */
struct affine affine_multiply(const struct affine *a, const struct affine *b);

static inline struct vec3 affine_point(const struct affine *m, struct vec3 p)
{
    return vec3_add(mat3_apply(&m->linear, p), m->offset);
}

/* The image of p minus `origin`, subtracted from the offset first: where offset and origin are large and
 * near each other, nothing of p is lost. */
static inline struct vec3 affine_point_relative(const struct affine *m, struct vec3 p, struct vec3 origin)
{
    return vec3_add(vec3_sub(m->offset, origin), mat3_apply(&m->linear, p));
}

/* The factor s if the linear part is a rotation or reflection times s, to within a few units in the last
 * place; otherwise 0. */
double affine_similarity(const struct affine *m);

#endif
