#include "wire/socket.h"

#include <stdlib.h>

#include "base/memory.h"
#include "wire/socket_private.h"

struct wire_client {
    char *endpoint;
    void *socket;
    bool send_refused; /* since the last wait that told so */
};

static void *connect_socket(const char *endpoint, struct error *error)
{
    void *socket = wire_socket_open(WIRE_CLIENT, error);
    if (socket && wire_socket_connect(socket, endpoint, error) != STATUS_OK)
        wire_socket_close(&socket, true);
    return socket;
}

struct wire_client *wire_client_create(const char *endpoint, struct error *error)
{
    void *socket = connect_socket(endpoint, error);
    if (!socket)
        return NULL;
    struct wire_client *client = memory_array(1, sizeof *client);
    client->endpoint = memory_string(endpoint);
    client->socket = socket;
    return client;
}

void wire_client_destroy(struct wire_client **client)
{
    if (!*client)
        return;
    wire_socket_close(&(*client)->socket, false);
    free((*client)->endpoint);
    free(*client);
    *client = NULL;
}

/* A new socket rather than a new connection of the old one, whose queues would live on. */
enum status wire_client_reconnect(struct wire_client *client, struct error *error)
{
    void *socket = connect_socket(client->endpoint, error);
    if (!socket)
        return STATUS_FAILED;
    wire_socket_close(&client->socket, false);
    client->socket = socket;
    return STATUS_OK;
}

bool wire_client_send(struct wire_client *client, const void *data, size_t size)
{
    bool sent = wire_socket_send(client->socket, data, size, false);
    client->send_refused = !sent;
    return sent;
}

bool wire_client_receive(struct wire_client *client, struct bytes *data)
{
    size_t parts;
    do
        parts = wire_socket_receive(client->socket, &data, 1);
    while (parts > 1);
    return parts == 1;
}

void wire_client_wait(struct wire_client *client, struct pollfd *fds, size_t count, int timeout_ms)
{
    short events = POLLIN | (client->send_refused ? POLLOUT : 0);
    if (wire_socket_wait(client->socket, events, fds, count, timeout_ms) & POLLOUT)
        client->send_refused = false;
}
