/*
 * Who asks the coordinator how things stand (ASK and STATUS of wire/message.h), and when each is answered. Askers are
 * not workers: there is room for so many, and an answer comes when its pause is over and those before have had theirs.
 * What answering costs is bounded, whoever asks how often: a round of answers, all of one snapshot, comes at most ten
 * times a second, and is followed by a pause that grows with the bytes that it took.
 *
 * Pure: it sends nothing and has no clock. Times are in milliseconds.
 */
#ifndef WEFT_COORDINATOR_ASKERS_H
#define WEFT_COORDINATOR_ASKERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "wire/message.h"
#include "wire/socket.h"

enum {
    ASKERS_MAX = 256,
    ASKERS_ROUND_MS = 100,              /* from one round to the next, at least */
    ASKERS_BYTES_PER_MS = 4 * 1024,     /* of snapshots made and sent */
    ASKERS_ROUND_BYTES = 1024 * 1024,   /* with which a round ends, if it has not before */
    ASKERS_FORGET_MS = 3000,            /* who is silent for so long gives place to others */
};

struct asker {
    struct wire_peer address;
    uint64_t ticket; /* of the last answer; whoever shows it has read that */
    uint64_t number; /* of the question that waits */
    bool waiting;
    bool watching;   /* it will ask again and again */
    bool told;       /* the last answer of all */
    uint64_t turn;   /* while it waits: lower ones come before it */
    int64_t due_ms;  /* while it waits: not before */
    int64_t answered_ms, heard_ms;
};

/* All zero: nobody asks. */
struct askers {
    struct asker list[ASKERS_MAX];
    size_t count;
    uint64_t turns;   /* so many have been given out */
    int64_t round_ms; /* the next round, not before */
};

/* Takes an ASK. True if it comes from somebody new, who is to be answered at once by `ticket`, which nobody can guess,
 * and nothing else. Who does not show the ticket of the last answer is not heeded; nor is a newcomer for whom there is
 * no place. */
bool askers_take(struct askers *askers, const struct wire_peer *from, const struct message *ask, uint64_t ticket,
                 int64_t now_ms);

/* Forgets that one, if it is there. */
void askers_forget(struct askers *askers, const struct wire_peer *address);

/* When a round of answers is due; INT64_MAX: nobody waits. */
int64_t askers_due_ms(const struct askers *askers);

/* Who is to be answered next, in a round that may begin now; with `ending` whoever waits and has not been told. NULL:
 * nobody. Borrowed, until the next call. */
struct asker *askers_next(struct askers *askers, bool ending, int64_t now_ms);

/* The asker has been sent an answer with that ticket. */
void askers_answered(struct asker *asker, uint64_t ticket, bool last, int64_t now_ms);

/* A round of answers has taken so many bytes. */
void askers_end_round(struct askers *askers, size_t bytes, int64_t now_ms);

/* How many watch, and have been heard of late. */
size_t askers_watching(const struct askers *askers, int64_t now_ms);

#endif
