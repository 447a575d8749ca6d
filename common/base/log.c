#include "base/log.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/folder.h"
#include "base/json_text.h"
#include "base/text.h"

static struct {
    const char *program;
    enum log_level level;
    void (*hide)(void *);
    void (*show)(void *);
    void *display;
    void (*take)(void *, enum log_level, const char *);
    void *listener;
    int file;            /* that lines are appended to, or −1 */
    bool as_json;        /* in the file; without one on standard error */
    bool file_has_failed;
    struct bytes line;   /* room to build one in */
} log_state = {.program = "weft", .level = LOG_WARNING, .file = -1};

void log_start(const char *program, enum log_level level)
{
    log_state.program = program;
    log_state.level = level;
}

enum status log_open(const char *path, bool as_json, struct error *error)
{
    log_close();
    if (path) {
        log_state.file = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOCTTY, 0666);
        int failure = errno;
        if (log_state.file < 0 && folder_is_there(path, error) != STATUS_OK)
            return STATUS_OUTPUT;
        if (log_state.file < 0)
            return error_set(error, STATUS_OUTPUT, "%s: the log cannot be written: %s", path, strerror(failure));
    }
    log_state.as_json = as_json;
    return STATUS_OK;
}

void log_close(void)
{
    if (log_state.file >= 0)
        close(log_state.file);
    log_state.file = -1;
    log_state.as_json = log_state.file_has_failed = false;
    bytes_finish(&log_state.line);
}

void log_set_display(void (*hide)(void *), void (*show)(void *), void *context)
{
    log_state.hide = hide;
    log_state.show = show;
    log_state.display = context;
}

void log_set_listener(void (*take)(void *context, enum log_level level, const char *text), void *context)
{
    log_state.take = take;
    log_state.listener = context;
}

const char *log_level_name(enum log_level level)
{
    static const char *const names[] = {"", "error", "warning", "info", "debug"};
    return names[level];
}

/* --- the forms of a line ---------------------------------------------------------------------------------- */

/* As a person reads it: "weft: warning: text", or as a result the text alone. */
static void put_shown(struct bytes *line, enum log_level level, bool is_result, const char *text)
{
    const char *kind = level == LOG_WARNING ? "warning: " : level == LOG_DEBUG ? "debug: " : "";
    if (!is_result)
        text_put(line, "%s: %s", log_state.program, kind);
    bytes_put(line, text, strlen(text));
}

static void put_recorded(struct bytes *line, enum log_level level, const char *text)
{
    char time[CLOCK_TEXT_BYTES];
    clock_text(time);
    if (!log_state.as_json) {
        text_put(line, "%s %s %s[%d]: ", time, log_level_name(level), log_state.program, (int)getpid());
        bytes_put(line, text, strlen(text));
        return;
    }
    text_put(line, "{");
    json_text_string(line, "time", time);
    text_put(line, ",");
    json_text_string(line, "level", log_level_name(level));
    text_put(line, ",");
    json_text_string(line, "program", log_state.program);
    text_put(line, ",\"pid\":%d,", (int)getpid());
    json_text_string(line, "message", text);
    text_put(line, "}");
}

/* --- where lines go --------------------------------------------------------------------------------------- */

/* Ends the line and writes it at once. False, with errno set, if that fails. */
static bool write_line(int file)
{
    bytes_put_u8(&log_state.line, '\n');
    bool whole = write(file, log_state.line.data, log_state.line.size) == (ssize_t)log_state.line.size;
    log_state.line.size = 0;
    return whole;
}

static void show(int file, enum log_level level, bool is_result, const char *text)
{
    if (log_state.as_json && log_state.file < 0 && !is_result)
        put_recorded(&log_state.line, level, text);
    else
        put_shown(&log_state.line, level, is_result, text);
    if (log_state.hide)
        log_state.hide(log_state.display);
    write_line(file);
    if (log_state.show)
        log_state.show(log_state.display);
}

static void record(enum log_level level, const char *text)
{
    put_recorded(&log_state.line, level, text);
    if (write_line(log_state.file) || log_state.file_has_failed)
        return;
    char failure[128];
    snprintf(failure, sizeof failure, "lines are missing in the log: %s", strerror(errno));
    log_state.file_has_failed = true;
    show(STDERR_FILENO, LOG_WARNING, false, failure);
}

static void tell(int file, enum log_level level, bool is_result, const char *format, va_list arguments)
{
    bool is_shown = is_result || level <= log_state.level;
    bool is_kept = (log_state.file >= 0 || log_state.take) && (level <= LOG_INFO || is_shown);
    if (!is_shown && !is_kept)
        return;
    char raw[2048];
    vsnprintf(raw, sizeof raw, format, arguments);
    /* Some texts come from other machines: nothing in them may steer a terminal. */
    struct bytes text = {0};
    text_put_cut(&text, raw, SIZE_MAX);
    const char *line = text.size ? (const char *)text.data : "";
    if (is_shown)
        show(file, level, is_result, line);
    if (log_state.file >= 0)
        record(level, line);
    if (log_state.take)
        log_state.take(log_state.listener, level, line);
    bytes_finish(&text);
}

/* --- what to say ------------------------------------------------------------------------------------------ */

#define DEFINE_LOG(name, file, level, is_result)                                                                      \
    void name(const char *format, ...)                                                                                \
    {                                                                                                                 \
        va_list arguments;                                                                                            \
        va_start(arguments, format);                                                                                  \
        tell(file, level, is_result, format, arguments);                                                              \
        va_end(arguments);                                                                                            \
    }

DEFINE_LOG(log_error, STDERR_FILENO, LOG_ERROR, false)
DEFINE_LOG(log_warning, STDERR_FILENO, LOG_WARNING, false)
DEFINE_LOG(log_info, STDERR_FILENO, LOG_INFO, false)
DEFINE_LOG(log_debug, STDERR_FILENO, LOG_DEBUG, false)
DEFINE_LOG(log_result, STDOUT_FILENO, LOG_INFO, true)
