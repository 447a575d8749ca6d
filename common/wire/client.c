#include "wire/socket.h"

#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "wire/lookup.h"
#include "wire/socket_private.h"

struct wire_client {
    char *endpoint;
    void *socket;
    struct lookup *lookup; /* of the endpoint's name; until it ends there is nothing to connect to. NULL: none */
    int name_failure;      /* of the last search (getaddrinfo); 0: it has an address, as far as is known */
    int name_told;         /* what of that was told last */
    bool keyed;            /* it speaks CURVE */
    bool send_refused;     /* since the last wait that told so */
};

/* The socket is the client's, or is to be. */
static enum status begin_to_connect(struct wire_client *client, void *socket, struct error *error)
{
    char name[WIRE_ENDPOINT_BYTES];
    if (!wire_endpoint_name(client->endpoint, name))
        return wire_socket_connect(socket, client->endpoint, error);
    if (!client->lookup)
        client->lookup = lookup_create(name, error);
    return client->lookup ? STATUS_OK : STATUS_FAILED;
}

struct wire_client *wire_client_create(const char *endpoint, struct worker_keys *keys, struct error *error)
{
    struct wire_client *client = memory_array(1, sizeof *client);
    *client = (struct wire_client){.endpoint = memory_string(endpoint), .socket = wire_socket_open(WIRE_CLIENT, error),
                                   .keyed = keys && !wire_endpoint_is_ipc(endpoint)};
    enum status status = client->socket ? STATUS_OK : STATUS_FAILED;
    if (status == STATUS_OK && client->keyed)
        status = wire_curve_join(client->socket, &keys->secret, &keys->coordinator, error);
    if (keys)
        worker_keys_finish(keys);
    if (status == STATUS_OK)
        status = begin_to_connect(client, client->socket, error);
    if (status != STATUS_OK) {
        wire_socket_close(&client->socket, true);
        wire_client_destroy(&client);
    }
    return client;
}

void wire_client_destroy(struct wire_client **client)
{
    if (!*client)
        return;
    lookup_destroy(&(*client)->lookup);
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
        status = begin_to_connect(client, socket, error);
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

/* Where ZeroMQ refuses an address, the next reconnection tries again. */
static void take_address(struct wire_client *client)
{
    char address[INET_ADDRSTRLEN], endpoint[WIRE_ENDPOINT_BYTES];
    struct error error;
    int failure;
    enum lookup_news news = lookup_take(client->lookup, &failure, address);
    if (news == LOOKUP_NOTHING)
        return;
    client->name_failure = failure;
    if (news == LOOKUP_FAILED)
        return;
    snprintf(endpoint, sizeof endpoint, "tcp://%s%s", address, strrchr(client->endpoint, ':'));
    wire_socket_connect(client->socket, endpoint, &error);
    lookup_destroy(&client->lookup);
}

void wire_client_wait(struct wire_client *client, struct pollfd *fds, size_t count, int timeout_ms)
{
    struct wire_waiting waiting = {.socket = client->socket, .events = POLLIN | (client->send_refused ? POLLOUT : 0)};
    size_t all_count = count + (client->lookup != NULL);
    struct pollfd *all = memory_array(all_count, sizeof *all);
    for (size_t i = 0; i < count; i++)
        all[i] = fds[i];
    if (client->lookup)
        all[count] = (struct pollfd){.fd = lookup_descriptor(client->lookup), .events = POLLIN};
    wire_socket_wait(&waiting, 1, all, all_count, timeout_ms);
    for (size_t i = 0; i < count; i++)
        fds[i] = all[i];
    free(all);
    if (waiting.revents & POLLOUT)
        client->send_refused = false;
    if (client->lookup)
        take_address(client);
}

bool wire_client_seeks_address(const struct wire_client *client)
{
    return client->lookup != NULL;
}

enum wire_name wire_client_name(struct wire_client *client, struct error *error)
{
    char name[WIRE_ENDPOINT_BYTES];
    if (client->name_failure == client->name_told)
        return WIRE_NAME_SAME;
    client->name_told = client->name_failure;
    if (client->name_failure == 0)
        return WIRE_NAME_FOUND;
    wire_endpoint_name(client->endpoint, name);
    error_set(error, STATUS_FAILED, "the name %s leads to no address: %s", name, gai_strerror(client->name_failure));
    return WIRE_NAME_LACKING;
}
