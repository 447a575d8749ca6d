/*
 * Lines for a person: "weft: text" on standard error, and results on standard output. Each call writes one whole line
 * with one write, so lines of several processes do not mix. All calls from one thread.
 */
#ifndef WEFT_BASE_LOG_H
#define WEFT_BASE_LOG_H

#include <stdbool.h>

#include "base/error.h"

enum log_level { LOG_SILENT, LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG };

/* Names the program in every line and sets what is shown. Before this call: "weft", warnings and errors.
 * `program` is kept, not copied. */
void log_start(const char *program, enum log_level level);

/* From now on every line, down to information even where less is shown, is appended to the file `path` as well, with
 * the time and its level:
 *     2026-01-31T23:59:59.123Z warning weft[4711]: text
 * or, as_json, as an object with the members time, level, program, pid and message. Several processes may share the
 * file. path NULL: no file; what goes to standard error is JSON then, if as_json. STATUS_OUTPUT if the file cannot be
 * opened; that it cannot be written later is said once. */
enum status log_open(const char *path, bool as_json, struct error *error);

/* Closes the file, if one is open, and undoes as_json. */
void log_close(void);

/* Called before and after each line if set, so that a live display can step aside. May be NULL. */
void log_set_display(void (*hide)(void *), void (*show)(void *), void *context);

/* Called with every line, down to information even where less is shown; text without the program's name, in valid UTF-8
 * and without control characters, borrowed for the call. May be NULL. */
void log_set_listener(void (*take)(void *context, enum log_level level, const char *text), void *context);

/* "error", "warning", "info", "debug"; of LOG_SILENT "". */
const char *log_level_name(enum log_level level);

void log_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_debug(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A line of result on standard output, which a live display steps aside for as well; elsewhere it is information. */
void log_result(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
