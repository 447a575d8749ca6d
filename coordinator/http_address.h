/*
 * Where weft render --http listens, and by which names a browser may call it there.
 */
#ifndef WEFT_COORDINATOR_HTTP_ADDRESS_H
#define WEFT_COORDINATOR_HTTP_ADDRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

#include "base/error.h"

struct http_address {
    struct sockaddr_storage socket;
    socklen_t size;
};

/* PORT or :PORT, of 127.0.0.1; or ADDR:PORT: ADDR is an IPv4 address, an IPv6 address in brackets, localhost, or * for
 * all of IPv4. PORT is 0..65535, 0 for any that is free. STATUS_USAGE otherwise. */
enum status http_address_parse(const char *text, struct http_address *address, struct error *error);

/* Whether only this machine can reach it. */
bool http_address_is_local(const struct http_address *address);

/* Opens a socket that listens there, and sets the port in *address to the one it got. −1 with *error set. */
int http_address_listen(struct http_address *address, struct error *error);

/* http://ADDR:PORT/ */
enum { HTTP_URL_BYTES = 80 };
void http_address_url(const struct http_address *address, char url[HTTP_URL_BYTES]);

/* Whether the Host of a request (NULL: it has none) is a name that no stranger can have pointed here: localhost or an
 * address of this machine's loopback interface, with any port or none. */
bool http_host_is_local(const char *host);

#endif
