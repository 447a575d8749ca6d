/*
 * The reason a fallible function failed.
 *
 * A fallible function returns an enum status. Where the failure is first known it fills a struct error
 * with one sentence for a person; everyone above forwards status and sentence untouched.
 */
#ifndef WEFT_BASE_ERROR_H
#define WEFT_BASE_ERROR_H

/* The values are the exit statuses of the programs. */
enum status {
    STATUS_OK = 0,
    STATUS_FAILED = 1,   /* the render or the check failed */
    STATUS_USAGE = 2,    /* wrong usage */
    STATUS_INPUT = 3,    /* bad scene or asset, or bad bytes from a peer */
    STATUS_OUTPUT = 4,   /* output could not be written */
    STATUS_INTERNAL = 5, /* out of memory or an internal failure */
};

struct error {
    char text[1024]; /* one sentence without a newline; cut short if it does not fit */
};

/* Formats the sentence into *error and returns status, so that callers can write
 * `return error_set(...)`. status is not STATUS_OK. */
enum status error_set(struct error *error, enum status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Puts the formatted text before the sentence that *error already holds. Returns status. */
enum status error_prefix(struct error *error, enum status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
