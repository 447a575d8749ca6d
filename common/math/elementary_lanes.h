/*
 * The elementary functions that shading calls for every ray, in a form that a compiler can make vector code of: a loop
 * over many arguments that calls one of them has neither branches nor tables nor calls. Only +, −, ×, ÷, selections and
 * operations on the bits of doubles, all of which even SSE2 has for vectors (it has no 64-bit multiplication,
 * arithmetic shift, comparison or conversion between integers and doubles). Part of elementary.h, whose contract holds
 * here too.
 *
 * Where a series is said to be fitted, Remez's exchange algorithm chose the coefficients such that the function's
 * largest relative error on the interval is least; it is given as it is after rounding them.
 */
#ifndef WEFT_MATH_ELEMENTARY_LANES_H
#define WEFT_MATH_ELEMENTARY_LANES_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* --- the bits of a double --------------------------------------------------------------------------------- */

static inline uint64_t elementary_bits(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline double elementary_double(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* x to the nearest integer, ties to even, for |x| < 2^51: the sum's unit in the last place is 1. */
static inline double elementary_nearest(double x)
{
    return (x + 0x1.8p+52) - 0x1.8p+52;
}

/* C's floor to the last bit, in operations that SSE2 has for vectors: for |x| <= 2^52 the unit in the last place of the
 * sum is 1, and doubles beyond are whole. */
static inline double math_floor(double x)
{
    double whole = copysign(0x1p+52, x), nearest = (x + whole) - whole;
    double below = nearest > x ? nearest - 1 : nearest;
    return fabs(x) < 0x1p+52 ? copysign(below, x) : x;
}

/* 2^n for an integer n, −1022 <= n <= 1023: the sum ends in the bits of n + 1023, and the shift drops all others. */
static inline double elementary_power_of_two(double n)
{
    return elementary_double(elementary_bits(n + (0x1.8p+52 + 1023)) << 52);
}

/* --- exponential ------------------------------------------------------------------------------------------ */

/* e^r − 1 − r for |r| <= 0.347, half of ln 2, by Taylor's series, of which 4e-18 is left out. */
static inline double elementary_exp_beyond_linear(double r)
{
    double z = r * r;
    double series = 1.0 / 479001600 + r * (1.0 / 6227020800);
    series = (1.0 / 3628800 + r * (1.0 / 39916800)) + z * series;
    series = (1.0 / 40320 + r * (1.0 / 362880)) + z * series;
    series = (1.0 / 720 + r * (1.0 / 5040)) + z * series;
    series = (1.0 / 24 + r * (1.0 / 120)) + z * series;
    series = (1.0 / 2 + r * (1.0 / 6)) + z * series;
    return z * series;
}

/* e^(x + x_rest), x_rest being below a unit in the last place of x: with n = x / ln 2 to the nearest integer it is
 * 2^n e^(x − n ln 2). */
static inline double elementary_exp(double x, double x_rest)
{
    double bounded = fabs(x) < 746 ? x : 0; /* beyond lies 0 or infinity */
    double n = elementary_nearest(bounded * 0x1.71547652b82fep+0);
    /* ln 2 in two parts, the first so short that n times it is exact. */
    double above = bounded - n * 0x1.62e42fefap-1, below = n * 0x1.cf79abc9e3b3ap-40 - x_rest;
    double r = above - below, r_rest = (above - r) - below;
    double one = 1 + r, lost = (1 - one) + r;
    double value = one + (lost + (r_rest * one + elementary_exp_beyond_linear(r)));
    double half = elementary_nearest(0.5 * n); /* in two steps: 2^n itself may be out of range */
    value = value * elementary_power_of_two(half) * elementary_power_of_two(n - half);
    return fabs(x) < 746 ? value : x < 0 ? 0 : x > 0 ? INFINITY : NAN;
}

/* Within 0.67 ulp, 0.8 where the result is subnormal. */
static inline double math_exp(double x)
{
    return elementary_exp(x, 0);
}

/* --- power ------------------------------------------------------------------------------------------------ */

/* The binary logarithm of a normal x > 0: x = 2^k m with m in √½..√2, and with s = (m − 1) / (m + 1)
 * it is k + 2 artanh(s) / ln 2. The series was fitted for |s| <= 0.1716 and leaves 2e-17. */
static inline double elementary_log2(double x)
{
    const uint64_t root_half = 0x3fe6a09e667f3bcd, exponents = 2048, double_2_52 = 0x4330000000000000;
    uint64_t from_root = elementary_bits(x) - root_half + (exponents << 52);
    double k = elementary_double(from_root >> 52 | double_2_52) - (0x1p+52 + (double)exponents);
    double m = elementary_double((from_root & 0xfffffffffffff) + root_half);
    double s = (m - 1) / (m + 1), z = s * s, zz = z * z;
    double series = (0x1.0ca11f2b861f6p-2 + z * 0x1.c4799879fd311p-3) + zz * 0x1.b52aba61a5f4bp-3;
    series = (0x1.a61762d20d638p-2 + z * 0x1.484afcf244a42p-2) + zz * series;
    series = (0x1.ec709dc3a0455p-1 + z * 0x1.2776c50ee72e1p-1) + zz * series;
    return k + s * (0x1.71547652b82fep+1 + z * series);
}

/* x to the power y, such as a highlight's, for 0 <= x <= 1 and 0 < y <= 1e300. The relative error is at most 7e-16 for
 * each e-fold that the power is below 1, plus 7e-16: 6e-15 at 0.001, 5e-13 at 1e-308. An x above 1, as rounding makes
 * them, counts as 1, and an x (also a negative one) or a power below 2^-1022 as 0. Neither argument may be a NaN. */
static inline double math_pow_unit(double x, double y)
{
    double exponent = y * elementary_log2(x < 1 ? x : 1);
    double bounded = exponent > -1022 ? exponent : 0;
    double n = elementary_nearest(bounded), r = (bounded - n) * 0x1.62e42fefa39efp-1;
    double power = (1 + (r + elementary_exp_beyond_linear(r))) * elementary_power_of_two(n);
    power = exponent > -1022 ? power : 0;
    return x >= 0x1p-1022 ? power : 0;
}

/* --- arc tangent ------------------------------------------------------------------------------------------ */

#define ELEMENTARY_SIGN (1ull << 63)

/* x, or −x where `sign` is ELEMENTARY_SIGN instead of 0. */
static inline double elementary_flipped(double x, uint64_t sign)
{
    return elementary_double(elementary_bits(x) ^ sign);
}

/* (atan q) / q − 1 for |q| <= √2 − 1. The series was fitted there and leaves 3e-18. */
static inline double elementary_atan_beyond_linear(double q)
{
    double z = q * q, zz = z * z;
    double series = (-0x1.9cdd3c73c6a79p-5 + z * 0x1.37f01069be0bfp-5) - zz * 0x1.25a3910bd14c1p-6;
    series = (-0x1.10ebe1a6e262fp-4 + z * 0x1.df11a3b508d3fp-5) + zz * series;
    series = (-0x1.745cf90fe78f3p-4 + z * 0x1.3b111cbccc84ap-4) + zz * series;
    series = (-0x1.24924922b184ep-3 + z * 0x1.c71c70e7cb630p-4) + zz * series;
    series = (-0x1.555555555553dp-2 + z * 0x1.99999999958fap-3) + zz * series;
    return z * series;
}

/* The angle of the point (x, y), −π..π. Within 2 ulp.
 *
 * The point is mirrored into the octant 0 <= small <= large and there, if steeper than 22.5 degrees, turned down by 45
 * degrees. The arc tangent of its slope q, now at most √2 − 1, is what the angle lacks or exceeds of 0, ½, 1, 1½ or 2
 * right angles. */
static inline double math_atan2(double y, double x)
{
    double rise = fabs(y), run = fabs(x);
    double small = rise < run ? rise : run, large = rise < run ? run : rise;
    double bounded = large < DBL_MAX ? large : DBL_MAX; /* so that ∞ beside ∞ is steep enough */
    bool turns = small > bounded * 0x1.a827999fcef32p-2;
    double scale = large > 1 ? 0.5 : 1; /* the sum must not overflow */
    double s = small * scale, l = large * scale;
    double q = (s - (turns ? l : 0)) / (l + (turns ? s : 0));
    q = isnan(q) ? 0 : q; /* 0/0, and ∞/∞ whose slope is 1 */
    double rest = q * elementary_atan_beyond_linear(q);

    double quarters = turns ? 0.5 : 0, way = rise > run ? -1 : 1;
    uint64_t back = elementary_bits(x) & ELEMENTARY_SIGN;
    quarters = (rise > run ? 1 : 0) + way * quarters;
    quarters = elementary_double(back >> 1) + elementary_flipped(quarters, back); /* the shifted sign is 2 */
    q = elementary_flipped(way * q, back);
    rest = elementary_flipped(way * rest, back);
    /* π/2 in two parts; the first ends in three zero bits, so that the product is exact. */
    double angle = quarters * 0x1.921fb54442d18p+0 + (q + (rest + quarters * 0x1.1a62633145c07p-54));
    return isunordered(x, y) ? NAN : copysign(angle, y);
}

#endif
