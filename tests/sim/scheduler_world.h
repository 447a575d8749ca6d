/*
 * What there is in a history of the scheduler: workers, jobs, leases, audits, and what is to come.
 */
#ifndef WEFT_TESTS_SCHEDULER_WORLD_H
#define WEFT_TESTS_SCHEDULER_WORLD_H

#include "coordinator/scheduler.h"
#include "tests/sim/history.h"

enum {
    SILENCE_MS = 4500,
    BEAT_MS = 1000,
    WORKERS_MAX = 12,
    SPARES_MAX = 24, /* trusted workers that come when they are asked for */
    JOBS_MAX = 4,
    ROWS_MAX = 200,
    MACHINES = 4, /* of which some workers are; the first is that of trusted ones */
    LEASES_MAX = 4096,
    END_MS = 3600 * 1000, /* far beyond what the honest worker needs alone */
};

enum fate { HONEST, DIES, SILENT, LEAVES, DRAINS, HANGS, REPEATS, FATES };

enum lease_state { OPEN, ANSWERED, REVOKED, LOST };

struct lease {
    enum lease_state state;
    uint32_t worker, job;
    enum render_pass pass;
    uint32_t first_row, rows;
    bool unsent; /* it was revoked before its result was sent */
    bool audits, lies; /* what its result is */
};

struct worker {
    enum fate fate;
    bool present;                         /* in the scheduler's view */
    bool proven;                          /* it has answered */
    bool draining, fated;                 /* fated: its fate has come */
    bool trusted;
    uint32_t machine;                     /* 0: its own */
    uint32_t lies;                        /* so often, in percent */
    bool announced[JOBS_MAX], ready[JOBS_MAX], ended[JOBS_MAX];
    uint32_t threads, credit, held;
    uint32_t ms_a_row;
    int64_t heard_ms, busy_until_ms;
    uint64_t progress;
};

/* An audit of the band that begins at a row. */
struct audit {
    bool open, unsettled, judges;
    uint64_t renderers, liars; /* bit sets of workers; 0: nobody who is here */
    uint32_t last;             /* who rendered it last, after the first */
    uint32_t turn;             /* counts its answers */
};

/* All but the rows, surveyors and `kept` is of the present pass. */
struct job {
    enum render_pass pass;
    uint32_t rows[PASSES];
    uint64_t surveyors; /* bit set of workers whose survey was accepted, or who found another's right */
    bool kept, over;
    uint32_t accepted_rows;
    bool accepted[ROWS_MAX];
    uint8_t losses[ROWS_MAX]; /* by fault, of bands and audits */
    struct {
        uint32_t count;
        uint64_t workers; /* bit set */
    } lost[2][ROWS_MAX];  /* the same of bands, and of audits */
    uint32_t band_rows[ROWS_MAX], band_worker[ROWS_MAX]; /* of the accepted band that begins there; rows 0: none does */
    struct audit audits[ROWS_MAX];
};

enum happening_kind { ARRIVES, JOINS, BEATS, FATE, FINDS };

struct happening {
    enum happening_kind kind;
    struct event event; /* ARRIVES; of FINDS what the audit is about; of the others only the worker */
    uint32_t turn;      /* FINDS */
};

/* One history; made anew from each seed. */
static struct world {
    bool deadly, asked;
    uint32_t audited; /* bands, in percent */
    uint32_t newcomer_bands;
    struct kept_rows kept[JOBS_MAX];
    struct scheduler *scheduler;
    struct action_list actions;
    struct worker workers[WORKERS_MAX + SPARES_MAX + 1]; /* numbered from 1; 1 is the honest one */
    uint32_t worker_count;
    struct job jobs[JOBS_MAX];
    uint32_t job_count, jobs_begun, jobs_over;
    struct lease leases[LEASES_MAX];
    uint64_t lease_count;
    struct queue happenings;
} world;

/* What the histories held, over all seeds. */
static struct {
    unsigned surveyed, done, failed, expelled, stuck, revoked, late, audited, judged, liars, undone, restarted, asked,
        reopened;
} tally;

static void happen(enum happening_kind kind, int64_t at_ms, struct event event)
{
    queue_put(&world.happenings, at_ms, &(struct happening){kind, event, 0}, sizeof(struct happening));
}

#endif
