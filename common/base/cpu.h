#ifndef WEFT_BASE_CPU_H
#define WEFT_BASE_CPU_H

/* Processors that this process may use: those of its affinity mask, but no more than its cgroup's quota allows
 * (rounded up). At least 1. */
int cpu_available(void);

#endif
