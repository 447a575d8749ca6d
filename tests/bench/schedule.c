/*
 * How well the scheduler keeps a farm busy, and what it takes for that: schedule [WORKERS SCENES ROWS ROW_MS]...
 *
 * The real scheduler under a virtual clock, with workers that only count time. A worker has one thread and holds two
 * bands; messages take some milliseconds each way, and a scene some time to load. Speeds are spread over 1 to 4, one
 * worker in twenty is ten times slower; they join within two seconds. Rows of a scene differ by up to ten times in what
 * they cost, neighbours little; ROW_MS is what the cheapest takes a worker of speed 1.
 *
 * The ideal is the time at which all the work is done if every worker works from its coming on and no work is done
 * twice; a picture's last row cannot be split, so for few rows and many workers nothing comes near it.
 */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "base/options.h"
#include "base/memory.h"
#include "coordinator/scheduler.h"
#include "tests/bench/bench.h"

enum {
    LATENCY_LEAST_US = 1000, /* of a message */
    LATENCY_MOST_US = 4000,
    LOAD_LEAST_US = 50000,   /* of a scene */
    LOAD_MOST_US = 200000,
    JOIN_SPREAD_US = 2000000,
    SLOW_EVERY = 20,
    TICK_US = 20000,         /* stands for the beats of many workers, which all make the scheduler look */
    NEWCOMER_BANDS = 32,     /* as from the dispatcher */
    KNOT_ROWS = 40,          /* rows between those whose costs are drawn */
    CREDIT = 2,
};

struct held {
    uint64_t lease;
    uint32_t job, first_row, rows;
};

struct machine {
    double speed;
    int64_t latency_us, join_us, load_us;
    struct held held[CREDIT]; /* in work is held[0] */
    uint32_t held_count;
    uint32_t turn;            /* counts what it began to work on */
    int64_t began_us;
};

enum happening_kind { ARRIVES, TOLD, FINISHES, TICKS };

struct happening {
    int64_t at_us;
    uint64_t number; /* of happenings at one time the earlier one comes first */
    enum happening_kind kind;
    uint32_t worker, turn;
    struct event event;   /* ARRIVES */
    struct action action; /* TOLD */
};

struct task {
    uint32_t workers, scenes, rows;
    double row_us; /* of the cheapest row */
};

struct world {
    struct task task;
    struct scheduler *scheduler;
    struct action_list actions;
    int64_t now_us;
    struct machine *machines; /* numbered from 1 */
    struct happening *heap;   /* the next first */
    size_t count, capacity;
    uint64_t numbers;
    uint32_t scenes_done;
    double work_us, wasted_us; /* of speed 1; wasted: on bands that another answered first */
    uint64_t events;
    double scheduler_seconds, worst_seconds; /* that the scheduler took, and for one event at most */
};

/* --- what is to come ------------------------------------------------------------------------------------------ */

static bool is_before(const struct happening *a, const struct happening *b)
{
    return a->at_us < b->at_us || (a->at_us == b->at_us && a->number < b->number);
}

static void push(struct world *w, struct happening happening)
{
    w->heap = memory_grow(w->heap, &w->capacity, w->count + 1, sizeof *w->heap);
    happening.number = w->numbers++;
    size_t at = w->count++;
    for (; at > 0 && is_before(&happening, &w->heap[(at - 1) / 2]); at = (at - 1) / 2)
        w->heap[at] = w->heap[(at - 1) / 2];
    w->heap[at] = happening;
}

static struct happening pop(struct world *w)
{
    struct happening first = w->heap[0], last = w->heap[--w->count];
    size_t at = 0;
    for (size_t child; (child = 2 * at + 1) < w->count; at = child) {
        if (child + 1 < w->count && is_before(&w->heap[child + 1], &w->heap[child]))
            child++;
        if (!is_before(&w->heap[child], &last))
            break;
        w->heap[at] = w->heap[child];
    }
    w->heap[at] = last;
    return first;
}

/* The worker says so to the scheduler, after so long. */
static void say(struct world *w, uint32_t worker, int64_t after_us, struct event event)
{
    event.worker = worker;
    push(w, (struct happening){.at_us = w->now_us + after_us + w->machines[worker].latency_us, .kind = ARRIVES,
                               .event = event});
}

/* --- workers -------------------------------------------------------------------------------------------------- */

/* Of speed 1. */
static double row_us(const struct world *w, uint32_t scene, uint32_t row)
{
    double low = random_between(row / KNOT_ROWS, scene, 0, 1), high = random_between(row / KNOT_ROWS + 1, scene, 0, 1);
    double between = (double)(row % KNOT_ROWS) / KNOT_ROWS;
    return w->task.row_us * pow(10, low + between * (high - low));
}

static void work(struct world *w, uint32_t worker)
{
    struct machine *m = &w->machines[worker];
    double took_us = 0;
    m->turn++;
    m->began_us = w->now_us;
    if (m->held_count == 0)
        return;
    for (uint32_t i = 0; i < m->held[0].rows; i++)
        took_us += row_us(w, m->held[0].job, m->held[0].first_row + i);
    push(w, (struct happening){.at_us = w->now_us + (int64_t)(took_us / m->speed), .kind = FINISHES, .worker = worker,
                               .turn = m->turn});
}

static void drop_held(struct machine *m, uint32_t at)
{
    m->held_count--;
    for (uint32_t i = at; i < m->held_count; i++)
        m->held[i] = m->held[i + 1];
}

static void finish_band(struct world *w, const struct happening *happening)
{
    struct machine *m = &w->machines[happening->worker];
    if (happening->turn != m->turn)
        return;
    say(w, happening->worker, 0, (struct event){.kind = EVENT_RESULT, .lease = m->held[0].lease});
    drop_held(m, 0);
    work(w, happening->worker);
}

static void forget_band(struct world *w, uint32_t worker, uint64_t lease)
{
    struct machine *m = &w->machines[worker];
    uint32_t at = 0;
    while (at < m->held_count && m->held[at].lease != lease)
        at++;
    if (at == m->held_count)
        return;
    drop_held(m, at);
    if (at > 0)
        return;
    w->wasted_us += (double)(w->now_us - m->began_us) * m->speed;
    work(w, worker);
}

static void hear(struct world *w, const struct action *action)
{
    struct machine *m = &w->machines[action->worker];
    switch (action->kind) {
    case ACTION_ANNOUNCE:
        say(w, action->worker, m->load_us, (struct event){.kind = EVENT_READY, .job = action->job});
        break;
    case ACTION_GRANT:
        m->held[m->held_count++] = (struct held){action->lease, action->job, action->first_row, action->rows};
        if (m->held_count == 1)
            work(w, action->worker);
        break;
    case ACTION_REVOKE:
        forget_band(w, action->worker, action->lease);
        break;
    default:
        break;
    }
}

/* --- the coordinator ------------------------------------------------------------------------------------------ */

/* What is for a worker is on its way. A band counts against a worker's credit until its answer has come, and what is
 * revoked is heard before what is granted instead, so nobody's hands are ever too full. */
static void carry_out(struct world *w, const struct action *action)
{
    if (action->kind == ACTION_DONE)
        w->scenes_done++;
    else if (action->worker > 0)
        push(w, (struct happening){.at_us = w->now_us + w->machines[action->worker].latency_us, .kind = TOLD,
                                   .action = *action});
}

static void tell(struct world *w, const struct event *event)
{
    double start = bench_thread_seconds();
    w->actions.count = 0;
    scheduler_handle(w->scheduler, event, w->now_us / 1000, &w->actions);
    double took = bench_thread_seconds() - start;
    w->events++;
    w->scheduler_seconds += took;
    w->worst_seconds = fmax(w->worst_seconds, took);
    for (size_t i = 0; i < w->actions.count; i++)
        carry_out(w, &w->actions.items[i]);
}

static void happen(struct world *w, const struct happening *happening)
{
    w->now_us = happening->at_us;
    switch (happening->kind) {
    case ARRIVES:
        tell(w, &happening->event);
        break;
    case TOLD:
        hear(w, &happening->action);
        break;
    case FINISHES:
        finish_band(w, happening);
        break;
    case TICKS:
        tell(w, &(struct event){.kind = EVENT_TICK});
        push(w, (struct happening){.at_us = w->now_us + TICK_US, .kind = TICKS});
        break;
    }
}

/* --- a run ---------------------------------------------------------------------------------------------------- */

static void add_machines(struct world *w)
{
    w->machines = memory_array(w->task.workers + 1, sizeof *w->machines);
    for (uint32_t i = 1; i <= w->task.workers; i++) {
        struct machine *m = &w->machines[i];
        *m = (struct machine){
            .speed = pow(4, random_between(i, 100, 0, 1)) / (i % SLOW_EVERY == 0 ? 10 : 1),
            .latency_us = (int64_t)random_between(i, 101, LATENCY_LEAST_US, LATENCY_MOST_US),
            .load_us = (int64_t)random_between(i, 102, LOAD_LEAST_US, LOAD_MOST_US),
            .join_us = (int64_t)random_between(i, 103, 0, JOIN_SPREAD_US),
        };
        say(w, i, m->join_us, (struct event){.kind = EVENT_JOIN, .threads = 1, .credit = CREDIT});
    }
}

static void add_scenes(struct world *w)
{
    for (uint32_t scene = 0; scene < w->task.scenes; scene++) {
        for (uint32_t row = 0; row < w->task.rows; row++)
            w->work_us += row_us(w, scene, row);
        tell(w, &(struct event){.kind = EVENT_JOB, .rows = w->task.rows});
    }
}

/* By halving: the work that can be done up to a time grows with it. */
static double ideal_us(const struct world *w)
{
    double low = 0, high = JOIN_SPREAD_US + 1000 * w->work_us;
    for (int step = 0; step < 100; step++) {
        double until = (low + high) / 2, done = 0;
        for (uint32_t i = 1; i <= w->task.workers; i++)
            done += w->machines[i].speed * fmax(0, until - (double)w->machines[i].join_us);
        if (done < w->work_us)
            low = until;
        else
            high = until;
    }
    return high;
}

static void run(struct task task)
{
    struct world w = {.task = task, .scheduler = scheduler_create(&(struct scheduler_policy){
        .silence_ms = INT32_MAX, .newcomer_bands = NEWCOMER_BANDS})};
    add_scenes(&w);
    add_machines(&w);
    push(&w, (struct happening){.kind = TICKS});
    while (w.scenes_done < task.scenes) {
        struct happening next = pop(&w);
        happen(&w, &next);
    }
    double ideal = ideal_us(&w);
    printf("%7u  %6u  %5u  %7.0f  %7.2f  %7.2f  %10.1f  %8.1f  %8" PRIu64 "  %8.1f  %8.2f\n", task.workers, task.scenes,
           task.rows, 1e-3 * task.row_us, 1e-6 * ideal, 1e-6 * (double)w.now_us, 100 * ideal / (double)w.now_us,
           100 * w.wasted_us / w.work_us, w.events, 1e6 * w.scheduler_seconds / (double)w.events,
           1e3 * w.worst_seconds);
    fflush(stdout);
    free(w.heap);
    free(w.machines);
    free(w.actions.items);
    scheduler_destroy(&w.scheduler);
}

int main(int argc, char **argv)
{
    static const struct task usual[] = {{100, 20, 1080, 1e4}, {1000, 1, 1080, 1e5}, {1000, 20, 1080, 1e5}};
    struct error error;
    if (argc % 4 != 1) {
        fprintf(stderr, "usage: schedule [WORKERS SCENES ROWS ROW_MS]...\n");
        return STATUS_USAGE;
    }
    printf("workers  scenes   rows   row ms  ideal s   took s  efficiency%%  wasted%%    events  us/event  worst ms\n");
    for (size_t i = 0; argc == 1 && i < sizeof usual / sizeof *usual; i++)
        run(usual[i]);
    for (int i = 1; i < argc; i += 4) {
        int64_t n[4];
        for (int k = 0; k < 4; k++)
            if (options_integer("an argument", argv[i + k], 1, 100000, &n[k], &error) != STATUS_OK) {
                fprintf(stderr, "schedule: %s\n", error.text);
                return STATUS_USAGE;
            }
        run((struct task){(uint32_t)n[0], (uint32_t)n[1], (uint32_t)n[2], 1e3 * (double)n[3]});
    }
    return 0;
}
