#include "coordinator/machines.h"

#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/memory.h"

enum { SLOTS_LEAST = 64, MINUTE_MS = 60000 };

/* Nonsense and refusals repeat themselves; a machine may have many workers that come and go at once. */
static const uint32_t lines_a_minute[MACHINE_LINES] = {
    [LINE_NONSENSE] = 1, [LINE_REFUSAL] = 4, [LINE_TROUBLE] = 16, [LINE_COMING] = 256};

void machines_finish(struct machines *machines)
{
    for (size_t i = 0; i < machines->count; i++)
        free(machines->machines[i].processes);
    free(machines->machines);
    free(machines->slots);
    *machines = (struct machines){0};
}

struct machine *machines_find(const struct machines *machines, uint32_t number)
{
    return number > 0 ? &machines->machines[number - 1] : NULL;
}

/* --- numbers ---------------------------------------------------------------------------------------------- */

/* The slot of that name, or the free one where it belongs. */
static uint32_t *find_slot(const struct machines *machines, const struct wire_machine *name)
{
    uint32_t hash = 0;
    for (size_t i = 0; i < sizeof name->id; i++)
        hash = hash_u32(hash ^ name->id[i]);
    size_t at = hash & (machines->slot_count - 1);
    while (machines->slots[at] && !wire_machine_equal(&machines->machines[machines->slots[at] - 1].name, name))
        at = (at + 1) & (machines->slot_count - 1);
    return &machines->slots[at];
}

/* Half of the slots stay free, so that the next free one is near. */
static void make_room(struct machines *machines)
{
    if (2 * (machines->count + 1) <= machines->slot_count)
        return;
    free(machines->slots);
    machines->slot_count = machines->slot_count ? 2 * machines->slot_count : SLOTS_LEAST;
    machines->slots = memory_array(machines->slot_count, sizeof *machines->slots);
    for (size_t i = 0; i < machines->count; i++)
        *find_slot(machines, &machines->machines[i].name) = (uint32_t)i + 1;
}

uint32_t machines_number(struct machines *machines, const struct wire_machine *name)
{
    make_room(machines);
    uint32_t *slot = find_slot(machines, name);
    if (*slot || machines->count == MACHINES_MAX)
        return *slot;
    machines->machines = memory_grow(machines->machines, &machines->capacity, machines->count + 1,
                                     sizeof *machines->machines);
    machines->machines[machines->count] = (struct machine){.name = *name};
    *slot = (uint32_t)++machines->count;
    return *slot;
}

/* --- troubles --------------------------------------------------------------------------------------------- */

static uint64_t hash_of(const char *host)
{
    struct digest digest = digest_of(host, strlen(host));
    uint64_t hash;
    memcpy(&hash, digest.bytes, sizeof hash);
    return hash;
}

/* Its index, or process_count. */
static size_t find_process(const struct machine *machine, const char *host, uint32_t pid, bool own)
{
    size_t i = 0;
    uint64_t hash = machine->process_count > 0 ? hash_of(host) : 0;
    for (; i < machine->process_count; i++) {
        const struct machine_process *process = &machine->processes[i];
        if (process->pid == pid && process->own == own && process->host == hash)
            break;
    }
    return i;
}

static void forget_process(struct machine *machine, size_t at)
{
    machine->process_count--;
    memmove(machine->processes + at, machine->processes + at + 1,
            (machine->process_count - at) * sizeof *machine->processes);
}

/* The one that has been quiet for longest, if it has not failed. */
static void make_room_for_process(struct machine *machine)
{
    size_t at = 0;
    if (machine->process_count < MACHINE_PROCESSES_MAX)
        return;
    while (at < machine->process_count && machine->processes[at].failures > 0)
        at++;
    if (at < machine->process_count)
        forget_process(machine, at);
}

void machine_note_trouble(struct machine *machine, const char *host, uint32_t pid, bool own,
                          enum worker_trouble trouble, bool failed)
{
    size_t at = find_process(machine, host, pid, own);
    struct machine_process process = {.host = hash_of(host), .pid = pid, .own = own};
    if (at < machine->process_count) {
        process = machine->processes[at];
        forget_process(machine, at);
    }
    process.failures += failed;
    process.trouble = trouble;
    make_room_for_process(machine);
    if (machine->process_count == MACHINE_PROCESSES_MAX) {
        machine->keeps_failing |= failed;
        return;
    }
    if (!machine->processes)
        machine->processes = memory_array(MACHINE_PROCESSES_MAX, sizeof *machine->processes);
    machine->processes[machine->process_count++] = process;
}

enum worker_trouble machine_trouble(const struct machine *machine, const char *host, uint32_t pid, bool own)
{
    size_t at = find_process(machine, host, pid, own);
    return at < machine->process_count ? machine->processes[at].trouble : TROUBLE_NONE;
}

bool machine_fails_too_often(const struct machine *machine, const char *host, uint32_t pid, bool own)
{
    size_t at = find_process(machine, host, pid, own);
    bool itself = at < machine->process_count && machine->processes[at].failures >= MACHINE_FAILURES_MAX;
    return itself || (machine->keeps_failing && !own);
}

/* --- lines of the log ------------------------------------------------------------------------------------- */

bool machine_may_tell(struct machine *machine, enum machine_line kind, int64_t now_ms, uint64_t *passed_over)
{
    bool begun = machine->lines[kind].told > 0 && now_ms - machine->lines[kind].since_ms < MINUTE_MS;
    *passed_over = machine->lines[kind].passed_over;
    if (begun && machine->lines[kind].told == lines_a_minute[kind]) {
        machine->lines[kind].passed_over++;
        return false;
    }
    if (!begun) {
        machine->lines[kind].since_ms = now_ms;
        machine->lines[kind].told = 0;
    }
    machine->lines[kind].told++;
    machine->lines[kind].passed_over = 0;
    return true;
}
