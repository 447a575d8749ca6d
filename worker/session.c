#include "worker/session.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "wire/manifest.h"
#include "worker/cache.h"

enum {
    FETCH_WINDOW = 4 * MESSAGE_CHUNK_MAX, /* bytes asked for and not yet received */
    RETRY_FIRST_MS = 1,                   /* after a HELLO that found no connection; doubled each time */
    RETRY_LAST_MS = 200,
    RENEW_LAST_MS = 20000,                /* a connection that leads nowhere is given up after SESSION_SILENCE_MS, then
                                           * after twice that, …: a server on which thousands knock needs its time */
    REFUSED_PAUSE_MS = 10000,             /* before asking again a coordinator that has no use for this worker */
    BROKEN_PAUSE_MS = 1000,               /* before asking again one that broke the protocol */
};

enum session_state { STATE_SEEKING, STATE_JOINED, STATE_ENDED };

enum job_state { JOB_FETCHING, JOB_LOADING, JOB_READY, JOB_UNUSABLE };

struct session_job {
    uint32_t number;
    enum job_state state;
    struct job_settings settings;
    struct digest manifest_digest;
    uint64_t manifest_bytes;
    struct manifest manifest; /* empty until it has come */
};

/* A band that the worker holds; records are there from when it is rendered until it is acknowledged. */
struct held_band {
    uint64_t lease;
    uint32_t job;
    struct bytes records;
};

/* The one asset on its way. While its job ends it is not active, until some job asks for it again. */
struct fetch {
    bool active;
    struct digest digest;
    uint64_t total, requested;
    struct bytes bytes;
};

struct session {
    struct session_config config;
    enum session_state state;
    bool draining;
    bool unfit; /* said FAILED in this conversation */
    uint64_t epoch;
    int64_t seeking_since_ms, hello_ms, retry_ms, say_ms, renew_ms, renew_pause_ms, heard_ms, beat_ms;
    uint64_t progress, rays;
    struct cache cache;
    struct fetch fetch;
    struct session_job *jobs;
    size_t job_count, job_capacity;
    struct held_band *bands;
    size_t band_count, band_capacity;
    struct session_action *actions; /* taken up to action_at */
    size_t action_at, action_count, action_capacity;
};

/* --- actions ---------------------------------------------------------------------------------------------- */

static struct session_action *act(struct session *s, enum session_action_kind kind)
{
    s->actions = memory_grow(s->actions, &s->action_capacity, s->action_count + 1, sizeof *s->actions);
    struct session_action *action = &s->actions[s->action_count++];
    *action = (struct session_action){.kind = kind};
    return action;
}

bool session_take(struct session *s, struct session_action *action)
{
    if (s->action_at == s->action_count) {
        s->action_at = s->action_count = 0;
        return false;
    }
    *action = s->actions[s->action_at++];
    return true;
}

static void send_message(struct session *s, struct message message)
{
    message.epoch = s->epoch;
    message_encode(&message, &act(s, SESSION_SEND)->bytes);
}

static void __attribute__((format(printf, 2, 3))) say(struct session *s, const char *format, ...)
{
    struct session_action *action = act(s, SESSION_SAY);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(action->text, sizeof action->text, format, arguments);
    va_end(arguments);
}

static void end(struct session *s, int exit_status)
{
    s->state = STATE_ENDED;
    act(s, SESSION_EXIT)->exit_status = exit_status;
}

/* --- coming and going ------------------------------------------------------------------------------------- */

/* On a connection that is new; with a HELLO from pause_ms on. */
static void begin_seeking(struct session *s, int64_t pause_ms, int64_t now_ms)
{
    s->seeking_since_ms = now_ms;
    s->hello_ms = now_ms + pause_ms;
    s->renew_pause_ms = SESSION_SILENCE_MS;
    s->say_ms = s->renew_ms = now_ms + SESSION_SILENCE_MS;
    s->retry_ms = RETRY_FIRST_MS;
}

struct session *session_create(const struct session_config *config, int64_t now_ms)
{
    struct session *s = memory_array(1, sizeof *s);
    s->config = *config;
    begin_seeking(s, 0, now_ms);
    return s;
}

/* What is still to be done for the job is not done: a message before it may have met a lost connection. */
static void drop_actions(struct session *s, uint32_t job)
{
    size_t kept = s->action_at;
    for (size_t i = s->action_at; i < s->action_count; i++) {
        const struct session_action *action = &s->actions[i];
        bool dropped = (action->kind == SESSION_LOAD || action->kind == SESSION_START) && action->job == job;
        if (!dropped)
            s->actions[kept++] = *action;
    }
    s->action_count = kept;
}

static void forget_job(struct session *s, size_t index)
{
    struct session_job *job = &s->jobs[index];
    drop_actions(s, job->number);
    act(s, SESSION_FORGET)->job = job->number;
    for (size_t i = s->band_count; i-- > 0;) {
        if (s->bands[i].job != job->number)
            continue;
        bytes_finish(&s->bands[i].records);
        s->bands[i] = s->bands[--s->band_count];
    }
    manifest_finish(&job->manifest);
    s->job_count--;
    for (struct session_job *to = job; to < s->jobs + s->job_count; to++) /* keeps the order of announcement */
        *to = to[1];
}

static void stop_fetching(struct session *s)
{
    bytes_finish(&s->fetch.bytes);
    s->fetch = (struct fetch){0};
}

static void forget_all(struct session *s)
{
    while (s->job_count > 0)
        forget_job(s, s->job_count - 1);
    stop_fetching(s);
    cache_trim(&s->cache, CACHE_BYTES_MAX);
}

void session_destroy(struct session **pointer)
{
    struct session *s = *pointer;
    if (!s)
        return;
    forget_all(s);
    struct session_action action;
    while (session_take(s, &action))
        bytes_finish(&action.bytes);
    cache_finish(&s->cache);
    free(s->jobs);
    free(s->bands);
    free(s->actions);
    free(s);
    *pointer = NULL;
}

/* Looks for a coordinator, on a new connection, from pause_ms on. */
static void seek(struct session *s, int64_t pause_ms, int64_t now_ms)
{
    forget_all(s);
    act(s, SESSION_RECONNECT);
    s->state = STATE_SEEKING;
    s->epoch = 0;
    s->unfit = false;
    begin_seeking(s, pause_ms, now_ms);
    if (s->draining)
        end(s, 0);
}

void session_send_failed(struct session *s, int64_t now_ms)
{
    if (s->state == STATE_SEEKING) {
        s->hello_ms = now_ms + s->retry_ms;
        s->retry_ms = 2 * s->retry_ms < RETRY_LAST_MS ? 2 * s->retry_ms : RETRY_LAST_MS;
    } else if (s->state == STATE_JOINED) {
        say(s, "lost the connection to the coordinator; looking for it again");
        seek(s, 0, now_ms);
    }
}

/* What else can be the matter when no coordinator is heard. */
static const char *doubt(const struct session *s)
{
    return s->config.keyed ? " (if there is one, its keys and this worker's may not match)" : "";
}

static void seek_on(struct session *s, int64_t now_ms)
{
    if (s->config.wait_ms >= 0 && now_ms - s->seeking_since_ms >= s->config.wait_ms) {
        say(s, "no coordinator answered within %lld s%s", (long long)(s->config.wait_ms / 1000), doubt(s));
        end(s, STATUS_FAILED);
        return;
    }
    if (now_ms >= s->say_ms) {
        say(s, "waiting for a coordinator%s", doubt(s));
        s->say_ms = now_ms + SESSION_SAY_MS;
    }
    if (now_ms >= s->renew_ms) { /* a connection can be dead without ZeroMQ noticing */
        act(s, SESSION_RECONNECT);
        s->renew_pause_ms = 2 * s->renew_pause_ms < RENEW_LAST_MS ? 2 * s->renew_pause_ms : RENEW_LAST_MS;
        s->renew_ms = now_ms + s->renew_pause_ms;
    }
    if (now_ms >= s->hello_ms) {
        send_message(s, s->config.hello);
        s->hello_ms = now_ms + SESSION_HELLO_MS;
    }
}

/* --- fetching assets -------------------------------------------------------------------------------------- */

/* Even an empty asset has one chunk. */
static void request_chunks(struct session *s)
{
    struct fetch *fetch = &s->fetch;
    while (fetch->requested == 0 ||
           (fetch->requested < fetch->total && fetch->requested - fetch->bytes.size < FETCH_WINDOW)) {
        send_message(s, (struct message){.kind = MESSAGE_NEED,
                                         .need = {.digest = fetch->digest, .offset = fetch->requested}});
        fetch->requested += MESSAGE_CHUNK_MAX;
    }
}

/* An asset that was on its way already goes on where it is: its next chunks have been asked for. */
static void start_fetch(struct session *s, const struct digest *digest, uint64_t total)
{
    struct fetch *fetch = &s->fetch;
    if (fetch->requested == 0 || fetch->total != total || !digest_equal(&fetch->digest, digest)) {
        stop_fetching(s);
        *fetch = (struct fetch){.digest = *digest, .total = total};
    }
    fetch->active = true;
    request_chunks(s);
}

static void fail_job(struct session *s, struct session_job *job, const char *reason)
{
    struct message message = {.kind = MESSAGE_FAILED, .failed = {.job = job->number}};
    snprintf(message.failed.reason, sizeof message.failed.reason, "%s", reason);
    job->state = JOB_UNUSABLE;
    s->unfit = true;
    send_message(s, message);
    say(s, "cannot work on job %u: %s", job->number, reason);
}

/* Takes the manifest from the cache. False if it has yet to be fetched. */
static bool have_manifest(struct session *s, struct session_job *job)
{
    if (job->manifest.count > 0)
        return true;
    const struct bytes *bytes = cache_find(&s->cache, &job->manifest_digest);
    if (!bytes) {
        start_fetch(s, &job->manifest_digest, job->manifest_bytes);
        return false;
    }
    struct error error;
    if (manifest_decode(&job->manifest, bytes->data, bytes->size, &error) == STATUS_OK)
        return true;
    fail_job(s, job, error.text);
    return false;
}

/* Fetches the first file that the job lacks; if it lacks none, has it loaded. */
static void advance_job(struct session *s, struct session_job *job)
{
    if (!have_manifest(s, job))
        return;
    for (size_t i = 0; i < job->manifest.count; i++) {
        const struct manifest_entry *entry = &job->manifest.entries[i];
        if (cache_find(&s->cache, &entry->digest))
            continue;
        start_fetch(s, &entry->digest, entry->size);
        return;
    }
    job->state = JOB_LOADING;
    act(s, SESSION_LOAD)->job = job->number;
}

static void fetch_on(struct session *s)
{
    for (size_t i = 0; i < s->job_count && !s->fetch.active; i++)
        if (s->jobs[i].state == JOB_FETCHING)
            advance_job(s, &s->jobs[i]);
}

/* The coordinator does not keep the protocol: its bytes cannot be trusted further. */
static void break_off(struct session *s, const char *reason, int64_t now_ms)
{
    say(s, "the coordinator broke the protocol (%s); starting anew", reason);
    seek(s, BROKEN_PAUSE_MS, now_ms);
}

static void complete_fetch(struct session *s, int64_t now_ms)
{
    struct digest wanted = s->fetch.digest;
    bytes_put_u8(&s->fetch.bytes, 0); /* a NUL that the size does not count, as readers expect */
    s->fetch.bytes.size--;
    cache_add(&s->cache, &s->fetch.bytes);
    stop_fetching(s);
    if (cache_find(&s->cache, &wanted))
        fetch_on(s);
    else
        break_off(s, "an asset's bytes do not have its digest", now_ms);
}

static void take_asset(struct session *s, const struct message *message, int64_t now_ms)
{
    struct fetch *fetch = &s->fetch;
    if (!fetch->active || !digest_equal(&message->asset.digest, &fetch->digest))
        return; /* for a job that has ended */
    uint64_t left = fetch->total - fetch->bytes.size, expected = left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX;
    if (message->asset.total != fetch->total || message->asset.offset != fetch->bytes.size ||
        message->asset.size != expected) {
        break_off(s, "an asset's chunks do not fit together", now_ms);
        return;
    }
    bytes_put(&fetch->bytes, message->asset.data, message->asset.size);
    if (fetch->bytes.size == fetch->total)
        complete_fetch(s, now_ms);
    else
        request_chunks(s);
}

static void take_job(struct session *s, const struct message *message, int64_t now_ms)
{
    for (size_t i = 0; i < s->job_count; i++)
        if (s->jobs[i].number == message->job.job) {
            break_off(s, "a job was announced twice", now_ms);
            return;
        }
    s->jobs = memory_grow(s->jobs, &s->job_capacity, s->job_count + 1, sizeof *s->jobs);
    s->jobs[s->job_count++] = (struct session_job){
        .number = message->job.job,
        .settings = message->job.settings,
        .manifest_digest = message->job.manifest,
        .manifest_bytes = message->job.manifest_bytes,
    };
    fetch_on(s);
}

/* --- jobs and bands --------------------------------------------------------------------------------------- */

static struct session_job *find_job(const struct session *s, uint32_t number)
{
    for (size_t i = 0; i < s->job_count; i++)
        if (s->jobs[i].number == number)
            return &s->jobs[i];
    return NULL;
}

static struct held_band *find_band(const struct session *s, uint64_t lease)
{
    for (size_t i = 0; i < s->band_count; i++)
        if (s->bands[i].lease == lease)
            return &s->bands[i];
    return NULL;
}

static void drop_band(struct session *s, uint64_t lease)
{
    struct held_band *band = find_band(s, lease);
    if (!band)
        return;
    bytes_finish(&band->records);
    *band = s->bands[--s->band_count];
}

const char *session_assets(const struct session *s, uint32_t number, struct job_settings *settings,
                           struct asset_set *assets)
{
    const struct session_job *job = find_job(s, number);
    assert(job && job->manifest.count > 0);
    *settings = job->settings;
    for (size_t i = 0; i < job->manifest.count; i++) {
        const struct manifest_entry *entry = &job->manifest.entries[i];
        const struct bytes *bytes = cache_find(&s->cache, &entry->digest);
        struct bytes copy = {0};
        bytes_put(&copy, bytes->data, bytes->size + 1); /* with its NUL */
        copy.size--;
        asset_set_add(assets, entry->name, &copy);
    }
    return assets->assets[0].name;
}

static void take_band(struct session *s, const struct message *message, int64_t now_ms)
{
    const struct session_job *job = find_job(s, message->band.job);
    struct order order = order_of(message);
    bool fits = job && job->state == JOB_READY && order_fits(&order, &job->settings);
    if (!fits || find_band(s, message->band.lease)) {
        break_off(s, "a band that is not of a ready job", now_ms);
        return;
    }
    if (s->band_count == s->config.hello.hello.credit) {
        break_off(s, "more bands than this worker can take", now_ms);
        return;
    }
    s->bands = memory_grow(s->bands, &s->band_capacity, s->band_count + 1, sizeof *s->bands);
    s->bands[s->band_count++] = (struct held_band){.lease = message->band.lease, .job = message->band.job};
    struct session_action *action = act(s, SESSION_START);
    action->job = message->band.job;
    action->lease = message->band.lease;
    action->order = order;
}

static void take_rendered(struct session *s, const struct session_event *event)
{
    struct held_band *band = find_band(s, event->lease);
    if (!band || band->records.data) { /* revoked meanwhile, and perhaps given anew with the same lease */
        bytes_finish(event->records);
        return;
    }
    band->records = *event->records;
    *event->records = (struct bytes){0};
    for (size_t offset = 0; offset < band->records.size; offset += MESSAGE_CHUNK_MAX) {
        size_t left = band->records.size - offset;
        send_message(s, (struct message){.kind = MESSAGE_RESULT, .result = {
            .job = band->job, .lease = band->lease, .offset = offset, .total = band->records.size,
            .data = band->records.data + offset,
            .size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX)}});
    }
}

static void take_end(struct session *s, uint32_t number)
{
    for (size_t i = 0; i < s->job_count; i++) {
        if (s->jobs[i].number != number)
            continue;
        forget_job(s, i);
        if (s->job_count == 0) /* nobody's assets are in use */
            cache_trim(&s->cache, CACHE_BYTES_MAX);
        s->fetch.active = false;
        fetch_on(s);
        if (!s->fetch.active)
            stop_fetching(s);
        return;
    }
}

/* --- events ----------------------------------------------------------------------------------------------- */

static void take_refusal(struct session *s, const struct message *message, int64_t now_ms)
{
    say(s, "the coordinator refused this worker: %s", message->refuse.reason);
    if (s->config.once)
        end(s, STATUS_FAILED);
    s->hello_ms = now_ms + REFUSED_PAUSE_MS;
}

/* A coordinator that ends stays until it hears the answer; then it is gone. One whose job this worker could not load
 * stays too, and would welcome it again at once, and again. */
static void take_goodbye(struct session *s, int64_t now_ms)
{
    send_message(s, (struct message){.kind = MESSAGE_GOODBYE});
    seek(s, s->unfit ? REFUSED_PAUSE_MS : 0, now_ms);
    if (s->config.once && s->state != STATE_ENDED)
        end(s, 0);
}

static void join(struct session *s, uint64_t epoch, int64_t now_ms)
{
    s->state = STATE_JOINED;
    s->epoch = epoch;
    s->beat_ms = now_ms;
    say(s, "joined a coordinator");
}

static void handle_joined_message(struct session *s, const struct message *message, int64_t now_ms)
{
    switch (message->kind) {
    case MESSAGE_JOB:
        take_job(s, message, now_ms);
        break;
    case MESSAGE_ASSET:
        take_asset(s, message, now_ms);
        break;
    case MESSAGE_BAND:
        take_band(s, message, now_ms);
        break;
    case MESSAGE_ACK:
        drop_band(s, message->ack.lease);
        break;
    case MESSAGE_REVOKE:
        drop_band(s, message->revoke.lease);
        act(s, SESSION_CANCEL)->lease = message->revoke.lease;
        break;
    case MESSAGE_END:
        take_end(s, message->end.job);
        break;
    case MESSAGE_REFUSE: /* the coordinator goes on without it, but not for ever: not even --once ends with this */
        say(s, "the coordinator gave this worker up (%s); joining anew", message->refuse.reason);
        seek(s, 0, now_ms);
        break;
    case MESSAGE_GOODBYE:
        take_goodbye(s, now_ms);
        break;
    default:
        break; /* beats, and what a coordinator has no business sending */
    }
}

static void handle_message(struct session *s, const struct message *message, int64_t now_ms)
{
    if (s->state == STATE_SEEKING && message->kind == MESSAGE_REFUSE)
        take_refusal(s, message, now_ms);
    else if (s->state == STATE_SEEKING && message->kind == MESSAGE_WELCOME)
        join(s, message->epoch, now_ms);
    else if (s->state != STATE_JOINED || message->epoch != s->epoch)
        return;
    s->heard_ms = now_ms;
    if (message->kind != MESSAGE_WELCOME && s->state == STATE_JOINED)
        handle_joined_message(s, message, now_ms);
}

static void handle_loaded(struct session *s, const struct session_event *event)
{
    struct session_job *job = find_job(s, event->job);
    if (!job || job->state != JOB_LOADING)
        return;
    if (event->kind == SESSION_LOAD_FAILED) {
        fail_job(s, job, event->reason);
        return;
    }
    job->state = JOB_READY;
    send_message(s, (struct message){.kind = MESSAGE_READY, .ready = {.job = job->number}});
}

static void drain(struct session *s)
{
    s->draining = true;
    if (s->state == STATE_SEEKING)
        end(s, 0);
    else
        send_message(s, (struct message){.kind = MESSAGE_DRAIN});
}

static void keep_alive(struct session *s, int64_t now_ms)
{
    if (now_ms - s->heard_ms >= SESSION_SILENCE_MS) {
        say(s, "no word from the coordinator for %d s; looking for it again", SESSION_SILENCE_MS / 1000);
        seek(s, 0, now_ms);
        return;
    }
    if (now_ms >= s->beat_ms) {
        send_message(s, (struct message){.kind = MESSAGE_BEAT, .beat = {s->progress, s->rays}});
        s->beat_ms = now_ms + SESSION_BEAT_MS;
    }
}

void session_handle(struct session *s, const struct session_event *event, int64_t now_ms)
{
    if (s->state == STATE_ENDED) {
        if (event->kind == SESSION_RENDERED)
            bytes_finish(event->records);
        return;
    }
    switch (event->kind) {
    case SESSION_TICK:
        s->progress = event->progress;
        s->rays = event->rays;
        break;
    case SESSION_MESSAGE:
        handle_message(s, event->message, now_ms);
        break;
    case SESSION_LOADED:
    case SESSION_LOAD_FAILED:
        handle_loaded(s, event);
        break;
    case SESSION_RENDERED:
        take_rendered(s, event);
        break;
    case SESSION_DRAIN:
        drain(s);
        break;
    }
    if (s->state == STATE_SEEKING)
        seek_on(s, now_ms);
    if (s->state == STATE_JOINED)
        keep_alive(s, now_ms);
    if (s->state == STATE_JOINED && s->draining && s->band_count == 0) {
        send_message(s, (struct message){.kind = MESSAGE_GOODBYE});
        end(s, 0);
    }
}

int64_t session_deadline(const struct session *s)
{
    if (s->state == STATE_ENDED)
        return INT64_MAX;
    if (s->state == STATE_JOINED)
        return s->beat_ms < s->heard_ms + SESSION_SILENCE_MS ? s->beat_ms : s->heard_ms + SESSION_SILENCE_MS;
    int64_t deadline = s->hello_ms < s->say_ms ? s->hello_ms : s->say_ms;
    deadline = s->renew_ms < deadline ? s->renew_ms : deadline;
    if (s->config.wait_ms >= 0 && s->seeking_since_ms + s->config.wait_ms < deadline)
        deadline = s->seeking_since_ms + s->config.wait_ms;
    return deadline;
}
