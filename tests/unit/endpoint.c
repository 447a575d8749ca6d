/* Endpoints: which texts are taken, what they become, and which are local. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "wire/socket.h"

static struct error error;

static const struct {
    const char *text;
    const char *full; /* NULL: refused */
    bool local;
} endpoints[] = {
    {"tcp://127.0.0.1:7420", "tcp://127.0.0.1:7420", true},
    {"tcp://127.9.9.9:1", "tcp://127.9.9.9:1", true},
    {"tcp://[::1]:7420", "tcp://[::1]:7420", true},
    {"[::1]", "tcp://[::1]:7420", true},
    {"[::1]:99", "tcp://[::1]:99", true},
    {"localhost", "tcp://127.0.0.1:7420", true},
    {"localhost:*", "tcp://127.0.0.1:*", true},
    {"ipc:///run/weft.sock", "ipc:///run/weft.sock", true},
    {"ipc://socket", "ipc://socket", true},
    {"tcp://*:*", "tcp://*:*", false},
    {"*", "tcp://*:7420", false},
    {"*:65535", "tcp://*:65535", false},
    {"node-17.farm.example:80", "tcp://node-17.farm.example:80", false},
    {"node17", "tcp://node17:7420", false},
    {"10.0.0.7", "tcp://10.0.0.7:7420", false},
    {"128.0.0.1", "tcp://128.0.0.1:7420", false},
    {"127.example.com", "tcp://127.example.com:7420", false},
    {"localhost.example", "tcp://localhost.example:7420", false},
    {"[2001:db8::7]", "tcp://[2001:db8::7]:7420", false},
    {"[fe80::1%eth0]:7420", "tcp://[fe80::1%eth0]:7420", false},
    {"", NULL, false},
    {":7420", NULL, false},
    {"tcp://", NULL, false},
    {"tcp://host", NULL, false},
    {"tcp://host:", NULL, false},
    {"host:", NULL, false},
    {"host:0", NULL, false},
    {"host:65536", NULL, false},
    {"host:100000", NULL, false},
    {"host:18446744073709551617", NULL, false},
    {"host:-1", NULL, false},
    {"host:+1", NULL, false},
    {"host: 1", NULL, false},
    {"host:7420x", NULL, false},
    {"host:080", NULL, false},
    {"host:**", NULL, false},
    {"-host", NULL, false},
    {"ho st", NULL, false},
    {"host/path", NULL, false},
    {"10.0.0.7;10.0.0.8:7420", NULL, false},
    {"udp://host:7420", NULL, false},
    {"inproc://name", NULL, false},
    {"::1", NULL, false},
    {"2001:db8::7", NULL, false},
    {"[::1", NULL, false},
    {"[]", NULL, false},
    {"[::1]7420", NULL, false},
    {"[host]:7420", NULL, false},
    {"[127.0.0.1]:7420", NULL, false},
    {"ipc://", NULL, false},
    {"ipc://*", NULL, false},
    {"ipc://@abstract", NULL, false},
};

static void test_endpoints(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof endpoints / sizeof *endpoints; i++) {
        char full[WIRE_ENDPOINT_BYTES] = "";
        error.text[0] = '\0';
        enum status status = wire_endpoint_parse(endpoints[i].text, full, &error);
        if (status != (endpoints[i].full ? STATUS_OK : STATUS_USAGE))
            fail_msg("\"%s\": status %d, \"%s\", \"%s\"", endpoints[i].text, status, full, error.text);
        if (status != STATUS_OK) {
            assert_non_null(strstr(error.text, endpoints[i].text));
            continue;
        }
        assert_string_equal(full, endpoints[i].full);
        assert_int_equal(wire_endpoint_is_local(full), endpoints[i].local);
    }
    assert_true(wire_endpoint_is_local("tcp://localhost:7420"));
}

static void test_endpoint_lengths(void **state)
{
    (void)state;
    char text[400], full[WIRE_ENDPOINT_BYTES];
    memset(text, 'p', sizeof text);
    memcpy(text, "ipc:///", 7);
    text[6 + 107] = '\0';
    assert_int_equal(wire_endpoint_parse(text, full, &error), STATUS_OK);
    assert_string_equal(full, text);
    text[6 + 107] = 'p';
    text[6 + 108] = '\0';
    assert_int_equal(wire_endpoint_parse(text, full, &error), STATUS_USAGE);
    assert_non_null(strstr(error.text, "at most 107 bytes, found 108"));
    memset(text, 'h', sizeof text);
    text[sizeof text - 1] = '\0';
    assert_int_equal(wire_endpoint_parse(text, full, &error), STATUS_USAGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_endpoints),
        cmocka_unit_test(test_endpoint_lengths),
    };
    return cmocka_run_group_tests_name("endpoint", tests, NULL, NULL);
}
