/*
 * One who asks how things stand, and a coordinator that answers anything. The input is a script (script.h); after each
 * step the asker says what is due.
 *
 * Messages of the coordinator; NUMBER is how far behind the question's number it answers:
 *   T NUMBER TICKET  an answer that is only a ticket
 *   p MORE SIZE      the next part: SIZE KiB and a byte ('o': as large as a message can be), and so many more follow
 *   P PLACE SIZE     a part from PLACE KiB on, the last one          q NUMBER SIZE  one of another question
 *   L . .            a last part of all, which completes the answer  R . .          a refusal
 *   m . COUNT        the next COUNT bytes, as a message
 * What else happens:
 *   t TIME UNIT      TIME ms later, or (UNIT 1) TIME * 256 ms       d . .          it is the deadline
 *   f . .            the last question could not be sent            g . .          the answer has been read
 */
#include "coordinator/inquiry.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/script.h"

enum { WAIT_MS = 5000, KIB = 1024 };

static struct {
    struct inquiry inquiry;
    int64_t now_ms, said_ms;
    uint64_t number, ticket; /* that the next question has */
    bool may_ask;            /* before a question is said again */
    bool over;
    bool raw;                /* parts hold anything */
} run;

/* What an answer has there. */
static uint8_t byte_at(uint64_t offset)
{
    return (uint8_t)(offset % 251);
}

static void say(void)
{
    struct bytes bytes = {0};
    struct message message;
    struct error error;
    if (inquiry_say(&run.inquiry, &bytes, run.now_ms)) {
        require(message_decode(&message, bytes.data, bytes.size, &error) == STATUS_OK);
        require(message.kind == MESSAGE_ASK && message.epoch == 0);
        require(message.ask.number == run.number && message.ask.ticket == run.ticket);
        require(run.may_ask || run.now_ms - run.said_ms >= INQUIRY_AGAIN_MS);
        run.may_ask = false;
        run.said_ms = run.now_ms;
    } else {
        require(bytes.size == 0);
    }
    bytes_finish(&bytes);
}

/* --- what the coordinator says ---------------------------------------------------------------------------- */

static void check_answer(void)
{
    const struct bytes *text = &run.inquiry.text;
    require(text->size <= MESSAGE_STATUS_MAX && text->capacity <= 2 * MESSAGE_STATUS_MAX);
    if (!run.inquiry.complete)
        return;
    require(text->size > 0);
    for (size_t i = 0; i < text->size && !run.raw; i++)
        require(text->data[i] == byte_at(i));
}

/* The ticket is that of a whole answer, or of one that is nothing else; an answer that is complete stays as it is. */
static void receive_bytes(const void *data, size_t size)
{
    struct message message;
    struct error error = {{0}}, ignored;
    bool is_message = message_decode(&message, data, size, &ignored) == STATUS_OK;
    bool is_status = is_message && message.kind == MESSAGE_STATUS;
    bool heeded = is_status && message.status.number == run.number && !run.inquiry.complete;
    bool only_ticket = heeded && message.status.total == 0;
    enum status status = inquiry_take(&run.inquiry, data, size, run.now_ms, &error);
    if (status != STATUS_OK) {
        require(status == STATUS_FAILED && error.text[0]);
        require(!is_status);
        run.over = true;
        return;
    }
    require(is_message);
    require(!only_ticket || !run.inquiry.complete);
    if (only_ticket || (heeded && run.inquiry.complete))
        run.ticket = message.status.ticket;
    require(only_ticket || !heeded || !run.inquiry.complete || run.inquiry.text.size == message.status.total);
    run.may_ask |= only_ticket;
    check_answer();
}

static void receive(const struct message *message)
{
    struct bytes bytes = {0};
    message_encode(message, &bytes);
    receive_bytes(bytes.data, bytes.size);
    bytes_finish(&bytes);
}

static void receive_ticket(unsigned behind, unsigned ticket)
{
    receive(&(struct message){.kind = MESSAGE_STATUS, .status = {.number = run.number - behind, .ticket = ticket}});
}

static void receive_part(unsigned behind, uint64_t offset, unsigned size_kib, uint64_t more, bool last)
{
    static uint8_t data[MESSAGE_CHUNK_MAX];
    uint32_t size = size_kib == SCRIPT_NUMBERS - 1 ? MESSAGE_CHUNK_MAX : size_kib * KIB + 1;
    uint64_t total = offset + size + more;
    for (uint32_t i = 0; i < size; i++)
        data[i] = byte_at(offset + i);
    receive(&(struct message){.kind = MESSAGE_STATUS, .status = {
        .number = run.number - behind, .ticket = total, .last = last, .offset = offset, .total = total, .data = data,
        .size = size}});
}

static bool message_step(char what, unsigned x, unsigned y)
{
    /* A part more than an answer can have is no message, and would end it. */
    uint64_t next = run.inquiry.text.size < MESSAGE_STATUS_MAX - MESSAGE_CHUNK_MAX - SCRIPT_NUMBERS * KIB
                        ? run.inquiry.text.size : 0;
    switch (what) {
    case 'T':
        receive_ticket(x, y);
        return true;
    case 'p':
        receive_part(0, next, y, (uint64_t)x * KIB, false);
        return true;
    case 'P':
        receive_part(0, (uint64_t)x * KIB, y, 0, false);
        return true;
    case 'q':
        receive_part(x, next, y, 0, false);
        return true;
    case 'L':
        receive_part(0, next, 0, 0, true);
        return true;
    case 'R':
        receive(&(struct message){.kind = MESSAGE_REFUSE, .refuse = {"no"}});
        return true;
    default:
        return false;
    }
}

/* --- what else happens ------------------------------------------------------------------------------------ */

/* It asks then, or has waited long enough. */
static void pass_deadline(void)
{
    int64_t deadline_ms = inquiry_deadline(&run.inquiry);
    if (run.inquiry.complete)
        return;
    run.now_ms = deadline_ms > run.now_ms ? deadline_ms : run.now_ms;
    int64_t said_ms = run.said_ms;
    bool may_ask = run.may_ask;
    say();
    require(run.said_ms != said_ms || run.may_ask != may_ask || inquiry_is_late(&run.inquiry, run.now_ms));
}

static void read_answer(void)
{
    if (!run.inquiry.complete)
        return;
    inquiry_go_on(&run.inquiry, run.now_ms);
    run.number++;
    run.may_ask = true;
}

static bool other_step(char what, unsigned x, unsigned y)
{
    switch (what) {
    case 't':
        run.now_ms += y == 1 ? x * 256 : x;
        return true;
    case 'd':
        pass_deadline();
        return true;
    case 'f':
        inquiry_not_said(&run.inquiry, run.now_ms);
        run.may_ask = true;
        return true;
    case 'g':
        read_answer();
        return true;
    default:
        return false;
    }
}

static bool step(char what, unsigned x, unsigned y)
{
    return message_step(what, x, y) || other_step(what, x, y);
}

static void receive_raw(unsigned who, const struct bytes *bytes)
{
    (void)who;
    run.raw = true;
    receive_bytes(bytes->data, bytes->size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct script_reader reader = {step, receive_raw};
    memset(&run, 0, sizeof run);
    run.number = 1;
    run.may_ask = true;
    inquiry_init(&run.inquiry, size % 2 ? 250 : 0, WAIT_MS, run.now_ms);
    for (size_t at = 0; at < size && !run.over;) {
        say();
        at += script_take(&reader, data + at, size - at);
    }
    inquiry_finish(&run.inquiry);
    return 0;
}
