#include "coordinator/http_address.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "base/options.h"

enum { HOST_BYTES = 64 };

/* --- text to address -------------------------------------------------------------------------------------- */

/* Splits at the last colon, and takes brackets from the host; false: the host is too long, or its brackets are odd. */
static bool split(const char *text, char host[HOST_BYTES], const char **port)
{
    const char *colon = strrchr(text, ':');
    size_t length = colon ? (size_t)(colon - text) : 0;
    *port = colon ? colon + 1 : text;
    bool bracketed = length >= 2 && text[0] == '[' && text[length - 1] == ']';
    if (bracketed) {
        text++;
        length -= 2;
    }
    if (length >= HOST_BYTES)
        return false;
    memcpy(host, text, length);
    host[length] = '\0';
    return bracketed == (strchr(host, ':') != NULL);
}

static bool set_host(struct http_address *address, const char *host, uint16_t port)
{
    struct sockaddr_in *four = (struct sockaddr_in *)&address->socket;
    struct sockaddr_in6 *six = (struct sockaddr_in6 *)&address->socket;
    *address = (struct http_address){.size = sizeof *four};
    if (!*host || strcasecmp(host, "localhost") == 0)
        host = "127.0.0.1";
    else if (strcmp(host, "*") == 0)
        host = "0.0.0.0";
    four->sin_family = AF_INET;
    four->sin_port = htons(port);
    if (inet_pton(AF_INET, host, &four->sin_addr) == 1)
        return true;
    *address = (struct http_address){.size = sizeof *six};
    six->sin6_family = AF_INET6;
    six->sin6_port = htons(port);
    return inet_pton(AF_INET6, host, &six->sin6_addr) == 1;
}

enum status http_address_parse(const char *text, struct http_address *address, struct error *error)
{
    char host[HOST_BYTES];
    const char *port;
    int64_t number;
    if (!split(text, host, &port) || !set_host(address, host, 0))
        return error_set(error, STATUS_USAGE,
                         "--http: expected PORT, or ADDR:PORT with an IPv4 address, an IPv6 address in brackets, "
                         "localhost or *, found \"%s\"", text);
    enum status status = options_integer("--http: the port", port, 0, 65535, &number, error);
    if (status == STATUS_OK)
        set_host(address, host, (uint16_t)number);
    return status;
}

/* --- addresses -------------------------------------------------------------------------------------------- */

static bool is_loopback(const struct sockaddr_storage *socket)
{
    if (socket->ss_family == AF_INET)
        return ntohl(((const struct sockaddr_in *)socket)->sin_addr.s_addr) >> 24 == 127;
    return IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)socket)->sin6_addr);
}

bool http_address_is_local(const struct http_address *address)
{
    return is_loopback(&address->socket);
}

void http_address_url(const struct http_address *address, char url[HTTP_URL_BYTES])
{
    char host[INET6_ADDRSTRLEN] = "";
    if (address->socket.ss_family == AF_INET) {
        const struct sockaddr_in *four = (const struct sockaddr_in *)&address->socket;
        inet_ntop(AF_INET, &four->sin_addr, host, sizeof host);
        snprintf(url, HTTP_URL_BYTES, "http://%s:%u/", host, ntohs(four->sin_port));
    } else {
        const struct sockaddr_in6 *six = (const struct sockaddr_in6 *)&address->socket;
        inet_ntop(AF_INET6, &six->sin6_addr, host, sizeof host);
        snprintf(url, HTTP_URL_BYTES, "http://[%s]:%u/", host, ntohs(six->sin6_port));
    }
}

int http_address_listen(struct http_address *address, struct error *error)
{
    enum { BACKLOG = 64 };
    const int one = 1;
    char url[HTTP_URL_BYTES];
    int file = socket(address->socket.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (file >= 0 && setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) == 0 &&
        bind(file, (const struct sockaddr *)&address->socket, address->size) == 0 && listen(file, BACKLOG) == 0 &&
        getsockname(file, (struct sockaddr *)&address->socket, &address->size) == 0)
        return file;
    int reason = errno;
    http_address_url(address, url);
    error_set(error, STATUS_FAILED, "--http: cannot listen at %s: %s", url,
              reason == EADDRINUSE ? "another program does already; choose another port" : strerror(reason));
    if (file >= 0)
        close(file);
    return -1;
}

/* --- the Host of a request -------------------------------------------------------------------------------- */

/* "NAME" or "NAME:PORT"; an IPv6 address is in brackets. Without the port into name[]; false: it is none of these. */
static bool take_name(const char *host, char name[HOST_BYTES])
{
    const char *end = *host == '[' ? strchr(host, ']') : host + strcspn(host, ":");
    if (!end)
        return false;
    host += *host == '[';
    size_t length = (size_t)(end - host);
    const char *rest = end + (*end == ']');
    if (length >= HOST_BYTES || (*rest && (*rest != ':' || rest[1 + strspn(rest + 1, "0123456789")])))
        return false;
    memcpy(name, host, length);
    name[length] = '\0';
    return true;
}

bool http_host_is_local(const char *host)
{
    char name[HOST_BYTES];
    struct http_address address;
    if (!host || !take_name(host, name) || !*name || strcmp(name, "*") == 0)
        return false;
    return set_host(&address, name, 0) && is_loopback(&address.socket);
}
