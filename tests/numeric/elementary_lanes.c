/*
 * The functions for loops over lanes: the same bits from vectors of every width that this processor has as from one
 * number at a time, and the special cases and the error of math_pow_unit beside math_pow.
 */
#include "math/elementary.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "math/vec3.h"
#include "tests/random.h"

enum { LANES = 20000, OUTPUTS = 6 };

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

/* --- arguments -------------------------------------------------------------------------------------------- */

struct lane_arguments {
    double x[LANES], y[LANES]; /* of any kind */
    double base[LANES], exponent[LANES];
    double a[LANES], b[LANES], c[LANES]; /* a vector, finite and not zero */
};

static double any_bits(uint32_t index, uint32_t draw)
{
    uint64_t bits = (uint64_t)hash_u32(hash_u32(draw) ^ index) << 32 | hash_u32(hash_u32(draw + 1) ^ index);
    return elementary_double(bits);
}

/* A sixth each: a special value, any pattern of bits; the others moderate. */
static double argument(uint32_t index, uint32_t draw)
{
    static const double special[] = {0.0, -0.0, INFINITY, -INFINITY, NAN, 1, -1, 0x1p-1074, DBL_MIN, DBL_MAX,
                                     -DBL_MAX, -708.3, -745.2, 709.7, 709.8, -746};
    uint32_t choice = hash_u32(hash_u32(draw) ^ index) % 6;
    return choice == 0   ? special[hash_u32(index + draw) % COUNT(special)]
           : choice == 1 ? any_bits(index, draw)
                         : random_between(index, draw, -1, 1) * (choice < 4 ? 1 : 700);
}

static double component(uint32_t index, uint32_t draw)
{
    double any = any_bits(index, draw);
    return index % 4 == 0 && isfinite(any) ? any : random_signed(index, draw);
}

static const struct lane_arguments *arguments(void)
{
    static struct lane_arguments all;
    for (uint32_t i = 0; i < LANES; i++) {
        all.x[i] = argument(i, 0);
        all.y[i] = argument(i, 2);
        all.base[i] = i % 8 == 0 ? i % 3 : i % 8 == 1 ? 1 - random_between(i, 4, 0, 1e-6) : random_between(i, 4, 0, 1);
        all.exponent[i] = ldexp(random_between(i, 5, 0.5, 1), (int)(i % 40) - 15);
        all.a[i] = component(i, 6);
        all.b[i] = component(i, 8);
        all.c[i] = component(i, 10) + DBL_MIN;
    }
    return &all;
}

/* --- one at a time, and in vectors ------------------------------------------------------------------------ */

struct lane_results {
    double of[OUTPUTS][LANES]; /* exp, atan2, pow_unit and a unit vector's three components */
};

/* A loop over lanes for the processors that `target`, a function attribute or nothing, names. */
#define DEFINE_LOOPS(name, target)                                                                                     \
    target static void name(const struct lane_arguments *restrict in, struct lane_results *restrict out)              \
    {                                                                                                                  \
        for (size_t i = 0; i < LANES; i++)                                                                             \
            out->of[0][i] = math_exp(in->x[i]);                                                                        \
        for (size_t i = 0; i < LANES; i++)                                                                             \
            out->of[1][i] = math_atan2(in->y[i], in->x[i]);                                                            \
        for (size_t i = 0; i < LANES; i++)                                                                             \
            out->of[2][i] = math_pow_unit(in->base[i], in->exponent[i]);                                               \
        for (size_t i = 0; i < LANES; i++) {                                                                           \
            struct vec3 unit = vec3_normalize(vec3_make(in->a[i], in->b[i], in->c[i]));                                \
            out->of[3][i] = unit.x;                                                                                    \
            out->of[4][i] = unit.y;                                                                                    \
            out->of[5][i] = unit.z;                                                                                    \
        }                                                                                                              \
    }

DEFINE_LOOPS(baseline_loops, )
#ifdef __x86_64__
DEFINE_LOOPS(avx2_loops, __attribute__((target("avx2"))))
DEFINE_LOOPS(avx512_loops, __attribute__((target("avx512f,avx512vl,avx512dq"))))
#endif

/* Through pointers that a compiler cannot see through, so that no loop becomes vectors. */
static void one_at_a_time(const struct lane_arguments *in, struct lane_results *out)
{
    double (*volatile exp_of)(double) = math_exp;
    double (*volatile atan2_of)(double, double) = math_atan2;
    double (*volatile pow_unit_of)(double, double) = math_pow_unit;
    struct vec3 (*volatile unit_of)(struct vec3) = vec3_normalize;
    for (size_t i = 0; i < LANES; i++) {
        struct vec3 unit = unit_of(vec3_make(in->a[i], in->b[i], in->c[i]));
        const double results[OUTPUTS] = {exp_of(in->x[i]), atan2_of(in->y[i], in->x[i]),
                                         pow_unit_of(in->base[i], in->exponent[i]), unit.x, unit.y, unit.z};
        for (size_t k = 0; k < OUTPUTS; k++)
            out->of[k][i] = results[k];
    }
}

static void expect_same_bits(void (*loops)(const struct lane_arguments *restrict, struct lane_results *restrict))
{
    static struct lane_results expected, found;
    one_at_a_time(arguments(), &expected);
    loops(arguments(), &found);
    for (size_t k = 0; k < OUTPUTS; k++)
        for (size_t i = 0; i < LANES; i++)
            if (elementary_bits(found.of[k][i]) != elementary_bits(expected.of[k][i]))
                fail_msg("seed %d, output %zu, lane %zu: %a, but %a alone", TEST_SEED, k, i, found.of[k][i],
                         expected.of[k][i]);
}

static void baseline_vectors_give_the_same_bits(void **state)
{
    (void)state;
    expect_same_bits(baseline_loops);
}

static void avx2_vectors_give_the_same_bits(void **state)
{
    (void)state;
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx2")) {
        expect_same_bits(avx2_loops);
        return;
    }
#endif
    skip();
}

static void avx512_vectors_give_the_same_bits(void **state)
{
    (void)state;
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
        expect_same_bits(avx512_loops);
        return;
    }
#endif
    skip();
}

/* --- powers of the unit interval -------------------------------------------------------------------------- */

static void unit_powers_at_the_ends(void **state)
{
    (void)state;
    static const double rows[][3] = {
        /* x, y, x^y */
        {0, 1e-30, 0}, {0, 1, 0}, {0, 1e30, 0}, {-0.0, 32, 0}, {1, 1e-30, 1}, {1, 1e30, 1},
        {1 + DBL_EPSILON, 1e30, 1}, {0x1.fffffffffffffp-1, 1e30, 0}, {0.5, 1e-30, 1}, {0.5, 1, 0.5}, {0.5, 10, 0x1p-10},
        {0.5, 1021, 0x1p-1021}, {0.5, 1023, 0}, {DBL_MIN, 0.5, 0x1p-511}, {DBL_MIN / 2, 1e-30, 0}, {0.25, 0.5, 0.5},
    };
    for (size_t i = 0; i < COUNT(rows); i++) {
        double power = math_pow_unit(rows[i][0], rows[i][1]);
        if (elementary_bits(power) != elementary_bits(rows[i][2]))
            fail_msg("row %zu: %a to the power %g is %a, not %a", i, rows[i][0], rows[i][1], power, rows[i][2]);
    }
}

/* math_pow itself is off by at most 0.67 ulp or 1.5e-16. */
static void unit_powers_are_off_by_their_logarithm(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10 * LANES; i++) {
        double x = i % 2 ? random_between(i, 0, 0, 1) : random_between(i, 0, 0.7, 0.71);
        double y = exp2(random_between(i, 1, -10, 11)), truth = math_pow(x, y);
        if (truth < DBL_MIN)
            continue;
        double error = fabs(math_pow_unit(x, y) - truth) / truth;
        if (!(error <= 7e-16 * (1 - math_log(truth)) + 1.5e-16))
            fail_msg("seed %d, sample %u: %a to the power %a is off by %g", TEST_SEED, i, x, y, error);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(baseline_vectors_give_the_same_bits),
        cmocka_unit_test(avx2_vectors_give_the_same_bits),
        cmocka_unit_test(avx512_vectors_give_the_same_bits),
        cmocka_unit_test(unit_powers_at_the_ends),
        cmocka_unit_test(unit_powers_are_off_by_their_logarithm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
