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

enum wire_role { WIRE_SERVER, WIRE_CLIENT };

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
 * they held. Returns how many parts it had (counted to max + 1 at most), 0 if no message waits. */
size_t wire_socket_receive(void *socket, struct bytes *const parts[], size_t max);

/* Waits until the socket is ready for one of `events` (POLLIN, POLLOUT), one of fds[count] is ready,
 * timeout_ms have passed (-1: for ever) or a signal came. Sets the fds' revents as poll(2) does. Returns
 * the socket's ready events. */
short wire_socket_wait(void *socket, short events, struct pollfd *fds, size_t count, int timeout_ms);

bool wire_endpoint_is_ipc(const char *endpoint);

#endif
