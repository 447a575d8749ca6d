/*
 * Elementary functions that give the same bits on every machine: only +, −, ×, ÷, sqrt and operations on
 * the bits of a double, in a fixed order. The C library's own functions differ between CPUs and versions,
 * so nothing that reaches a pixel calls them (beyond sqrt, floor and fmod, which are exact everywhere).
 *
 * All take and return double, accept every double and follow C's Annex F for infinities, NaN and signed
 * zeros (except math_pow_unit); a NaN result is always the positive quiet one without payload. The error bounds are in
 * units in the last place of the true result (ulp), a little above the largest error seen against MPFR; tests/numeric
 * holds the functions to them.
 */
#ifndef WEFT_MATH_ELEMENTARY_H
#define WEFT_MATH_ELEMENTARY_H

#include "math/elementary_lanes.h" /* math_floor, math_exp, math_pow_unit, math_atan2 */

/* Within 0.86 ulp for every finite argument, however large. */
double math_sin(double radians);
double math_cos(double radians);

/* Within 0.86 ulp. Exact where the result is: at multiples of 90 degrees, and 0.5 at 30 and 60. A zero of
 * the sine has the sign of the argument, a zero of the cosine is +0. */
double math_sin_degrees(double degrees);
double math_cos_degrees(double degrees);

/* Within 0.501 ulp. */
double math_log(double x);

/* x to the power y. Within 0.67 ulp, 0.8 where the result is subnormal; exact where x^y is a double. Where
 * 0 <= x <= 1 and not every bit counts, math_pow_unit is many times faster. */
double math_pow(double x, double y);

#endif
