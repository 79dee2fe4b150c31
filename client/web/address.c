/* SPDX-License-Identifier: MIT */
/* Addresses of the page, and names that browsers may use for it. */
#include "web/address.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define PORT_MAX 65535

/* Splits "HOST:PORT", "[HOST]:PORT" and both without a port; false: invalid. *port is the text after the colon;
 * NULL: none. */
static bool split(const char *text, char *host, size_t host_bytes, const char **port)
{
    const bool has_brackets = text[0] == '[';
    const char *begin = text + has_brackets, *end = strchr(begin, has_brackets ? ']' : ':');
    const char *behind = end ? end + has_brackets : begin + strlen(begin);
    if ((has_brackets && !end) || (*behind != '\0' && *behind != ':'))
        return false;
    const size_t length = (size_t)((end ? end : behind) - begin);
    if (length == 0 || length >= host_bytes)
        return false;
    memcpy(host, begin, length);
    host[length] = '\0';
    *port = *behind == ':' ? behind + 1 : NULL;
    return true;
}

static int read_port(const char *text)
{
    const size_t length = text ? strlen(text) : 0;
    if (length == 0 || length > 5 || strspn(text, "0123456789") != length)
        return -1;
    const int port = atoi(text);
    return port <= PORT_MAX ? port : -1;
}

static bool read_digits(const char *host, bool has_brackets, struct in_addr *four, struct in6_addr *six)
{
    return has_brackets ? inet_pton(AF_INET6, host, six) == 1 : inet_pton(AF_INET, host, four) == 1;
}

bool web_address_read(const char *text, struct web_address *address, struct fl_error *error)
{
    struct in_addr four = {0};
    struct in6_addr six = {0};
    const char *port = NULL;
    *address = (struct web_address){.is_v6 = text[0] == '['};
    if (!split(text, address->host, sizeof(address->host), &port) || (address->port = read_port(port)) < 0) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--listen", "'%s' is not HOST:PORT", text);
        return fl_error_remedy(error, "as in 127.0.0.1:8080 or [::1]:8080");
    }
    if (strcmp(address->host, "localhost") == 0)
        snprintf(address->host, sizeof(address->host), "127.0.0.1");
    if (!read_digits(address->host, address->is_v6, &four, &six)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--listen", "'%s' is no address in digits", address->host);
        return fl_error_remedy(error, "as in 127.0.0.1:8080, [::1]:8080, or [::]:8080 for all of this machine");
    }
    const bool is_four_in_six = address->is_v6 && IN6_IS_ADDR_V4MAPPED(&six);
    if (is_four_in_six)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--listen", "'%s' is an IPv4 address: write it as one",
                            text);
    address->is_loopback = address->is_v6 ? IN6_IS_ADDR_LOOPBACK(&six) : ntohl(four.s_addr) >> 24 == 127;
    address->is_any = address->is_v6 ? IN6_IS_ADDR_UNSPECIFIED(&six) : four.s_addr == INADDR_ANY;
    return true;
}

void web_address_print(const struct web_address *address, char *text, size_t text_bytes)
{
    snprintf(text, text_bytes, address->is_v6 ? "[%s]" : "%s", address->host);
}

bool web_host_is_ours(const char *host, const char *const *names, size_t name_count)
{
    char name[256];
    const char *port = NULL;
    struct in_addr four;
    struct in6_addr six;
    if (!split(host, name, sizeof(name), &port) || (port && read_port(port) < 0))
        return false;
    if (read_digits(name, host[0] == '[', &four, &six))
        return true;
    if (host[0] == '[')
        return false;
    for (size_t i = 0; i < name_count; i++)
        if (strcasecmp(name, names[i]) == 0)
            return true;
    return strcasecmp(name, "localhost") == 0;
}
