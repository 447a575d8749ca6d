/*
 * How messages begin, for the fuzz targets of the wire: so corpora outlive the protocol's versions.
 */
#ifndef WEFT_TESTS_FUZZ_WIRE_HELP_H
#define WEFT_TESTS_FUZZ_WIRE_HELP_H

#include "wire/message.h"

/* Magic and version, as far as all messages are alike, and then these bytes. The caller frees. */
static inline struct bytes begun_message(const uint8_t *rest, size_t size)
{
    struct bytes bytes = {0};
    bytes_put(&bytes, "WEFT", 4);
    bytes_put_u16(&bytes, PROTOCOL_VERSION);
    bytes_put(&bytes, rest, size);
    return bytes;
}

#endif
