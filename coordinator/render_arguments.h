/*
 * The command line of weft render.
 */
#ifndef WEFT_COORDINATOR_RENDER_ARGUMENTS_H
#define WEFT_COORDINATOR_RENDER_ARGUMENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"
#include "coordinator/http_address.h"
#include "coordinator/render_job.h"
#include "wire/socket.h"

/* Strings are borrowed from argv; NULL: not given. */
struct render_arguments {
    const char *output, *report, *kernel, *keys, *log;
    struct render_choices choices;
    double audit_percent;
    int64_t workers, threads, band;
    char listen[WIRE_ENDPOINT_BYTES]; /* "": no */
    const char *http_token;
    struct http_address http; /* size 0: no */
    bool insecure, quiet, verbose, log_json;
    const char *progress;
};

/* Defaults first, then what argv says, which fits together; *first is the index of the first scene, of which there is
 * one at least. STATUS_USAGE otherwise. --help and --version are answered, and end the process. */
enum status render_arguments_read(struct render_arguments *arguments, int argc, char **argv, int *first,
                                  struct error *error);

#endif
