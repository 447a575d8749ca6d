/*
 * For benchmarks: other programs, and what they use.
 */
#ifndef WEFT_BENCH_PROCESS_H
#define WEFT_BENCH_PROCESS_H

#include <arpa/inet.h>
#include <inttypes.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"

extern char **environ;

struct process {
    pid_t pid;
    int64_t start_us;
};

/* What a process took in all, with its children that it has waited for. */
struct process_cost {
    double wall_seconds, cpu_seconds;
    double peak_bytes; /* of memory, of the largest of them */
};

/* Ends this program. */
static inline _Noreturn void process_fail(const char *name, const char *what)
{
    fprintf(stderr, "%s: %s\n", name, what);
    exit(STATUS_FAILED);
}

/* Starts argv[0]; argv ends with NULL. */
static inline struct process process_start(const char *const argv[])
{
    struct process process = {.start_us = clock_now_us()};
    if (posix_spawn(&process.pid, argv[0], NULL, NULL, (char **)argv, environ) != 0)
        process_fail(argv[0], "cannot be started");
    return process;
}

static inline double process_seconds_of(struct timeval time)
{
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

/* Waits for its end. Ends this program if it failed. */
static inline struct process_cost process_wait(const struct process *process, const char *name)
{
    int status;
    struct rusage usage;
    if (process->pid < 0 || wait4(process->pid, &status, 0, &usage) != process->pid || status != 0)
        process_fail(name, "failed");
    return (struct process_cost){
        .wall_seconds = 1e-6 * (double)(clock_now_us() - process->start_us),
        .cpu_seconds = process_seconds_of(usage.ru_utime) + process_seconds_of(usage.ru_stime),
        .peak_bytes = 1024 * (double)usage.ru_maxrss,
    };
}

/* CPU time that a process which runs has taken so far. */
static inline double process_cpu_seconds(const struct process *process)
{
    clockid_t clock;
    struct timespec time;
    if (clock_getcpuclockid(process->pid, &clock) != 0 || clock_gettime(clock, &time) != 0)
        return 0;
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Memory that it holds now. */
static inline double process_bytes(const struct process *process)
{
    char path[64];
    uint64_t all, resident = 0;
    snprintf(path, sizeof path, "/proc/%d/statm", (int)process->pid);
    FILE *file = fopen(path, "r");
    if (file && fscanf(file, "%" SCNu64 " %" SCNu64, &all, &resident) != 2)
        resident = 0;
    if (file)
        fclose(file);
    return (double)resident * (double)sysconf(_SC_PAGESIZE);
}

/* A port of 127.0.0.1 that was free a moment ago. */
static inline int process_free_port(void)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&address, size) != 0 ||
        getsockname(fd, (struct sockaddr *)&address, &size) != 0)
        process_fail("127.0.0.1", "no port is free");
    close(fd);
    return ntohs(address.sin_port);
}

#endif
