/*
 * The message codec: every kind there and back with random contents, the bytes of two kinds pinned, and that
 * nothing wrong is taken: short, long, out of range, of another version, damaged, or random.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/memory.h"
#include "wire/manifest.h"
#include "wire/message.h"

enum { HEADER_BYTES = 15 };

/* --- random messages -------------------------------------------------------------------------------------- */

static uint8_t body[MESSAGE_CHUNK_MAX];

static uint64_t random_u64(void)
{
    return (uint64_t)random() << 42 ^ (uint64_t)random() << 21 ^ (uint64_t)random();
}

static uint64_t random_within(uint64_t min, uint64_t max)
{
    uint64_t span = max - min + 1; /* 0: all of 64 bits */
    return span ? min + random_u64() % span : random_u64();
}

static void random_digest(struct digest *digest)
{
    uint64_t value = random_u64();
    *digest = digest_of(&value, sizeof value);
}

static void random_text(char *text, size_t capacity)
{
    size_t length = random_within(0, capacity - 1);
    for (size_t i = 0; i < length; i++)
        text[i] = (char)random_within(1, 255);
}

/* A chunk of at most 300 bytes most of the time, the largest now and then. */
static void random_chunk(uint64_t *offset, uint64_t *total, const uint8_t **data, uint32_t *size)
{
    *size = random() % 50 ? (uint32_t)random_within(0, 300) : MESSAGE_CHUNK_MAX;
    *total = random_within(*size, random() % 2 ? *size + 1000 : UINT64_MAX);
    *offset = *total == *size ? 0 : random_within(0, *total - *size);
    *data = body + random_within(0, MESSAGE_CHUNK_MAX - *size);
}

static void random_hello(struct message *message)
{
    random_digest(&message->hello.core_revision);
    random_digest(&message->hello.proof);
    random_text(message->hello.host, sizeof message->hello.host);
    random_text(message->hello.kernel, sizeof message->hello.kernel);
    message->hello.pid = (uint32_t)random_u64();
    message->hello.threads = (uint32_t)random_within(1, MESSAGE_THREADS_MAX);
    message->hello.credit = (uint32_t)random_within(1, 4 * MESSAGE_THREADS_MAX);
}

static void random_job(struct message *message)
{
    message->job.job = (uint32_t)random_u64();
    random_digest(&message->job.manifest);
    message->job.manifest_bytes = random_within(1, MANIFEST_BYTES_MAX);
    message->job.settings.width = (uint32_t)random_within(1, MESSAGE_SIDE_MAX);
    message->job.settings.height = (uint32_t)random_within(1, MESSAGE_SIDE_MAX);
    message->job.settings.filter = (uint8_t)random_within(0, MESSAGE_FILTERS - 1);
    message->job.settings.pixel_format = (uint8_t)random_within(0, MESSAGE_PIXEL_FORMATS - 1);
    message->job.settings.maps = (uint8_t)random_within(0, 1);
}

static void random_band(struct message *message)
{
    message->band.job = (uint32_t)random_u64();
    message->band.lease = random_u64();
    message->band.pass = (uint32_t)random_within(0, PASSES - 1);
    message->band.first_row = (uint32_t)random_within(0, MESSAGE_SIDE_MAX - 1);
    message->band.rows = (uint32_t)random_within(1, MESSAGE_SIDE_MAX - message->band.first_row);
    message->band.sampling.least = (uint32_t)random_within(1, MESSAGE_SAMPLES_MAX);
    message->band.sampling.most = (uint32_t)random_within(message->band.sampling.least, MESSAGE_SAMPLES_MAX);
    message->band.sampling.threshold = (uint32_t)random_within(0, MESSAGE_THRESHOLD_MAX);
}

static void random_status(struct message *message)
{
    message->status.number = random_u64();
    message->status.ticket = random_u64();
    message->status.last = (uint8_t)random_within(0, 1);
    message->status.size = (uint32_t)random_within(0, 300);
    message->status.total = random_within(message->status.size, MESSAGE_STATUS_MAX);
    message->status.offset = random_within(0, message->status.total - message->status.size);
    message->status.data = body + random_within(0, MESSAGE_CHUNK_MAX - message->status.size);
}

static bool has_epoch(enum message_kind kind)
{
    return kind != MESSAGE_HELLO && kind != MESSAGE_ASK && kind != MESSAGE_STATUS;
}

static void random_body(struct message *message)
{
    switch (message->kind) {
    case MESSAGE_NEED:
        random_digest(&message->need.digest);
        message->need.offset = random_u64();
        break;
    case MESSAGE_READY: message->ready.job = (uint32_t)random_u64(); break;
    case MESSAGE_FAILED:
        message->failed.job = (uint32_t)random_u64();
        random_text(message->failed.reason, sizeof message->failed.reason);
        break;
    case MESSAGE_RESULT:
        message->result.job = (uint32_t)random_u64();
        message->result.lease = random_u64();
        random_chunk(&message->result.offset, &message->result.total, &message->result.data,
                     &message->result.size);
        break;
    case MESSAGE_REFUSE: random_text(message->refuse.reason, sizeof message->refuse.reason); break;
    case MESSAGE_ASSET:
        random_digest(&message->asset.digest);
        random_chunk(&message->asset.offset, &message->asset.total, &message->asset.data, &message->asset.size);
        break;
    case MESSAGE_ACK: message->ack.lease = random_u64(); break;
    case MESSAGE_REVOKE: message->revoke.lease = random_u64(); break;
    case MESSAGE_END: message->end.job = (uint32_t)random_u64(); break;
    case MESSAGE_BEAT:
        message->beat.progress = random_u64();
        message->beat.rays = random_u64();
        break;
    case MESSAGE_ASK:
        message->ask.number = random_u64();
        message->ask.ticket = random_u64();
        message->ask.pause_ms = (uint32_t)random_within(0, MESSAGE_PAUSE_MAX_MS);
        break;
    case MESSAGE_STATUS: random_status(message); break;
    default: break;
    }
}

/* All that the kind does not use, padding too, stays zero. */
static void random_message(struct message *message, enum message_kind kind)
{
    memset(message, 0, sizeof *message);
    message->kind = kind;
    if (has_epoch(kind))
        message->epoch = random_u64();
    if (kind == MESSAGE_HELLO)
        random_hello(message);
    else if (kind == MESSAGE_JOB)
        random_job(message);
    else if (kind == MESSAGE_BAND)
        random_band(message);
    else
        random_body(message);
}

/* --- helpers ---------------------------------------------------------------------------------------------- */

/* Decodes a copy in a block of its own size, so that the sanitizer sees any reading beyond it. */
static enum status decode_exact(const uint8_t *data, size_t size, struct error *error)
{
    uint8_t *exact = malloc(size);
    struct message message;
    if (size)
        memcpy(exact, data, size);
    enum status status = message_decode(&message, exact, size, error);
    free(exact);
    return status;
}

static void assert_refused(const struct bytes *bytes, const char *says)
{
    struct error error = {""};
    assert_int_equal(decode_exact(bytes->data, bytes->size, &error), STATUS_INPUT);
    if (!strstr(error.text, says))
        fail_msg("expected a sentence with \"%s\", found \"%s\"", says, error.text);
}

/* The bytes of a small message: chunks of 5 bytes at 10 of 20, short texts, everything else in range. */
static struct bytes small(enum message_kind kind)
{
    struct message message;
    random_message(&message, kind);
    if (kind == MESSAGE_HELLO) {
        strcpy(message.hello.host, "host");
        strcpy(message.hello.kernel, "avx2");
    }
    if (kind == MESSAGE_RESULT || kind == MESSAGE_ASSET) {
        uint64_t *offset = kind == MESSAGE_RESULT ? &message.result.offset : &message.asset.offset;
        uint64_t *total = kind == MESSAGE_RESULT ? &message.result.total : &message.asset.total;
        *offset = 10;
        *total = 20;
        *(kind == MESSAGE_RESULT ? &message.result.size : &message.asset.size) = 5;
    }
    if (kind == MESSAGE_STATUS) {
        message.status.offset = 10;
        message.status.total = 20;
        message.status.size = 5;
    }
    struct bytes bytes = {0};
    message_encode(&message, &bytes);
    return bytes;
}

static void overwrite(struct bytes *bytes, size_t at, uint64_t value, size_t size)
{
    assert_true(at + size <= bytes->size);
    for (size_t i = 0; i < size; i++)
        bytes->data[at + i] = (uint8_t)(value >> (8 * i));
}

/* --- tests ------------------------------------------------------------------------------------------------ */

/* The borrowed bodies are compared by content and then made equal, so that the rest can be compared whole. */
static void assert_same(const struct message *a, struct message *b)
{
    if (a->kind == MESSAGE_ASSET) {
        assert_memory_equal(a->asset.data, b->asset.data, a->asset.size);
        b->asset.data = a->asset.data;
    }
    if (a->kind == MESSAGE_RESULT) {
        assert_memory_equal(a->result.data, b->result.data, a->result.size);
        b->result.data = a->result.data;
    }
    if (a->kind == MESSAGE_STATUS) {
        assert_memory_equal(a->status.data, b->status.data, a->status.size);
        b->status.data = a->status.data;
    }
    assert_memory_equal(a, b, sizeof *a);
}

static void test_round_trip(void **state)
{
    (void)state;
    struct bytes bytes = {0};
    for (int round = 0; round < 200; round++) {
        for (int kind = 1; kind < MESSAGE_KINDS; kind++) {
            struct message message, back;
            struct error error;
            random_message(&message, (enum message_kind)kind);
            memset(&back, 0, sizeof back);
            bytes.size = 0;
            message_encode(&message, &bytes);
            assert_true(bytes.size <= MESSAGE_BYTES_MAX);
            assert_int_equal(message_decode(&back, bytes.data, bytes.size, &error), STATUS_OK);
            assert_same(&message, &back);
        }
    }
    bytes_finish(&bytes);
}

static void test_layout(void **state)
{
    (void)state;
    static const uint8_t band[] = {'W', 'E', 'F', 'T', 2, 0, 11, 8, 7, 6, 5, 4,  3, 2, 1, 4, 3, 2,   1,
                                   9,   0,   0,   0,   0, 0, 0,  0, 1, 0, 0, 0,  0, 1, 0, 0, 16, 0, 0, 0,
                                   4,   0,   0,   0,   0, 4, 0,  0, 200, 0, 0, 0};
    static const uint8_t refuse[] = {'W', 'E', 'F', 'T', 2, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 'n', 'o'};
    struct message message = {.kind = MESSAGE_BAND, .epoch = 0x0102030405060708};
    message.band.job = 0x01020304;
    message.band.lease = 9;
    message.band.pass = PASS_RENDER;
    message.band.first_row = 256;
    message.band.rows = 16;
    message.band.sampling = (struct band_sampling){4, 1024, 200};
    struct bytes bytes = {0};
    message_encode(&message, &bytes);
    assert_int_equal(bytes.size, sizeof band);
    assert_memory_equal(bytes.data, band, sizeof band);
    message = (struct message){.kind = MESSAGE_REFUSE, .refuse.reason = "no"};
    bytes.size = 0;
    message_encode(&message, &bytes);
    assert_int_equal(bytes.size, sizeof refuse);
    assert_memory_equal(bytes.data, refuse, sizeof refuse);
    bytes_finish(&bytes);
}

static void test_wrong_length(void **state)
{
    (void)state;
    for (int kind = 1; kind < MESSAGE_KINDS; kind++) {
        struct bytes bytes = small((enum message_kind)kind);
        struct error error;
        size_t whole = bytes.size;
        for (size_t size = 0; size < whole; size++)
            assert_int_equal(decode_exact(bytes.data, size, &error), STATUS_INPUT);
        assert_int_equal(decode_exact(bytes.data, whole, &error), STATUS_OK);
        bytes_put_u8(&bytes, 0);
        assert_refused(&bytes, message_kind_name((enum message_kind)kind));
        bytes_finish(&bytes);
    }
}

static void test_wrong_start(void **state)
{
    (void)state;
    struct bytes bytes = small(MESSAGE_BEAT);
    for (size_t i = 0; i < 4; i++) {
        bytes.data[i] ^= 0x20;
        assert_refused(&bytes, "expected one of weft's");
        bytes.data[i] ^= 0x20;
    }
    static const unsigned wrong_kinds[] = {0, MESSAGE_KINDS, 255};
    for (size_t i = 0; i < 3; i++) {
        overwrite(&bytes, 6, wrong_kinds[i], 1);
        assert_refused(&bytes, "expected a kind from 1 to 18");
    }
    overwrite(&bytes, 4, 259, 2);
    bytes.size = 6; /* nothing behind the version counts */
    assert_refused(&bytes, "expected protocol version 2, found version 259");
    assert_int_equal(message_version(bytes.data, 6), 259);
    assert_int_equal(message_version(bytes.data, 5), 0);
    bytes.data[0] ^= 1;
    assert_int_equal(message_version(bytes.data, 6), 0);
    bytes_finish(&bytes);
}

/* Fields at their limits and beyond. `at` counts from the start, or from the end if negative. */
static const struct {
    enum message_kind kind;
    int at, size;
    uint64_t value;
    const char *refused_for; /* NULL: the value is a good one */
} edges[] = {
    {MESSAGE_HELLO, 7, 8, 1, "HELLO: epoch"},
    {MESSAGE_HELLO, -8, 4, 0, "HELLO: threads"},
    {MESSAGE_HELLO, -8, 4, 1, NULL},
    {MESSAGE_HELLO, -8, 4, 65535, NULL},
    {MESSAGE_HELLO, -8, 4, 65536, "HELLO: threads"},
    {MESSAGE_HELLO, -4, 4, 0, "HELLO: credit"},
    {MESSAGE_HELLO, -4, 4, 262140, NULL},
    {MESSAGE_HELLO, -4, 4, 262141, "HELLO: credit: expected 1 to 262140, found 262141"},
    {MESSAGE_REFUSE, 7, 8, UINT64_MAX, NULL},
    {MESSAGE_WELCOME, 7, 8, UINT64_MAX, NULL},
    {MESSAGE_JOB, 51, 8, 0, "JOB: manifest_bytes"},
    {MESSAGE_JOB, 51, 8, 8 << 20, NULL},
    {MESSAGE_JOB, 51, 8, (8 << 20) + 1, "JOB: manifest_bytes"},
    {MESSAGE_JOB, 51, 8, UINT64_MAX, "JOB: manifest_bytes"},
    {MESSAGE_JOB, -11, 4, 0, "JOB: width"},
    {MESSAGE_JOB, -11, 4, 65535, NULL},
    {MESSAGE_JOB, -11, 4, 65536, "JOB: width"},
    {MESSAGE_JOB, -7, 4, 0, "JOB: height"},
    {MESSAGE_JOB, -7, 4, 65535, NULL},
    {MESSAGE_JOB, -7, 4, 65536, "JOB: height"},
    {MESSAGE_JOB, -3, 1, 0, NULL},
    {MESSAGE_JOB, -3, 1, 1, NULL},
    {MESSAGE_JOB, -3, 1, 2, "JOB: filter: expected 0 to 1, found 2"},
    {MESSAGE_JOB, -3, 1, 255, "JOB: filter"},
    {MESSAGE_JOB, -2, 1, 2, NULL},
    {MESSAGE_JOB, -2, 1, 3, "JOB: pixel_format"},
    {MESSAGE_JOB, -1, 1, 1, NULL},
    {MESSAGE_JOB, -1, 1, 2, "JOB: maps"},
    {MESSAGE_ASSET, 47, 8, 15, NULL},
    {MESSAGE_ASSET, 47, 8, 16, "ASSET: offset"},
    {MESSAGE_ASSET, 47, 8, UINT64_MAX, "ASSET: offset"},
    {MESSAGE_ASSET, 55, 8, 4, "ASSET: size"},
    {MESSAGE_ASSET, 55, 8, 14, "ASSET: offset"},
    {MESSAGE_ASSET, 63, 4, 4, "ASSET: expected 71 bytes, found 72"},
    {MESSAGE_ASSET, 63, 4, 6, "ASSET: cut short"},
    {MESSAGE_ASSET, 63, 4, UINT32_MAX, "ASSET: size"},
    {MESSAGE_RESULT, 27, 8, 15, NULL},
    {MESSAGE_RESULT, 27, 8, 16, "RESULT: offset"},
    {MESSAGE_RESULT, 27, 8, UINT64_MAX - 2, "RESULT: offset"},
    {MESSAGE_RESULT, 35, 8, 14, "RESULT: offset"},
    {MESSAGE_RESULT, 35, 8, 0, "RESULT: size"},
    {MESSAGE_RESULT, 43, 4, 262145, "RESULT: size: expected 0 to 262144, found 262145"},
    {MESSAGE_ASK, 7, 8, 1, "ASK: epoch"},
    {MESSAGE_ASK, -4, 4, 60000, NULL},
    {MESSAGE_ASK, -4, 4, 60001, "ASK: pause_ms"},
    {MESSAGE_STATUS, 7, 8, 1, "STATUS: epoch"},
    {MESSAGE_STATUS, 31, 1, 2, "STATUS: last"},
    {MESSAGE_STATUS, 32, 8, 15, NULL},
    {MESSAGE_STATUS, 32, 8, 16, "STATUS: offset"},
    {MESSAGE_STATUS, 40, 8, 8 << 20, NULL},
    {MESSAGE_STATUS, 40, 8, (8 << 20) + 1, "STATUS: total"},
    {MESSAGE_STATUS, 40, 8, 14, "STATUS: offset"},
    {MESSAGE_BAND, -24, 4, 0, NULL},
    {MESSAGE_BAND, -24, 4, 1, NULL},
    {MESSAGE_BAND, -24, 4, 2, "BAND: pass"},
    {MESSAGE_BAND, -20, 8, 65534ull | 1ull << 32, NULL},
    {MESSAGE_BAND, -20, 8, 65535ull | 1ull << 32, "BAND: first_row"},
    {MESSAGE_BAND, -20, 8, 65534ull | 2ull << 32, "BAND: rows"},
    {MESSAGE_BAND, -20, 8, 0ull | 65535ull << 32, NULL},
    {MESSAGE_BAND, -20, 8, 0ull | 65536ull << 32, "BAND: rows"},
    {MESSAGE_BAND, -20, 8, 0, "BAND: rows"},
    {MESSAGE_BAND, -20, 8, UINT32_MAX | 2ull << 32, "BAND: first_row"},
    {MESSAGE_BAND, -12, 8, 0 | 1ull << 32, "BAND: least"},
    {MESSAGE_BAND, -12, 8, 1 | 0ull << 32, "BAND: most"},
    {MESSAGE_BAND, -12, 8, 1 | 65536ull << 32, NULL},
    {MESSAGE_BAND, -12, 8, 1 | 65537ull << 32, "BAND: most"},
    {MESSAGE_BAND, -12, 8, 8 | 8ull << 32, NULL},
    {MESSAGE_BAND, -12, 8, 8 | 7ull << 32, "BAND: most"},
    {MESSAGE_BAND, -12, 8, 65537 | 65537ull << 32, "BAND: least"},
    {MESSAGE_BAND, -4, 4, 255, NULL},
    {MESSAGE_BAND, -4, 4, 256, "BAND: threshold"},
};

static void test_edges(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof edges / sizeof *edges; i++) {
        struct bytes bytes = small(edges[i].kind);
        struct error error = {""};
        size_t at = edges[i].at < 0 ? bytes.size - (size_t)-edges[i].at : (size_t)edges[i].at;
        overwrite(&bytes, at, edges[i].value, (size_t)edges[i].size);
        if (edges[i].refused_for)
            assert_refused(&bytes, edges[i].refused_for);
        else if (decode_exact(bytes.data, bytes.size, &error) != STATUS_OK)
            fail_msg("row %zu: expected no error, found \"%s\"", i, error.text);
        bytes_finish(&bytes);
    }
}

/* A chunk that is too large although its bytes are there. */
static void test_oversized_chunk(void **state)
{
    (void)state;
    struct bytes bytes = small(MESSAGE_ASSET);
    bytes.size = HEADER_BYTES + DIGEST_BYTES;
    bytes_put_u64(&bytes, 0);
    bytes_put_u64(&bytes, 1 << 20);
    bytes_put_u32(&bytes, MESSAGE_CHUNK_MAX + 1);
    bytes_put(&bytes, body, sizeof body);
    bytes_put_u8(&bytes, 0);
    assert_refused(&bytes, "ASSET: size");
    bytes_finish(&bytes);
}

static void assert_text_refused(enum message_kind kind, size_t before, const char *text, size_t size,
                                size_t after, const char *says)
{
    struct bytes bytes = small(kind);
    bytes.size = HEADER_BYTES;
    memset(bytes_extend(&bytes, before), 0, before);
    bytes_put_u16(&bytes, (uint16_t)size);
    bytes_put(&bytes, text, size);
    memset(bytes_extend(&bytes, after), 1, after);
    assert_refused(&bytes, says);
    bytes_finish(&bytes);
}

static void test_texts(void **state)
{
    (void)state;
    char text[MESSAGE_REASON_BYTES];
    memset(text, 't', sizeof text);
    assert_text_refused(MESSAGE_HELLO, 64, text, MESSAGE_HOST_BYTES, 30, "HELLO: host: expected");
    assert_text_refused(MESSAGE_HELLO, 66, text, MESSAGE_KERNEL_BYTES, 12, "HELLO: kernel: expected");
    assert_text_refused(MESSAGE_HELLO, 64, "a\0b", 3, 30, "HELLO: host");
    assert_text_refused(MESSAGE_REFUSE, 0, text, sizeof text, 0, "REFUSE: reason");
    assert_text_refused(MESSAGE_FAILED, 4, text, sizeof text, 0, "FAILED: reason");
}

/* What decodes must encode to the very same bytes: there is one way to write a message. */
static void assert_refused_or_canonical(const struct bytes *bytes)
{
    struct message message;
    struct error error = {""};
    if (message_decode(&message, bytes->data, bytes->size, &error) != STATUS_OK) {
        assert_true(error.text[0] != '\0');
        return;
    }
    struct bytes again = {0};
    message_encode(&message, &again);
    assert_int_equal(again.size, bytes->size);
    assert_memory_equal(again.data, bytes->data, bytes->size);
    bytes_finish(&again);
}

static void test_flipped_bits(void **state)
{
    (void)state;
    for (int round = 0; round < 60000; round++) {
        struct bytes bytes = small((enum message_kind)random_within(1, MESSAGE_KINDS - 1));
        for (uint64_t flips = random_within(1, 3); flips > 0; flips--) {
            size_t bit = random_within(0, 8 * bytes.size - 1);
            bytes.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
        }
        assert_refused_or_canonical(&bytes);
        bytes_finish(&bytes);
    }
}

/* Half of them behind a good header, or they would get no further than that. */
static void test_random_bytes(void **state)
{
    (void)state;
    for (int round = 0; round < 60000; round++) {
        struct bytes bytes = small((enum message_kind)random_within(1, MESSAGE_KINDS - 1));
        bytes.size = round % 2 ? HEADER_BYTES : 0;
        for (uint64_t count = random_within(0, 200); count > 0; count--)
            bytes_put_u8(&bytes, (uint8_t)(random() % 3 ? 0 : random()));
        assert_refused_or_canonical(&bytes);
        bytes_finish(&bytes);
    }
}

static void test_names(void **state)
{
    (void)state;
    assert_string_equal(message_kind_name(MESSAGE_HELLO), "HELLO");
    assert_string_equal(message_kind_name(MESSAGE_GOODBYE), "GOODBYE");
    assert_string_equal(message_kind_name(MESSAGE_KINDS), "UNKNOWN");
    assert_string_equal(message_kind_name((enum message_kind)0), "UNKNOWN");
}

/* `message SEED` repeats a run. */
int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),      cmocka_unit_test(test_layout),
        cmocka_unit_test(test_wrong_length),    cmocka_unit_test(test_wrong_start),
        cmocka_unit_test(test_edges),           cmocka_unit_test(test_oversized_chunk),
        cmocka_unit_test(test_texts),           cmocka_unit_test(test_flipped_bits),
        cmocka_unit_test(test_random_bytes),    cmocka_unit_test(test_names),
    };
    unsigned seed = argc > 1 ? (unsigned)strtoul(argv[1], NULL, 10) : (unsigned)time(NULL);
    print_message("# seed %u\n", seed);
    srandom(seed);
    for (size_t i = 0; i < sizeof body; i++)
        body[i] = (uint8_t)random();
    return cmocka_run_group_tests_name("message", tests, NULL, NULL);
}
