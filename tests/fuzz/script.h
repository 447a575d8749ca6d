/*
 * Scripts, as which the fuzz targets of state machines read their input: three characters a step, what happens and two
 * numbers as the digits '0' to '9', ':' to 'o' (so up to 63). Other characters are passed over where a step could
 * begin. One step is the same for all who take messages:
 *
 *   m WHO COUNT  WHO (where there are several) says what the next COUNT bytes are behind a message's magic and version
 */
#ifndef WEFT_TESTS_FUZZ_SCRIPT_H
#define WEFT_TESTS_FUZZ_SCRIPT_H

#include <stdbool.h>

#include "tests/fuzz/wire_help.h"

enum { SCRIPT_NUMBERS = 64 };

struct script_reader {
    bool (*step)(char what, unsigned x, unsigned y);          /* false: no step begins so */
    void (*message)(unsigned who, const struct bytes *bytes); /* NULL: it takes none */
};

static inline unsigned script_number(uint8_t digit)
{
    return (unsigned)(digit - '0') % SCRIPT_NUMBERS;
}

/* Takes the step at text[size], or passes over a character; returns how many bytes that were. */
static inline size_t script_take(const struct script_reader *reader, const uint8_t *text, size_t size)
{
    if (size < 3)
        return size;
    unsigned x = script_number(text[1]), y = script_number(text[2]);
    if (text[0] != 'm' || !reader->message)
        return reader->step((char)text[0], x, y) ? 3 : 1;
    size_t count = y < size - 3 ? y : size - 3;
    struct bytes bytes = begun_message(text + 3, count);
    reader->message(x, &bytes);
    bytes_finish(&bytes);
    return 3 + count;
}

#endif
