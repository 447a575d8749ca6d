#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/options.h"
#include "coordinator/http_private.h"
#include "base/json_text.h"
#include "coordinator/metrics.h"
#include "coordinator/page.h"
#include "coordinator/snapshot_json.h"
#include "base/text.h"

/* --- responses -------------------------------------------------------------------------------------------- */

/* Nothing from elsewhere, nothing inline, in nobody's frame, kept by nobody. */
static const char *const headers[][2] = {
    {"Content-Security-Policy", "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cache-Control", "no-store"},
};

static void forget(struct MHD_Response **response)
{
    if (*response)
        MHD_destroy_response(*response);
    *response = NULL;
}

/* Responses are NULL where libmicrohttpd has no memory for them: then the connection ends, and the render goes on. An
 * answer lacks none of its headers, so *response becomes NULL too where one cannot be added. */
static void add_header(struct MHD_Response **response, const char *key, const char *value)
{
    if (*response && MHD_add_response_header(*response, key, value) != MHD_YES)
        forget(response);
}

/* `how` says whose the data is: with MHD_RESPMEM_MUST_FREE the response's from now on. */
static struct MHD_Response *make(const struct http_server *server, const void *data, size_t size,
                                 enum MHD_ResponseMemoryMode how, const char *type)
{
    struct MHD_Response *response = MHD_create_response_from_buffer(size, (void *)data, how);
    if (!response && how == MHD_RESPMEM_MUST_FREE)
        free((void *)data);
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++)
        add_header(&response, headers[i][0], headers[i][1]);
    add_header(&response, "Weft-Run", server->run);
    add_header(&response, "Content-Type", type);
    return response;
}

static struct MHD_Response *make_of(const struct http_server *server, const struct bytes *content, const char *type)
{
    return make(server, content->data, content->size, MHD_RESPMEM_MUST_FREE, type);
}

static enum MHD_Result queue(struct MHD_Connection *connection, unsigned code, struct MHD_Response *response)
{
    return response ? MHD_queue_response(connection, code, response) : MHD_NO;
}

/* Queues it, and gives up what we have of it. */
static enum MHD_Result send_once(struct MHD_Connection *connection, unsigned code, struct MHD_Response *response)
{
    enum MHD_Result result = queue(connection, code, response);
    forget(&response);
    return result;
}

static struct MHD_Response *make_sentence(const struct http_server *server, const char *sentence)
{
    return make(server, sentence, strlen(sentence), MHD_RESPMEM_PERSISTENT, "text/plain; charset=utf-8");
}

static enum MHD_Result refuse(const struct http_server *server, struct MHD_Connection *connection, unsigned code,
                              const char *sentence)
{
    struct MHD_Response *response = make_sentence(server, sentence);
    if (code == MHD_HTTP_METHOD_NOT_ALLOWED)
        add_header(&response, "Allow", "GET, HEAD");
    if (code == MHD_HTTP_UNAUTHORIZED)
        add_header(&response, "WWW-Authenticate", "Bearer realm=\"weft\"");
    if (code == MHD_HTTP_SERVICE_UNAVAILABLE)
        add_header(&response, "Retry-After", "1");
    return send_once(connection, code, response);
}

void http_forget_answers(struct http_server *server)
{
    forget(&server->json);
    forget(&server->metrics);
    for (int i = 0; i < PREVIEW_KINDS; i++)
        forget(&server->pictures[i].response);
}

/* --- the state -------------------------------------------------------------------------------------------- */

/* Writes what a snapshot is as text. */
typedef void write_state(struct bytes *text, const struct snapshot *snapshot);

/* Made once for each state, for all who ask. */
static enum MHD_Result send_state(struct http_server *server, struct MHD_Connection *connection,
                                  struct MHD_Response **made, write_state *write, const char *type)
{
    const struct snapshot *state = board_look(server->board);
    if (!state)
        return refuse(server, connection, MHD_HTTP_SERVICE_UNAVAILABLE, "The render is about to begin.\n");
    if (state != server->state) {
        forget(&server->json);
        forget(&server->metrics);
        server->state = state;
    }
    if (!*made) {
        struct bytes text = {0};
        write(&text, state);
        *made = make_of(server, &text, type);
    }
    return queue(connection, MHD_HTTP_OK, *made);
}

static enum MHD_Result send_job(struct http_server *server, struct MHD_Connection *connection)
{
    return send_state(server, connection, &server->json, snapshot_write_json, "application/json");
}

static enum MHD_Result send_metrics(struct http_server *server, struct MHD_Connection *connection)
{
    return send_state(server, connection, &server->metrics, metrics_write, METRICS_CONTENT_TYPE);
}

/* --- the log and the last minutes ------------------------------------------------------------------------- */

/* A whole number of the query; `otherwise` where it is not there or none. */
static int64_t query_number(struct MHD_Connection *connection, const char *key, int64_t otherwise)
{
    struct error ignored;
    int64_t number;
    const char *text = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, key);
    if (!text || options_integer(key, text, 0, INT64_MAX, &number, &ignored) != STATUS_OK)
        return otherwise;
    return number;
}

static enum MHD_Result send_log(struct http_server *server, struct MHD_Connection *connection)
{
    struct bytes json = {0};
    board_put_lines(server->board, (uint64_t)query_number(connection, "from", 0), &json);
    return send_once(connection, MHD_HTTP_OK, make_of(server, &json, "application/json"));
}

static enum MHD_Result send_history(struct http_server *server, struct MHD_Connection *connection)
{
    struct bytes json = {0};
    board_put_history(server->board, &json);
    return send_once(connection, MHD_HTTP_OK, make_of(server, &json, "application/json"));
}

/* --- the picture ------------------------------------------------------------------------------------------ */

/* That the query asks for, and its number; NULL: there is none. */
static struct preview *find_preview(struct http_server *server, struct MHD_Connection *connection, size_t *job)
{
    int64_t number = query_number(connection, "job", 0);
    struct preview *preview = NULL;
    pthread_mutex_lock(&server->mutex);
    if ((uint64_t)number < server->job_count)
        preview = server->jobs[number].preview;
    pthread_mutex_unlock(&server->mutex);
    *job = (size_t)number;
    return preview;
}

static enum MHD_Result send_rows(struct http_server *server, struct MHD_Connection *connection)
{
    size_t job;
    struct preview *preview = find_preview(server, connection, &job);
    if (!preview)
        return refuse(server, connection, MHD_HTTP_NOT_FOUND, "There is no such scene.\n");
    struct preview_share *shares;
    struct bytes json = {0};
    size_t count = preview_shares(preview, &shares);
    text_put(&json, "{\"rows\":[");
    for (size_t i = 0; i < count; i++) {
        text_put(&json, "%s{\"first_row\":%" PRIu32 ",\"rows\":%" PRIu32 ",", i ? "," : "", shares[i].first_row,
                 shares[i].rows);
        json_text_number(&json, "worker", shares[i].worker > 0 ? shares[i].worker : NAN, 0);
        text_put(&json, "}");
    }
    text_put(&json, "]}\n");
    free(shares);
    return send_once(connection, MHD_HTTP_OK, make_of(server, &json, "application/json"));
}

static void name_version(const struct http_server *server, const struct http_picture *picture,
                         enum preview_kind kind, char tag[64])
{
    snprintf(tag, 64, "\"%s-%zu-%d-%" PRIu64 "\"", server->run, picture->job, (int)kind, picture->version);
}

/* Once a second at most, and so seldom that it takes a twentieth of this thread's time at most. */
static bool is_due(const struct http_server *server, const struct http_picture *picture, int64_t now_ms)
{
    enum { LEAST_MS = 800, SHARE = 20 };
    int64_t wait_ms = picture->cost_ms * SHARE > LEAST_MS ? picture->cost_ms * SHARE : LEAST_MS;
    return board_is_over(server->board) || now_ms - picture->made_ms >= wait_ms;
}

/* Computed by this thread so far. */
static int64_t thread_ms(void)
{
    struct timespec used;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return (int64_t)used.tv_sec * 1000 + used.tv_nsec / 1000000;
}

static void make_picture(const struct http_server *server, struct http_picture *picture, struct preview *preview,
                         enum preview_kind kind, size_t job)
{
    char tag[64];
    struct bytes png = {0};
    int64_t begun_ms = thread_ms();
    forget(&picture->response);
    picture->job = job;
    picture->version = preview_png(preview, kind, &png);
    picture->made_ms = clock_now_ms();
    picture->cost_ms = thread_ms() - begun_ms;
    picture->response = png.size > 0 ? make_of(server, &png, "image/png") : NULL;
    name_version(server, picture, kind, tag);
    add_header(&picture->response, "ETag", tag);
}

static bool find_kind(struct MHD_Connection *connection, enum preview_kind *kind)
{
    static const char *const names[PREVIEW_KINDS] = {"picture", "samples", "error"};
    const char *name = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, "show");
    for (*kind = PREVIEW_PICTURE; name && *kind < PREVIEW_KINDS; (*kind)++)
        if (strcmp(name, names[*kind]) == 0)
            break;
    return *kind < PREVIEW_KINDS;
}

static enum MHD_Result send_unchanged(struct http_server *server, struct MHD_Connection *connection, const char *tag)
{
    struct MHD_Response *response = make(server, "", 0, MHD_RESPMEM_PERSISTENT, "image/png");
    add_header(&response, "ETag", tag);
    return send_once(connection, MHD_HTTP_NOT_MODIFIED, response);
}

static enum MHD_Result send_picture(struct http_server *server, struct MHD_Connection *connection)
{
    size_t job;
    enum preview_kind kind;
    struct preview *preview = find_preview(server, connection, &job);
    if (!preview || !find_kind(connection, &kind))
        return refuse(server, connection, MHD_HTTP_NOT_FOUND, "There is no such picture.\n");
    board_note_look(server->board);
    struct http_picture *picture = &server->pictures[kind];
    if (!picture->response || picture->job != job ||
        (picture->version != preview_version(preview) && is_due(server, picture, clock_now_ms())))
        make_picture(server, picture, preview, kind, job);
    if (!picture->response)
        return refuse(server, connection, MHD_HTTP_SERVICE_UNAVAILABLE, "There is no memory for the picture.\n");
    char tag[64];
    name_version(server, picture, kind, tag);
    const char *known = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "If-None-Match");
    if (known && strcmp(known, tag) == 0)
        return send_unchanged(server, connection, tag);
    return queue(connection, MHD_HTTP_OK, picture->response);
}

/* --- requests --------------------------------------------------------------------------------------------- */

static const struct route {
    const char *path;
    enum MHD_Result (*send)(struct http_server *server, struct MHD_Connection *connection);
} routes[] = {
    {"/api/job", send_job},         {"/api/log", send_log},         {"/api/history", send_history},
    {"/api/rows", send_rows},       {"/preview.png", send_picture}, {"/metrics", send_metrics},
};

static const struct route *find_route(const char *path)
{
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++)
        if (strcmp(routes[i].path, path) == 0)
            return &routes[i];
    return NULL;
}

static bool shows_token(const struct http_server *server, struct MHD_Connection *connection)
{
    return !server->guarded ||
           http_token_matches(&server->token,
                              MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Authorization"));
}

static enum MHD_Result answer(struct http_server *server, struct MHD_Connection *connection, const char *path,
                              const char *method)
{
    const struct page_file *file = page_find(path);
    const struct route *route = find_route(path);
    if (strcmp(method, "GET") != 0 && strcmp(method, "HEAD") != 0)
        return refuse(server, connection, MHD_HTTP_METHOD_NOT_ALLOWED, "Only GET and HEAD are answered.\n");
    if (server->local && !http_host_is_local(MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Host")))
        return refuse(server, connection, MHD_HTTP_MISDIRECTED_REQUEST,
                      "This server is called localhost or by its address, and answers to no other Host.\n");
    if (file)
        return send_once(connection, MHD_HTTP_OK,
                         make(server, file->data, file->size, MHD_RESPMEM_PERSISTENT, file->type));
    if (!route)
        return refuse(server, connection, MHD_HTTP_NOT_FOUND, "There is no such page.\n");
    if (!shows_token(server, connection))
        return refuse(server, connection, MHD_HTTP_UNAUTHORIZED,
                      "This needs the token that weft was given: Authorization: Bearer TOKEN.\n");
    return route->send(server, connection);
}

/* Called once with the head of a request, then with its body, if it has one, and once more. A GET that has a body, and
 * whatever else has a head that can be refused at once, ends its connection. */
enum MHD_Result http_answer(void *context, struct MHD_Connection *connection, const char *url, const char *method,
                            const char *version, const char *data, size_t *size, void **request)
{
    static int begun;
    (void)version;
    (void)data;
    if (!*request && (strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0)) {
        *request = &begun;
        return MHD_YES;
    }
    return *size > 0 ? MHD_NO : answer(context, connection, url, method);
}
