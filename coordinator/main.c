/* weft: the coordinator and its tools. */
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
    fputs("\n`weft COMMAND --help` says more. Workers on other machines run `weft-worker`.\n", to);
}

int main(int argc, char **argv)
{
    log_start("weft", LOG_WARNING);
    abort_becomes_status("weft");
    const char *name = argc > 1 ? argv[1] : "";
    for (size_t i = 0; i < COMMANDS; i++)
        if (strcmp(name, commands[i].name) == 0)
            return commands[i].run(argc - 1, argv + 1);
    if (strcmp(name, "--help") == 0 || strcmp(name, "help") == 0) {
        print_help(stdout);
        return STATUS_OK;
    }
    if (strcmp(name, "--version") == 0) {
        puts("weft " WEFT_VERSION);
        return STATUS_OK;
    }
    if (argc > 1)
        log_error("unknown command \"%s\"; see weft --help", name);
    else
        print_help(stderr);
    return STATUS_USAGE;
}
