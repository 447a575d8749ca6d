/*
 * What the tests of the session share: a session under a virtual clock, a coordinator's messages to it, and its actions
 * as text, such as "NEED a@0, NEED b@0, LOAD 0".
 */
#ifndef WEFT_TESTS_SESSION_HELP_H
#define WEFT_TESTS_SESSION_HELP_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "wire/manifest.h"
#include "worker/seeking.h"
#include "worker/session.h"

enum { EPOCH = 77, HEIGHT = 100, FILES_MAX = 8 };

static struct session *session;
static int64_t now_ms;
static char said[1100];       /* the last that the user was told */
static unsigned beats;        /* sent; they are not part of the text */
static struct message beat;   /* the last */
static struct bytes returned; /* the bytes of all RESULT chunks since it was emptied */

/* A coordinator's files, called 'a', 'b', … in the texts. */
static struct file {
    struct bytes bytes;
    struct digest digest;
} files[FILES_MAX];
static size_t file_count;

/* --- files ------------------------------------------------------------------------------------------------ */

/* Adds a file; *bytes becomes empty. Returns its index. */
static inline size_t keep_file(struct bytes *bytes)
{
    assert_true(file_count < FILES_MAX);
    files[file_count] = (struct file){*bytes, digest_of(bytes->data, bytes->size)};
    *bytes = (struct bytes){0};
    return file_count++;
}

/* A file of `size` bytes that `seed` tells from others. */
static inline size_t make_file(size_t size, uint8_t seed)
{
    struct bytes bytes = {0};
    bytes_extend(&bytes, size + 1); /* so that data is never NULL */
    bytes.size = size;
    for (size_t i = 0; i < size; i++)
        bytes.data[i] = (uint8_t)(seed + i * 31 + i / 1000);
    return keep_file(&bytes);
}

/* A manifest that lists these files, `count` of them. */
static inline size_t make_manifest(const size_t *listed, size_t count)
{
    struct manifest manifest = {.entries = memory_array(count, sizeof(struct manifest_entry)), .count = count};
    struct bytes bytes = {0};
    for (size_t i = 0; i < count; i++) {
        const struct file *file = &files[listed[i]];
        snprintf(manifest.entries[i].name, MANIFEST_NAME_BYTES, "file%zu", listed[i]);
        manifest.entries[i].digest = file->digest;
        manifest.entries[i].size = file->bytes.size;
    }
    manifest_encode(&manifest, &bytes);
    manifest_finish(&manifest);
    return keep_file(&bytes);
}

static inline char file_letter(const struct digest *digest)
{
    for (size_t i = 0; i < file_count; i++)
        if (digest_equal(&files[i].digest, digest))
            return (char)('a' + i);
    return '?';
}

/* --- what the session does, as text ----------------------------------------------------------------------- */

static inline void describe_message(const struct message *m, char *text, size_t size)
{
    const char *name = message_kind_name(m->kind);
    assert_true(m->kind == MESSAGE_HELLO ? m->epoch == 0 : m->epoch == EPOCH);
    switch (m->kind) {
    case MESSAGE_NEED:
        snprintf(text, size, "NEED %c@%llu", file_letter(&m->need.digest),
                 (unsigned long long)m->need.offset / MESSAGE_CHUNK_MAX);
        break;
    case MESSAGE_READY:
        snprintf(text, size, "READY %u", m->ready.job);
        break;
    case MESSAGE_FAILED:
        snprintf(text, size, "FAILED %u", m->failed.job);
        break;
    case MESSAGE_RESULT:
        snprintf(text, size, "RESULT %u #%llu", m->result.job, (unsigned long long)m->result.lease);
        assert_int_equal(m->result.offset, returned.size);
        bytes_put(&returned, m->result.data, m->result.size);
        break;
    case MESSAGE_BEAT:
        beats++;
        beat = *m;
        break;
    default:
        snprintf(text, size, "%s", name);
    }
}

static inline void describe_sent(struct bytes *bytes, char *text, size_t size)
{
    struct message message;
    struct error error;
    if (message_decode(&message, bytes->data, bytes->size, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    describe_message(&message, text, size);
    bytes_finish(bytes);
}

static inline void describe_action(struct session_action *a, char *text, size_t size)
{
    unsigned long long lease = a->lease;
    if (a->kind == SESSION_SEND)
        describe_sent(&a->bytes, text, size);
    else if (a->kind == SESSION_LOAD)
        snprintf(text, size, "LOAD %u", a->job);
    else if (a->kind == SESSION_START)
        snprintf(text, size, "START%s %u #%llu %u+%u", a->order.pass == PASS_SURVEY ? " SURVEY" : "", a->job, lease,
                 a->order.first_row, a->order.rows);
    else if (a->kind == SESSION_CANCEL)
        snprintf(text, size, "CANCEL #%llu", lease);
    else if (a->kind == SESSION_FORGET)
        snprintf(text, size, "FORGET %u", a->job);
    else if (a->kind == SESSION_RECONNECT)
        snprintf(text, size, "RECONNECT");
    else if (a->kind == SESSION_EXIT)
        snprintf(text, size, "EXIT %d", a->exit_status);
    else
        snprintf(said, sizeof said, "%s", a->text);
}

/* Takes all actions and compares them; words to the user and beats are left out. */
static inline void expect(const char *expected)
{
    struct session_action action;
    char text[2048] = "";
    while (session_take(session, &action)) {
        char one[100] = "";
        describe_action(&action, one, sizeof one);
        if (one[0])
            strcat(strcat(text, text[0] ? ", " : ""), one);
    }
    assert_string_equal(text, expected);
}

/* --- what happens to it ----------------------------------------------------------------------------------- */

static inline void handle(struct session_event event, const char *expected)
{
    session_handle(session, &event, now_ms);
    expect(expected);
}

static inline void tick(int64_t later_ms, const char *expected)
{
    now_ms += later_ms;
    handle((struct session_event){.kind = SESSION_TICK}, expected);
}

/* Goes through the encoding, as a real one does. */
static inline void receive_from(uint64_t epoch, struct message message, const char *expected)
{
    struct bytes bytes = {0};
    struct error error;
    struct message decoded;
    message.epoch = epoch;
    message_encode(&message, &bytes);
    if (message_decode(&decoded, bytes.data, bytes.size, &error) != STATUS_OK)
        fail_msg("%s", error.text);
    handle((struct session_event){.kind = SESSION_MESSAGE, .message = &decoded}, expected);
    bytes_finish(&bytes);
}

static inline void receive(struct message message, const char *expected)
{
    receive_from(EPOCH, message, expected);
}

static inline struct message plain(enum message_kind kind)
{
    return (struct message){.kind = kind};
}

static inline struct message job(uint32_t number, size_t manifest)
{
    return (struct message){.kind = MESSAGE_JOB, .job = {
        .job = number, .manifest = files[manifest].digest, .manifest_bytes = files[manifest].bytes.size,
        .settings = {.width = 64, .height = HEIGHT}}};
}

/* Chunk number `chunk` of a file. */
static inline struct message asset(size_t file, size_t chunk)
{
    const struct bytes *bytes = &files[file].bytes;
    size_t offset = chunk * MESSAGE_CHUNK_MAX, left = bytes->size - offset;
    return (struct message){.kind = MESSAGE_ASSET, .asset = {
        .digest = files[file].digest, .offset = offset, .total = bytes->size, .data = bytes->data + offset,
        .size = (uint32_t)(left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX)}};
}

static inline struct message band(uint32_t number, uint64_t lease, uint32_t first_row, uint32_t rows)
{
    return (struct message){.kind = MESSAGE_BAND,
                            .band = {.job = number, .lease = lease, .pass = PASS_RENDER, .first_row = first_row,
                                     .rows = rows, .sampling = {1, 1, 0}}};
}

static inline struct message survey_band(uint32_t number, uint64_t lease, uint32_t first_row, uint32_t rows)
{
    return (struct message){.kind = MESSAGE_BAND,
                            .band = {.job = number, .lease = lease, .pass = PASS_SURVEY, .first_row = first_row,
                                     .rows = rows, .sampling = {1, 64, 100}}};
}

static inline struct message end_of(uint32_t number)
{
    return (struct message){.kind = MESSAGE_END, .end = {number}};
}

static inline void loaded(uint32_t number, const char *expected)
{
    handle((struct session_event){.kind = SESSION_LOADED, .job = number}, expected);
}

/* `size` bytes of records, of which each tells its place. */
static inline void rendered(uint64_t lease, size_t size, const char *expected)
{
    struct bytes records = {0};
    uint8_t *to = bytes_extend(&records, size);
    for (size_t i = 0; i < size; i++)
        to[i] = (uint8_t)(lease + i * 7 + i / 999);
    handle((struct session_event){.kind = SESSION_RENDERED, .lease = lease, .records = &records}, expected);
    assert_null(records.data); /* moved or freed */
}

/* --- beginnings ------------------------------------------------------------------------------------------- */

static inline void start_with(struct session_config config)
{
    config.hello = (struct message){.kind = MESSAGE_HELLO,
                                    .hello = {.host = "host", .kernel = "ref", .pid = 5, .threads = 2, .credit = 4}};
    session_destroy(&session);
    now_ms = 500000;
    beats = 0;
    said[0] = '\0';
    session = session_create(&config, now_ms);
}

static inline void start(bool once, int64_t wait_ms)
{
    start_with((struct session_config){.once = once, .wait_ms = wait_ms});
}

static inline void start_joined(bool once)
{
    start(once, -1);
    tick(0, "HELLO");
    receive(plain(MESSAGE_WELCOME), "");
}

/* Joined, with job 0 ready; it is of file a alone, and b is its manifest. */
static inline void start_ready(bool once)
{
    start_joined(once);
    size_t listed[] = {make_file(100, 1)}, manifest = make_manifest(listed, 1);
    receive(job(0, manifest), "NEED b@0");
    receive(asset(manifest, 0), "NEED a@0");
    receive(asset(listed[0], 0), "LOAD 0");
    loaded(0, "READY 0");
}

static int finish(void **state)
{
    (void)state;
    session_destroy(&session);
    assert_null(session);
    bytes_finish(&returned);
    while (file_count > 0)
        bytes_finish(&files[--file_count].bytes);
    return 0;
}

#endif
