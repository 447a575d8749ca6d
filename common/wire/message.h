/*
 * The messages between coordinator and worker, and their bytes.
 *
 * Encoding is little-endian: magic "WEFT", protocol version (u16), kind (u8), epoch (u64), then the kind's fields
 * in the order below. Decoding is pure and bounded: every length, count and enum is checked, and bytes left over
 * are an error. Messages are at most MESSAGE_BYTES_MAX long; larger bodies (assets, pixels) travel as chunks.
 *
 * A conversation: the worker says HELLO until it hears WELCOME (or REFUSE), which names the epoch that both put
 * into every later message; messages of another epoch are ignored. The coordinator announces a JOB; the worker
 * asks for the bytes it lacks by NEED and gets ASSET chunks, first the manifest (manifest.h), then what the
 * manifest lists; then it is READY (or says FAILED). It gets BANDs up to the credit it named, and returns each as
 * RESULT chunks, which it keeps until the ACK. REVOKE takes a band back. END closes a job. DRAIN says that the
 * worker wants no more bands: it will end when those it holds are done. Both sides send a BEAT every second;
 * GOODBYE ends the conversation; so does a REFUSE within it, after which the worker may say HELLO again.
 *
 * Who only wants to know how things stand says ASK, and hears STATUS chunks. The first answer to a newcomer is empty
 * and gives a ticket; every further ASK shows the ticket of the answer before, which proves that it was read: so who
 * does not read cannot make answers pile up. GOODBYE says that no more are wanted.
 *
 * A message of another protocol version is answered by a REFUSE, whose first fields no version may change: its reader
 * finds no message of his own version, but learns of the other.
 */
#ifndef WEFT_WIRE_MESSAGE_H
#define WEFT_WIRE_MESSAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"
#include "base/hash.h"

enum {
    PROTOCOL_VERSION = 2,
    MESSAGE_CHUNK_MAX = 256 * 1024,           /* bytes of an asset or result in one message */
    MESSAGE_BYTES_MAX = MESSAGE_CHUNK_MAX + 4096, /* a chunk and what goes with it; nothing else is as long */
    MESSAGE_HOST_BYTES = 256,                 /* with the NUL */
    MESSAGE_KERNEL_BYTES = 16,
    MESSAGE_REASON_BYTES = 1024,
    MESSAGE_THREADS_MAX = 65535,
    MESSAGE_SIDE_MAX = 65535,                 /* pixels; width, height and rows of a band */
    MESSAGE_SAMPLES_MAX = 65536,              /* a pixel */
    MESSAGE_RESULT_MAX = 256 * 1024 * 1024,   /* bytes of a whole band's result */
    MESSAGE_THRESHOLD_MAX = 255,
    MESSAGE_FILTERS = 2,                      /* as enum pixel_filter */
    MESSAGE_PIXEL_FORMATS = 3,                /* as enum pixel_format */
    MESSAGE_STATUS_MAX = 8 * 1024 * 1024,     /* bytes of a whole status */
    MESSAGE_PAUSE_MAX_MS = 60000,
};

enum message_kind {
    /* worker to coordinator */
    MESSAGE_HELLO = 1,
    MESSAGE_NEED,
    MESSAGE_READY,
    MESSAGE_FAILED,
    MESSAGE_RESULT,
    MESSAGE_DRAIN,
    /* coordinator to worker */
    MESSAGE_WELCOME,
    MESSAGE_REFUSE,
    MESSAGE_JOB,
    MESSAGE_ASSET,
    MESSAGE_BAND,
    MESSAGE_ACK,
    MESSAGE_REVOKE,
    MESSAGE_END,
    /* both */
    MESSAGE_BEAT,
    MESSAGE_GOODBYE,
    /* whoever looks to coordinator, and its answer */
    MESSAGE_ASK,
    MESSAGE_STATUS,
    MESSAGE_KINDS,
};

/* What a worker needs to know about a job besides the scene. */
struct job_settings {
    uint32_t width, height; /* pixels, 1..MESSAGE_SIDE_MAX */
    uint8_t filter;         /* enum pixel_filter */
    uint8_t pixel_format;   /* enum pixel_format */
    uint8_t maps;           /* 0 or 1: whether row records have maps (rows.h) */
};

/* What a band is rendered for. The rows of a survey are rows of cells of the picture's survey grid, and its result is
 * one survey of them all; those of a render are the picture's, and its result is their records (rows.h). */
enum render_pass { PASS_SURVEY, PASS_RENDER, PASSES };

/* How many samples a pixel of a band gets: as struct sampling of the tracing core. */
struct band_sampling {
    uint32_t least, most; /* 1 <= least <= most <= MESSAGE_SAMPLES_MAX */
    uint32_t threshold;   /* 0..MESSAGE_THRESHOLD_MAX */
};

struct message {
    enum message_kind kind;
    uint64_t epoch; /* 0 in HELLO, in REFUSE as an answer to it, and between a coordinator and who asks it */
    union {
        struct {
            struct digest core_revision; /* of the tracing core's sources */
            struct digest proof;         /* of a picture that the worker rendered to prove its arithmetic */
            char host[MESSAGE_HOST_BYTES];
            char kernel[MESSAGE_KERNEL_BYTES];
            uint32_t pid;
            uint32_t threads; /* 1..MESSAGE_THREADS_MAX */
            uint32_t credit;  /* bands it will hold at once, 1..4 * MESSAGE_THREADS_MAX */
        } hello;
        struct {
            char reason[MESSAGE_REASON_BYTES];
        } refuse;
        struct {
            uint32_t job;
            struct digest manifest; /* of the manifest's bytes */
            uint64_t manifest_bytes; /* 1..MANIFEST_BYTES_MAX (manifest.h) */
            struct job_settings settings;
        } job;
        struct {
            struct digest digest;
            uint64_t offset; /* of the wanted chunk; the answer is as long as fits */
        } need;
        struct {
            struct digest digest; /* of the whole asset */
            uint64_t offset, total;
            const uint8_t *data; /* borrowed; size <= MESSAGE_CHUNK_MAX, offset + size <= total */
            uint32_t size;
        } asset;
        struct {
            uint32_t job;
        } ready;
        struct {
            uint32_t job;
            char reason[MESSAGE_REASON_BYTES];
        } failed;
        struct {
            uint32_t job;
            uint64_t lease;
            uint32_t pass;            /* enum render_pass */
            uint32_t first_row, rows; /* rows >= 1, first_row + rows <= MESSAGE_SIDE_MAX */
            struct band_sampling sampling;
        } band;
        struct {
            uint32_t job;
            uint64_t lease;
            uint64_t offset, total; /* bytes within the band's result */
            const uint8_t *data;    /* borrowed; size <= MESSAGE_CHUNK_MAX, offset + size <= total */
            uint32_t size;
        } result;
        struct {
            uint64_t lease;
        } ack;
        struct {
            uint64_t lease;
        } revoke;
        struct {
            uint32_t job;
        } end;
        struct {
            uint64_t progress; /* batches of rays traced since the worker started; 0 from a coordinator */
            uint64_t rays;     /* traced since the worker started; 0 from a coordinator */
        } beat;
        struct {
            uint64_t number;   /* the asker's own; its answer repeats it */
            uint64_t ticket;   /* of the answer before; 0: there was none */
            uint32_t pause_ms; /* from the last answer to this one, 0..MESSAGE_PAUSE_MAX_MS; 0: it is the only one */
        } ask;
        struct {
            uint64_t number, ticket;
            uint8_t last;           /* 0 or 1: the coordinator ends, and there will be no other */
            uint64_t offset, total; /* bytes of the whole, at most MESSAGE_STATUS_MAX; total 0: only a ticket */
            const uint8_t *data;    /* of a snapshot as JSON; borrowed; size and offset as of an asset's chunk */
            uint32_t size;
        } status;
    };
};

/* Appends the message's bytes to *out. The message must keep the limits above. */
void message_encode(const struct message *message, struct bytes *out);

/* Decodes data[size]; data pointers in *message borrow from it. On failure STATUS_INPUT, and *message is
 * unspecified. A message of another protocol version fails with a sentence that names both versions. */
enum status message_decode(struct message *message, const void *data, size_t size, struct error *error);

/* The protocol version of a message, whatever the rest of it is; 0: it is not one of weft's. */
unsigned message_version(const void *data, size_t size);

/* "HELLO" and so on, for logs. */
const char *message_kind_name(enum message_kind kind);

#endif
