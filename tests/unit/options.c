/* Command lines: the parser against a table of argument vectors, and numbers at their edges. */
#include <limits.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/options.h"

enum { KEY_WAIT = 256, KEY_WATCH, KEY_ONCE };

static const struct option_spec specs[] = {
    OPTIONS_HEADING("Talk"),
    {'o', "output", "FILE", "where to"},
    {'q', "quiet", NULL, "say less"},
    {'v', "verbose", NULL, "say more"},
    OPTIONS_HEADING("Time"),
    {KEY_WAIT, "wait", "SECONDS", "how long"},
    {KEY_WATCH, "watch", NULL, "go on"},
    {KEY_ONCE, "once", NULL, "only once"},
    {0},
};

/* Writes what it is told: "q", "o=file", "wait=3", each followed by a space. */
static enum status note(void *context, int key, const char *argument, struct error *error)
{
    char *notes = context;
    for (size_t i = 0; specs[i].name; i++)
        if (specs[i].key == key)
            strcat(notes, key <= UCHAR_MAX ? (char[]){(char)key, '\0'} : specs[i].name);
    if (argument)
        strcat(strcat(notes, "="), argument);
    strcat(notes, " ");
    if (argument && strcmp(argument, "wrong") == 0)
        return error_set(error, STATUS_INPUT, "handed on untouched");
    return STATUS_OK;
}

enum { WORDS_MAX = 8 };

struct command_line {
    const char *words[WORDS_MAX]; /* after the program's name */
    const char *notes;            /* what was handled, then the operands in brackets */
    const char *error;            /* NULL: it is right */
};

static const struct command_line command_lines[] = {
    {{NULL}, "[]", NULL},
    {{"a", "b"}, "[a b ]", NULL},
    {{"-q", "a"}, "q [a ]", NULL},
    {{"--quiet", "--once"}, "q once []", NULL},
    {{"a", "-q", "b", "-v"}, "q v [a b ]", NULL}, /* operands move behind */
    {{"-qv", "a"}, "q v [a ]", NULL},
    {{"-qofile"}, "q o=file []", NULL},
    {{"-qo", "file"}, "q o=file []", NULL},
    {{"-o-q"}, "o=-q []", NULL},
    {{"--output", "file"}, "o=file []", NULL},
    {{"--output=file"}, "o=file []", NULL},
    {{"--output="}, "o= []", NULL},
    {{"--out", "file"}, "o=file []", NULL}, /* an abbreviation of one name only */
    {{"--wai=3"}, "wait=3 []", NULL},
    {{"-q", "--", "-v", "--nonsense"}, "q [-v --nonsense ]", NULL},
    {{"a", "--", "b"}, "[a b ]", NULL},
    {{"-"}, "[- ]", NULL}, /* standard input, by custom: an operand */
    {{"--"}, "[]", NULL},
    {{"--wa"}, "", "--wa: may stand for --wait, --watch"},
    {{"--w=3"}, "", "--w=3: may stand for --wait, --watch"},
    {{"--nonsense"}, "", "--nonsense: unknown option; see --help"},
    {{"-q", "--nonsense=3"}, "q ", "--nonsense=3: unknown option; see --help"},
    {{"--=3"}, "", "--=3: unknown option; see --help"}, /* a heading is none */
    {{"--quiet=3"}, "", "--quiet=3: --quiet takes no argument"},
    {{"--once=3"}, "", "--once=3: --once takes no argument"},
    {{"--onc=3"}, "", "--onc=3: --once takes no argument"},
    {{"-onc", "--qui="}, "o=nc ", "--qui=: --quiet takes no argument"},
    {{"-x"}, "", "unknown option -x"},
    {{"-qxv"}, "q ", "unknown option -x"},
    {{"-:q"}, "", "unknown option -:"},
    {{"-\xc3\xa4"}, "", "unknown option -\\xc3"},
    {{"-o"}, "", "-o: expected an argument"},
    {{"-qo"}, "q ", "-qo: expected an argument"},
    {{"a", "--output"}, "", "--output: expected an argument"},
    {{"--wait"}, "", "--wait: expected an argument"},
    {{"-q", "-o", "wrong", "-v"}, "q o=wrong ", "handed on untouched"},
};

static void check(const struct command_line *line)
{
    char copies[1 + WORDS_MAX][32] = {"program"}, notes[256] = "";
    char *argv[2 + WORDS_MAX] = {copies[0]};
    struct error error = {""};
    int argc = 1, first = -1;
    for (; line->words[argc - 1]; argc++) {
        strcpy(copies[argc], line->words[argc - 1]);
        argv[argc] = copies[argc];
    }
    enum status status = options_parse(argc, argv, specs, note, notes, &first, &error);
    if (status == STATUS_OK) {
        strcat(notes, "[");
        for (int i = first; i < argc; i++)
            strcat(strcat(notes, argv[i]), " ");
        strcat(notes, "]");
    }
    assert_string_equal(notes, line->notes);
    assert_string_equal(error.text, line->error ? line->error : "");
    enum status failure = strstr(notes, "wrong") ? STATUS_INPUT : STATUS_USAGE;
    assert_int_equal(status, line->error ? failure : STATUS_OK);
}

static void test_command_lines(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof command_lines / sizeof *command_lines; i++)
        check(&command_lines[i]);
}

static void test_help(void **state)
{
    (void)state;
    char text[1024] = "";
    FILE *to = fmemopen(text, sizeof text, "w");
    assert_non_null(to);
    options_help(to, specs);
    fclose(to);
    assert_string_equal(text, "Talk\n"
                              "  -o, --output FILE      where to\n"
                              "  -q, --quiet            say less\n"
                              "  -v, --verbose          say more\n"
                              "Time\n"
                              "      --wait SECONDS     how long\n"
                              "      --watch            go on\n"
                              "      --once             only once\n");
}

/* --- numbers ---------------------------------------------------------------------------------------------- */

static void assert_integer(const char *text, int64_t min, int64_t max, int64_t expected)
{
    struct error error;
    int64_t value = 12345;
    if (options_integer("--n", text, min, max, &value, &error) != STATUS_OK)
        fail_msg("refused: %s", error.text);
    assert_true(value == expected);
}

static void assert_no_integer(const char *text, int64_t min, int64_t max)
{
    struct error error = {""};
    int64_t value = 12345;
    if (options_integer("--n", text, min, max, &value, &error) != STATUS_USAGE)
        fail_msg("\"%s\" was taken as %lld", text, (long long)value);
    assert_int_equal(value, 12345);
    char found[64];
    snprintf(found, sizeof found, "found \"%s\"", text);
    assert_non_null(strstr(error.text, found));
    assert_ptr_equal(strstr(error.text, "--n: expected a whole number from "), error.text);
}

static void test_integers(void **state)
{
    (void)state;
    assert_integer("0", 0, 0, 0);
    assert_integer("007", 0, 10, 7);
    assert_integer("+7", 0, 10, 7);
    assert_integer("-7", -10, 10, -7);
    assert_integer("9223372036854775807", 0, INT64_MAX, INT64_MAX);
    assert_integer("-9223372036854775808", INT64_MIN, 0, INT64_MIN);
    static const char *const wrong[] = {"", " ", " 5", "5 ", "\t5", "5\n", "+", "-", "--5", "+-5", "- 5", "0x10",
                                        "5x", "1e3", "1.0", "five", "1,000", "9223372036854775808",
                                        "-9223372036854775809", "99999999999999999999999999"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_no_integer(wrong[i], INT64_MIN, INT64_MAX);
    assert_no_integer("0", 1, 10);
    assert_no_integer("11", 1, 10);
    assert_no_integer("-1", 0, 10);
}

static void assert_number(const char *text, double min, double max, double expected)
{
    struct error error;
    double value = 12345;
    if (options_number("--x", text, min, max, &value, &error) != STATUS_OK)
        fail_msg("refused: %s", error.text);
    assert_true(value == expected);
}

static void assert_no_number(const char *text, double min, double max)
{
    struct error error = {""};
    double value = 12345;
    if (options_number("--x", text, min, max, &value, &error) != STATUS_USAGE)
        fail_msg("\"%s\" was taken as %g", text, value);
    assert_true(value == 12345);
    assert_ptr_equal(strstr(error.text, "--x: expected a number from "), error.text);
}

static void test_numbers(void **state)
{
    (void)state;
    assert_number("0", 0, 0, 0);
    assert_number(".5", 0, 1, 0.5);
    assert_number("5.", 0, 9, 5);
    assert_number("+5e-3", 0, 1, 0.005);
    assert_number("-2.5E1", -100, 0, -25);
    assert_number("1", 0, 1, 1);
    assert_number("1e308", 0, INFINITY, 1e308);
    static const char *const wrong[] = {"", " ", " 1", "1 ", "\n1", "nan", "NAN", "-nan", "nan(1)", "inf", "-inf",
                                        "Infinity", "1e309", "-1e309", "0x10", "0x1p3", "1,5", "1.5.", "e5", "+",
                                        ".", "--1", "1d0", "1%"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_no_number(wrong[i], -INFINITY, INFINITY);
    assert_no_number("1.0000001", 0, 1);
    assert_no_number("-1e-300", 0, 1);
}

static void assert_no_size(const char *text)
{
    struct error error = {""};
    int64_t width = 0, height = 0;
    if (options_size("--size", text, 1, 65535, &width, &height, &error) != STATUS_USAGE)
        fail_msg("\"%s\" was taken as %lldx%lld", text, (long long)width, (long long)height);
    assert_ptr_equal(strstr(error.text, "--size: expected WIDTHxHEIGHT, each from 1 to 65535, found \""), error.text);
    assert_non_null(strstr(error.text, text));
}

static void test_sizes(void **state)
{
    (void)state;
    struct error error;
    int64_t width, height;
    assert_int_equal(options_size("--size", "1x65535", 1, 65535, &width, &height, &error), STATUS_OK);
    assert_int_equal(width, 1);
    assert_int_equal(height, 65535);
    static const char *const wrong[] = {"", "x", "640", "640x", "x480", "0x480", "640x0", "65536x1", "1x65536",
                                        "-640x480", "640x-480", "640 x 480", " 640x480", "640x480 ", "640x480x3",
                                        "640X480", "640*480", "6.4x4.8", "0x10x10", "640xx480",
                                        "00000000000000000000000000000000000000640x480",
                                        "640x99999999999999999999999"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_no_size(wrong[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_command_lines), cmocka_unit_test(test_help),  cmocka_unit_test(test_integers),
        cmocka_unit_test(test_numbers),       cmocka_unit_test(test_sizes),
    };
    return cmocka_run_group_tests_name("options", tests, NULL, NULL);
}
