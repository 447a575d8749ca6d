/*
 * Lines for a person: "weft: text" on standard error, and results on standard output. Each call writes one whole line
 * with one write, so lines of several processes do not mix.
 */
#ifndef WEFT_BASE_LOG_H
#define WEFT_BASE_LOG_H

enum log_level { LOG_SILENT, LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG };

/* Names the program in every line and sets what is shown. Before this call: "weft", warnings and errors.
 * `program` is kept, not copied. */
void log_start(const char *program, enum log_level level);

/* Called before and after each line if set, so that a live display can step aside. May be NULL. */
void log_set_display(void (*hide)(void *), void (*show)(void *), void *context);

void log_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));
void log_debug(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A line of result on standard output, which a live display steps aside for as well. */
void log_result(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
