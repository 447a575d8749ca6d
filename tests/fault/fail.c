/*
 * A library for LD_PRELOAD that makes one operation of a program fail, as operations do when memory, disk or
 * descriptors run out. Told by the environment:
 *
 *   WEFT_FAIL="PROGRAM KIND N [THREAD]"
 *                                the Nth operation of that kind (the table below) in a process of that program fails,
 *                                or of those of its threads whose names begin with THREAD; N = 0: none does, they are
 *                                counted
 *   WEFT_FAIL_NOTE=FILE          made when it fails, and where it is nothing fails any more: of all processes that
 *                                inherit the environment one has one failure; counts are added to it as lines
 *
 * Not with sanitizers, which have the allocator for themselves.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

enum kind { MEMORY, OPEN, WRITE, SYNC, NAME, DESCRIPTOR, SEND, RECEIVE, PROCESS, THREAD, KINDS };

static const char *const kinds[KINDS] = {
    [MEMORY] = "memory", [OPEN] = "open",       [WRITE] = "write",     [SYNC] = "sync",       [NAME] = "name",
    [SEND] = "send",     [RECEIVE] = "receive", [PROCESS] = "process", [THREAD] = "thread",
    [DESCRIPTOR] = "descriptor",
};

static enum kind chosen = KINDS; /* KINDS: none, in this program */
static long wanted;
static const char *note;
static char threads[16]; /* how their names begin */
static atomic_long count;

static void __attribute__((constructor)) start(void)
{
    char program[64], kind[16];
    const char *what = getenv("WEFT_FAIL");
    note = getenv("WEFT_FAIL_NOTE");
    if (!what || !note || sscanf(what, "%63s %15s %ld %15s", program, kind, &wanted, threads) < 3)
        return;
    if (strcmp(program, program_invocation_short_name) != 0)
        return;
    for (enum kind i = 0; i < KINDS; i++)
        if (strcmp(kind, kinds[i]) == 0)
            chosen = i;
}

#define NEXT(function) ((__typeof__(&(function)))dlsym(RTLD_NEXT, #function))

static void __attribute__((destructor)) tell_count(void)
{
    char line[32];
    if (chosen == KINDS || wanted != 0)
        return;
    int length = snprintf(line, sizeof line, "%ld\n", atomic_load(&count));
    int fd = NEXT(open)(note, O_WRONLY | O_CREAT | O_APPEND, 0666);
    if (fd < 0 || NEXT(write)(fd, line, (size_t)length) != length)
        abort();
    close(fd);
}

/* libpgm, which ZeroMQ may bring along, crashes when it cannot have memory as it starts; weft cannot mend that. */
static _Thread_local bool spared;

int pgm_init(void *error);
int pgm_init(void *error)
{
    spared = true;
    int result = NEXT(pgm_init)(error);
    spared = false;
    return result;
}

static bool is_of_thread(void)
{
    char name[16] = "";
    if (threads[0])
        prctl(PR_GET_NAME, name);
    return strncmp(name, threads, strlen(threads)) == 0;
}

/* Whether this operation is to fail; then errno is set to `number`. */
static bool fails(enum kind kind, int number)
{
    if (spared || kind != chosen || !is_of_thread() || atomic_fetch_add(&count, 1) + 1 != wanted)
        return false;
    int fd = NEXT(open)(note, O_WRONLY | O_CREAT | O_EXCL, 0666);
    if (fd < 0)
        return false;
    close(fd);
    errno = number;
    return true;
}

/* --- memory ----------------------------------------------------------------------------------------------- */

/* The C library's own, by the names that it gives them: dlsym may allocate. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t items, size_t size);
extern void *__libc_realloc(void *block, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

void *malloc(size_t size)
{
    return fails(MEMORY, ENOMEM) ? NULL : __libc_malloc(size);
}

void *calloc(size_t items, size_t size)
{
    return fails(MEMORY, ENOMEM) ? NULL : __libc_calloc(items, size);
}

void *realloc(void *block, size_t size)
{
    return fails(MEMORY, ENOMEM) ? NULL : __libc_realloc(block, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return fails(MEMORY, ENOMEM) ? NULL : __libc_memalign(alignment, size);
}

/* --- files ------------------------------------------------------------------------------------------------ */

/* Event descriptors and pipes are written to as well, and cannot be full. */
static bool is_file(int fd)
{
    struct stat info;
    return fd > STDERR_FILENO && fstat(fd, &info) == 0 && S_ISREG(info.st_mode);
}

static mode_t take_mode(int flags, va_list arguments)
{
    return flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
}

int open(const char *path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = take_mode(flags, arguments);
    va_end(arguments);
    return fails(OPEN, EMFILE) ? -1 : NEXT(open)(path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...)
{
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = take_mode(flags, arguments);
    va_end(arguments);
    return fails(OPEN, EMFILE) ? -1 : NEXT(openat)(folder, path, flags, mode);
}

int mkostemp(char *name, int flags)
{
    return fails(OPEN, EMFILE) ? -1 : NEXT(mkostemp)(name, flags);
}

ssize_t write(int fd, const void *data, size_t size)
{
    return is_file(fd) && fails(WRITE, ENOSPC) ? -1 : NEXT(write)(fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset)
{
    return is_file(fd) && fails(WRITE, ENOSPC) ? -1 : NEXT(pwrite)(fd, data, size, offset);
}

int ftruncate(int fd, off_t size)
{
    return fails(WRITE, ENOSPC) ? -1 : NEXT(ftruncate)(fd, size);
}

int fsync(int fd)
{
    return fails(SYNC, EIO) ? -1 : NEXT(fsync)(fd);
}

int fdatasync(int fd)
{
    return fails(SYNC, EIO) ? -1 : NEXT(fdatasync)(fd);
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags)
{
    return fails(NAME, EIO) ? -1 : NEXT(linkat)(from_folder, from, to_folder, to, flags);
}

int renameat(int from_folder, const char *from, int to_folder, const char *to)
{
    return fails(NAME, EIO) ? -1 : NEXT(renameat)(from_folder, from, to_folder, to);
}

/* --- descriptors that are no files ------------------------------------------------------------------------ */

int socket(int domain, int type, int protocol)
{
    return fails(DESCRIPTOR, EMFILE) ? -1 : NEXT(socket)(domain, type, protocol);
}

/* Of what waits, not of calls that find nothing. The connection goes on waiting. */
int accept4(int fd, struct sockaddr *address, socklen_t *size, int flags)
{
    struct pollfd waiting = {.fd = fd, .events = POLLIN};
    if (poll(&waiting, 1, 0) == 1 && fails(DESCRIPTOR, EMFILE))
        return -1;
    return NEXT(accept4)(fd, address, size, flags);
}

int eventfd(unsigned value, int flags)
{
    return fails(DESCRIPTOR, EMFILE) ? -1 : NEXT(eventfd)(value, flags);
}

int signalfd(int fd, const sigset_t *signals, int flags)
{
    return fails(DESCRIPTOR, EMFILE) ? -1 : NEXT(signalfd)(fd, signals, flags);
}

int epoll_create1(int flags)
{
    return fails(DESCRIPTOR, EMFILE) ? -1 : NEXT(epoll_create1)(flags);
}

/* --- connections ------------------------------------------------------------------------------------------ */

/* Whether the connection is to be lost, in both directions, as with a reset that came. */
static bool loses(enum kind kind, int fd)
{
    if (!fails(kind, ECONNRESET))
        return false;
    shutdown(fd, SHUT_RDWR);
    errno = ECONNRESET;
    return true;
}

ssize_t send(int fd, const void *data, size_t size, int flags)
{
    return loses(SEND, fd) ? -1 : NEXT(send)(fd, data, size, flags);
}

ssize_t sendmsg(int fd, const struct msghdr *message, int flags)
{
    return loses(SEND, fd) ? -1 : NEXT(sendmsg)(fd, message, flags);
}

ssize_t recv(int fd, void *data, size_t size, int flags)
{
    return loses(RECEIVE, fd) ? -1 : NEXT(recv)(fd, data, size, flags);
}

/* --- processes -------------------------------------------------------------------------------------------- */

int posix_spawn(pid_t *pid, const char *path, const posix_spawn_file_actions_t *actions,
                const posix_spawnattr_t *attributes, char *const arguments[], char *const environment[])
{
    if (fails(PROCESS, EAGAIN))
        return EAGAIN;
    return NEXT(posix_spawn)(pid, path, actions, attributes, arguments, environment);
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*function)(void *), void *argument)
{
    return fails(THREAD, EAGAIN) ? EAGAIN : NEXT(pthread_create)(thread, attributes, function, argument);
}
