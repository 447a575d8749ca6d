/*
 * The elementary functions: Annex F's special cases, and results that must be exact.
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

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

/* Expected values are compared by their bits: −0 is not 0, and NAN is that very NaN. */
static uint64_t bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

struct unary_case {
    double (*function)(double);
    double x, expected;
};

struct binary_case {
    double (*function)(double, double);
    double x, y, expected;
};

static void check_unary(const struct unary_case *rows, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double result = rows[i].function(rows[i].x);
        if (bits_of(result) != bits_of(rows[i].expected))
            fail_msg("row %zu: f(%g) = %g, not %g", i, rows[i].x, result, rows[i].expected);
    }
}

static void check_binary(const struct binary_case *rows, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double result = rows[i].function(rows[i].x, rows[i].y);
        if (bits_of(result) != bits_of(rows[i].expected))
            fail_msg("row %zu: f(%g, %g) = %g, not %g", i, rows[i].x, rows[i].y, result, rows[i].expected);
    }
}

static void unary_special_cases(void **state)
{
    (void)state;
    static const double inf = INFINITY;
    const struct unary_case rows[] = {
        {math_sin, 0.0, 0.0},
        {math_sin, -0.0, -0.0},
        {math_sin, inf, NAN},
        {math_sin, -inf, NAN},
        {math_sin, -NAN, NAN},
        {math_sin, 0x1p-1074, 0x1p-1074},
        {math_cos, 0.0, 1},
        {math_cos, -0.0, 1},
        {math_cos, inf, NAN},
        {math_cos, -NAN, NAN},
        {math_sin_degrees, -0.0, -0.0},
        {math_sin_degrees, inf, NAN},
        {math_sin_degrees, -NAN, NAN},
        {math_cos_degrees, -inf, NAN},
        {math_cos_degrees, -NAN, NAN},
        {math_exp, 0.0, 1},
        {math_exp, -0.0, 1},
        {math_exp, inf, inf},
        {math_exp, -inf, 0.0},
        {math_exp, -NAN, NAN},
        {math_exp, 1e308, inf},
        {math_exp, -1e308, 0.0},
        {math_exp, 0x1.62e42fefa39efp+9, 0x1.fffffffffff2ap+1023}, /* the last finite one */
        {math_exp, 0x1.62e42fefa39fp+9, inf},
        {math_exp, -0x1.74910d52d3051p+9, 0x1p-1074}, /* the last that is not 0 */
        {math_exp, -0x1.74910d52d3052p+9, 0.0},
        {math_log, 1, 0.0},
        {math_log, 0.0, -inf},
        {math_log, -0.0, -inf},
        {math_log, inf, inf},
        {math_log, -1, NAN},
        {math_log, -inf, NAN},
        {math_log, -NAN, NAN},
    };
    check_unary(rows, COUNT(rows));
}

static void atan2_special_cases(void **state)
{
    (void)state;
    static const double inf = INFINITY;
    const struct binary_case rows[] = {
        /* y, x, angle */
        {math_atan2, 0.0, 0.0, 0.0},
        {math_atan2, -0.0, 0.0, -0.0},
        {math_atan2, 0.0, -0.0, M_PI},
        {math_atan2, -0.0, -0.0, -M_PI},
        {math_atan2, 0.0, 5, 0.0},
        {math_atan2, -0.0, 5, -0.0},
        {math_atan2, 0.0, -5, M_PI},
        {math_atan2, -0.0, -5, -M_PI},
        {math_atan2, 5, 0.0, M_PI_2},
        {math_atan2, 5, -0.0, M_PI_2},
        {math_atan2, -5, 0.0, -M_PI_2},
        {math_atan2, -5, -0.0, -M_PI_2},
        {math_atan2, 5, inf, 0.0},
        {math_atan2, -5, inf, -0.0},
        {math_atan2, 5, -inf, M_PI},
        {math_atan2, -5, -inf, -M_PI},
        {math_atan2, inf, 5, M_PI_2},
        {math_atan2, -inf, -5, -M_PI_2},
        {math_atan2, inf, inf, M_PI_4},
        {math_atan2, -inf, inf, -M_PI_4},
        {math_atan2, inf, -inf, 0x1.2d97c7f3321d2p+1},
        {math_atan2, -inf, -inf, -0x1.2d97c7f3321d2p+1},
        {math_atan2, 1, 1, M_PI_4},
        {math_atan2, 0x1p-1074, 0x1p-1074, M_PI_4},
        {math_atan2, DBL_MAX, -DBL_MAX, 0x1.2d97c7f3321d2p+1},
        {math_atan2, 0x1p-1074, DBL_MAX, 0.0},
        {math_atan2, 1, -NAN, NAN},
        {math_atan2, -NAN, 1, NAN},
    };
    check_binary(rows, COUNT(rows));
}

/* C11 F.10.4.4, in its order. */
static void pow_special_cases(void **state)
{
    (void)state;
    static const double inf = INFINITY;
    const struct binary_case rows[] = {
        {math_pow, 0.0, -3, inf},      {math_pow, -0.0, -3, -inf},   {math_pow, 0.0, -2, inf},
        {math_pow, -0.0, -2, inf},     {math_pow, -0.0, -0.5, inf},  {math_pow, -0.0, -0x1p+53, inf},
        {math_pow, 0.0, -inf, inf},    {math_pow, -0.0, -inf, inf},  {math_pow, 0.0, 3, 0.0},
        {math_pow, -0.0, 3, -0.0},     {math_pow, 0.0, 2, 0.0},      {math_pow, -0.0, 2, 0.0},
        {math_pow, -0.0, 0.5, 0.0},    {math_pow, -0.0, inf, 0.0},   {math_pow, -1, inf, 1},
        {math_pow, -1, -inf, 1},       {math_pow, 1, 7.5, 1},        {math_pow, 1, -NAN, 1},
        {math_pow, 1, inf, 1},         {math_pow, 3, 0.0, 1},        {math_pow, -NAN, -0.0, 1},
        {math_pow, inf, 0.0, 1},       {math_pow, 0.0, 0.0, 1},      {math_pow, -2, 0.5, NAN},
        {math_pow, -DBL_MAX, 1e-9, NAN}, {math_pow, 0.5, -inf, inf}, {math_pow, -0.5, -inf, inf},
        {math_pow, 2, -inf, 0.0},      {math_pow, -2, -inf, 0.0},    {math_pow, 0.5, inf, 0.0},
        {math_pow, -0.5, inf, 0.0},    {math_pow, 2, inf, inf},      {math_pow, -2, inf, inf},
        {math_pow, -inf, -3, -0.0},    {math_pow, -inf, -2, 0.0},    {math_pow, -inf, -0.5, 0.0},
        {math_pow, -inf, 3, -inf},     {math_pow, -inf, 2, inf},     {math_pow, -inf, 0.5, inf},
        {math_pow, inf, -1, 0.0},      {math_pow, inf, 1, inf},      {math_pow, -NAN, 1, NAN},
        {math_pow, 2, -NAN, NAN},      {math_pow, -1, 3, -1},        {math_pow, -1, 1e300, 1},
        {math_pow, -2, 1025, -inf},    {math_pow, -2, -1077, -0.0},  {math_pow, 2, DBL_MAX, inf},
        {math_pow, 0x1.fffffffffffffp-1, DBL_MAX, 0.0},              {math_pow, 3, 0x1p-1074, 1},
        {math_pow, 2, -1074, 0x1p-1074}, {math_pow, 0x1p-1074, 1, 0x1p-1074}, {math_pow, DBL_MAX, 1, DBL_MAX},
        {math_pow, -DBL_MAX, 1, -DBL_MAX}, {math_pow, 0x1p-1074, -0.5, 0x1p+537},
    };
    check_binary(rows, COUNT(rows));
}

static void degrees_are_exact_where_the_result_is(void **state)
{
    (void)state;
    static const double sines[12] = {0, 0.5, NAN, 1, NAN, 0.5, 0, -0.5, NAN, -1, NAN, -0.5};
    for (int k = -1200; k <= 1200; k++) {
        double sine = sines[((k % 12) + 12) % 12], cosine = sines[((k + 3) % 12 + 12) % 12];
        if (!isnan(sine))
            assert_true(bits_of(math_sin_degrees(30.0 * k)) == bits_of(sine == 0 && k < 0 ? -0.0 : sine));
        if (!isnan(cosine))
            assert_true(bits_of(math_cos_degrees(30.0 * k)) == bits_of(cosine));
    }
    assert_true(math_sin_degrees(360 * 0x1p+60 + 0x1p+20 * 90) == 0);
}

/* All x^y of integers x and y whose result has at most 53 bits, and the square, fourth, … roots of those. */
static void small_integer_powers_are_exact(void **state)
{
    (void)state;
    for (int x = 2; x <= 1000; x++) {
        double power = x;
        for (int y = 1; power <= 0x1p+53; y++, power *= x)
            if (math_pow(x, y) != power || math_pow(-x, y) != (y % 2 ? -power : power) ||
                ((y & (y - 1)) == 0 && math_pow(power, 1.0 / y) != x))
                fail_msg("%d^%d or its root is not exact", x, y);
    }
    for (int y = -1074; y <= 1023; y++)
        assert_true(math_pow(2, y) == ldexp(1, y));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unary_special_cases),
        cmocka_unit_test(atan2_special_cases),
        cmocka_unit_test(pow_special_cases),
        cmocka_unit_test(degrees_are_exact_where_the_result_is),
        cmocka_unit_test(small_integer_powers_are_exact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
