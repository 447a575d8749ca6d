/*
 * How fast a worker is, as its answers and beats have shown: pure, for the scheduler. Times are in milliseconds.
 */
#ifndef WEFT_COORDINATOR_PACE_H
#define WEFT_COORDINATOR_PACE_H

#include <stdbool.h>
#include <stdint.h>

#include "wire/message.h"

/* All zero: nothing is known. */
struct pace {
    /* Of the rows that it answered last, of one pass of one job: */
    uint32_t job;
    enum render_pass pass;
    uint64_t rows;
    int64_t lease_ms; /* from grant to answer, summed over its bands; they spent it waiting too */
    int64_t busy_ms;  /* how long it held any band, up to busy_since_ms */
    int64_t busy_since_ms;
    bool busy;
    int64_t answered_ms; /* when it last answered, or began to hold bands */
    /* Since it joined: */
    uint64_t progress;      /* what its last beat said */
    int64_t advanced_ms;    /* when that last grew, or it began to hold bands */
    int64_t longest_gap_ms; /* between two such times while it held bands; 0: none was seen */
};

/* It holds bands from now on; it holds none any more. */
void pace_begin(struct pace *pace, int64_t now_ms);
void pace_end(struct pace *pace, int64_t now_ms);

/* It answered a band, lease_ms after that was granted. To be told before pace_end. */
void pace_answer(struct pace *pace, uint32_t job, enum render_pass pass, uint32_t rows, int64_t lease_ms,
                 int64_t now_ms);

/* It said how far it is: any number that grows as work is done. */
void pace_beat(struct pace *pace, uint64_t progress, int64_t now_ms);

/* Until now it had something else to do: that it has not advanced says nothing. */
void pace_excuse(struct pace *pace, int64_t now_ms);

/* How long it would take for so many rows with nothing else to do; and from grant to answer as it goes. −1: unknown, as
 * long as it has answered nothing of that pass. */
int64_t pace_alone_ms(const struct pace *pace, uint32_t job, enum render_pass pass, uint64_t rows, int64_t now_ms);
int64_t pace_leased_ms(const struct pace *pace, uint32_t job, enum render_pass pass, uint64_t rows);

/* When a worker that holds bands counts as stuck if it does not advance until then: eight times its longest gap, but
 * not within ten seconds. INT64_MAX as long as it has not been seen advancing twice. */
int64_t pace_stuck_at(const struct pace *pace);

#endif
