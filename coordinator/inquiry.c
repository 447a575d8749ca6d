#include "coordinator/inquiry.h"

#include "wire/message.h"

void inquiry_init(struct inquiry *q, uint32_t pause_ms, int64_t wait_ms, int64_t now_ms)
{
    *q = (struct inquiry){
        .pause_ms = pause_ms, .wait_ms = wait_ms, .number = 1, .ask_ms = now_ms, .heard_ms = now_ms};
}

void inquiry_finish(struct inquiry *q)
{
    bytes_finish(&q->text);
}

bool inquiry_say(struct inquiry *q, struct bytes *message, int64_t now_ms)
{
    if (q->complete || now_ms < q->ask_ms)
        return false;
    message_encode(&(struct message){.kind = MESSAGE_ASK,
                                     .ask = {.number = q->number, .ticket = q->ticket, .pause_ms = q->pause_ms}},
                   message);
    q->ask_ms = now_ms + INQUIRY_AGAIN_MS;
    return true;
}

void inquiry_not_said(struct inquiry *q, int64_t now_ms)
{
    q->ask_ms = now_ms + INQUIRY_RETRY_MS;
}

/* Part by part, as they were sent; an answer that begins anew is another one, after a connection that was lost. */
static void take_part(struct inquiry *q, const struct message *message, int64_t now_ms)
{
    if (message->status.offset == 0)
        q->text.size = 0;
    if (message->status.offset != q->text.size || message->status.size == 0)
        return;
    bytes_put(&q->text, message->status.data, message->status.size);
    q->heard_ms = now_ms;
    q->complete = q->text.size == message->status.total;
    q->last = message->status.last;
}

/* The ticket of an answer is shown when all of it is there: shown earlier, by a question that is said again, it would
 * bring a second one. */
static void take_status(struct inquiry *q, const struct message *message, int64_t now_ms)
{
    bool only_ticket = message->status.total == 0;
    if (message->status.number != q->number || q->complete)
        return;
    if (only_ticket)
        q->ask_ms = now_ms;
    else
        take_part(q, message, now_ms);
    if (only_ticket || q->complete)
        q->ticket = message->status.ticket;
    q->heard_ms = q->heard ? q->heard_ms : now_ms;
    q->heard = true;
}

enum status inquiry_take(struct inquiry *q, const void *data, size_t size, int64_t now_ms, struct error *error)
{
    struct message message;
    unsigned version = message_version(data, size);
    if (version > 0 && version != PROTOCOL_VERSION)
        return error_set(error, STATUS_FAILED, "the coordinator speaks version %u of the protocol, this weft %d",
                         version, PROTOCOL_VERSION);
    if (message_decode(&message, data, size, error) != STATUS_OK)
        return STATUS_FAILED;
    if (message.kind == MESSAGE_REFUSE)
        return error_set(error, STATUS_FAILED, "the coordinator does not answer: %s", message.refuse.reason);
    if (message.kind == MESSAGE_STATUS)
        take_status(q, &message, now_ms);
    return STATUS_OK;
}

void inquiry_go_on(struct inquiry *q, int64_t now_ms)
{
    q->complete = false;
    q->text.size = 0;
    q->number++;
    q->ask_ms = now_ms;
}

static int64_t patience_ms(const struct inquiry *q)
{
    return q->heard_ms + q->wait_ms + (q->heard ? q->pause_ms : 0);
}

int64_t inquiry_deadline(const struct inquiry *q)
{
    return q->ask_ms < patience_ms(q) ? q->ask_ms : patience_ms(q);
}

bool inquiry_is_late(const struct inquiry *q, int64_t now_ms)
{
    return now_ms >= patience_ms(q);
}

void inquiry_goodbye(struct bytes *message)
{
    message_encode(&(struct message){.kind = MESSAGE_GOODBYE}, message);
}
