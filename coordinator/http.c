#include "coordinator/http_private.h"

#include <errno.h>
#include <signal.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"

/* --- connections ------------------------------------------------------------------------------------------ */

/* Where others compute, whoever asks often gets little of a core. */
static void lower_priority(struct http_server *server)
{
    enum { NICE = 10 };
    if (!server->lowered)
        setpriority(PRIO_PROCESS, 0, NICE); /* of this thread alone, on Linux */
    server->lowered = true;
}

static struct http_connection *add_connection(struct http_server *server, int socket)
{
    struct http_connection *found = NULL;
    pthread_mutex_lock(&server->mutex);
    for (int i = 0; i < HTTP_CONNECTIONS_MAX && !found; i++)
        if (server->connections[i].socket < 0)
            found = &server->connections[i];
    if (found)
        *found = (struct http_connection){socket, clock_now_ms()};
    pthread_mutex_unlock(&server->mutex);
    return found;
}

static void note_connection(void *context, struct MHD_Connection *connection, void **entry,
                            enum MHD_ConnectionNotificationCode what)
{
    struct http_server *server = context;
    lower_priority(server);
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        *entry = add_connection(server,
                                MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd);
    } else if (*entry) {
        pthread_mutex_lock(&server->mutex);
        ((struct http_connection *)*entry)->socket = -1;
        pthread_mutex_unlock(&server->mutex);
    }
}

static void note_request_done(void *context, struct MHD_Connection *connection, void **request,
                              enum MHD_RequestTerminationCode how)
{
    (void)request;
    (void)how;
    struct http_server *server = context;
    struct http_connection *entry =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
    if (!entry)
        return;
    pthread_mutex_lock(&server->mutex);
    entry->since_ms = clock_now_ms();
    pthread_mutex_unlock(&server->mutex);
}

/* Who asks, or takes the answer, so slowly that it would hold a connection for ever, a byte now and then, loses it. */
static void end_slow_connections(struct http_server *server, int64_t now_ms)
{
    pthread_mutex_lock(&server->mutex);
    for (int i = 0; i < HTTP_CONNECTIONS_MAX; i++) {
        const struct http_connection *entry = &server->connections[i];
        if (entry->socket >= 0 && now_ms - entry->since_ms > HTTP_REQUEST_MS)
            shutdown(entry->socket, SHUT_RDWR);
    }
    pthread_mutex_unlock(&server->mutex);
}

/* --- starting --------------------------------------------------------------------------------------------- */

/* A signal is for the loop, so the thread is made with all of them blocked. */
static struct MHD_Daemon *start_daemon(struct http_server *server, int listener, bool six)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    struct MHD_Daemon *daemon = MHD_start_daemon(
        MHD_USE_EPOLL_INTERNAL_THREAD | (six ? MHD_USE_IPv6 : 0), 0, NULL, NULL, http_answer, server,
        MHD_OPTION_LISTEN_SOCKET, listener,
        MHD_OPTION_CONNECTION_LIMIT, (unsigned)HTTP_CONNECTIONS_MAX,
        MHD_OPTION_PER_IP_CONNECTION_LIMIT, (unsigned)HTTP_CONNECTIONS_OF_ONE_MAX,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)HTTP_CONNECTION_BYTES,
        MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)HTTP_SILENCE_S,
        MHD_OPTION_NOTIFY_CONNECTION, note_connection, server,
        MHD_OPTION_NOTIFY_COMPLETED, note_request_done, server, MHD_OPTION_END);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return daemon;
}

static void name_run(char run[HTTP_RUN_BYTES])
{
    uint8_t random[(HTTP_RUN_BYTES - 1) / 2];
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(run, HTTP_RUN_BYTES, random, sizeof random);
}

static void take_line(void *board, enum log_level level, const char *text)
{
    board_add_line(board, level, text);
}

static void say_where(const struct http_server *server, const struct http_address *address)
{
    char url[HTTP_URL_BYTES];
    http_address_url(address, url);
    log_info("status page at %s%s", url, server->guarded ? "#TOKEN, with the token behind the #" : "");
}

static enum status start(struct http_server *server, const struct http_address *asked, struct error *error)
{
    struct http_address address = *asked;
    int listener = http_address_listen(&address, error);
    if (listener < 0)
        return STATUS_FAILED;
    if (board_bell(server->board) >= 0)
        server->daemon = start_daemon(server, listener, address.socket.ss_family == AF_INET6);
    if (!server->daemon) {
        close(listener);
        return error_set(error, STATUS_INTERNAL,
                         "--http: the server cannot be started: it lacks memory, a descriptor or a thread");
    }
    say_where(server, &address);
    return STATUS_OK;
}

struct http_server *http_create(const struct http_address *address, const struct http_token *token,
                                enum status *status, struct error *error)
{
    struct http_server *server = memory_array(1, sizeof *server);
    server->board = board_create();
    server->local = http_address_is_local(address);
    server->guarded = token != NULL;
    if (token)
        server->token = *token;
    name_run(server->run);
    pthread_mutex_init(&server->mutex, NULL);
    for (int i = 0; i < HTTP_CONNECTIONS_MAX; i++)
        server->connections[i].socket = -1;
    log_set_listener(take_line, server->board);
    *status = start(server, address, error);
    if (*status != STATUS_OK)
        http_destroy(&server);
    return server;
}

void http_destroy(struct http_server **pointer)
{
    struct http_server *server = *pointer;
    if (!server)
        return;
    if (server->daemon)
        MHD_stop_daemon(server->daemon);
    log_set_listener(NULL, NULL);
    http_forget_answers(server);
    board_destroy(&server->board);
    pthread_mutex_destroy(&server->mutex);
    free(server);
    *pointer = NULL;
}

/* --- the loop's side -------------------------------------------------------------------------------------- */

void http_show_jobs(struct http_server *server, const struct render_job *jobs, size_t count)
{
    pthread_mutex_lock(&server->mutex);
    server->jobs = jobs;
    server->job_count = count;
    pthread_mutex_unlock(&server->mutex);
}

int http_bell(const struct http_server *server)
{
    return board_bell(server->board);
}

int http_wait_ms(struct http_server *server, int64_t now_ms)
{
    return board_wait_ms(server->board, now_ms);
}

void http_publish(struct http_server *server, const struct snapshot *snapshot, int64_t now_ms, bool last)
{
    board_publish(server->board, snapshot, now_ms, last);
    end_slow_connections(server, now_ms);
}

void http_linger(struct http_server *server)
{
    board_linger(server->board);
}
