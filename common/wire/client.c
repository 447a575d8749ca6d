#include "wire/socket.h"

#include <stdlib.h>

#include "base/memory.h"
#include "wire/socket_private.h"

struct wire_client {
    char *endpoint;
    void *socket;
    bool keyed;        /* it speaks CURVE */
    bool send_refused; /* since the last wait that told so */
};

struct wire_client *wire_client_create(const char *endpoint, struct worker_keys *keys, struct error *error)
{
    bool keyed = keys && !wire_endpoint_is_ipc(endpoint);
    void *socket = wire_socket_open(WIRE_CLIENT, error);
    enum status status = socket ? STATUS_OK : STATUS_FAILED;
    if (status == STATUS_OK && keyed)
        status = wire_curve_join(socket, &keys->secret, &keys->coordinator, error);
    if (keys)
        worker_keys_finish(keys);
    if (status == STATUS_OK)
        status = wire_socket_connect(socket, endpoint, error);
    if (status != STATUS_OK) {
        wire_socket_close(&socket, true);
        return NULL;
    }
    struct wire_client *client = memory_array(1, sizeof *client);
    *client = (struct wire_client){.endpoint = memory_string(endpoint), .socket = socket, .keyed = keyed};
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
    void *socket = wire_socket_open(WIRE_CLIENT, error);
    enum status status = socket ? STATUS_OK : STATUS_FAILED;
    if (status == STATUS_OK && client->keyed)
        status = wire_curve_copy(socket, client->socket, error);
    if (status == STATUS_OK)
        status = wire_socket_connect(socket, client->endpoint, error);
    if (status != STATUS_OK) {
        wire_socket_close(&socket, true);
        return status;
    }
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
        parts = wire_socket_receive(client->socket, &data, 1, NULL);
    while (parts > 1);
    return parts == 1;
}

void wire_client_wait(struct wire_client *client, struct pollfd *fds, size_t count, int timeout_ms)
{
    struct wire_waiting waiting = {.socket = client->socket, .events = POLLIN | (client->send_refused ? POLLOUT : 0)};
    wire_socket_wait(&waiting, 1, fds, count, timeout_ms);
    if (waiting.revents & POLLOUT)
        client->send_refused = false;
}
