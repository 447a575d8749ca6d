#include "coordinator/http_token.h"

#include <ctype.h>
#include <fcntl.h>
#include <errno.h>
#include <sodium.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static enum status check_file(const char *path, const struct stat *info, struct error *error)
{
    unsigned mode = info->st_mode & 07777;
    if (!S_ISREG(info->st_mode))
        return error_set(error, STATUS_INPUT, "%s: expected a file with a token, found something else", path);
    if (mode & 077)
        return error_set(error, STATUS_INPUT,
                         "%s: expected a token that only its owner can read (mode 0600), found mode %04o", path, mode);
    return STATUS_OK;
}

/* Without the end of its line. */
static enum status take_token(const char *path, char *text, struct http_token *token, struct error *error)
{
    size_t length = strcspn(text, "\r\n");
    if (text[length + strspn(text + length, "\r\n")] != '\0')
        return error_set(error, STATUS_INPUT, "%s: expected a token on one line, found more", path);
    text[length] = '\0';
    size_t good = 0;
    while (isalnum((unsigned char)text[good]) || (text[good] && strchr("-._~+/=", text[good])))
        good++;
    if (good < length)
        return error_set(error, STATUS_INPUT, "%s: expected a token of letters, digits and -._~+/=, "
                         "found another character at %zu", path, good + 1);
    if (length < HTTP_TOKEN_LEAST || length > HTTP_TOKEN_MOST)
        return error_set(error, STATUS_INPUT, "%s: expected a token of %d to %d characters, found %zu", path,
                         HTTP_TOKEN_LEAST, HTTP_TOKEN_MOST, length);
    token->digest = digest_of(text, length);
    return STATUS_OK;
}

enum status http_token_read(const char *path, struct http_token *token, struct error *error)
{
    char text[HTTP_TOKEN_MOST + 64] = "";
    struct stat info;
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    enum status status = STATUS_OK;
    if (fstat(file, &info) != 0)
        status = error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    if (status == STATUS_OK)
        status = check_file(path, &info, error);
    if (status == STATUS_OK && read(file, text, sizeof text - 1) < 0)
        status = error_set(error, STATUS_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    close(file);
    if (status == STATUS_OK)
        status = take_token(path, text, token, error);
    sodium_memzero(text, sizeof text);
    return status;
}

bool http_token_matches(const struct http_token *token, const char *authorization)
{
    static const char scheme[] = "Bearer ";
    if (!authorization || strncasecmp(authorization, scheme, strlen(scheme)) != 0)
        return false;
    const char *shown = authorization + strlen(scheme);
    struct digest digest = digest_of(shown, strlen(shown));
    return sodium_memcmp(digest.bytes, token->digest.bytes, DIGEST_BYTES) == 0;
}
