/* Private to the HTTP server. */
#ifndef WEFT_COORDINATOR_HTTP_PRIVATE_H
#define WEFT_COORDINATOR_HTTP_PRIVATE_H

#include <microhttpd.h>
#include <pthread.h>

#include "coordinator/board.h"
#include "coordinator/http.h"
#include "coordinator/preview.h"

enum {
    HTTP_CONNECTIONS_MAX = 64,
    HTTP_CONNECTIONS_OF_ONE_MAX = 32,     /* of one address */
    HTTP_CONNECTION_BYTES = 16 * 1024,    /* of a request's head, and what else a connection needs */
    HTTP_SILENCE_S = 15,                  /* of a connection that is closed */
    HTTP_REQUEST_MS = 30 * 1000,          /* from one request's end to the next one's */
    HTTP_RUN_BYTES = 17,
};

struct http_connection {
    int socket; /* −1: this entry is free */
    int64_t since_ms;
};

/* A PNG of a preview, as it was last asked for. */
struct http_picture {
    struct MHD_Response *response; /* NULL: none was */
    size_t job;
    uint64_t version;
    int64_t made_ms, cost_ms;
};

struct http_server {
    struct board *board;
    struct MHD_Daemon *daemon;
    char run[HTTP_RUN_BYTES]; /* tells this process from those before and after it */
    bool local;               /* only this machine reaches it */
    bool guarded;             /* by the token */
    struct http_token token;

    pthread_mutex_t mutex; /* guards these: */
    const struct render_job *jobs;
    size_t job_count;
    struct http_connection connections[HTTP_CONNECTIONS_MAX];

    /* of the thread that answers: */
    bool lowered;                  /* its priority */
    const struct snapshot *state;  /* what these are of: */
    struct MHD_Response *json, *metrics;
    struct http_picture pictures[PREVIEW_KINDS];
};

/* libmicrohttpd's MHD_AccessHandlerCallback; `server` is a struct http_server. */
enum MHD_Result http_answer(void *server, struct MHD_Connection *connection, const char *url, const char *method,
                            const char *version, const char *data, size_t *size, void **request);

/* Frees what the thread that answers has made; that has ended. */
void http_forget_answers(struct http_server *server);

#endif
