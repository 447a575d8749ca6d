/*
 * The elementary functions: their error against MPFR (72 bits) on random and hard arguments, and one digest
 * a function of the bits of 10,000 results, which every compiler, flag and CPU must reproduce.
 */
#include "math/elementary.h"

#include <float.h>
#include <math.h>
#include <mpfr.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/hash.h"

enum { SEED = 20240611, SAMPLES = 200000, THREADS = 2, GOLDEN = 10000 };

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

struct pair {
    double x, y;
};

static uint64_t bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* --- random arguments: the value number `draw` of sample `i` comes from these coordinates alone ----------- */

static uint64_t random_bits(uint32_t i, uint32_t draw)
{
    uint32_t key = hash_u32(SEED + draw) ^ i;
    return (uint64_t)hash_u32(key) << 32 | hash_u32(hash_u32(key) + 0x9e3779b9u);
}

static double uniform(uint32_t i, uint32_t draw, double from, double to)
{
    return from + (to - from) * ((double)(random_bits(i, draw) >> 11) * 0x1p-53);
}

/* Any finite double but 0: its exponent, fraction and sign are uniform. */
static double any_finite(uint32_t i, uint32_t draw)
{
    uint64_t bits = random_bits(i, draw);
    double x;
    if ((bits >> 52 & 0x7ff) == 0x7ff)
        bits ^= 1ull << 62;
    bits |= 1;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* A few units in the last place to either side of x. */
static double near(uint32_t i, uint32_t draw, double x)
{
    return x * (1 + floor(uniform(i, draw, -4, 5)) * DBL_EPSILON);
}

static struct pair sample_radians(uint32_t i)
{
    /* The double nearest to a multiple of π/2, from an exhaustive search by continued fractions (Muller,
     * "Elementary Functions", 11.3), and other arguments that have broken reductions. */
    static const double hard[] = {
        6381956970095103 * 0x1p+797, 1e22, 1e308, 0x1.fffffffffff00p+1023, 22, 0.785, M_PI_4, 0x1p-27};
    switch (i % 8) {
    case 0:
        return (struct pair){any_finite(i, 0), 0};
    case 1:
        return (struct pair){near(i, 1, floor(uniform(i, 0, 1, 1e5)) * M_PI_2), 0};
    case 2:
        return (struct pair){near(i, 1, floor(uniform(i, 0, 0, 1e4)) * M_PI_2 + M_PI_4), 0};
    case 3:
        return (struct pair){near(i, 0, hard[i / 8 % COUNT(hard)]), 0};
    case 4:
        return (struct pair){uniform(i, 0, -1e5, 1e5), 0};
    default:
        return (struct pair){uniform(i, 0, -4, 4), 0};
    }
}

static struct pair sample_degrees(uint32_t i)
{
    switch (i % 8) {
    case 0:
        return (struct pair){any_finite(i, 0), 0};
    case 1:
        return (struct pair){near(i, 1, 15 * floor(uniform(i, 0, -100, 100))), 0};
    case 2:
        return (struct pair){uniform(i, 0, -1e5, 1e5), 0};
    case 3:
        return (struct pair){uniform(i, 0, 1, 2) * 0x1p-30, 0};
    default:
        return (struct pair){uniform(i, 0, -360, 360), 0};
    }
}

static struct pair sample_point(uint32_t i)
{
    static const double slopes[] = {1, -1, M_SQRT2 - 1, 1 - M_SQRT2, M_SQRT2 + 1, -1 - M_SQRT2};
    double x = uniform(i, 0, -1, 1), y = uniform(i, 1, -1, 1);
    switch (i % 8) {
    case 0:
        return (struct pair){any_finite(i, 0), any_finite(i, 1)};
    case 1: /* from subnormal to large, the ratio moderate */
        return (struct pair){ldexp(x, (int)(i % 2040) - 1040), ldexp(y, (int)(i % 2040) - 1040 + (int)(i % 7))};
    case 2: /* the borders of octants and of what is turned within them */
        return (struct pair){x, near(i, 1, x * slopes[i / 8 % COUNT(slopes)])};
    case 3: /* nearly flat */
        return (struct pair){x, ldexp(y, -(int)(i % 60))};
    default:
        return (struct pair){x, y};
    }
}

static struct pair sample_exponent(uint32_t i)
{
    switch (i % 8) {
    case 0:
        return (struct pair){uniform(i, 0, -746, -708), 0};
    case 1:
        return (struct pair){uniform(i, 0, 709, 710), 0};
    case 2:
        return (struct pair){ldexp(uniform(i, 0, -1, 1), -(int)(i % 1000)), 0};
    case 3: /* where the power of two changes */
        return (struct pair){near(i, 0, (floor(uniform(i, 1, -1075, 1024)) + 0.5) * M_LN2), 0};
    case 4:
        return (struct pair){uniform(i, 0, -1, 1), 0};
    default:
        return (struct pair){uniform(i, 0, -745, 710), 0};
    }
}

static struct pair sample_positive(uint32_t i)
{
    switch (i % 4) {
    case 0:
        return (struct pair){fabs(any_finite(i, 0)), 0};
    case 1:
        return (struct pair){1 + ldexp(uniform(i, 0, -1, 1), -(int)(i % 53)), 0};
    case 2:
        return (struct pair){uniform(i, 0, 0, 1) * DBL_MIN + 0x1p-1074, 0};
    default:
        return (struct pair){uniform(i, 0, 0.5, 2), 0};
    }
}

/* Mostly such that x^y fills the whole range of a double. */
static struct pair sample_power(uint32_t i)
{
    double x = i % 2 ? 1 + uniform(i, 0, -0.01, 0.01) : fabs(any_finite(i, 0));
    switch (i / 2 % 4) {
    case 0: /* near the ends of the range */
        return (struct pair){x, near(i, 1, (i & 8 ? 709.78 : uniform(i, 1, -745.2, -708)) / math_log(x))};
    case 1:
        return (struct pair){-uniform(i, 0, 0, 20), floor(uniform(i, 1, -200, 200))};
    case 2: /* what the sRGB functions ask for */
        return (struct pair){uniform(i, 0, 0, 1), i & 8 ? 2.4 : 1 / 2.4};
    default:
        return (struct pair){x, uniform(i, 1, -745, 710) / math_log(x)};
    }
}

/* Bases and exponents of highlights whose power is a normal number. */
static struct pair sample_unit_power(uint32_t i)
{
    double x = i % 4 == 0   ? ldexp(uniform(i, 0, 0.5, 1), -(int)(i / 4 % 1021))
               : i % 4 == 1 ? 1 - ldexp(uniform(i, 0, 0, 1), -(int)(i / 4 % 53))
               : i % 4 == 2 ? near(i, 0, M_SQRT1_2)
                            : uniform(i, 0, 0, 1);
    x = x < 1 ? x : 1 - DBL_EPSILON / 2;
    double largest = -708.39 / math_log(x);
    return (struct pair){x, i / 4 % 2 ? largest * uniform(i, 1, 0, 1) : fmin(largest, exp2(uniform(i, 1, -10, 20)))};
}

/* --- the functions under test ----------------------------------------------------------------------------- */

static int true_sin_degrees(mpfr_ptr result, mpfr_srcptr x, mpfr_rnd_t rounding)
{
    return mpfr_sinu(result, x, 360, rounding);
}

static int true_cos_degrees(mpfr_ptr result, mpfr_srcptr x, mpfr_rnd_t rounding)
{
    return mpfr_cosu(result, x, 360, rounding);
}

static int true_atan2(mpfr_ptr result, mpfr_srcptr x, mpfr_srcptr y, mpfr_rnd_t rounding)
{
    return mpfr_atan2(result, y, x, rounding);
}

static double atan2_of(double x, double y)
{
    return math_atan2(y, x);
}

/* Of each function either the first or the second of `ours` and `truth` is set. */
struct function {
    const char *name;
    double (*ours)(double);
    double (*ours2)(double, double);
    int (*truth)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
    int (*truth2)(mpfr_ptr, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);
    struct pair (*sample)(uint32_t i);
    double bound;           /* in units in the last place, as stated in elementary.h */
    double bound_subnormal; /* the same where the true result is subnormal */
    const char *digest;     /* SHA-256 of the bits of the results for the golden arguments */
};

static const struct function functions[] = {
    {"sin", math_sin, NULL, mpfr_sin, NULL, sample_radians, 0.86, 0.86,
     "8e9284cb95f8dea9cf219421b2e4e8b54db4b0330b134086ef4a80a228742a9c"},
    {"cos", math_cos, NULL, mpfr_cos, NULL, sample_radians, 0.86, 0.86,
     "6e2fc7dd6f0548007ea3446eb552efa10e5cd9d2173d312bb77bbf3fd11d2a99"},
    {"sin_degrees", math_sin_degrees, NULL, true_sin_degrees, NULL, sample_degrees, 0.86, 0.86,
     "cfaf64b7fd70d954cb1ce393cf372a43a66ca6ab1cec3b3fd8d3ab15d035574e"},
    {"cos_degrees", math_cos_degrees, NULL, true_cos_degrees, NULL, sample_degrees, 0.86, 0.86,
     "2cb2d40c47b831b02c8c90abaf0210dc37c657c18a33f31fd58f5e93a6cc578e"},
    {"atan2", NULL, atan2_of, NULL, true_atan2, sample_point, 2, 0.55,
     "7f522e1ffffdf9f7c43dd1f8ff052087a05a30ba6315ac8fe1d1b52565d51947"},
    {"exp", math_exp, NULL, mpfr_exp, NULL, sample_exponent, 0.67, 0.8,
     "5ca0ec885b6c4bf9c8611fd13175341a78596f123ad89c83833bbc632244c9f5"},
    {"log", math_log, NULL, mpfr_log, NULL, sample_positive, 0.501, 0.501,
     "40eba0be658d2c2ac6ca7cb1a567cdea222ea591d9217603a7a5f69b1ee55ecf"},
    {"pow_unit", NULL, math_pow_unit, NULL, mpfr_pow, sample_unit_power, 5e-13 / DBL_EPSILON, 0,
     "c4fd018e694bc7e31756fad00709bda9fc966ed8323b89cd80113dcb8c01df6c"},
    {"pow", NULL, math_pow, NULL, mpfr_pow, sample_power, 0.67, 0.8,
     "26f5985f3055ed78dbb2867bec9b4ea7e17fbefdc38d4672a4303610ef1dd2c3"},
};

static double value_of(const struct function *f, struct pair a)
{
    return f->ours ? f->ours(a.x) : f->ours2(a.x, a.y);
}

/* --- the error -------------------------------------------------------------------------------------------- */

/* |result − truth| in units in the last place of a double near the truth; an infinite result counts as
 * 2^1024 unless the truth is beyond that. Uses `scratch`. */
static double ulps_between(double result, mpfr_srcptr truth, mpfr_ptr scratch)
{
    if ((isinf(result) || result == 0) && mpfr_get_d(truth, MPFR_RNDN) == result)
        return 0;
    if (mpfr_zero_p(truth) || isnan(result))
        return INFINITY;
    long exponent = (long)mpfr_get_exp(truth) - DBL_MANT_DIG;
    if (exponent < -1074)
        exponent = -1074;
    if (isinf(result))
        mpfr_set_si_2exp(scratch, result > 0 ? 1 : -1, 1024, MPFR_RNDN);
    else
        mpfr_set_d(scratch, result, MPFR_RNDN);
    mpfr_sub(scratch, truth, scratch, MPFR_RNDN);
    mpfr_div_2si(scratch, scratch, exponent, MPFR_RNDN);
    return fabs(mpfr_get_d(scratch, MPFR_RNDN));
}

/* One thread's share of a function's samples: every THREADS-th from `first` on. */
struct share {
    const struct function *function;
    uint32_t first;
    double worst[2]; /* ulp: where the true result is normal; where it is subnormal */
    uint32_t worst_sample[2];
};

static void *measure_share(void *argument)
{
    struct share *share = argument;
    const struct function *f = share->function;
    mpfr_t x, y, truth, scratch;
    mpfr_inits2(72, x, y, truth, scratch, (mpfr_ptr)0);
    for (uint32_t i = share->first; i < SAMPLES; i += THREADS) {
        struct pair a = f->sample(i);
        mpfr_set_d(x, a.x, MPFR_RNDN);
        mpfr_set_d(y, a.y, MPFR_RNDN);
        if (f->truth)
            f->truth(truth, x, MPFR_RNDN);
        else
            f->truth2(truth, x, y, MPFR_RNDN);
        bool subnormal = !mpfr_zero_p(truth) && mpfr_get_exp(truth) < DBL_MIN_EXP;
        double ulps = ulps_between(value_of(f, a), truth, scratch);
        if (ulps > share->worst[subnormal]) {
            share->worst[subnormal] = ulps;
            share->worst_sample[subnormal] = i;
        }
    }
    mpfr_clears(x, y, truth, scratch, (mpfr_ptr)0);
    mpfr_free_cache();
    return NULL;
}

static void check_share(const struct share *share)
{
    const struct function *f = share->function;
    const double bounds[2] = {f->bound, f->bound_subnormal};
    for (int i = 0; i < 2; i++) {
        struct pair a = f->sample(share->worst_sample[i]);
        if (share->worst[i] > bounds[i])
            fail_msg("seed %d, sample %u: %s(%a, %a) = %a is off by %g ulp", SEED, share->worst_sample[i],
                     f->name, a.x, a.y, value_of(f, a), share->worst[i]);
    }
    print_message("# seed %d: %s is off by at most %.4f ulp (subnormal results: %.4f)\n", SEED, f->name,
                  share->worst[0], share->worst[1]);
}

static void error_stays_within_the_stated_bound(void **state)
{
    struct share shares[THREADS];
    pthread_t threads[THREADS];
    for (uint32_t i = 0; i < THREADS; i++) {
        shares[i] = (struct share){.function = *state, .first = i};
        assert_int_equal(pthread_create(&threads[i], NULL, measure_share, &shares[i]), 0);
    }
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_join(threads[i], NULL), 0);
    for (int i = 0; i < THREADS; i++)
        check_share(&shares[i]);
}

/* --- the same bits everywhere ----------------------------------------------------------------------------- */

/* A quarter of the golden arguments are any pattern of bits, NaN and infinities included; the others lie
 * within ±2^15 with all magnitudes down to 2^-8 alike. */
static double golden_argument(uint32_t i, uint32_t draw)
{
    uint64_t bits = random_bits(i, draw);
    double x;
    memcpy(&x, &bits, sizeof x);
    return i % 4 == 0 ? x : ldexp((double)(int64_t)bits, -48 - (int)(bits % 24));
}

static struct pair golden_pair(const struct function *f, uint32_t i)
{
    if (f->ours2 == math_pow_unit)
        return (struct pair){uniform(i, 10, 0, 1), ldexp(uniform(i, 11, 0.5, 1), (int)(i % 24) - 4)};
    double x = golden_argument(i, 10);
    return (struct pair){f->ours2 == math_pow && i % 8 ? fabs(x) : x, golden_argument(i, 11)};
}

static void bits_are_the_recorded_ones(void **state)
{
    const struct function *f = *state;
    static uint64_t results[GOLDEN];
    for (uint32_t i = 0; i < GOLDEN; i++)
        results[i] = bits_of(value_of(f, golden_pair(f, i)));
    struct digest digest = digest_of(results, sizeof results);
    char text[DIGEST_HEX_BYTES];
    digest_hex(&digest, text);
    if (strcmp(text, f->digest) != 0)
        fail_msg("%s: the results' digest is %s", f->name, text);
}

int main(void)
{
    struct CMUnitTest tests[2 * COUNT(functions)];
    char names[COUNT(tests)][40];
    for (size_t i = 0; i < COUNT(tests); i++) {
        const struct function *f = &functions[i / 2];
        snprintf(names[i], sizeof names[i], "%s_%s", f->name, i % 2 ? "same_bits" : "error");
        CMUnitTestFunction test = i % 2 ? bits_are_the_recorded_ones : error_stays_within_the_stated_bound;
        tests[i] = (struct CMUnitTest){.name = names[i], .test_func = test, .initial_state = (void *)f};
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
