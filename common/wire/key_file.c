#include "wire/key_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sodium.h>
#include <zmq.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "wire/access_list.h"

enum { FILE_BYTES_MAX = 4 * 1024 * 1024 }; /* keys of 50,000 workers and their names */

/* --- whole files ------------------------------------------------------------------------------------------ */

/* With an access control list the group's bits are the most that the list gives to anyone. systemd hands credentials to
 * a service so: files of root that one user may read. Kubernetes gives those of a Secret, root's too, to the group of a
 * container; only root can do so. */
static bool is_secret(int descriptor, const struct stat *file)
{
    bool given_by_root = file->st_uid == 0 && geteuid() != 0;
    return !(file->st_mode & 077) ||
           (!(file->st_mode & 037) && (given_by_root || access_list_of_file_is_private(descriptor)));
}

static enum status check_file(int descriptor, const struct stat *file, const char *path, enum key_secrecy secrecy,
                              struct error *error)
{
    unsigned mode = file->st_mode & 07777;
    if (!S_ISREG(file->st_mode))
        return error_set(error, STATUS_INPUT, "%s: expected a regular file", path);
    if (secrecy == KEY_SECRET && !is_secret(descriptor, file))
        return error_set(error, STATUS_INPUT,
                         "%s: expected a secret file that only its owner can read (mode 0600), found mode %04o", path,
                         mode);
    if (mode & 022)
        return error_set(error, STATUS_INPUT,
                         "%s: expected a file that only its owner can write (mode 0644), found mode %04o", path, mode);
    if (file->st_size > FILE_BYTES_MAX)
        return error_set(error, STATUS_INPUT, "%s: expected at most %d bytes, found %lld", path, (int)FILE_BYTES_MAX,
                         (long long)file->st_size);
    return STATUS_OK;
}

/* One allocation takes it all, so that there is one place to wipe. A file that shrinks meanwhile ends earlier. */
static enum status read_descriptor(struct bytes *text, int file, const char *path, enum key_secrecy secrecy,
                                   struct error *error)
{
    struct stat info;
    if (fstat(file, &info) != 0)
        return error_set(error, STATUS_INPUT, "%s: cannot be looked up: %s", path, strerror(errno));
    enum status status = check_file(file, &info, path, secrecy, error);
    if (status != STATUS_OK)
        return status;
    size_t size = (size_t)info.st_size;
    bytes_extend(text, size + 1);
    text->size = 0;
    while (text->size < size) {
        ssize_t got = read(file, text->data + text->size, size - text->size);
        if (got < 0 && errno != EINTR)
            return error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
        if (got == 0)
            break;
        text->size += got > 0 ? (size_t)got : 0;
    }
    return STATUS_OK;
}

static void wipe(struct bytes *text)
{
    if (text->data)
        sodium_memzero(text->data, text->capacity);
    bytes_finish(text);
}

static enum status read_file(struct bytes *text, const char *path, enum key_secrecy secrecy, struct error *error)
{
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a pipe is an error, not something to wait for */
    if (file < 0)
        return error_set(error, STATUS_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    enum status status = read_descriptor(text, file, path, secrecy, error);
    close(file);
    if (status != STATUS_OK)
        wipe(text);
    return status;
}

static bool write_whole(int file, const char *text)
{
    size_t left = strlen(text);
    while (left > 0) {
        ssize_t written = write(file, text, left);
        if (written < 0 && errno != EINTR)
            return false;
        text += written > 0 ? written : 0;
        left -= written > 0 ? (size_t)written : 0;
    }
    return fsync(file) == 0;
}

enum status key_file_create(const char *path, const char *text, enum key_secrecy secrecy, struct error *error)
{
    int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, secrecy == KEY_SECRET ? 0600 : 0644);
    if (file < 0 && errno == EEXIST)
        return error_set(error, STATUS_OUTPUT, "%s: is there already, and keys are never overwritten", path);
    if (file < 0)
        return error_set(error, STATUS_OUTPUT, "%s: cannot be made: %s", path, strerror(errno));
    bool written = write_whole(file, text);
    if (!written)
        error_set(error, STATUS_OUTPUT, "%s: cannot be written: %s", path, strerror(errno));
    close(file);
    if (!written)
        unlink(path);
    return written ? STATUS_OK : STATUS_OUTPUT;
}

/* --- lines ------------------------------------------------------------------------------------------------ */

struct line_reader {
    const char *path;
    const char *at, *end;
    unsigned line; /* of the last key, from 1 */
};

static struct line_reader line_reader_of(const struct bytes *text, const char *path)
{
    const char *start = (const char *)text->data;
    return (struct line_reader){.path = path, .at = start, .end = start + text->size};
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

static const char *skip_blanks(const char *at, const char *end)
{
    while (at < end && is_blank(*at))
        at++;
    return at;
}

static enum status parse_key(const struct line_reader *reader, const char *word, size_t length, struct key *key,
                             struct error *error)
{
    char text[KEY_TEXT_BYTES] = "";
    if (length != sizeof text - 1)
        return error_set(error, STATUS_INPUT, "%s:%u: expected a key of 40 characters, found %zu", reader->path,
                         reader->line, length);
    memcpy(text, word, length);
    bool known = strlen(text) == length && zmq_z85_decode(key->bytes, text);
    sodium_memzero(text, sizeof text);
    if (known)
        return STATUS_OK;
    sodium_memzero(key, sizeof *key);
    return error_set(error, STATUS_INPUT, "%s:%u: expected a key in Z85, found 40 characters that are not",
                     reader->path, reader->line);
}

/* Takes the next line that holds a key. At the end *found becomes false. */
static enum status next_key(struct line_reader *reader, struct key *key, bool *found, struct error *error)
{
    for (*found = false; reader->at < reader->end;) {
        const char *feed = memchr(reader->at, '\n', (size_t)(reader->end - reader->at));
        const char *end = feed ? feed : reader->end, *word = skip_blanks(reader->at, end), *after = word;
        reader->at = feed ? feed + 1 : reader->end;
        reader->line++;
        if (word == end || *word == '#')
            continue;
        while (after < end && !is_blank(*after))
            after++;
        const char *rest = skip_blanks(after, end);
        if (rest < end && *rest != '#')
            return error_set(error, STATUS_INPUT, "%s:%u: expected one key, and behind it nothing or a # and a remark",
                             reader->path, reader->line);
        *found = true;
        return parse_key(reader, word, (size_t)(after - word), key, error);
    }
    return STATUS_OK;
}

static enum status take_only_key(struct line_reader *reader, struct key *key, struct error *error)
{
    bool found;
    struct key second = {{0}};
    enum status status = next_key(reader, key, &found, error);
    if (status == STATUS_OK && !found)
        return error_set(error, STATUS_INPUT, "%s: expected a key, found none in %u lines", reader->path, reader->line);
    if (status == STATUS_OK)
        status = next_key(reader, &second, &found, error);
    sodium_memzero(&second, sizeof second);
    if (status == STATUS_OK && found)
        status = error_set(error, STATUS_INPUT, "%s:%u: expected no second key", reader->path, reader->line);
    return status;
}

enum status key_file_read(struct key *key, const char *path, enum key_secrecy secrecy, struct error *error)
{
    struct bytes text = {0};
    *key = (struct key){{0}};
    enum status status = read_file(&text, path, secrecy, error);
    if (status != STATUS_OK)
        return status;
    struct line_reader reader = line_reader_of(&text, path);
    status = take_only_key(&reader, key, error);
    wipe(&text);
    if (status != STATUS_OK)
        sodium_memzero(key, sizeof *key);
    return status;
}

void key_text(const struct key *key, char text[KEY_TEXT_BYTES])
{
    zmq_z85_encode(text, key->bytes, KEY_BYTES);
}

/* --- lists ------------------------------------------------------------------------------------------------ */

enum status key_list_read(struct key_list *list, const char *path, struct error *error)
{
    struct bytes text = {0};
    enum status status = read_file(&text, path, KEY_PUBLIC, error);
    if (status != STATUS_OK)
        return status;
    struct line_reader reader = line_reader_of(&text, path);
    struct key key;
    bool found;
    while ((status = next_key(&reader, &key, &found, error)) == STATUS_OK && found) {
        list->keys = memory_grow(list->keys, &list->capacity, list->count + 1, sizeof *list->keys);
        list->keys[list->count++] = key;
    }
    bytes_finish(&text);
    if (status != STATUS_OK)
        key_list_finish(list);
    return status;
}

/* Whoever asks has shown that it holds the secret of its key, so the time that the search takes tells it nothing. */
bool key_list_has(const struct key_list *list, const struct key *key)
{
    for (size_t i = 0; i < list->count; i++)
        if (memcmp(&list->keys[i], key, sizeof *key) == 0)
            return true;
    return false;
}

void key_list_finish(struct key_list *list)
{
    free(list->keys);
    *list = (struct key_list){0};
}
