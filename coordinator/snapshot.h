/*
 * The state of a render at one moment, defined once: the terminal, JSON lines and all later views show this and
 * nothing else. Plain data, filled by the farm (farm.h), borrowed by the views for one call.
 */
#ifndef WEFT_COORDINATOR_SNAPSHOT_H
#define WEFT_COORDINATOR_SNAPSHOT_H

#include <stddef.h>
#include <stdint.h>

enum worker_state {
    WORKER_LOADING, /* fetching and preparing a scene */
    WORKER_WORKING, /* holds bands */
    WORKER_IDLE,    /* ready, without a band */
    WORKER_DRAINING,
    WORKER_GONE,    /* died, was lost, or said goodbye */
};

struct worker_snapshot {
    uint32_t number;    /* from 1, in the order of joining */
    const char *host;
    const char *kernel;
    uint32_t pid, threads;
    enum worker_state state;
    uint32_t bands_held, bands_done;
    uint64_t rows_done, rays;
    double rays_per_second; /* over the last few seconds */
};

enum job_state { JOB_WAITING, JOB_SURVEYING, JOB_RUNNING, JOB_DONE, JOB_FAILED };

/* One scene of the command. */
struct job_snapshot {
    const char *scene, *output; /* paths as the user gave them */
    enum job_state state;
    uint32_t width, height; /* pixels */
    double samples;         /* a pixel: the number asked for, else the mean of the rows done; 0: not known yet */
    uint32_t samples_max;   /* no pixel gets more */
    double error;           /* RMSE asked for; 0: none was */
    double rmse;            /* of what was rendered, estimated; NAN: unknown, as long as it is not done */
    uint32_t rows_done, rows_in_work;
    uint64_t rays;
    double elapsed_seconds;   /* since its first band was handed out */
    double remaining_seconds; /* an estimate; negative: unknown yet */
};

struct snapshot {
    double elapsed_seconds; /* since the command began */
    double rays_per_second; /* over the last few seconds, all workers */
    uint64_t rays;          /* all jobs */
    size_t job_count, worker_count;
    const struct job_snapshot *jobs; /* in the order of the command */
    const struct worker_snapshot *workers; /* in the order of joining, those that are gone included */
};

#endif
