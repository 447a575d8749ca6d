#include "scene/number.h"

#include <locale.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

/* A decimal: digits × 10^exponent. */
struct decimal {
    uint64_t digits;
    int64_t exponent;
    bool any; /* there was a digit */
    bool cut; /* more digits than fit: use strtod */
};

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* Reads digits; each one moves the point by `step` places. */
static const char *read_digits(const char *at, struct decimal *decimal, int step)
{
    const uint64_t full = (UINT64_MAX - 9) / 10;
    decimal->any |= is_digit(*at);
    for (; is_digit(*at); at++) {
        decimal->cut |= decimal->digits > full;
        if (!decimal->cut)
            decimal->digits = 10 * decimal->digits + (uint64_t)(*at - '0');
        decimal->exponent += step;
    }
    return at;
}

/* Reads an exponent if there is one, digits and all. */
static const char *read_exponent(const char *at, struct decimal *decimal)
{
    const int64_t enough = 1 << 20; /* larger ones are infinite or zero anyhow; strtod decides */
    if (*at != 'e' && *at != 'E')
        return at;
    const char *digit = at + 1 + (at[1] == '-' || at[1] == '+');
    if (!is_digit(*digit))
        return at;
    int64_t exponent = 0;
    for (; is_digit(*digit); digit++)
        exponent = exponent < enough ? 10 * exponent + (*digit - '0') : exponent;
    decimal->exponent += at[1] == '-' ? -exponent : exponent;
    return digit;
}

/* Exact: digits and power are doubles without error, so their product or quotient is rounded once (Clinger,
 * "How to Read Floating Point Numbers Accurately", 1990). */
static bool convert_exactly(const struct decimal *decimal, double *value)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                   1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (decimal->cut || decimal->digits > (uint64_t)1 << 53)
        return false;
    if (decimal->exponent < -22 || decimal->exponent > 22)
        return false;
    double digits = (double)decimal->digits;
    *value = decimal->exponent < 0 ? digits / power[-decimal->exponent] : digits * power[decimal->exponent];
    return true;
}

static double convert_with_strtod(const char *text)
{
    locale_t c = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
    double value = strtod_l(text, NULL, c);
    freelocale(c);
    return value;
}

const char *number_read(const char *text, double *value)
{
    struct decimal decimal = {0};
    bool negative = *text == '-';
    const char *at = read_digits(text + (negative || *text == '+'), &decimal, 0);
    if (*at == '.')
        at = read_digits(at + 1, &decimal, -1);
    if (!decimal.any)
        return NULL;
    at = read_exponent(at, &decimal);
    double magnitude;
    if (convert_exactly(&decimal, &magnitude))
        *value = negative ? -magnitude : magnitude;
    else
        *value = convert_with_strtod(text);
    return at;
}
