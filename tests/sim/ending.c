/*
 * How a job ends that has one slow machine among fast ones: not more than one band's time on a fast machine later than
 * if all had been busy to the last moment, though the slow one takes ten times as long. (One band's time: of the
 * largest that was out when there were no more rows to hand out.) A virtual clock; messages take no time, bands what
 * their rows take, and a machine renders those it holds one after the other, with all its threads, in the order in
 * which it got them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/hash.h"
#include "coordinator/scheduler.h"

enum { MACHINES_MAX = 17, HELD_MAX = 64, ROWS = 1080, SLOWNESS = 10, SILENCE_MS = 4500,
       SLACK_MS = 150, /* the scheduler's clock counts milliseconds, and copies that gain less than 20 are not made */
       FIRST_ROWS = 4, /* of a worker's first bands, */
       CREDIT = 2,     /* of which it gets so many a thread, */
       NEWCOMER_BANDS = 32, /* and at first no more than so many, as from the dispatcher */
};

struct machine {
    int64_t us_a_unit; /* of a row's cost */
    struct action held[HELD_MAX]; /* in the order of their granting; the first is in work */
    int held_count;
    int64_t done_us; /* when the first will be answered */
};

static struct machine machines[MACHINES_MAX]; /* the last is the slow one */
static int machine_count;
static uint32_t cost[ROWS];
static struct scheduler *scheduler;
static struct action_list actions;
static int64_t now_us, last_band; /* the latter: cost of the most expensive band when the last rows were handed out */
static bool done;

static int64_t cost_of(const struct action *band)
{
    int64_t sum = 0;
    for (uint32_t row = band->first_row; row < band->first_row + band->rows; row++)
        sum += cost[row];
    return sum;
}

static void begin_first(struct machine *m)
{
    m->done_us = m->held_count > 0 ? now_us + cost_of(&m->held[0]) * m->us_a_unit : INT64_MAX;
}

static void drop(struct machine *m, uint64_t lease)
{
    for (int i = 0; i < m->held_count; i++) {
        if (m->held[i].lease != lease)
            continue;
        m->held_count--;
        memmove(m->held + i, m->held + i + 1, (size_t)(m->held_count - i) * sizeof *m->held);
        if (i == 0)
            begin_first(m);
        return;
    }
}

static void note_last_band(void)
{
    for (int i = 0; i < machine_count; i++)
        for (int k = 0; k < machines[i].held_count; k++)
            last_band = cost_of(&machines[i].held[k]) > last_band ? cost_of(&machines[i].held[k]) : last_band;
}

static void tell(struct event event)
{
    actions.count = 0;
    scheduler_handle(scheduler, &event, now_us / 1000, &actions);
    for (size_t i = 0; i < actions.count; i++) {
        const struct action *a = &actions.items[i];
        struct machine *m = &machines[a->worker ? a->worker - 1 : 0];
        if (a->kind == ACTION_REVOKE)
            drop(m, a->lease);
        done |= a->kind == ACTION_DONE;
        assert_true(a->kind != ACTION_EXPEL && a->kind != ACTION_FAIL);
        if (a->kind != ACTION_GRANT)
            continue;
        assert_true(m->held_count < HELD_MAX);
        m->held[m->held_count++] = *a;
        if (m->held_count == 1)
            begin_first(m);
        if (a->first_row + a->rows == ROWS && last_band == 0)
            note_last_band();
    }
}

static struct machine *next_machine(void)
{
    struct machine *next = &machines[0];
    for (int i = 1; i < machine_count; i++)
        if (machines[i].done_us < next->done_us)
            next = &machines[i];
    return next;
}

/* Answers, and beats of all every second in between. */
static void run(void)
{
    int64_t beat_us = now_us;
    uint64_t progress = 0;
    while (!done) {
        struct machine *m = next_machine();
        int64_t tick_us = scheduler_deadline(scheduler) * 1000, until = beat_us < m->done_us ? beat_us : m->done_us;
        if (tick_us > now_us && tick_us < until) {
            now_us = tick_us;
            tell((struct event){.kind = EVENT_TICK});
        } else if (beat_us < m->done_us) {
            now_us = beat_us;
            beat_us += 1000000;
            progress++;
            for (int i = 0; i < machine_count; i++)
                tell((struct event){.kind = EVENT_BEAT, .worker = (uint32_t)i + 1, .progress = progress});
        } else {
            now_us = m->done_us;
            uint64_t lease = m->held[0].lease;
            drop(m, lease);
            tell((struct event){.kind = EVENT_RESULT, .worker = (uint32_t)(m - machines) + 1, .lease = lease});
        }
    }
}

/* A row's cost in units: even, or ten times as much in the middle of the picture as elsewhere. */
static void make_rows(bool uneven)
{
    for (uint32_t row = 0; row < ROWS; row++)
        cost[row] = !uneven || (row > ROWS / 3 && row < ROWS / 2) ? 10 : 1 + hash_u32(row) % 2;
}

static int64_t render(int fast, uint32_t threads, int64_t us_a_unit)
{
    machine_count = fast + 1;
    scheduler = scheduler_create(&(struct scheduler_policy){.silence_ms = SILENCE_MS, .newcomer_bands = NEWCOMER_BANDS});
    now_us = 1000000;
    last_band = 0;
    done = false;
    tell((struct event){.kind = EVENT_JOB, .rows = ROWS});
    for (int i = 0; i < machine_count; i++) {
        machines[i] = (struct machine){.us_a_unit = us_a_unit * (i == fast ? SLOWNESS : 1), .done_us = INT64_MAX};
        tell((struct event){.kind = EVENT_JOIN, .worker = (uint32_t)i + 1, .threads = threads, .credit = CREDIT * threads});
    }
    for (int i = machine_count; i-- > 0;) /* the slow one first */
        tell((struct event){.kind = EVENT_READY, .worker = (uint32_t)i + 1});
    run();
    scheduler_destroy(&scheduler);
    return now_us - 1000000;
}

static void check(bool uneven, int fast, uint32_t threads, int64_t us_a_unit)
{
    int64_t total = 0, taken_us = render(fast, threads, us_a_unit);
    make_rows(uneven);
    for (uint32_t row = 0; row < ROWS; row++)
        total += cost[row];
    int64_t ideal_us = total * us_a_unit * SLOWNESS / (fast * SLOWNESS + 1), band_us = last_band * us_a_unit;
    print_message("# %s rows, %d fast machines of %u threads, %lld us a unit: %lld ms late, a band takes %lld ms\n",
                  uneven ? "uneven" : "even", fast, threads, (long long)us_a_unit,
                  (long long)(taken_us - ideal_us) / 1000, (long long)band_us / 1000);
    assert_true(taken_us - ideal_us <= band_us + SLACK_MS * 1000);
}

static void test_slow_machine(void **state)
{
    (void)state;
    static const int64_t us_a_unit[] = {200, 2000, 20000};
    for (int uneven = 0; uneven <= 1; uneven++) {
        make_rows(uneven);
        for (int fast = 1; fast < MACHINES_MAX; fast *= 2)
            for (uint32_t threads = 1; threads <= 16; threads *= 4)
                for (int i = 0; i < 3 && (fast + 1) * (int)threads * CREDIT * FIRST_ROWS <= ROWS; i++) /* work for all */
                    check(uneven, fast, threads, us_a_unit[i]);
    }
}

static int finish(void **state)
{
    (void)state;
    free(actions.items);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_slow_machine)};
    return cmocka_run_group_tests_name("the end of a job", tests, NULL, finish);
}
