/*
 * A coordinator that many ask how things stand: one honest asker, and others that say anything. The input is a script
 * (script.h). At its end there is calm: the honest one gets an answer, and the last one of all when the coordinator
 * ends.
 *
 *   a WHO TICKET   WHO asks, with the ticket of its last answer (TICKET 0), of the one before (1), none (2), or another
 *   p WHO PAUSE    WHO asks, with its ticket, for an answer PAUSE * 100 ms after the last
 *   g WHO .        WHO says goodbye           m WHO COUNT  WHO says the next COUNT bytes, as a message
 *   c COUNT .      COUNT * 8 others ask, each once
 *   w COUNT .      so many workers join, of which there is much to say
 *   h CUT .        the honest one's connection breaks after CUT more messages to it; it has another at once
 *   x COUNT .      the next message but COUNT cannot be sent
 *   t TIME UNIT    TIME ms later, or (UNIT 1) TIME * 256 ms
 *   e . .          the coordinator ends
 */
#include "base/log.h"
#include "coordinator/askers.h"
#include "coordinator/dispatcher.h"
#include "coordinator/inquiry.h"
#include "coordinator/snapshot_json.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/script.h"

enum { KNOWN = 16, WORKERS_MAX = 160, STEPS_MAX = 300, NEVER = -1, HONEST_PAUSE_MS = 3000 };

/* Who is who, by the first byte of an address; the others are the number, low byte first. */
enum { OF_ASKER, OF_CROWD, OF_WORKER, OF_HONEST };

/* What an asker may be told. */
struct asker_seen {
    bool certain;             /* that the coordinator knows it; else it may */
    uint64_t ticket, before;  /* of its last answer, and of the one before; 0: none that counts */
    bool shown;               /* it has asked with the ticket, */
    uint64_t number;          /* in this question, */
    uint32_t pause_ms;
    bool told;                /* the last answer of all */
    int64_t heard_ms, answered_ms;
    uint64_t taken, total, coming; /* bytes of an answer that comes in parts, and its ticket */
};

static struct {
    struct dispatcher *dispatcher;
    int64_t now_ms;
    struct asker_seen askers[KNOWN];
    int asking;               /* whose message is being taken; NEVER: none's */
    bool ticking, ending, crowded;
    uint64_t round_bytes, answer_bytes; /* since the tick began; the largest answer */
    int64_t round_ms;         /* the next round, not before */
    uint32_t crowd, workers;  /* that have come */
    int fails, cut;           /* after so many messages, or NEVER */
    struct inquiry inquiry;   /* the honest one's */
    uint32_t connection;      /* its number */
    unsigned answers;
    bool over;                /* it has been told all */
} run;

static struct wire_peer address_of(int kind, uint32_t number)
{
    return (struct wire_peer){
        .machine = {{(uint8_t)kind, (uint8_t)number, (uint8_t)(number >> 8)}},
        .may_work = kind == OF_WORKER || (kind == OF_ASKER && number % 2),
        .size = 3, .id = {(uint8_t)kind, (uint8_t)number, (uint8_t)(number >> 8)}};
}

/* --- what the coordinator says ---------------------------------------------------------------------------- */

static void forget(struct asker_seen *asker)
{
    *asker = (struct asker_seen){.before = asker->ticket, .heard_ms = asker->heard_ms};
}

static void take_ticket(struct asker_seen *asker, const struct message *message)
{
    require(run.asking >= 0 && asker == &run.askers[run.asking] && !asker->certain);
    *asker = (struct asker_seen){
        .certain = true, .ticket = message->status.ticket, .before = asker->ticket ? asker->ticket : asker->before,
        .heard_ms = run.now_ms, .answered_ms = run.now_ms - MESSAGE_PAUSE_MAX_MS};
    require(asker->ticket != 0 && asker->ticket != asker->before);
}

/* Only to who has shown that it has read the last, not before its pause is over, and in a round. */
static void begin_answer(struct asker_seen *asker, const struct message *message)
{
    require(asker->shown && !asker->told);
    require(message->status.ticket != 0 && message->status.ticket != asker->ticket);
    require(run.ending || (run.ticking && run.now_ms >= run.round_ms));
    require(run.ending || run.now_ms >= asker->answered_ms + asker->pause_ms);
    asker->taken = 0;
    asker->total = message->status.total;
    asker->coming = message->status.ticket;
}

static void take_part(struct asker_seen *asker, const struct message *message)
{
    if (message->status.offset == 0)
        begin_answer(asker, message);
    require(message->status.number == asker->number && message->status.ticket == asker->coming);
    require(message->status.offset == asker->taken && message->status.total == asker->total);
    require(message->status.size > 0 && message->status.last == run.ending);
    asker->taken += message->status.size;
    if (asker->taken < asker->total)
        return;
    asker->before = asker->ticket;
    asker->ticket = asker->coming;
    asker->shown = false;
    asker->told = message->status.last;
    asker->answered_ms = run.now_ms;
}

/* A whole answer is what a snapshot is read from; only the last one is read, which takes its time. */
static void check_answer(const struct bytes *text)
{
    struct error error;
    require(text->size > 2 && text->data[0] == '{' && memcmp(text->data + text->size - 2, "}\n", 2) == 0);
    if (!run.inquiry.last)
        return;
    struct snapshot *snapshot = snapshot_read_json((const char *)text->data, text->size, &error);
    require(snapshot);
    free(snapshot);
}

static void tell_honest(const struct wire_peer *to, const void *data, size_t size)
{
    struct error error;
    if (run.cut != NEVER && run.cut-- == 0)
        run.connection++;
    if (!(to->id[1] == (uint8_t)run.connection && to->id[2] == (uint8_t)(run.connection >> 8)) || run.over)
        return;
    require(inquiry_take(&run.inquiry, data, size, run.now_ms, &error) == STATUS_OK);
    if (!run.inquiry.complete)
        return;
    check_answer(&run.inquiry.text);
    run.answers++;
    run.over = run.inquiry.last;
    inquiry_go_on(&run.inquiry, run.now_ms);
}

static bool send_message(void *context, const struct wire_peer *to, const void *data, size_t size)
{
    struct message message;
    struct error error;
    struct asker_seen *asker = to->id[0] == OF_ASKER ? &run.askers[to->id[1]] : NULL;
    (void)context;
    require(message_decode(&message, data, size, &error) == STATUS_OK);
    bool is_status = message.kind == MESSAGE_STATUS;
    if (run.fails != NEVER && run.fails-- == 0) {
        if (asker && is_status)
            forget(asker);
        return false;
    }
    if (is_status) {
        run.round_bytes += message.status.size;
        run.answer_bytes = message.status.total > run.answer_bytes ? message.status.total : run.answer_bytes;
    }
    if (to->id[0] == OF_HONEST)
        tell_honest(to, data, size);
    if (asker && is_status && message.status.total == 0)
        take_ticket(asker, &message);
    else if (asker && is_status)
        take_part(asker, &message);
    return true;
}

/* --- what is said to it ----------------------------------------------------------------------------------- */

static void note_question(struct asker_seen *asker, const struct message *ask)
{
    if (run.crowded && run.now_ms - asker->heard_ms >= ASKERS_FORGET_MS)
        asker->certain = false; /* another may have its place */
    asker->heard_ms = run.now_ms;
    if (asker->ticket == 0 || ask->ask.ticket != asker->ticket)
        return;
    asker->shown = true;
    asker->number = ask->ask.number;
    asker->pause_ms = ask->ask.pause_ms;
}

static void deliver(int kind, uint32_t number, const struct bytes *bytes)
{
    struct wire_peer from = address_of(kind, number);
    dispatcher_take_message(run.dispatcher, &from, bytes->data, bytes->size, run.now_ms);
}

/* Who is new is welcome where there is room. */
static void deliver_of_asker(uint32_t who, const struct bytes *bytes)
{
    struct message message;
    struct error error;
    struct asker_seen *asker = &run.askers[who];
    bool asks = false, has_room = run.fails == NEVER && !run.crowded && run.connection < ASKERS_MAX / 2;
    if (message_decode(&message, bytes->data, bytes->size, &error) == STATUS_OK) {
        asks = message.kind == MESSAGE_ASK;
        if (asks)
            note_question(asker, &message);
        if (message.kind == MESSAGE_GOODBYE && message.epoch == 0)
            forget(asker);
    }
    run.asking = (int)who;
    deliver(OF_ASKER, who, bytes);
    run.asking = NEVER;
    require(!asks || !has_room || asker->certain);
}

static void say(int kind, uint32_t number, const struct message *message)
{
    struct bytes bytes = {0};
    message_encode(message, &bytes);
    if (kind == OF_ASKER)
        deliver_of_asker(number, &bytes);
    else
        deliver(kind, number, &bytes);
    bytes_finish(&bytes);
}

static void ask(int kind, uint32_t who, uint64_t ticket, uint32_t pause_ms)
{
    static uint64_t number;
    say(kind, who, &(struct message){.kind = MESSAGE_ASK, .ask = {++number, ticket, pause_ms}});
}

static void ask_with(uint32_t who, unsigned ticket)
{
    const struct asker_seen *asker = &run.askers[who];
    ask(OF_ASKER, who, ticket == 0 ? asker->ticket : ticket == 1 ? asker->before : ticket - 2, 0);
}

static void send_crowd(unsigned count)
{
    run.crowded = true;
    for (unsigned i = 0; i < count; i++)
        ask(OF_CROWD, run.crowd++, 0, 0);
}

static void add_workers(unsigned count)
{
    struct message hello = {.kind = MESSAGE_HELLO, .hello = {.kernel = "ref", .threads = 1, .credit = 1}};
    memset(hello.hello.host, '\1', sizeof hello.hello.host - 1); /* which JSON makes six characters of */
    for (unsigned i = 0; i < count && run.workers < WORKERS_MAX; i++)
        say(OF_WORKER, run.workers++, &hello);
}

static void ask_honestly(void)
{
    struct bytes bytes = {0};
    if (!run.over && inquiry_say(&run.inquiry, &bytes, run.now_ms))
        deliver(OF_HONEST, run.connection, &bytes);
    bytes_finish(&bytes);
}

/* --- what happens ----------------------------------------------------------------------------------------- */

/* What a round may take, and when the next may come, as askers.h promises. */
static void pass_time(int64_t ms)
{
    run.now_ms += ms;
    run.round_bytes = 0;
    run.ticking = true;
    if (!run.ending)
        dispatcher_tick(run.dispatcher, run.now_ms);
    run.ticking = false;
    require(run.round_bytes <= ASKERS_ROUND_BYTES + run.answer_bytes);
    if (run.round_bytes == 0)
        return;
    int64_t pause_ms = (int64_t)(run.round_bytes / ASKERS_BYTES_PER_MS);
    run.round_ms = run.now_ms + (pause_ms > ASKERS_ROUND_MS ? pause_ms : ASKERS_ROUND_MS);
}

static void end(void)
{
    if (run.ending)
        return;
    run.ending = true;
    dispatcher_say_goodbye(run.dispatcher, run.now_ms);
}

static bool step(char what, unsigned x, unsigned y)
{
    switch (what) {
    case 'a':
        ask_with(x % KNOWN, y);
        return true;
    case 'p':
        ask(OF_ASKER, x % KNOWN, run.askers[x % KNOWN].ticket, y * 100);
        return true;
    case 'g':
        say(OF_ASKER, x % KNOWN, &(struct message){.kind = MESSAGE_GOODBYE});
        return true;
    case 'c':
        send_crowd(x * 8);
        return true;
    case 'w':
        add_workers(x);
        return true;
    case 'h':
        run.cut = (int)x;
        return true;
    case 'x':
        run.fails = (int)x;
        return true;
    case 't':
        pass_time(y == 1 ? x * 256 : x);
        return true;
    case 'e':
        end();
        return true;
    default:
        return false;
    }
}

static void deliver_raw(unsigned who, const struct bytes *bytes)
{
    deliver_of_asker(who % KNOWN, bytes);
}

/* Long enough for who is silent to be forgotten, and for a question to be asked again. */
static void stay_calm(void)
{
    run.fails = run.cut = NEVER;
    for (int i = 0; i < 8; i++) {
        pass_time(INQUIRY_AGAIN_MS);
        ask_honestly();
    }
}

static void come_to_an_end(void)
{
    unsigned answers = run.answers;
    stay_calm();
    require(run.answers > answers || run.over);
    end();
    stay_calm();
    require(run.over);
    require(dispatcher_present(run.dispatcher) <= ASKERS_MAX + run.workers + KNOWN);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct script_reader reader = {step, deliver_raw};
    const struct dispatcher_config config = {.bell = -1, .send = send_message};
    log_start("askers", LOG_SILENT);
    memset(&run, 0, sizeof run);
    run.asking = run.fails = run.cut = NEVER;
    run.dispatcher = dispatcher_create(&config, run.now_ms);
    inquiry_init(&run.inquiry, HONEST_PAUSE_MS, INT32_MAX, run.now_ms);
    for (size_t at = 0, steps = 0; at < size && steps < STEPS_MAX; steps++) {
        ask_honestly();
        at += script_take(&reader, data + at, size - at);
    }
    come_to_an_end();
    inquiry_finish(&run.inquiry);
    dispatcher_destroy(&run.dispatcher);
    return 0;
}
