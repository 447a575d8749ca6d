#include "wire/socket.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zmq.h>

#include "base/memory.h"
#include "wire/socket_private.h"

struct wire_server {
    void *socket;
    struct bytes sender; /* of the message being received */
};

bool wire_peer_equal(const struct wire_peer *a, const struct wire_peer *b)
{
    return a->size == b->size && memcmp(a->id, b->id, a->size) == 0;
}

/* Each worker takes a descriptor, and the usual soft limit of 1024 would stop a large farm. Best effort. */
static void raise_descriptor_limit(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return;
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
}

struct wire_server *wire_server_create(struct error *error)
{
    raise_descriptor_limit();
    void *socket = wire_socket_open(WIRE_SERVER, error);
    if (!socket)
        return NULL;
    struct wire_server *server = memory_array(1, sizeof *server);
    server->socket = socket;
    return server;
}

void wire_server_destroy(struct wire_server **server)
{
    if (!*server)
        return;
    wire_socket_close(&(*server)->socket, true);
    bytes_finish(&(*server)->sender);
    free(*server);
    *server = NULL;
}

/* ZeroMQ removes whatever is at an ipc path before it binds; spare what is not a socket. */
static enum status check_ipc_path(const char *endpoint, struct error *error)
{
    struct stat info;
    const char *path = endpoint + strlen("ipc://");
    if (!wire_endpoint_is_ipc(endpoint) || lstat(path, &info) != 0 || S_ISSOCK(info.st_mode))
        return STATUS_OK;
    return error_set(error, STATUS_FAILED, "cannot listen on %s: the path exists and is not a socket",
                     endpoint);
}

/* The endpoint as it was asked for, with the port that was chosen: ZeroMQ's own form of * is [::]. */
static void write_bound(void *socket, const char *endpoint, char *bound)
{
    char last[WIRE_ENDPOINT_BYTES] = "";
    size_t size = sizeof last;
    zmq_getsockopt(socket, ZMQ_LAST_ENDPOINT, last, &size);
    const char *port = strrchr(last, ':');
    if (wire_endpoint_is_ipc(endpoint) || !port)
        port = "";
    size_t kept = *port ? (size_t)(strrchr(endpoint, ':') - endpoint) : strlen(endpoint);
    snprintf(bound, WIRE_ENDPOINT_BYTES, "%.*s%s", (int)kept, endpoint, port);
}

enum status wire_server_bind(struct wire_server *server, const char *endpoint, char *bound, struct error *error)
{
    enum status status = check_ipc_path(endpoint, error);
    if (status == STATUS_OK)
        status = wire_socket_bind(server->socket, endpoint, error);
    if (status == STATUS_OK && bound)
        write_bound(server->socket, endpoint, bound);
    return status;
}

bool wire_server_send(struct wire_server *server, const struct wire_peer *peer, const void *data, size_t size)
{
    return wire_socket_send(server->socket, peer->id, peer->size, true) &&
           wire_socket_send(server->socket, data, size, false);
}

/* Messages that are not one part from a sender whose name fits are dropped, a bounded number at a call so
 * that a flood of them cannot hold the caller. */
bool wire_server_receive(struct wire_server *server, struct wire_peer *peer, struct bytes *data)
{
    enum { DROPPED_AT_ONCE = 100 };
    for (int dropped = 0; dropped < DROPPED_AT_ONCE; dropped++) {
        size_t parts = wire_socket_receive(server->socket, (struct bytes *[]){&server->sender, data}, 2);
        if (parts == 0)
            return false;
        if (parts != 2 || server->sender.size > sizeof peer->id)
            continue;
        peer->size = (uint8_t)server->sender.size;
        memcpy(peer->id, server->sender.data, server->sender.size);
        return true;
    }
    return false;
}

void wire_server_wait(struct wire_server *server, struct pollfd *fds, size_t count, int timeout_ms)
{
    wire_socket_wait(server->socket, POLLIN, fds, count, timeout_ms);
}
