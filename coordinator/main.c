/* weft: the coordinator and its tools. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/abort.h"
#include "base/error.h"
#include "base/log.h"
#include "coordinator/commands.h"

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
} commands[] = {
    {"render", command_render, "render scenes on local and remote workers"},
    {"check", command_check, "check a scene and print what it needs"},
    {"compare", command_compare, "say how far two images are apart"},
    {"status", command_status, "show what a running coordinator is doing"},
    {"keygen", command_keygen, "make the keys of a farm on several machines"},
};

enum { COMMANDS = sizeof commands / sizeof *commands };

static void print_help(FILE *to)
{
    fputs("usage: weft COMMAND [OPTION]... [OPERAND]...\n"
          "A network render farm: the same bytes from any number of workers and threads.\n\n",
          to);
    for (size_t i = 0; i < COMMANDS; i++)
        fprintf(to, "  %-8s %s\n", commands[i].name, commands[i].help);
    fputs("  help     print this, or the help of the command that is named\n"
          "\n"
          "`weft help COMMAND` or `weft COMMAND --help` lists its options; `weft --version`\n"
          "prints the version. Workers on other machines run `weft-worker`. For example:\n"
          "\n"
          "  weft render scene.json              render it into scene.png, on all cores\n"
          "  weft check scene.json               say what is wrong with it or what it needs\n"
          "\n"
          "Manuals: weft(1), weft-worker(1), and weft-scene(5) for how scenes are written.\n",
          to);
}

/* Runs the command, or returns -1 where there is none of that name. */
static int run_command(int argc, char **argv)
{
    for (size_t i = 0; i < COMMANDS; i++)
        if (strcmp(argv[0], commands[i].name) == 0)
            return commands[i].run(argc, argv);
    return -1;
}

/* What was printed is a result, which may not be lost in silence. */
static int flush_results(int status)
{
    bool lost = ferror(stdout) != 0;
    errno = 0;
    lost |= fflush(stdout) != 0;
    if (!lost || status != STATUS_OK)
        return status;
    log_error("standard output cannot be written%s%s", errno ? ": " : "", errno ? strerror(errno) : "");
    return STATUS_OUTPUT;
}

static int complain(const char *name)
{
    log_error("unknown command \"%s\"; see weft --help", name);
    return STATUS_USAGE;
}

/* weft help [COMMAND]; weft help COMMAND is weft COMMAND --help. */
static int help(int argc, char **argv)
{
    char option[] = "--help";
    if (argc > 1) {
        int status = run_command(2, (char *[]){argv[1], option, NULL});
        return status < 0 ? complain(argv[1]) : status;
    }
    print_help(stdout);
    return STATUS_OK;
}

static int run(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return STATUS_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "help") == 0)
        return help(argc - 1, argv + 1);
    if (strcmp(argv[1], "--version") == 0) {
        puts("weft " WEFT_VERSION);
        return STATUS_OK;
    }
    int status = run_command(argc - 1, argv + 1);
    return status < 0 ? complain(argv[1]) : status;
}

int main(int argc, char **argv)
{
    log_start("weft", LOG_WARNING);
    abort_becomes_status("weft");
    return flush_results(run(argc, argv));
}
