/*
 * The scheduler with workers that say and do anything. The input is a script, of three characters a step: what happens,
 * and two numbers as the digits '0' to '9', ':' to 'o' (so up to 63). Other characters are passed over where a step
 * could begin. Workers and jobs are numbered in the order of their coming, leases in that of their granting.
 *
 *   J ROWS SURVEYED  a new job, of 1 + ROWS rows     w THREADS CREDIT  a new worker, with one more of each
 *   R WORKER JOB     ready                           r WORKER LEASE    returned a result
 *   B WORKER .       beat                            D WORKER .        to be drained
 *   L WORKER .       goodbye                         X WORKER .        lost
 *   t TIME UNIT      TIME ms later, or (UNIT 1) TIME * 256 ms
 */
#include "base/memory.h"
#include "coordinator/scheduler.h"
#include "tests/fuzz/fuzz.h"

enum { NUMBERS = 64, JOBS_MAX = 8, WORKERS_MAX = 16, SILENCE_MS = 4000 };

struct pass {
    uint32_t rows, left;
    bool accepted[NUMBERS + 1];
};

static struct {
    struct scheduler *scheduler;
    int64_t now_ms;
    struct {
        struct pass passes[PASSES];
        bool surveyed, over;
    } jobs[JOBS_MAX];
    struct {
        uint32_t credit;
        bool wants_none; /* it drains or is gone */
    } workers[WORKERS_MAX];
    uint32_t job_count, worker_count;
    struct {
        uint64_t number;
        uint32_t worker;
    } *leases; /* granted so far */
    size_t lease_count, lease_capacity;
} run;

/* --- what is to be done ----------------------------------------------------------------------------------- */

static struct pass *pass_of(const struct action *action)
{
    require(action->job < run.job_count && !run.jobs[action->job].over);
    struct pass *pass = &run.jobs[action->job].passes[action->pass];
    require(action->rows > 0 && action->first_row < pass->rows && action->rows <= pass->rows - action->first_row);
    require((action->pass == PASS_RENDER) == run.jobs[action->job].surveyed);
    return pass;
}

static uint32_t count_held(uint32_t worker)
{
    uint32_t held = 0;
    struct action grant;
    for (size_t i = 0; i < run.lease_count; i++)
        held += run.leases[i].worker == worker && scheduler_lease(run.scheduler, worker, run.leases[i].number, &grant);
    return held;
}

static void take_grant(const struct action *action)
{
    const struct pass *pass = pass_of(action);
    require(action->worker < run.worker_count && !run.workers[action->worker].wants_none);
    for (uint32_t row = 0; row < action->rows; row++)
        require(!pass->accepted[action->first_row + row]);
    run.leases = memory_grow(run.leases, &run.lease_capacity, run.lease_count + 1, sizeof *run.leases);
    run.leases[run.lease_count].number = action->lease;
    run.leases[run.lease_count++].worker = action->worker;
    require(count_held(action->worker) <= run.workers[action->worker].credit);
}

/* Every row once a pass. */
static void take_accept(const struct action *action)
{
    struct pass *pass = pass_of(action);
    for (uint32_t row = action->first_row; row < action->first_row + action->rows; row++) {
        require(!pass->accepted[row]);
        pass->accepted[row] = true;
        pass->left--;
    }
}

static void take_end_of_pass(const struct action *action)
{
    require(action->job < run.job_count && !run.jobs[action->job].over);
    if (action->kind == ACTION_SURVEYED)
        run.jobs[action->job].surveyed = true;
    else
        run.jobs[action->job].over = true;
    require(action->kind == ACTION_FAIL || run.jobs[action->job].passes[PASS_SURVEY].left == 0);
    require(action->kind != ACTION_DONE || run.jobs[action->job].passes[PASS_RENDER].left == 0);
}

static void take_action(const struct action *action)
{
    switch (action->kind) {
    case ACTION_GRANT:
        take_grant(action);
        break;
    case ACTION_ACCEPT:
        take_accept(action);
        break;
    case ACTION_SURVEYED:
    case ACTION_DONE:
    case ACTION_FAIL:
        take_end_of_pass(action);
        break;
    case ACTION_EXPEL:
        require(action->worker < run.worker_count);
        run.workers[action->worker].wants_none = true;
        break;
    default:
        require(action->worker < run.worker_count); /* a message to it */
        break;
    }
}

static void handle(struct event event)
{
    struct action_list actions = {0};
    scheduler_handle(run.scheduler, &event, run.now_ms, &actions);
    for (size_t i = 0; i < actions.count; i++)
        take_action(&actions.items[i]);
    free(actions.items);
}

/* --- what happens ----------------------------------------------------------------------------------------- */

static void add_job(uint32_t rows, uint32_t survey_rows)
{
    if (run.job_count == JOBS_MAX)
        return;
    uint32_t job = run.job_count++;
    run.jobs[job].passes[PASS_SURVEY] = (struct pass){.rows = survey_rows, .left = survey_rows};
    run.jobs[job].passes[PASS_RENDER] = (struct pass){.rows = rows, .left = rows};
    run.jobs[job].surveyed = survey_rows == 0;
    handle((struct event){.kind = EVENT_JOB, .rows = rows, .survey_rows = survey_rows});
}

static void add_worker(uint32_t threads, uint32_t credit)
{
    if (run.worker_count == WORKERS_MAX)
        return;
    uint32_t worker = run.worker_count++;
    run.workers[worker].credit = credit;
    handle((struct event){.kind = EVENT_JOIN, .worker = worker, .threads = threads, .credit = credit});
}

/* Any lease that was granted, or one that never was. */
static void return_result(uint32_t worker, size_t lease)
{
    uint64_t number = lease < run.lease_count ? run.leases[lease].number : UINT64_MAX - lease;
    handle((struct event){.kind = EVENT_RESULT, .worker = worker, .lease = number});
}

static void leave(enum event_kind kind, uint32_t worker)
{
    if (worker < run.worker_count)
        run.workers[worker].wants_none = true;
    handle((struct event){.kind = kind, .worker = worker});
}

static void pass_time(int64_t ms)
{
    run.now_ms += ms;
    handle((struct event){.kind = EVENT_TICK});
}

/* Takes a step; false if the letter is none. */
static bool step(char what, uint32_t x, uint32_t y)
{
    switch (what) {
    case 'J':
        add_job(1 + x, y);
        return true;
    case 'w':
        add_worker(1 + x, 1 + y);
        return true;
    case 'R':
        handle((struct event){.kind = EVENT_READY, .worker = x, .job = y});
        return true;
    case 'r':
        return_result(x, y);
        return true;
    case 'B':
        handle((struct event){.kind = EVENT_BEAT, .worker = x});
        return true;
    case 'D':
        leave(EVENT_DRAIN, x);
        return true;
    case 'L':
        leave(EVENT_LEAVE, x);
        return true;
    case 'X':
        leave(EVENT_LOST, x);
        return true;
    case 't':
        pass_time(y == 1 ? x * 256 : x);
        return true;
    default:
        return false;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct scheduler_policy policy = {.band_rows = size % 4, .silence_ms = SILENCE_MS};
    memset(&run, 0, sizeof run);
    run.scheduler = scheduler_create(&policy);
    for (size_t at = 0; at + 2 < size;)
        at += step((char)data[at], (uint32_t)(data[at + 1] - '0') % NUMBERS, (uint32_t)(data[at + 2] - '0') % NUMBERS)
                  ? 3 : 1;
    scheduler_destroy(&run.scheduler);
    free(run.leases);
    return 0;
}
