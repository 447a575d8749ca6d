/*
 * The scheduler under a virtual clock, with workers of every kind: fast and slow ones, ones that die, fall
 * silent, leave, drain, hang while they still say that they live, answer late, twice, or what nobody asked. A
 * model beside it, which knows nothing of how the scheduler works, holds every action against its promises; one
 * honest worker is always there, so every job ends. Some worlds have audits, and workers that lie; there a trusted
 * worker comes when it is asked for.
 *
 * Which histories: tests/sim/history.h.
 */
#include "tests/sim/scheduler_oracle.h"

/* --- the workers: what they answer ------------------------------------------------------------------------ */

/* Whether what the worker says comes through. */
static bool is_heard(const struct worker *w)
{
    return !w->fated || (w->fate != DIES && w->fate != SILENT && w->fate != LEAVES);
}

static void start_loading(const struct action *a)
{
    struct event event = {.kind = EVENT_READY, .worker = a->worker, .job = a->job};
    happen(ARRIVES, history.now_ms + draw(1, 800), event);
}

static void start_rendering(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    struct event event = {.kind = EVENT_RESULT, .worker = a->worker, .lease = a->lease};
    if (w->fate == HANGS && w->fated)
        return;
    int64_t from_ms = w->busy_until_ms > history.now_ms ? w->busy_until_ms : history.now_ms;
    w->busy_until_ms = from_ms + a->rows * w->ms_a_row * draw(50, 150) / 100 / w->threads;
    happen(ARRIVES, w->busy_until_ms + draw(1, 20), event);
    if (w->fate != REPEATS)
        return;
    happen(ARRIVES, w->busy_until_ms + draw(1, 3000), event); /* again */
    event.lease = draw(0, (uint32_t)a->lease + 3);            /* another's, or nobody's */
    if (event.lease > world.lease_count || world.leases[event.lease].worker != a->worker)
        happen(ARRIVES, history.now_ms + draw(1, 3000), event);
}

/* The worker may have sent the result before it hears that nobody wants it. */
static void stop_rendering(const struct action *a)
{
    world.leases[a->lease].unsent = chance(50);
}

static void note_job(const struct event *event)
{
    uint32_t number = world.jobs_begun++;
    world.jobs[number] = (struct job){.pass = event->survey_rows ? PASS_SURVEY : PASS_RENDER,
                                      .rows = {event->survey_rows, event->rows}, .kept = event->kept_count > 0};
    for (size_t i = 0; i < event->kept_count; i++)
        note_band(number, event->kept[i].first_row, event->kept[i].rows, 0, chance(30));
}

/* What a liar alone found right is audited again. */
static void open_audits_of(uint32_t liar)
{
    for (uint32_t i = 0; i < world.jobs_begun; i++)
        for (uint32_t row = 0; liar > 0 && row < ROWS_MAX; row++) {
            struct job *job = &world.jobs[i];
            struct audit *audit = &job->audits[row];
            bool opens = !job->over && !audit->open && audit->last == liar && job->band_worker[row] != liar;
            audit->open |= opens;
            tally.reopened += opens;
        }
}

static void tell(struct event event)
{
    struct worker *w = &world.workers[event.worker];
    if (event.kind == EVENT_LIAR)
        open_audits_of(event.worker);
    if (event.kind == EVENT_JOB)
        note_job(&event);
    if (w->present && event.kind != EVENT_TICK && event.kind != EVENT_LIAR)
        w->heard_ms = history.now_ms;
    if (w->present && event.kind == EVENT_READY)
        w->ready[event.job] = w->announced[event.job];
    if (w->present && event.kind == EVENT_DRAIN)
        w->draining = true;
    if (w->present && (event.kind == EVENT_LOST || event.kind == EVENT_LEAVE))
        drop_worker(event.worker, event.kind == EVENT_LOST);
    if (event.kind == EVENT_RESULT && (!w->present || world.leases[event.lease % LEASES_MAX].state != OPEN))
        tally.late++;
    else if (event.kind == EVENT_RESULT)
        w->proven |= world.leases[event.lease].worker == event.worker;
    world.actions.count = 0;
    scheduler_handle(world.scheduler, &event, history.now_ms, &world.actions);
    for (size_t i = 0; i < world.actions.count; i++)
        check_action(&world.actions.items[i], &event);
    if (event.kind == EVENT_LIAR)
        check_liar(event.worker);
    check_rest(&event);
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

/* Lies differ from one another, so who lied is clear once somebody who is trusted has rendered the rows. */
static void caller_finds(const struct happening *h)
{
    struct event event = h->event;
    struct audit *audit = &world.jobs[event.job].audits[event.first_row];
    bool judged = false;
    if (world.jobs[event.job].over || !audit->unsettled || audit->turn != h->turn)
        return;
    for (uint32_t i = 1; i <= world.worker_count; i++)
        judged |= world.workers[i].trusted && (audit->renderers >> i & 1);
    for (uint32_t i = 0; judged && i <= world.worker_count; i++)
        if (audit->liars >> i & 1)
            tell((struct event){.kind = EVENT_LIAR, .worker = i});
    if (!audit->unsettled || audit->turn != h->turn)
        return; /* what it was about is undone */
    event.kind = audit->liars && !judged ? EVENT_JUDGE : EVENT_SETTLED;
    audit->judges = event.kind == EVENT_JUDGE;
    audit->open = audit->judges;
    audit->unsettled = false;
    if (!audit->open && event.pass == PASS_SURVEY)
        world.jobs[event.job].surveyors |= UINT64_C(1) << audit->last;
    tally.judged += audit->judges;
    tell(event);
}

static void worker_joins(uint32_t number)
{
    struct worker *w = &world.workers[number];
    w->present = true;
    w->heard_ms = history.now_ms;
    world.asked &= !w->trusted;
    tell((struct event){.kind = EVENT_JOIN, .worker = number, .machine = w->machine, .threads = w->threads,
                        .credit = w->credit, .trusted = w->trusted});
    happen(BEATS, history.now_ms + BEAT_MS, (struct event){.worker = number});
    uint32_t latest_ms = world.deadly || chance(50) ? 1500 : 10000;
    if (w->fate != HONEST && w->fate != REPEATS)
        happen(FATE, history.now_ms + draw(0, latest_ms), (struct event){.worker = number});
}

static void fate_comes(uint32_t number)
{
    struct worker *w = &world.workers[number];
    w->fated = true;
    if (w->fate == DIES) /* and the death is noticed, a little later */
        happen(ARRIVES, history.now_ms + draw(0, 50), (struct event){.kind = EVENT_LOST, .worker = number});
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
    w->progress += w->busy_until_ms > history.now_ms && !(w->fate == HANGS && w->fated);
    tell((struct event){.kind = empty ? EVENT_LEAVE : EVENT_BEAT, .worker = number, .progress = w->progress});
    happen(BEATS, history.now_ms + BEAT_MS, (struct event){.worker = number});
}

/* Messages of a worker that is cut off are lost, or come much later. */
static void message_arrives(const struct happening *h)
{
    const struct worker *w = &world.workers[h->event.worker];
    if (h->event.kind == EVENT_RESULT && world.leases[h->event.lease % LEASES_MAX].unsent)
        return;
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
    bool together = chance(70);
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        struct worker *w = &world.workers[i];
        w->fate = i == 1 ? HONEST : world.deadly ? DIES : (enum fate)draw(0, FATES - 1);
        w->trusted = (i == 1 && chance(50)) || chance(10);
        w->machine = w->trusted ? 1 : together ? draw(1, world.deadly ? 2 : MACHINES) : 0;
        w->lies = !w->trusted && i > 1 && world.audited > 0 && chance(30) ? draw(1, 100) : 0;
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
        world.kept[i] = (struct kept_rows){PASS_RENDER, 0, draw(1, event.rows)};
        if (event.survey_rows == 0 && chance(20)) {
            event.kept = &world.kept[i];
            event.kept_count = 1;
        }
        happen(ARRIVES, chance(70) ? 0 : draw(0, 20000), event);
    }
}

/* Anything, another thing every five seconds, and nothing at first. */
static const double *expected_work(void *context, uint32_t job)
{
    static double sums[ROWS_MAX + 1];
    uint32_t turn = (uint32_t)(history.now_ms / 5000);
    (void)context;
    for (uint32_t row = 0; row < ROWS_MAX; row++) {
        uint32_t hash = hash_u32(row / 7 + hash_u32(job + 1000 * turn));
        sums[row + 1] = sums[row] + (hash % 3 == 0 ? 0 : hash % 100);
    }
    return turn > 0 ? sums : NULL;
}

static void make_world(void)
{
    struct action_list actions = world.actions;
    world = (struct world){.actions = actions};
    world.newcomer_bands = chance(50) ? 0 : draw(1, 2);
    world.scheduler = scheduler_create(&(struct scheduler_policy){
        .band_rows = chance(50) ? 0 : draw(1, 40), .silence_ms = SILENCE_MS, .newcomer_bands = world.newcomer_bands,
        .audits = is_audited, .expects = chance(50) ? expected_work : NULL});
    world.audited = chance(50) ? 0 : chance(50) ? 100 : draw(1, 99);
    make_workers();
    make_jobs();
}

static void step(void)
{
    struct happening h;
    int64_t deadline_ms = scheduler_deadline(world.scheduler), next_ms = queue_next_ms(&world.happenings);
    if (deadline_ms <= next_ms) {
        history.now_ms = deadline_ms > history.now_ms ? deadline_ms : history.now_ms;
        tell((struct event){.kind = EVENT_TICK});
        return;
    }
    history.now_ms = next_ms;
    queue_take(&world.happenings, &h, sizeof h);
    if (h.kind == ARRIVES)
        message_arrives(&h);
    else if (h.kind == JOINS)
        worker_joins(h.event.worker);
    else if (h.kind == FINDS)
        caller_finds(&h);
    else if (h.kind == BEATS)
        worker_beats(h.event.worker);
    else
        fate_comes(h.event.worker);
}

static void live(void)
{
    make_world();
    while (world.jobs_over < world.job_count) {
        step();
        require(history.now_ms < END_MS, "still not done");
    }
    scheduler_destroy(&world.scheduler);
    queue_finish(&world.happenings);
}

static void test_histories(void **state)
{
    (void)state;
    seeds_run(live);
    print_message("# seeds %u to %u: %u jobs surveyed, %u done, %u failed, %u workers expelled, %u stuck, "
                  "%u leases revoked, %u results too late; %u bands audited, %u judged, %u liars expelled, %u bands "
                  "undone, %u jobs begun again, %u trusted workers asked for, %u audits opened again\n",
                  seeds.first, seeds.first + seeds.count - 1, tally.surveyed, tally.done, tally.failed, tally.expelled,
                  tally.stuck, tally.revoked, tally.late, tally.audited, tally.judged, tally.liars, tally.undone,
                  tally.restarted, tally.asked, tally.reopened);
}

static int finish(void **state)
{
    (void)state;
    scheduler_destroy(&world.scheduler);
    free(world.actions.items);
    queue_finish(&world.happenings);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_histories)};
    seeds_choose(argc, argv, 2000);
    return cmocka_run_group_tests_name("scheduler simulation", tests, NULL, finish);
}
