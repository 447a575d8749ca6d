#include "base/log.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

static struct {
    const char *program;
    enum log_level level;
    void (*hide)(void *);
    void (*show)(void *);
    void *context;
} log_state = {.program = "weft", .level = LOG_WARNING};

void log_start(const char *program, enum log_level level)
{
    log_state.program = program;
    log_state.level = level;
}

void log_set_display(void (*hide)(void *), void (*show)(void *), void *context)
{
    log_state.hide = hide;
    log_state.show = show;
    log_state.context = context;
}

/* Some texts come from other machines: nothing in them may steer the terminal. */
static void disarm(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < ' ' || *text == 0x7f)
            *text = '?';
}

static void write_whole(int file, char *line, size_t length)
{
    disarm(line);
    line[length++] = '\n';
    if (log_state.hide)
        log_state.hide(log_state.context);
    ssize_t ignored = write(file, line, length);
    (void)ignored;
    if (log_state.show)
        log_state.show(log_state.context);
}

/* How long what snprintf returned really is, in a buffer with `room` bytes. */
static size_t written(int returned, size_t room)
{
    return returned < 0 ? 0 : (size_t)returned < room ? (size_t)returned : room - 1;
}

static void write_line(enum log_level level, const char *kind, const char *format, va_list arguments)
{
    if (level > log_state.level)
        return;
    char line[2048];
    size_t room = sizeof line - 1; /* for the newline */
    size_t length = written(snprintf(line, room, "%s: %s", log_state.program, kind), room);
    length += written(vsnprintf(line + length, room - length, format, arguments), room - length);
    write_whole(STDERR_FILENO, line, length);
}

void log_error(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(LOG_ERROR, "", format, arguments);
    va_end(arguments);
}

void log_warning(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(LOG_WARNING, "warning: ", format, arguments);
    va_end(arguments);
}

void log_info(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(LOG_INFO, "", format, arguments);
    va_end(arguments);
}

void log_debug(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(LOG_DEBUG, "debug: ", format, arguments);
    va_end(arguments);
}

void log_result(const char *format, ...)
{
    char line[2048];
    va_list arguments;
    va_start(arguments, format);
    size_t length = written(vsnprintf(line, sizeof line - 1, format, arguments), sizeof line - 1);
    va_end(arguments);
    write_whole(STDOUT_FILENO, line, length);
}
