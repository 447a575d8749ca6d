/*
 * What simulations share: histories that are functions of a seed alone, the draws in them, their virtual clock, and
 * queues of what is to happen. A failure, a failed assertion and a sanitizer's report name the seed.
 *
 * A program replays one history with its seed as the argument. SEEDS=1000 FIRST_SEED=7 in the environment runs others
 * than the program does by itself.
 */
#ifndef WEFT_TESTS_HISTORY_H
#define WEFT_TESTS_HISTORY_H

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/hash.h"
#include "base/memory.h"
#include "tests/sanitized.h"

#ifdef SANITIZED
#include <sanitizer/common_interface_defs.h>
#endif

/* The one being lived through. */
static struct {
    uint32_t seed, draws;
    int64_t now_ms;
} history;

static inline void __attribute__((format(printf, 2, 3))) require(bool condition, const char *format, ...)
{
    if (condition)
        return;
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    fail_msg("seed %u at %lld ms: %s", history.seed, (long long)history.now_ms, text);
}

/* low <= n <= high */
static inline uint32_t draw(uint32_t low, uint32_t high)
{
    return low + hash_u32(hash_u32(history.seed) ^ hash_u32(++history.draws)) % (high - low + 1);
}

static inline bool chance(uint32_t percent)
{
    return draw(0, 99) < percent;
}

/* --- what is to happen ------------------------------------------------------------------------------------ */

/* Things of one kind by their times; those of one time in the order in which they were put. All zero is empty. */
struct queue {
    struct queue_entry {
        int64_t at_ms;
        uint64_t turn;
        void *thing;
    } *entries; /* a heap: entry i comes before 2 i + 1 and 2 i + 2 */
    size_t count, capacity;
    uint64_t turns;
};

static inline bool queue_precedes(const struct queue_entry *a, const struct queue_entry *b)
{
    return a->at_ms < b->at_ms || (a->at_ms == b->at_ms && a->turn < b->turn);
}

static inline void queue_swap(struct queue *queue, size_t a, size_t b)
{
    struct queue_entry entry = queue->entries[a];
    queue->entries[a] = queue->entries[b];
    queue->entries[b] = entry;
}

/* Copies the thing, `size` bytes. */
static inline void queue_put(struct queue *queue, int64_t at_ms, const void *thing, size_t size)
{
    queue->entries = memory_grow(queue->entries, &queue->capacity, queue->count + 1, sizeof *queue->entries);
    size_t i = queue->count++;
    queue->entries[i] = (struct queue_entry){at_ms, queue->turns++, memory_array(1, size)};
    memcpy(queue->entries[i].thing, thing, size);
    for (; i > 0 && queue_precedes(&queue->entries[i], &queue->entries[(i - 1) / 2]); i = (i - 1) / 2)
        queue_swap(queue, i, (i - 1) / 2);
}

/* When the next one is due; INT64_MAX: there is none. */
static inline int64_t queue_next_ms(const struct queue *queue)
{
    return queue->count > 0 ? queue->entries[0].at_ms : INT64_MAX;
}

/* Takes the next one, of which there must be one. */
static inline void queue_take(struct queue *queue, void *thing, size_t size)
{
    memcpy(thing, queue->entries[0].thing, size);
    free(queue->entries[0].thing);
    queue->entries[0] = queue->entries[--queue->count];
    for (size_t i = 0, next; (next = 2 * i + 1) < queue->count; i = next) {
        if (next + 1 < queue->count && queue_precedes(&queue->entries[next + 1], &queue->entries[next]))
            next++;
        if (queue_precedes(&queue->entries[i], &queue->entries[next]))
            break;
        queue_swap(queue, i, next);
    }
}

static inline void queue_finish(struct queue *queue)
{
    for (size_t i = 0; i < queue->count; i++)
        free(queue->entries[i].thing);
    free(queue->entries);
    *queue = (struct queue){0};
}

/* --- which histories -------------------------------------------------------------------------------------- */

static struct {
    uint32_t first, count;
} seeds;

static inline uint32_t seeds_number(const char *text, uint32_t otherwise)
{
    return text ? (uint32_t)strtoul(text, NULL, 10) : otherwise;
}

/* As the arguments and the environment say, else `count` from 1 on. */
static inline void seeds_choose(int argc, char **argv, uint32_t count)
{
    seeds.first = seeds_number(argc > 1 ? argv[1] : getenv("FIRST_SEED"), 1);
    seeds.count = argc > 1 ? 1 : seeds_number(getenv("SEEDS"), count);
}

static inline void seeds_say(void)
{
    char text[64];
    int length = snprintf(text, sizeof text, "in seed %u at %lld ms\n", history.seed, (long long)history.now_ms);
    if (write(STDERR_FILENO, text, (size_t)length) < 0)
        return;
}

static inline void seeds_say_and_die(int signal_number)
{
    seeds_say();
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

/* Lives through the chosen histories, in a test. */
static inline void seeds_run(void (*live)(void))
{
    signal(SIGABRT, seeds_say_and_die);
#ifdef SANITIZED
    __sanitizer_set_death_callback(seeds_say);
#else
    signal(SIGSEGV, seeds_say_and_die);
#endif
    for (uint32_t i = 0; i < seeds.count; i++) {
        history.seed = seeds.first + i;
        history.draws = 0;
        history.now_ms = 0;
        live();
    }
}

#endif
