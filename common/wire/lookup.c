#include "wire/lookup.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include "base/memory.h"

/* Between two searches; doubled each time. A name may appear at any moment, as that of a container that starts. */
enum { PAUSE_FIRST_MS = 250, PAUSE_MAX_MS = 4000 };

/* Shared by the thread and its owner; the last of them frees it. */
struct lookup {
    char *host;
    int bell; /* rung at each news */
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t changed;
    int holders;
    bool ended; /* nobody waits for it any more */
    enum lookup_news news;
    int failure;
    char address[INET_ADDRSTRLEN];
};

static void init_waiting(struct lookup *lookup)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&lookup->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&lookup->lock, NULL);
}

static void let_go(struct lookup *lookup)
{
    pthread_mutex_lock(&lookup->lock);
    bool last = --lookup->holders == 0;
    pthread_mutex_unlock(&lookup->lock);
    if (!last)
        return;
    if (lookup->bell >= 0)
        close(lookup->bell);
    pthread_cond_destroy(&lookup->changed);
    pthread_mutex_destroy(&lookup->lock);
    free(lookup->host);
    free(lookup);
}

/* --- the thread ------------------------------------------------------------------------------------------- */

/* As getaddrinfo returns: 0 with the address. */
static int search(const char *host, char address[INET_ADDRSTRLEN])
{
    static const struct addrinfo wanted = {.ai_family = AF_INET, .ai_socktype = SOCK_STREAM};
    struct addrinfo *found;
    int failure = getaddrinfo(host, NULL, &wanted, &found);
    if (failure != 0)
        return failure;
    struct sockaddr_in first;
    memcpy(&first, found->ai_addr, sizeof first);
    inet_ntop(AF_INET, &first.sin_addr, address, INET_ADDRSTRLEN);
    freeaddrinfo(found);
    return 0;
}

/* With the lock held. */
static void pause_search(struct lookup *lookup, int pause_ms)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += pause_ms % 1000 * 1000000L;
    until.tv_sec += pause_ms / 1000 + until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    while (!lookup->ended && pthread_cond_timedwait(&lookup->changed, &lookup->lock, &until) == 0)
        continue;
}

static void *search_on(void *context)
{
    struct lookup *lookup = context;
    bool over = false;
    for (int pause_ms = PAUSE_FIRST_MS; !over; pause_ms = 2 * pause_ms < PAUSE_MAX_MS ? 2 * pause_ms : PAUSE_MAX_MS) {
        char address[INET_ADDRSTRLEN] = "";
        int failure = search(lookup->host, address);
        pthread_mutex_lock(&lookup->lock);
        lookup->news = failure == 0 ? LOOKUP_FOUND : LOOKUP_FAILED;
        lookup->failure = failure;
        memcpy(lookup->address, address, sizeof address);
        eventfd_write(lookup->bell, 1);
        if (failure != 0)
            pause_search(lookup, pause_ms);
        over = failure == 0 || lookup->ended;
        pthread_mutex_unlock(&lookup->lock);
    }
    let_go(lookup);
    return NULL;
}

/* --- its owner -------------------------------------------------------------------------------------------- */

static enum status start(struct lookup *lookup, struct error *error)
{
    pthread_t thread;
    if (lookup->bell < 0)
        return error_set(error, STATUS_FAILED, "cannot make an event descriptor: %s", strerror(errno));
    lookup->holders++;
    int failure = pthread_create(&thread, NULL, search_on, lookup);
    if (failure == 0) {
        pthread_detach(thread);
        return STATUS_OK;
    }
    lookup->holders--;
    return error_set(error, STATUS_FAILED, "cannot start a thread: %s", strerror(failure));
}

struct lookup *lookup_create(const char *host, struct error *error)
{
    struct lookup *lookup = memory_array(1, sizeof *lookup);
    *lookup = (struct lookup){.host = memory_string(host), .holders = 1,
                              .bell = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
    init_waiting(lookup);
    if (start(lookup, error) != STATUS_OK)
        lookup_destroy(&lookup);
    return lookup;
}

int lookup_descriptor(const struct lookup *lookup)
{
    return lookup->bell;
}

enum lookup_news lookup_take(struct lookup *lookup, int *failure, char address[INET_ADDRSTRLEN])
{
    eventfd_t rung;
    pthread_mutex_lock(&lookup->lock);
    enum lookup_news news = lookup->news;
    lookup->news = LOOKUP_NOTHING;
    *failure = lookup->failure;
    memcpy(address, lookup->address, INET_ADDRSTRLEN);
    eventfd_read(lookup->bell, &rung);
    pthread_mutex_unlock(&lookup->lock);
    return news;
}

void lookup_destroy(struct lookup **lookup)
{
    if (!*lookup)
        return;
    pthread_mutex_lock(&(*lookup)->lock);
    (*lookup)->ended = true;
    pthread_cond_signal(&(*lookup)->changed);
    pthread_mutex_unlock(&(*lookup)->lock);
    let_go(*lookup);
    *lookup = NULL;
}
