/*
 * The only sockets of weft: a server (ZeroMQ ROUTER) for the coordinator and a client (DEALER) for a worker.
 * One ZeroMQ context a process, made by wire_start. All calls from one thread. Nothing here blocks except
 * the two wait functions. ZeroMQ's own heartbeats stay off: they abort a peer that reads slowly, and they
 * lose frames that cross a slow link slower than the heartbeat's timeout (libzmq issues 3937, 2709).
 */
#ifndef WEFT_WIRE_SOCKET_H
#define WEFT_WIRE_SOCKET_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "wire/keys.h"

/* Makes the process's context; wire_stop ends it, waiting at most two seconds for what is still to be sent. */
enum status wire_start(struct error *error);
void wire_stop(void);

/* Checks that an endpoint is tcp://HOST:PORT (PORT 1..65535, or * for any free one), a HOST:PORT or HOST
 * without the scheme (port 7420 by default), or ipc://PATH, and writes its full form. STATUS_USAGE otherwise.
 * HOST is a name, an IPv4 address, an IPv6 address in brackets, or * (to listen on every interface). Names are
 * looked up as IPv4 only; localhost becomes 127.0.0.1. */
enum { WIRE_ENDPOINT_BYTES = 512, WIRE_PORT_DEFAULT = 7420 };
enum status wire_endpoint_parse(const char *text, char endpoint[WIRE_ENDPOINT_BYTES], struct error *error);

/* This machine's name, as its workers tell it, into name[size], cut to fit. */
void wire_host_name(char *name, size_t size);

/* True for ipc and for addresses of the loopback interface (127.0.0.0/8, [::1], localhost). */
bool wire_endpoint_is_local(const char *endpoint);

/* --- server ----------------------------------------------------------------------------------------------- */

struct wire_server;

/* The machine at the other end of a connection, as that shows it, whatever messages claim: one for each key that comes
 * in by CURVE, else one for each network address; all zero: this machine, by ipc. */
enum { WIRE_MACHINE_BYTES = 16 };
struct wire_machine {
    uint8_t id[WIRE_MACHINE_BYTES];
};

/* A connection as the server knows it; valid until it breaks. Compare with wire_peer_equal. Who may not work may only
 * look: nothing else that it sends may be heeded. */
enum { WIRE_PEER_BYTES = 16 };
struct wire_peer {
    struct wire_machine machine;
    bool own; /* it came by wire_server_bind_own's endpoint */
    bool may_work;
    uint8_t socket; /* the server's own */
    uint8_t size;
    uint8_t id[WIRE_PEER_BYTES];
};

bool wire_peer_equal(const struct wire_peer *a, const struct wire_peer *b);
bool wire_machine_equal(const struct wire_machine *a, const struct wire_machine *b);

/* With keys, only who has one of the keys on its lists can speak over TCP, encrypted (CURVE); ipc stays plain, because
 * there the file system says who may enter. Without keys (NULL) everything is plain, and everybody may work. Finishes
 * *keys in any case: ZeroMQ alone has the secret then. At most one server with keys from wire_start to wire_stop. NULL
 * with *error filled if ZeroMQ refuses. */
struct wire_server *wire_server_create(struct coordinator_keys *keys, struct error *error);

/* Accepts NULL in *server. Drops what is not yet sent, so a GOODBYE just sent is mostly lost; and ZeroMQ drops
 * what a client has not yet read when its connection ends. A server that wants to be heard stays until its
 * peers have answered. */
void wire_server_destroy(struct wire_server **server);

/* Binds one more endpoint (full form). Writes the bound endpoint, with the port chosen for *, to
 * bound[WIRE_ENDPOINT_BYTES] unless NULL. STATUS_FAILED with a sentence, e.g. that the port is in use, or
 * that HOST is not of this machine (names are not looked up here). A socket that is left at an ipc path is
 * replaced, any other file there is an error. */
enum status wire_server_bind(struct wire_server *server, const char *endpoint, char *bound,
                             struct error *error);

/* The same for an endpoint (ipc, in a folder that only this user can enter) of which nobody knows but processes that
 * this one starts: those who come there can be told from all others. */
enum status wire_server_bind_own(struct wire_server *server, const char *endpoint, struct error *error);

/* Sends data[size] (copied). False if the peer is gone or its queue is full. */
bool wire_server_send(struct wire_server *server, const struct wire_peer *peer, const void *data, size_t size);

/* Takes one waiting message of at most MESSAGE_BYTES_MAX into *data (replacing what it held). False if none
 * waits. Malformed multi-part messages are dropped silently. */
bool wire_server_receive(struct wire_server *server, struct wire_peer *peer, struct bytes *data);

/* Waits until a message can be received, one of fds[count] is ready (their revents are set), or timeout_ms
 * have passed (−1: for ever). Returns early on a signal. With keys, logs who has been refused meanwhile; of many
 * refusals only some (refusals.h). */
void wire_server_wait(struct wire_server *server, struct pollfd *fds, size_t count, int timeout_ms);

/* --- client ----------------------------------------------------------------------------------------------- */

struct wire_client;

/* Connects (in the background, again and again) to the endpoint, once its name has an address (wire_client_name); with
 * keys (not NULL) over TCP only to the coordinator that they name, encrypted. One that refuses looks as one that is not
 * there. Finishes *keys in any case: ZeroMQ alone has the secret then. ZeroMQ tries no more after the server sent a
 * message over the limit, and does not mind a connection that stays silent: a caller that hears nothing for some
 * seconds calls wire_client_reconnect. */
struct wire_client *wire_client_create(const char *endpoint, struct worker_keys *keys, struct error *error);

/* Accepts NULL in *client. What is still to be sent keeps being sent until wire_stop. */
void wire_client_destroy(struct wire_client **client);

/* Connects anew, to the address that its name has now; what waits to be read is dropped, what waits to be sent is still
 * tried for two seconds. */
enum status wire_client_reconnect(struct wire_client *client, struct error *error);

/* As for the server. False while there is no connection or the queue is full. */
bool wire_client_send(struct wire_client *client, const void *data, size_t size);
bool wire_client_receive(struct wire_client *client, struct bytes *data);

/* As for the server, and returns, once, when a send that was refused can be tried again: a client that is not
 * yet connected sends, is refused, waits, and sends again, without trying in steps. Returns early, too, when
 * wire_client_name has something to tell. */
void wire_client_wait(struct wire_client *client, struct pollfd *fds, size_t count, int timeout_ms);

/* What is new, since the last call, of the address of the endpoint's name, for which a thread of its own searches,
 * again and again until there is one. WIRE_NAME_LACKING, with *error filled: there is none, which is told again only
 * when there is another reason. WIRE_NAME_FOUND: after that, there is one. */
enum wire_name { WIRE_NAME_SAME, WIRE_NAME_LACKING, WIRE_NAME_FOUND };
enum wire_name wire_client_name(struct wire_client *client, struct error *error);

/* While that search goes on there is nothing to connect to. */
bool wire_client_seeks_address(const struct wire_client *client);

#endif
