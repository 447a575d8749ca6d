/*
 * The status page of a render and what else there is by HTTP: its state as JSON, metrics for Prometheus, and the
 * picture so far. One thread of its own, of low priority, answers (libmicrohttpd), from what the loop of the farm has
 * left on a board and from the jobs' previews; nothing that a browser does can make the loop wait. The number of
 * connections, their memory and their time are limited.
 */
#ifndef WEFT_COORDINATOR_HTTP_H
#define WEFT_COORDINATOR_HTTP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "coordinator/http_address.h"
#include "coordinator/http_token.h"
#include "coordinator/render_job.h"
#include "coordinator/snapshot.h"

struct http_server;

/* Listens, says where, and answers from now on; listens to the log, too. `token`: what all but the empty page needs
 * (NULL: nothing). NULL with *error set if it cannot: *status is STATUS_FAILED where the address is not to be had, else
 * STATUS_INTERNAL. */
struct http_server *http_create(const struct http_address *address, const struct http_token *token,
                                enum status *status, struct error *error);

/* Shows these from now on; borrowed until http_destroy. */
void http_show_jobs(struct http_server *server, const struct render_job *jobs, size_t count);

/* For the loop: a descriptor that is readable when http_wait_ms is to be asked again; how long until http_publish is
 * wanted, in milliseconds; and the present state, borrowed for the call. `last`: there will be none after it. */
int http_bell(const struct http_server *server);
int http_wait_ms(struct http_server *server, int64_t now_ms);
void http_publish(struct http_server *server, const struct snapshot *snapshot, int64_t now_ms, bool last);

/* Where a page has the last state to show, waits up to 3 s until it has it. */
void http_linger(struct http_server *server);

/* Ends all connections, frees *server and sets it to NULL; *server may be NULL. */
void http_destroy(struct http_server **server);

#endif
