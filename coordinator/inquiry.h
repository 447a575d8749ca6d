/*
 * The side of one who asks a coordinator how things stand (ASK and STATUS of wire/message.h): what to send when, and
 * what comes back. Pure: it has no sockets and no clock. The coordinator may be anybody.
 */
#ifndef WEFT_COORDINATOR_INQUIRY_H
#define WEFT_COORDINATOR_INQUIRY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/error.h"

enum {
    INQUIRY_AGAIN_MS = 1000, /* a question without an answer is said again: its connection may have been lost */
    INQUIRY_RETRY_MS = 20,   /* one that could not be sent */
};

/* Its fields are its own, except text and last after an answer. */
struct inquiry {
    uint32_t pause_ms;  /* from one answer to the next; 0: there is to be one */
    int64_t wait_ms;    /* for how long nothing may be heard */
    uint64_t number, ticket;
    int64_t ask_ms, heard_ms;
    bool heard;         /* that there is a coordinator */
    bool complete;      /* text is a whole answer, */
    bool last;          /* and there will be no other */
    struct bytes text;  /* JSON, as far as it has come */
};

/* Begins with the first question. To be finished. */
void inquiry_init(struct inquiry *inquiry, uint32_t pause_ms, int64_t wait_ms, int64_t now_ms);
void inquiry_finish(struct inquiry *inquiry);

/* Appends the message that is to be sent now, if there is one; false otherwise. */
bool inquiry_say(struct inquiry *inquiry, struct bytes *message, int64_t now_ms);

/* It could not be sent. */
void inquiry_not_said(struct inquiry *inquiry, int64_t now_ms);

/* Takes a message of the coordinator. STATUS_OK, and complete if `text` is now an answer; STATUS_FAILED, with a
 * sentence, if no answer can be expected any more. Messages that do not belong here are passed over. */
enum status inquiry_take(struct inquiry *inquiry, const void *data, size_t size, int64_t now_ms, struct error *error);

/* The answer has been read: the next question. */
void inquiry_go_on(struct inquiry *inquiry, int64_t now_ms);

/* When inquiry_say is to be called next, or patience ends. */
int64_t inquiry_deadline(const struct inquiry *inquiry);

/* Nothing has been heard for too long. */
bool inquiry_is_late(const struct inquiry *inquiry, int64_t now_ms);

/* Appends the message with which the asker leaves. */
void inquiry_goodbye(struct bytes *message);

#endif
