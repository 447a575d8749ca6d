/*
 * What the fuzz targets share. A target is one file here, TARGET.c, that defines LLVMFuzzerTestOneInput: it hands any
 * bytes to what reads those of strangers, and demands what the headers promise. `make fuzz` runs it under libFuzzer;
 * `make test` links it with replay.c, which puts the files of corpus/TARGET through it.
 */
#ifndef WEFT_TESTS_FUZZ_H
#define WEFT_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

/* Returns 0. The input is not followed by a NUL, and may be empty. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the program, as a sanitizer would, unless the condition holds. */
#define require(condition)                                                                                             \
    do {                                                                                                               \
        if (!(condition))                                                                                              \
            fuzz_fail(__FILE__, __LINE__, #condition);                                                                 \
    } while (0)

static inline _Noreturn void fuzz_fail(const char *file, int line, const char *condition)
{
    fprintf(stderr, "%s:%d: expected %s, found otherwise\n", file, line, condition);
    abort();
}

/* Bad bytes are refused with one sentence, and with no other status. */
static inline void require_refusal(enum status status, const struct error *error)
{
    require(status == STATUS_INPUT);
    require(error->text[0] != '\0');
    require(!strchr(error->text, '\n'));
}

#endif
