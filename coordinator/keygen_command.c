/* weft keygen */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "base/options.h"
#include "coordinator/commands.h"
#include "wire/keys.h"

enum { OPTION_WORKER = 256, OPTION_HELP, OPTION_VERSION };

static const struct option_spec options[] = {
    {OPTION_WORKER, "worker", "NAME", "one more worker's in DIR/NAME; admit it in DIR/workers"},
    {OPTION_HELP, "help", NULL, "print this and exit"},
    {OPTION_VERSION, "version", NULL, "print the version and exit"},
    {0},
};

static void print_help(void)
{
    puts("usage: weft keygen [--worker NAME] DIR\n"
         "Makes the keys of a farm in a folder, by which coordinator and workers on other\n"
         "machines know one another and encrypt what they say. Nothing that is there\n"
         "already is overwritten.\n");
    options_help(stdout, options);
    puts("\nFiles: coordinator.key, worker.key and watcher.key are secret; coordinator.pub,\n"
         "worker.pub and watcher.pub are not. The lists workers and watchers hold the\n"
         "public keys, one a line, that may join, or may only look; they are read when a\n"
         "render starts. The coordinator runs with --keys DIR; a worker's machine needs a\n"
         "folder with coordinator.pub and worker.key, no more. Copy them as secrets: by\n"
         "scp, say.\n"
         "\nExit status: 0 made; 2 wrong usage; 3 bad keys in the folder; 4 not written;\n"
         "5 an internal failure.");
}

static enum status handle_option(void *context, int key, const char *argument, struct error *error)
{
    const char **worker = context;
    (void)error;
    switch (key) {
    case OPTION_WORKER:
        *worker = argument;
        break;
    case OPTION_HELP:
        print_help();
        exit(STATUS_OK);
    case OPTION_VERSION:
        puts("weft " WEFT_VERSION);
        exit(STATUS_OK);
    }
    return STATUS_OK;
}

static void say_what_next(const char *folder, const char *worker)
{
    if (worker)
        log_result("%s/%s: keys of one more worker; copy the folder to its machine, for weft-worker --keys", folder,
                   worker);
    else
        log_result("%s: keys of a farm; keep it where weft render --keys is to run, and copy coordinator.pub and "
                   "worker.key to the workers' machines, for weft-worker --keys", folder);
}

int command_keygen(int argc, char **argv)
{
    const char *worker = NULL;
    struct error error;
    int first = 0;
    enum status status = options_parse(argc, argv, options, handle_option, &worker, &first, &error);
    if (status == STATUS_OK && argc - first != 1)
        status = error_set(&error, STATUS_USAGE, "expected one folder, found %d operands; see weft keygen --help",
                           argc - first);
    if (status == STATUS_OK)
        status = worker ? keys_add_worker(argv[first], worker, &error) : keys_make(argv[first], &error);
    if (status == STATUS_OK)
        say_what_next(argv[first], worker);
    else
        log_error("%s", error.text);
    return (int)status;
}
