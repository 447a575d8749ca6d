#include "wire/socket.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zmq.h>

#include "base/memory.h"
#include "wire/message.h"
#include "wire/socket_private.h"

/* --- context ---------------------------------------------------------------------------------------------- */

/* One context a process: version 4.3.4 has a crash with several of them that use CURVE. */
static void *context;
static int sockets_open;

/* ZeroMQ's own default, 1023, stops a process that plays a whole farm; a slot costs eight bytes. */
enum { SOCKETS_MAX = 16384 };

enum status wire_start(struct error *error)
{
    assert(!context);
    context = zmq_ctx_new();
    if (!context)
        return error_set(error, STATUS_INTERNAL, "ZeroMQ cannot start: %s", zmq_strerror(errno));
    zmq_ctx_set(context, ZMQ_MAX_SOCKETS, SOCKETS_MAX);
    return STATUS_OK;
}

void wire_stop(void)
{
    assert(sockets_open == 0); /* ending the context would wait for them for ever */
    while (context && zmq_ctx_term(context) != 0 && errno == EINTR)
        continue;
    context = NULL;
}

/* --- options ---------------------------------------------------------------------------------------------- */

struct socket_option {
    int option;
    int value;
};

/*
 * Queues count messages of each connection, not bytes, and there may be thousands of connections. What one of them can
 * make a coordinator hold:
 *
 *   by sending more than is read   RECEIVED_MESSAGES of MESSAGE_BYTES_MAX, 8 MiB (mostly chunks of results; bands a
 *                                  second do not suffer: ZeroMQ's thread refills the queue while we read)
 *   by not reading                 SENT_MESSAGES of less than 200 bytes, and chunks of assets as far as the dispatcher
 *                                  allows it to ask for any: twice a job's scene, at most 520 MiB
 *
 * and as much again in the kernel's buffers, which are its own limit. SENT_MESSAGES is more than one peer can be owed
 * while it does not answer: each band of the largest credit that the dispatcher gives (512), granted and revoked, 256
 * jobs announced and ended, chunks that it asked for, and beats. A worker has but one connection, and trusts its
 * coordinator: its queues hold all of the largest credit that a message can name.
 */
enum { RECEIVED_MESSAGES = 32, SENT_MESSAGES = 2048, WORKERS_MESSAGES = 8 * MESSAGE_THREADS_MAX };

static const struct socket_option every_socket[] = {
    /* The default has no limit, and a peer could make us allocate what it likes. */
    {ZMQ_MAXMSGSIZE, MESSAGE_BYTES_MAX},
    /* The kernel finds out that a peer vanished without a word, and frees the connection after about a
     * minute; the farm itself knows sooner, by its beats. */
    {ZMQ_TCP_KEEPALIVE, 1},
    {ZMQ_TCP_KEEPALIVE_IDLE, 30},
    {ZMQ_TCP_KEEPALIVE_INTVL, 10},
    {ZMQ_TCP_KEEPALIVE_CNT, 3},
};

static const struct socket_option server_socket[] = {
    /* A send to a peer that is gone fails instead of vanishing. */
    {ZMQ_ROUTER_MANDATORY, 1},
    /* A newcomer that claims another's identity is refused rather than given its messages. */
    {ZMQ_ROUTER_HANDOVER, 0},
    /* Silent connections are closed soon; otherwise they use up the descriptors and keep workers out. */
    {ZMQ_HANDSHAKE_IVL, 2000},
    /* A whole farm may knock at once. */
    {ZMQ_BACKLOG, 1024},
    /* What does not fit waits at the worker. */
    {ZMQ_RCVHWM, RECEIVED_MESSAGES},
    {ZMQ_SNDHWM, SENT_MESSAGES},
    /* A coordinator that ends owes nobody anything: workers learn of it by GOODBYE or by silence. */
    {ZMQ_LINGER, 0},
};

static const struct socket_option client_socket[] = {
    /* Queue nothing before there is a connection: it would arrive later, in another conversation. */
    {ZMQ_IMMEDIATE, 1},
    /* Try again soon when packets to the coordinator just vanish; the kernel would try for two minutes. */
    {ZMQ_CONNECT_TIMEOUT, 3000},
    /* Above the credit, so never reached: reading must not stop, nor a send fail. Room is taken as it is used. */
    {ZMQ_RCVHWM, WORKERS_MESSAGES},
    {ZMQ_SNDHWM, WORKERS_MESSAGES},
    /* Time for the last results and GOODBYE to leave. */
    {ZMQ_LINGER, 2000},
};

/* Doubling from the first to the second, so that thousands of workers do not storm a coordinator. */
static const struct socket_option client_over_tcp[] = {
    {ZMQ_RECONNECT_IVL, 200},
    {ZMQ_RECONNECT_IVL_MAX, 10000},
};

/* A local worker may be up before its coordinator, and the attempt costs microseconds. */
static const struct socket_option client_over_ipc[] = {
    {ZMQ_RECONNECT_IVL, 5},
    {ZMQ_RECONNECT_IVL_MAX, 100},
};

/* Without a limit: ZeroMQ would wait for room in it with a lock held that closing it takes. */
static const struct socket_option monitor_socket[] = {
    {ZMQ_RCVHWM, 0},
};

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* MAXMSGSIZE is the one option here that ZeroMQ takes as 64 bits. False if it refuses one. */
static bool set_options(void *socket, const struct socket_option *options, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        int64_t wide = options[i].value;
        bool is_wide = options[i].option == ZMQ_MAXMSGSIZE;
        const void *value = is_wide ? (const void *)&wide : &options[i].value;
        if (zmq_setsockopt(socket, options[i].option, value, is_wide ? sizeof wide : sizeof(int)) != 0)
            return false;
    }
    return true;
}

static const struct {
    int type;
    const struct socket_option *options;
    size_t count;
} roles[] = {
    [WIRE_SERVER] = {ZMQ_ROUTER, server_socket, COUNT(server_socket)},
    [WIRE_CLIENT] = {ZMQ_DEALER, client_socket, COUNT(client_socket)},
    [WIRE_ANSWERER] = {ZMQ_REP, NULL, 0},
    [WIRE_MONITOR] = {ZMQ_PAIR, monitor_socket, COUNT(monitor_socket)},
};

static bool set_role_options(void *socket, enum wire_role role)
{
    return set_options(socket, every_socket, COUNT(every_socket)) &&
           set_options(socket, roles[role].options, roles[role].count);
}

/* IPv6 only where an endpoint asks for it (a literal, or * for every interface): with it on, ZeroMQ takes
 * only the first address of a name, which may be one that the other side does not listen on. */
static bool set_ipv6(void *socket, const char *endpoint)
{
    bool wanted = strncmp(endpoint, "tcp://[", 7) == 0 || strncmp(endpoint, "tcp://*", 7) == 0;
    return set_options(socket, &(struct socket_option){ZMQ_IPV6, wanted}, 1);
}

/* --- sockets ---------------------------------------------------------------------------------------------- */

void *wire_socket_open(enum wire_role role, struct error *error)
{
    assert(context);
    void *socket = zmq_socket(context, roles[role].type);
    if (!socket) {
        error_set(error, STATUS_INTERNAL, "ZeroMQ cannot make a socket: %s", zmq_strerror(errno));
        return NULL;
    }
    sockets_open++;
    if (!set_role_options(socket, role)) {
        error_set(error, STATUS_INTERNAL, "ZeroMQ refuses an option of a socket: %s", zmq_strerror(errno));
        wire_socket_close(&socket, true);
    }
    return socket;
}

void wire_socket_close(void **socket, bool drop)
{
    static const struct socket_option linger_none = {ZMQ_LINGER, 0};
    if (!*socket)
        return;
    if (drop)
        set_options(*socket, &linger_none, 1);
    zmq_close(*socket);
    *socket = NULL;
    sockets_open--;
}

/* What ZeroMQ's error numbers mean for an endpoint, where its own text would mislead. */
static const char *reason(int code)
{
    switch (code) {
    case EADDRINUSE: return "it is in use by another program";
    case ENODEV: return "expected an address or an interface of this machine, or *";
    case ENAMETOOLONG: return "the path is longer than 107 bytes";
    case EINVAL: return "it is not an endpoint for that";
    default: return zmq_strerror(code);
    }
}

enum status wire_socket_bind(void *socket, const char *endpoint, struct error *error)
{
    if (set_ipv6(socket, endpoint) && zmq_bind(socket, endpoint) == 0)
        return STATUS_OK;
    return error_set(error, STATUS_FAILED, "cannot listen on %s: %s", endpoint, reason(errno));
}

enum status wire_socket_connect(void *socket, const char *endpoint, struct error *error)
{
    bool set = wire_endpoint_is_ipc(endpoint) ? set_options(socket, client_over_ipc, COUNT(client_over_ipc))
                                              : set_options(socket, client_over_tcp, COUNT(client_over_tcp));
    if (set && set_ipv6(socket, endpoint) && zmq_connect(socket, endpoint) == 0)
        return STATUS_OK;
    return error_set(error, STATUS_FAILED, "cannot connect to %s: %s", endpoint, reason(errno));
}

bool wire_socket_send(void *socket, const void *data, size_t size, bool more)
{
    int sent;
    do
        sent = zmq_send(socket, data, size, ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0));
    while (sent < 0 && errno == EINTR);
    return sent >= 0;
}

static bool receive_part(void *socket, zmq_msg_t *part)
{
    int size;
    zmq_msg_init(part);
    do
        size = zmq_msg_recv(part, socket, ZMQ_DONTWAIT);
    while (size < 0 && errno == EINTR);
    return size >= 0;
}

/* The last part is asked: in version 4.3.4 the first, which ROUTER makes, can lack it. */
static void read_origin(zmq_msg_t *part, struct wire_origin *origin)
{
    const char *user = zmq_msg_gets(part, "User-Id"), *address = zmq_msg_gets(part, "Peer-Address");
    snprintf(origin->user, sizeof origin->user, "%s", user ? user : "");
    snprintf(origin->address, sizeof origin->address, "%s", address ? address : "");
}

size_t wire_socket_receive(void *socket, struct bytes *const parts[], size_t max, struct wire_origin *origin)
{
    size_t count = 0;
    bool more = true;
    while (more) {
        zmq_msg_t part;
        if (!receive_part(socket, &part))
            return 0; /* only the first part can be lacking: ZeroMQ delivers messages whole */
        if (count < max) {
            parts[count]->size = 0;
            bytes_put(parts[count], zmq_msg_data(&part), zmq_msg_size(&part));
        }
        count += count <= max;
        more = zmq_msg_more(&part);
        if (origin && !more)
            read_origin(&part, origin);
        zmq_msg_close(&part);
    }
    return count;
}

/* --- waiting ---------------------------------------------------------------------------------------------- */

static short to_zmq_events(short events)
{
    return (short)((events & POLLIN ? ZMQ_POLLIN : 0) | (events & POLLOUT ? ZMQ_POLLOUT : 0) |
                   (events & POLLPRI ? ZMQ_POLLPRI : 0));
}

/* Sockets themselves are polled, never their ZMQ_FD: that one is edge-triggered and misses what is queued already.
 * ZeroMQ's poll reports hang-ups of an fd as mere errors, so poll(2) has the last word on the fds. */
void wire_socket_wait(struct wire_waiting *sockets, size_t socket_count, struct pollfd *fds, size_t count,
                      int timeout_ms)
{
    zmq_pollitem_t *items = memory_array(socket_count + count, sizeof *items);
    for (size_t i = 0; i < socket_count; i++)
        items[i] = (zmq_pollitem_t){.socket = sockets[i].socket, .events = to_zmq_events(sockets[i].events)};
    for (size_t i = 0; i < count; i++)
        items[socket_count + i] = (zmq_pollitem_t){.fd = fds[i].fd, .events = to_zmq_events(fds[i].events)};
    int ready = zmq_poll(items, (int)(socket_count + count), timeout_ms);
    for (size_t i = 0; i < socket_count; i++) {
        short revents = ready > 0 ? items[i].revents : 0;
        sockets[i].revents = (short)((revents & ZMQ_POLLIN ? POLLIN : 0) | (revents & ZMQ_POLLOUT ? POLLOUT : 0));
    }
    free(items);
    if (count)
        poll(fds, count, 0);
}
