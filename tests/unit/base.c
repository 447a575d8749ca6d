/* The smaller parts of base/: errors, digests, the integer hash, log lines, memory, processors, the clock. */
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/cpu.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/memory.h"

#if defined __SANITIZE_ADDRESS__
enum { SANITIZED = 1 };
#elif defined __has_feature
enum { SANITIZED = __has_feature(address_sanitizer) };
#else
enum { SANITIZED = 0 };
#endif

/* --- errors ----------------------------------------------------------------------------------------------- */

static void test_error(void **state)
{
    (void)state;
    struct error error;
    assert_int_equal(error_set(&error, STATUS_INPUT, "expected %d, found %s", 3, "four"), STATUS_INPUT);
    assert_string_equal(error.text, "expected 3, found four");
    assert_int_equal(error_prefix(&error, STATUS_OUTPUT, "%s: ", "scene.json"), STATUS_OUTPUT);
    assert_string_equal(error.text, "scene.json: expected 3, found four");
}

static void test_long_error(void **state)
{
    (void)state;
    struct error error;
    char text[2000];
    memset(text, 'a', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    error_set(&error, STATUS_FAILED, "%s", text);
    assert_int_equal(strlen(error.text), sizeof error.text - 1);
    error_prefix(&error, STATUS_FAILED, "bb");
    assert_int_equal(strlen(error.text), sizeof error.text - 1);
    assert_int_equal(strspn(error.text, "b"), 2);
    memset(text, 'c', sizeof text - 1);
    error_prefix(&error, STATUS_FAILED, "%s", text);
    assert_int_equal(strspn(error.text, "c"), sizeof error.text - 1);
}

/* --- digests ---------------------------------------------------------------------------------------------- */

static void assert_digest(const void *data, size_t size, const char *expected)
{
    char hex[DIGEST_HEX_BYTES];
    struct digest digest = digest_of(data, size);
    digest_hex(&digest, hex);
    assert_string_equal(hex, expected);
}

/* FIPS 180-2, appendix B, and NIST's example messages: the empty one, one block, two blocks, and a million letters. */
static void test_digest(void **state)
{
    (void)state;
    assert_digest(NULL, 0, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    assert_digest("abc", 3, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_digest("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56,
                  "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    assert_digest("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrs"
                  "mnopqrstnopqrstu", 112, "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
    char *letters = memory_array(1000000, 1);
    memset(letters, 'a', 1000000);
    assert_digest(letters, 1000000, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
    free(letters);
}

static void test_digest_equal(void **state)
{
    (void)state;
    struct digest a = digest_of("a", 1), b = a;
    assert_true(digest_equal(&a, &b));
    for (size_t i = 0; i < DIGEST_BYTES; i++) {
        b.bytes[i] ^= 1;
        assert_false(digest_equal(&a, &b));
        b.bytes[i] ^= 1;
    }
}

/* Published values of MurmurHash3's fmix32, and what makes it a good mixer: over 4,096 inputs every input bit changes
 * every output bit in near half of the cases. The spread of a fair coin is 32; five times that is allowed. */
static void test_hash(void **state)
{
    (void)state;
    assert_int_equal(hash_u32(0), 0);
    assert_int_equal(hash_u32(1), 0x514e28b7);
    for (uint32_t in = 0; in < 32; in++) {
        int changes[32] = {0};
        for (uint32_t x = 0; x < 4096; x++) {
            uint32_t difference = hash_u32(x * 2654435761u) ^ hash_u32(x * 2654435761u ^ 1u << in);
            for (uint32_t out = 0; out < 32; out++)
                changes[out] += difference >> out & 1;
        }
        for (uint32_t out = 0; out < 32; out++)
            assert_in_range(changes[out], 2048 - 5 * 32, 2048 + 5 * 32);
    }
}

/* --- children: what a process says on standard error, and how it ends ------------------------------------- */

/* Runs `work` in a child. Returns what waitpid tells of it; what it wrote to standard error goes to text[capacity]. */
static int run_child(void (*work)(void), char *text, size_t capacity)
{
    int ends[2], how;
    size_t length = 0;
    fflush(NULL);
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        work();
        _exit(0);
    }
    close(ends[1]);
    for (ssize_t got; (got = read(ends[0], text + length, capacity - 1 - length)) > 0;)
        length += (size_t)got;
    text[length] = '\0';
    close(ends[0]);
    assert_int_equal(waitpid(child, &how, 0), child);
    return how;
}

static void hide(void *context)
{
    *(int *)context += 1;
    fputs("<", stderr);
}

static void show(void *context)
{
    fprintf(stderr, "%d>", *(int *)context);
}

static void write_lines(void)
{
    int count = 0;
    log_error("first %d", 1);
    log_info("not shown before log_start");
    log_start("prog", LOG_INFO);
    log_set_display(hide, show, &count);
    log_warning("second");
    log_debug("not shown");
    log_info("one\nline, \x1b[31mnot red\x7f, ä");
    log_set_display(NULL, NULL, NULL);
    log_start("prog", LOG_DEBUG);
    log_debug("third");
    log_start("prog", LOG_SILENT);
    log_error("not shown");
}

static void test_log(void **state)
{
    (void)state;
    char text[1024];
    assert_int_equal(run_child(write_lines, text, sizeof text), 0);
    assert_string_equal(text, "weft: first 1\n"
                              "<prog: warning: second\n1>"
                              "<prog: one�line, �[31mnot red�, ä\n2>"
                              "prog: debug: third\n");
}

static void write_long_lines(void)
{
    char text[4096];
    memset(text, 'x', sizeof text);
    for (int length = 2030; length < 2060; length++)
        log_error("%.*s", length, text);
    log_error("%.*s", 4096, text);
}

/* Every call gives one line, cut where it is too long. */
static void test_long_log_lines(void **state)
{
    (void)state;
    static char text[100000];
    assert_int_equal(run_child(write_long_lines, text, sizeof text), 0);
    const char *at = text;
    for (size_t i = 0; i < 31; i++) {
        size_t length = strcspn(at, "\n"), wanted = i < 30 ? 2030 + i : 4096;
        assert_int_equal(length, 6 + (wanted < 2047 ? wanted : 2047));
        at += length + 1;
    }
    assert_string_equal(at, "");
}

/* Reads a whole file, ends it with NUL, and removes it. */
static void take_file(const char *path, char *text, size_t capacity)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, capacity - 1, file)] = '\0';
    fclose(file);
    unlink(path);
}

static char log_path[] = "/tmp/weft-test-base.XXXXXX";

/* What a file gets: more than is shown; appended. The time stands first. */
static void write_log_file(void)
{
    struct error error;
    for (int round = 0; round < 2; round++) {
        log_start("prog", LOG_WARNING);
        if (log_open(log_path, round == 1, &error) != STATUS_OK)
            log_error("%s", error.text);
        log_warning("shown \"%d\"", round);
        log_info("kept\xff\t");
        log_debug("neither");
        log_start("prog", LOG_DEBUG);
        log_debug("both");
        log_close();
    }
    log_error("not kept");
}

static void test_log_file(void **state)
{
    (void)state;
    char text[4096];
    int file = mkstemp(log_path);
    assert_true(file >= 0);
    close(file);
    assert_int_equal(run_child(write_log_file, text, sizeof text), 0);
    assert_string_equal(text, "prog: warning: shown \"0\"\nprog: debug: both\n"
                              "prog: warning: shown \"1\"\nprog: debug: both\nprog: not kept\n");
    take_file(log_path, text, sizeof text);
    static const char *const expected[] = {
        " warning prog[#]: shown \"0\"",
        " info prog[#]: kept\xef\xbf\xbd\xef\xbf\xbd",
        " debug prog[#]: both",
        "\",\"level\":\"warning\",\"program\":\"prog\",\"pid\":#,\"message\":\"shown \\\"1\\\"\"}",
        "\",\"level\":\"info\",\"program\":\"prog\",\"pid\":#,\"message\":\"kept\xef\xbf\xbd\xef\xbf\xbd\"}",
        "\",\"level\":\"debug\",\"program\":\"prog\",\"pid\":#,\"message\":\"both\"}",
    };
    char *rest = text;
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        char line[256], *end = strchr(rest, '\n');
        int year, month, day, hour, minute, second, milliseconds, pid, at = 0;
        assert_non_null(end);
        *end = '\0';
        if (i >= 3) {
            assert_memory_equal(rest, "{\"time\":\"", 9);
            rest += 9;
        }
        assert_int_equal(sscanf(rest, "%4d-%2d-%2dT%2d:%2d:%2d.%3dZ%n", &year, &month, &day, &hour, &minute, &second,
                                &milliseconds, &at), 7);
        assert_int_equal(at, 24);
        const char *mark = strchr(expected[i], '#');
        char *found = rest + at + (mark - expected[i]);
        assert_int_equal(sscanf(found, "%d%n", &pid, &at), 1);
        snprintf(line, sizeof line, "%.*s%d%s", (int)(mark - expected[i]), expected[i], pid, mark + 1);
        assert_string_equal(rest + 24, line);
        rest = end + 1;
    }
    assert_string_equal(rest, "");
}

static void write_json(void)
{
    struct error error;
    log_start("prog", LOG_WARNING);
    log_open(NULL, true, &error);
    log_info("not shown");
    log_error("all");
}

static void test_log_json_alone(void **state)
{
    (void)state;
    char text[4096];
    assert_int_equal(run_child(write_json, text, sizeof text), 0);
    assert_non_null(strstr(text, "Z\",\"level\":\"error\",\"program\":\"prog\",\"pid\":"));
    assert_non_null(strstr(text, ",\"message\":\"all\"}\n"));
    assert_null(strstr(text, "not shown"));
}

static void listen_to(void *context, enum log_level level, const char *text)
{
    fprintf(stderr, "(%s %s %s)", (const char *)context, log_level_name(level), text);
}

/* No room for a line is told once; a listener hears all the same. */
static void write_to_full_file(void)
{
    struct error error;
    log_start("prog", LOG_ERROR);
    if (log_open("/nowhere/log", false, &error) == STATUS_OUTPUT)
        log_error("%s", error.text);
    log_start("prog", LOG_WARNING);
    log_open("/dev/full", false, &error);
    log_info("one");
    log_set_listener(listen_to, "heard");
    log_info("two");
    log_error("three");
    log_debug("not heard");
    log_set_listener(NULL, NULL);
    log_close();
}

static void test_log_that_cannot_be_written(void **state)
{
    (void)state;
    char text[4096];
    assert_int_equal(run_child(write_to_full_file, text, sizeof text), 0);
    assert_string_equal(text, "prog: /nowhere/log: the folder /nowhere is not there\n"
                              "prog: warning: lines are missing in the log: No space left on device\n"
                              "(heard info two)prog: three\n(heard error three)");
}

/* --- memory ----------------------------------------------------------------------------------------------- */

static void limit_memory(void)
{
    setrlimit(RLIMIT_AS, &(struct rlimit){256 << 20, 256 << 20});
}

static void exhaust_array(void)
{
    limit_memory();
    memory_array((size_t)1 << 30, 1);
}

static void exhaust_resize(void)
{
    limit_memory();
    free(memory_resize(memory_array(100, 1), (size_t)1 << 30, 1));
}

static void exhaust_bytes(void)
{
    limit_memory();
    struct bytes bytes = {0};
    bytes_extend(&bytes, (size_t)1 << 30);
    bytes_finish(&bytes);
}

static void overflow_array(void)
{
    memory_array(SIZE_MAX / 2, 3);
}

static void overflow_resize(void)
{
    free(memory_resize(NULL, SIZE_MAX / 2, 3));
}

static void overflow_grow(void)
{
    size_t capacity = 0;
    free(memory_grow(NULL, &capacity, SIZE_MAX / 8 + 1, 16));
}

static void assert_out_of_memory(void (*work)(void))
{
    char text[1024];
    int how = run_child(work, text, sizeof text);
    assert_true(WIFEXITED(how));
    assert_int_equal(WEXITSTATUS(how), STATUS_INTERNAL);
    assert_ptr_equal(strstr(text, "weft: out of memory ("), text);
    assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1);
}

/* The sanitizer ends the process itself on such sizes and takes terabytes of address space, so these run without it. */
static void test_out_of_memory(void **state)
{
    (void)state;
    if (!SANITIZED) {
        assert_out_of_memory(exhaust_array);
        assert_out_of_memory(exhaust_resize);
        assert_out_of_memory(exhaust_bytes);
        assert_out_of_memory(overflow_array);
    }
    assert_out_of_memory(overflow_resize);
    assert_out_of_memory(overflow_grow);
}

static void test_arrays(void **state)
{
    (void)state;
    uint8_t *block = memory_array(1000, 3);
    for (size_t i = 0; i < 3000; i++)
        assert_int_equal(block[i], 0);
    block = memory_resize(block, 10, 1);
    free(memory_array(0, 8));
    free(memory_array(8, 0));
    void *none = memory_resize(NULL, 0, 8);
    assert_non_null(none);
    free(none);
    free(block);
}

/* Growing one by one to n elements moves the block about log2(n) times, and keeps what it holds. */
static void test_growth(void **state)
{
    (void)state;
    uint32_t *block = NULL;
    size_t capacity = 0, moves = 0;
    for (uint32_t i = 0; i < 100000; i++) {
        size_t before = capacity;
        block = memory_grow(block, &capacity, i + 1, sizeof *block);
        assert_true(capacity > i);
        assert_true(capacity == before || capacity >= 2 * before);
        moves += capacity != before;
        block[i] = i;
    }
    assert_true(moves <= 17);
    for (uint32_t i = 0; i < 100000; i++)
        assert_int_equal(block[i], i);
    uint32_t *same = memory_grow(block, &capacity, 5, sizeof *block);
    assert_ptr_equal(same, block);
    size_t far = 10 * capacity;
    block = memory_grow(block, &capacity, far, sizeof *block);
    assert_int_equal(capacity, far);
    assert_int_equal(block[99999], 99999);
    free(block);
}

static void test_strings(void **state)
{
    (void)state;
    char *copy = memory_string("wärp"), *empty = memory_string(""), *made = memory_format("%d/%s", 7, "x");
    assert_string_equal(copy, "wärp");
    assert_string_equal(empty, "");
    assert_string_equal(made, "7/x");
    free(copy);
    free(empty);
    free(made);
}

/* --- processors and time ---------------------------------------------------------------------------------- */

static void test_cpu(void **state)
{
    (void)state;
    cpu_set_t all, one;
    assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
    assert_in_range(cpu_available(), 1, CPU_COUNT(&all));
    for (int cpu = 0; cpu < CPU_SETSIZE; cpu++) {
        if (!CPU_ISSET(cpu, &all))
            continue;
        CPU_ZERO(&one);
        CPU_SET(cpu, &one);
        assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
        assert_int_equal(cpu_available(), 1);
    }
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
}

static void test_clock(void **state)
{
    (void)state;
    int64_t before_us = clock_now_us(), before_ms = clock_now_ms();
    usleep(2000);
    int64_t after_us = clock_now_us(), after_ms = clock_now_ms();
    assert_true(after_us - before_us >= 2000);
    assert_true(after_ms - before_ms >= 1);
    assert_true(before_ms >= before_us / 1000 && after_ms >= after_us / 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error),         cmocka_unit_test(test_long_error),
        cmocka_unit_test(test_digest),        cmocka_unit_test(test_digest_equal),
        cmocka_unit_test(test_hash),          cmocka_unit_test(test_log),
        cmocka_unit_test(test_long_log_lines), cmocka_unit_test(test_log_file),
        cmocka_unit_test(test_log_json_alone), cmocka_unit_test(test_log_that_cannot_be_written),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_arrays),        cmocka_unit_test(test_growth),
        cmocka_unit_test(test_strings),       cmocka_unit_test(test_cpu),
        cmocka_unit_test(test_clock),
    };
    return cmocka_run_group_tests_name("base", tests, NULL, NULL);
}
