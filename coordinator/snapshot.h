/*
 * The state of a render at one moment, defined once: the terminal, JSON lines and all later views show this and
 * nothing else. Plain data, filled by the dispatcher (dispatcher.h), borrowed by the views for one call.
 * snapshot.schema.json describes it as it is written in JSON.
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
    WORKER_STATES,
};

/* The last that went wrong with a worker, or with the same process when it was another worker. */
enum worker_trouble {
    TROUBLE_NONE,
    TROUBLE_LOST,   /* it died, or its connection did */
    TROUBLE_SILENT, /* it has not been heard for too long */
    TROUBLE_STUCK,  /* it lives, but did not get on */
    TROUBLE_MISFIT, /* it sent a result that does not fit its band */
    TROUBLE_UNFIT,  /* it could not load a scene */
    TROUBLE_LIAR,   /* it returned wrong bytes */
    WORKER_TROUBLES,
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
    enum worker_trouble trouble;
};

enum stretch_state { STRETCH_WAITING, STRETCH_IN_WORK, STRETCH_DONE, STRETCH_STATES };

/* A stretch of a picture's rows: a band in work, or bands side by side that are all done or all wait. */
struct stretch_snapshot {
    uint32_t first_row, rows;
    enum stretch_state state;
    uint32_t worker; /* in work: the number of one who has it; else 0 */
};

enum job_state { JOB_WAITING, JOB_SURVEYING, JOB_RUNNING, JOB_DONE, JOB_FAILED, JOB_STATES };

/* One scene of the command. */
struct job_snapshot {
    const char *scene, *output; /* paths as the user gave them */
    enum job_state state;
    uint32_t width, height; /* pixels */
    double samples;         /* a pixel: the number asked for, else the mean of the rows done; 0: not known yet */
    uint32_t samples_max;   /* no pixel gets more */
    double error;           /* RMSE asked for; 0: none was */
    double rmse;            /* of the rows done, estimated; NAN: unknown */
    uint32_t rows_done, rows_in_work;
    uint64_t rays;
    double elapsed_seconds;   /* since its first band was handed out */
    double remaining_seconds; /* an estimate (forecast.h); negative: unknown yet */
    size_t stretch_count;
    const struct stretch_snapshot *stretches; /* the whole picture from the top; rows being surveyed are in work too */
};

struct snapshot {
    double elapsed_seconds; /* since the command began */
    double rays_per_second; /* over the last few seconds, all workers */
    uint64_t rays;          /* all jobs */
    uint32_t refused;       /* how often a worker asked to join and was not let in */
    size_t job_count, worker_count;
    const struct job_snapshot *jobs; /* in the order of the command */
    const struct worker_snapshot *workers; /* in the order of joining, those that are gone included */
};

/* A word or two in lower case, the same in every view. NULL of TROUBLE_NONE. */
const char *job_state_name(enum job_state state);
const char *stretch_state_name(enum stretch_state state);
const char *worker_state_name(enum worker_state state);
const char *worker_trouble_name(enum worker_trouble trouble);

#endif
