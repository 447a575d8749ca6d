/*
 * Each function reduces its argument to a short interval in double-double arithmetic, where a short Taylor
 * series does the rest, and rounds once at the end. The tables and constants were computed from their
 * definitions (stated at each) with 1600 bits and rounded to nearest; the series' coefficients are the
 * Taylor ones and read as such. The exponential function and the arc tangent are in elementary_lanes.h.
 *
 * Two things could differ between machines and are ruled out here: a NaN's sign and payload (every NaN
 * result is the constant NAN) and conversions to an integer out of its range (none is reached).
 */
#include "math/elementary.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* --- double-double ---------------------------------------------------------------------------------------- */

/* The unevaluated sum hi + lo, |lo| being at most about half a unit in the last place of hi. */
struct dd {
    double hi, lo;
};

static const struct dd half_pi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
static const struct dd degree = {0x1.1df46a2529d39p-6, 0x1.5c1d8becdd291p-62}; /* π / 180 */

/* flip ? −x : x */
static double flipped(double x, bool flip)
{
    return elementary_flipped(x, flip ? ELEMENTARY_SIGN : 0);
}

/* a + b exactly, for |a| >= |b| or a = 0 (Dekker 1971). */
static struct dd ordered_sum(double a, double b)
{
    double sum = a + b;
    return (struct dd){sum, b - (sum - a)};
}

/* a + b exactly (Knuth, TAOCP 2, 4.2.2). */
static struct dd exact_sum(double a, double b)
{
    double sum = a + b, b_part = sum - a;
    return (struct dd){sum, (a - (sum - b_part)) + (b - b_part)};
}

/* The upper 26 bits of x, rounded (Veltkamp 1968); |x| < 2^996. */
static double upper_half(double x)
{
    double shifted = x * 0x1.0000002p+27;
    return shifted - (shifted - x);
}

/* a × b exactly unless it comes near either end of the range (Dekker 1971). */
static struct dd exact_product(double a, double b)
{
    double product = a * b;
    double a_hi = upper_half(a), b_hi = upper_half(b);
    double a_lo = a - a_hi, b_lo = b - b_hi;
    return (struct dd){product, ((a_hi * b_hi - product) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo};
}

/* a × b to about 100 bits. */
static struct dd scaled(struct dd a, double b)
{
    struct dd product = exact_product(a.hi, b);
    return ordered_sum(product.hi, product.lo + a.lo * b);
}

/* a ÷ b to about 100 bits. */
static struct dd quotient(struct dd a, struct dd b)
{
    double q = a.hi / b.hi, inverse = 1 / b.hi;
    struct dd back = exact_product(q, b.hi);
    double rest = (a.hi - back.hi) - back.lo + a.lo - q * b.lo;
    return (struct dd){q, rest * inverse};
}

/* c[0] + c[1] z + … + c[n − 1] z^(n − 1) for an even n, by two interleaved Horner schemes, which a
 * processor computes side by side. */
static inline double polynomial(double z, const double *c, int n)
{
    double square = z * z, even = c[n - 2], odd = c[n - 1];
    for (int i = n - 4; i >= 0; i -= 2) {
        even = even * square + c[i];
        odd = odd * square + c[i + 1];
    }
    return even + odd * z;
}

/* --- sine and cosine -------------------------------------------------------------------------------------- */

/* An angle of `quarters` right angles and `rest` radians, |rest| <= π/4. */
struct reduced_angle {
    unsigned quarters;
    struct dd rest;
};

/* 64 zero bits and the first 1216 bits of 2/π. */
static const uint64_t two_over_pi[20] = {
    0x0000000000000000, 0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
    0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41,
    0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7,
    0x4f463f669e5fea2d, 0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab,
};

/* x mod 2π for any finite x >= 1/2, after Payne and Hanek, "Radian Reduction for Trigonometric Functions",
 * SIGNUM 1983: x × 2/π modulo 4 in fixed point, where only 192 bits of 2/π matter, since those further left
 * make whole turns. No double is nearer than 2^-62 to a multiple of π/2, so the 126 bits of the fraction
 * leave at least 64 that count. */
static struct reduced_angle reduce_radians(double x)
{
    uint64_t bits = elementary_bits(x);
    uint64_t mantissa = (bits & 0xfffffffffffff) | 1ull << 52;
    unsigned first = (unsigned)(bits >> 52) - 1075 + 62; /* of the bits that matter; at least 9 */
    const uint64_t *at = two_over_pi + first / 64;
    unsigned shift = first % 64;
    uint64_t factor[3];
    for (int i = 0; i < 3; i++)
        factor[i] = at[i] << shift | at[i + 1] >> 1 >> (63 - shift);

    /* The upper 128 of the 192 bits: two of quarters, the rest their fraction. */
    unsigned __int128 product = (unsigned __int128)(mantissa * factor[0]) << 64;
    product += (unsigned __int128)mantissa * factor[1];
    product += (unsigned __int128)mantissa * factor[2] >> 64;

    __int128 fraction = (__int128)(product << 2); /* of a quarter, signed: −1/2..1/2 */
    double upper = (double)(int64_t)(fraction >> 75);
    double middle = (double)(int64_t)(fraction >> 22 & 0x1fffffffffffff);
    double lower = (double)(int64_t)(fraction & 0x3fffff);
    struct dd part = exact_sum(upper * 0x1p-53, middle * 0x1p-106);
    part = ordered_sum(part.hi, part.lo + lower * 0x1p-128);
    struct dd rest = scaled(half_pi, part.hi);
    rest.lo += half_pi.hi * part.lo;
    return (struct reduced_angle){(unsigned)(product >> 126) + (fraction < 0), rest};
}

/* The sine of an angle. Which series it takes and the sign are selected, not branched upon: a processor
 * cannot foresee the quarter. */
static double sine_of(struct reduced_angle a)
{
    static const double series[2][8] = {
        {-1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800, 1.0 / 6227020800,
         -1.0 / 1307674368000, 1.0 / 355687428096000},
        {1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200,
         1.0 / 20922789888000, -1.0 / 6402373705728000},
    };
    unsigned cosine = a.quarters & 1;
    double x = a.rest.hi, z = x * x;
    struct dd parabola = ordered_sum(1, -0.5 * z);
    const double first[2] = {x, parabola.hi}, factor[2] = {x * z, z * z};
    const double small[2] = {a.rest.lo * parabola.hi, parabola.lo - x * a.rest.lo};
    double sine = first[cosine] + (factor[cosine] * polynomial(z, series[cosine], 8) + small[cosine]);
    return flipped(sine, a.quarters & 2);
}

static double cosine_of(struct reduced_angle a)
{
    a.quarters++;
    return sine_of(a);
}

static struct reduced_angle angle_of_radians(double x)
{
    return x < 0.785 ? (struct reduced_angle){0, {x, 0}} : reduce_radians(x);
}

double math_sin(double radians)
{
    double x = fabs(radians);
    if (!isfinite(x))
        return NAN;
    if (x < 0x1p-27) /* where x³/6 is less than what rounding loses; keeps the sign of zero */
        return radians;
    return flipped(sine_of(angle_of_radians(x)), radians < 0);
}

double math_cos(double radians)
{
    double x = fabs(radians);
    return isfinite(x) ? cosine_of(angle_of_radians(x)) : NAN;
}

/* x degrees, finite and not negative; every step up to the product with π/180 is exact. */
static struct reduced_angle angle_of_degrees(double x)
{
    double turn = x < 360 ? x : fmod(x, 360); /* the same, sooner */
    double quarters = elementary_nearest(turn * (1.0 / 90));
    return (struct reduced_angle){(unsigned)quarters, scaled(degree, turn - 90 * quarters)};
}

double math_sin_degrees(double degrees)
{
    double x = fabs(degrees);
    if (!isfinite(x))
        return NAN;
    if (x < 0x1p-30) /* as in math_sin; the product below would lose bits of a tiny angle */
        return degrees * degree.hi;
    return flipped(sine_of(angle_of_degrees(x)) + 0.0, degrees < 0); /* + 0.0 turns −0 into 0 */
}

double math_cos_degrees(double degrees)
{
    double x = fabs(degrees);
    return isfinite(x) ? cosine_of(angle_of_degrees(x)) + 0.0 : NAN; /* + 0.0 turns −0 into 0 */
}

/* --- logarithm -------------------------------------------------------------------------------------------- */

/* ln(i/64) for i = 45..91. */
static const struct dd log_table[47] = {
    {-0x1.68ac83e9c6a14p-2, -0x1.a64eadd740178p-58}, {-0x1.522ae0738a3d8p-2, 0x1.8f7e9b38a6979p-57},
    {-0x1.3c25277333184p-2, 0x1.2ad27e50a8ec6p-56}, {-0x1.269621134db92p-2, -0x1.e0efadd9db02bp-56},
    {-0x1.1178e8227e47cp-2, 0x1.0e63a5f01c691p-57}, {-0x1.f991c6cb3b379p-3, -0x1.f665066f980a2p-57},
    {-0x1.d1037f2655e7bp-3, -0x1.60629242471a2p-57}, {-0x1.a93ed3c8ad9e3p-3, -0x1.bcafa9de97203p-57},
    {-0x1.823c16551a3c2p-3, 0x1.1232ce70be781p-57}, {-0x1.5bf406b543db2p-3, 0x1.1f5b44c0df7e7p-61},
    {-0x1.365fcb0159016p-3, -0x1.7d411a5b944adp-58}, {-0x1.1178e8227e47cp-3, 0x1.0e63a5f01c691p-58},
    {-0x1.da727638446a2p-4, -0x1.401fa71733019p-58}, {-0x1.9335e5d594989p-4, 0x1.478a85704ccb7p-58},
    {-0x1.4d3115d207eacp-4, -0x1.769f42c7842ccp-58}, {-0x1.08598b59e3a07p-4, 0x1.dd7009902bf32p-58},
    {-0x1.894aa149fb343p-5, -0x1.a8be97660a23dp-60}, {-0x1.0415d89e74444p-5, -0x1.c05cf1d753622p-59},
    {-0x1.0205658935847p-6, -0x1.27c8e8416e71fp-60}, {0, 0},
    {0x1.fc0a8b0fc03e4p-7, -0x1.83092c59642a1p-62}, {0x1.f829b0e7833p-6, 0x1.33e3f04f1ef23p-60},
    {0x1.77458f632dcfcp-5, 0x1.18d3ca87b9296p-59}, {0x1.f0a30c01162a6p-5, 0x1.85f325c5bbacdp-59},
    {0x1.341d7961bd1d1p-4, -0x1.b599f227becbbp-58}, {0x1.6f0d28ae56b4cp-4, -0x1.906d99184b992p-58},
    {0x1.a926d3a4ad563p-4, 0x1.942f48aa70ea9p-58}, {0x1.e27076e2af2e6p-4, -0x1.61578001e0162p-60},
    {0x1.0d77e7cd08e59p-3, 0x1.9a5dc5e9030acp-57}, {0x1.29552f81ff523p-3, 0x1.301771c407dbfp-57},
    {0x1.44d2b6ccb7d1ep-3, 0x1.9f4f6543e1f88p-57}, {0x1.5ff3070a793d4p-3, -0x1.bc60efafc6f6ep-58},
    {0x1.7ab890210d909p-3, 0x1.be36b2d6a0608p-59}, {0x1.9525a9cf456b4p-3, 0x1.d904c1d4e2e26p-57},
    {0x1.af3c94e80bff3p-3, -0x1.398cff3641985p-58}, {0x1.c8ff7c79a9a22p-3, -0x1.4f689f8434012p-57},
    {0x1.e27076e2af2e6p-3, -0x1.61578001e0162p-59}, {0x1.fb9186d5e3e2bp-3, -0x1.caaae64f21acbp-57},
    {0x1.0a324e27390e3p-2, 0x1.7dcfde8061c03p-56}, {0x1.1675cababa60ep-2, 0x1.ce63eab883717p-61},
    {0x1.22941fbcf7966p-2, -0x1.76f5eb09628afp-56}, {0x1.2e8e2bae11d31p-2, -0x1.8f4cdb95ebdf9p-56},
    {0x1.3a64c556945eap-2, -0x1.c68651945f97cp-57}, {0x1.4618bc21c5ec2p-2, 0x1.f42decdeccf1dp-56},
    {0x1.51aad872df82dp-2, 0x1.3927ac19f55e3p-59}, {0x1.5d1bdbf5809cap-2, 0x1.4236383dc7fe1p-56},
    {0x1.686c81e9b14afp-2, -0x1.ddea0f7f58e3dp-57},
};

/* ln x to about 67 bits, for a finite x > 0: x = 2^k m with m in √½..√2 and c = i/64 next to m, so
 * ln x = k ln 2 + ln c + 2 artanh((m − c) / (m + c)), the quotient being below 1/180. */
static struct dd log_of(double x)
{
    static const double series[] = {2.0 / 3, 2.0 / 5, 2.0 / 7, 2.0 / 9};
    const uint64_t root_half = 0x3fe6a09e667f3bcd;
    int k = 0;
    if (x < 0x1p-1022) {
        x *= 0x1p+54;
        k = -54;
    }
    uint64_t bits = elementary_bits(x);
    int shift = (int)((bits - root_half + (1024ull << 52)) >> 52) - 1024;
    k += shift;
    double m = elementary_double(bits - ((uint64_t)shift << 52));
    double i = elementary_nearest(m * 64), c = i / 64;
    struct dd s = quotient((struct dd){m - c, 0}, exact_sum(m, c));
    double z = s.hi * s.hi;
    struct dd row = log_table[(int)i - 45];
    /* ln 2 in two parts, the first so short that k times it is exact. */
    struct dd whole = exact_sum(k * 0x1.62e42fefa2p-1, row.hi);
    struct dd sum = exact_sum(whole.hi, 2 * s.hi);
    double small = s.hi * z * polynomial(z, series, 4) + 2 * s.lo;
    return ordered_sum(sum.hi, sum.lo + (small + (whole.lo + row.lo + k * 0x1.9ef35793c7673p-41)));
}

double math_log(double x)
{
    if (isnan(x) || x < 0)
        return NAN;
    if (x == 0)
        return -INFINITY;
    return isinf(x) ? x : log_of(x).hi;
}

/* --- power ------------------------------------------------------------------------------------------------ */

static bool is_odd_integer(double y)
{
    return fabs(y) < 0x1p+53 && floor(y) == y && 2 * floor(y / 2) != y;
}

/* x^y for 0 <= x <= ∞ and x not 1, y not 0, neither NaN. */
static double power_of(double x, double y)
{
    if (x == 0 || isinf(x) || isinf(y))
        return (x > 1) == (y > 0) ? INFINITY : 0;
    /* ln x is at least 2^-53, so beyond this the power over- or underflows anyway; the product must not. */
    double clamped = fabs(y) < 0x1p+80 ? y : copysign(0x1p+80, y);
    struct dd exponent = scaled(log_of(x), clamped);
    return elementary_exp(exponent.hi, exponent.lo);
}

double math_pow(double x, double y)
{
    if (y == 0 || x == 1)
        return 1;
    if (isnan(x) || isnan(y) || (x < 0 && isfinite(x) && floor(y) != y))
        return NAN;
    if (x == -1 && isinf(y))
        return 1;
    double magnitude = fabs(x) == 1 ? 1 : power_of(fabs(x), y);
    return signbit(x) && is_odd_integer(y) ? -magnitude : magnitude;
}
