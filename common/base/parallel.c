#include "base/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/memory.h"

struct loop {
    void (*run)(void *context, size_t index);
    void *context;
    size_t count;
    atomic_size_t next;
};

static void *take_turns(void *argument)
{
    struct loop *loop = argument;
    for (size_t i = atomic_fetch_add(&loop->next, 1); i < loop->count; i = atomic_fetch_add(&loop->next, 1))
        loop->run(loop->context, i);
    return NULL;
}

void parallel_for(int threads, size_t count, void (*run)(void *context, size_t index), void *context)
{
    struct loop loop = {.run = run, .context = context, .count = count};
    size_t wanted = threads < 1 ? 0 : (size_t)threads - 1, started = 0;
    if (wanted >= count)
        wanted = count ? count - 1 : 0;
    pthread_t *helpers = memory_array(wanted, sizeof *helpers);
    while (started < wanted && pthread_create(&helpers[started], NULL, take_turns, &loop) == 0)
        started++;
    take_turns(&loop);
    for (size_t i = 0; i < started; i++)
        pthread_join(helpers[i], NULL);
    free(helpers);
}
