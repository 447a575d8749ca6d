/*
 * Private to the wire: what server and client share. A socket is ZeroMQ's, made with weft's options.
 */
#ifndef WEFT_WIRE_SOCKET_PRIVATE_H
#define WEFT_WIRE_SOCKET_PRIVATE_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/bytes.h"
#include "base/error.h"
#include "wire/key_file.h"

/* An answerer takes requests from ZeroMQ itself, a monitor hears its news of another socket. */
enum wire_role { WIRE_SERVER, WIRE_CLIENT, WIRE_ANSWERER, WIRE_MONITOR };

/* A socket of the process's context with the role's options set. NULL with *error filled. */
void *wire_socket_open(enum wire_role role, struct error *error);

/* Closes *socket and nulls it; accepts NULL. What is still to be sent keeps to the role's LINGER, or is
 * dropped if `drop`. */
void wire_socket_close(void **socket, bool drop);

/* Binds or connects, after setting what depends on the endpoint. STATUS_FAILED with a sentence. */
enum status wire_socket_bind(void *socket, const char *endpoint, struct error *error);
enum status wire_socket_connect(void *socket, const char *endpoint, struct error *error);

/* Queues one part of a message (copied), never blocking; `more` if another part follows. False if it cannot
 * be queued. */
bool wire_socket_send(void *socket, const void *data, size_t size, bool more);

/* Takes one waiting message, never blocking, and puts its first `max` parts into parts[max], replacing what
 * they held. Returns how many parts it had (counted to max + 1 at most), 0 if no message waits. Writes what the
 * connection shows of the sender to *origin unless NULL. */
enum { WIRE_USER_BYTES = 64, WIRE_ADDRESS_BYTES = 96 };
struct wire_origin {
    char user[WIRE_USER_BYTES];       /* under which the doorkeeper let it in (door.h); "": over a plain socket */
    char address[WIRE_ADDRESS_BYTES]; /* of its network interface, in digits; something else by ipc */
};
size_t wire_socket_receive(void *socket, struct bytes *const parts[], size_t max, struct wire_origin *origin);

/* As struct pollfd: a socket, what to wait for (POLLIN, POLLOUT), and what of it is ready. */
struct wire_waiting {
    void *socket;
    short events, revents;
};

/* Waits until one of sockets[socket_count] or of fds[count] is ready, timeout_ms have passed (-1: for ever) or a signal
 * came. Sets the revents of all as poll(2) does. */
void wire_socket_wait(struct wire_waiting *sockets, size_t socket_count, struct pollfd *fds, size_t count,
                      int timeout_ms);

bool wire_endpoint_is_ipc(const char *endpoint);

/* Whether HOST is a name, whose address is yet to be found, and PORT one to connect to; then the name goes to
 * name[WIRE_ENDPOINT_BYTES]. */
bool wire_endpoint_name(const char *endpoint, char *name);

/* --- CURVE (curve.c) -------------------------------------------------------------------------------------- */

/* Makes a server's socket, not yet bound, take only clients that know its public key and that the doorkeeper (door.h)
 * admits. */
enum status wire_curve_serve(void *socket, const struct key *secret, struct error *error);

/* Makes a client's socket, not yet connected, speak only with the holder of the server key's secret. */
enum status wire_curve_join(void *socket, const struct key *secret, const struct key *server, struct error *error);

/* Gives a client's socket the keys of another one. */
enum status wire_curve_copy(void *socket, void *from, struct error *error);

#endif
