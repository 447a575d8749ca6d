/*
 * Messages of the wire. One that is taken has just one encoding: the bytes that it came as. An input is tried as it is,
 * and as what follows a message's magic and version.
 */
#include "base/memory.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/wire_help.h"

static void try_message(const uint8_t *data, size_t size)
{
    struct message message;
    struct error error = {{0}};
    enum status status = message_decode(&message, data, size, &error);
    if (status != STATUS_OK) {
        require_refusal(status, &error);
        return;
    }
    struct bytes again = {0};
    message_encode(&message, &again);
    require(again.size == size && memcmp(again.data, data, size) == 0);
    bytes_finish(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes begun = begun_message(data, size);
    uint8_t *exact = memory_array(begun.size, 1); /* so that reading on is noticed */
    memcpy(exact, begun.data, begun.size);
    try_message(exact, begun.size);
    try_message(data, size);
    free(exact);
    bytes_finish(&begun);
    return 0;
}
