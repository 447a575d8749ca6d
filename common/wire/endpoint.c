#include "wire/socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <sys/un.h>

#include "wire/socket_private.h"

enum {
    HOST_BYTES = 256,                                           /* with the NUL; DNS names end at 253 */
    IPC_PATH_MAX = sizeof(((struct sockaddr_un *)0)->sun_path) - 1, /* 107 */
};

static enum status refuse(struct error *error, const char *text, const char *why)
{
    return error_set(error, STATUS_USAGE, "endpoint \"%s\": %s", text, why);
}

/* "*" and a leading "@" mean something else than a path to ZeroMQ. */
static enum status parse_ipc(const char *text, char *endpoint, struct error *error)
{
    const char *path = text + strlen("ipc://");
    if (*path == '\0' || *path == '@' || strcmp(path, "*") == 0)
        return refuse(error, text, "expected a path after ipc://");
    if (strlen(path) > IPC_PATH_MAX)
        return error_set(error, STATUS_USAGE, "endpoint \"%s\": expected a path of at most %d bytes, found %zu",
                         text, (int)IPC_PATH_MAX, strlen(path));
    snprintf(endpoint, WIRE_ENDPOINT_BYTES, "%s", text);
    return STATUS_OK;
}

/* The literal between the brackets, perhaps with an interface's name after a '%'. */
static bool is_ipv6(const char *literal)
{
    char address[INET6_ADDRSTRLEN];
    size_t length = strcspn(literal, "%");
    if (length >= sizeof address || strspn(literal + length, "%") > 1)
        return false;
    memcpy(address, literal, length);
    address[length] = '\0';
    struct in6_addr unused;
    return inet_pton(AF_INET6, address, &unused) == 1;
}

static bool is_name(const char *host)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
    return *host && !strchr("-._", *host) && strspn(host, letters) == strlen(host);
}

static bool is_port(const char *port)
{
    size_t digits = strspn(port, "0123456789");
    if (strcmp(port, "*") == 0)
        return true;
    return digits >= 1 && digits <= 5 && port[digits] == '\0' && *port != '0' && atoi(port) <= 65535;
}

/* Cuts HOST[:PORT] at its colon, the one behind the bracket if there is a bracket. *port is "" without one. */
static bool split(const char *text, char host[HOST_BYTES], const char **port)
{
    const char *bracket = *text == '[' ? strchr(text, ']') : NULL;
    const char *colon = bracket ? bracket + 1 : strchrnul(text, ':');
    size_t length = (size_t)(colon - text);
    if (length >= HOST_BYTES || (*colon != ':' && *colon != '\0'))
        return false;
    memcpy(host, text, length);
    host[length] = '\0';
    *port = *colon ? colon + 1 : "";
    return true;
}

static bool host_is_known_form(char *host)
{
    size_t length = strlen(host);
    if (*host != '[')
        return strcmp(host, "*") == 0 || is_name(host);
    host[length - 1] = '\0';
    bool known = is_ipv6(host + 1);
    host[length - 1] = ']';
    return known;
}

static enum status parse_tcp(const char *text, const char *host_port, const char *port_default, char *endpoint,
                             struct error *error)
{
    char host[HOST_BYTES];
    const char *port;
    if (*host_port != '[' && is_ipv6(host_port))
        return refuse(error, text, "an IPv6 address goes in brackets, as in [::1]:7420");
    if (strstr(host_port, "://") || !split(host_port, host, &port) || !host_is_known_form(host))
        return refuse(error, text, "expected tcp://HOST:PORT, HOST:PORT, HOST or ipc://PATH");
    if (host_port[strlen(host)] == '\0')
        port = port_default;
    if (!is_port(port))
        return refuse(error, text, "expected a port from 1 to 65535, or * for any free one");
    snprintf(endpoint, WIRE_ENDPOINT_BYTES, "tcp://%s:%s", strcmp(host, "localhost") == 0 ? "127.0.0.1" : host,
             port);
    return STATUS_OK;
}

enum status wire_endpoint_parse(const char *text, char endpoint[WIRE_ENDPOINT_BYTES], struct error *error)
{
    char port_default[8];
    snprintf(port_default, sizeof port_default, "%d", WIRE_PORT_DEFAULT);
    if (wire_endpoint_is_ipc(text))
        return parse_ipc(text, endpoint, error);
    if (strncmp(text, "tcp://", 6) == 0)
        return parse_tcp(text, text + 6, "", endpoint, error);
    return parse_tcp(text, text, port_default, endpoint, error);
}

bool wire_endpoint_is_ipc(const char *endpoint)
{
    return strncmp(endpoint, "ipc://", 6) == 0;
}

bool wire_endpoint_is_local(const char *endpoint)
{
    char host[HOST_BYTES];
    const char *port;
    struct in_addr address;
    if (wire_endpoint_is_ipc(endpoint))
        return true;
    if (strncmp(endpoint, "tcp://", 6) != 0 || !split(endpoint + 6, host, &port))
        return false;
    if (strcmp(host, "localhost") == 0 || strcmp(host, "[::1]") == 0)
        return true;
    return inet_pton(AF_INET, host, &address) == 1 && ntohl(address.s_addr) >> 24 == 127;
}

bool wire_endpoint_name(const char *endpoint, char *name)
{
    char host[HOST_BYTES];
    const char *port;
    struct in_addr address;
    if (strncmp(endpoint, "tcp://", 6) != 0 || !split(endpoint + 6, host, &port) || strcmp(port, "*") == 0)
        return false;
    snprintf(name, WIRE_ENDPOINT_BYTES, "%s", host);
    return is_name(host) && inet_pton(AF_INET, host, &address) != 1;
}

void wire_host_name(char *name, size_t size)
{
    if (gethostname(name, size) != 0)
        snprintf(name, size, "unknown");
    name[size - 1] = '\0';
}
