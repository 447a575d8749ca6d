#include "base/cpu.h"

#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* The first two words of a one-line file, as numbers; "max" is −1. */
static bool read_numbers(const char *path, double *first, double *second)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return false;
    char word[32] = "";
    *second = 0;
    int got = fscanf(file, "%31s %lf", word, second);
    fclose(file);
    *first = -1;
    return got >= 1 && (strcmp(word, "max") == 0 || sscanf(word, "%lf", first) == 1);
}

/* Processors' worth of time that the cgroup in `folder` may use; INFINITY: no limit. */
static double folder_quota(const char *folder)
{
    char path[4300];
    double quota, period, ignored;
    snprintf(path, sizeof path, "%s/cpu.max", folder); /* version 2: "QUOTA PERIOD" in µs, or "max PERIOD" */
    if (read_numbers(path, &quota, &period))
        return quota > 0 && period > 0 ? quota / period : INFINITY;
    snprintf(path, sizeof path, "%s/cpu.cfs_quota_us", folder); /* version 1 */
    if (!read_numbers(path, &quota, &ignored))
        return INFINITY;
    snprintf(path, sizeof path, "%s/cpu.cfs_period_us", folder);
    if (!read_numbers(path, &period, &ignored))
        return INFINITY;
    return quota > 0 && period > 0 ? quota / period : INFINITY;
}

/* The least quota from the process's own cgroup up to the root of the hierarchy mounted at `mount`. */
static double hierarchy_quota(const char *mount, char *group)
{
    double least = INFINITY;
    for (;;) {
        char folder[4200];
        snprintf(folder, sizeof folder, "%s%s", mount, group);
        double quota = folder_quota(folder);
        least = quota < least ? quota : least;
        char *slash = strrchr(group, '/');
        if (!slash)
            return least;
        *slash = '\0';
    }
}

/* /proc/self/cgroup has lines "ID:CONTROLLERS:PATH"; version 2's line has no controllers. */
static double cgroup_quota(void)
{
    double least = INFINITY;
    FILE *file = fopen("/proc/self/cgroup", "re");
    if (!file)
        return least;
    char line[4096];
    while (fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = '\0';
        char *controllers = strchr(line, ':');
        char *group = controllers ? strchr(controllers + 1, ':') : NULL;
        if (!group)
            continue;
        *group++ = '\0';
        double quota = INFINITY;
        if (controllers[1] == '\0')
            quota = hierarchy_quota("/sys/fs/cgroup", group);
        else if (strstr(controllers, "cpu"))
            quota = hierarchy_quota("/sys/fs/cgroup/cpu", group);
        least = quota < least ? quota : least;
    }
    fclose(file);
    return least;
}

int cpu_available(void)
{
    cpu_set_t set;
    int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    double quota = cgroup_quota();
    if (quota < count)
        count = (int)ceil(quota);
    return count > 0 ? count : 1;
}
