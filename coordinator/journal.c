#include "coordinator/journal.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <sodium.h>

#include "base/log.h"
#include "base/memory.h"

enum {
    VERSION = 2,
    HEAD_BYTES = 8 + 4 + 3 * DIGEST_BYTES,   /* magic, version, key */
    BAND_HEAD_BYTES = 2 + 2 + 4 + 4 + 8 + 8, /* pass, undone, first row, rows, lease_ms, size */
    TAG_BYTES = crypto_generichash_KEYBYTES_MIN,
    SYNC_SECONDS = 1,
};

static const char magic[] = "weftjrnl"; /* its NUL is not written */

struct journal {
    char *path, *output;
    int lock_fd; /* of the file beside the output */
    int fd;      /* of the same, or of a file without a name */
    bool resumes;
    uint64_t begin;            /* of the first band, */
    uint8_t begin_tag[TAG_BYTES]; /* and the tag before it */
    uint64_t end;              /* of what is written and believed */
    uint64_t last;             /* where the band begins that journal_next gave last, */
    uint8_t last_tag[TAG_BYTES]; /* and the tag before it */
    uint8_t tag[TAG_BYTES];    /* of the last band */

    pthread_t syncer;
    bool syncer_started;
    pthread_mutex_t mutex; /* guards what follows */
    pthread_cond_t changed;
    bool dirty, ending;
    int failure; /* errno of an fsync that failed */
};

static enum status fail(const struct journal *j, const char *doing, int number, struct error *error)
{
    return error_set(error, STATUS_OUTPUT, "%s: its journal %s %s: %s", j->output, j->path, doing, strerror(number));
}

/* --- files ------------------------------------------------------------------------------------------------ */

static enum status write_all(const struct journal *j, uint64_t offset, const void *data, size_t size,
                             struct error *error)
{
    const uint8_t *bytes = data;
    while (size > 0) {
        ssize_t written = pwrite(j->fd, bytes, size, (off_t)offset);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return fail(j, "cannot be written", errno, error);
        bytes += written;
        size -= (size_t)written;
        offset += (uint64_t)written;
    }
    return STATUS_OK;
}

enum status journal_read(const struct journal *j, uint64_t offset, void *data, size_t size, struct error *error)
{
    uint8_t *bytes = data;
    while (size > 0) {
        ssize_t got = pread(j->fd, bytes, size, (off_t)offset);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return fail(j, "cannot be read back", got < 0 ? errno : ENODATA, error);
        bytes += got;
        size -= (size_t)got;
        offset += (uint64_t)got;
    }
    return STATUS_OK;
}

static char *path_beside(const char *output)
{
    const char *slash = strrchr(output, '/'), *name = slash ? slash + 1 : output;
    return memory_format("%.*s.%s.journal", (int)(name - output), output, name);
}

/* Whether the file that is open is still the one of that name, and not one that its last holder has removed. */
static bool is_at(const char *path, int fd)
{
    struct stat open_file, named;
    return fstat(fd, &open_file) == 0 && stat(path, &named) == 0 && open_file.st_dev == named.st_dev &&
           open_file.st_ino == named.st_ino;
}

/* Some file systems cannot lock; that is said, and no reason not to render. */
static enum status lock(const struct journal *j, struct error *error)
{
    if (flock(j->lock_fd, LOCK_EX | LOCK_NB) == 0)
        return STATUS_OK;
    if (errno == EWOULDBLOCK)
        return error_set(error, STATUS_OUTPUT, "%s: another weft is rendering it (%s is locked)", j->output, j->path);
    log_warning("%s cannot be locked (%s): nothing keeps another weft from rendering to the same file", j->path,
                strerror(errno));
    return STATUS_OK;
}

static enum status open_locked(struct journal *j, struct error *error)
{
    for (;;) {
        j->lock_fd = open(j->path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (j->lock_fd < 0)
            return error_set(error, STATUS_OUTPUT, "%s: cannot open the journal %s beside it: %s", j->output, j->path,
                             strerror(errno));
        enum status status = lock(j, error);
        if (status != STATUS_OK || is_at(j->path, j->lock_fd))
            return status;
        close(j->lock_fd);
    }
}

/* In the output's folder, for there is room for it if there is room for the output. */
static enum status open_nameless(struct journal *j, struct error *error)
{
    char *name = memory_format("%s.XXXXXX", j->path);
    j->fd = mkostemp(name, O_CLOEXEC);
    int number = errno;
    if (j->fd >= 0)
        unlink(name);
    free(name);
    return j->fd >= 0 ? STATUS_OK : fail(j, "cannot have a file beside it for rows that wait", number, error);
}

/* --- the thread that brings bands to disk ----------------------------------------------------------------- */

/* Waits until something is to be brought to disk. False: no more. */
static bool wait_until_dirty(struct journal *j)
{
    pthread_mutex_lock(&j->mutex);
    while (!j->dirty && !j->ending)
        pthread_cond_wait(&j->changed, &j->mutex);
    bool more = j->dirty && !j->ending;
    j->dirty = false;
    pthread_mutex_unlock(&j->mutex);
    return more;
}

static void pause_syncing(struct journal *j)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += SYNC_SECONDS;
    pthread_mutex_lock(&j->mutex);
    while (!j->ending && pthread_cond_timedwait(&j->changed, &j->mutex, &until) == 0)
        continue;
    pthread_mutex_unlock(&j->mutex);
}

static void *sync_bands(void *argument)
{
    struct journal *j = argument;
    while (wait_until_dirty(j)) {
        if (fdatasync(j->fd) != 0) {
            pthread_mutex_lock(&j->mutex);
            j->failure = errno;
            pthread_mutex_unlock(&j->mutex);
        }
        pause_syncing(j);
    }
    return NULL;
}

static void end_syncer(struct journal *j)
{
    if (!j->syncer_started)
        return;
    pthread_mutex_lock(&j->mutex);
    j->ending = true;
    pthread_cond_signal(&j->changed);
    pthread_mutex_unlock(&j->mutex);
    pthread_join(j->syncer, NULL);
}

static enum status note_written(struct journal *j, struct error *error)
{
    if (!j->syncer_started) {
        int number = pthread_create(&j->syncer, NULL, sync_bands, j);
        if (number != 0)
            return error_set(error, STATUS_INTERNAL, "cannot start a thread for the journal: %s", strerror(number));
        j->syncer_started = true;
    }
    pthread_mutex_lock(&j->mutex);
    j->dirty = true;
    int failure = j->failure;
    pthread_cond_signal(&j->changed);
    pthread_mutex_unlock(&j->mutex);
    return failure == 0 ? STATUS_OK : fail(j, "cannot be brought to disk", failure, error);
}

/* --- opening ---------------------------------------------------------------------------------------------- */

static void put_head(const struct journal_key *key, struct bytes *head)
{
    bytes_put(head, magic, strlen(magic));
    bytes_put_u32(head, VERSION);
    bytes_put(head, key->program.bytes, DIGEST_BYTES);
    bytes_put(head, key->scene.bytes, DIGEST_BYTES);
    bytes_put(head, key->settings.bytes, DIGEST_BYTES);
}

/* In what the head that was found differs from the one expected; NULL: in nothing. */
static const char *difference(const uint8_t *found, const uint8_t *expected)
{
    size_t key = HEAD_BYTES - 3 * DIGEST_BYTES;
    if (memcmp(found, expected, key + DIGEST_BYTES) != 0)
        return "was written by another version of weft";
    if (memcmp(found + key + DIGEST_BYTES, expected + key + DIGEST_BYTES, DIGEST_BYTES) != 0)
        return "is of another scene, or a file that the scene reaches has changed";
    if (memcmp(found, expected, HEAD_BYTES) != 0)
        return "is of a render with other settings";
    return NULL;
}

/* Whether the journal begins as expected; if it does otherwise, why it cannot be used is said. */
static bool has_head(const struct journal *j, const struct bytes *expected)
{
    uint8_t found[HEAD_BYTES];
    struct error error;
    struct stat info;
    if (fstat(j->fd, &info) != 0 || info.st_size == 0)
        return false;
    const char *what = "is broken";
    if (info.st_size >= HEAD_BYTES && journal_read(j, 0, found, sizeof found, &error) == STATUS_OK)
        what = difference(found, expected->data);
    if (what)
        log_warning("%s: its journal %s; starting anew", j->output, what);
    return !what;
}

static enum status begin(struct journal *j, const struct journal_key *key, struct error *error)
{
    struct bytes head = {0};
    enum status status = STATUS_OK;
    put_head(key, &head);
    crypto_generichash(j->begin_tag, TAG_BYTES, head.data, head.size, NULL, 0);
    memcpy(j->tag, j->begin_tag, TAG_BYTES);
    j->begin = j->end = head.size;
    if (!has_head(j, &head)) {
        status = ftruncate(j->fd, 0) == 0 ? STATUS_OK : fail(j, "cannot be emptied", errno, error);
        if (status == STATUS_OK)
            status = write_all(j, 0, head.data, head.size, error);
    }
    bytes_finish(&head);
    return status;
}

bool journal_is_left(const char *output, const struct journal_key *key)
{
    struct bytes expected = {0};
    uint8_t found[HEAD_BYTES];
    char *path = path_beside(output);
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    put_head(key, &expected);
    bool same = file >= 0 && pread(file, found, sizeof found, 0) == HEAD_BYTES &&
                memcmp(found, expected.data, sizeof found) == 0;
    if (file >= 0)
        close(file);
    bytes_finish(&expected);
    free(path);
    return same;
}

static void init_waiting(struct journal *j)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&j->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&j->mutex, NULL);
}

struct journal *journal_open(const char *output, const struct journal_key *key, bool resume, enum status *status,
                             struct error *error)
{
    struct journal *j = memory_array(1, sizeof *j);
    j->output = memory_string(output);
    j->path = path_beside(output);
    j->lock_fd = j->fd = -1;
    j->resumes = resume;
    init_waiting(j);
    *status = open_locked(j, error);
    if (*status == STATUS_OK && resume) {
        j->fd = j->lock_fd;
        *status = begin(j, key, error);
    } else if (*status == STATUS_OK) {
        *status = open_nameless(j, error);
    }
    if (*status != STATUS_OK)
        journal_close(&j, false);
    return j;
}

/* --- what an earlier run left ----------------------------------------------------------------------------- */

static void put_band_head(const struct journal_band *band, struct bytes *bytes)
{
    bytes_put_u16(bytes, (uint16_t)band->pass);
    bytes_put_u16(bytes, band->undone);
    bytes_put_u32(bytes, band->first_row);
    bytes_put_u32(bytes, band->rows);
    bytes_put_u64(bytes, band->lease_ms);
    bytes_put_u64(bytes, band->size);
}

static struct journal_band band_of_head(const uint8_t *head, uint64_t offset)
{
    struct byte_reader reader = byte_reader_of(head, BAND_HEAD_BYTES);
    struct journal_band band = {.pass = (enum render_pass)byte_reader_u16(&reader)};
    band.undone = byte_reader_u16(&reader) != 0;
    band.first_row = byte_reader_u32(&reader);
    band.rows = byte_reader_u32(&reader);
    band.lease_ms = byte_reader_u64(&reader);
    band.size = byte_reader_u64(&reader);
    band.offset = offset;
    return band;
}

/* Of a band as it is written, but for the tag: head and bytes. */
static void tag_of(const struct journal *j, const struct bytes *written, uint8_t tag[TAG_BYTES])
{
    crypto_generichash(tag, TAG_BYTES, written->data, written->size, j->tag, TAG_BYTES);
}

/* Reads the band at `end`, where `left` bytes are left. False if it is not whole or not as it was written. */
static bool read_band(struct journal *j, uint64_t left, struct journal_band *band, struct bytes *data)
{
    uint8_t *head = bytes_extend(data, BAND_HEAD_BYTES), found[TAG_BYTES], expected[TAG_BYTES];
    struct error error;
    if (left < BAND_HEAD_BYTES + TAG_BYTES || journal_read(j, j->end, head, BAND_HEAD_BYTES, &error) != STATUS_OK)
        return false;
    *band = band_of_head(head, j->end + BAND_HEAD_BYTES);
    if (band->size > left - BAND_HEAD_BYTES - TAG_BYTES)
        return false;
    uint8_t *bytes = bytes_extend(data, band->size);
    if (journal_read(j, band->offset, bytes, band->size, &error) != STATUS_OK ||
        journal_read(j, band->offset + band->size, found, TAG_BYTES, &error) != STATUS_OK)
        return false;
    tag_of(j, data, expected);
    return memcmp(found, expected, TAG_BYTES) == 0;
}

static void cut(struct journal *j)
{
    if (ftruncate(j->fd, (off_t)j->end) != 0)
        log_warning("%s: cannot be cut after its last whole band: %s", j->path, strerror(errno));
}

bool journal_next(struct journal *j, struct journal_band *band, struct bytes *data)
{
    struct stat info;
    data->size = 0;
    if (!j->resumes || fstat(j->fd, &info) != 0 || (uint64_t)info.st_size <= j->end)
        return false;
    if (!read_band(j, (uint64_t)info.st_size - j->end, band, data)) {
        log_warning("%s: the last %llu bytes of its journal are not whole bands; they are dropped", j->output,
                    (unsigned long long)((uint64_t)info.st_size - j->end));
        cut(j);
        return false;
    }
    j->last = j->end;
    memcpy(j->last_tag, j->tag, TAG_BYTES);
    tag_of(j, data, j->tag);
    j->end = band->offset + band->size + TAG_BYTES;
    memmove(data->data, data->data + BAND_HEAD_BYTES, band->size);
    data->size = band->size;
    return true;
}

void journal_reject(struct journal *j)
{
    log_warning("%s: a band in its journal does not fit the picture; it and all behind it are dropped", j->output);
    j->end = j->last;
    memcpy(j->tag, j->last_tag, TAG_BYTES);
    cut(j);
}

/* --- writing ---------------------------------------------------------------------------------------------- */

/* Appends an entry as it is written. `tag`: of the entry before it, and then of this one. */
static void put_entry(const struct journal_band *band, const uint8_t *data, uint8_t tag[TAG_BYTES], struct bytes *to)
{
    size_t begin = to->size;
    uint8_t next[TAG_BYTES];
    put_band_head(band, to);
    bytes_put(to, data, band->size);
    crypto_generichash(next, TAG_BYTES, to->data + begin, to->size - begin, tag, TAG_BYTES);
    memcpy(tag, next, TAG_BYTES);
    bytes_put(to, tag, TAG_BYTES);
}

/* Entries, the last of which has that tag. */
static enum status append(struct journal *j, const struct bytes *entries, const uint8_t tag[TAG_BYTES],
                          struct error *error)
{
    enum status status = write_all(j, j->end, entries->data, entries->size, error);
    if (status != STATUS_OK)
        return status;
    memcpy(j->tag, tag, TAG_BYTES);
    j->end += entries->size;
    return STATUS_OK;
}

enum status journal_add(struct journal *j, struct journal_band *band, const uint8_t *data, struct error *error)
{
    struct bytes entry = {0};
    uint8_t tag[TAG_BYTES];
    memcpy(tag, j->tag, TAG_BYTES);
    put_entry(band, data, tag, &entry);
    band->offset = j->end + BAND_HEAD_BYTES;
    enum status status = append(j, &entry, tag, error);
    if (status == STATUS_OK && j->resumes)
        status = note_written(j, error);
    bytes_finish(&entry);
    return status;
}

static enum status sync_now(const struct journal *j, struct error *error)
{
    return !j->resumes || fdatasync(j->fd) == 0 ? STATUS_OK : fail(j, "cannot be brought to disk", errno, error);
}

enum status journal_undo(struct journal *j, const struct journal_band *bands, size_t count, struct error *error)
{
    struct bytes entries = {0};
    uint8_t tag[TAG_BYTES];
    memcpy(tag, j->tag, TAG_BYTES);
    for (size_t i = 0; i < count; i++) {
        const struct journal_band undone = {.undone = true, .pass = bands[i].pass, .first_row = bands[i].first_row,
                                            .rows = bands[i].rows};
        put_entry(&undone, NULL, tag, &entries);
    }
    enum status status = append(j, &entries, tag, error);
    bytes_finish(&entries);
    return status == STATUS_OK ? sync_now(j, error) : status;
}

enum status journal_clear(struct journal *j, struct error *error)
{
    if (ftruncate(j->fd, (off_t)j->begin) != 0)
        return fail(j, "cannot be emptied", errno, error);
    j->end = j->begin;
    memcpy(j->tag, j->begin_tag, TAG_BYTES);
    return sync_now(j, error);
}

/* Whether a later run could go on from nothing that is in the file. */
static bool is_empty(const struct journal *j)
{
    struct stat info;
    return fstat(j->lock_fd, &info) == 0 && info.st_size <= (j->resumes ? HEAD_BYTES : 0);
}

/* The file, while it is still locked. */
static void leave_file(const struct journal *j, bool done)
{
    if ((done && j->resumes) || is_empty(j))
        unlink(j->path);
    else if (j->resumes && fdatasync(j->fd) != 0)
        log_warning("%s: cannot be brought to disk: %s", j->path, strerror(errno));
}

void journal_close(struct journal **pointer, bool done)
{
    struct journal *j = *pointer;
    if (!j)
        return;
    end_syncer(j);
    if (j->fd >= 0) /* else it could not be opened, or is another's */
        leave_file(j, done);
    if (j->fd >= 0 && j->fd != j->lock_fd)
        close(j->fd);
    if (j->lock_fd >= 0)
        close(j->lock_fd);
    pthread_cond_destroy(&j->changed);
    pthread_mutex_destroy(&j->mutex);
    free(j->path);
    free(j->output);
    free(j);
    *pointer = NULL;
}
