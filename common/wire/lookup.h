/*
 * Private to the wire: the search for the address of a host's name, in a thread of its own, for the system can take
 * many seconds over it and cannot be hurried. ZeroMQ would search in the thread that carries all messages: it says
 * nothing when that fails, and cannot end before it is over.
 */
#ifndef WEFT_WIRE_LOOKUP_H
#define WEFT_WIRE_LOOKUP_H

#include <netinet/in.h>

#include "base/error.h"

struct lookup;

/* Searches again and again, until there is an address. The thread has the signal mask of the caller. NULL with *error
 * filled if the system has no thread or descriptor left. */
struct lookup *lookup_create(const char *host, struct error *error);

/* It can be read once lookup_take has news. */
int lookup_descriptor(const struct lookup *lookup);

/* What has happened since the last call. LOOKUP_FAILED: *failure says why (as getaddrinfo does); the search goes on.
 * LOOKUP_FOUND: the first IPv4 address, in digits; the search is over. */
enum lookup_news { LOOKUP_NOTHING, LOOKUP_FAILED, LOOKUP_FOUND };
enum lookup_news lookup_take(struct lookup *lookup, int *failure, char address[INET_ADDRSTRLEN]);

/* Waits for nothing: a thread that is in the middle of a search ends after it. Accepts NULL in *lookup and sets it to
 * NULL. */
void lookup_destroy(struct lookup **lookup);

#endif
