/*
 * Whole farms under a virtual clock: one real dispatcher with real jobs, whose files are written (coordinator.h), and
 * real sessions (worker_loop.h), over a network that delays and cuts (network.h). Workers are slow, hang, are stopped,
 * die and come again, drain, cannot load, lie (lies.h), or, where all bands are audited, render wrong bytes. The
 * coordinator itself is stopped, or dies and is started again, or another one follows it. Whatever happens, the files
 * are those that a render without a farm gives (pictures.h), or the dispatcher says why not, and that only once three
 * workers were lost; one honest worker is always there, so every job ends.
 *
 * Evil on the way can be told where it breaks a message, its header, or an asset (by its digest). A JOB, BAND or RESULT
 * whose fields were altered can still fit: then nothing is promised of the picture. CURVE keeps such away.
 */
#include "base/log.h"
#include "tests/sim/coordinator.h"
#include "tests/sim/lies.h"
#include "tests/sim/worker_loop.h"

enum {
    AFTERMATH_MS = 40000, /* all that were stopped go on by then, and all silence has been noticed */
    STEPS_MAX = 100000,   /* at one time */
};

static bool evil, aftermath;
static uint32_t steps; /* since time went on */

/* Nothing here outlives the program, so nothing needs to be brought to disk. */
int fsync(int descriptor)
{
    (void)descriptor;
    return 0;
}

int fdatasync(int descriptor)
{
    (void)descriptor;
    return 0;
}

/* --- troubles --------------------------------------------------------------------------------------------- */

static void kill_worker(struct worker *w)
{
    size_t link = w->link;
    bool told = w->own && chance(70);
    if (!w->session)
        return;
    end_worker(w);
    if (link != NO_LINK && chance(50))
        network_cut(link); /* what it has sent did not leave the machine */
    if (told)
        happen(DEATH_IS_TOLD, 0, w->pid, history.now_ms + draw(0, 50));
    w->pid += 10;
    if (w->number == farm.judge || chance(80)) /* the coordinator starts its own again */
        happen(START, w->number, 0, history.now_ms + draw(0, 8000));
}

static void cut_off(struct worker *w)
{
    w->unreachable_ms = history.now_ms + draw(0, 15000);
    if (w->link != NO_LINK)
        network_cut(w->link);
}

static void hold(struct worker *w, bool up)
{
    struct link *link = w->link != NO_LINK ? &network.links[w->link] : NULL;
    if (link)
        network_hold(link, up ? &link->up : &link->down, history.now_ms + draw(100, 12000));
}

static void trouble_worker(struct worker *w)
{
    w->disturbed = true;
    switch (draw(0, 7)) {
    case 0:
    case 1:
        return cut_off(w);
    case 2:
    case 3:
        return hold(w, chance(50));
    case 4:
    case 5:
        return kill_worker(w);
    case 6:
        return stop_worker(w, history.now_ms + draw(100, 20000));
    default:
        drain_worker(w);
        if (w->number == farm.judge || chance(50))
            happen(START, w->number, 0, history.now_ms + draw(0, 8000));
    }
}

static void trouble_coordinator(void)
{
    if (!coordinator.dispatcher || coordinator.ending)
        return;
    if (chance(85))
        stop_coordinator(draw(100, 8000));
    else
        coordinator.crashed = true;
}

static void make_trouble(void)
{
    if (worker_count == 1 || chance(12))
        trouble_coordinator();
    else
        trouble_worker(&workers[draw(1, worker_count - 1)]);
}

static void take_lie(struct worker *w)
{
    if (w->session && !w->stopped && w->link != NO_LINK)
        tell_lie(w);
    if (!aftermath)
        happen(LIE, w->number, 0, history.now_ms + draw(1, 2000));
}

/* --- a history -------------------------------------------------------------------------------------------- */

static void take_happening(const struct happening *h)
{
    switch (h->kind) {
    case COORDINATOR_TURN:
        return coordinator_turn();
    case WORKER_TURN:
        return worker_turn(&workers[h->who]);
    case CONNECTION:
        return connection_is_made(&workers[h->who], h->tag);
    case START:
        if (farm.judge > 0 && h->who == farm.judge && workers[h->who].session) /* it drains: another one is to come */
            return happen(START, h->who, 0, history.now_ms + 1000);
        return start_worker(&workers[h->who]);
    case TROUBLE:
        return make_trouble();
    case CONTINUE:
        return continue_worker(&workers[h->who]);
    case DEATH_IS_TOLD:
        return tell_death(h->tag);
    case LIE:
        return take_lie(&workers[h->who]);
    case LATE_JOB:
        if (coordinator.dispatcher && !coordinator.ending && coordinator.jobs_added < coordinator.job_count)
            add_job();
    }
}

static void step(void)
{
    struct happening h;
    int64_t deadline_ms = coordinator_deadline(), next_ms = queue_next_ms(&happenings), before_ms = history.now_ms;
    history.now_ms = deadline_ms < next_ms ? deadline_ms : next_ms;
    steps = history.now_ms > before_ms ? 0 : steps + 1;
    require(steps < STEPS_MAX, "time does not go on");
    if (deadline_ms <= next_ms) {
        coordinator_turn();
        return;
    }
    queue_take(&happenings, &h, sizeof h);
    take_happening(&h);
}

static void run_until(int64_t end_ms)
{
    while (queue_next_ms(&happenings) < end_ms || coordinator_deadline() < end_ms)
        step();
    history.now_ms = end_ms;
}

/* Process numbers are of a host; the same ones occur on others. */
static void give_identity(struct worker *w)
{
    w->host = draw(0, 2);
    w->pid = 100;
    for (uint32_t i = 0; i < w->number; i++)
        w->pid += workers[i].host == w->host;
}

static void give_speed(struct worker *w)
{
    static const uint32_t delays[][2] = {{0, 2}, {0, 2}, {20, 200}, {100, 1500}};
    const uint32_t *delay = delays[draw(0, 3)];
    w->threads = draw(1, 4);
    w->credit = chance(50) ? 2 * w->threads : draw(1, 3);
    w->ms_a_row = draw(1, 600) * (chance(15) ? 10 : 1);
    w->load_ms = draw(0, 3000);
    w->low_ms = delay[0];
    w->high_ms = delay[1];
}

static void make_workers(bool calm)
{
    worker_count = draw(1, WORKERS_MAX - 1); /* and perhaps a judge */
    for (uint32_t i = 0; i < worker_count; i++) {
        struct worker *w = &workers[i];
        bool may_be_odd = i > 0 && !calm;
        *w = (struct worker){.number = i, .link = NO_LINK, .once = may_be_odd && chance(30)};
        give_identity(w);
        give_speed(w);
        w->hangs = may_be_odd && chance(15);
        w->unfit = may_be_odd && chance(5);
        w->stranger = may_be_odd && chance(5);
        w->liar = may_be_odd && chance(15);
        w->evil = may_be_odd && evil && chance(70) ? draw(1, 20) : 0;
        w->crooked = may_be_odd && farm.audits && chance(40);
        if (farm.audits && (w->liar || w->evil > 0 || w->crooked))
            w->host += 10 + i; /* its machine is left out with it */
        w->own = w->host == 0 && is_honest(w) && !w->crooked && (i == 0 || chance(50));
        w->disturbed = w->unfit || w->stranger || w->liar || w->crooked || w->evil > 0;
        happen(START, i, 0, chance(50) ? draw(0, 20) : draw(0, 15000));
        if (w->liar)
            happen(LIE, i, 0, draw(0, 5000));
    }
}

static void make_troubles(void)
{
    uint32_t span_ms = draw(1000, 30000);
    for (uint32_t i = draw(1, 12); i > 0; i--)
        happen(TROUBLE, 0, 0, draw(0, span_ms));
}

static void make_world(void)
{
    bool calm = chance(15);
    evil = !calm && chance(20);
    aftermath = false;
    network.flips = chance(50);
    memset(&farm, 0, sizeof farm);
    farm.audits = chance(25);
    memset(&coordinator, 0, sizeof coordinator);
    make_workers(calm);
    if (!calm)
        make_troubles();
}

/* Mostly the small ones. */
static const struct picture *draw_picture(void)
{
    uint32_t percent = draw(0, 99);
    return &pictures[percent < 50 ? 0 : percent < 80 ? 1 : percent < 95 ? 2 : 3];
}

static void choose_pictures(void)
{
    coordinator.job_count = chance(80) ? 1 : JOBS_MAX;
    for (uint32_t i = 0; i < JOBS_MAX; i++)
        farm.pictures[i] = draw_picture();
}

/* Who has a good connection has heard the goodbye. */
static void check_farewell(void)
{
    for (uint32_t i = 0; i < worker_count; i++)
        require(!workers[i].joined || workers[i].disturbed || 2 * workers[i].high_ms > GOODBYE_MS,
                "worker %u has heard no goodbye", i);
}

/* How long a render may take: what its first worker needs alone, with its ways to and fro, and some more, for that gets
 * bands that others keep only when these have had their time. Where all is audited the slowest may have to audit it. */
static int64_t patience_ms(void)
{
    const struct worker *w = &workers[0];
    int64_t rows = 0, ms_a_row = w->ms_a_row;
    for (uint32_t i = 1; i < worker_count && farm.audits; i++)
        ms_a_row = workers[i].ms_a_row > ms_a_row ? workers[i].ms_a_row : ms_a_row;
    for (uint32_t i = 0; i < coordinator.job_count; i++)
        rows += coordinator.jobs[i].settings.height + render_job_survey_rows(&coordinator.jobs[i]);
    return 120000 + 3 * rows * ms_a_row + 2 * rows * w->high_ms;
}

/* From the coordinator's start to its end. True if it came to one. */
static bool live_render(void)
{
    run_until(history.now_ms + (chance(70) ? 0 : draw(0, 10000)));
    start_coordinator();
    for (int64_t end_ms = history.now_ms + patience_ms(); !is_over();) {
        step();
        require(history.now_ms < end_ms, "still not done");
    }
    check_outcome();
    farm.disturbed = true;
    if (!coordinator.crashed) {
        coordinator.ending = true;
        dispatcher_say_goodbye(coordinator.dispatcher, history.now_ms);
        run_until(history.now_ms + GOODBYE_MS);
        check_farewell();
    }
    bool crashed = coordinator.crashed;
    end_coordinator();
    return !crashed;
}

/* Every worker knows that there is no coordinator, whether it was told or not. */
static void check_aftermath(void)
{
    for (uint32_t i = 0; i < worker_count; i++) {
        const struct worker *w = &workers[i];
        require(!w->session || w->said == MESSAGE_HELLO, "worker %u does not know that the coordinator is gone", i);
        require(!w->session || !w->draining, "worker %u was to end and has not", i);
    }
}

/* Workers that ended with one coordinator are there for the next, as are local ones. */
static void start_again(void)
{
    for (uint32_t i = 0; i < worker_count; i++)
        happen(START, i, 0, history.now_ms + draw(0, 3000));
}

static void live(void)
{
    make_world();
    choose_pictures();
    while (!live_render())
        start_again();
    if (chance(20)) {
        choose_pictures();
        start_again();
        while (!live_render())
            start_again();
    }
    aftermath = true;
    run_until(history.now_ms + AFTERMATH_MS);
    check_aftermath();
    tally.altered += farm.altered;
    for (uint32_t i = 0; i < worker_count; i++) {
        end_worker(&workers[i]);
        free(workers[i].bands);
        free(workers[i].owed);
    }
    for (uint32_t i = 0; i < JOBS_MAX; i++) /* of a render that failed */
        remove_journal(farm.pictures[i], job_files[i]);
    network_finish();
    queue_finish(&happenings);
}

static void test_histories(void **state)
{
    (void)state;
    seeds_run(live);
    print_message("# seeds %u to %u: %u renders, %u done, %u failed, %u coordinators died, %u pictures altered by "
                  "evil; %u workers joined, %u were lost or left; %u bands, %u audited; %u liars were found out\n",
                  seeds.first, seeds.first + seeds.count - 1, tally.renders, tally.done, tally.failed, tally.crashed,
                  tally.altered, tally.joined, tally.lost, tally.bands, tally.audited, tally.exposed);
}

static int start(void **state)
{
    (void)state;
    log_start("weft", LOG_SILENT);
    pictures_make();
    return 0;
}

static int finish(void **state)
{
    (void)state;
    pictures_finish();
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_histories)};
#ifdef SANITIZED
    seeds_choose(argc, argv, 400);
#else
    seeds_choose(argc, argv, 2000);
#endif
    return cmocka_run_group_tests_name("farms", tests, start, finish);
}
