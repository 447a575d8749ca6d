/*
 * The subcommands of weft. Each gets the arguments after its name (argv[0] is the name) and returns the exit status.
 */
#ifndef WEFT_COORDINATOR_COMMANDS_H
#define WEFT_COORDINATOR_COMMANDS_H

int command_render(int argc, char **argv);
int command_check(int argc, char **argv);
int command_compare(int argc, char **argv);
int command_keygen(int argc, char **argv);
int command_status(int argc, char **argv);

#endif
