/*
 * Vectors of three doubles, by value. Every function is a fixed sequence of +, −, × and ÷, so all
 * machines compute the same bits. Colours use the same type (linear-light red, green, blue).
 */
#ifndef WEFT_MATH_VEC3_H
#define WEFT_MATH_VEC3_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

struct vec3 {
    double x, y, z;
};

static inline struct vec3 vec3_make(double x, double y, double z)
{
    return (struct vec3){x, y, z};
}

static inline struct vec3 vec3_add(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline struct vec3 vec3_sub(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline struct vec3 vec3_scale(struct vec3 a, double s)
{
    return vec3_make(a.x * s, a.y * s, a.z * s);
}

/* Component by component. */
static inline struct vec3 vec3_mul(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.x * b.x, a.y * b.y, a.z * b.z);
}

static inline struct vec3 vec3_neg(struct vec3 a)
{
    return vec3_make(-a.x, -a.y, -a.z);
}

/* a + s b */
static inline struct vec3 vec3_add_scaled(struct vec3 a, struct vec3 b, double s)
{
    return vec3_make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

/* (1 − s) a + s b */
static inline struct vec3 vec3_mix(struct vec3 a, struct vec3 b, double s)
{
    return vec3_add(vec3_scale(a, 1 - s), vec3_scale(b, s));
}

/* a if first is not 0, else b: a choice without a branch. */
static inline struct vec3 vec3_choose(double first, struct vec3 a, struct vec3 b)
{
    return vec3_make(first != 0 ? a.x : b.x, first != 0 ? a.y : b.y, first != 0 ? a.z : b.z);
}

static inline double vec3_dot(struct vec3 a, struct vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vec3 vec3_cross(struct vec3 a, struct vec3 b)
{
    return vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline double vec3_length(struct vec3 a)
{
    return sqrt(vec3_dot(a, a));
}

/* The largest magnitude among the components. */
static inline double vec3_max_abs(struct vec3 a)
{
    double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
    double m = x > y ? x : y;
    return m > z ? m : z;
}

/* The largest component. */
static inline double vec3_max(struct vec3 a)
{
    double m = a.x > a.y ? a.x : a.y;
    return m > a.z ? m : a.z;
}

/* A direction and how far it reaches. */
struct vec3_way {
    struct vec3 direction; /* unit */
    double length;
};

/* a / |a|, for an a of any magnitude: it is scaled by a power of two first, so that the sum of squares neither
 * overflows nor underflows; and |a|, or 0 if a is subnormal. a must be finite and not zero. Without branches, for loops
 * over lanes. */
static inline struct vec3_way vec3_way(struct vec3 a)
{
    /* The biased exponent of the scale is 2046 minus that of the largest component, which is so brought within 1..4
     * or, where it is subnormal, within 2^-52..1. */
    const uint64_t exponent_bits = 0x7ffull << 52;
    double largest = vec3_max_abs(a), scale, inverse;
    largest = largest < 0x1p+1022 ? largest : 0x1p+1022; /* or the scale would be subnormal */
    uint64_t bits;
    memcpy(&bits, &largest, sizeof bits);
    bits &= exponent_bits;
    memcpy(&inverse, &bits, sizeof inverse);
    bits = (2046ull << 52) - bits;
    memcpy(&scale, &bits, sizeof scale);
    a = vec3_scale(a, scale);
    double length = vec3_length(a);
    return (struct vec3_way){vec3_make(a.x / length, a.y / length, a.z / length), length * inverse};
}

static inline struct vec3 vec3_normalize(struct vec3 a)
{
    return vec3_way(a).direction;
}

/* Two unit vectors that complete the unit vector n to a right-handed orthonormal frame (t, b, n), after
 * Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017. */
void vec3_frame(struct vec3 n, struct vec3 *t, struct vec3 *b);

static inline bool vec3_is_finite(struct vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline bool vec3_is_zero(struct vec3 a)
{
    return a.x == 0 && a.y == 0 && a.z == 0;
}

#endif
