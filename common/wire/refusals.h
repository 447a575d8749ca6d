/*
 * Which refusals are worth a line of the log. Who is refused tries again and again, and who means harm more often: a
 * line that was told is not told again for a minute, and at most 16 are told in one. What was passed over is counted.
 * Pure.
 */
#ifndef WEFT_WIRE_REFUSALS_H
#define WEFT_WIRE_REFUSALS_H

#include <stdbool.h>
#include <stdint.h>

enum { REFUSAL_BYTES = 256, REFUSAL_LINE_BYTES = 320, REFUSALS_RECENT = 16, REFUSAL_PAUSE_MS = 60000 };

/* All zero: none yet. */
struct refusals {
    struct {
        char text[REFUSAL_BYTES]; /* "": free */
        int64_t noted_ms;
        bool waiting; /* to be told */
    } recent[REFUSALS_RECENT];
    uint64_t passed_over; /* since the last line */
};

/* Notes a refusal: `text` says who and why, the same for the same (cut short if it does not fit). */
void refusals_note(struct refusals *refusals, const char *text, int64_t now_ms);

/* Takes the next line to be told, with the number of those passed over before it. False if there is none. */
bool refusals_take(struct refusals *refusals, char line[REFUSAL_LINE_BYTES]);

#endif
