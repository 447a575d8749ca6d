#include "base/abort.h"

#include <signal.h>
#include <string.h>
#include <unistd.h>

#include "base/error.h"

static const char *name;

/* Only calls that a signal handler may make. */
static void end(int signal_number)
{
    static const char text[] = ": an internal failure, told above\n";
    (void)signal_number;
    ssize_t ignored = write(STDERR_FILENO, name, strlen(name));
    ignored = write(STDERR_FILENO, text, sizeof text - 1);
    (void)ignored;
    _exit(STATUS_INTERNAL);
}

void abort_becomes_status(const char *program)
{
    name = program;
    signal(SIGABRT, end);
}
