/*
 * What the tests of the sockets share: servers and clients that are closed after a test that fails half way,
 * and sending and receiving with patience.
 */
#ifndef WEFT_TESTS_SOCKET_HELP_H
#define WEFT_TESTS_SOCKET_HELP_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "wire/socket.h"

/* Longer than anything here takes on a busy machine; a test that meets it has failed. */
enum { PATIENCE_MS = 10000 };

static char folder[] = "/tmp/weft-socket-XXXXXX";
static struct error error;

/* What is open, so that a test that fails half way can be tidied up after and tells its own reason. */
enum { OPEN_MAX = 2000 };
static struct wire_server *servers[OPEN_MAX];
static struct wire_client *clients[OPEN_MAX];

static inline struct wire_server *open_server_with(struct coordinator_keys *keys)
{
    int i = 0;
    while (servers[i])
        i++;
    servers[i] = wire_server_create(keys, &error);
    if (!servers[i])
        fail_msg("%s", error.text);
    return servers[i];
}

static inline struct wire_server *open_server(void)
{
    return open_server_with(NULL);
}

static inline void close_server(struct wire_server *server)
{
    int i = 0;
    while (servers[i] != server)
        i++;
    wire_server_destroy(&servers[i]);
    assert_null(servers[i]);
}

static inline struct wire_client *join_with(const char *endpoint, struct worker_keys *keys)
{
    int i = 0;
    while (clients[i])
        i++;
    clients[i] = wire_client_create(endpoint, keys, &error);
    if (!clients[i])
        fail_msg("%s", error.text);
    return clients[i];
}

static inline struct wire_client *join(const char *endpoint)
{
    return join_with(endpoint, NULL);
}

static inline void leave(struct wire_client *client)
{
    int i = 0;
    while (clients[i] != client)
        i++;
    wire_client_destroy(&clients[i]);
    assert_null(clients[i]);
}

static inline int start(void **state)
{
    (void)state;
    return wire_start(&error);
}

static inline int stop(void **state)
{
    (void)state;
    for (int i = 0; i < OPEN_MAX; i++) {
        wire_client_destroy(&clients[i]);
        wire_server_destroy(&servers[i]);
    }
    int64_t before = clock_now_ms();
    wire_stop();
    return clock_now_ms() - before > 2000 + PATIENCE_MS / 2; /* 2 s are for last words */
}

static inline const char *ipc_endpoint(void)
{
    static char endpoint[64];
    snprintf(endpoint, sizeof endpoint, "ipc://%s/socket", folder);
    return endpoint;
}

static inline struct wire_server *serve(const char *endpoint, char *bound)
{
    struct wire_server *server = open_server();
    if (wire_server_bind(server, endpoint, bound, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    return server;
}

/* Sends as a worker does before it is connected: refused, it waits until it can try again. */
static inline void client_send(struct wire_client *client, const void *data, size_t size)
{
    int64_t until = clock_now_ms() + PATIENCE_MS;
    while (!wire_client_send(client, data, size)) {
        assert_true(clock_now_ms() < until);
        wire_client_wait(client, NULL, 0, PATIENCE_MS);
    }
}

static inline bool server_receive_within(struct wire_server *server, struct wire_peer *peer, struct bytes *data,
                                         int timeout_ms)
{
    int64_t until = clock_now_ms() + timeout_ms;
    bool received;
    while (!(received = wire_server_receive(server, peer, data)) && clock_now_ms() < until)
        wire_server_wait(server, NULL, 0, (int)(until - clock_now_ms()));
    return received;
}

static inline void assert_server_receives(struct wire_server *server, struct wire_peer *peer, const char *text)
{
    struct bytes data = {0};
    assert_true(server_receive_within(server, peer, &data, PATIENCE_MS));
    assert_int_equal(data.size, strlen(text));
    assert_memory_equal(data.data, text, data.size);
    bytes_finish(&data);
}

static inline void assert_client_receives(struct wire_client *client, const char *text)
{
    struct bytes data = {0};
    int64_t until = clock_now_ms() + PATIENCE_MS;
    while (!wire_client_receive(client, &data)) {
        assert_true(clock_now_ms() < until);
        wire_client_wait(client, NULL, 0, PATIENCE_MS);
    }
    assert_int_equal(data.size, strlen(text));
    assert_memory_equal(data.data, text, data.size);
    bytes_finish(&data);
}

/* A joined client and the peer that the server knows it by. */
static inline struct wire_client *join_and_greet(struct wire_server *server, const char *bound,
                                                 struct wire_peer *peer)
{
    struct wire_client *client = join(bound);
    client_send(client, "hello", 5);
    assert_server_receives(server, peer, "hello");
    return client;
}

/* Says `text` again and again, as HELLO is, until the server hears it: the first may die with a connection
 * whose end the client has not yet noticed, and several may arrive, which later calls pass over. */
static inline void greet_until_heard(struct wire_client *client, const char *text, struct wire_server *server,
                                     struct wire_peer *peer)
{
    struct bytes data = {0};
    int64_t until = clock_now_ms() + PATIENCE_MS;
    do {
        assert_true(clock_now_ms() < until);
        client_send(client, text, strlen(text));
        server_receive_within(server, peer, &data, 100);
    } while (data.size != strlen(text) || memcmp(data.data, text, data.size) != 0);
    bytes_finish(&data);
}

static inline uint16_t port_of(const char *bound)
{
    return (uint16_t)atoi(strrchr(bound, ':') + 1);
}

/* Group fixtures: a folder for the ipc sockets, and an alarm that ends what would wait for ever. */
static inline int make_folder(void **state)
{
    (void)state;
    alarm(120);
    return mkdtemp(folder) ? 0 : -1;
}

static inline int remove_folder(void **state)
{
    (void)state;
    unlink(ipc_endpoint() + strlen("ipc://"));
    return rmdir(folder);
}

#endif
