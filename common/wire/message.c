#include "wire/message.h"

#include <assert.h>
#include <stdbool.h>
#include <string.h>

#include "wire/manifest.h"

static const uint8_t magic[4] = {'W', 'E', 'F', 'T'};

/* --- fields ----------------------------------------------------------------------------------------------- */

/* Reads the fields of one message. The first that breaks its limits fills *error and fails the reader, after
 * which every field reads as zero and nothing more is refused. */
struct decoder {
    struct byte_reader reader;
    const char *kind;
    struct error *error;
    bool refused; /* *error is filled; a reader that failed without it ran out of bytes */
};

static void refuse(struct decoder *in)
{
    in->reader.failed = true;
    in->refused = true;
}

static uint64_t require(struct decoder *in, const char *field, uint64_t value, uint64_t min, uint64_t max)
{
    if (in->reader.failed || (value >= min && value <= max))
        return value;
    error_set(in->error, STATUS_INPUT, "%s: %s: expected %llu to %llu, found %llu", in->kind, field,
              (unsigned long long)min, (unsigned long long)max, (unsigned long long)value);
    refuse(in);
    return value;
}

static uint32_t get_u32(struct decoder *in)
{
    return byte_reader_u32(&in->reader);
}

static uint32_t get_u32_within(struct decoder *in, const char *field, uint32_t min, uint32_t max)
{
    return (uint32_t)require(in, field, get_u32(in), min, max);
}

/* One of `count` values, the first of which is 0. */
static uint8_t get_choice(struct decoder *in, const char *field, unsigned count)
{
    return (uint8_t)require(in, field, byte_reader_u8(&in->reader), 0, count - 1);
}

static uint64_t get_u64(struct decoder *in)
{
    return byte_reader_u64(&in->reader);
}

static void put_digest(struct bytes *out, const struct digest *digest)
{
    bytes_put(out, digest->bytes, DIGEST_BYTES);
}

static void get_digest(struct decoder *in, struct digest *digest)
{
    const uint8_t *from = byte_reader_take(&in->reader, DIGEST_BYTES);
    if (from)
        memcpy(digest->bytes, from, DIGEST_BYTES);
}

static void get_text(struct decoder *in, const char *field, char *text, size_t capacity)
{
    bool failed_before = in->reader.failed;
    byte_reader_string(&in->reader, text, capacity);
    if (failed_before || !in->reader.failed)
        return;
    error_set(in->error, STATUS_INPUT, "%s: %s: expected a text of at most %zu bytes", in->kind, field,
              capacity - 1);
    refuse(in);
}

/* A part of a larger body: where it starts, how long the whole is, and its bytes. */
static void put_chunk(struct bytes *out, uint64_t offset, uint64_t total, const uint8_t *data, uint32_t size)
{
    assert(size <= MESSAGE_CHUNK_MAX && size <= total && offset <= total - size);
    bytes_put_u64(out, offset);
    bytes_put_u64(out, total);
    bytes_put_u32(out, size);
    bytes_put(out, data, size);
}

static void get_chunk(struct decoder *in, uint64_t *offset, uint64_t *total, const uint8_t **data,
                      uint32_t *size)
{
    *offset = get_u64(in);
    *total = get_u64(in);
    *size = get_u32_within(in, "size", 0, MESSAGE_CHUNK_MAX);
    require(in, "size", *size, 0, *total);
    require(in, "offset", *offset, 0, *total - *size);
    *data = byte_reader_take(&in->reader, *size);
}

/* --- kinds ------------------------------------------------------------------------------------------------ */

static void put_hello(const struct message *message, struct bytes *out)
{
    put_digest(out, &message->hello.core_revision);
    put_digest(out, &message->hello.proof);
    bytes_put_string(out, message->hello.host);
    bytes_put_string(out, message->hello.kernel);
    bytes_put_u32(out, message->hello.pid);
    bytes_put_u32(out, message->hello.threads);
    bytes_put_u32(out, message->hello.credit);
}

static void get_hello(struct message *message, struct decoder *in)
{
    get_digest(in, &message->hello.core_revision);
    get_digest(in, &message->hello.proof);
    get_text(in, "host", message->hello.host, sizeof message->hello.host);
    get_text(in, "kernel", message->hello.kernel, sizeof message->hello.kernel);
    message->hello.pid = get_u32(in);
    message->hello.threads = get_u32_within(in, "threads", 1, MESSAGE_THREADS_MAX);
    message->hello.credit = get_u32_within(in, "credit", 1, 4 * MESSAGE_THREADS_MAX);
}

static void put_need(const struct message *message, struct bytes *out)
{
    put_digest(out, &message->need.digest);
    bytes_put_u64(out, message->need.offset);
}

static void get_need(struct message *message, struct decoder *in)
{
    get_digest(in, &message->need.digest);
    message->need.offset = get_u64(in);
}

static void put_ready(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->ready.job);
}

static void get_ready(struct message *message, struct decoder *in)
{
    message->ready.job = get_u32(in);
}

static void put_failed(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->failed.job);
    bytes_put_string(out, message->failed.reason);
}

static void get_failed(struct message *message, struct decoder *in)
{
    message->failed.job = get_u32(in);
    get_text(in, "reason", message->failed.reason, sizeof message->failed.reason);
}

static void put_result(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->result.job);
    bytes_put_u64(out, message->result.lease);
    put_chunk(out, message->result.offset, message->result.total, message->result.data, message->result.size);
}

static void get_result(struct message *message, struct decoder *in)
{
    message->result.job = get_u32(in);
    message->result.lease = get_u64(in);
    get_chunk(in, &message->result.offset, &message->result.total, &message->result.data,
              &message->result.size);
}

static void put_refuse(const struct message *message, struct bytes *out)
{
    bytes_put_string(out, message->refuse.reason);
}

static void get_refuse(struct message *message, struct decoder *in)
{
    get_text(in, "reason", message->refuse.reason, sizeof message->refuse.reason);
}

static void put_job(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->job.job);
    put_digest(out, &message->job.manifest);
    bytes_put_u64(out, message->job.manifest_bytes);
    bytes_put_u32(out, message->job.settings.width);
    bytes_put_u32(out, message->job.settings.height);
    bytes_put_u8(out, message->job.settings.filter);
    bytes_put_u8(out, message->job.settings.pixel_format);
    bytes_put_u8(out, message->job.settings.maps);
}

static void get_job(struct message *message, struct decoder *in)
{
    message->job.job = get_u32(in);
    get_digest(in, &message->job.manifest);
    message->job.manifest_bytes = require(in, "manifest_bytes", get_u64(in), 1, MANIFEST_BYTES_MAX);
    message->job.settings.width = get_u32_within(in, "width", 1, MESSAGE_SIDE_MAX);
    message->job.settings.height = get_u32_within(in, "height", 1, MESSAGE_SIDE_MAX);
    message->job.settings.filter = get_choice(in, "filter", MESSAGE_FILTERS);
    message->job.settings.pixel_format = get_choice(in, "pixel_format", MESSAGE_PIXEL_FORMATS);
    message->job.settings.maps = get_choice(in, "maps", 2);
}

static void put_asset(const struct message *message, struct bytes *out)
{
    put_digest(out, &message->asset.digest);
    put_chunk(out, message->asset.offset, message->asset.total, message->asset.data, message->asset.size);
}

static void get_asset(struct message *message, struct decoder *in)
{
    get_digest(in, &message->asset.digest);
    get_chunk(in, &message->asset.offset, &message->asset.total, &message->asset.data, &message->asset.size);
}

static void put_band(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->band.job);
    bytes_put_u64(out, message->band.lease);
    bytes_put_u32(out, message->band.pass);
    bytes_put_u32(out, message->band.first_row);
    bytes_put_u32(out, message->band.rows);
    bytes_put_u32(out, message->band.sampling.least);
    bytes_put_u32(out, message->band.sampling.most);
    bytes_put_u32(out, message->band.sampling.threshold);
}

static void get_band(struct message *message, struct decoder *in)
{
    message->band.job = get_u32(in);
    message->band.lease = get_u64(in);
    message->band.pass = get_u32_within(in, "pass", 0, PASSES - 1);
    message->band.first_row = get_u32_within(in, "first_row", 0, MESSAGE_SIDE_MAX - 1);
    message->band.rows = get_u32_within(in, "rows", 1, MESSAGE_SIDE_MAX - message->band.first_row);
    struct band_sampling *sampling = &message->band.sampling;
    sampling->least = get_u32_within(in, "least", 1, MESSAGE_SAMPLES_MAX);
    sampling->most = get_u32_within(in, "most", sampling->least, MESSAGE_SAMPLES_MAX);
    sampling->threshold = get_u32_within(in, "threshold", 0, MESSAGE_THRESHOLD_MAX);
}

static void put_ack(const struct message *message, struct bytes *out)
{
    bytes_put_u64(out, message->ack.lease);
}

static void get_ack(struct message *message, struct decoder *in)
{
    message->ack.lease = get_u64(in);
}

static void put_revoke(const struct message *message, struct bytes *out)
{
    bytes_put_u64(out, message->revoke.lease);
}

static void get_revoke(struct message *message, struct decoder *in)
{
    message->revoke.lease = get_u64(in);
}

static void put_end(const struct message *message, struct bytes *out)
{
    bytes_put_u32(out, message->end.job);
}

static void get_end(struct message *message, struct decoder *in)
{
    message->end.job = get_u32(in);
}

static void put_beat(const struct message *message, struct bytes *out)
{
    bytes_put_u64(out, message->beat.progress);
    bytes_put_u64(out, message->beat.rays);
}

static void get_beat(struct message *message, struct decoder *in)
{
    message->beat.progress = get_u64(in);
    message->beat.rays = get_u64(in);
}

static void put_ask(const struct message *message, struct bytes *out)
{
    bytes_put_u64(out, message->ask.number);
    bytes_put_u64(out, message->ask.ticket);
    bytes_put_u32(out, message->ask.pause_ms);
}

static void get_ask(struct message *message, struct decoder *in)
{
    message->ask.number = get_u64(in);
    message->ask.ticket = get_u64(in);
    message->ask.pause_ms = get_u32_within(in, "pause_ms", 0, MESSAGE_PAUSE_MAX_MS);
}

static void put_status(const struct message *message, struct bytes *out)
{
    bytes_put_u64(out, message->status.number);
    bytes_put_u64(out, message->status.ticket);
    bytes_put_u8(out, message->status.last);
    put_chunk(out, message->status.offset, message->status.total, message->status.data, message->status.size);
}

static void get_status(struct message *message, struct decoder *in)
{
    message->status.number = get_u64(in);
    message->status.ticket = get_u64(in);
    message->status.last = get_choice(in, "last", 2);
    get_chunk(in, &message->status.offset, &message->status.total, &message->status.data, &message->status.size);
    require(in, "total", message->status.total, 0, MESSAGE_STATUS_MAX);
}

/* WELCOME, DRAIN and GOODBYE: their epoch says it all. */
static void put_nothing(const struct message *message, struct bytes *out)
{
    (void)message;
    (void)out;
}

static void get_nothing(struct message *message, struct decoder *in)
{
    (void)message;
    (void)in;
}

/* --- messages --------------------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    void (*put)(const struct message *message, struct bytes *out);
    void (*get)(struct message *message, struct decoder *in);
    uint64_t epoch_max; /* 0: the kind is said before an epoch is known */
} kinds[MESSAGE_KINDS] = {
    [MESSAGE_HELLO] = {"HELLO", put_hello, get_hello, 0},
    [MESSAGE_NEED] = {"NEED", put_need, get_need, UINT64_MAX},
    [MESSAGE_READY] = {"READY", put_ready, get_ready, UINT64_MAX},
    [MESSAGE_FAILED] = {"FAILED", put_failed, get_failed, UINT64_MAX},
    [MESSAGE_RESULT] = {"RESULT", put_result, get_result, UINT64_MAX},
    [MESSAGE_DRAIN] = {"DRAIN", put_nothing, get_nothing, UINT64_MAX},
    [MESSAGE_WELCOME] = {"WELCOME", put_nothing, get_nothing, UINT64_MAX},
    [MESSAGE_REFUSE] = {"REFUSE", put_refuse, get_refuse, UINT64_MAX},
    [MESSAGE_JOB] = {"JOB", put_job, get_job, UINT64_MAX},
    [MESSAGE_ASSET] = {"ASSET", put_asset, get_asset, UINT64_MAX},
    [MESSAGE_BAND] = {"BAND", put_band, get_band, UINT64_MAX},
    [MESSAGE_ACK] = {"ACK", put_ack, get_ack, UINT64_MAX},
    [MESSAGE_REVOKE] = {"REVOKE", put_revoke, get_revoke, UINT64_MAX},
    [MESSAGE_END] = {"END", put_end, get_end, UINT64_MAX},
    [MESSAGE_BEAT] = {"BEAT", put_beat, get_beat, UINT64_MAX},
    [MESSAGE_GOODBYE] = {"GOODBYE", put_nothing, get_nothing, UINT64_MAX},
    [MESSAGE_ASK] = {"ASK", put_ask, get_ask, 0},
    [MESSAGE_STATUS] = {"STATUS", put_status, get_status, 0},
};

static bool kind_is_known(unsigned kind)
{
    return kind < MESSAGE_KINDS && kinds[kind].name;
}

const char *message_kind_name(enum message_kind kind)
{
    return kind_is_known(kind) ? kinds[kind].name : "UNKNOWN";
}

void message_encode(const struct message *message, struct bytes *out)
{
    assert(kind_is_known(message->kind) && message->epoch <= kinds[message->kind].epoch_max);
    bytes_put(out, magic, sizeof magic);
    bytes_put_u16(out, PROTOCOL_VERSION);
    bytes_put_u8(out, (uint8_t)message->kind);
    bytes_put_u64(out, message->epoch);
    kinds[message->kind].put(message, out);
}

unsigned message_version(const void *data, size_t size)
{
    struct byte_reader reader = byte_reader_of(data, size);
    const uint8_t *start = byte_reader_take(&reader, sizeof magic);
    return start && memcmp(start, magic, sizeof magic) == 0 ? byte_reader_u16(&reader) : 0;
}

/* Reads magic, version and kind. What follows the version may look different in another version, so that is
 * judged first. */
static enum status decode_start(struct message *message, struct byte_reader *reader, struct error *error)
{
    const uint8_t *start = byte_reader_take(reader, sizeof magic);
    if (!start || memcmp(start, magic, sizeof magic) != 0)
        return error_set(error, STATUS_INPUT, "message: expected one of weft's, found other bytes");
    unsigned version = byte_reader_u16(reader);
    if (!reader->failed && version != PROTOCOL_VERSION)
        return error_set(error, STATUS_INPUT, "message: expected protocol version %d, found version %u",
                         PROTOCOL_VERSION, version);
    unsigned kind = byte_reader_u8(reader);
    if (reader->failed)
        return error_set(error, STATUS_INPUT, "message: cut short at %zu bytes", reader->size);
    if (!kind_is_known(kind))
        return error_set(error, STATUS_INPUT, "message: expected a kind from 1 to %d, found %u",
                         MESSAGE_KINDS - 1, kind);
    message->kind = (enum message_kind)kind;
    return STATUS_OK;
}

static enum status decode_fields(struct message *message, struct decoder *in)
{
    message->epoch = require(in, "epoch", get_u64(in), 0, kinds[message->kind].epoch_max);
    kinds[message->kind].get(message, in);
    if (in->refused)
        return STATUS_INPUT;
    if (in->reader.failed)
        return error_set(in->error, STATUS_INPUT, "%s: cut short at %zu bytes", in->kind, in->reader.size);
    if (!byte_reader_done(&in->reader))
        return error_set(in->error, STATUS_INPUT, "%s: expected %zu bytes, found %zu", in->kind, in->reader.at,
                         in->reader.size);
    return STATUS_OK;
}

enum status message_decode(struct message *message, const void *data, size_t size, struct error *error)
{
    struct decoder in = {.reader = byte_reader_of(data, size), .error = error};
    enum status status = decode_start(message, &in.reader, error);
    if (status != STATUS_OK)
        return status;
    in.kind = kinds[message->kind].name;
    return decode_fields(message, &in);
}
