/*
 * The scheduler with workers that say and do anything. The input is a script (script.h) without messages. Workers (from
 * 1: '0' is worker 1) and jobs are numbered in the order of their coming, leases in that of their granting.
 *
 *   J ROWS SURVEYED  a new job, of 1 + ROWS rows     w THREADS CREDIT  a new worker, with one more of each
 *   R WORKER JOB     ready                           r WORKER LEASE    returned a result
 *   B WORKER .       beat                            D WORKER .        to be drained
 *   L WORKER .       goodbye                         X WORKER .        lost
 *   t TIME UNIT      TIME ms later, or (UNIT 1) TIME * 256 ms
 *   A ROWS .         bands that begin below ROWS are audited from now on
 *   W THREADS CREDIT a new worker that is trusted
 *   S JOB ROW        an audit is settled             G JOB ROW         and this one is to be judged
 *   Z WORKER .       lied; WORKER 'o' is number 0
 */
#include "base/memory.h"
#include "coordinator/scheduler.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/script.h"

enum { JOBS_MAX = 8, WORKERS_MAX = 16, SILENCE_MS = 4000 };

struct pass {
    uint32_t rows, left;
    bool accepted[SCRIPT_NUMBERS + 1];
    bool audited[SCRIPT_NUMBERS + 1];   /* by the row where the band begins: its audit is open, */
    bool unsettled[SCRIPT_NUMBERS + 1]; /* and answered; */
    bool settled[SCRIPT_NUMBERS + 1];   /* it is over, which a liar who took part in it undoes */
};

static struct {
    struct scheduler *scheduler;
    int64_t now_ms;
    struct {
        struct pass passes[PASSES];
        bool surveyed, over;
        uint32_t survey_rows;
    } jobs[JOBS_MAX];
    struct {
        uint32_t credit;
        bool wants_none; /* it drains or is gone */
    } workers[WORKERS_MAX + 1];
    uint32_t job_count, worker_count, audited_rows;
    bool has_liars;
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

static bool is_worker(uint32_t number)
{
    return number >= 1 && number <= run.worker_count;
}

static bool is_audited(const void *context, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    (void)context;
    (void)job;
    (void)pass;
    return first_row < run.audited_rows;
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
    struct pass *pass = pass_of(action);
    if (run.has_liars && pass->settled[action->first_row]) {
        pass->settled[action->first_row] = false;
        pass->audited[action->first_row] = true;
    }
    require(is_worker(action->worker) && !run.workers[action->worker].wants_none);
    for (uint32_t row = 0; row < action->rows; row++)
        require(pass->accepted[action->first_row + row] == pass->audited[action->first_row]);
    run.leases = memory_grow(run.leases, &run.lease_capacity, run.lease_count + 1, sizeof *run.leases);
    run.leases[run.lease_count].number = action->lease;
    run.leases[run.lease_count++].worker = action->worker;
    require(count_held(action->worker) <= run.workers[action->worker].credit);
}

/* Every row once a pass, and once more each time that it was undone. */
static void take_accept(const struct action *action)
{
    struct pass *pass = pass_of(action);
    for (uint32_t row = action->first_row; row < action->first_row + action->rows; row++) {
        require(!pass->accepted[row]);
        pass->accepted[row] = true;
        pass->left--;
    }
    pass->audited[action->first_row] = is_audited(NULL, action->job, action->pass, action->first_row);
}

static void take_audited(const struct action *action)
{
    struct pass *pass = pass_of(action);
    require(action->worker != action->about);
    require(pass->audited[action->first_row] && !pass->unsettled[action->first_row]);
    pass->unsettled[action->first_row] = true;
}

static void take_undo(const struct action *action)
{
    struct pass *pass = pass_of(action);
    pass->audited[action->first_row] = pass->unsettled[action->first_row] = pass->settled[action->first_row] = false;
    for (uint32_t row = action->first_row; row < action->first_row + action->rows; row++) {
        require(pass->accepted[row]);
        pass->accepted[row] = false;
        pass->left++;
    }
}

static void begin_job(uint32_t job, uint32_t rows, uint32_t survey_rows)
{
    run.jobs[job].passes[PASS_SURVEY] = (struct pass){.rows = survey_rows, .left = survey_rows};
    run.jobs[job].passes[PASS_RENDER] = (struct pass){.rows = rows, .left = rows};
    run.jobs[job].survey_rows = survey_rows;
    run.jobs[job].surveyed = survey_rows == 0;
}

static void take_restart(const struct action *action)
{
    require(action->job < run.job_count && !run.jobs[action->job].over);
    begin_job(action->job, run.jobs[action->job].passes[PASS_RENDER].rows, run.jobs[action->job].survey_rows);
}

static void check_settled(const struct pass *pass)
{
    for (uint32_t row = 0; row < pass->rows; row++)
        require(!pass->audited[row]);
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
    if (action->kind != ACTION_FAIL)
        check_settled(&run.jobs[action->job].passes[action->kind == ACTION_DONE ? PASS_RENDER : PASS_SURVEY]);
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
        require(is_worker(action->worker));
        run.workers[action->worker].wants_none = true;
        break;
    case ACTION_AUDITED:
        take_audited(action);
        break;
    case ACTION_UNDO:
        take_undo(action);
        break;
    case ACTION_RESTART:
        take_restart(action);
        break;
    case ACTION_NEED_TRUSTED:
        break;
    default:
        require(is_worker(action->worker)); /* a message to it */
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
    begin_job(job, rows, survey_rows);
    handle((struct event){.kind = EVENT_JOB, .rows = rows, .survey_rows = survey_rows});
}

static void add_worker(uint32_t threads, uint32_t credit, bool trusted)
{
    if (run.worker_count == WORKERS_MAX)
        return;
    uint32_t worker = ++run.worker_count;
    run.workers[worker].credit = credit;
    handle((struct event){.kind = EVENT_JOIN, .worker = worker, .threads = threads, .credit = credit,
                          .trusted = trusted});
}

/* Any lease that was granted, or one that never was. */
static void return_result(uint32_t worker, size_t lease)
{
    uint64_t number = lease < run.lease_count ? run.leases[lease].number : UINT64_MAX - lease;
    handle((struct event){.kind = EVENT_RESULT, .worker = worker, .lease = number});
}

static void leave(enum event_kind kind, uint32_t worker)
{
    if (is_worker(worker))
        run.workers[worker].wants_none = true;
    handle((struct event){.kind = kind, .worker = worker});
}

static void say_of_audit(enum event_kind kind, uint32_t number, uint32_t first_row)
{
    if (number >= run.job_count)
        return;
    enum render_pass pass_kind = run.jobs[number].surveyed ? PASS_RENDER : PASS_SURVEY;
    struct pass *pass = &run.jobs[number].passes[pass_kind];
    pass->settled[first_row] |= pass->unsettled[first_row] && kind == EVENT_SETTLED;
    pass->audited[first_row] &= !pass->unsettled[first_row] || kind == EVENT_JUDGE;
    pass->unsettled[first_row] = false;
    handle((struct event){.kind = kind, .job = number, .pass = pass_kind, .first_row = first_row});
}

static void pass_time(int64_t ms)
{
    run.now_ms += ms;
    handle((struct event){.kind = EVENT_TICK});
}

/* Takes a step; false if the letter is none. */
static bool step(char what, unsigned x, unsigned y)
{
    switch (what) {
    case 'J':
        add_job(1 + x, y);
        return true;
    case 'w':
    case 'W':
        add_worker(1 + x, 1 + y, what == 'W');
        return true;
    case 'R':
        handle((struct event){.kind = EVENT_READY, .worker = 1 + x, .job = y});
        return true;
    case 'r':
        return_result(1 + x, y);
        return true;
    case 'B':
        handle((struct event){.kind = EVENT_BEAT, .worker = 1 + x});
        return true;
    case 'D':
        leave(EVENT_DRAIN, 1 + x);
        return true;
    case 'L':
        leave(EVENT_LEAVE, 1 + x);
        return true;
    case 'X':
        leave(EVENT_LOST, 1 + x);
        return true;
    case 'Z':
        run.has_liars = true;
        handle((struct event){.kind = EVENT_LIAR, .worker = (1 + x) % SCRIPT_NUMBERS});
        return true;
    case 'A':
        run.audited_rows = x;
        return true;
    case 'S':
    case 'G':
        say_of_audit(what == 'S' ? EVENT_SETTLED : EVENT_JUDGE, x, y);
        return true;
    case 't':
        pass_time(y == 1 ? x * 256 : x);
        return true;
    default:
        return false;
    }
}

/* Rows are dear by turns; how dear, the context says. */
static const double *expected_work(void *context, uint32_t job)
{
    static double sums[SCRIPT_NUMBERS + 1];
    for (uint32_t row = 0; row < SCRIPT_NUMBERS; row++)
        sums[row + 1] = sums[row] + (row + job) / 8 % 2 * *(double *)context;
    return sums;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct script_reader reader = {step, NULL};
    double dear = (double)(size / 8 % 4);
    const struct scheduler_policy policy = {
        .band_rows = size % 4, .silence_ms = SILENCE_MS, .audits = is_audited,
        .expects = size / 4 % 2 ? expected_work : NULL, .expects_context = &dear};
    memset(&run, 0, sizeof run);
    run.scheduler = scheduler_create(&policy);
    for (size_t at = 0; at < size;)
        at += script_take(&reader, data + at, size - at);
    scheduler_destroy(&run.scheduler);
    free(run.leases);
    return 0;
}
