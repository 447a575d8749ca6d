/*
 * The machines that peers come from, as the wire tells them apart (wire/socket.h), and what is held against them. What
 * is remembered is bounded, however often a machine comes, and found at once. Pure.
 */
#ifndef WEFT_COORDINATOR_MACHINES_H
#define WEFT_COORDINATOR_MACHINES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "coordinator/snapshot.h"
#include "wire/socket.h"

enum {
    MACHINES_MAX = 65536,       /* that are told apart */
    MACHINE_PROCESSES_MAX = 32, /* of which a machine's troubles are remembered, */
    MACHINE_FAILURES_MAX = 3,   /* and how often one may fail */
};

/* Lines of the log about a machine, of each kind no more than so many a minute. */
enum machine_line { LINE_NONSENSE, LINE_REFUSAL, LINE_TROUBLE, LINE_COMING, MACHINE_LINES };

/* A process that has been in trouble, as it names itself: that counts for nothing with other machines, nor among those
 * that this coordinator has started. */
struct machine_process {
    uint64_t host; /* hash of the name that it gives its machine */
    uint32_t pid;
    bool own;
    uint32_t failures;
    enum worker_trouble trouble; /* the last */
};

struct machine {
    struct wire_machine name;
    bool lied;          /* a worker of it returned wrong bytes */
    bool keeps_failing; /* more processes have failed than are remembered */
    struct machine_process *processes; /* that one last whose trouble is the latest */
    size_t process_count;
    uint32_t first_spare, last_spare, spares; /* a queue of worker numbers, through struct peer's next_spare */
    struct {
        int64_t since_ms; /* when the minute began */
        uint32_t told;    /* in it */
        uint64_t passed_over;
    } lines[MACHINE_LINES];
};

/* All zero is empty; machines_finish frees it. */
struct machines {
    struct machine *machines;
    size_t count, capacity;
    uint32_t *slots; /* numbers of machines, by a hash of their names; 0: free */
    size_t slot_count; /* a power of two */
};

void machines_finish(struct machines *machines);

/* The machine's number, from 1 on; 0: it is new, and there are too many. */
uint32_t machines_number(struct machines *machines, const struct wire_machine *name);

/* Borrowed, until another machine comes. NULL for 0. */
struct machine *machines_find(const struct machines *machines, uint32_t number);

/* Notes what was the matter with a process, and whether it counts as a failure. */
void machine_note_trouble(struct machine *machine, const char *host, uint32_t pid, bool own,
                          enum worker_trouble trouble, bool failed);

/* The last trouble of that process; whether it, or its machine, has failed too often. */
enum worker_trouble machine_trouble(const struct machine *machine, const char *host, uint32_t pid, bool own);
bool machine_fails_too_often(const struct machine *machine, const char *host, uint32_t pid, bool own);

/* Whether one more line of that kind is to be logged now. *passed_over: how many were not since the last that was. */
bool machine_may_tell(struct machine *machine, enum machine_line kind, int64_t now_ms, uint64_t *passed_over);

#endif
