/* Clients whose endpoint has a name: its address is found before they connect, and told where there is none. */
#include <dirent.h>

#include "tests/unit/socket_help.h"
#include "wire/socket_private.h"

/* A part of more than 63 characters is in no list of names, so no server of names is asked. */
#define TEN "xxxxxxxxxx"
#define NAMELESS "tcp://" TEN TEN TEN TEN TEN TEN TEN ".invalid:7420"

static void test_what_is_a_name(void **state)
{
    (void)state;
    static const struct {
        const char *endpoint, *name; /* NULL: it has none */
    } endpoints[] = {
        {"tcp://loom:7420", "loom"},         {"tcp://loom.example.org:1", "loom.example.org"},
        {"tcp://127.1:7420", "127.1"},       {"tcp://1.2.3.4.5:7420", "1.2.3.4.5"},
        {"tcp://192.0.2.1:7420", NULL},      {"tcp://[::1]:7420", NULL},
        {"tcp://*:7420", NULL},              {"tcp://loom:*", NULL},
        {"ipc://loom:7420", NULL},
    };
    for (size_t i = 0; i < sizeof endpoints / sizeof *endpoints; i++) {
        char name[WIRE_ENDPOINT_BYTES] = "";
        assert_int_equal(wire_endpoint_name(endpoints[i].endpoint, name), endpoints[i].name != NULL);
        if (endpoints[i].name)
            assert_string_equal(name, endpoints[i].name);
    }
}

/* 127.1 is 127.0.0.1 to the system alone. */
static void name_loopback(const char *bound, char named[WIRE_ENDPOINT_BYTES])
{
    snprintf(named, WIRE_ENDPOINT_BYTES, "tcp://127.1:%u", port_of(bound));
}

static void test_name_with_an_address(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES], named[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    name_loopback(bound, named);
    struct wire_client *client = join_and_greet(server, named, &peer);
    assert_false(wire_client_seeks_address(client));
    assert_int_equal(wire_client_reconnect(client, &error), STATUS_OK);
    assert_true(wire_client_seeks_address(client)); /* it may be another one now */
    greet_until_heard(client, "again", server, &peer);
    assert_int_equal(wire_client_name(client, &error), WIRE_NAME_SAME);
    leave(client);
    close_server(server);
}

static void test_name_without_an_address(void **state)
{
    (void)state;
    struct wire_client *client = join(NAMELESS);
    int64_t until = clock_now_ms() + PATIENCE_MS;
    while (wire_client_name(client, &error) == WIRE_NAME_SAME) {
        assert_true(clock_now_ms() < until);
        wire_client_wait(client, NULL, 0, PATIENCE_MS);
    }
    assert_non_null(strstr(error.text, "the name " TEN));
    assert_non_null(strstr(error.text, ".invalid leads to no address: "));
    assert_true(wire_client_seeks_address(client));
    assert_int_equal(wire_client_reconnect(client, &error), STATUS_OK); /* as a worker does now and then */
    wire_client_wait(client, NULL, 0, 1000); /* it is searched for again meanwhile */
    assert_int_equal(wire_client_name(client, &error), WIRE_NAME_SAME);
    assert_false(wire_client_send(client, "hello", 5));
    leave(client);
}

static size_t count_threads(void)
{
    DIR *threads = opendir("/proc/self/task");
    size_t count = 0;
    assert_non_null(threads);
    while (readdir(threads))
        count++;
    closedir(threads);
    return count;
}

/* Whether the search is over or not; its thread goes, sooner or later. */
static void test_leaving_early(void **state)
{
    (void)state;
    leave(join("tcp://127.0.0.1:1")); /* ZeroMQ has its own threads now */
    size_t before = count_threads();
    for (int i = 0; i < 100; i++) {
        struct wire_client *client = join(i % 2 ? "tcp://127.1:1" : NAMELESS);
        if (i % 4 < 2)
            wire_client_wait(client, NULL, 0, i % 3);
        leave(client);
    }
    for (int64_t until = clock_now_ms() + PATIENCE_MS; count_threads() > before; usleep(1000))
        assert_true(clock_now_ms() < until);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_a_name),
        cmocka_unit_test_setup_teardown(test_name_with_an_address, start, stop),
        cmocka_unit_test_setup_teardown(test_name_without_an_address, start, stop),
        cmocka_unit_test_setup_teardown(test_leaving_early, start, stop),
    };
    return cmocka_run_group_tests_name("socket_names", tests, make_folder, remove_folder);
}
