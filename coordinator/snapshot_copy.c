#include "coordinator/snapshot_copy.h"

#include <string.h>

#include "base/memory.h"

/* Behind the snapshot: jobs, workers, stretches, and last the strings, which need no alignment. */
struct parts {
    size_t stretches, string_bytes;
};

static struct parts measure(const struct snapshot *s)
{
    struct parts parts = {0};
    for (size_t i = 0; i < s->job_count; i++) {
        parts.stretches += s->jobs[i].stretch_count;
        parts.string_bytes += strlen(s->jobs[i].scene) + strlen(s->jobs[i].output) + 2;
    }
    for (size_t i = 0; i < s->worker_count; i++)
        parts.string_bytes += strlen(s->workers[i].host) + strlen(s->workers[i].kernel) + 2;
    return parts;
}

static const char *put_string(char **at, const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = memcpy(*at, text, size);
    *at += size;
    return copy;
}

struct snapshot *snapshot_copy(const struct snapshot *s)
{
    struct parts parts = measure(s);
    size_t jobs_bytes = s->job_count * sizeof *s->jobs, workers_bytes = s->worker_count * sizeof *s->workers;
    size_t stretches_bytes = parts.stretches * sizeof *s->jobs->stretches;
    struct snapshot *copy =
        memory_array(sizeof *copy + jobs_bytes + workers_bytes + stretches_bytes + parts.string_bytes, 1);
    struct job_snapshot *jobs = (struct job_snapshot *)(copy + 1);
    struct worker_snapshot *workers = (struct worker_snapshot *)(jobs + s->job_count);
    struct stretch_snapshot *stretches = (struct stretch_snapshot *)(workers + s->worker_count);
    char *strings = (char *)(stretches + parts.stretches);
    *copy = *s;
    copy->jobs = jobs;
    copy->workers = workers;
    for (size_t i = 0; i < s->job_count; i++) {
        jobs[i] = s->jobs[i];
        jobs[i].scene = put_string(&strings, s->jobs[i].scene);
        jobs[i].output = put_string(&strings, s->jobs[i].output);
        jobs[i].stretches = stretches;
        for (size_t k = 0; k < jobs[i].stretch_count; k++)
            *stretches++ = s->jobs[i].stretches[k];
    }
    for (size_t i = 0; i < s->worker_count; i++) {
        workers[i] = s->workers[i];
        workers[i].host = put_string(&strings, s->workers[i].host);
        workers[i].kernel = put_string(&strings, s->workers[i].kernel);
    }
    return copy;
}
