/*
 * The secret that a browser shows before it is told anything.
 */
#ifndef WEFT_COORDINATOR_HTTP_TOKEN_H
#define WEFT_COORDINATOR_HTTP_TOKEN_H

#include <stdbool.h>

#include "base/error.h"
#include "base/hash.h"

/* Its digest, so that all comparisons are of one length. */
struct http_token {
    struct digest digest;
};

enum { HTTP_TOKEN_LEAST = 16, HTTP_TOKEN_MOST = 256 }; /* characters */

/* Reads a file of one line, which only its owner can read: a token of letters, digits and -._~+/=. STATUS_INPUT if it
 * is not such a file. */
enum status http_token_read(const char *path, struct http_token *token, struct error *error);

/* Whether the Authorization of a request (NULL: it has none) is "Bearer" and this token; takes as long if it is not. */
bool http_token_matches(const struct http_token *token, const char *authorization);

#endif
