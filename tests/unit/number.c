/*
 * number_read is strtod: the same bits for random numbers of every form, in any locale, and the same end.
 */
#include "scene/number.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"

static uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* The whole text is a number, with strtod's bits. */
static void assert_like_strtod(const char *text)
{
    double value = 0, expected = strtod(text, NULL);
    const char *end = number_read(text, &value);
    if (!end || *end || bits_of(value) != bits_of(expected))
        fail_msg("%s: expected %a, found %a, rest \"%s\"", text, expected, value, end ? end : "(no number)");
}

static uint32_t draw(uint32_t index, uint32_t number)
{
    return hash_u32(hash_u32(TEST_SEED + number) ^ index);
}

/* --- random numbers --------------------------------------------------------------------------------------- */

enum { RANDOM_COUNT = 1000000 };

/* As programs print coordinates: few digits, small exponents. */
static void coordinates_are_those_of_strtod(void **state)
{
    (void)state;
    char text[64];
    for (uint32_t i = 0; i < RANDOM_COUNT; i++) {
        snprintf(text, sizeof text, i % 2 ? "%.*f" : "%.*g", (int)(draw(i, 1) % 10),
                 random_between(i, 0, -1e3, 1e3));
        assert_like_strtod(text);
    }
}

/* Doubles of any exponent, with 15 to 17 digits: most are beyond the exact path. */
static void doubles_of_any_size_are_those_of_strtod(void **state)
{
    (void)state;
    char text[64];
    for (uint32_t i = 0; i < RANDOM_COUNT; i++) {
        uint64_t bits = (uint64_t)draw(i, 0) << 32 | draw(i, 1);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value))
            continue;
        snprintf(text, sizeof text, "%.*e", (int)(14 + draw(i, 2) % 3), value);
        assert_like_strtod(text);
    }
}

/* Up to 25 random digits with a point anywhere and an exponent from −30 to 30: around the limits of the exact
 * path. */
static void strings_of_digits_are_those_of_strtod(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < RANDOM_COUNT; i++) {
        char text[64];
        size_t length = 0, digits = 1 + draw(i, 0) % 25, point = draw(i, 1) % (digits + 1);
        for (size_t k = 0; k < digits; k++) {
            if (k == point)
                text[length++] = '.';
            text[length++] = (char)('0' + draw(i, 10 + (uint32_t)k) % 10);
        }
        snprintf(text + length, sizeof text - length, "e%d", (int)(draw(i, 2) % 61) - 30);
        assert_like_strtod(text);
    }
}

/* --- forms ------------------------------------------------------------------------------------------------ */

static void all_forms_are_read(void **state)
{
    (void)state;
    static const char *const texts[] = {"0",
                                        "-0",
                                        "+1",
                                        "1.",
                                        ".5",
                                        "-.5e-3",
                                        "00012",
                                        "1E5",
                                        "1e+05",
                                        "9007199254740992",
                                        "9007199254740993",
                                        "9007199254740993.0",
                                        "18446744073709551615",
                                        "18446744073709551616",
                                        "184467440737095516150000000001",
                                        "1e22",
                                        "1e23",
                                        "1e-22",
                                        "1e-23",
                                        "123456789e15",
                                        "4.9406564584124654e-324",
                                        "2.4703282292062327e-324",
                                        "2.4703282292062328e-324",
                                        "1e-400",
                                        "1e400",
                                        "-1e99999999999",
                                        "1e-99999999999",
                                        "2.2250738585072011e-308",
                                        "1.7976931348623157e308",
                                        "1.7976931348623159e308",
                                        "0.00000000000000000000000000000000000000000000000001e50",
                                        "0e99999999999",
                                        "8.5",
                                        "0.1"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_like_strtod(texts[i]);
}

static void what_is_no_number_is_none(void **state)
{
    (void)state;
    static const char *const texts[] = {"",    "-",   "+",    ".",  "-.", "e5",  ".e5",
                                        "nan", "inf", "-inf", "x1", " 1", "--1", "+-1"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double value = 42;
        assert_null(number_read(texts[i], &value));
        assert_true(value == 42);
    }
}

static void it_ends_where_the_number_ends(void **state)
{
    (void)state;
    static const char *const rests[][2] = {{"0x10", "x10"},  {"1e", "e"},   {"1e+", "e+"}, {"1.5.5", ".5"},
                                           {"12abc", "abc"}, {"3,5", ",5"}, {"1-2", "-2"}, {"7 8", " 8"}};
    for (size_t i = 0; i < sizeof rests / sizeof *rests; i++) {
        double value;
        assert_string_equal(number_read(rests[i][0], &value), rests[i][1]);
    }
}

/* A locale with a decimal comma, if there is one on this machine; the slow path must not take it either. */
static void the_locale_does_not_count(void **state)
{
    (void)state;
    double value = 0;
    if (!setlocale(LC_NUMERIC, "de_DE.UTF-8"))
        print_message("# no de_DE.UTF-8 here: only the C locale is tested\n");
    number_read("1.2345678901234567890123", &value);
    setlocale(LC_NUMERIC, "C");
    assert_true(value == 1.2345678901234567890123);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coordinates_are_those_of_strtod),
        cmocka_unit_test(doubles_of_any_size_are_those_of_strtod),
        cmocka_unit_test(strings_of_digits_are_those_of_strtod),
        cmocka_unit_test(all_forms_are_read),
        cmocka_unit_test(what_is_no_number_is_none),
        cmocka_unit_test(it_ends_where_the_number_ends),
        cmocka_unit_test(the_locale_does_not_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
