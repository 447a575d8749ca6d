#include "wire/socket.h"

#include <assert.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sodium.h>
#include <zmq.h>

#include "base/memory.h"
#include "wire/door.h"
#include "wire/socket_private.h"

/* A socket is either plain or takes only CURVE, and by which endpoint a message came a socket does not tell. */
enum { OWN, PLAIN, GUARDED, SOCKET_KINDS };

struct wire_server {
    void *sockets[SOCKET_KINDS];
    size_t count;        /* of sockets; GUARDED is there only with keys */
    size_t turn;         /* the socket to be heard first */
    struct door *door;   /* NULL without keys */
    struct bytes sender; /* of the message being received */
    uint8_t secret[crypto_shorthash_siphashx24_KEYBYTES]; /* of the names of machines */
};

bool wire_peer_equal(const struct wire_peer *a, const struct wire_peer *b)
{
    return a->socket == b->socket && a->size == b->size && memcmp(a->id, b->id, a->size) == 0;
}

bool wire_machine_equal(const struct wire_machine *a, const struct wire_machine *b)
{
    return memcmp(a->id, b->id, sizeof a->id) == 0;
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

static enum status open_socket(struct wire_server *server, struct error *error)
{
    server->sockets[server->count] = wire_socket_open(WIRE_SERVER, error);
    if (!server->sockets[server->count])
        return STATUS_INTERNAL;
    server->count++;
    return STATUS_OK;
}

/* The doorkeeper is there before anybody can knock: without one, ZeroMQ would let in every key. */
static enum status open_guarded(struct wire_server *server, struct coordinator_keys *keys, struct error *error)
{
    enum status status = open_socket(server, error);
    if (status == STATUS_OK)
        status = wire_curve_serve(server->sockets[GUARDED], &keys->secret, error);
    if (status != STATUS_OK)
        return status;
    server->door = door_create(server->sockets[GUARDED], &keys->workers, &keys->watchers, error);
    return server->door ? STATUS_OK : STATUS_FAILED;
}

struct wire_server *wire_server_create(struct coordinator_keys *keys, struct error *error)
{
    raise_descriptor_limit();
    struct wire_server *server = memory_array(1, sizeof *server);
    randombytes_buf(server->secret, sizeof server->secret);
    enum status status = open_socket(server, error);
    if (status == STATUS_OK)
        status = open_socket(server, error);
    if (status == STATUS_OK && keys)
        status = open_guarded(server, keys, error);
    if (keys)
        coordinator_keys_finish(keys);
    if (status != STATUS_OK)
        wire_server_destroy(&server);
    return server;
}

void wire_server_destroy(struct wire_server **server)
{
    if (!*server)
        return;
    door_destroy(&(*server)->door);
    for (size_t i = 0; i < (*server)->count; i++)
        wire_socket_close(&(*server)->sockets[i], true);
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
    void *socket = server->sockets[server->count > GUARDED && !wire_endpoint_is_ipc(endpoint) ? GUARDED : PLAIN];
    enum status status = check_ipc_path(endpoint, error);
    if (status == STATUS_OK)
        status = wire_socket_bind(socket, endpoint, error);
    if (status == STATUS_OK && bound)
        write_bound(socket, endpoint, bound);
    return status;
}

enum status wire_server_bind_own(struct wire_server *server, const char *endpoint, struct error *error)
{
    return wire_socket_bind(server->sockets[OWN], endpoint, error);
}

bool wire_server_send(struct wire_server *server, const struct wire_peer *peer, const void *data, size_t size)
{
    assert(peer->socket < server->count);
    void *socket = server->sockets[peer->socket];
    return wire_socket_send(socket, peer->id, peer->size, true) && wire_socket_send(socket, data, size, false);
}

/* Of an ipc connection ZeroMQ tells user, group and process, behind what the system takes for a name. */
static bool is_network_address(const char *address)
{
    return isxdigit((unsigned char)address[0]) || strncmp(address, "::", 2) == 0;
}

/* A secret goes into the names, so that nobody can choose a key whose name is another's. */
static struct wire_machine machine_of(const struct wire_server *server, const struct wire_origin *origin)
{
    struct wire_machine machine = {{0}};
    const char *name = origin->user[0] ? origin->user : origin->address;
    static_assert(sizeof machine.id == crypto_shorthash_siphashx24_BYTES, "a name is a hash");
    if (origin->user[0] || is_network_address(name))
        crypto_shorthash_siphashx24(machine.id, (const unsigned char *)name, strlen(name), server->secret);
    return machine;
}

static bool is_worker(const char *user)
{
    return strncmp(user, DOOR_WORKER, strlen(DOOR_WORKER)) == 0;
}

/* Messages that are not one part from a sender whose name fits are dropped, a bounded number at a call so
 * that a flood of them cannot hold the caller. */
static bool receive_from(struct wire_server *server, size_t at, struct wire_peer *peer, struct bytes *data)
{
    enum { DROPPED_AT_ONCE = 100 };
    struct wire_origin origin;
    for (int dropped = 0; dropped < DROPPED_AT_ONCE; dropped++) {
        size_t parts = wire_socket_receive(server->sockets[at], (struct bytes *[]){&server->sender, data}, 2, &origin);
        if (parts == 0)
            return false;
        if (parts != 2 || server->sender.size > sizeof peer->id)
            continue;
        *peer = (struct wire_peer){.socket = (uint8_t)at, .size = (uint8_t)server->sender.size,
                                   .own = at == OWN, .machine = machine_of(server, &origin),
                                   .may_work = at != GUARDED || is_worker(origin.user)};
        memcpy(peer->id, server->sender.data, server->sender.size);
        return true;
    }
    return false;
}

/* The sockets take turns, so that many messages at one do not silence the other. */
bool wire_server_receive(struct wire_server *server, struct wire_peer *peer, struct bytes *data)
{
    for (size_t i = 0; i < server->count; i++) {
        size_t at = server->turn;
        server->turn = (server->turn + 1) % server->count;
        if (receive_from(server, at, peer, data))
            return true;
    }
    return false;
}

void wire_server_wait(struct wire_server *server, struct pollfd *fds, size_t count, int timeout_ms)
{
    struct wire_waiting waiting[SOCKET_KINDS];
    for (size_t i = 0; i < server->count; i++)
        waiting[i] = (struct wire_waiting){.socket = server->sockets[i], .events = POLLIN};
    wire_socket_wait(waiting, server->count, fds, count, timeout_ms);
    if (server->door)
        door_tell(server->door);
}
