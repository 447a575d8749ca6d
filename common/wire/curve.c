/* ZeroMQ's CURVE on a socket: encrypted, and each side knows the other by its public key (rfc.zeromq.org/spec/26). */
#include <errno.h>

#include <sodium.h>
#include <zmq.h>

#include "wire/socket_private.h"

/* Version 4.3.4 knows this option, but its header has it only among drafts. With a domain set it says: let nobody in
 * while there is no doorkeeper to ask. */
#ifndef ZMQ_ZAP_ENFORCE_DOMAIN
#define ZMQ_ZAP_ENFORCE_DOMAIN 93
#endif
static const char domain[] = "weft";

static enum status refused(struct error *error)
{
    return error_set(error, STATUS_FAILED, "ZeroMQ refuses to use keys (CURVE): %s", zmq_strerror(errno));
}

enum status wire_curve_serve(void *socket, const struct key *secret, struct error *error)
{
    const int yes = 1;
    if (zmq_setsockopt(socket, ZMQ_ZAP_DOMAIN, domain, sizeof domain - 1) == 0 &&
        zmq_setsockopt(socket, ZMQ_ZAP_ENFORCE_DOMAIN, &yes, sizeof yes) == 0 &&
        zmq_setsockopt(socket, ZMQ_CURVE_SERVER, &yes, sizeof yes) == 0 &&
        zmq_setsockopt(socket, ZMQ_CURVE_SECRETKEY, secret->bytes, KEY_BYTES) == 0)
        return STATUS_OK;
    return refused(error);
}

enum status wire_curve_join(void *socket, const struct key *secret, const struct key *server, struct error *error)
{
    struct key public;
    crypto_scalarmult_base(public.bytes, secret->bytes);
    if (zmq_setsockopt(socket, ZMQ_CURVE_SERVERKEY, server->bytes, KEY_BYTES) == 0 &&
        zmq_setsockopt(socket, ZMQ_CURVE_PUBLICKEY, public.bytes, KEY_BYTES) == 0 &&
        zmq_setsockopt(socket, ZMQ_CURVE_SECRETKEY, secret->bytes, KEY_BYTES) == 0)
        return STATUS_OK;
    return refused(error);
}

enum status wire_curve_copy(void *socket, void *from, struct error *error)
{
    struct key secret, server;
    size_t secret_size = KEY_BYTES, server_size = KEY_BYTES;
    enum status status;
    if (zmq_getsockopt(from, ZMQ_CURVE_SECRETKEY, secret.bytes, &secret_size) == 0 &&
        zmq_getsockopt(from, ZMQ_CURVE_SERVERKEY, server.bytes, &server_size) == 0)
        status = wire_curve_join(socket, &secret, &server, error);
    else
        status = refused(error);
    sodium_memzero(&secret, sizeof secret);
    return status;
}
