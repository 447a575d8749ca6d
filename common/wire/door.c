#include "wire/door.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <zmq.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/memory.h"
#include "wire/refusals.h"
#include "wire/socket_private.h"

static const char questions_endpoint[] = "inproc://zeromq.zap.01", news_endpoint[] = "inproc://weft.door";

/* The parts of a question. */
enum { VERSION, REQUEST, DOMAIN, ADDRESS, ROUTING_ID, MECHANISM, KEY, PARTS };

struct door {
    void *guarded;   /* borrowed */
    void *questions; /* the thread's own while it runs, as is news */
    void *news;      /* of failed handshakes */
    int stop;        /* a descriptor that can be read once the thread is to end */
    bool running;
    pthread_t thread;
    struct key_list workers, watchers;
    struct bytes parts[PARTS]; /* of the message that the thread has received */
    pthread_mutex_t lock;      /* of refusals */
    struct refusals refusals;
};

static void note(struct door *door, const char *text)
{
    pthread_mutex_lock(&door->lock);
    refusals_note(&door->refusals, text, clock_now_ms());
    pthread_mutex_unlock(&door->lock);
}

void door_tell(struct door *door)
{
    char line[REFUSAL_LINE_BYTES];
    pthread_mutex_lock(&door->lock);
    while (refusals_take(&door->refusals, line))
        log_warning("%s", line);
    pthread_mutex_unlock(&door->lock);
}

/* --- questions -------------------------------------------------------------------------------------------- */

static bool part_is(const struct bytes *part, const char *text)
{
    return part->size == strlen(text) && memcmp(part->data, text, part->size) == 0;
}

/* Its name within; "": it stays outside. */
static void judge(struct door *door, const struct key *key, char user[WIRE_USER_BYTES])
{
    static_assert(sizeof DOOR_WATCHER - 1 + KEY_TEXT_BYTES <= WIRE_USER_BYTES, "names fit");
    char text[KEY_TEXT_BYTES], line[REFUSAL_BYTES];
    key_text(key, text);
    if (key_list_has(&door->workers, key)) {
        snprintf(user, WIRE_USER_BYTES, DOOR_WORKER "%s", text);
        return;
    }
    if (key_list_has(&door->watchers, key)) {
        snprintf(user, WIRE_USER_BYTES, DOOR_WATCHER "%s", text);
        return;
    }
    snprintf(line, sizeof line, "refused %.*s: its key %s is not among the workers or watchers",
             (int)door->parts[ADDRESS].size, (const char *)door->parts[ADDRESS].data, text);
    note(door, line);
}

/* The same request number, then the verdict; version 1.0 has no more of them. */
static void answer(struct door *door, const char *user)
{
    const struct bytes *request = &door->parts[REQUEST];
    const char *const rest[] = {*user ? "200" : "400", "", user, ""};
    const size_t count = sizeof rest / sizeof *rest;
    wire_socket_send(door->questions, "1.0", 3, true);
    wire_socket_send(door->questions, request->data, request->size, true);
    for (size_t i = 0; i < count; i++)
        wire_socket_send(door->questions, rest[i], strlen(rest[i]), i + 1 < count);
}

static size_t receive(struct door *door, void *socket)
{
    struct bytes *parts[PARTS];
    for (size_t i = 0; i < PARTS; i++)
        parts[i] = &door->parts[i];
    return wire_socket_receive(socket, parts, PARTS, NULL);
}

static void answer_questions(struct door *door)
{
    struct bytes *parts = door->parts;
    for (size_t count = receive(door, door->questions); count > 0; count = receive(door, door->questions)) {
        char user[WIRE_USER_BYTES] = "";
        struct key key;
        if (count == PARTS && part_is(&parts[VERSION], "1.0") && part_is(&parts[MECHANISM], "CURVE") &&
            parts[KEY].size == sizeof key.bytes) {
            memcpy(key.bytes, parts[KEY].data, sizeof key.bytes);
            judge(door, &key, user);
        }
        answer(door, user);
    }
}

/* --- news ------------------------------------------------------------------------------------------------- */

enum { NEWS = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL };

/* Who comes without keys may go before it has said so, as soon as it hears that keys are wanted. */
static const char *reason_of(uint16_t event, int32_t value)
{
    if (event == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL)
        return "it showed no key until the connection ended, as a worker without --keys does";
    switch (value) {
    case ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH: return "it came without keys";
    case ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC: return "its messages are not encrypted for this coordinator's key";
    default: return "it does not keep to the protocol";
    }
}

/* Before a handshake is through, ZeroMQ says at which endpoint somebody knocked, but not who. */
static void hear_news(struct door *door)
{
    enum { EVENT_BYTES = 6 }; /* the event's number (u16) and value (i32), then a part with the endpoint */
    while (receive(door, door->news) > 0) {
        const struct bytes *event = &door->parts[0], *endpoint = &door->parts[1];
        char line[REFUSAL_BYTES];
        uint16_t number;
        int32_t value;
        if (event->size != EVENT_BYTES)
            continue;
        memcpy(&number, event->data, sizeof number);
        memcpy(&value, event->data + sizeof number, sizeof value);
        snprintf(line, sizeof line, "refused somebody at %.*s: %s", (int)endpoint->size, (const char *)endpoint->data,
                 reason_of(number, value));
        note(door, line);
    }
}

/* --- the thread ------------------------------------------------------------------------------------------- */

static void *keep(void *context)
{
    struct door *door = context;
    struct pollfd stop = {.fd = door->stop, .events = POLLIN};
    while (!(stop.revents & POLLIN)) {
        struct wire_waiting waiting[] = {{.socket = door->questions, .events = POLLIN},
                                         {.socket = door->news, .events = POLLIN}};
        wire_socket_wait(waiting, 2, &stop, 1, -1);
        answer_questions(door);
        hear_news(door);
    }
    return NULL;
}

static enum status open_sockets(struct door *door, struct error *error)
{
    door->questions = wire_socket_open(WIRE_ANSWERER, error);
    door->news = door->questions ? wire_socket_open(WIRE_MONITOR, error) : NULL;
    if (!door->news)
        return STATUS_FAILED;
    if (zmq_bind(door->questions, questions_endpoint) == 0 &&
        zmq_socket_monitor(door->guarded, news_endpoint, NEWS) == 0 &&
        zmq_connect(door->news, news_endpoint) == 0)
        return STATUS_OK;
    return error_set(error, STATUS_FAILED, "ZeroMQ cannot ask who may come in: %s", zmq_strerror(errno));
}

static enum status start(struct door *door, struct error *error)
{
    enum status status = open_sockets(door, error);
    if (status != STATUS_OK)
        return status;
    door->stop = eventfd(0, EFD_CLOEXEC);
    if (door->stop < 0)
        return error_set(error, STATUS_FAILED, "cannot make an event descriptor: %s", strerror(errno));
    int failure = pthread_create(&door->thread, NULL, keep, door);
    door->running = failure == 0;
    return door->running ? STATUS_OK
                         : error_set(error, STATUS_FAILED, "cannot start a thread: %s", strerror(failure));
}

struct door *door_create(void *guarded, struct key_list *workers, struct key_list *watchers, struct error *error)
{
    struct door *door = memory_array(1, sizeof *door);
    *door = (struct door){.guarded = guarded, .stop = -1, .workers = *workers, .watchers = *watchers,
                          .lock = PTHREAD_MUTEX_INITIALIZER};
    if (start(door, error) != STATUS_OK) {
        door->workers = door->watchers = (struct key_list){0};
        door_destroy(&door);
        return NULL;
    }
    *workers = *watchers = (struct key_list){0};
    return door;
}

/* The news end while the thread still hears them: closing their socket first can hang ZeroMQ. */
void door_destroy(struct door **pointer)
{
    struct door *door = *pointer;
    if (!door)
        return;
    zmq_socket_monitor(door->guarded, NULL, 0);
    if (door->running) {
        eventfd_write(door->stop, 1);
        pthread_join(door->thread, NULL);
    }
    if (door->stop >= 0)
        close(door->stop);
    wire_socket_close(&door->news, true);
    wire_socket_close(&door->questions, true);
    for (size_t i = 0; i < PARTS; i++)
        bytes_finish(&door->parts[i]);
    key_list_finish(&door->workers);
    key_list_finish(&door->watchers);
    pthread_mutex_destroy(&door->lock);
    free(door);
    *pointer = NULL;
}
