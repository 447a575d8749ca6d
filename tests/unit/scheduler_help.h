/*
 * What the tests of the scheduler share: histories written by hand; what it answers is compared as text.
 */
#ifndef WEFT_TESTS_SCHEDULER_HELP_H
#define WEFT_TESTS_SCHEDULER_HELP_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "coordinator/scheduler.h"

enum { SILENCE_MS = 4000 };

static struct scheduler *scheduler;
static struct action_list actions;
static int64_t now_ms;

static void start_with(struct scheduler_policy policy)
{
    scheduler_destroy(&scheduler);
    policy.silence_ms = SILENCE_MS;
    scheduler = scheduler_create(&policy);
    now_ms = 1000000;
}

static inline void start(uint32_t band_rows)
{
    start_with((struct scheduler_policy){.band_rows = band_rows});
}

static int finish(void **state)
{
    (void)state;
    scheduler_destroy(&scheduler);
    assert_null(scheduler);
    scheduler_destroy(&scheduler);
    free(actions.items);
    actions = (struct action_list){0};
    return 0;
}

/* "grant w1 j0 4+2 #7": to worker 1 rows 4 and 5 of job 0 under lease 7; those of its survey: "grant w1 s0 4+2 #7". */
static void describe(const struct action *a, char *text, size_t size)
{
    char pass = a->pass == PASS_SURVEY ? 's' : 'j';
    switch (a->kind) {
    case ACTION_ANNOUNCE:
        snprintf(text, size, "announce w%u j%u", a->worker, a->job);
        break;
    case ACTION_GRANT:
        snprintf(text, size, "grant w%u %c%u %u+%u #%llu", a->worker, pass, a->job, a->first_row, a->rows,
                 (unsigned long long)a->lease);
        break;
    case ACTION_ACCEPT:
        snprintf(text, size, "accept %c%u %u+%u", pass, a->job, a->first_row, a->rows);
        break;
    case ACTION_ACK:
        snprintf(text, size, "ack w%u #%llu", a->worker, (unsigned long long)a->lease);
        break;
    case ACTION_REVOKE:
        snprintf(text, size, "revoke w%u #%llu", a->worker, (unsigned long long)a->lease);
        break;
    case ACTION_END:
        snprintf(text, size, "end w%u j%u", a->worker, a->job);
        break;
    case ACTION_EXPEL:
        snprintf(text, size, "expel w%u%s", a->worker, a->liar ? ", which lied" : "");
        break;
    case ACTION_SURVEYED:
        snprintf(text, size, "surveyed j%u", a->job);
        break;
    case ACTION_DONE:
        snprintf(text, size, "done j%u", a->job);
        break;
    case ACTION_AUDITED:
        snprintf(text, size, "audited w%u %c%u %u+%u of w%u", a->worker, pass, a->job, a->first_row, a->rows, a->about);
        break;
    case ACTION_UNDO:
        snprintf(text, size, "undo %c%u %u+%u", pass, a->job, a->first_row, a->rows);
        break;
    case ACTION_RESTART:
        snprintf(text, size, "restart j%u", a->job);
        break;
    case ACTION_NEED_TRUSTED:
        snprintf(text, size, "need trusted");
        break;
    case ACTION_FAIL:
        snprintf(text, size, "fail %c%u %u+%u", pass, a->job, a->first_row, a->rows);
        break;
    }
}

static void tell(struct event event)
{
    actions.count = 0;
    scheduler_handle(scheduler, &event, now_ms, &actions);
    assert_true(event.kind != EVENT_TICK || scheduler_deadline(scheduler) > now_ms);
}

/* What is answered to the event, parted by ", ". */
static void expect(struct event event, const char *expected)
{
    char text[4096] = "";
    tell(event);
    for (size_t i = 0; i < actions.count; i++) {
        char one[80] = "";
        describe(&actions.items[i], one, sizeof one);
        strcat(strcat(text, i ? ", " : ""), one);
    }
    assert_string_equal(text, expected);
}

static struct event job(uint32_t rows)
{
    return (struct event){.kind = EVENT_JOB, .rows = rows};
}

static struct event join(uint32_t worker, uint32_t threads, uint32_t credit)
{
    return (struct event){.kind = EVENT_JOIN, .worker = worker, .threads = threads, .credit = credit};
}

static struct event ready(uint32_t worker, uint32_t number)
{
    return (struct event){.kind = EVENT_READY, .worker = worker, .job = number};
}

static struct event result(uint32_t worker, uint64_t lease)
{
    return (struct event){.kind = EVENT_RESULT, .worker = worker, .lease = lease};
}

static struct event plain(enum event_kind kind, uint32_t worker)
{
    return (struct event){.kind = kind, .worker = worker};
}

/* A job, and two workers of one thread that hold a band of it each, where there are rows for both. */
static inline void start_pair(uint32_t band_rows, uint32_t rows)
{
    start(band_rows);
    tell(job(rows));
    for (uint32_t worker = 1; worker <= 2; worker++)
        tell(join(worker, 1, 1));
    for (uint32_t worker = 1; worker <= 2; worker++)
        tell(ready(worker, 0));
}

#endif
