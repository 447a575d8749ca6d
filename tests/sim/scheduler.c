/*
 * The scheduler under a virtual clock, with workers of every kind: fast and slow ones, ones that die, fall
 * silent, leave, drain, hang while they still say that they live, answer late, twice, or what nobody asked. A
 * model beside it, which knows nothing of how the scheduler works, holds every action against its promises; one
 * honest worker is always there, so every job ends.
 *
 * `scheduler SEED` replays one history. SEEDS=1000 FIRST_SEED=7 in the environment runs others than the first 300.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/hash.h"
#include "base/memory.h"
#include "coordinator/scheduler.h"

enum {
    SILENCE_MS = 4500,
    BEAT_MS = 1000,
    WORKERS_MAX = 12,
    JOBS_MAX = 4,
    ROWS_MAX = 200,
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
};

struct worker {
    enum fate fate;
    bool present;                         /* in the scheduler's view */
    bool draining, fated;                 /* fated: its fate has come */
    bool announced[JOBS_MAX], ready[JOBS_MAX], ended[JOBS_MAX];
    uint32_t threads, credit, held;
    uint32_t ms_a_row;
    int64_t heard_ms, busy_until_ms;
    uint64_t progress;
};

/* All but the rows is of the present pass. */
struct job {
    enum render_pass pass;
    uint32_t rows[PASSES], accepted_rows;
    bool over;
    bool accepted[ROWS_MAX];
    uint8_t losses[ROWS_MAX]; /* by fault */
};

enum happening_kind { ARRIVES, JOINS, BEATS, FATE };

struct happening {
    enum happening_kind kind;
    int64_t at_ms;
    struct event event; /* ARRIVES; of the others only the worker */
};

/* One history; made anew from each seed. */
static struct world {
    uint32_t seed, draws;
    int64_t now_ms;
    bool deadly;
    struct scheduler *scheduler;
    struct action_list actions;
    struct worker workers[WORKERS_MAX + 1]; /* numbered from 1; 1 is the honest one */
    uint32_t worker_count;
    struct job jobs[JOBS_MAX];
    uint32_t job_count, jobs_begun, jobs_over;
    struct lease leases[LEASES_MAX];
    uint64_t lease_count;
    struct happening *happenings; /* in no order */
    size_t happening_count, happening_capacity;
} world;

/* What the histories held, over all seeds. */
static struct {
    unsigned surveyed, done, failed, expelled, stuck, revoked, late;
} tally;

static void __attribute__((format(printf, 2, 3))) require(bool condition, const char *format, ...)
{
    if (condition)
        return;
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    fail_msg("seed %u at %lld ms: %s", world.seed, (long long)world.now_ms, text);
}

/* low <= n <= high */
static uint32_t draw(uint32_t low, uint32_t high)
{
    return low + hash_u32(hash_u32(world.seed) ^ hash_u32(++world.draws)) % (high - low + 1);
}

static bool chance(uint32_t percent)
{
    return draw(0, 99) < percent;
}

static void happen(enum happening_kind kind, int64_t at_ms, struct event event)
{
    world.happenings = memory_grow(world.happenings, &world.happening_capacity, world.happening_count + 1,
                                   sizeof *world.happenings);
    world.happenings[world.happening_count++] = (struct happening){kind, at_ms, event};
}

/* --- the model: what the scheduler promised --------------------------------------------------------------- */

static void drop_worker(uint32_t number, bool by_fault)
{
    struct worker *w = &world.workers[number];
    w->present = false;
    w->held = 0;
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        struct lease *lease = &world.leases[i];
        if (lease->worker != number || lease->state != OPEN)
            continue;
        lease->state = LOST;
        struct job *job = &world.jobs[lease->job];
        for (uint32_t row = lease->first_row; row < lease->first_row + lease->rows; row++)
            job->losses[row] += by_fault;
    }
}

/* The bands of open leases are either the same or have no row in common. */
static void check_overlap(const struct action *a)
{
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        if (lease->state != OPEN || lease->job != a->job)
            continue;
        bool same = lease->first_row == a->first_row && lease->rows == a->rows;
        bool apart = lease->first_row + lease->rows <= a->first_row || a->first_row + a->rows <= lease->first_row;
        require(same || apart, "lease %llu cuts through a band", (unsigned long long)a->lease);
        require(!same || lease->worker != a->worker, "worker %u got a band twice", a->worker);
    }
}

static void check_announce(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    require(w->present && !w->draining, "announced to worker %u, which is not there", a->worker);
    require(!w->announced[a->job] && !world.jobs[a->job].over, "job %u announced again or too late", a->job);
    w->announced[a->job] = true;
}

static void check_grant(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    struct job *job = &world.jobs[a->job];
    require(a->lease == world.lease_count + 1 && a->lease < LEASES_MAX, "lease %llu", (unsigned long long)a->lease);
    require(w->present && !w->draining && w->ready[a->job], "worker %u cannot take a band", a->worker);
    require(w->held < w->credit, "worker %u got more than its credit", a->worker);
    require(a->pass == job->pass, "job %u is not at pass %d", a->job, (int)a->pass);
    require(!job->over && a->rows >= 1 && a->first_row + a->rows <= job->rows[a->pass], "rows outside of an open job");
    for (uint32_t row = a->first_row; row < a->first_row + a->rows; row++)
        require(!job->accepted[row], "row %u handed out again", row);
    check_overlap(a);
    w->held++;
    world.leases[++world.lease_count] = (struct lease){OPEN, a->worker, a->job, a->pass, a->first_row, a->rows};
}

static void check_accept(const struct action *a, const struct event *event)
{
    struct lease *lease = &world.leases[event->lease];
    struct job *job = &world.jobs[a->job];
    require(a->worker == event->worker && a->lease_ms >= 0, "accepted from another worker");
    require(event->kind == EVENT_RESULT && lease->state == OPEN && lease->worker == event->worker,
            "accepted what is not an answer");
    require(lease->job == a->job && lease->pass == a->pass && a->pass == job->pass, "accepted for another pass");
    require(lease->first_row == a->first_row && lease->rows == a->rows,
            "accepted other rows than were answered");
    for (uint32_t row = a->first_row; row < a->first_row + a->rows; row++) {
        require(!job->accepted[row], "row %u accepted twice", row);
        job->accepted[row] = true;
    }
    job->accepted_rows += a->rows;
    lease->state = ANSWERED;
    world.workers[lease->worker].held--;
}

static void check_revoke(const struct action *a)
{
    struct lease *lease = &world.leases[a->lease];
    require(a->lease <= world.lease_count && lease->state == OPEN && lease->worker == a->worker,
            "revoked what is not a lease of worker %u", a->worker);
    lease->state = REVOKED;
    world.workers[a->worker].held--;
    tally.revoked++;
}

static void check_expel(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    require(w->present, "worker %u expelled again", a->worker);
    if (a->stuck)
        require(w->fate == HANGS && w->fated, "worker %u expelled though it got on", a->worker);
    else
        require(world.now_ms - w->heard_ms >= SILENCE_MS, "worker %u expelled though it spoke", a->worker);
    drop_worker(a->worker, !a->stuck);
    *(a->stuck ? &tally.stuck : &tally.expelled) += 1;
}

/* Nothing of the survey is missing, and nothing of it is out any more. */
static void check_surveyed(const struct action *a)
{
    struct job *job = &world.jobs[a->job];
    require(!job->over && job->pass == PASS_SURVEY, "job %u is surveyed twice", a->job);
    require(job->accepted_rows == job->rows[PASS_SURVEY], "job %u surveyed with holes", a->job);
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        require(lease->job != a->job || lease->state != OPEN, "job %u: its survey is leased", a->job);
    }
    *job = (struct job){.pass = PASS_RENDER, .rows = {job->rows[PASS_SURVEY], job->rows[PASS_RENDER]}};
    tally.surveyed++;
}

static void check_over(const struct action *a)
{
    struct job *job = &world.jobs[a->job];
    require(!job->over, "job %u is over twice", a->job);
    job->over = true;
    world.jobs_over++;
    for (uint32_t row = a->first_row; a->kind == ACTION_FAIL && row < a->first_row + a->rows; row++)
        require(job->losses[row] >= SCHEDULER_LOSSES_MAX, "failed for row %u, lost %u times", row, job->losses[row]);
    require(a->kind == ACTION_FAIL ? a->pass == job->pass
                                   : job->pass == PASS_RENDER && job->accepted_rows == job->rows[PASS_RENDER],
            "job %u done with holes", a->job);
    *(a->kind == ACTION_FAIL ? &tally.failed : &tally.done) += 1;
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        const struct worker *w = &world.workers[i];
        require(!w->present || w->announced[a->job] == w->ended[a->job], "worker %u not told of the end", i);
    }
}

static void check_action(const struct action *a, const struct event *event)
{
    switch (a->kind) {
    case ACTION_ANNOUNCE:
        check_announce(a);
        break;
    case ACTION_GRANT:
        check_grant(a);
        break;
    case ACTION_ACCEPT:
        check_accept(a, event);
        break;
    case ACTION_ACK:
        require(event->kind == EVENT_RESULT && a->worker == event->worker && a->lease == event->lease, "a stray ack");
        break;
    case ACTION_REVOKE:
        check_revoke(a);
        break;
    case ACTION_END:
        require(!world.workers[a->worker].ended[a->job], "ended twice");
        world.workers[a->worker].ended[a->job] = true;
        break;
    case ACTION_EXPEL:
        check_expel(a);
        break;
    case ACTION_SURVEYED:
        check_surveyed(a);
        break;
    case ACTION_DONE:
    case ACTION_FAIL:
        check_over(a);
        break;
    }
}

/* Rows of open leases; `mark` gets them, one flag each. */
static uint32_t leased_rows(uint32_t job, bool mark[ROWS_MAX])
{
    uint32_t count = 0;
    memset(mark, 0, ROWS_MAX * sizeof *mark);
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        if (lease->state != OPEN || lease->job != job || mark[lease->first_row])
            continue;
        memset(mark + lease->first_row, true, lease->rows * sizeof *mark);
        count += lease->rows;
    }
    return count;
}

/* Between events: both sides count alike, nobody silent is left, and no row waits for a worker that has room. */
static void check_rest(void)
{
    bool mark[ROWS_MAX], room[JOBS_MAX] = {false};
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        const struct worker *w = &world.workers[i];
        require(scheduler_held(world.scheduler, i) == w->held, "worker %u holds other than %u", i, w->held);
        require(!w->present || world.now_ms - w->heard_ms < SILENCE_MS, "worker %u is silent and still there", i);
        for (uint32_t job = 0; job < world.jobs_begun; job++)
            room[job] |= w->present && !w->draining && w->ready[job] && w->held < w->credit;
    }
    for (uint32_t job = 0; job < world.jobs_begun; job++) {
        uint32_t leased = leased_rows(job, mark);
        const struct job *j = &world.jobs[job];
        require(leased == scheduler_rows_leased(world.scheduler, job), "job %u: other rows are leased", job);
        require(!j->over || leased == 0, "job %u is over and leased", job);
        require(j->over || !room[job] || j->accepted_rows + leased == j->rows[j->pass], "rows of job %u wait", job);
    }
    require(scheduler_deadline(world.scheduler) > world.now_ms, "the deadline is past");
}

/* --- the workers: what they answer ------------------------------------------------------------------------ */

/* Whether what the worker says comes through. */
static bool is_heard(const struct worker *w)
{
    return !w->fated || (w->fate != DIES && w->fate != SILENT && w->fate != LEAVES);
}

static void start_loading(const struct action *a)
{
    struct event event = {.kind = EVENT_READY, .worker = a->worker, .job = a->job};
    happen(ARRIVES, world.now_ms + draw(1, 800), event);
}

static void start_rendering(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    struct event event = {.kind = EVENT_RESULT, .worker = a->worker, .lease = a->lease};
    if (w->fate == HANGS && w->fated)
        return;
    int64_t from_ms = w->busy_until_ms > world.now_ms ? w->busy_until_ms : world.now_ms;
    w->busy_until_ms = from_ms + a->rows * w->ms_a_row * draw(50, 150) / 100 / w->threads;
    happen(ARRIVES, w->busy_until_ms + draw(1, 20), event);
    if (w->fate != REPEATS)
        return;
    happen(ARRIVES, w->busy_until_ms + draw(1, 3000), event); /* again */
    event.lease = draw(0, (uint32_t)a->lease + 3);            /* another's, or nobody's */
    if (event.lease > world.lease_count || world.leases[event.lease].worker != a->worker)
        happen(ARRIVES, world.now_ms + draw(1, 3000), event);
}

/* The worker may have sent the result before it hears that nobody wants it. */
static void stop_rendering(const struct action *a)
{
    for (size_t i = 0; i < world.happening_count; i++) {
        const struct happening *h = &world.happenings[i];
        if (h->kind == ARRIVES && h->event.kind == EVENT_RESULT && h->event.lease == a->lease && chance(50)) {
            world.happenings[i] = world.happenings[--world.happening_count];
            return;
        }
    }
}

static void tell(struct event event)
{
    struct worker *w = &world.workers[event.worker];
    if (event.kind == EVENT_JOB)
        world.jobs[world.jobs_begun++] = (struct job){.pass = event.survey_rows ? PASS_SURVEY : PASS_RENDER,
                                                      .rows = {event.survey_rows, event.rows}};
    if (w->present && event.kind != EVENT_TICK)
        w->heard_ms = world.now_ms;
    if (w->present && event.kind == EVENT_READY)
        w->ready[event.job] = w->announced[event.job];
    if (w->present && event.kind == EVENT_DRAIN)
        w->draining = true;
    if (w->present && (event.kind == EVENT_LOST || event.kind == EVENT_LEAVE))
        drop_worker(event.worker, event.kind == EVENT_LOST);
    if (event.kind == EVENT_RESULT && (!w->present || world.leases[event.lease % LEASES_MAX].state != OPEN))
        tally.late++;
    world.actions.count = 0;
    scheduler_handle(world.scheduler, &event, world.now_ms, &world.actions);
    for (size_t i = 0; i < world.actions.count; i++)
        check_action(&world.actions.items[i], &event);
    check_rest();
    for (size_t i = 0; i < world.actions.count; i++) {
        const struct action *a = &world.actions.items[i];
        if (a->kind == ACTION_ANNOUNCE)
            start_loading(a);
        if (a->kind == ACTION_GRANT)
            start_rendering(a);
        if (a->kind == ACTION_REVOKE)
            stop_rendering(a);
    }
}

static void worker_joins(uint32_t number)
{
    struct worker *w = &world.workers[number];
    w->present = true;
    w->heard_ms = world.now_ms;
    tell((struct event){.kind = EVENT_JOIN, .worker = number, .threads = w->threads, .credit = w->credit});
    happen(BEATS, world.now_ms + BEAT_MS, (struct event){.worker = number});
    uint32_t latest_ms = world.deadly || chance(50) ? 1500 : 10000;
    if (w->fate != HONEST && w->fate != REPEATS)
        happen(FATE, world.now_ms + draw(0, latest_ms), (struct event){.worker = number});
}

static void fate_comes(uint32_t number)
{
    struct worker *w = &world.workers[number];
    w->fated = true;
    if (w->fate == DIES) /* and the death is noticed, a little later */
        happen(ARRIVES, world.now_ms + draw(0, 50), (struct event){.kind = EVENT_LOST, .worker = number});
    if (w->fate == LEAVES)
        tell((struct event){.kind = EVENT_LEAVE, .worker = number});
    if (w->fate == DRAINS)
        tell((struct event){.kind = EVENT_DRAIN, .worker = number});
}

/* A drained worker that holds nothing goes with its next beat. */
static void worker_beats(uint32_t number)
{
    struct worker *w = &world.workers[number];
    if (!is_heard(w) || !w->present)
        return;
    bool empty = w->draining && w->held == 0;
    w->progress += w->busy_until_ms > world.now_ms && !(w->fate == HANGS && w->fated);
    tell((struct event){.kind = empty ? EVENT_LEAVE : EVENT_BEAT, .worker = number, .progress = w->progress});
    happen(BEATS, world.now_ms + BEAT_MS, (struct event){.worker = number});
}

/* Messages of a worker that is cut off are lost, or come much later. */
static void message_arrives(const struct happening *h)
{
    const struct worker *w = &world.workers[h->event.worker];
    bool lost = h->event.kind != EVENT_LOST && h->event.worker && !is_heard(w);
    if (!lost || (w->fate == LEAVES && chance(50)))
        tell(h->event);
    else if (w->fate == SILENT && w->present && chance(50))
        happen(ARRIVES, w->heard_ms + SILENCE_MS + draw(0, 3000), h->event);
    else if (w->fate == SILENT && !w->present)
        tell(h->event);
}

/* --- a history -------------------------------------------------------------------------------------------- */

/* In some worlds all but the honest worker die soon, so that bands are lost again and again. */
static void make_workers(void)
{
    world.worker_count = draw(1, WORKERS_MAX);
    world.deadly = chance(20);
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        struct worker *w = &world.workers[i];
        w->fate = i == 1 ? HONEST : world.deadly ? DIES : (enum fate)draw(0, FATES - 1);
        w->threads = draw(1, 4);
        w->credit = chance(50) ? 2 * w->threads : draw(1, 3);
        w->ms_a_row = chance(20) ? draw(500, 3000) : draw(1, 300);
        happen(JOINS, chance(50) ? draw(0, 20) : draw(0, 15000), (struct event){.worker = i});
    }
}

static void make_jobs(void)
{
    world.job_count = draw(1, JOBS_MAX);
    for (uint32_t i = 0; i < world.job_count; i++) {
        struct event event = {.kind = EVENT_JOB, .rows = chance(20) ? draw(1, 3) : draw(1, ROWS_MAX)};
        event.survey_rows = chance(40) ? 0 : chance(50) ? draw(1, 3) : draw(1, 40);
        happen(ARRIVES, chance(70) ? 0 : draw(0, 20000), event);
    }
}

static void make_world(uint32_t seed)
{
    struct action_list actions = world.actions;
    struct happening *happenings = world.happenings;
    size_t capacity = world.happening_capacity;
    world = (struct world){.seed = seed, .actions = actions, .happenings = happenings, .happening_capacity = capacity};
    world.scheduler = scheduler_create(&(struct scheduler_policy){chance(50) ? 0 : draw(1, 40), SILENCE_MS});
    make_workers();
    make_jobs();
}

static struct happening take_next(void)
{
    size_t next = 0;
    for (size_t i = 1; i < world.happening_count; i++)
        if (world.happenings[i].at_ms < world.happenings[next].at_ms)
            next = i;
    struct happening taken = world.happenings[next];
    world.happenings[next] = world.happenings[--world.happening_count];
    return taken;
}

static void step(void)
{
    struct happening h = take_next();
    int64_t deadline_ms = scheduler_deadline(world.scheduler);
    if (deadline_ms <= h.at_ms) {
        happen(h.kind, h.at_ms, h.event);
        world.now_ms = deadline_ms;
        tell((struct event){.kind = EVENT_TICK});
        return;
    }
    world.now_ms = h.at_ms;
    if (h.kind == ARRIVES)
        message_arrives(&h);
    else if (h.kind == JOINS)
        worker_joins(h.event.worker);
    else if (h.kind == BEATS)
        worker_beats(h.event.worker);
    else
        fate_comes(h.event.worker);
}

static void run(uint32_t seed)
{
    make_world(seed);
    while (world.jobs_over < world.job_count) {
        step();
        require(world.now_ms < END_MS, "still not done");
    }
    scheduler_destroy(&world.scheduler);
}

static uint32_t first_seed, seed_count;

static void test_histories(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < seed_count; i++)
        run(first_seed + i);
    print_message("# seeds %u to %u: %u jobs surveyed, %u done, %u failed, %u workers expelled, %u stuck, %u leases "
                  "revoked, "
                  "%u results too late\n",
                  first_seed, first_seed + seed_count - 1, tally.surveyed, tally.done, tally.failed, tally.expelled,
                  tally.stuck, tally.revoked, tally.late);
}

static uint32_t number_or(const char *text, uint32_t otherwise)
{
    return text ? (uint32_t)strtoul(text, NULL, 10) : otherwise;
}

static int finish(void **state)
{
    (void)state;
    scheduler_destroy(&world.scheduler);
    free(world.actions.items);
    free(world.happenings);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_histories)};
    first_seed = number_or(argc > 1 ? argv[1] : getenv("FIRST_SEED"), 1);
    seed_count = argc > 1 ? 1 : number_or(getenv("SEEDS"), 300);
    return cmocka_run_group_tests_name("scheduler simulation", tests, NULL, finish);
}
