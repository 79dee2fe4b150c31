/* SPDX-License-Identifier: MIT */
/* Parsing and printing of addresses. */
#include "net/address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/un.h>

static bool parse_unix(struct address *address, const char *text, const char *path, struct error *error)
{
    struct sockaddr_un local = {.sun_family = AF_UNIX};
    size_t bytes = strlen(path);
    if (path[0] != '/')
        return error_set(error, ERROR_INVALID, text, "the path of a Unix socket must begin with /");
    if (bytes >= sizeof(local.sun_path))
        return error_set(error, ERROR_INVALID, text, "the path has %zu bytes, at most %zu fit a Unix socket",
                         bytes, sizeof(local.sun_path) - 1);
    memcpy(local.sun_path, path, bytes + 1);
    memcpy(&address->storage, &local, sizeof(local));
    address->storage_bytes = (socklen_t)sizeof(local);
    return true;
}

static bool parse_tcp(struct address *address, const char *text, const char *host_port, struct error *error)
{
    const char *colon = strrchr(host_port, ':');
    if (!colon || colon == host_port || !colon[1])
        return error_set(error, ERROR_INVALID, text, "expected tcp:HOST:PORT, with an IPv6 address in brackets");
    char host[128];
    const char *first = host_port;
    size_t bytes = (size_t)(colon - host_port);
    if (bytes > 2 && first[0] == '[' && first[bytes - 1] == ']') {
        first++;
        bytes -= 2;
    } else if (memchr(first, ':', bytes)) {
        return error_set(error, ERROR_INVALID, text, "write an IPv6 address in brackets: tcp:[::1]:PORT");
    }
    if (bytes >= sizeof(host))
        return error_set(error, ERROR_INVALID, text, "the host name is too long");
    memcpy(host, first, bytes);
    host[bytes] = '\0';
    struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV};
    struct addrinfo *found = NULL;
    int result = getaddrinfo(host, colon + 1, &hints, &found);
    if (result != 0)
        return error_set(error, ERROR_INVALID, text, "%s", gai_strerror(result));
    memcpy(&address->storage, found->ai_addr, found->ai_addrlen);
    address->storage_bytes = found->ai_addrlen;
    freeaddrinfo(found);
    return true;
}

bool address_parse(struct address *address, const char *text, struct error *error)
{
    *address = (struct address){0};
    if (strncmp(text, "unix:", 5) == 0)
        return parse_unix(address, text, text + 5, error);
    if (strncmp(text, "tcp:", 4) == 0)
        return parse_tcp(address, text, text + 4, error);
    return error_set(error, ERROR_INVALID, text, "an address is unix:/PATH or tcp:HOST:PORT");
}

bool address_is_unix(const struct address *address)
{
    return address->storage.ss_family == AF_UNIX;
}

/* Address in the socket's own family, copied from the storage so that no pointer is cast. */
static struct sockaddr_in as_ipv4(const struct address *address)
{
    struct sockaddr_in ipv4;
    memcpy(&ipv4, &address->storage, sizeof(ipv4));
    return ipv4;
}

static struct sockaddr_in6 as_ipv6(const struct address *address)
{
    struct sockaddr_in6 ipv6;
    memcpy(&ipv6, &address->storage, sizeof(ipv6));
    return ipv6;
}

void address_print(const struct address *address, char text[ADDRESS_TEXT_BYTES])
{
    char host[INET6_ADDRSTRLEN] = "";
    if (address->storage.ss_family == AF_INET) {
        struct sockaddr_in ipv4 = as_ipv4(address);
        inet_ntop(AF_INET, &ipv4.sin_addr, host, sizeof(host));
        snprintf(text, ADDRESS_TEXT_BYTES, "tcp:%s:%u", host, ntohs(ipv4.sin_port));
    } else if (address->storage.ss_family == AF_INET6) {
        struct sockaddr_in6 ipv6 = as_ipv6(address);
        inet_ntop(AF_INET6, &ipv6.sin6_addr, host, sizeof(host));
        snprintf(text, ADDRESS_TEXT_BYTES, "tcp:[%s]:%u", host, ntohs(ipv6.sin6_port));
    } else {
        snprintf(text, ADDRESS_TEXT_BYTES, "unix:%s", address_path(address));
    }
}

bool address_is_loopback(const struct address *address)
{
    if (address->storage.ss_family == AF_INET)
        return ntohl(as_ipv4(address).sin_addr.s_addr) >> 24 == 127;
    if (address->storage.ss_family != AF_INET6)
        return false;
    struct in6_addr host = as_ipv6(address).sin6_addr;
    return IN6_IS_ADDR_LOOPBACK(&host) || (IN6_IS_ADDR_V4MAPPED(&host) && host.s6_addr[12] == 127);
}

const char *address_path(const struct address *address)
{
    return address_is_unix(address) ? (const char *)&address->storage + offsetof(struct sockaddr_un, sun_path)
                                    : "";
}

uint64_t address_network(const struct address *address)
{
    const uint64_t ipv4 = UINT64_C(1) << 32; /* no assigned IPv6 network begins with this prefix */
    if (address->storage.ss_family == AF_INET)
        return ipv4 | ntohl(as_ipv4(address).sin_addr.s_addr);
    if (address->storage.ss_family != AF_INET6)
        return 0;
    struct in6_addr host = as_ipv6(address).sin6_addr;
    size_t first = IN6_IS_ADDR_V4MAPPED(&host) ? 12 : 0, last = first ? 16 : 8;
    uint64_t network = first ? 1 : 0;
    for (size_t i = first; i < last; i++)
        network = network << 8 | host.s6_addr[i];
    return network;
}
