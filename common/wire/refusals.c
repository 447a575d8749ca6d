#include "wire/refusals.h"

#include <inttypes.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* The place of that text, or else one that is free: told, and long enough ago. −1 if there is neither. */
static int place_of(const struct refusals *refusals, const char *text, int64_t now_ms)
{
    int place = -1;
    for (int i = 0; i < REFUSALS_RECENT; i++) {
        bool old = !refusals->recent[i].waiting && now_ms - refusals->recent[i].noted_ms >= REFUSAL_PAUSE_MS;
        if (strncmp(refusals->recent[i].text, text, REFUSAL_BYTES - 1) == 0)
            return i;
        if (place < 0 && (!refusals->recent[i].text[0] || old))
            place = i;
    }
    return place;
}

void refusals_note(struct refusals *refusals, const char *text, int64_t now_ms)
{
    int place = place_of(refusals, text, now_ms);
    bool known = place >= 0 && strncmp(refusals->recent[place].text, text, REFUSAL_BYTES - 1) == 0;
    if (place < 0 || (known && now_ms - refusals->recent[place].noted_ms < REFUSAL_PAUSE_MS)) {
        refusals->passed_over++;
        return;
    }
    snprintf(refusals->recent[place].text, REFUSAL_BYTES, "%s", text);
    refusals->recent[place].noted_ms = now_ms;
    refusals->recent[place].waiting = true;
}

bool refusals_take(struct refusals *refusals, char line[REFUSAL_LINE_BYTES])
{
    for (int i = 0; i < REFUSALS_RECENT; i++) {
        if (!refusals->recent[i].waiting)
            continue;
        refusals->recent[i].waiting = false;
        int length = snprintf(line, REFUSAL_LINE_BYTES, "%s", refusals->recent[i].text);
        if (refusals->passed_over > 0)
            snprintf(line + length, REFUSAL_LINE_BYTES - (size_t)length, " (and %" PRIu64 " more since the last line)",
                     refusals->passed_over);
        refusals->passed_over = 0;
        return true;
    }
    return false;
}
