/*
 * Vectors of numbers with 113 bits of fraction, for pictures that are computed by textbook formulas: what a
 * double loses by cancellation there (up to 16 digits of 16) leaves 18 digits here.
 */
#ifndef WEFT_TESTS_QUAD_H
#define WEFT_TESTS_QUAD_H

#include <math.h>

#include "math/transform.h"

#ifdef __SIZEOF_FLOAT128__
typedef __float128 real;
#else
typedef long double real; /* where this has 113 bits: AArch64 */
#endif

struct quad3 {
    real x, y, z;
};

/* Newton's iteration from the double's root: 53, 106, 113 bits. */
static inline real quad_sqrt(real a)
{
    double root = sqrt((double)a);
    if (!(root > 0))
        return 0;
    real x = root;
    for (int i = 0; i < 3; i++)
        x = (x + a / x) / 2;
    return x;
}

static inline real quad_abs(real a)
{
    return a < 0 ? -a : a;
}

/* sin and cos of an angle in degrees of at most 90, by their series. */
static inline void quad_sin_cos(real degrees, real *sine, real *cosine)
{
    const real pi = (real)0x1.921fb54442d18p+1 + 0x1.1a62633145c07p-53 - 0x1.f1976b7ed8fbcp-109;
    real x = degrees * pi / 180, term = 1;
    *sine = *cosine = 0;
    for (int n = 0; n < 60; n += 2) {
        *cosine += term;
        term *= x / (n + 1);
        *sine += term;
        term *= -x / (n + 2);
    }
}

static inline struct quad3 quad_of(struct vec3 v)
{
    return (struct quad3){v.x, v.y, v.z};
}

static inline struct vec3 quad_round(struct quad3 v)
{
    return vec3_make((double)v.x, (double)v.y, (double)v.z);
}

static inline struct quad3 quad_add(struct quad3 a, struct quad3 b)
{
    return (struct quad3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline struct quad3 quad_sub(struct quad3 a, struct quad3 b)
{
    return (struct quad3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline struct quad3 quad_scale(struct quad3 a, real s)
{
    return (struct quad3){a.x * s, a.y * s, a.z * s};
}

/* a + s b */
static inline struct quad3 quad_add_scaled(struct quad3 a, struct quad3 b, real s)
{
    return (struct quad3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

/* Component by component. */
static inline struct quad3 quad_mul(struct quad3 a, struct quad3 b)
{
    return (struct quad3){a.x * b.x, a.y * b.y, a.z * b.z};
}

static inline real quad_dot(struct quad3 a, struct quad3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct quad3 quad_cross(struct quad3 a, struct quad3 b)
{
    return (struct quad3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline real quad_length(struct quad3 a)
{
    return quad_sqrt(quad_dot(a, a));
}

static inline struct quad3 quad_normalize(struct quad3 a)
{
    return quad_scale(a, 1 / quad_length(a));
}

static inline real quad_max(struct quad3 a)
{
    real m = a.x > a.y ? a.x : a.y;
    return m > a.z ? m : a.z;
}

/* The inverse of an affine map's linear part. */
struct quad_matrix {
    struct quad3 row[3];
};

static inline struct quad3 quad_apply(const struct quad_matrix *m, struct quad3 v)
{
    return (struct quad3){quad_dot(m->row[0], v), quad_dot(m->row[1], v), quad_dot(m->row[2], v)};
}

static inline struct quad3 quad_apply_transposed(const struct quad_matrix *m, struct quad3 v)
{
    return quad_add_scaled(quad_add_scaled(quad_scale(m->row[0], v.x), m->row[1], v.y), m->row[2], v.z);
}

static inline struct quad_matrix quad_inverse(const struct mat3 *m)
{
    struct quad3 x = quad_of(m->x), y = quad_of(m->y), z = quad_of(m->z);
    struct quad3 yz = quad_cross(y, z), zx = quad_cross(z, x), xy = quad_cross(x, y);
    real determinant = quad_dot(x, yz);
    return (struct quad_matrix){{
        quad_scale((struct quad3){yz.x, zx.x, xy.x}, 1 / determinant),
        quad_scale((struct quad3){yz.y, zx.y, xy.y}, 1 / determinant),
        quad_scale((struct quad3){yz.z, zx.z, xy.z}, 1 / determinant),
    }};
}

#endif
