/* The sockets in trouble: hostile and silent peers, errors of endpoints, and what ends a wait. */
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <zmq.h>

#include "base/memory.h"
#include "tests/unit/socket_help.h"
#include "wire/message.h"

/* A plain TCP connection to a bound endpoint, which speaks no ZMTP. */
static int plain_connect(const char *bound)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(port_of(bound))};
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    return fd;
}

/* --- hostile and unlucky ---------------------------------------------------------------------------------- */

static void exceed_limit(const char *endpoint)
{
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer good_peer, bad_peer, peer;
    struct bytes data = {0};
    uint8_t *body = memory_array(MESSAGE_BYTES_MAX + 1, 1);
    struct wire_server *server = serve(endpoint, bound);
    struct wire_client *good = join_and_greet(server, bound, &good_peer);
    struct wire_client *bad = join_and_greet(server, bound, &bad_peer);
    client_send(bad, body, MESSAGE_BYTES_MAX);
    assert_true(server_receive_within(server, &peer, &data, PATIENCE_MS));
    assert_int_equal(data.size, MESSAGE_BYTES_MAX);
    client_send(bad, body, MESSAGE_BYTES_MAX + 1);
    client_send(good, "still here", 10);
    assert_server_receives(server, &peer, "still here");
    assert_true(wire_peer_equal(&good_peer, &peer));
    greet_until_heard(bad, "bad is back", server, &peer);
    assert_false(wire_peer_equal(&bad_peer, &peer));
    assert_true(wire_server_send(server, &good_peer, body, MESSAGE_BYTES_MAX + 1));
    wire_client_wait(good, NULL, 0, 100);
    assert_false(wire_client_receive(good, &data));
    assert_int_equal(wire_client_reconnect(good, &error), STATUS_OK); /* it does not by itself: socket.h */
    greet_until_heard(good, "good is back", server, &peer);
    free(body);
    bytes_finish(&data);
    leave(good);
    leave(bad);
    close_server(server);
}

static void test_over_limit(void **state)
{
    (void)state;
    exceed_limit(ipc_endpoint());
    exceed_limit("tcp://127.0.0.1:*");
}

/* A peer that sends messages of several parts, or none that count, or calls itself by a long name. */
static void test_malformed_messages(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    static const char long_name[] = "a name of more than sixteen bytes";
    char reply[8];
    struct wire_peer peer;
    struct bytes data = {0};
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    void *other_context = zmq_ctx_new();
    void *parts = zmq_socket(other_context, ZMQ_DEALER), *named = zmq_socket(other_context, ZMQ_DEALER);
    zmq_setsockopt(named, ZMQ_ROUTING_ID, long_name, strlen(long_name));
    zmq_connect(parts, bound);
    zmq_connect(named, bound);
    for (int i = 0; i < 300; i++) { /* more than one call drops */
        assert_int_equal(zmq_send(parts, "first", 5, ZMQ_SNDMORE), 5);
        assert_int_equal(zmq_send(parts, "", 0, i % 2 ? ZMQ_SNDMORE : 0), 0);
        if (i % 2)
            assert_int_equal(zmq_send(parts, "third", 5, 0), 5);
        assert_int_equal(zmq_send(named, "named", 5, 0), 5);
    }
    assert_int_equal(zmq_send(parts, "whole", 5, 0), 5);
    assert_server_receives(server, &peer, "whole");
    assert_true(wire_server_send(server, &peer, "first", 5));
    assert_int_equal(zmq_recv(parts, reply, sizeof reply, 0), 5);
    assert_false(server_receive_within(server, &peer, &data, 100));
    bytes_finish(&data);
    zmq_close(parts);
    zmq_close(named);
    zmq_ctx_term(other_context);
    close_server(server);
}

/* Connections that say nothing, or nothing that ZeroMQ understands. */
static void test_strangers(void **state)
{
    (void)state;
    enum { STRANGERS = 50 };
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct bytes data = {0};
    int fds[STRANGERS];
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    for (int i = 0; i < STRANGERS; i++) {
        fds[i] = plain_connect(bound);
        if (i % 2)
            assert_int_equal(send(fds[i], "GET / HTTP/1.1\r\n\r\n", 18, MSG_NOSIGNAL), 18);
    }
    struct wire_client *client = join_and_greet(server, bound, &peer);
    assert_true(wire_server_send(server, &peer, "welcome", 7));
    assert_client_receives(client, "welcome");
    assert_false(wire_server_receive(server, &peer, &data));
    for (int i = 0; i < STRANGERS; i++)
        close(fds[i]);
    leave(client);
    close_server(server);
}

/* A server that takes a connection and never answers, as a stopped coordinator does. */
static void test_silent_server(void **state)
{
    (void)state;
    struct sockaddr_in address = {.sin_family = AF_INET};
    socklen_t size = sizeof address;
    char endpoint[WIRE_ENDPOINT_BYTES];
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&address, size), 0);
    assert_int_equal(listen(fd, 10), 0);
    assert_int_equal(getsockname(fd, (struct sockaddr *)&address, &size), 0);
    snprintf(endpoint, sizeof endpoint, "tcp://127.0.0.1:%u", ntohs(address.sin_port));
    struct wire_client *client = join(endpoint);
    int64_t until = clock_now_ms() + 100;
    while (clock_now_ms() < until) {
        assert_false(wire_client_send(client, "hello", 5));
        wire_client_wait(client, NULL, 0, (int)(until - clock_now_ms()));
    }
    leave(client);
    close(fd);
}

/* --- errors ----------------------------------------------------------------------------------------------- */

static void assert_bind_fails(struct wire_server *server, const char *endpoint, const char *says)
{
    assert_int_equal(wire_server_bind(server, endpoint, NULL, &error), STATUS_FAILED);
    if (!strstr(error.text, endpoint) || !strstr(error.text, says))
        fail_msg("expected \"%s\" and \"%s\", found \"%s\"", endpoint, says, error.text);
}

static void test_bind_errors(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES], endpoint[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct wire_server *first = serve("tcp://127.0.0.1:*", bound);
    struct wire_server *server = open_server();
    assert_bind_fails(server, bound, "in use");
    assert_bind_fails(server, "tcp://192.0.2.1:*", "Cannot assign requested address");
    assert_bind_fails(server, "tcp://nosuch.invalid:*", "expected an address or an interface");
    snprintf(endpoint, sizeof endpoint, "ipc://%s/nosuch/socket", folder);
    assert_bind_fails(server, endpoint, "No such file");
    snprintf(endpoint, sizeof endpoint, "ipc://%s/%0107d", folder, 0);
    assert_bind_fails(server, endpoint, "longer than 107 bytes");
    assert_null(wire_client_create(endpoint, NULL, &error));
    assert_non_null(strstr(error.text, "longer than 107 bytes"));
    assert_null(wire_client_create("tcp://*:7420", NULL, &error));
    assert_non_null(strstr(error.text, "cannot connect to tcp://*:7420"));
    assert_int_equal(wire_server_bind(server, "tcp://127.0.0.1:*", bound, &error), STATUS_OK);
    struct wire_client *client = join_and_greet(server, bound, &peer); /* the failures left it usable */
    leave(client);
    close_server(server);
    close_server(first);
}

static void test_file_is_spared(void **state)
{
    (void)state;
    char path[128], endpoint[160];
    struct stat info;
    snprintf(path, sizeof path, "%s/file", folder);
    snprintf(endpoint, sizeof endpoint, "ipc://%s", path);
    close(open(path, O_CREAT | O_WRONLY, 0600));
    struct wire_server *server = open_server();
    assert_bind_fails(server, endpoint, "is not a socket");
    assert_int_equal(lstat(path, &info), 0);
    assert_true(S_ISREG(info.st_mode));
    assert_int_equal(unlink(path), 0);
    close_server(server);
}

static void test_destroy_nothing(void **state)
{
    (void)state;
    struct wire_server *server = NULL;
    struct wire_client *client = NULL;
    wire_server_destroy(&server);
    wire_client_destroy(&client);
}

/* --- waiting ---------------------------------------------------------------------------------------------- */

static void wait_on(struct wire_server *server, struct wire_client *client, struct pollfd *fds, size_t count,
                    int timeout_ms)
{
    if (server)
        wire_server_wait(server, fds, count, timeout_ms);
    else
        wire_client_wait(client, fds, count, timeout_ms);
}

/* Waits for ever, so a wait that misses its event ends by the alarm. */
static void wait_for_fds(struct wire_server *server, struct wire_client *client)
{
    int quiet[2], busy[2];
    assert_int_equal(pipe(quiet), 0);
    assert_int_equal(pipe(busy), 0);
    struct pollfd fds[] = {
        {.fd = quiet[0], .events = POLLIN, .revents = POLLERR},
        {.fd = -1, .events = POLLIN},
        {.fd = busy[0], .events = POLLIN},
    };
    assert_int_equal(write(busy[1], "x", 1), 1);
    wait_on(server, client, fds, 3, -1);
    assert_int_equal(fds[0].revents, 0);
    assert_int_equal(fds[1].revents, 0);
    assert_int_equal(fds[2].revents, POLLIN);
    fds[2] = (struct pollfd){.fd = busy[1], .events = POLLOUT};
    wait_on(server, client, fds, 3, -1);
    assert_int_equal(fds[2].revents, POLLOUT);
    close(quiet[1]);
    wait_on(server, client, fds, 2, -1);
    assert_int_equal(fds[0].revents, POLLHUP);
    close(quiet[0]);
    close(busy[0]);
    close(busy[1]);
}

static void wait_for_time(struct wire_server *server, struct wire_client *client)
{
    int64_t before = clock_now_ms();
    wait_on(server, client, NULL, 0, 30);
    int64_t after = clock_now_ms();
    assert_true(after - before >= 29 && after - before < PATIENCE_MS);
    wait_on(server, client, NULL, 0, 0);
}

static void test_waiting(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    struct wire_client *client = join_and_greet(server, bound, &peer);
    wait_for_fds(server, NULL);
    wait_for_fds(NULL, client);
    wait_for_time(server, NULL);
    wait_for_time(NULL, client);
    leave(client);
    close_server(server);
}

/* What is already queued ends a wait at once, and again as long as it is there. */
static void test_waiting_for_queued(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    struct wire_client *client = join_and_greet(server, bound, &peer);
    for (int i = 0; i < 5; i++) {
        client_send(client, "to server", 9);
        assert_true(wire_server_send(server, &peer, "to client", 9));
    }
    for (int i = 0; i < 5; i++) {
        wire_server_wait(server, NULL, 0, -1);
        wire_server_wait(server, NULL, 0, -1);
        assert_server_receives(server, &peer, "to server");
        wire_client_wait(client, NULL, 0, -1);
        wire_client_wait(client, NULL, 0, -1);
        assert_client_receives(client, "to client");
    }
    wait_for_time(server, NULL);
    wait_for_time(NULL, client);
    leave(client);
    close_server(server);
}

/* Only a refused send makes a connection wake its client, and only once. */
static void test_waiting_to_send(void **state)
{
    (void)state;
    struct wire_peer peer;
    struct wire_server *server = serve(ipc_endpoint(), NULL);
    struct wire_client *client = join(ipc_endpoint());
    while (!wire_client_send(client, "hello", 5))
        wire_client_wait(client, NULL, 0, -1);
    assert_server_receives(server, &peer, "hello");
    wait_for_time(NULL, client);
    close_server(server);
    while (wire_client_send(client, "lost", 4))
        wire_client_wait(client, NULL, 0, 1);
    server = serve(ipc_endpoint(), NULL);
    wire_client_wait(client, NULL, 0, -1);
    wait_for_time(NULL, client);
    leave(client);
    close_server(server);
}

static void on_signal(int number)
{
    (void)number;
}

static void test_waiting_is_interrupted(void **state)
{
    (void)state;
    struct sigaction action = {.sa_handler = on_signal};
    assert_int_equal(sigaction(SIGUSR1, &action, NULL), 0);
    struct wire_server *server = open_server();
    pid_t parent = getpid(), child = fork();
    if (child == 0) { /* touches nothing of ZeroMQ's; more than once, for the first may come before the wait */
        while (getppid() == parent && kill(parent, SIGUSR1) == 0)
            usleep(20000);
        _exit(0);
    }
    wire_server_wait(server, NULL, 0, -1);
    assert_int_equal(kill(child, SIGKILL), 0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    close_server(server);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_over_limit, start, stop),
        cmocka_unit_test_setup_teardown(test_malformed_messages, start, stop),
        cmocka_unit_test_setup_teardown(test_strangers, start, stop),
        cmocka_unit_test_setup_teardown(test_silent_server, start, stop),
        cmocka_unit_test_setup_teardown(test_bind_errors, start, stop),
        cmocka_unit_test_setup_teardown(test_file_is_spared, start, stop),
        cmocka_unit_test_setup_teardown(test_destroy_nothing, start, stop),
        cmocka_unit_test_setup_teardown(test_waiting, start, stop),
        cmocka_unit_test_setup_teardown(test_waiting_for_queued, start, stop),
        cmocka_unit_test_setup_teardown(test_waiting_to_send, start, stop),
        cmocka_unit_test_setup_teardown(test_waiting_is_interrupted, start, stop),
    };
    return cmocka_run_group_tests_name("socket_trouble", tests, make_folder, remove_folder);
}
