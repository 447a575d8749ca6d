/* Where the status page listens, which Host names are this machine's own, and the token of a request. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "coordinator/http_address.h"
#include "coordinator/http_token.h"

static void test_addresses(void **state)
{
    (void)state;
    static const struct {
        const char *text, *url;
        bool local;
    } cases[] = {
        {"8080", "http://127.0.0.1:8080/", true},
        {":0", "http://127.0.0.1:0/", true},
        {"localhost:80", "http://127.0.0.1:80/", true},
        {"127.8.9.10:1", "http://127.8.9.10:1/", true},
        {"192.0.2.1:65535", "http://192.0.2.1:65535/", false},
        {"*:8080", "http://0.0.0.0:8080/", false},
        {"[::1]:8080", "http://[::1]:8080/", true},
        {"[::]:8080", "http://[::]:8080/", false},
        {"[2001:db8::7]:8080", "http://[2001:db8::7]:8080/", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct http_address address;
        struct error error;
        char url[HTTP_URL_BYTES];
        assert_int_equal(http_address_parse(cases[i].text, &address, &error), STATUS_OK);
        http_address_url(&address, url);
        assert_string_equal(url, cases[i].url);
        assert_int_equal(http_address_is_local(&address), cases[i].local);
    }
}

static void test_bad_addresses(void **state)
{
    (void)state;
    static const char *const cases[] = {"", ":", "x", "host.example:80", "::1:80", "[::1]", "[127.0.0.1]:80", "8080:",
                                        "127.0.0.1:65536", "127.0.0.1:-1", "127.0.0.1: 80", "[::1:80", "127.1:80",
                                        "http://127.0.0.1:80", "127.0.0.1:80/"};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct http_address address;
        struct error error = {""};
        if (http_address_parse(cases[i], &address, &error) != STATUS_USAGE)
            fail_msg("\"%s\" was taken", cases[i]);
        assert_memory_equal(error.text, "--http", strlen("--http"));
    }
}

static void test_hosts(void **state)
{
    (void)state;
    static const char *const own[] = {"localhost", "LOCALHOST:9", "127.0.0.1", "127.0.0.1:8080", "[::1]:1", "[::1]",
                                      "127.200.0.1"};
    static const char *const strange[] = {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "*",
                                          "192.0.2.1", "[::2]", "localhost:80x", "[::1]x", "[::1", ":80", "0.0.0.0"};
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        if (!http_host_is_local(own[i]))
            fail_msg("\"%s\" was refused", own[i]);
    for (size_t i = 0; i < sizeof strange / sizeof *strange; i++)
        if (http_host_is_local(strange[i]))
            fail_msg("\"%s\" was taken", strange[i]);
    assert_false(http_host_is_local(NULL));
}

/* Writes the file, and says how reading it went. */
static enum status read_token(const char *text, mode_t mode, struct http_token *token, struct error *error)
{
    char path[] = "/tmp/weft-token.XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    assert_int_equal(write(file, text, strlen(text)), strlen(text));
    assert_int_equal(fchmod(file, mode), 0);
    close(file);
    enum status status = http_token_read(path, token, error);
    unlink(path);
    return status;
}

static void test_token(void **state)
{
    (void)state;
    struct http_token token;
    struct error error;
    assert_int_equal(read_token("0123456789abcdef+/=\n", 0600, &token, &error), STATUS_OK);
    assert_true(http_token_matches(&token, "Bearer 0123456789abcdef+/="));
    assert_true(http_token_matches(&token, "bearer 0123456789abcdef+/="));
    static const char *const wrong[] = {"", "Bearer", "Bearer ", "Bearer 0123456789abcdef+/", "0123456789abcdef+/=",
                                        "Bearer 0123456789abcdef+/=\n", "Bearer 0123456789abcdef+/==",
                                        "Bearer 0123456789Abcdef+/=", "Basic 0123456789abcdef+/="};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        if (http_token_matches(&token, wrong[i]))
            fail_msg("\"%s\" was taken", wrong[i]);
    assert_false(http_token_matches(&token, NULL));
}

static void test_bad_tokens(void **state)
{
    (void)state;
    struct http_token token;
    struct error error;
    assert_int_equal(read_token("0123456789abcdef\n", 0640, &token, &error), STATUS_INPUT);
    assert_non_null(strstr(error.text, "found mode 0640"));
    assert_int_equal(read_token("0123456789abcde\n", 0600, &token, &error), STATUS_INPUT);
    assert_non_null(strstr(error.text, "found 15"));
    assert_int_equal(read_token("", 0600, &token, &error), STATUS_INPUT);
    assert_int_equal(read_token("0123456789abcdef ghijk\n", 0600, &token, &error), STATUS_INPUT);
    assert_non_null(strstr(error.text, "at 17"));
    assert_int_equal(read_token("0123456789abcdef\n0123456789abcdef\n", 0600, &token, &error), STATUS_INPUT);
    char large[400];
    memset(large, 'a', sizeof large - 1);
    large[sizeof large - 1] = '\0';
    assert_int_equal(read_token(large, 0600, &token, &error), STATUS_INPUT);
    assert_int_equal(http_token_read("/nowhere/at/all", &token, &error), STATUS_INPUT);
    assert_int_equal(http_token_read("/tmp", &token, &error), STATUS_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_addresses), cmocka_unit_test(test_bad_addresses), cmocka_unit_test(test_hosts),
        cmocka_unit_test(test_token),     cmocka_unit_test(test_bad_tokens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
